"""The tasks, loaded by name: each is compiled only when it is used."""

from __future__ import annotations

import importlib

from lean_yaw_env.envs.tasks.task import Command, Feature, Metric, Task
from lean_yaw_env.registration import TASK_VERSIONS


def task_named(name: str) -> Task:
    """The task of that name, or ``ValueError`` naming those there are."""
    if name not in TASK_VERSIONS:
        raise ValueError(f"task must be one of {', '.join(TASK_VERSIONS)}, not {name!r}")
    return importlib.import_module(f"{__name__}.{name.lower()}").TASK


__all__ = ["Command", "Feature", "Metric", "Task", "task_named"]
