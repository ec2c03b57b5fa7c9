"""Exact three-dimensional walkers with lean-to-yaw coupling, after Wisse and Schwab (2005), and the steering tasks they make.

Importing the package registers its environments; everything else is loaded when first used, so that the import is quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from lean_yaw_env.registration import register_envs

if TYPE_CHECKING:
    from lean_yaw_env.analysis import LimitCycle, find_limit_cycle
    from lean_yaw_env.errors import FellError, LeanYawError, NoGaitError, SolverError
    from lean_yaw_env.parameters import STATE_FIELDS, WalkerParameters
    from lean_yaw_env.walker import EnergyLedger, Fall, StepResult, Walk, Walker

__version__ = "0.1.0"

_HOMES = {
    "EnergyLedger": "lean_yaw_env.walker",
    "Fall": "lean_yaw_env.walker",
    "FellError": "lean_yaw_env.errors",
    "LeanYawError": "lean_yaw_env.errors",
    "LimitCycle": "lean_yaw_env.analysis",
    "NoGaitError": "lean_yaw_env.errors",
    "STATE_FIELDS": "lean_yaw_env.parameters",
    "SolverError": "lean_yaw_env.errors",
    "StepResult": "lean_yaw_env.walker",
    "Walk": "lean_yaw_env.walker",
    "Walker": "lean_yaw_env.walker",
    "WalkerParameters": "lean_yaw_env.parameters",
    "find_limit_cycle": "lean_yaw_env.analysis",
}

__all__ = [
    "STATE_FIELDS",
    "EnergyLedger",
    "Fall",
    "FellError",
    "LeanYawError",
    "LimitCycle",
    "NoGaitError",
    "SolverError",
    "StepResult",
    "Walk",
    "Walker",
    "WalkerParameters",
    "find_limit_cycle",
    "register_envs",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted(set(globals()) | set(_HOMES))


register_envs()
