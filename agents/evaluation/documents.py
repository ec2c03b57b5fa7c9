"""A leaderboard in words: Markdown with a table for each task, and what holds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from agents.evaluation.claims import Claim, Sample, claims_of, direction
from agents.evaluation.intervals import CONFIDENCE, RESAMPLES, Estimate
from agents.evaluation.push_levels import LevelRow
from agents.evaluation.results import RETURN, SURVIVAL, Row, is_share
from agents.evaluation.tables import estimate, number
from agents.registry import agent_entry
from lean_yaw_env.envs.tasks import task_named

_READING = """\
Every agent walks the same episodes, which no training and no tuning has seen. Of an agent that was trained several times all trainings are
pooled; it is the trainings that come with the package. **iqm** is the interquartile mean: the mean of the middle half of all episodes. It
forgives what goes wrong in fewer than a quarter of them, falls among it, so the mean stands beside the return's. An error is over the time
walked: of an agent that falls it says little without survival, the share of episodes that nothing but the time limit ended. In brackets:
{confidence:.0%} intervals by bootstrap ({resamples} resamples of the episodes and, where there are several, of the trainings: an interval holds for
another training on other episodes), of shares Wilson's. **against** compares the means of the task's headline, shown in bold type, with the best
feedback controller's on the same episodes: better or worse where the interval of the difference leaves out zero."""


@dataclass(frozen=True)
class Circumstances:
    """How a leaderboard was made.

    Attributes
    ----------
    command : str
    seed : int
    core_seconds : float
        Time the episodes took, summed over cores.
    machine : processor and versions, in words
    """

    command: str
    seed: int
    core_seconds: float
    machine: str


def leaderboard_page(
    rows: Sequence[Row],
    samples: Mapping[str, Mapping[str, Sample]],
    levels: Sequence[LevelRow],
    made: Circumstances,
) -> str:
    """The whole page."""
    tasks = list(samples)
    claims = [claim for task in tasks for claim in claims_of(task, samples[task])]
    parts = [
        "# Leaderboard",
        f"Written by `{made.command}`; not to be edited. Evaluation seed {made.seed}; the episodes took {_duration(made.core_seconds)} "
        f"of one core ({made.machine}).",
        _READING.format(confidence=CONFIDENCE, resamples=RESAMPLES),
        "All numbers, with those of metrics that only describe: [leaderboard.csv](leaderboard.csv).",
        "![Headline of each task with intervals](images/leaderboard.png)",
        "## What holds",
        *_claims_part(claims),
    ]
    for task in tasks:
        parts += [f"## {task}", task_named(task).summary, _task_table(task, rows)]
        parts.append(f"![Footprints](images/footprints_{task.lower()}.png)")
    if levels:
        parts += [
            "## Push at other levels",
            "Share of walkers on their feet after 200 steps, of the same agents.",
            _levels_table(levels),
            "![Survival against push level](images/push_levels.png)",
        ]
    return "\n\n".join(parts) + "\n"


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} seconds" if seconds < 300.0 else f"{seconds / 60.0:.0f} minutes"


def _claims_part(claims: Sequence[Claim]) -> list[str]:
    lines = [
        "Each by the task's headline. A claim holds if the interval of the difference of means leaves out zero.",
        _table(
            ("task", "headline", "claim", "holds", "difference of means", "of iqm"),
            [_claim_row(claim) for claim in claims],
        ),
    ]
    learned = dict.fromkeys(
        claim.better for claim in claims if agent_entry(claim.better).kind in ("learned", "planner")
    )
    for name in learned:
        mine = [claim for claim in claims if claim.better == name]
        holds = [f"{claim.task} ({claim.worse})" for claim in mine if claim.holds]
        fails = [f"{claim.task} ({_why_not(claim)})" for claim in mine if not claim.holds]
        lines.append(
            f"**{name}** is better than the best feedback controller on {_listed(holds)}"
            + (f"; not on {_listed(fails)}." if fails else ".")
        )
    return lines


def _claim_row(claim: Claim) -> tuple[str, ...]:
    said = f"{claim.worse} < {claim.better}"
    headline = task_named(claim.task).headline.replace("_", " ")
    comparison = claim.comparison
    if comparison is None:
        return (claim.task, headline, said, "not evaluated", "", "")
    return (
        claim.task,
        headline,
        said,
        "yes" if claim.holds else f"no: {_why_not(claim)}",
        _bracketed(comparison.mean, signed=True),
        _bracketed(comparison.iqm, signed=True),
    )


def _why_not(claim: Claim) -> str:
    if claim.comparison is None:
        return "not evaluated"
    words = {
        "worse": f"{claim.better} is worse than {claim.worse}",
        "tie": f"no difference to {claim.worse} is shown",
        "mixed": f"mean and iqm disagree against {claim.worse}",
    }
    return words[claim.comparison.verdict]


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) if names else "no task"


def _task_table(task: str, rows: Sequence[Row]) -> str:
    of_task = [row for row in rows if row.task == task]
    headline = task_named(task).headline
    metrics = [
        metric
        for metric in dict.fromkeys(row.metric for row in of_task)
        if direction(task, metric) and metric not in (RETURN, SURVIVAL)
    ]
    metrics.sort(key=lambda metric: metric != headline)
    cells = {(row.agent, row.metric): row for row in of_task}
    rivals = [row.against for row in of_task if row.against is not None]
    titles = [
        "agent",
        "kind",
        "trainings",
        "episodes",
        _title(task, RETURN, headline),
        "return, mean",
    ]
    titles += [_title(task, metric, headline) for metric in metrics]
    titles += [SURVIVAL, f"against {rivals[0]}" if rivals else "against"]
    lines: list[tuple[str, ...]] = []
    for agent in dict.fromkeys(row.agent for row in of_task):
        first = cells[agent, RETURN]
        head = cells[agent, headline]
        lines.append(
            (
                agent,
                agent_entry(agent).kind,
                str(first.trainings) if agent_entry(agent).kind == "learned" else "",
                str(first.episodes),
                _cell(first),
                _cell(first, mean=True),
                *(_cell(cells[agent, metric]) for metric in metrics),
                _cell(cells[agent, SURVIVAL]),
                head.verdict or ("best feedback" if rivals and agent == rivals[0] else ""),
            )
        )
    return _table(titles, lines)


def _title(task: str, metric: str, headline: str) -> str:
    words = metric.replace("_", " ")
    kind = "share" if is_share(task, metric) else "iqm"
    arrow = "↑" if direction(task, metric) > 0 else "↓"
    shown = f"**{words}**" if metric == headline else words
    return f"{shown}, {kind} {arrow}"


def _levels_table(rows: Sequence[LevelRow]) -> str:
    levels = sorted({each.level for each in rows})
    cells = {(each.row.agent, each.level): each.row for each in rows}
    agents = dict.fromkeys(each.row.agent for each in rows)
    return _table(
        ["agent", *(f"{level:g}" for level in levels)],
        [(agent, *(_cell(cells[agent, level]) for level in levels)) for agent in agents],
    )


def _cell(row: Row, *, mean: bool = False) -> str:
    whole = mean or is_share(row.task, row.metric)
    return _bracketed(Estimate(*estimate(row, mean=whole)))


def _bracketed(found: Estimate, *, signed: bool = False) -> str:
    if math.isnan(found.value):
        return ""
    plus = "+" if signed and found.value > 0.0 else ""
    return f"{plus}{number(found.value)} [{number(found.low)}, {number(found.high)}]"


def _table(titles: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    rule = ["---"] * len(titles)
    return "\n".join("| " + " | ".join(line) + " |" for line in (titles, rule, *lines))
