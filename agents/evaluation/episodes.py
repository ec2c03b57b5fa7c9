"""What came of an agent's episodes, and rows that sum it up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.parameters import Vector

from .intervals import Estimate, Resampled, resample, share_estimate

RETURN = "return"
SPEED = "speed"
SURVIVAL = "survival"


@dataclass(frozen=True)
class Episodes:
    """What came of an agent's episodes.

    Attributes
    ----------
    survived : bool, shape (episodes,)
        Whether the time limit or a success ended it.
    metrics : by name, each of shape (episodes,)
        ``return``, the task's metrics and ``speed`` (distance over time); NaN where an episode leaves one undefined.
    """

    survived: NDArray[np.bool_]
    metrics: dict[str, Vector]

    @classmethod
    def joined(cls, parts: Sequence[Episodes]) -> Episodes:
        """Episodes one after the other."""
        return cls(
            np.concatenate([part.survived for part in parts]),
            {
                name: np.concatenate([part.metrics[name] for part in parts])
                for name in parts[0].metrics
            },
        )


@dataclass(frozen=True)
class Row:
    """A metric over episodes and, of an agent that was trained several times, over trainings.

    An error is over the time walked, so that it says little of an agent that falls: read ``survival`` with it.

    Attributes
    ----------
    task, agent, metric : str
    mean, low, high : float
        The mean, for a metric that is 0 or 1 the share, with its 95 % interval.
    survival : float
        Share of the episodes that the time limit or a success ended.
    episodes : int
        Of each training.
    iqm, iqm_low, iqm_high : float
        The interquartile mean with its 95 % interval; NaN for a share.
    trainings : int
        Policies of as many trainings are pooled; 1 for what is not trained.
    least_training, greatest_training : float
        The lowest and the highest mean of a training.
    against : str or None
        The agent it is compared with, on the episodes that both have walked.
    difference, difference_low, difference_high : float
        The mean less that agent's, with its 95 % interval; NaN where there is no comparison.
    verdict : str or None
        "better", "worse", "tie" or "mixed": see ``comparison.Comparison``.
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
    difference: float = float("nan")
    difference_low: float = float("nan")
    difference_high: float = float("nan")
    verdict: str | None = None


@dataclass(frozen=True)
class Results:
    """One agent's episodes at a task, (trainings, episodes): the same episodes for each of its trainings.

    Parameters
    ----------
    task, agent : str
    runs : one for each training
    """

    task: str
    agent: str
    runs: tuple[Episodes, ...]

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
    def survived(self) -> NDArray[np.bool_]:
        """Shape (trainings, episodes)."""
        return np.stack([run.survived for run in self.runs])

    @property
    def metrics(self) -> tuple[str, ...]:
        return tuple(self.runs[0].metrics)

    def values(self, metric: str) -> Vector:
        """Shape (trainings, episodes); ``survival`` is 0 or 1."""
        if metric == SURVIVAL:
            return self.survived.astype(float)
        return np.stack([run.metrics[metric] for run in self.runs])


def is_share(task: str, metric: str) -> bool:
    """Whether a metric is 0 or 1 for an episode."""
    known = task_named(task).metrics.get(metric)
    return metric == SURVIVAL or (known is not None and known.is_share)


def summary(results: Results) -> list[Row]:
    """A row for each metric, ``survival`` last."""
    return [metric_row(results, metric) for metric in (*results.metrics, SURVIVAL)]


def metric_row(results: Results, metric: str, resampled: Resampled | None = None) -> Row:
    """The row of a metric; ``resampled`` are its values' resamples where there are some already."""
    values = results.values(metric)
    if is_share(results.task, metric):
        mean, iqm = share_estimate(values > 0.0), Estimate(*[float("nan")] * 3)
    else:
        drawn = resample(values) if resampled is None else resampled
        mean, iqm = drawn.mean_estimate(), drawn.iqm_estimate()
    of_trainings = [_defined_mean(run) for run in values]
    return Row(
        results.task,
        results.agent,
        metric,
        *mean,
        float(results.survived.mean()),
        results.episodes,
        *iqm,
        len(values),
        min(of_trainings),
        max(of_trainings),
    )


def _defined_mean(values: Vector) -> float:
    defined = values[np.isfinite(values)]
    return float(defined.mean()) if len(defined) else float("nan")
