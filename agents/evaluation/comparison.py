"""Which agent is better: comparisons on the same episodes, and whether the agents of a task come in the order that is expected of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from lean_yaw_env.envs.tasks import task_named

from ..registry import agent_entry
from .episodes import RETURN, SURVIVAL, Results, Row, is_share, metric_row
from .intervals import Estimate, Resampled, resample

Verdict = Literal["better", "worse", "tie", "mixed"]
_VERDICTS: dict[int, Verdict] = {1: "better", -1: "worse", 0: "tie"}


@dataclass
class Sample:
    """An agent's results with their resamples, each drawn once.

    Parameters
    ----------
    results : Results
    stream : int
        Another for each agent: see ``intervals.resample``.
    """

    results: Results
    stream: int = 0
    _drawn: dict[tuple[str, int], Resampled] = field(default_factory=dict)

    def drawn(self, metric: str, episodes: int | None = None) -> Resampled:
        """Resamples of a metric, of the first episodes or all."""
        count = self.results.episodes if episodes is None else episodes
        if (metric, count) not in self._drawn:
            values = self.results.values(metric)[:, :count]
            self._drawn[metric, count] = resample(values, self.stream)
        return self._drawn[metric, count]


@dataclass(frozen=True)
class Comparison:
    """How an agent does against another in a metric, on the episodes that both have walked.

    Attributes
    ----------
    agent, other, metric : str
    mean, iqm : Estimate
        The first's less the second's mean, and interquartile mean; the latter is NaN for a share.
    verdict : Verdict
        ``better`` or ``worse`` by the mean, which counts every fall, if the interval of its difference leaves out zero, and ``tie``
        otherwise; ``mixed`` if the interquartile means say the opposite.
    episodes : int
    """

    agent: str
    other: str
    metric: str
    mean: Estimate
    iqm: Estimate
    verdict: Verdict
    episodes: int


def direction(task: str, metric: str) -> int:
    """+1 for a metric of which more is better, -1 for one of which less is, 0 for one that only describes."""
    if metric in (RETURN, SURVIVAL):
        return 1
    known = task_named(task).metrics.get(metric)
    better = None if known is None else known.better
    return {"higher": 1, "lower": -1, None: 0}[better]


def compare(first: Sample, second: Sample, metric: str) -> Comparison:
    """Compare two agents in a metric that has a direction."""
    task = first.results.task
    episodes = min(first.results.episodes, second.results.episodes)
    less = first.drawn(metric, episodes).less(second.drawn(metric, episodes))
    mean, iqm = less.mean_estimate(), less.iqm_estimate()
    sign = direction(task, metric)
    by_mean, by_iqm = sign * _sign(mean), sign * _sign(iqm)
    if is_share(task, metric):
        iqm, by_iqm = Estimate(*[float("nan")] * 3), 0
    verdict = "mixed" if by_mean * by_iqm < 0 else _VERDICTS[by_mean]
    return Comparison(
        first.results.agent, second.results.agent, metric, mean, iqm, verdict, episodes
    )


def samples_of(results: Sequence[Results]) -> dict[str, Sample]:
    """The agents of one task by name, ready to be compared."""
    return {each.agent: Sample(each, stream) for stream, each in enumerate(results)}


def samples_by_task(results: Sequence[Results]) -> dict[str, dict[str, Sample]]:
    """Results by task and agent, ready to be compared."""
    return {
        task: samples_of([each for each in results if each.task == task])
        for task in dict.fromkeys(each.task for each in results)
    }


def compared_rows(samples: Mapping[str, Mapping[str, Sample]], threads: int = 1) -> list[Row]:
    """Rows of every task, its agents compared with one another; numpy's loops let threads share the tasks."""
    with ThreadPoolExecutor(threads) as pool:
        return [row for rows in pool.map(task_rows, samples.values()) for row in rows]


def best_feedback(samples: Mapping[str, Sample]) -> str | None:
    """The feedback controller with the best mean of the task's headline; None if there is none."""
    names = [name for name in samples if agent_entry(name).kind == "feedback"]
    if not names:
        return None
    task = samples[names[0]].results.task
    headline = task_named(task).headline
    sign = direction(task, headline)
    return max(names, key=lambda name: sign * samples[name].drawn(headline).mean)


def task_rows(samples: Mapping[str, Sample]) -> list[Row]:
    """A row for each metric of each agent, compared with the best feedback controller where there is one.

    What some episodes leave undefined, as the time to settle of an agent that never settles, is no ground to compare on.
    """
    rival = best_feedback(samples)
    rows: list[Row] = []
    for name, sample in samples.items():
        for metric in (*sample.results.metrics, SURVIVAL):
            row = metric_row(sample.results, metric, sample.drawn(metric))
            if (
                rival is not None
                and name != rival
                and _is_comparable(metric, sample, samples[rival])
            ):
                row = _with_comparison(row, compare(sample, samples[rival], metric))
            rows.append(row)
    return rows


def _is_comparable(metric: str, *samples: Sample) -> bool:
    if direction(samples[0].results.task, metric) == 0:
        return False
    return all(np.isfinite(sample.results.values(metric)).all() for sample in samples)


def _with_comparison(row: Row, comparison: Comparison) -> Row:
    value, low, high = comparison.mean
    return replace(
        row,
        against=comparison.other,
        difference=value,
        difference_low=low,
        difference_high=high,
        verdict=comparison.verdict,
    )


def _sign(difference: Estimate) -> int:
    if difference.low > 0.0:
        return 1
    return -1 if difference.high < 0.0 else 0


@dataclass(frozen=True)
class Expectation:
    """Whether one agent is better than another at a task, by its headline; ``comparison`` is None where one of them is missing."""

    task: str
    worse: str
    better: str
    comparison: Comparison | None

    @property
    def holds(self) -> bool:
        return self.comparison is not None and self.comparison.verdict == "better"


def expectations_of(task: str, samples: Mapping[str, Sample]) -> list[Expectation]:
    """Random below fixed, fixed below the best feedback controller, and that below whatever plans or has learned."""
    rival = best_feedback(samples)
    pairs = [("random", "fixed")]
    if rival is not None:
        pairs.append(("fixed", rival))
        pairs += [
            (rival, name) for name in samples if agent_entry(name).kind in ("planner", "learned")
        ]
    headline = task_named(task).headline
    return [
        Expectation(
            task,
            worse,
            better,
            compare(samples[better], samples[worse], headline)
            if worse in samples and better in samples
            else None,
        )
        for worse, better in pairs
    ]
