"""What may be tuned of each agent at a task, and how far: the one place where an agent is made tunable."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

from optuna import Trial

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.registration import TASK_VERSIONS
from lean_yaw_env.validation import require_choice

from ..agent import Agent
from ..controllers.guidance import regulator_for
from ..controllers.linear import LinearSettings
from ..controllers.simple import HeadingFeedback, HeadingGains
from ..learning.algorithms import settings_for
from ..registry import agent_entry
from ..settings import tuned, with_values

Range = tuple[float, float, bool]
"""From, to, and whether equal ratios are equal steps; whole numbers if its ends are."""
Entry = Range | list[Any]
"""What a trial draws from: a range or a list of choices."""
Values = dict[str, Any]


@dataclass(frozen=True)
class Space:
    """What may be tuned of an agent at a task.

    Attributes
    ----------
    settings : the present ones, with which trials begin
    start : the values of a trial that stand for them
    suggest : returns a trial's settings, or raises ``ValueError`` where its values are no valid settings
    is_continuous : whether all values are real numbers, as CMA-ES needs
    episodes : number of episodes that settings are scored on by default
    make : makes a controller of options and settings; None for an agent that is trained
    options : of the environments that settings are scored in
    """

    settings: Any
    start: Mapping[str, Any]
    suggest: Callable[[Trial], Any]
    is_continuous: bool
    episodes: int
    make: Callable[[EnvOptions, Any], Agent] | None = None
    options: tuple[EnvOptions, ...] = (EnvOptions(),)


def space_of(agent: str, task: str, horizon: float | None = None) -> Space:
    """What may be tuned of an agent at a task; ``horizon`` shortens the episodes that a controller is scored on.

    Raises
    ------
    ValueError
        If there is no such task, or nothing to tune of the agent at it.
    """
    require_choice("agent", agent, ("feedback", "lqr", *_LEARNERS))
    own = [name for tuned_agent, name in RANGES if tuned_agent == agent]
    others = [each for each in agent_entry(agent).tasks if each in TASK_VERSIONS]
    require_choice("task", task, own or others)
    if agent in _LEARNERS:
        return _learner_space(agent, task)
    return _gain_space(agent, task, horizon)


def settings_of(agent: str, task: str) -> Any:
    """The present settings of an agent that is tuned."""
    is_linear = agent == "linear"
    return tuned(agent, task, LinearSettings()) if is_linear else space_of(agent, task).settings


def _drawn(trial: Trial, entries: Mapping[str, Entry], start: Mapping[str, Any]) -> Values:
    """A trial's values; the present value is one more choice if it is none of the choices."""
    values: Values = {}
    for path, entry in entries.items():
        if isinstance(entry, list):
            choices = entry if start[path] in entry else [*entry, start[path]]
            values[path] = trial.suggest_categorical(path, choices)
        elif isinstance(entry[0], int):
            values[path] = trial.suggest_int(path, entry[0], int(entry[1]), log=entry[2])
        else:
            values[path] = trial.suggest_float(path, entry[0], entry[1], log=entry[2])
    return values


def _starting(settings: Any, ranges: Mapping[str, Range]) -> dict[str, float]:
    """The present numbers, moved into their ranges; the middle of the range where there is none yet."""
    start: dict[str, float] = {}
    for path, (low, high, by_ratio) in ranges.items():
        middle = math.sqrt(low * high) if by_ratio else 0.5 * (low + high)
        value = attrgetter(path)(settings)
        start[path] = min(max(middle if value is None else value, low), high)
    return start


# ---- gains of feedback and lqr

DIGITS = 3
"""Digits that are kept of each number."""
_REACH = 0.45
"""How far trials lie from the present settings at most, to either side, as a share of the range. CMA-ES begins in the middle of what it is given,
with a standard deviation of a sixth of it: with the present settings, and 0.15 of the range."""

_LOOP: dict[str, Range] = {
    "weights.heading": (0.01, 3.0, True),
    "weights.ankle_angle": (0.02, 5.0, True),
    "weights.stance_pitch_rate": (0.02, 5.0, True),
    "weights.ankle_rate": (0.02, 5.0, True),
    "weights.mass_offset": (0.005, 50.0, True),
    "weights.inter_leg_angle": (0.01, 1.0, True),
    "weights.offset_change": (0.001, 0.3, True),
}
_SPEED_COST: dict[str, Range] = {"weights.speed": (0.01, 10.0, True)}
_LIMIT: dict[str, Range] = {"largest_error": (0.1, 3.0, True)}
_ANGLE: dict[str, Range] = {"inter_leg_angle": (0.15, 0.45, False)}
_TURN = _LIMIT | {"turning_angle": (0.2, 0.45, False), "turning_error": (0.05, 1.0, True)}
_GUIDED = {f"loop.{path}": entry for path, entry in (_LOOP | _ANGLE | _TURN).items()}
_TO_GOALS = _GUIDED | {"radius": (1.0, 8.0, True), "persistence": (0.0, 2.0, False)}
_PUMPING: dict[str, Range] = {"pumping.downhill": (0.0, 0.045, False)}
_UPHILL: dict[str, Range] = {"pumping.uphill": (0.01, 0.05, False)}
_STEERING: dict[str, Range] = {
    "proportional": (0.0, 0.3, False),
    "ankle": (-1.0, 1.0, False),
    "ankle_rate": (-0.5, 0.5, False),
    "feedforward": (0.0, 2.0, False),
    "inter_leg_angle": (-0.15, 0.15, False),
}
_SPEED: dict[str, Range] = {"speed": (-2.0, 0.0, False), "speed_error": (-1.0, 1.0, False)}


RANGES: dict[tuple[str, str], dict[str, Range]] = {
    ("feedback", "Heading"): _STEERING,
    ("feedback", "SpeedHeading"): _STEERING | _SPEED,
    ("feedback", "UTurn"): _STEERING | _PUMPING | _UPHILL,
    ("feedback", "Level"): _STEERING | _PUMPING,
    ("feedback", "Energy"): _STEERING | _SPEED | _PUMPING | {"pumping_by_speed": (0.0, 0.1, False)},
    ("feedback", "UnknownBody"): _STEERING,
    ("feedback", "Hills"): _STEERING | _SPEED,
    ("lqr", "Heading"): _LOOP | _ANGLE | _TURN,
    ("lqr", "SpeedHeading"): _LOOP | _LIMIT | _SPEED_COST,
    ("lqr", "UTurn"): _LOOP | _ANGLE | _TURN | _PUMPING | _UPHILL,
    ("lqr", "Level"): _LOOP | _ANGLE | _TURN | _PUMPING,
    ("lqr", "UnknownBody"): _LOOP | _ANGLE | _TURN,
    ("lqr", "Hills"): _LOOP | _LIMIT | _SPEED_COST | _PUMPING,
    ("lqr", "Walk"): _LOOP | _ANGLE,
    ("lqr", "Metastable"): _LOOP | _ANGLE | _PUMPING,
    ("lqr", "Slalom"): _GUIDED | {"ahead": (0.0, 6.0, False), "approach": (1.0, 30.0, True)},
    ("lqr", "Waypoint"): _TO_GOALS,
    ("lqr", "Race"): _TO_GOALS | {"loop.pumping.downhill": (0.0, 0.045, False)},
}
"""Of the numbers that are tuned, by agent and task and by their paths in the settings."""

_CONDITIONS = {
    ("lqr", "Metastable"): tuple(EnvOptions(push_level=x, horizon=150.0) for x in (0.5, 0.7, 1.0)),
    ("lqr", "Slalom"): (EnvOptions(horizon=100.0),),
}
"""Episodes that are shorter than the task's, but long enough to tell good from bad, and several push levels at once."""


def _gain_space(agent: str, task: str, horizon: float | None) -> Space:
    options = _CONDITIONS.get((agent, task), (EnvOptions(),))
    if horizon is not None:
        options = tuple(replace(each, horizon=horizon) for each in options)
    ranges = RANGES[agent, task]
    kind: Any = HeadingFeedback if agent == "feedback" else regulator_for(task, EnvOptions())
    default: Any = HeadingGains() if agent == "feedback" else kind.Settings()
    settings = tuned(agent, task, default)
    start = _starting(settings, ranges)

    def suggest(trial: Trial) -> Any:
        return with_values(
            settings, {path: _near(trial, path, start[path], ranges[path]) for path in ranges}
        )

    def make(options: EnvOptions, gains: Any) -> Agent:
        return kind(task, options, gains)

    return Space(settings, start, suggest, True, 128, make, options)


def _near(trial: Trial, path: str, start: float, entry: Range) -> float:
    """A trial's number around the present one."""
    low, high, by_ratio = entry
    if by_ratio:
        reach = (high / low) ** _REACH
        value = trial.suggest_float(path, start / reach, start * reach, log=True)
    else:
        reach = _REACH * (high - low)
        value = trial.suggest_float(path, start - reach, start + reach)
    value = min(max(value, low), high)
    # gaits are computed anew for each offset that pumps, so that few of those are tried
    return round(value, 3) if "pumping." in path else float(f"{value:.{DIGITS}g}")


# ---- learners

_LEARNERS: dict[str, dict[str, Entry]] = {
    "ppo": {
        "steps_per_update": [32, 64, 128, 256],
        "minibatches": [2, 4, 8, 16, 32],
        "epochs": (1, 12, False),
        "learning_rate": (2e-4, 1e-2, True),
        "time_constant": (6.0, 100.0, True),
        "gae_lambda": (0.8, 1.0, False),
        "clip_range": (0.05, 0.4, False),
        "entropy": (0.0, 0.02, False),
        "initial_log_std": (-3.0, 0.0, False),
        "hidden": ["32x32", "64x64", "128x128"],
    },
    "sac": {
        "gradient_steps": (1, 16, True),
        "batch_size": [128, 256, 512, 1024],
        "learning_rate": (1e-4, 5e-3, True),
        "time_constant": (6.0, 100.0, True),
        "target_rate": (1e-3, 5e-2, True),
        "target_entropy": (-8.0, 0.0, False),
        "initial_entropy_weight": (1e-3, 1.0, True),
        "hidden": ["32x32", "64x64", "128x128"],
    },
}
"""Steps, walkers and pushes stay as they are, since scores depend on them whatever the rest."""


def _learner_space(algorithm: str, task: str) -> Space:
    settings = settings_for(algorithm, task)
    # a study's file keeps no tuples, so that layers are words
    start: Values = {"hidden": "x".join(map(str, settings.hidden))}
    if algorithm == "ppo":
        samples = settings.walkers * settings.steps_per_update
        start["minibatches"] = samples // settings.batch_size
    entries = _LEARNERS[algorithm]
    start |= {path: getattr(settings, path) for path in entries if path not in start}

    def suggest(trial: Trial) -> Any:
        values = _drawn(trial, entries, start)
        values["hidden"] = tuple(int(units) for units in values["hidden"].split("x"))
        if algorithm == "ppo":
            samples, parts = (
                settings.walkers * values["steps_per_update"],
                values.pop("minibatches"),
            )
            # few walkers make too few samples for so many parts: then every update is one part
            values["batch_size"] = samples // parts if samples % parts == 0 else samples
        return with_values(settings, values)

    return Space(settings, start, suggest, False, 512)
