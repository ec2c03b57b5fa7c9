"""The tasks by name; each is compiled when it is first used."""

from __future__ import annotations

from lean_yaw_env.envs.tasks.energy import ENERGY
from lean_yaw_env.envs.tasks.headings import (
    HEADING,
    LEVEL,
    LEVEL_UPHILL,
    SPEED_HEADING,
    UNKNOWN_BODY,
    UTURN,
)
from lean_yaw_env.envs.tasks.hills import HILLS
from lean_yaw_env.envs.tasks.race import RACE
from lean_yaw_env.envs.tasks.slalom import SLALOM
from lean_yaw_env.envs.tasks.task import Command, Feature, Formula, Metric, Task
from lean_yaw_env.envs.tasks.walking import METASTABLE, WALK
from lean_yaw_env.envs.tasks.waypoints import WAYPOINT, WAYPOINT_GOAL
from lean_yaw_env.registration import name_of_task, register_id
from lean_yaw_env.validation import require_instance, suggestion

_ALL = (
    HEADING, WALK, SPEED_HEADING, WAYPOINT, SLALOM, METASTABLE, UTURN, LEVEL, LEVEL_UPHILL, ENERGY,
    UNKNOWN_BODY, RACE, HILLS, WAYPOINT_GOAL,
)  # fmt: skip
TASKS = {task.name: task for task in _ALL}
"""Those of this package and of others (``register_task``)."""


def task_named(task: str | Task) -> Task:
    """The task of a name ("Heading") or an environment id ("LeanYaw/Heading-v1"); a task is returned as it is.

    Raises
    ------
    ValueError
        If there is none; names those there are.
    """
    if isinstance(task, Task):
        return task
    name = name_of_task(task)
    if not isinstance(name, str) or name not in TASKS:
        raise ValueError(
            f"task must be one of {', '.join(TASKS)}, got {task!r}{suggestion(task, TASKS)}"
        )
    return TASKS[name]


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
        If another task has that name, or ``env_id`` is not of that form.
    """
    if TASKS.get(require_instance("task", task, Task).name, task) is not task:
        raise ValueError(f"name must be a task's own, got {task.name!r}, which there is already")
    register_id(env_id, task.name, reward_threshold=reward_threshold)
    TASKS[task.name] = task


__all__ = [
    "TASKS",
    "Command",
    "Feature",
    "Formula",
    "Metric",
    "Task",
    "register_task",
    "task_named",
]
