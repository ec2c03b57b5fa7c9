"""Which agent is better: comparisons on the same episodes, and hypotheses whose p-values are corrected for how many there are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from lean_yaw_env.envs.tasks import task_named

from ..registry import AGENTS
from .episodes import TIME_PER_FALL, Results, Row, direction, is_share, metric_row
from .intervals import CONFIDENCE, UNDEFINED, Estimate, equal_rates_p_value, holm

Verdict = Literal["better", "worse", "tie", "mixed"]
ResultsByAgent = Mapping[str, Results]
"""Of one task."""
Rivals = Mapping[str, str | None]
"""By task, the feedback controller that agents are compared with; None where there is none."""
ENTERED = "entered"
"""Kind of an agent that is not of this package."""


def kind_of(agent: str) -> str:
    """The kind of an agent of the registry, or ``ENTERED``."""
    return AGENTS[agent].kind if agent in AGENTS else ENTERED


def by_task(results: Sequence[Results]) -> dict[str, dict[str, Results]]:
    """Results by task and agent."""
    return {
        task: {each.agent: each for each in results if each.task == task}
        for task in dict.fromkeys(each.task for each in results)
    }


def best_feedback(results: ResultsByAgent) -> str | None:
    """The feedback controller with the best mean of the task's headline; None if there is none."""
    names = [name for name in results if kind_of(name) == "feedback"]
    if not names:
        return None
    task = results[names[0]].task
    headline = task_named(task).headline
    sign = direction(task, headline)
    return max(names, key=lambda name: sign * results[name].resampled(headline).mean)


def rivals_of(results: Mapping[str, ResultsByAgent]) -> dict[str, str | None]:
    """Each task's best feedback controller."""
    return {task: best_feedback(of_task) for task, of_task in results.items()}


class Comparison(NamedTuple):
    """An agent less another in a metric, on the episodes that both have walked."""

    mean: Estimate
    """The difference of the means."""
    iqm: Estimate
    """The difference of the interquartile means; NaN for a share."""
    p_value: float
    """Two-sided, of the means being equal; no smaller than a sign test's can be on so few episodes, nor than that of equal rates of falls."""
    episodes: int


def compare(first: Results, second: Results, metric: str) -> Comparison:
    """Compare two agents in a metric; of the time per fall, one that never falls counts half a fall."""
    episodes = min(first.episodes, second.episodes)
    difference = first.resampled(metric, episodes).less(second.resampled(metric, episodes))
    iqm = UNDEFINED if is_share(first.task, metric) else difference.iqm_estimate()
    p_value = max(difference.p_value(), 2.0 ** (1 - episodes))
    if metric == TIME_PER_FALL:
        # the bootstrap draws trainings too, but knows little of falls that are few
        sums = zip(
            *([each.sum() for each in one.falls(episodes)] for one in (first, second)), strict=True
        )
        p_value = max(p_value, equal_rates_p_value(*sums))
    return Comparison(difference.mean_estimate(), iqm, p_value, episodes)


@dataclass(frozen=True)
class Hypothesis:
    """That one agent is better than another at a task, by the mean of its headline, which counts every fall."""

    task: str
    better: str
    worse: str
    comparison: Comparison
    p_value: float
    """Corrected for the number of hypotheses."""

    @property
    def verdict(self) -> Verdict:
        """``better`` or ``worse`` if the corrected p-value is below 0.05, and ``tie`` otherwise; ``mixed`` if the interval of the difference of
        the interquartile means lies on the other side of zero."""
        if not self.p_value < 1.0 - CONFIDENCE:
            return "tie"
        sign = direction(self.task, task_named(self.task).headline)
        mean, iqm = (sign * np.array(each) for each in (self.comparison.mean, self.comparison.iqm))
        if mean[0] > 0.0:
            return "mixed" if (iqm < 0.0).all() else "better"
        return "mixed" if (iqm > 0.0).all() else "worse"

    @property
    def holds(self) -> bool:
        return self.verdict == "better"


def hypotheses_of(
    results: Mapping[str, ResultsByAgent], rivals: Rivals, threads: int = 1
) -> list[Hypothesis]:
    """Every hypothesis: the fixed controller against random actions, and every other agent against its task's rival, as the better one; none of tasks that
    rank nobody.

    numpy's loops let threads share the comparisons.
    """
    pairs: list[tuple[str, str, str]] = []
    for task, of_task in results.items():
        if not task_named(task).is_ranked:
            continue
        rival = rivals.get(task)
        if "random" in of_task and "fixed" in of_task:
            pairs.append((task, "fixed", "random"))
        if rival is not None and rival in of_task:
            pairs += [(task, name, rival) for name in of_task if name != rival]

    def compared(pair: tuple[str, str, str]) -> Comparison:
        task, better, worse = pair
        return compare(results[task][better], results[task][worse], task_named(task).headline)

    with ThreadPoolExecutor(threads) as pool:
        comparisons = list(pool.map(compared, pairs))
    corrected = holm([each.p_value for each in comparisons])
    return [
        Hypothesis(*pair, comparison, p_value)
        for pair, comparison, p_value in zip(pairs, comparisons, corrected, strict=True)
    ]


def compared_rows(
    results: Mapping[str, ResultsByAgent], rivals: Rivals, threads: int = 1
) -> tuple[list[Row], list[Hypothesis]]:
    """A row for each metric of each agent, compared with the task's rival where there is one; and the hypotheses.

    What some episodes leave undefined, as the time to settle of an agent that never settles, is no ground to compare on.
    """
    hypotheses = hypotheses_of(results, rivals, threads)
    against = {
        (each.task, each.better): each for each in hypotheses if each.worse == rivals.get(each.task)
    }
    everything = [each for of_task in results.values() for each in of_task.values()]

    def rows_of(mine: Results) -> list[Row]:
        rival = results[mine.task].get(rivals.get(mine.task) or "")
        rows = [_compared(metric_row(mine, metric), mine, rival) for metric in mine.metrics]
        hypothesis, headline = against.get((mine.task, mine.agent)), task_named(mine.task).headline
        if hypothesis is None:
            return rows
        found = {"p_value": hypothesis.p_value, "verdict": hypothesis.verdict}
        return [replace(row, **found) if row.metric == headline else row for row in rows]

    with ThreadPoolExecutor(threads) as pool:
        return [row for rows in pool.map(rows_of, everything) for row in rows], hypotheses


def _compared(row: Row, mine: Results, rival: Results | None) -> Row:
    """The row with its difference from the rival's, where that means something."""
    if rival is None or rival is mine or direction(row.task, row.metric) == 0:
        return row
    if row.metric != TIME_PER_FALL and not all(
        np.isfinite(each.values(row.metric)).all() for each in (mine, rival)
    ):
        return row
    value, low, high = compare(mine, rival, row.metric).mean
    return replace(
        row, against=rival.agent, difference=value, difference_low=low, difference_high=high
    )
