"""What may be tuned of each agent at a task, and how far: the one place where an agent is made tunable."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from optuna import Trial

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.registration import TASK_VERSIONS
from lean_yaw_env.validation import require_choice

from ..agent import Agent
from ..controllers.guidance import regulator_for
from ..controllers.mpc import MpcController
from ..controllers.mpc_settings import MpcSettings
from ..controllers.simple import HeadingFeedback, HeadingGains
from ..learning.algorithms import settings_for
from ..learning.ppo import PPOSettings
from ..learning.sac import SACSettings
from ..registry import agent_entry
from ..settings import tuned, value_at, with_values


@dataclass(frozen=True)
class Space:
    """What may be tuned of an agent at a task.

    Attributes
    ----------
    settings : as they are; trials begin with them
    start : the values of a trial that stand for them
    suggest : a trial's settings
        Raises ``ValueError`` where the values make none.
    is_continuous : whether all values are real numbers: CMA-ES is for those
    episodes : that settings are scored on, where no other number is asked for
    make : a controller of options and settings; None for an agent that is trained
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
    require_choice("agent", agent, ("feedback", "lqr", "mpc", *_LEARNERS))
    own = [name for tuned_agent, name in RANGES if tuned_agent == agent]
    others = [each for each in agent_entry(agent).tasks if each in TASK_VERSIONS]
    require_choice("task", task, own or others)
    if agent in _LEARNERS:
        return _learner_space(agent, task)
    if agent == "mpc":
        return _mpc_space(task, horizon)
    return _gain_space(agent, task, horizon)


# ---- gains of feedback and lqr

Range = tuple[float, float, bool]
"""From, to, and whether equal ratios are equal steps."""

DIGITS = 3
"""That are kept of each number."""
_REACH = 0.45
"""Of the first trials to either side of the settings as they are, as a share of the range. CMA-ES begins in the middle of what it is given,
with a standard deviation of a sixth of it: with the settings as they are, and 0.15 of the range."""

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


def _within_loop(ranges: dict[str, Range]) -> dict[str, Range]:
    return {f"loop.{path}": entry for path, entry in ranges.items()}


RANGES: dict[tuple[str, str], dict[str, Range]] = {
    ("feedback", "Heading"): _STEERING,
    ("feedback", "SpeedHeading"): _STEERING | _SPEED,
    ("feedback", "UTurn"): _STEERING | _PUMPING | _UPHILL,
    ("feedback", "Level"): _STEERING | _PUMPING,
    ("lqr", "Heading"): _LOOP | _ANGLE | _TURN,
    ("lqr", "SpeedHeading"): _LOOP | _LIMIT | _SPEED_COST,
    ("lqr", "UTurn"): _LOOP | _ANGLE | _TURN | _PUMPING | _UPHILL,
    ("lqr", "Level"): _LOOP | _ANGLE | _TURN | _PUMPING,
    ("lqr", "Walk"): _LOOP | _ANGLE,
    ("lqr", "Push"): _LOOP | _ANGLE | _PUMPING,
    ("lqr", "Slalom"): _within_loop(_LOOP | _ANGLE | _TURN)
    | {"ahead": (0.0, 6.0, False), "approach": (1.0, 30.0, True)},
    ("lqr", "Waypoint"): _within_loop(_LOOP | _ANGLE | _TURN)
    | {"radius": (1.0, 8.0, True), "persistence": (0.0, 2.0, False)},
}
"""Of the numbers that are tuned, by agent and task and by their paths in the settings."""

_CONDITIONS = {
    ("lqr", "Push"): tuple(EnvOptions(push_level=x, horizon=150.0) for x in (0.5, 0.7, 1.0)),
    ("lqr", "Slalom"): (EnvOptions(horizon=100.0),),
}
"""Episodes that are shorter than the task's, but long enough to tell good from bad, and several push levels at once."""


def _gain_space(agent: str, task: str, horizon: float | None) -> Space:
    options = _CONDITIONS.get((agent, task), (EnvOptions(),))
    if horizon is not None:
        options = tuple(replace(each, horizon=horizon) for each in options)
    ranges = RANGES[agent, task]
    if agent == "feedback":
        settings: Any = tuned(agent, task, HeadingGains())

        def make(options: EnvOptions, gains: Any) -> Agent:
            return HeadingFeedback(task, options, gains)
    else:
        kind = regulator_for(task, EnvOptions())
        settings = tuned(agent, task, kind.Settings())

        def make(options: EnvOptions, gains: Any) -> Agent:
            return kind(task, options, gains)

    start = {path: _starting(value_at(settings, path), entry) for path, entry in ranges.items()}

    def suggest(trial: Trial) -> Any:
        values = {path: _suggested(trial, path, start[path], ranges[path]) for path in ranges}
        return with_values(settings, values)

    return Space(settings, start, suggest, True, 128, make, options)


def _starting(value: float | None, entry: Range) -> float:
    """The number to begin with, within the range; its middle where there is none yet."""
    low, high, by_ratio = entry
    if value is None:
        return math.sqrt(low * high) if by_ratio else 0.5 * (low + high)
    return min(max(value, low), high)


def _suggested(trial: Trial, path: str, start: float, entry: Range) -> float:
    low, high, by_ratio = entry
    if by_ratio:
        reach = (high / low) ** _REACH
        value = trial.suggest_float(path, start / reach, start * reach, log=True)
    else:
        reach = _REACH * (high - low)
        value = trial.suggest_float(path, start - reach, start + reach)
    value = min(max(value, low), high)
    # gaits are found anew for each offset that pumps, so that few of those are tried
    return round(value, 3) if "pumping" in path else float(f"{value:.{DIGITS}g}")


# ---- predictive control

STEPS_PER_DECISION = 2400
"""Walked by all plans together, near 2 ms on one core: every trial may walk as many, so that the search gets better and not the time it takes."""
_KNOTS = (0.0, 0.15, 0.35, 0.7)  # shares of the horizon
_PUMPING_TASKS = ("Push", "UTurn", "Level")  # where the masses may change sides from step to step


_PLANS: dict[str, Range] = {
    "horizon": (1, 24, False),
    "tail": (0, 24, False),
    "iterations": (1, 4, False),
    "scenarios": (0, 16, False),
    "spread.angle": (0.05, 1.0, True),
    "spread.steady": (0.05, 1.0, True),
    "spread.alternating": (0.05, 1.0, True),
    "window": (4.0, 40.0, True),
    "step_price": (0.0, 0.1, False),
    "trust": (0.01, 100.0, True),
    "margin": (0.0, 3.0, False),
    "push_scale": (0.5, 3.0, False),
}


def _mpc_space(task: str, horizon: float | None) -> Space:
    settings = tuned("mpc", task, MpcSettings())
    left_out = set() if task in _PUMPING_TASKS else {"spread.alternating"}
    if not settings.scenarios:
        left_out |= {"scenarios", "push_scale"}
    ranges = {path: entry for path, entry in _PLANS.items() if path not in left_out}
    start = {path: _starting(value_at(settings, path), entry) for path, entry in ranges.items()}
    return Space(
        settings,
        start,
        lambda trial: suggested_mpc(trial, settings, ranges),
        False,
        24,
        lambda options, chosen: MpcController(task, options, chosen),
        (EnvOptions(horizon=horizon),),
    )


def suggested_mpc(trial: Trial, settings: MpcSettings, ranges: Mapping[str, Range]) -> MpcSettings:
    """The predictive controller's settings of a trial.

    Raises
    ------
    ValueError
        If they leave too few plans to choose from.
    """
    values: dict[str, Any] = {
        path: trial.suggest_int(path, int(low), int(high))
        if isinstance(low, int)
        else trial.suggest_float(path, low, high, log=by_ratio)
        for path, (low, high, by_ratio) in ranges.items()
    }
    steps = values["horizon"] + values["tail"]
    draws = max(values.get("scenarios", settings.scenarios), 1)
    samples = min(STEPS_PER_DECISION // (values["iterations"] * steps * draws), 200)
    values |= {
        "knots": tuple(sorted({int(share * values["horizon"]) for share in _KNOTS})),
        "samples": samples,
        "elites": max(2, samples // 6),
    }
    return with_values(settings, values)


# ---- learners

_LAYERS = ("32x32", "64x64", "128x128")


def _learner_space(algorithm: str, task: str) -> Space:
    settings = settings_for(algorithm, task)
    start = start_of(algorithm, settings)
    suggest = _LEARNERS[algorithm]
    return Space(settings, start, lambda trial: suggest(trial, settings), False, 512)


def suggested_ppo(trial: Trial, settings: PPOSettings) -> PPOSettings:
    """PPO's settings of a trial; steps, walkers and pushes stay as they are, since scores differ by them whatever the rest."""
    start = start_of("ppo", settings)
    steps_per_update = _chosen(trial, start, "steps_per_update", (32, 64, 128, 256))
    minibatches = _chosen(trial, start, "minibatches", (2, 4, 8, 16, 32))
    samples = settings.walkers * steps_per_update
    return replace(
        settings,
        steps_per_update=steps_per_update,
        # few walkers make too few samples for so many parts: then every update is one part
        batch_size=samples // minibatches if samples % minibatches == 0 else samples,
        epochs=trial.suggest_int("epochs", 1, 12),
        learning_rate=trial.suggest_float("learning_rate", 2e-4, 1e-2, log=True),
        time_constant=trial.suggest_float("time_constant", 6.0, 100.0, log=True),
        gae_lambda=trial.suggest_float("gae_lambda", 0.8, 1.0),
        clip_range=trial.suggest_float("clip_range", 0.05, 0.4),
        entropy=trial.suggest_float("entropy", 0.0, 0.02),
        initial_log_std=trial.suggest_float("initial_log_std", -3.0, 0.0),
        hidden=_layers(trial, start),
    )


def suggested_sac(trial: Trial, settings: SACSettings) -> SACSettings:
    """SAC's settings of a trial."""
    start = start_of("sac", settings)
    return replace(
        settings,
        gradient_steps=trial.suggest_int("gradient_steps", 1, 16, log=True),
        batch_size=_chosen(trial, start, "batch_size", (128, 256, 512, 1024)),
        learning_rate=trial.suggest_float("learning_rate", 1e-4, 5e-3, log=True),
        time_constant=trial.suggest_float("time_constant", 6.0, 100.0, log=True),
        target_rate=trial.suggest_float("target_rate", 1e-3, 5e-2, log=True),
        target_entropy=trial.suggest_float("target_entropy", -8.0, 0.0),
        initial_entropy_weight=trial.suggest_float("initial_entropy_weight", 1e-3, 1.0, log=True),
        hidden=_layers(trial, start),
    )


_LEARNERS: dict[str, Callable[[Trial, Any], Any]] = {"ppo": suggested_ppo, "sac": suggested_sac}

_SEARCHED = {
    "ppo": (
        "steps_per_update", "epochs", "learning_rate", "time_constant", "gae_lambda", "clip_range",
        "entropy", "initial_log_std",
    ),
    "sac": (
        "gradient_steps", "batch_size", "learning_rate", "time_constant", "target_rate",
        "target_entropy", "initial_entropy_weight",
    ),
}  # fmt: skip


def start_of(algorithm: str, settings: Any) -> dict[str, Any]:
    """The values, by the names of a trial, that stand for a learner's settings."""
    values = {name: getattr(settings, name) for name in _SEARCHED[algorithm]}
    if algorithm == "ppo":
        values["minibatches"] = settings.walkers * settings.steps_per_update // settings.batch_size
    return values | {"hidden": "x".join(str(units) for units in settings.hidden)}


def _layers(trial: Trial, start: Mapping[str, Any]) -> tuple[int, ...]:
    # as words, since a study's file keeps no tuples
    words = _chosen(trial, start, "hidden", _LAYERS)
    return tuple(int(units) for units in words.split("x"))


def _chosen(trial: Trial, start: Mapping[str, Any], name: str, choices: tuple[Any, ...]) -> Any:
    """One of some choices, or what the settings have now."""
    own = start[name]
    return trial.suggest_categorical(name, choices if own in choices else (*choices, own))
