"""Means and interquartile means with 95 % intervals, and differences between agents, by bootstrap.

Means with survival beside them come first, as they count every fall; interquartile means stand beside. As Agarwal et al. (2021, "Deep reinforcement learning at the edge of the statistical precipice") ask for, intervals are
those of a percentile bootstrap, each task drawn for itself. What is drawn anew are the episodes and, of an agent that was trained several
times, the trainings too, so that an interval holds for another training on other episodes. All trainings walk the same episodes: rows and
columns of one table are drawn, each once for the whole of it (Owen, 2007, "The pigeonhole bootstrap", Annals of Applied Statistics 1), which
errs towards wide intervals. Every agent gets the same draws of episodes, so that differences are those of pairs.
Their library, rliable, draws along one axis only.

The time to a fall is that of walkers that never stop being pushed, and the natural measure of how stable they are (Byl and Tedrake, 2009, "Metastable
walking machines", IJRR 28): see ``time_per_fall_estimate``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest, chi2

from lean_yaw_env.parameters import Vector

CONFIDENCE = 0.95
RESAMPLES = 2000
HYPOTHESIS_RESAMPLES = 10_000
"""Of what is tested: the smallest p-value is 2 / (HYPOTHESIS_RESAMPLES + 1), and Holm's first limit is 0.05 over the number of hypotheses."""
_BLOCK = 500_000  # values drawn at a time: some megabytes
_QUARTER = 0.25


class Estimate(NamedTuple):
    """A number with its 95 % interval; NaN where there is nothing to estimate it from. With a low end alone it is a lower bound."""

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
    if values.size == 0:
        raise ValueError(
            f"values must hold one training and one episode or more, got shape {values.shape}"
        )
    defined = values[np.isfinite(values)]
    if len(defined) == 0 or defined.min() == defined.max():  # resampling has nothing to draw
        only = float(defined[0]) if len(defined) else math.nan
        constant = np.full(resamples, only)
        return Resampled(only, only, constant, constant)
    mean, iqm = _statistics(values, *(np.ones((1, size)) for size in values.shape))
    blocks = [_statistics(values, *drawn) for drawn in _draws(values.shape, stream, resamples)]
    means, iqms = (np.concatenate(each) for each in zip(*blocks, strict=True))
    return Resampled(float(mean[0]), float(iqm[0]), means, iqms)


def resample_time_per_fall(
    times: Vector, falls: Vector, stream: int = 0, resamples: int = RESAMPLES
) -> Resampled:
    """log10 of the time walked per fall, of times and numbers of falls (trainings, episodes), with draws as ``resample``'s.

    So that every draw has a finite one, one without a fall counts half a fall.
    """

    def logarithms(of_trainings: Vector, of_episodes: Vector) -> Vector:
        time, count = (((of_trainings @ each) * of_episodes).sum(axis=1) for each in (times, falls))
        return np.log10(time / np.maximum(count, 0.5))

    (own,) = logarithms(*(np.ones((1, size)) for size in times.shape))
    drawn = [logarithms(*each) for each in _draws(times.shape, stream, resamples)]
    return Resampled(float(own), math.nan, np.concatenate(drawn), np.full(resamples, math.nan))


def time_per_fall_estimate(times: Vector, falls: Vector) -> Estimate:
    """log10 of the mean time to a fall, from times walked and numbers of falls (trainings, episodes).

    Walkers under persistent pushes forget how they began, so that their times to a fall are nearly exponential. The maximum-likelihood estimate is then the
    time of all walks over the number of falls: walks that the horizon ends add time and no fall. The interval is the exact one of a Poisson number of falls
    in that time (Garwood, 1936, "Fiducial limits for the Poisson distribution", Biometrika 28), from quantiles of chi-square; where trainings differ so much
    that the bootstrap's is wider, that. Without a fall there is its lower end alone.
    """
    time, count = float(times.sum()), float(falls.sum())
    tail = 0.5 * (1.0 - CONFIDENCE)
    low = math.log10(2.0 * time / chi2.isf(tail, 2.0 * count + 2.0))
    if count == 0.0:
        return Estimate(math.nan, low, math.nan)
    high = math.log10(2.0 * time / chi2.ppf(tail, 2.0 * count))
    if len(times) > 1:
        drawn = resample_time_per_fall(times, falls).mean_estimate()
        low, high = min(low, drawn.low), max(high, drawn.high)
    return Estimate(math.log10(time / count), low, high)


def equal_rates_p_value(times: Sequence[float], falls: Sequence[float]) -> float:
    """Two-sided, of two walkers falling equally often per time: given all falls, those of the first are binomial (Przyborowski and Wilenski, 1940,
    "Homogeneity of results in testing samples from Poisson series", Biometrika 31)."""
    total = round(sum(falls))
    return float(binomtest(round(falls[0]), total, times[0] / sum(times)).pvalue) if total else 1.0


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


def _draws(shape: tuple[int, ...], stream: int, resamples: int) -> Iterator[tuple[Vector, Vector]]:
    """How often each training and each episode is drawn, for some resamples at a time: (n, trainings) and (n, episodes)."""
    trainings, episodes = shape
    generators = [np.random.default_rng(each) for each in ((1 + stream, trainings), (0, episodes))]
    most = max(1, _BLOCK // (trainings * episodes))
    for start in range(0, resamples, most):
        n = min(most, resamples - start)
        yield (_counts(generators[0], n, trainings), _counts(generators[1], n, episodes))


def _counts(generator: np.random.Generator, n: int, size: int) -> Vector:
    """How often each of ``size`` things is among as many drawn, n times: shape (n, size)."""
    drawn = generator.integers(size, size=(n, size)) + size * np.arange(n)[:, None]
    return np.bincount(drawn.ravel(), minlength=n * size).reshape(n, size).astype(float)


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
