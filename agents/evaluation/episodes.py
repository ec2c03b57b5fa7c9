"""What came of an agent's episodes, and rows that sum it up."""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.parameters import Vector

from .intervals import (
    HYPOTHESIS_RESAMPLES,
    RESAMPLES,
    UNDEFINED,
    Resampled,
    resample,
    resample_time_per_fall,
    share_estimate,
    time_per_fall_estimate,
)

RETURN = "return"
SPEED = "speed"
SURVIVAL = "survival"
TIME, FELL = "time", "fell"
TIME_PER_FALL = "time_per_fall"
"""The headline of tasks without an end: log10 of the time of all walks over their number of falls."""


def metric_names(task: str) -> tuple[str, ...]:
    """What is known of every episode of a task: ``Episodes.metrics``."""
    return (RETURN, *task_named(task).metrics, SPEED, TIME, FELL)


def words(metric: str) -> str:
    """A metric's name as people read it."""
    return ("log10 " if metric == TIME_PER_FALL else "") + metric.replace("_", " ")


@dataclass(frozen=True)
class Episodes:
    """What came of an agent's episodes, in arrays of shape (episodes,)."""

    survived: NDArray[np.bool_]
    """Whether the time limit or a success ended it."""
    metrics: dict[str, Vector]
    """``return``, the task's metrics, ``speed`` (distance over time), ``time`` and ``fell`` (0 or 1; a solver's failure is no fall) by name; NaN where an
    episode leaves one undefined."""

    @classmethod
    def joined(cls, parts: Sequence[Episodes]) -> Episodes:
        """Episodes one after the other."""
        names = parts[0].metrics
        metrics = {name: np.concatenate([part.metrics[name] for part in parts]) for name in names}
        return cls(np.concatenate([part.survived for part in parts]), metrics)


@dataclass(frozen=True)
class Results:
    """One agent's episodes at a task, (trainings, episodes): the same episodes for each of its trainings."""

    task: str
    agent: str
    runs: tuple[Episodes, ...]
    """One for each training."""
    options: EnvOptions = field(default_factory=EnvOptions)
    seconds: float = 0.0
    """Of one core that the episodes took."""
    _resampled: dict[tuple[str, int], Resampled] = field(
        default_factory=dict, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        lengths = {len(run.survived) for run in self.runs}
        if len(lengths) != 1:
            raise ValueError(
                f"runs must be one or more of the same episodes, got runs of {sorted(lengths)}"
            )

    @property
    def episodes(self) -> int:
        return len(self.runs[0].survived)

    @property
    def metrics(self) -> tuple[str, ...]:
        first = (TIME_PER_FALL,) if task_named(self.task).headline == TIME_PER_FALL else ()
        return (*first, *self.runs[0].metrics, SURVIVAL)

    def values(self, metric: str) -> Vector:
        """Shape (trainings, episodes); ``survival`` is 0 or 1."""
        if metric == SURVIVAL:
            return np.stack([run.survived for run in self.runs]).astype(float)
        return np.stack([run.metrics[metric] for run in self.runs])

    def falls(self, episodes: int | None = None) -> tuple[Vector, Vector]:
        """Time walked and number of falls in each of the first episodes, or all: shapes (trainings, episodes)."""
        return self.values(TIME)[:, :episodes], self.values(FELL)[:, :episodes]

    def resampled(self, metric: str, episodes: int | None = None) -> Resampled:
        """Resamples of a metric's values in the first episodes, or all; drawn once."""
        count = self.episodes if episodes is None else episodes
        if (metric, count) not in self._resampled:
            # an agent's trainings are drawn by themselves, alike whoever else is evaluated
            stream = zlib.crc32(self.agent.encode())
            is_tested = metric == task_named(self.task).headline
            resamples = HYPOTHESIS_RESAMPLES if is_tested else RESAMPLES
            if metric == TIME_PER_FALL:
                drawn = resample_time_per_fall(*self.falls(count), stream, resamples)
            else:
                drawn = resample(self.values(metric)[:, :count], stream, resamples)
            self._resampled[metric, count] = drawn
        return self._resampled[metric, count]


@dataclass(frozen=True)
class Row:
    """A metric over episodes and, of an agent that was trained several times, over trainings.

    An error is over the time walked, so that it says little of an agent that falls: read ``survival`` with it.

    Attributes
    ----------
    mean, low, high : the mean, for a metric that is 0 or 1 the share, with its 95 % interval; of ``time_per_fall`` without a fall the low end alone
    survival : share of the episodes that the time limit or a success ended
    episodes : of each training
    iqm, iqm_low, iqm_high : the interquartile mean with its 95 % interval; NaN for a share
    trainings : policies of as many trainings are pooled; 1 for what is not trained
    least_training, greatest_training : the lowest and the highest mean of a training, of those that have one
    against : the feedback controller that it is compared with, on the episodes that both have walked
    difference, difference_low, difference_high : the mean less that agent's, with its 95 % interval; NaN where there is no comparison
    p_value : of the difference being zero, of the task's headline only; corrected for the number of hypotheses (Holm)
    normalised : on the leaderboard, the headline's mean (or what it is at least) where 0 is the fixed controller's and 1 the reference's
    verdict : "better", "worse", "tie" or "mixed", by that p-value: see ``comparison.Hypothesis``
    """

    task: str
    agent: str
    metric: str
    mean: float
    low: float
    high: float
    survival: float
    episodes: int
    iqm: float
    iqm_low: float
    iqm_high: float
    trainings: int
    least_training: float
    greatest_training: float
    against: str | None = None
    difference: float = math.nan
    difference_low: float = math.nan
    difference_high: float = math.nan
    p_value: float = math.nan
    normalised: float = math.nan
    verdict: str | None = None

    @property
    def score(self) -> float:
        """The mean, or what it is at least."""
        return self.low if math.isnan(self.mean) else self.mean


def is_share(task: str, metric: str) -> bool:
    """Whether a metric is 0 or 1 for an episode."""
    known = task_named(task).metrics.get(metric)
    return metric == SURVIVAL or (known is not None and known.is_share)


def direction(task: str, metric: str) -> int:
    """+1 for a metric of which more is better, -1 for one of which less is, 0 for one that only describes."""
    if metric in (RETURN, SURVIVAL, TIME_PER_FALL):
        return 1
    known = task_named(task).metrics.get(metric)
    better = None if known is None else known.better
    return {"higher": 1, "lower": -1, None: 0}[better]


def summary(results: Results) -> list[Row]:
    """A row for each metric, ``survival`` last."""
    return [metric_row(results, metric) for metric in results.metrics]


def metric_row(results: Results, metric: str) -> Row:
    """The row of a metric, compared with no one."""
    if metric == TIME_PER_FALL:
        times, falls = results.falls()
        mean, iqm = time_per_fall_estimate(times, falls), UNDEFINED
        each = zip(times[:, None], falls[:, None], strict=True)
        means = [time_per_fall_estimate(*training).value for training in each]
    else:
        values = results.values(metric)
        if is_share(results.task, metric):
            mean, iqm = share_estimate(values > 0.0), UNDEFINED
        else:
            drawn = results.resampled(metric)
            mean, iqm = drawn.mean_estimate(), drawn.iqm_estimate()
        defined = [run[np.isfinite(run)] for run in values]
        means = [float(run.mean()) if len(run) else math.nan for run in defined]
    known = [each for each in means if math.isfinite(each)] or [math.nan]
    return Row(
        results.task,
        results.agent,
        metric,
        *mean,
        float(results.values(SURVIVAL).mean()),
        results.episodes,
        *iqm,
        len(results.runs),
        min(known),
        max(known),
    )
