"""Exact three-dimensional walkers with lean-to-yaw coupling, after Wisse and Schwab (2005), and the steering tasks they make.

Importing the package registers its environments; everything else is loaded when first used, so that the import is quick.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lean_yaw_env.lazy import lazy_names
from lean_yaw_env.registration import register_envs

if TYPE_CHECKING:
    from lean_yaw_env.analysis import LimitCycle, find_limit_cycle
    from lean_yaw_env.errors import FellError, LeanYawError, NoGaitError, SolverError
    from lean_yaw_env.parameters import STATE_FIELDS, WalkerParameters
    from lean_yaw_env.walker import EnergyLedger, Fall, StepResult, Walk, Walker

__version__ = "0.1.0"

_EXPORTS = {
    "analysis": ("LimitCycle", "find_limit_cycle"),
    "errors": ("FellError", "LeanYawError", "NoGaitError", "SolverError"),
    "parameters": ("STATE_FIELDS", "WalkerParameters"),
    "walker": ("EnergyLedger", "Fall", "StepResult", "Walk", "Walker"),
}
"""Names by the module that defines them."""

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

__getattr__, __dir__ = lazy_names(__name__, _EXPORTS)


register_envs()
