"""Agents from outside the package: a folder says what the agent is and how to load it; see docs/enter_your_agent.md."""

from __future__ import annotations

import importlib.util
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lean_yaw_env.files import read_json

from ..agent import Agent
from ..registry import AGENTS, env_id_of

ENTRY_FILE = "agent.json"
LOADER_FILE = "agent.py"
FORMAT, FORMAT_VERSION = "lean-yaw-agent", 1


@dataclass(frozen=True)
class Entry:
    """An agent's folder.

    Attributes
    ----------
    folder : holds ``agent.json`` and ``agent.py``
    name : a lower-case word that no agent of the package has
    tasks : names of those that it is for
    trainings : what ``load`` of ``agent.py`` gets for each training
    """

    folder: Path
    name: str
    tasks: tuple[str, ...]
    trainings: tuple[Path, ...]


def is_entry(folder: Path) -> bool:
    """Whether a folder holds an agent from outside, rather than a policy that this package has trained."""
    return (folder / ENTRY_FILE).exists()


def read_entry(folder: Path) -> Entry:
    """Read and check ``agent.json``; runs no code.

    Raises
    ------
    ValueError
        If the file or a value in it is bad, or a file is missing.
    """
    path = folder / ENTRY_FILE
    record = read_json(path)
    known = {"format", "format_version", "name", "tasks", "trainings"}
    if not isinstance(record, dict) or set(record) != known:
        raise ValueError(f"{str(path)!r} must be an object with {', '.join(sorted(known))}")
    if (record["format"], record["format_version"]) != (FORMAT, FORMAT_VERSION):
        raise ValueError(f"{str(path)!r} must have format {FORMAT!r} and format_version {FORMAT_VERSION}")  # fmt: skip
    name = record["name"]
    if not isinstance(name, str) or not re.fullmatch(r"[a-z][a-z0-9_]*", name) or name in AGENTS:
        raise ValueError(f"name in {str(path)!r} must be a lower-case word and none of {', '.join(AGENTS)}, got {name!r}")  # fmt: skip
    tasks = _strings(record["tasks"], f"tasks in {str(path)!r}")
    for task in tasks:
        env_id_of(task)
    trainings = tuple(
        folder / each for each in _strings(record["trainings"], f"trainings in {str(path)!r}")
    )
    for needed in (folder / LOADER_FILE, *trainings):
        if not needed.exists():
            raise ValueError(f"{str(path)!r} needs {str(needed)!r}, which does not exist")
    return Entry(folder, name, tasks, trainings)


def load_entry(folder: Path, training: Path) -> Agent:
    """The agent of a training. Runs the folder's ``agent.py``: its ``load(path)`` returns an object with Stable-Baselines3's ``predict``."""
    path = folder / LOADER_FILE
    spec = importlib.util.spec_from_file_location(f"lean_yaw_entry_{folder.name}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    if not callable(getattr(module, "load", None)):
        raise ValueError(f"{str(path)!r} must define load(path), which returns an agent")
    return module.load(training)


def _strings(value: Any, name: str) -> tuple[str, ...]:
    if not isinstance(value, list) or not value or not all(isinstance(each, str) for each in value):
        raise ValueError(f"{name} must be a list of one or more texts, got {value!r}")
    return tuple(dict.fromkeys(value))
