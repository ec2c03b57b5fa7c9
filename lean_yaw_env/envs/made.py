"""Makers of environments by a task's name, as ``gymnasium.make`` looks them up: ``Heading`` for one walker, ``HeadingVector`` for many.

The task is fixed by the id: a ``task`` among the arguments is refused.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.envs.walker_env import WalkerEnv

_VECTOR = "Vector"


def __getattr__(name: str) -> Callable[..., Any]:
    if name.startswith("_"):
        raise AttributeError(name)
    maker: Any = partial(_make, name)
    maker.metadata = WalkerEnv.metadata
    return maker


def _make(name: str, **arguments: Any) -> WalkerEnv | WalkerVectorEnv:
    task = name.removesuffix(_VECTOR)
    if "task" in arguments:
        raise ValueError(
            f"task is fixed by the id to {task!r}, got {arguments['task']!r}: make the id of that task"
        )
    kind = WalkerVectorEnv if name.endswith(_VECTOR) else WalkerEnv
    return kind(task=task_named(task), **arguments)
