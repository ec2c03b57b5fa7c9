"""Gymnasium environments: one walker, many walkers, and the tasks they share.

What is exported here is loaded when first used; ``envs.sb3`` needs Stable-Baselines3.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lean_yaw_env.envs.goal_env import WaypointGoalEnv, WaypointGoalVectorEnv
    from lean_yaw_env.envs.info import FallCode
    from lean_yaw_env.envs.options import EnvOptions
    from lean_yaw_env.envs.simulation import Simulation
    from lean_yaw_env.envs.state import Field
    from lean_yaw_env.envs.tasks import Command, Feature, Metric, Task, register_task, task_named
    from lean_yaw_env.envs.vector_env import WalkerVectorEnv
    from lean_yaw_env.envs.walker_env import WalkerEnv
    from lean_yaw_env.kernel.compilation import formula
    from lean_yaw_env.kernel.random import normal, uniform

_HOMES = {
    "Command": "lean_yaw_env.envs.tasks",
    "EnvOptions": "lean_yaw_env.envs.options",
    "FallCode": "lean_yaw_env.envs.info",
    "Feature": "lean_yaw_env.envs.tasks",
    "Field": "lean_yaw_env.envs.state",
    "Metric": "lean_yaw_env.envs.tasks",
    "Simulation": "lean_yaw_env.envs.simulation",
    "Task": "lean_yaw_env.envs.tasks",
    "WalkerEnv": "lean_yaw_env.envs.walker_env",
    "WalkerVectorEnv": "lean_yaw_env.envs.vector_env",
    "WaypointGoalEnv": "lean_yaw_env.envs.goal_env",
    "WaypointGoalVectorEnv": "lean_yaw_env.envs.goal_env",
    "formula": "lean_yaw_env.kernel.compilation",
    "normal": "lean_yaw_env.kernel.random",
    "register_task": "lean_yaw_env.envs.tasks",
    "task_named": "lean_yaw_env.envs.tasks",
    "uniform": "lean_yaw_env.kernel.random",
}

__all__ = [
    "Command",
    "EnvOptions",
    "FallCode",
    "Feature",
    "Field",
    "Metric",
    "Simulation",
    "Task",
    "WalkerEnv",
    "WalkerVectorEnv",
    "WaypointGoalEnv",
    "WaypointGoalVectorEnv",
    "formula",
    "normal",
    "register_task",
    "task_named",
    "uniform",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)
