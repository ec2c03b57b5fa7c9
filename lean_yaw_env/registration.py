"""Environment ids, stated once, and their registration with Gymnasium."""

from __future__ import annotations

from gymnasium.envs.registration import parse_env_id, register, registry
from gymnasium.error import Error

from lean_yaw_env.validation import require_finite

NAMESPACE = "LeanYaw"

SUITE_VERSION = 1
_TASKS = (
    "Heading", "Walk", "SpeedHeading", "Waypoint", "Slalom", "Metastable", "UTurn", "Level",
    "LevelUphill", "Energy", "UnknownBody", "Race", "Hills",
)  # fmt: skip
TASK_VERSIONS = dict.fromkeys(_TASKS, SUITE_VERSION)
"""Every task's name and version; ``envs.tasks`` defines the tasks."""

REWARD_THRESHOLDS: dict[str, float] = {}
"""The mean return from which a task counts as solved, for tasks that are measured by the return."""

ENV_IDS = tuple(f"{NAMESPACE}/{name}-v{version}" for name, version in TASK_VERSIONS.items())

GOAL_TASK = "WaypointGoal"
"""Waypoint with one goal, rewarded for reaching it alone."""
GOAL_ENV_ID = f"{NAMESPACE}/{GOAL_TASK}-v{SUITE_VERSION}"
"""That task for goal-conditioned learners: the one environment whose observations are dictionaries."""

ALL_TASKS = (*TASK_VERSIONS, GOAL_TASK)
ALL_ENV_IDS = (*ENV_IDS, GOAL_ENV_ID)

TASK_IDS: dict[str, str] = {}
"""The name of the task of each registered id."""


def name_of_task(task: str) -> str:
    """A task's name, from itself or from an environment id of it (which may begin with a module to import, as for ``gymnasium.make``)."""
    return TASK_IDS.get(task.rsplit(":", 1)[-1], task) if isinstance(task, str) else task


def register_id(env_id: str, task: str, *, reward_threshold: float | None = None) -> None:
    """Register an id for a task, unless it is registered already.

    Raises
    ------
    ValueError
        If ``env_id`` is not of the form "Namespace/Name-v0", or the threshold is not a number.
    """
    try:
        parse_env_id(env_id)
    except (TypeError, Error) as error:
        raise ValueError(f"env_id must be like 'Mine/Zigzag-v0', got {env_id!r}") from error
    if reward_threshold is not None:
        require_finite("reward_threshold", reward_threshold)
    TASK_IDS[env_id] = task
    if env_id not in registry:
        register(
            id=env_id,
            entry_point=f"lean_yaw_env.envs.entry_points:{task}",
            vector_entry_point=f"lean_yaw_env.envs.entry_points:{task}Vector",
            reward_threshold=reward_threshold,
        )


def register_envs() -> None:
    """Register every environment that is not registered yet; calling it again does nothing."""
    for name, env_id in zip(ALL_TASKS, ALL_ENV_IDS, strict=True):
        register_id(env_id, name, reward_threshold=REWARD_THRESHOLDS.get(name))
