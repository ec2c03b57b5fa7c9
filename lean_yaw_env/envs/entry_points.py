"""What ``gymnasium.make`` calls for an id of a task: ``Heading`` makes an environment of one walker, ``HeadingVector`` one of many."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from lean_yaw_env.envs.goal_env import WaypointGoalEnv, WaypointGoalVectorEnv
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.extras import is_gpu
from lean_yaw_env.registration import GOAL_TASK

_VECTOR = "Vector"


def __getattr__(name: str) -> Callable[..., Any]:
    if name.startswith("_"):
        raise AttributeError(name)
    make: Any = partial(_make, name.removesuffix(_VECTOR), name.endswith(_VECTOR))
    make.metadata = WalkerEnv.metadata
    return make


def _make(task: str, many: bool, /, **arguments: Any) -> WalkerEnv | WalkerVectorEnv:
    if "task" in arguments:
        raise ValueError(
            f"task is fixed by the id to {task!r}, got {arguments['task']!r}: make the id of that task"
        )
    if is_gpu(arguments.get("device", "cpu")):
        if not many or task == GOAL_TASK:
            raise ValueError(
                f"device='cuda' is for gymnasium.make_vec and tasks other than {GOAL_TASK}; leave device='cpu'"
            )
        from lean_yaw_env.envs.device_env import DeviceVectorEnv

        return DeviceVectorEnv(task=task_named(task), **arguments)
    arguments.pop("device", None)
    if task == GOAL_TASK:
        return (WaypointGoalVectorEnv if many else WaypointGoalEnv)(**arguments)
    return (WalkerVectorEnv if many else WalkerEnv)(task=task_named(task), **arguments)
