"""The tasks, loaded by name: each is compiled only when it is used."""

from __future__ import annotations

import importlib

from lean_yaw_env.envs.tasks.task import Command, Feature, Formula, Metric, Task
from lean_yaw_env.registration import ALL_TASKS, TASK_IDS, name_of_task, register_id
from lean_yaw_env.validation import suggestion

_REGISTERED: dict[str, Task] = {}
"""Tasks of other packages, by name."""


def task_named(task: str | Task) -> Task:
    """The task of a name ("Heading") or an environment id ("LeanYaw/Heading-v0"); a task is returned as it is.

    Raises
    ------
    ValueError
        If there is none; names those there are.
    """
    if isinstance(task, Task):
        return task
    name = name_of_task(task)
    if name in _REGISTERED:
        return _REGISTERED[name]
    if name not in ALL_TASKS:
        known = (*ALL_TASKS, *_REGISTERED)
        raise ValueError(
            f"task must be one of {', '.join(known)}, got {task!r}{suggestion(task, known)}"
        )
    return importlib.import_module(f"{__name__}.{name.lower()}").TASK


def register_task(task: Task, env_id: str, *, reward_threshold: float | None = None) -> None:
    """Make a task of your own known by its name, and to ``gymnasium.make`` and ``make_vec`` by an id.

    Parameters
    ----------
    task : Task
    env_id : str
        As "Mine/Zigzag-v0".
    reward_threshold : float, optional
        The mean return from which the task counts as solved.

    Raises
    ------
    ValueError
        If another task has that name.
    """
    if task.name in ALL_TASKS or _REGISTERED.get(task.name, task) is not task:
        raise ValueError(f"name must be a task's own, got {task.name!r}, which there is already")
    _REGISTERED[task.name] = task
    register_id(env_id, task.name, reward_threshold=reward_threshold)


__all__ = [
    "TASK_IDS",
    "Command",
    "Feature",
    "Formula",
    "Metric",
    "Task",
    "register_task",
    "task_named",
]
