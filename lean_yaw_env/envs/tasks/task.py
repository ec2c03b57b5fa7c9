"""What a task is: names, numbers and compiled steps. A new task is one file like ``heading`` and one line in ``registration.TASK_VERSIONS``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from lean_yaw_env.parameters import Vector, WalkerParameters


@dataclass(frozen=True)
class Metric:
    """One number of an episode's result, apart from reward: a column of memory, or a quotient of two (0 over 0 is 0).

    ``better`` is the direction that an agent is to be judged by; None for what only describes an episode. ``is_share`` says that it is 0 or 1
    for an episode, so that a share is all there is to tell of many.
    """

    column: int
    divisor: int | None = None
    meaning: str = ""
    better: Literal["higher", "lower"] | None = None
    is_share: bool = False


class Feature(NamedTuple):
    """One number that a task appends to the observation: what it is, less ``centre``, divided by ``scale``; both in ``unit``."""

    name: str
    scale: float
    unit: str
    meaning: str
    centre: float = 0.0


class Command(NamedTuple):
    """A command that a reset option may set: its columns of memory, and the range of their numbers."""

    columns: tuple[int, ...]
    low: float
    high: float
    meaning: str


@dataclass(frozen=True)
class Task:
    """A task for the walker: reset, observation features, reward and ends, as formulas compiled into its three loops.

    Attributes
    ----------
    name : str
        The middle of its environment id.
    step_one, step_many, start_many : compiled entry points
        One walker's step, a batch's step, and the start of episodes; arguments as in ``envs.running``.
    features : what the task appends to the observation
    metrics : success metrics, apart from reward
    headline : the one of them, or "return", by which agents are compared: it must say enough without a look at survival
    summary, reward, ends, history : str
        For the documents: what is asked, the reward's rate per unit of time, what ends an episode apart from a fall and the horizon, and
        a sentence for each version.
    commands : reset options that set a command
    command_column : column of memory with the commanded heading, if there is one; pictures show it
    goal_columns : columns of memory with the place (downhill, right) of a goal to be reached within ``goal_radius``
    reference_path : the path to be followed, as points (k, 2) on the floor, from a row of memory
    constants : at most ``columns.TASK_SETTINGS`` numbers that the task's formulas read from the settings
    parameters, horizon, max_offset_change, push_level : defaults of the environment
    pumping : float
        Episodes start in the gait driven by this offset, away from the stance foot; 0 is the gait that the slope drives.
    """

    name: str
    step_one: Callable[..., int]
    step_many: Callable[..., int]
    start_many: Callable[..., None]
    features: tuple[Feature, ...]
    metrics: dict[str, Metric]
    summary: str
    reward: str
    history: tuple[str, ...]
    ends: str = ""
    commands: dict[str, Command] = field(default_factory=dict)
    command_column: int | None = None
    goal_columns: tuple[int, int] | None = None
    goal_radius: float = 0.5
    reference_path: Callable[[Vector], Vector] | None = None
    constants: tuple[float, ...] = ()
    parameters: WalkerParameters = field(default_factory=WalkerParameters)
    horizon: float = 200.0
    max_offset_change: float = 0.005
    push_level: float = 0.0
    pumping: float = 0.0
    headline: str = "return"
