"""How controllers are tuned: CMA-ES on the mean return over episodes kept for tuning, from the settings that are kept for the task.

Run as ``python -m agents.controllers.tune lqr Push``; it shows the best settings so far, and keeps them in ``tuned.json`` (minutes).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import cmaes
import numpy as np
import typer
from tqdm import tqdm

from agents.agent import Agent
from agents.controllers.gaits import Pumping
from agents.controllers.guidance import (
    PathGuidance,
    PathSettings,
    WaypointGuidance,
    WaypointSettings,
)
from agents.controllers.heading_feedback import HeadingFeedback, HeadingGains
from agents.controllers.lqr import HeadingLqr, LqrSettings, UprightLqr
from agents.controllers.regulator import LqrWeights
from agents.controllers.tuned import FILE, tuned, value_at, with_values
from agents.evaluation.scoring import run_seeds
from agents.files import read_json, write_json
from agents.seeds import TUNING_SEEDS
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.errors import LeanYawError
from lean_yaw_env.parameters import Vector

SPREAD = 0.15
"""First standard deviation of each number, as a share of its range."""
DIGITS = 3
"""That are kept of each number."""

_LOOP = {
    "weights.heading": (0.01, 3.0, True),
    "weights.ankle_angle": (0.02, 5.0, True),
    "weights.stance_pitch_rate": (0.02, 5.0, True),
    "weights.ankle_rate": (0.02, 5.0, True),
    "weights.mass_offset": (0.005, 50.0, True),
    "weights.inter_leg_angle": (0.01, 1.0, True),
    "weights.offset_change": (0.001, 0.3, True),
}
_SPEED_COST = {"weights.speed": (0.01, 10.0, True)}
_LIMIT = {"largest_error": (0.1, 3.0, True)}
_TURN = {
    "turning_angle": (0.2, 0.45, False),
    "turning_error": (0.05, 1.0, True),
    **_LIMIT,
}
_ANGLE = {"inter_leg_angle": (0.15, 0.45, False)}
_PUMPING = {"pumping.downhill": (0.0, 0.045, False)}
_UPHILL = {"pumping.uphill": (0.01, 0.05, False)}
_STEERING = {
    "proportional": (0.0, 0.3, False),
    "ankle": (-1.0, 1.0, False),
    "ankle_rate": (-0.5, 0.5, False),
    "feedforward": (0.0, 2.0, False),
    "inter_leg_angle": (-0.15, 0.15, False),
}
_SPEED = {"speed": (-2.0, 0.0, False), "speed_error": (-1.0, 1.0, False)}

Range = tuple[float, float, bool]
"""From, to, and whether equal ratios are equal steps."""


@dataclass(frozen=True)
class Search:
    """What is tuned of a controller at a task.

    Attributes
    ----------
    make : controller of settings
    settings : where nothing has been tuned yet
    ranges : of the numbers that are tuned, by their paths
    push_levels : each in its own episodes; None is the task's
    horizon : units of time, if shorter than the task's: enough to tell good from bad
    """

    make: Callable[[Any], Agent]
    settings: Any
    ranges: dict[str, Range]
    push_levels: tuple[float | None, ...] = (None,)
    horizon: float | None = None

    def options(self) -> list[EnvOptions]:
        """Those of each environment that settings are tried in."""
        return [EnvOptions(push_level=level, horizon=self.horizon) for level in self.push_levels]


def _loop(ranges: dict[str, Range]) -> dict[str, Range]:
    return {f"loop.{path}": entry for path, entry in ranges.items()}


_PUMPED = LqrSettings(
    LqrWeights(
        heading=0.3, ankle_angle=0.1, ankle_rate=0.1, inter_leg_angle=0.1, offset_change=0.05
    ),
    largest_error=0.4,
    pumping=Pumping(0.02),
)
"""Where tasks that allow pumping begin."""
_PUMPED_UPHILL = replace(_PUMPED, pumping=Pumping(0.02, 0.04))


def _heading_lqr(task: str, ranges: dict[str, Range]) -> Search:
    start = LqrSettings()
    if "pumping.downhill" in ranges:
        start = _PUMPED_UPHILL if "pumping.uphill" in ranges else _PUMPED
    return Search(lambda settings: HeadingLqr(task, settings=settings), start, ranges)


def _feedback(task: str, ranges: dict[str, Range]) -> Search:
    return Search(lambda gains: HeadingFeedback(task, gains=gains), HeadingGains(), ranges)


SEARCHES: dict[tuple[str, str], Search] = {
    ("feedback", "Heading"): _feedback("Heading", _STEERING),
    ("feedback", "SpeedHeading"): _feedback("SpeedHeading", _STEERING | _SPEED),
    ("feedback", "UTurn"): _feedback("UTurn", _STEERING | _PUMPING | _UPHILL),
    ("feedback", "Level"): _feedback("Level", _STEERING | _PUMPING),
    ("lqr", "Heading"): _heading_lqr("Heading", _LOOP | _ANGLE | _TURN),
    ("lqr", "SpeedHeading"): _heading_lqr("SpeedHeading", _LOOP | _LIMIT | _SPEED_COST),
    ("lqr", "UTurn"): _heading_lqr("UTurn", _LOOP | _ANGLE | _TURN | _PUMPING | _UPHILL),
    ("lqr", "Level"): _heading_lqr("Level", _LOOP | _ANGLE | _TURN | _PUMPING),
    ("lqr", "Walk"): Search(
        lambda settings: UprightLqr("Walk", settings=settings), LqrSettings(), _LOOP | _ANGLE
    ),
    ("lqr", "Push"): Search(
        lambda settings: UprightLqr("Push", settings=settings),
        _PUMPED,
        _LOOP | _ANGLE | _PUMPING,
        push_levels=(0.5, 0.7, 1.0),
        horizon=150.0,
    ),
    ("lqr", "Slalom"): Search(
        lambda settings: PathGuidance("Slalom", settings=settings),
        PathSettings(),
        _loop(_LOOP | _ANGLE | _TURN) | {"ahead": (0.0, 6.0, False), "approach": (1.0, 30.0, True)},
        horizon=100.0,
    ),
    ("lqr", "Waypoint"): Search(
        lambda settings: WaypointGuidance("Waypoint", settings=settings),
        WaypointSettings(),
        _loop(_LOOP | _ANGLE | _TURN)
        | {"radius": (1.0, 8.0, True), "persistence": (0.0, 2.0, False)},
    ),
}
"""What there is to tune, by controller and task."""


class Tuner:
    """Points of the unit cube as settings, and what they are worth.

    Parameters
    ----------
    controller, task : str
    episodes : int
        Of each push level, always the same.
    """

    def __init__(self, controller: str, task: str, episodes: int) -> None:
        self._task = task
        self._search = SEARCHES[controller, task]
        self._start = tuned(controller, task, self._search.settings)
        self._seeds = range(TUNING_SEEDS, TUNING_SEEDS + episodes)

    def start(self) -> Vector:
        """The settings to begin with, within the ranges."""
        shares = [
            _share(value_at(self._start, path), entry)
            for path, entry in self._search.ranges.items()
        ]
        return np.clip(shares, 0.01, 0.99)

    def values(self, shares: Vector) -> dict[str, float]:
        """The numbers that a point of the cube means, rounded to what is kept of them."""
        return {
            path: _rounded(path, _value(share, entry))
            for share, (path, entry) in zip(shares, self._search.ranges.items(), strict=True)
        }

    def cost(self, shares: Vector) -> float:
        """Minus the mean return; infinite where there is no such controller."""
        try:
            settings = with_values(self._start, self.values(shares))
            agent = self._search.make(settings)
        except (LeanYawError, ValueError, np.linalg.LinAlgError):
            return math.inf
        returns = [
            run_seeds(agent, self._task, self._seeds, options=options).metrics["return"].mean()
            for options in self._search.options()
        ]
        return -float(np.mean(returns))


def _rounded(path: str, value: float) -> float:
    """What is kept of a number. Gaits are found anew for each offset that pumps, so that few of those are tried."""
    return round(float(value), 3) if "pumping" in path else float(f"{value:.{DIGITS}g}")


def _share(value: float | None, entry: Range) -> float:
    low, high, by_ratio = entry
    if value is None:
        return 0.5
    if by_ratio:
        return math.log(min(value, high) / low) / math.log(high / low)
    return (value - low) / (high - low)


def _value(share: float, entry: Range) -> float:
    low, high, by_ratio = entry
    return low * (high / low) ** share if by_ratio else low + share * (high - low)


def tune(
    controller: str, task: str, *, evaluations: int, episodes: int, spread: float = SPREAD
) -> tuple[dict[str, float], float]:
    """Search the settings, the same every time; return the best, the ones to begin with among them, and their mean return.

    Better settings are kept as soon as they are found.
    """
    tuner = Tuner(controller, task, episodes)
    start = tuner.start()
    search = cmaes.CMA(
        mean=start, sigma=spread, bounds=np.tile([0.0, 1.0], (len(start), 1)), seed=0
    )
    best, least = start, tuner.cost(start)
    with tqdm(total=evaluations, desc=f"tuning {controller} for {task}", unit="evaluation") as bar:
        while bar.n < evaluations:
            points = [search.ask() for _ in range(search.population_size)]
            costs = []
            for point in points:
                costs.append(tuner.cost(point))
                bar.update(1)
            search.tell(list(zip(points, _finite(costs), strict=True)))
            if min(costs) < least:
                least, best = min(costs), points[int(np.argmin(costs))]
                keep(controller, task, tuner.values(best))
            bar.set_postfix({"return": f"{-least:.2f}"})
    return tuner.values(best), -least


def _finite(costs: Sequence[float]) -> list[float]:
    """Costs that can be ranked: what is impossible is worse than anything seen."""
    return [cost if math.isfinite(cost) else 1e9 for cost in costs]


def keep(controller: str, task: str, values: dict[str, float]) -> None:
    """Write settings to the file that controllers read."""
    everything = read_json(FILE)
    everything.setdefault(controller, {})[task] = values
    write_json(FILE, everything)


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def main(
    controller: Annotated[str, typer.Argument(help="feedback or lqr.")],
    task: Annotated[str, typer.Argument(help="The task's name.")],
    evaluations: Annotated[int, typer.Option(help="Settings tried.")] = 400,
    episodes: Annotated[int, typer.Option(help="Episodes that each is tried in.")] = 128,
    spread: Annotated[float, typer.Option(help="First spread, as a share of the ranges.")] = SPREAD,
) -> None:
    """Tune a controller for a task and keep what was found."""
    if (controller, task) not in SEARCHES:
        known = ", ".join(" ".join(pair) for pair in SEARCHES)
        raise typer.BadParameter(f"there is nothing to tune but {known}")
    values, best = tune(controller, task, evaluations=evaluations, episodes=episodes, spread=spread)
    typer.echo(f"{controller} {task}: return {best:.2f} with {values}")


if __name__ == "__main__":
    app()
