"""Means and interquartile means with 95 % intervals, and differences between agents, by bootstrap.

Means with survival beside them come first, as they count every fall; interquartile means stand beside. As Agarwal et al. (2021, "Deep reinforcement learning at the edge of the statistical precipice") ask for, intervals are
those of a percentile bootstrap, each task drawn for itself. What is drawn anew are the episodes and, of an agent that was trained several
times, the trainings too, so that an interval holds for another training on other episodes. All trainings walk the same episodes: rows and
columns of one table are drawn, each once for the whole of it (Owen, 2007, "The pigeonhole bootstrap", Annals of Applied Statistics 1), which
errs towards wide intervals. Every agent gets the same draws of episodes, so that differences are those of pairs.
Their library, rliable, draws along one axis only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

from lean_yaw_env.parameters import Vector

CONFIDENCE = 0.95
RESAMPLES = 2000
CLAIM_RESAMPLES = 10_000
"""Of what is claimed: the smallest p-value is 2 / (CLAIM_RESAMPLES + 1), and Holm's first limit is 0.05 over the number of claims."""
_BLOCK = 100  # resamples at a time: some megabytes
_QUARTER = 0.25


class Estimate(NamedTuple):
    """A number with its 95 % interval; NaN where there is nothing to estimate it from."""

    value: float
    low: float
    high: float


UNDEFINED = Estimate(math.nan, math.nan, math.nan)


class Resampled(NamedTuple):
    """Mean and interquartile mean of values, and of their resamples: shape (resamples,) each."""

    mean: float
    iqm: float
    means: Vector
    iqms: Vector

    def mean_estimate(self) -> Estimate:
        return _estimate(self.mean, self.means)

    def iqm_estimate(self) -> Estimate:
        return _estimate(self.iqm, self.iqms)

    def p_value(self) -> float:
        """Two-sided, of the mean being zero: twice the smaller share of resamples on either side of zero, the values themselves counted once."""
        count = min(np.count_nonzero(self.means <= 0.0), np.count_nonzero(self.means >= 0.0))
        return min(1.0, 2.0 * (1 + count) / (1 + len(self.means)))

    def less(self, other: Resampled) -> Resampled:
        """The differences to another agent's on the same episodes."""
        return Resampled(
            self.mean - other.mean, self.iqm - other.iqm, self.means - other.means, self.iqms - other.iqms
        )  # fmt: skip


def holm(p_values: Sequence[float]) -> list[float]:
    """p-values corrected for how many there are (Holm, 1979): those below a limit are all true with at least the limit's confidence."""
    order = np.argsort(p_values, kind="stable")
    factors = np.arange(len(p_values), 0, -1)
    corrected = np.empty(len(p_values))
    corrected[order] = np.minimum(np.maximum.accumulate(factors * np.asarray(p_values)[order]), 1.0)
    return corrected.tolist()


def resample(values: Vector, stream: int = 0, resamples: int = RESAMPLES) -> Resampled:
    """Draw episodes and trainings anew.

    Parameters
    ----------
    values : shape (trainings, episodes)
        NaN where an episode leaves one undefined: those are left out. The draws are seeded: the same values give the same.
    stream : int
        Trainings of two agents have nothing to do with one another: give them different numbers. Episodes are drawn alike for all.
    """
    trainings, episodes = values.shape
    if trainings * episodes == 0:
        raise ValueError(
            f"values must hold one training and one episode or more, got shape {values.shape}"
        )
    defined = values[np.isfinite(values)]
    if len(defined) == 0 or defined.min() == defined.max():  # resampling has nothing to draw
        only = float(defined[0]) if len(defined) else math.nan
        constant = np.full(resamples, only)
        return Resampled(only, only, constant, constant)
    mean, iqm = _statistics(values, np.ones((1, trainings)), np.ones((1, episodes)))
    of_trainings = _draws(trainings, 1 + stream, resamples)
    of_episodes = _draws(episodes, 0, resamples)
    blocks = [
        _statistics(values, of_trainings[k : k + _BLOCK], of_episodes[k : k + _BLOCK])
        for k in range(0, resamples, _BLOCK)
    ]
    means, iqms = (np.concatenate(each) for each in zip(*blocks, strict=True))
    return Resampled(float(mean[0]), float(iqm[0]), means, iqms)


def share_estimate(happened: NDArray[np.bool_]) -> Estimate:
    """A share of episodes, from an array (trainings, episodes).

    Wilson's interval of so many episodes, which has a width even where all or none are counted; where trainings differ so much that the
    bootstrap's is wider, that.
    """
    share = float(happened.mean())
    episodes = happened.shape[1]
    interval = binomtest(round(share * episodes), episodes).proportion_ci(CONFIDENCE, "wilson")
    low, high = float(interval.low), float(interval.high)
    if len(happened) > 1:
        drawn = resample(happened.astype(float)).mean_estimate()
        low, high = min(low, drawn.low), max(high, drawn.high)
    return Estimate(share, low, high)


@lru_cache(maxsize=8)
def _draws(size: int, stream: int, resamples: int) -> Vector:
    """How often each of ``size`` things is drawn, for each resample: shape (resamples, size)."""
    generator = np.random.default_rng((stream, size))
    counts = generator.multinomial(size, np.full(size, 1.0 / size), size=resamples).astype(float)
    counts.flags.writeable = False
    return counts


def _statistics(values: Vector, of_trainings: Vector, of_episodes: Vector) -> tuple[Vector, Vector]:
    """Means and interquartile means for each row of counts, (n, trainings) and (n, episodes)."""
    order = np.argsort(values, axis=None)
    order = order[: np.count_nonzero(np.isfinite(values))]
    training, episode = np.unravel_index(order, values.shape)
    ranked = values.ravel()[order]
    weights = of_episodes[:, episode]
    if len(values) > 1:
        weights = weights * of_trainings[:, training]
    reached = np.cumsum(weights, axis=1)
    total = np.where(reached[:, -1] > 0.0, reached[:, -1], np.nan)
    means = weights @ ranked / total
    low, high = _QUARTER * total[:, None], (1.0 - _QUARTER) * total[:, None]
    np.clip(reached, low, high, out=reached)
    # the part of each value's weight that lies between the quartiles, times the value
    inner = reached[:, -1] * ranked[-1] - low[:, 0] * ranked[0] - reached[:, :-1] @ np.diff(ranked)
    return means, inner / (high - low)[:, 0]


def _estimate(value: float, drawn: Vector) -> Estimate:
    found = drawn[np.isfinite(drawn)]
    if not np.isfinite(value) or len(found) == 0:
        return UNDEFINED
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = np.quantile(found, (tail, 1.0 - tail))
    return Estimate(float(value), float(low), float(high))
