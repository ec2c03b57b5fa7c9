"""What a task is: a record of its own, formulas, and what describes them. A new task is one file like ``heading``, and ``register_task``."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np

from lean_yaw_env.envs.reset import BODY_DEVIATIONS, BodyDraw
from lean_yaw_env.envs.state import BODY_SIZE, WALKER_FIELDS, Field, Records, record_type
from lean_yaw_env.kernel.compilation import formula
from lean_yaw_env.parameters import Range, Vector, WalkerParameters
from lean_yaw_env.validation import (
    require_array,
    require_choice,
    require_flag,
    require_instance,
    require_mapping,
)

RandomBody = Literal["nominal", "training", "held-out"]
BODY_DRAWS: dict[RandomBody, BodyDraw] = {
    "nominal": BodyDraw.NOMINAL,
    "training": BodyDraw.TRAINING,
    "held-out": BodyDraw.HELD_OUT,
}
Formula = Callable[[Any, Any], Any]
"""Of a walker's record and the task's; decorated by ``formula``."""


@formula
def draw_nothing(walker: Any, task: Any) -> None:
    """The start of a task without anything random."""


@formula
def go_on(walker: Any, task: Any) -> bool:
    """The update of a task that sums nothing up and ends no episode."""
    return False


@formula
def derive_nothing(walker: Any, task: Any) -> None:
    """The refresh of a task without derived fields."""


@formula
def observe_nothing(walker: Any, task: Any) -> Any:
    """The features of a task that has none."""
    return ()


FIRST = "0: the first."
FRICTION_LIMIT = 0.6
"""Friction limit of the tasks of this package: the least that tables give for rubber on dry concrete, 0.6 to 0.85."""
SINCE_VERSION_1 = f"the friction limit is {FRICTION_LIMIT}; the step across the horizon is paid, and counted in metrics, to the horizon alone"
"""What version 1 changed in every task of the package."""
NEW = ("1: the first.",)
"""The history of a task that came with version 1."""

TASK_RANGES = (
    Range("horizon", 0.0, math.inf, "(]"),
    Range("max_offset_change", 0.0, 2.0),
    Range("push_level", 0.0, 10.0),
)
"""Of the options that have a default of each task's own."""
_PUMPING, _GOAL_RADIUS = Range("pumping", -1.0, 1.0), Range("goal_radius", 0.0, math.inf, "()")


class Feature(NamedTuple):
    """One number that a task appends to the observation: what it is, less ``centre``, divided by ``scale``; both in ``unit``.

    ``is_odd`` says that it changes sign in a mirror image.
    """

    name: str
    scale: float
    unit: str
    meaning: str
    centre: float = 0.0
    is_odd: bool = False


class Metric(NamedTuple):
    """One number of an episode's result, apart from reward: a field, or a quotient of two (0 over 0 is 0), of the walker's record or the task's.

    ``better`` is the direction in which agents are compared; None for what only describes an episode. ``is_share`` says that it is 0 or 1
    for an episode, so that many episodes have a share.
    """

    field: str
    divisor: str | None = None
    meaning: str = ""
    better: Literal["higher", "lower"] | None = None
    is_share: bool = False


class Command(NamedTuple):
    """A command that a reset option may set: its fields of the task's record, and the range of their numbers."""

    fields: tuple[str, ...]
    low: float
    high: float
    meaning: str


@dataclass(frozen=True)
class Task:
    """A task for the walker.

    Its formulas take a walker's record (``envs.state.WALKER_FIELDS``) and the task's own. ``reward`` and ``features`` change nothing. They, and
    ``refresh``, take complex numbers too, whose imaginary parts carry a derivative: their decisions look at real parts (``x.real``).

    Raises
    ------
    ValueError
        If a value is outside its range, a metric or a command names a field that there is not, or a field has the name of one of the
        walker's.
    """

    name: str
    """The middle of its environment id."""
    reward: Formula
    """Of a step that was no fall, from records after the step and before ``update``. The environment pays its ``share`` before the horizon."""
    metrics: dict[str, Metric]
    """Success metrics, apart from reward."""
    summary: str
    """For the documents: what the walker must do."""
    reward_text: str
    """For the documents: the reward's rate per unit of time."""
    history: tuple[str, ...] = (FIRST,)
    """For the documents: a sentence for each version."""
    fields: tuple[Field, ...] = ()
    """The task's record, each field at its initial value before ``start``."""
    start: Formula = draw_nothing
    """Draws what is random in an episode."""
    update: Formula = go_on
    """Adds a step to the sums and draws the next command; returns whether the episode ends."""
    refresh: Formula = derive_nothing
    """Renews fields that derive from others, after each start, each step, and records set by hand."""
    features: Formula = observe_nothing
    """A tuple, which the task appends to the observation, not mirrored or scaled yet."""
    observed: tuple[Feature, ...] = ()
    """What those features are."""
    ends: str = ""
    """For the documents: what ends an episode apart from a fall and the horizon."""
    commands: dict[str, Command] = field(default_factory=dict)
    """Reset options that set a command."""
    heading_field: str | None = None
    """Field with the commanded heading, if there is one; pictures show it."""
    goal_fields: tuple[str, str] | None = None
    """Fields with the place (downhill, right) of a goal to be reached within ``goal_radius``."""
    goal_radius: float = 0.5
    reference_path: Callable[[Any, Any], Vector] | None = None
    """The path to be followed, as points (k, 2) on the floor, from a walker's record and the task's."""
    parameters: WalkerParameters = field(default_factory=WalkerParameters)
    horizon: float = 200.0
    max_offset_change: float = 0.005
    push_level: float = 0.0
    hidden_rates: bool = False
    random_body: RandomBody = "nominal"
    body_reach: tuple[float, ...] = BODY_DEVIATIONS
    """Half-widths of the box from which random bodies are drawn, shape (4,)."""
    slope_varies: bool = False
    """The slope under a walker changes from step to step: ``refresh`` sets its field ``slope``, on which it walks the next step."""
    pumping: float = 0.0
    """Episodes start in the gait driven by this offset, away from the stance foot; 0 is the gait that the slope drives."""
    headline: str = "return"
    """The metric, or "return", by which agents are compared: it must be meaningful without survival."""
    is_ranked: bool = True
    """Whether agents are compared on it; False for a smoke test."""

    def __post_init__(self) -> None:
        for name in ("metrics", "commands"):
            require_mapping(name, getattr(self, name))
        if not all(
            isinstance(each, Field) for each in require_instance("fields", self.fields, tuple)
        ):
            raise ValueError(f"fields must be of the class Field, got {self.fields!r}")
        require_instance("parameters", self.parameters, WalkerParameters)
        for limits in (*TASK_RANGES, _PUMPING, _GOAL_RADIUS):
            limits.require(getattr(self, limits.name))
        for name in ("hidden_rates", "slope_varies", "is_ranked"):
            require_flag(name, getattr(self, name))
        require_choice("random_body", self.random_body, BODY_DRAWS)
        require_array("body_reach", self.body_reach, (BODY_SIZE,), 0.0, 1.0, "(]")
        common = {field.name for field in WALKER_FIELDS}
        own = {field.name for field in self.fields}
        if common & own:
            raise ValueError(
                f"fields must not have names of the walker's record, got {', '.join(sorted(common & own))}"
            )
        named = {
            "heading_field": [self.heading_field],
            "goal_fields": require_instance("goal_fields", self.goal_fields or (), tuple),
            "metrics": [name for metric in self.metrics.values() for name in metric[:2]],
            "commands": [name for command in self.commands.values() for name in command.fields],
        }
        for where, names in named.items():
            for name in names:
                if name is not None and name not in common | own:
                    raise ValueError(
                        f"{where} must name fields of the task {self.name}, got {name!r}"
                    )

    def __reduce__(self) -> tuple[Any, ...]:
        return Task, tuple(getattr(self, each.name) for each in fields(self))

    @cached_property
    def record(self) -> np.dtype[np.void]:
        """The type of the task's record."""
        return record_type(self.fields)

    @cached_property
    def initial(self) -> Records:
        """A record (1,) with the fields' initial values."""
        record = np.zeros(1, self.record)
        for each in self.fields:
            record[each.name] = each.initial
        return record

    def measure(
        self, walkers: Records, tasks: Records, undefined: float = 0.0
    ) -> dict[str, Vector]:
        """The metrics of walkers' records and the task's, each (n,); quotients without a divisor are ``undefined``."""
        found: dict[str, Vector] = {}
        for key, metric in self.metrics.items():
            values = _numbers(metric.field, walkers, tasks)
            found[key] = values
            if metric.divisor is not None:
                divisors = _numbers(metric.divisor, walkers, tasks)
                found[key] = np.full(len(values), undefined)
                np.divide(values, divisors, out=found[key], where=divisors > 0.0)
        return found


def _numbers(name: str, walkers: Records, tasks: Records) -> Vector:
    names = walkers.dtype.names or ()
    return (walkers if name in names else tasks)[name].astype(np.float64)
