"""Which agent is better: comparisons on the same episodes, and whether the agents of a task come in the order that is expected of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from lean_yaw_env.envs.tasks import task_named

from ..registry import agent_entry
from .episodes import Results, Row, direction, is_share, metric_row
from .intervals import UNDEFINED, Estimate

Verdict = Literal["better", "worse", "tie", "mixed"]
_VERDICTS: dict[int, Verdict] = {1: "better", -1: "worse", 0: "tie"}
ResultsByAgent = Mapping[str, Results]
"""Of one task."""


@dataclass(frozen=True)
class Comparison:
    """How an agent does against another in a metric, on the episodes that both have walked."""

    agent: str
    other: str
    metric: str
    mean: Estimate
    """The agent's mean less the other's."""
    iqm: Estimate
    """The same of interquartile means; NaN for a share."""
    verdict: Verdict
    """``better`` or ``worse`` by the mean, which counts every fall, if the interval of its difference leaves out zero, and ``tie`` otherwise;
    ``mixed`` if the interquartile means say the opposite."""
    episodes: int


def compare(first: Results, second: Results, metric: str) -> Comparison:
    """Compare two agents in a metric that has a direction."""
    episodes = min(first.episodes, second.episodes)
    difference = first.resampled(metric, episodes).less(second.resampled(metric, episodes))
    mean = difference.mean_estimate()
    iqm = UNDEFINED if is_share(first.task, metric) else difference.iqm_estimate()
    by_mean, by_iqm = (direction(first.task, metric) * _sign(each) for each in (mean, iqm))
    verdict = "mixed" if by_mean * by_iqm < 0 else _VERDICTS[by_mean]
    return Comparison(first.agent, second.agent, metric, mean, iqm, verdict, episodes)


def _sign(difference: Estimate) -> int:
    return int(difference.low > 0.0) - int(difference.high < 0.0)


def by_agent(results: Sequence[Results]) -> dict[str, Results]:
    """The agents of one task by name, ready to be compared: the trainings of each are drawn by themselves."""
    return {each.agent: replace(each, stream=k) for k, each in enumerate(results)}


def by_task(results: Sequence[Results]) -> dict[str, dict[str, Results]]:
    """Results by task and agent, ready to be compared."""
    return {
        task: by_agent([each for each in results if each.task == task])
        for task in dict.fromkeys(each.task for each in results)
    }


def compared_rows(results: Mapping[str, ResultsByAgent], threads: int = 1) -> list[Row]:
    """Rows of every task, its agents compared with one another; numpy's loops let threads share the tasks."""
    with ThreadPoolExecutor(threads) as pool:
        return [row for rows in pool.map(task_rows, results.values()) for row in rows]


def best_feedback(results: ResultsByAgent) -> str | None:
    """The feedback controller with the best mean of the task's headline; None if there is none."""
    names = [name for name in results if agent_entry(name).kind == "feedback"]
    if not names:
        return None
    task = results[names[0]].task
    headline = task_named(task).headline
    sign = direction(task, headline)
    return max(names, key=lambda name: sign * results[name].resampled(headline).mean)


def task_rows(results: ResultsByAgent) -> list[Row]:
    """A row for each metric of each agent, compared with the best feedback controller where there is one.

    What some episodes leave undefined, as the time to settle of an agent that never settles, is no ground to compare on.
    """
    rival = best_feedback(results)
    rows: list[Row] = []
    for name, mine in results.items():
        for metric in mine.metrics:
            row = metric_row(mine, metric)
            if rival not in (None, name) and _is_comparable(metric, mine, results[rival]):
                found = compare(mine, results[rival], metric)
                value, low, high = found.mean
                row = replace(
                    row, against=rival, difference=value, difference_low=low, difference_high=high,
                    verdict=found.verdict,
                )  # fmt: skip
            rows.append(row)
    return rows


def _is_comparable(metric: str, *results: Results) -> bool:
    return direction(results[0].task, metric) != 0 and all(
        np.isfinite(each.values(metric)).all() for each in results
    )


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


def expectations_of(task: str, results: ResultsByAgent) -> list[Expectation]:
    """Random below fixed, fixed below the best feedback controller, and that below whatever plans or has learned."""
    rival = best_feedback(results)
    pairs = [("random", "fixed")]
    if rival is not None:
        above = [name for name in results if agent_entry(name).kind in ("planner", "learned")]
        pairs += [("fixed", rival), *((rival, name) for name in above)]
    headline = task_named(task).headline
    found: list[Expectation] = []
    for worse, better in pairs:
        is_there = worse in results and better in results
        comparison = compare(results[better], results[worse], headline) if is_there else None
        found.append(Expectation(task, worse, better, comparison))
    return found
