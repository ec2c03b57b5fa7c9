"""The leaderboard: every agent at every task, as one page with its numbers and pictures."""

from __future__ import annotations

import math
import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.files import write_text

from ..agent import Agent
from ..policies.policy import package_versions
from ..registry import AgentRequest, agent_entry, env_id_of, make_agent
from ..seeds import evaluation_seed
from .comparison import (
    Expectation,
    Sample,
    compared_rows,
    direction,
    expectations_of,
    samples_by_task,
)
from .episodes import RETURN, SURVIVAL, Row, is_share, metric_row
from .footprint_pictures import save_agents_footprints
from .intervals import CONFIDENCE, RESAMPLES, Estimate
from .plan import Candidate, CandidateResults, Evaluation
from .plots import save_leaderboard_plot, save_push_levels_plot
from .row_tables import estimate, number, rows_to_csv

PAGE_FILE = "leaderboard.md"
NUMBERS_FILE = "leaderboard.csv"
LEVELS_FILE = "push_levels.csv"
IMAGES = "images"
LEVELS_TASK, LEVELS_METRIC = "Push", "survived_200_steps"
"""What is evaluated at other push levels too, by which metric."""
LEVELS = (0.2, 0.4, 0.6, 0.8, 1.0)

_READING = """\
All agents walk the same episodes. No training and no tuning has used them. If an agent was trained several times, its trainings (those of the
package) are pooled.

- **iqm** is the interquartile mean: the mean of the middle half of all episodes. It does not show what happens in fewer than a quarter of the
  episodes, such as rare falls. The table therefore also gives the mean of the return.
- **survival** is the share of episodes that the time limit or a success ended. Errors are averaged over the time before a fall; the error of an agent that
  often falls means little without its survival.
- Brackets contain {confidence:.0%} confidence intervals: bootstrap intervals ({resamples} resamples) for means, Wilson intervals for shares. The
  bootstrap resamples the episodes and, if there are several, the trainings. Such an interval is valid for another training on other episodes.
- **against** compares the mean of the task's main metric (in bold type) with that of the best feedback controller on the same episodes. It says
  "better" or "worse" if the interval of the difference does not contain zero."""

Levels = Mapping[float, Sequence[Row]]
"""By push level, a row for each agent."""


def level_candidates(
    candidates: Sequence[Candidate], levels: Sequence[float] = LEVELS
) -> list[Candidate]:
    """The agents of Push once for each level."""
    return [
        replace(candidate, options=replace(candidate.options, push_level=level))
        for level in levels
        for candidate in candidates
        if candidate.task == LEVELS_TASK
    ]


def level_rows(found: Sequence[CandidateResults]) -> dict[float, list[Row]]:
    """By push level, how many walkers of each agent of Push survive; the task's own level among them."""
    rows: dict[float, list[Row]] = {}
    for each in found:
        if each.candidate.task == LEVELS_TASK:
            level = each.candidate.options.push_level
            own = task_named(LEVELS_TASK).push_level if level is None else level
            rows.setdefault(own, []).append(metric_row(each.results, LEVELS_METRIC))
    return dict(sorted(rows.items()))


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


def make_leaderboard(
    candidates: Sequence[Candidate],
    evaluation: Evaluation,
    out: Path,
    command: str,
) -> list[Row]:
    """Evaluate agents at their tasks, and Push's at other levels, and write page, numbers and pictures into a folder.

    Parameters
    ----------
    candidates : of ``evaluation``
    out : folder, which is made if it is not there
    command : what is said to have made it

    Raises
    ------
    ValueError
        If a number is bad, or an agent cannot be made.
    """
    found = evaluation.run([*candidates, *level_candidates(candidates)])
    samples = samples_by_task([each.results for each in found[: len(candidates)]])
    rows = compared_rows(samples, evaluation.processes)
    levels = level_rows(found)
    made = Circumstances(
        command, evaluation.seed, sum(each.seconds for each in found), machine_in_words()
    )
    images = out / IMAGES
    images.mkdir(parents=True, exist_ok=True)
    save_leaderboard_plot(rows, images / "leaderboard.png")
    if levels:
        save_push_levels_plot(levels, images / "push_levels.png")
        write_text(out / LEVELS_FILE, _levels_to_csv(levels))
    save_footprints(candidates, images, seed=evaluation.seed)
    write_text(out / NUMBERS_FILE, rows_to_csv(rows))
    write_text(out / PAGE_FILE, leaderboard_page(rows, samples, levels, made))
    return rows


def save_footprints(candidates: Sequence[Candidate], images: Path, *, seed: int = 0) -> None:
    """Write a picture for each task, ``footprints_<task>.png``: the agents on its first episode."""
    images.mkdir(parents=True, exist_ok=True)
    for task in dict.fromkeys(candidate.task for candidate in candidates):
        present = [candidate for candidate in candidates if candidate.task == task]
        save_agents_footprints(
            {candidate.agent: _first_agent(candidate, seed) for candidate in present},
            task,
            images / f"footprints_{task.lower()}.png",
            seed=evaluation_seed(seed),
            options=present[0].options,
        )


def machine_in_words() -> str:
    """Processor, cores and the versions that numbers depend on."""
    versions = ", ".join(f"{name} {version}" for name, version in package_versions().items())
    return f"{platform.machine()}, {os.cpu_count()} cores, {versions}"


def _first_agent(candidate: Candidate, seed: int) -> Agent:
    """The agent; of several trainings the first."""
    request = AgentRequest(
        env_id_of(candidate.task),
        candidate.options,
        seed=evaluation_seed(seed),
        path=candidate.folders[0],
        runs=None,
    )
    return make_agent(candidate.agent, request)


def _levels_to_csv(levels: Levels) -> str:
    lines = ["level,agent,share,low,high,episodes,trainings"]
    lines += [
        f"{level:g},{row.agent},{row.mean!r},{row.low!r},{row.high!r},{row.episodes},{row.trainings}"
        for level, rows in levels.items()
        for row in rows
    ]
    return "\n".join(lines) + "\n"


def leaderboard_page(
    rows: Sequence[Row],
    samples: Mapping[str, Mapping[str, Sample]],
    levels: Levels,
    made: Circumstances,
) -> str:
    """The whole page."""
    tasks = list(samples)
    expectations = [
        expectation for task in tasks for expectation in expectations_of(task, samples[task])
    ]
    parts = [
        "# Leaderboard",
        f"This page is generated by `{made.command}`. Do not edit it. The evaluation seed is {made.seed}. "
        f"The episodes took {_duration(made.core_seconds)} on one core ({made.machine}).",
        _READING.format(confidence=CONFIDENCE, resamples=RESAMPLES),
        "[leaderboard.csv](leaderboard.csv) contains all numbers, also those of metrics without a preferred direction.",
        "![Main metric of each task with confidence intervals](images/leaderboard.png)",
        "## Comparisons",
        *_expectations_part(expectations),
    ]
    for task in tasks:
        parts += [f"## {task}", task_named(task).summary, _task_table(task, rows)]
        parts.append(
            f"![Footprints of all agents in the same episode](images/footprints_{task.lower()}.png)"
        )
    if levels:
        parts += [
            "## Push at other push levels",
            "Share of walkers that survive 200 steps, with the same agents.",
            _levels_table(levels),
            "![Survival against push level](images/push_levels.png)",
        ]
    return "\n\n".join(parts) + "\n"


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} seconds" if seconds < 300.0 else f"{seconds / 60.0:.0f} minutes"


def _expectations_part(expectations: Sequence[Expectation]) -> list[str]:
    lines = [
        'Each comparison uses the task\'s main metric. "A < B" holds if the confidence interval of the difference of the means does not contain zero.',
        _table(
            (
                "task",
                "main metric",
                "comparison",
                "holds",
                "difference of means",
                "difference of iqm",
            ),
            [_expectation_row(each) for each in expectations],
        ),
    ]
    learned = dict.fromkeys(
        each.better
        for each in expectations
        if agent_entry(each.better).kind in ("learned", "planner")
    )
    for name in learned:
        mine = [each for each in expectations if each.better == name]
        holds = [f"{each.task} ({each.worse})" for each in mine if each.holds]
        fails = [f"{each.task} ({_why_not(each)})" for each in mine if not each.holds]
        lines.append(
            f"**{name}** is better than the best feedback controller on {_listed(holds)}"
            + (f"; not on {_listed(fails)}." if fails else ".")
        )
    return lines


def _expectation_row(expectation: Expectation) -> tuple[str, ...]:
    task, comparison = expectation.task, expectation.comparison
    said = (
        task,
        task_named(task).headline.replace("_", " "),
        f"{expectation.worse} < {expectation.better}",
    )
    if comparison is None:
        return (*said, "not evaluated", "", "")
    return (
        *said,
        "yes" if expectation.holds else f"no: {_why_not(expectation)}",
        _bracketed(comparison.mean, signed=True),
        _bracketed(comparison.iqm, signed=True),
    )


def _why_not(expectation: Expectation) -> str:
    if expectation.comparison is None:
        return "not evaluated"
    words = {
        "worse": f"{expectation.better} is worse than {expectation.worse}",
        "tie": f"no significant difference from {expectation.worse}",
        "mixed": "mean and iqm disagree",
    }
    return words[expectation.comparison.verdict]


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
                head.verdict or ("reference" if rivals and agent == rivals[0] else ""),
            )
        )
    return _table(titles, lines)


def _title(task: str, metric: str, headline: str) -> str:
    words = metric.replace("_", " ")
    kind = "share" if is_share(task, metric) else "iqm"
    arrow = "↑" if direction(task, metric) > 0 else "↓"
    shown = f"**{words}**" if metric == headline else words
    return f"{shown}, {kind} {arrow}"


def _levels_table(levels: Levels) -> str:
    cells = {(row.agent, level): row for level, rows in levels.items() for row in rows}
    agents = dict.fromkeys(agent for agent, _ in cells)
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
