"""Settings that the tuner found, kept in ``tuned.json``: by controller and task, each number by its path within the settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from agents.files import read_json

FILE = Path(__file__).with_name("tuned.json")

Settings = TypeVar("Settings")


def with_values(settings: Settings, values: Mapping[str, float]) -> Settings:
    """Settings with numbers replaced, each named by its path: ``weights.heading`` is ``settings.weights.heading``.

    Raises
    ------
    ValueError
        If there is no such number, or it is outside its range.
    """
    own: dict[str, Any] = {}
    parts: dict[str, dict[str, float]] = {}
    for path, value in values.items():
        name, _, rest = path.partition(".")
        if not hasattr(settings, name):
            raise ValueError(f"{type(settings).__name__} has no {name!r}")
        if rest:
            parts.setdefault(name, {})[rest] = value
        else:
            own[name] = value
    for name, inner in parts.items():
        own[name] = with_values(getattr(settings, name), inner)
    return replace(settings, **own)  # type: ignore[type-var]


def value_at(settings: Any, path: str) -> float | None:
    """The number at a path, or None where there is none yet."""
    for name in path.split("."):
        settings = getattr(settings, name)
    return None if settings is None else float(settings)


@lru_cache(maxsize=1)
def all_tuned() -> dict[str, dict[str, dict[str, float]]]:
    """What ``tuned.json`` holds: controller, task, path, number."""
    found = read_json(FILE)
    if not isinstance(found, dict):
        raise ValueError(f"{FILE.name} must hold an object, not {type(found).__name__}")
    return found


def tuned(controller: str, task: str, settings: Settings) -> Settings:
    """Settings as tuned for a task; as they are for one without tuning."""
    return with_values(settings, all_tuned().get(controller, {}).get(task, {}))
