"""What a task is: names, numbers and compiled steps. A new task is one file like ``heading`` and one line in ``tasks.REGISTRY``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from lean_yaw_env.parameters import WalkerParameters


@dataclass(frozen=True)
class Metric:
    """One number of an episode's result, apart from reward: a column of memory, or a quotient of two (0 over 0 is 0)."""

    column: int
    divisor: int | None = None


@dataclass(frozen=True)
class Task:
    """A task for the walker: reset, observation features, reward and ends, as formulas compiled into its three loops.

    Attributes
    ----------
    name : str
        The middle of its environment id.
    step_one, step_many, start_many : compiled entry points
        One walker's step, a batch's step, and the start of episodes; arguments as in ``envs.running``.
    features : names of the numbers that the task appends to the observation
    metrics : success metrics, apart from reward
    command_column : column of memory with the commanded heading, if there is one; pictures show it
    parameters, horizon, max_offset_change : defaults of the environment
    """

    name: str
    step_one: Callable[..., None]
    step_many: Callable[..., None]
    start_many: Callable[..., None]
    features: tuple[str, ...]
    metrics: dict[str, Metric]
    command_column: int | None = None
    parameters: WalkerParameters = field(default_factory=WalkerParameters)
    horizon: float = 200.0
    max_offset_change: float = 0.005
