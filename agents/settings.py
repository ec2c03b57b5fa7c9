"""The settings that come with the package, of controllers and learners alike: ``settings.json`` holds them by agent and task.

Each value stands under its path within the agent's settings, as ``weights.heading``; whatever is not there has the default of the agent's class.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from lean_yaw_env.files import read_json, write_json

FILE = Path(__file__).with_name("settings.json")

Settings = TypeVar("Settings")
Values = dict[str, Any]
"""Numbers, words and lists by their paths."""


def tuned(agent: str, task: str, settings: Settings) -> Settings:
    """Settings with the values that come with the package for an agent at a task; as they are where there are none."""
    return with_values(settings, all_settings().get(agent, {}).get(task, {}))


@lru_cache(maxsize=1)
def all_settings() -> dict[str, dict[str, Values]]:
    """What ``settings.json`` holds: agent, task, path, value."""
    found = read_json(FILE)
    if not isinstance(found, dict):
        raise ValueError(f"{FILE.name} must hold an object, got {type(found).__name__}")
    return found


def keep_settings(agent: str, task: str, values: Mapping[str, Any]) -> Path:
    """Put values in place of those that come with the package for an agent at a task; return the file."""
    kept = {name: dict(tasks) for name, tasks in all_settings().items()}
    kept.setdefault(agent, {})[task] = dict(values)
    write_json(FILE, kept)
    all_settings.cache_clear()
    return FILE


def with_values(settings: Settings, values: Mapping[str, Any]) -> Settings:
    """Settings with values replaced, each named by its path: ``weights.heading`` is ``settings.weights.heading``.

    Raises
    ------
    ValueError
        If there is no such value, or it is outside its range.
    """
    own: Values = {}
    parts: dict[str, Values] = {}
    for path, value in values.items():
        name, _, rest = path.partition(".")
        if not hasattr(settings, name):
            raise ValueError(f"{type(settings).__name__} has no {name!r}")
        if rest:
            parts.setdefault(name, {})[rest] = value
        else:
            own[name] = tuple(value) if isinstance(value, list) else value
    for name, inner in parts.items():
        own[name] = with_values(getattr(settings, name), inner)
    return replace(settings, **own)  # type: ignore[type-var]


def values_of(settings: Any, default: Any = None) -> Values:
    """The values in which settings differ from others, by default those of their class, by their paths: what ``with_values`` takes."""
    default = type(settings)() if default is None else default
    found: Values = {}
    for field in fields(settings):
        value, other = getattr(settings, field.name), getattr(default, field.name)
        if is_dataclass(value):
            inner = values_of(value, other)
            found |= {f"{field.name}.{path}": each for path, each in inner.items()}
        elif value != other:
            found[field.name] = list(value) if isinstance(value, tuple) else value
    return found
