"""What a task is: a record of its own, formulas, and what describes them. A new task is one file like ``heading``, and ``register_task``."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np

from lean_yaw_env.envs.derivatives import differentiate, differentiation_tables
from lean_yaw_env.envs.info import info_report, infos_of
from lean_yaw_env.envs.judging import judge, no_features, no_refresh, no_start, no_update
from lean_yaw_env.envs.observation import COMMON_CENTRES, COMMON_ODD, COMMON_SCALES
from lean_yaw_env.envs.state import WALKER_FIELDS, Field, Records, record_type
from lean_yaw_env.kernel.compilation import entry_point_with
from lean_yaw_env.parameters import Vector, WalkerParameters

Formula = Callable[[Any, Any], Any]
"""Of a walker's record and the task's; decorated by ``formula``."""


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

    ``better`` is the direction that an agent is to be judged by; None for what only describes an episode. ``is_share`` says that it is 0 or 1
    for an episode, so that a share is all there is to tell of many.
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

    Attributes
    ----------
    name : str
        The middle of its environment id.
    reward : of a step that was no fall, from records after the step and before ``update``
    metrics : success metrics, apart from reward
    summary, reward_text, history : str
        For the documents: what is asked, the reward's rate per unit of time, and a sentence for each version.
    fields : the task's record, each field at its initial value before ``start``
    start : draws what the episode asks
    update : keeps the account of a step and draws what the next one asks; returns whether the episode ends
    refresh : renews fields that derive from others, after each start, each step, and records set by hand
    features : a tuple, what the task appends to the observation, not mirrored or scaled yet
    observed : what those features are
    ends : str
        For the documents: what ends an episode apart from a fall and the horizon.
    commands : reset options that set a command
    heading_field : field with the commanded heading, if there is one; pictures show it
    goal_fields : fields with the place (downhill, right) of a goal to be reached within ``goal_radius``
    reference_path : the path to be followed, as points (k, 2) on the floor, from a walker's record and the task's
    parameters, horizon, max_offset_change, push_level : defaults of the environment
    pumping : float
        Episodes start in the gait driven by this offset, away from the stance foot; 0 is the gait that the slope drives.
    headline : the metric, or "return", by which agents are compared: it must say enough without a look at survival

    Raises
    ------
    ValueError
        If a metric or a command names a field that there is not, or a field has the name of one of the walker's.
    """

    name: str
    reward: Formula
    metrics: dict[str, Metric]
    summary: str
    reward_text: str
    history: tuple[str, ...]
    fields: tuple[Field, ...] = ()
    start: Formula = no_start
    update: Formula = no_update
    refresh: Formula = no_refresh
    features: Formula = no_features
    observed: tuple[Feature, ...] = ()
    ends: str = ""
    commands: dict[str, Command] = field(default_factory=dict)
    heading_field: str | None = None
    goal_fields: tuple[str, str] | None = None
    goal_radius: float = 0.5
    reference_path: Callable[[Any, Any], Vector] | None = None
    parameters: WalkerParameters = field(default_factory=WalkerParameters)
    horizon: float = 200.0
    max_offset_change: float = 0.005
    push_level: float = 0.0
    pumping: float = 0.0
    headline: str = "return"

    def __post_init__(self) -> None:
        common = {field.name for field in WALKER_FIELDS}
        own = {field.name for field in self.fields}
        if common & own:
            raise ValueError(
                f"fields must not have names of the walker's record, got {', '.join(sorted(common & own))}"
            )
        named = [
            name for metric in self.metrics.values() for name in (metric.field, metric.divisor)
        ]
        named += [name for command in self.commands.values() for name in command.fields]
        named += [self.heading_field, *(self.goal_fields or ())]
        for name in named:
            if name is not None and name not in common | own:
                raise ValueError(f"task {self.name} names a field that it has not: {name!r}")

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

    @cached_property
    def judge(self) -> Any:
        """The compiled ``judging.judge`` of this task; tasks of the same formulas and tables share one."""
        return self._compiled(judge, ("pay", "observe"), REPORT=info_report(self))

    @cached_property
    def differentiate(self) -> Any:
        """The compiled ``derivatives.differentiate`` of this task."""
        tables = differentiation_tables(self.fields)
        return self._compiled(differentiate, ("read_observation",), **tables)

    def measure(
        self, walkers: Records, tasks: Records, undefined: float = 0.0
    ) -> dict[str, Vector]:
        """The metrics of walkers' records and the task's, each (n,); quotients without a divisor are ``undefined``."""
        found: dict[str, Vector] = {}
        for key, metric in self.metrics.items():
            values = _numbers(metric.field, walkers, tasks)
            if metric.divisor is not None:
                divisors = _numbers(metric.divisor, walkers, tasks)
                found[key] = np.full(len(values), undefined)
                np.divide(values, divisors, out=found[key], where=divisors > 0.0)
            else:
                found[key] = values
        return found

    def _compiled(self, template: Callable[..., Any], parts: tuple[str, ...], **more: Any) -> Any:
        """The template with this task's formulas and tables; tasks that have the same ones share what is compiled."""
        formulas = {
            "TASK_START": self.start,
            "TASK_REWARD": self.reward,
            "TASK_UPDATE": self.update,
            "TASK_REFRESH": self.refresh,
            "TASK_FEATURES": self.features,
        }
        tables = {
            "CENTRES": (*COMMON_CENTRES, *(feature.centre for feature in self.observed)),
            "SCALES": (*COMMON_SCALES, *(feature.scale for feature in self.observed)),
            "ODD": (*COMMON_ODD, *(feature.is_odd for feature in self.observed)),
        }
        contents = (
            [each[:5] for each in self.fields],
            tables,
            [info[:2] for info in infos_of(self)],
        )
        key = (template, *formulas.values(), repr(contents))
        if key not in _COMPILED:
            names = [f"{each.__module__}.{each.__qualname__}" for each in formulas.values()]
            digest = hashlib.sha256(repr((names, contents)).encode()).hexdigest()
            _COMPILED[key] = entry_point_with(
                template, digest[:16], formulas, parts, **tables, **more
            )
        return _COMPILED[key]


_COMPILED: dict[tuple[Any, ...], Any] = {}
"""Entry points by template, formulas and tables."""


def _numbers(name: str, walkers: Records, tasks: Records) -> Vector:
    names = walkers.dtype.names or ()
    return (walkers if name in names else tasks)[name].astype(np.float64)
