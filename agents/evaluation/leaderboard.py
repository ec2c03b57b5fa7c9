"""The leaderboard: every agent at every task, as one page with its numbers and pictures."""

from __future__ import annotations

import math
import os
import platform
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from tqdm import tqdm

from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.files import write_text
from lean_yaw_env.tables import csv_table, markdown_table
from lean_yaw_env.validation import require_count

from ..agent import Agent
from ..policies.policy import package_versions
from ..references import normalised, references
from ..registry import AGENTS
from ..seeds import first_seed
from .capture import MOST_STEPS, CaptureReport, examine_capture, picture_name, save_captures
from .comparison import ENTERED, Hypothesis, by_task, compared_rows, kind_of, rivals_of
from .episodes import SURVIVAL, TIME_PER_FALL, Results, Row, direction, is_share, metric_row, words
from .intervals import CONFIDENCE, HYPOTHESIS_RESAMPLES, RESAMPLES
from .pictures import save_agents_footprints, save_leaderboard_plot, save_push_levels_plot
from .plan import (
    LONG_COSTLY_EPISODES,
    LONG_EPISODES,
    LONG_HORIZON,
    Candidate,
    Evaluation,
    make_candidate,
)
from .robustness import collapses
from .row_tables import IMAGES, bracketed, iqm, mean, number, rows_to_csv, rows_to_plain

LEVELS_TASK, LEVELS = "Metastable", (0.5, 0.7, 1.0)
"""What is evaluated at other push levels than its own too."""
LEAST, MOST = 0.3, 0.9
"""Normalised scores of the best agent between which a task is neither beyond all agents nor solved."""
_RANKED = ("planner", "learned", ENTERED)
"""Kinds that are expected to be better than the best feedback controller."""

_READING = """\
All agents walk the same test episodes. No training, no tuning and no choice has used them: nothing but the command above reads them. If an
agent was trained several times, its trainings (those of the package) are pooled.

- The first number of each agent is the **mean** of the task's main metric, which counts every fall. Beside it stands **survival**, the share of
  episodes that the time limit or a success ended, and the **iqm**, the interquartile mean: the mean of the middle half of all episodes, which does not show
  what happens in fewer than a quarter of them. Errors are averaged over the time before a fall; the error of an agent that often falls means little.
- Brackets contain {confidence:.0%} confidence intervals: bootstrap intervals ({resamples:,} resamples, {hypothesis_resamples:,} of main metrics) for means,
  Wilson intervals for shares. The bootstrap resamples the episodes and, if there are several, the trainings. Such an interval is valid for another
  training on other episodes.
- **log10 time per fall** is the time of all walks over their number of falls, as a power of ten. Walks are cut after {horizon:,.0f} time units; a walk that
  is still up then adds time and no fall. The interval is exact for falls that come at random, and wider where trainings differ. An agent that never
  falls has a lower bound (≥) only. A comparison of two agents counts half a fall for an agent without one, and its p-value is the larger one of the
  bootstrap's and that of the exact test of equal rates.
- **against** compares the mean of the main metric with that of the best feedback controller on the same episodes. Which controller that is was
  decided on the validation episodes, before the test episodes were read. "Better" and "worse" mean that the p-value, corrected for the number of
  all comparisons on this page by Holm's method, is below 0.05.
- **normalised** is the main metric's mean where 0 is the fixed controller's and 1 the reference's, the best result known (see below).
- **saves** is the share of disturbed starts that the agent saves, of those that an exhaustive search over {chosen_steps} chosen steps can save
  (see [findings](findings.md#what-learned-policies-save)); of the first of several trainings. Planners, agents that remember
  or draw, and agents of others have none."""

_ANSWERS = """\
| what was wrong in version 0 | what version 1 does |
| --- | --- |
| Commands were counted in steps, and rewards in time. Slow, long steps met fewer commands. | A command lasts a drawn time. The step across the horizon is paid to the horizon alone. No sweep of constant steps gains by their length; `tests/test_task_laws.py` tests this for each task. |
| Friction had no limit. | The friction limit of every task is 0.6, and a slip is a fall ([why 0.6](environments.md#friction)). |
| Level was solved by a linear law. | Level and LevelUphill are walked under pushes. Without pushes a linear law still came to 0.96 of the reference under the friction limit. |
| Slalom, Walk and Push were saturated, Heading nearly. | Slalom has stronger pushes. Metastable replaces Push: it measures the time to a fall. Walk ranks no agent. The table of what is left to win shows Heading as it is: the entry level. |
| The headline was survival of 200 steps, and the interquartile mean hid falls. | The mean, which counts every fall, stands first, and survival beside it. All limits are times. |
| Hidden bodies measured robustness, not adaptation. | The bodies of UnknownBody are twice as different, and its oracle shows what knowing the body is worth. |
| Agents were chosen on the episodes of the leaderboard, and p-values were not corrected. | Training, validation and test episodes are different by construction. Rivals are fixed before the test episodes are read. Holm's method corrects all hypotheses, and intervals resample trainings too. |
| mpc was a weak yardstick where its base was weak. | mpc plans around ppo, and references come from a search that sees the future. |"""

Levels = Mapping[float, Sequence[Row]]
"""By push level, a row for each agent."""
Saved = Mapping[tuple[str, str], float]
"""By task and agent, the share of what chosen steps can save that the agent saves."""


def make_leaderboard(
    candidates: Sequence[Candidate],
    evaluation: Evaluation,
    out: Path,
    command: str,
    others: Sequence[Results] = (),
    *,
    starts: int = 1024,
    points: int = 61,
) -> tuple[list[Row], list[Results]]:
    """Evaluate agents at their tasks, and Metastable's at other levels, and write page, numbers and pictures into a folder.

    Return the rows and the candidates' results at the tasks as they are.

    Parameters
    ----------
    candidates : of ``evaluation``
    evaluation : Evaluation
    out : folder, which is made if it is not there
    command : what is said to have made it
    others : results of agents that somebody else has evaluated on these test episodes
    starts, points : of the search for what can be saved, and to a side of its pictures

    Raises
    ------
    ValueError
        If a number is bad, or an agent cannot be made.
    SolverError
        If the integrator fails in the search for what can be saved.
    """
    require_count("starts", starts, 1, 1_000_000)
    require_count("points", points, 2, 2000)
    known = {(each.task, each.agent) for each in candidates}
    for each in others:
        if (each.task, each.agent) in known or each.agent in AGENTS:
            raise ValueError(f"results must be of another agent, got some of {each.agent!r} again")
    rivals = fixed_rivals(candidates, evaluation)
    evaluation = replace(evaluation, episode_set="test")
    found = evaluation.run([*candidates, *level_candidates(candidates)])
    made = {each: make_candidate(each, each.folders[0], evaluation.seed) for each in candidates}
    own = found[: len(candidates)]
    results = by_task([*own, *others])
    rows, hypotheses = compared_rows(results, rivals, evaluation.processes)
    rows = [_normalised(row) for row in rows]
    levels = level_rows(found)
    images = out / IMAGES
    images.mkdir(parents=True, exist_ok=True)
    save_leaderboard_plot(rows, images / "leaderboard.png")
    if levels:
        save_push_levels_plot(levels, images / "push_levels.png")
        write_text(out / "push_levels.csv", _levels_to_csv(levels))
    save_footprints(made, images, seed=evaluation.seed)
    write_text(out / "leaderboard.csv", rows_to_csv(rows))
    seconds = sum(each.seconds for each in found)
    duration = f"{seconds:.0f} seconds" if seconds < 300.0 else f"{seconds / 60.0:.0f} minutes"
    origin = (
        f"This page is generated by `{command}`. Do not edit it. The evaluation seed is {evaluation.seed}. "
        f"The episodes took {duration} on one core ({_machine()}). They are {evaluation.episodes:,} for each training, and "
        f"{evaluation.costly_episodes} for an agent that plans; {LONG_EPISODES} and {LONG_COSTLY_EPISODES} at most where the time to a fall is measured. "
        f"What can be saved is searched for {starts:,} starts."
    )
    captures: list[CaptureReport] = []
    hidden = not evaluation.progress
    for each in tqdm(made, "capturability", unit="agent", disable=hidden, file=sys.stderr):
        with suppress(ValueError):  # of planners, and of agents that remember or draw
            captures.append(
                examine_capture(each.agent, made[each], each.task, starts=starts, points=points)
            )
    save_captures(captures, images)
    saved = {(each.task, each.agent): each.share() for each in captures}
    page = leaderboard_page(rows, hypotheses, levels, saved, origin, out / "robustness.csv")
    write_text(out / "leaderboard.md", page)
    return rows, own


def fixed_rivals(candidates: Sequence[Candidate], evaluation: Evaluation) -> dict[str, str | None]:
    """The feedback controller that each task's agents are compared with: the best one on the validation episodes."""
    controllers = [each for each in candidates if kind_of(each.agent) == "feedback"]
    return rivals_of(by_task(replace(evaluation, episode_set="validation").run(controllers)))


def level_candidates(
    candidates: Sequence[Candidate], levels: Sequence[float] = LEVELS
) -> list[Candidate]:
    """The agents of ``LEVELS_TASK`` once for each level."""
    return [
        replace(candidate, options=replace(candidate.options, push_level=level))
        for level in levels
        for candidate in candidates
        if candidate.task == LEVELS_TASK
    ]


def level_rows(found: Sequence[Results]) -> dict[float, list[Row]]:
    """By push level, the time per fall of each agent of ``LEVELS_TASK``; the task's own level among them."""
    rows: dict[float, list[Row]] = {}
    for each in found:
        if each.task == LEVELS_TASK:
            level = each.options.for_task(task_named(LEVELS_TASK)).push_level
            rows.setdefault(level, []).append(metric_row(each, TIME_PER_FALL))
    return dict(sorted(rows.items()))


def save_footprints(made: Mapping[Candidate, Agent], images: Path, *, seed: int = 0) -> None:
    """Write a picture for each task, ``footprints_<task>.png``: the candidates' agents on its first validation episode."""
    images.mkdir(parents=True, exist_ok=True)
    for task in dict.fromkeys(each.task for each in made):
        save_agents_footprints(
            {
                each.agent: (agent, each.options)
                for each, agent in made.items()
                if each.task == task
            },
            task,
            images / f"footprints_{task.lower()}.png",
            seed=first_seed("validation", seed),
        )


def _machine() -> str:
    """Processor, cores and the versions that numbers depend on."""
    versions = ", ".join(f"{name} {version}" for name, version in package_versions().items())
    return f"{platform.machine()}, {os.cpu_count()} cores, {versions}"


def _levels_to_csv(levels: Levels) -> str:
    titles = ("level", "agent", "log10_time_per_fall", "low", "high", "episodes", "trainings")
    rows = [(level, row) for level, rows in levels.items() for row in rows]
    values = zip(rows_to_plain([row for _, row in rows]), rows, strict=True)
    names = ("agent", "mean", "low", "high", "episodes", "trainings")
    return csv_table(
        titles, ((f"{level:g}", *(plain[name] for name in names)) for plain, (level, _) in values)
    )


def leaderboard_page(
    rows: Sequence[Row],
    hypotheses: Sequence[Hypothesis],
    levels: Levels,
    saved: Saved,
    made: str,
    robustness: Path | None = None,
) -> str:
    """The whole page; ``made`` says how it was made. ``robustness`` is the file that ``python -m agents robustness`` wrote, if it is there."""
    reading = _READING.format(confidence=CONFIDENCE, resamples=RESAMPLES, hypothesis_resamples=HYPOTHESIS_RESAMPLES, chosen_steps=MOST_STEPS, horizon=LONG_HORIZON)  # fmt: skip
    parts = [
        "# Leaderboard",
        made,
        reading,
        "[leaderboard.csv](leaderboard.csv) contains all numbers, also those of metrics without a preferred direction. "
        "[Enter your agent](enter_your_agent.md) says how an agent from elsewhere gets onto this page.",
        "![Main metric of each task with confidence intervals](images/leaderboard.png)",
        "## What is left to win",
        *_standings(rows),
        "## What version 1 answers",
        _ANSWERS,
        "## Comparisons",
        *_comparisons(hypotheses),
    ]
    for task in dict.fromkeys(row.task for row in rows):
        parts += [
            f"## {task}",
            task_named(task).summary
            + ("" if task_named(task).is_ranked else " **A smoke test: it ranks no agent.**"),
            _task_table(task, [row for row in rows if row.task == task], saved),
            f"![Footprints of all agents in the same episode](images/footprints_{task.lower()}.png)",
        ]
        if any(each == task for each, _ in saved):
            parts.append(
                f"![Where each agent saves and loses states]({IMAGES}/{picture_name(task)})"
            )
    if levels:
        parts += [
            f"## {LEVELS_TASK} at other push levels",
            "log10 of the time per fall, with the same agents.",
            _levels_table(levels),
            "![Time per fall against push level](images/push_levels.png)",
        ]
    if robustness is not None and robustness.exists():
        parts += [
            "## Robustness",
            "Each agent under one changed option, without any adaptation ([all numbers](robustness.md)). These are the collapses: more than half of the main "
            "metric is lost, or 90 % of the time per fall.",
            markdown_table(("task", "agent", "as it is", "collapses under"), collapses(robustness)),
            "![Main metric under each changed option](images/robustness.png)",
        ]
    return "\n\n".join(parts) + "\n"


def _normalised(row: Row) -> Row:
    """A headline's row with its normalised score, where there is a reference."""
    found = normalised(row.task, row.score) if row.metric == task_named(row.task).headline else None
    return row if found is None else replace(row, normalised=found)


def _standings(rows: Sequence[Row]) -> list[str]:
    """Where the best agent of each ranked task stands between the fixed controller and the reference."""
    titles = ["task", "main metric", "fixed (0)", "reference (1)", "best agent", "its mean", "normalised", "room to win"]  # fmt: skip
    lines: list[list[str]] = []
    for task in dict.fromkeys(row.task for row in rows if task_named(row.task).is_ranked):
        headline = task_named(task).headline
        found = [
            row
            for row in rows
            if (row.task, row.metric) == (task, headline) and _sees_what_all_see(row.agent)
        ]
        best = max(found, key=lambda row: direction(task, headline) * row.score)
        line = [best.agent, bracketed(mean(best))]
        if (reference := references().get(task)) is None:
            lines.append([task, words(headline), "", "", *line, "", "not known: no reference"])
            continue
        share = best.normalised
        room = "yes" if LEAST <= share <= MOST else f"**no: {'nearly solved' if share > MOST else 'nobody comes near'}**"  # fmt: skip
        marks = [number(reference.fixed), f"{number(reference.value)} ({reference.found_by})"]
        lines.append([task, words(headline), *marks, *line, f"{share:.2f}", room])
    return [
        f"A task has room to win if its best agent lies between {LEAST} and {MOST} of the way from the fixed controller to the reference. References are found "
        "on validation episodes ([controllers](controllers.md)). Agents that know more than the observation are left out: mpc plans on copies of the true "
        "walker, and the oracle is shown the body.",
        markdown_table(titles, lines),
    ]


def _sees_what_all_see(agent: str) -> bool:
    """Whether an agent has nothing but the task's own observation."""
    return kind_of(agent) != "planner" and not (agent in AGENTS and AGENTS[agent].options)


def _comparisons(hypotheses: Sequence[Hypothesis]) -> list[str]:
    titles = ["task", "main metric", "comparison", "holds", "corrected p", "difference of means", "difference of iqm"]  # fmt: skip
    expected = [each for each in hypotheses if _is_expected(each)]
    lines = [
        'Each comparison uses the mean of the task\'s main metric. "A < B" holds if B is better with a corrected p-value below 0.05. '
        f"The correction is for {len(hypotheses)} comparisons: these and those of the remaining agents with the best feedback controller.",
        markdown_table(titles, [_hypothesis_row(each) for each in expected]),
    ]
    names = dict.fromkeys(each.better for each in expected)
    for name in (each for each in names if kind_of(each) in _RANKED):
        mine = [each for each in expected if each.better == name]
        holds = ", ".join(f"{each.task} ({each.worse})" for each in mine if each.holds)
        fails = ", ".join(f"{each.task} ({_why_not(each)})" for each in mine if not each.holds)
        lines.append(
            f"**{name}** is better than the best feedback controller on {holds or 'no task'}"
            + (f"; not on {fails}." if fails else ".")
        )
    return lines


def _is_expected(hypothesis: Hypothesis) -> bool:
    """Whether the better one is expected to be: not another feedback controller, nor a baseline against a feedback controller."""
    return kind_of(hypothesis.better) in _RANKED or hypothesis.worse == "random"


def _hypothesis_row(hypothesis: Hypothesis) -> list[str]:
    headline = words(task_named(hypothesis.task).headline)
    holds = "yes" if hypothesis.holds else f"no: {_why_not(hypothesis)}"
    differences = (bracketed(each, signed=True) for each in hypothesis.comparison[:2])
    p_value = f"{hypothesis.p_value:.2g}"
    return [
        hypothesis.task,
        headline,
        f"{hypothesis.worse} < {hypothesis.better}",
        holds,
        p_value,
        *differences,
    ]


def _why_not(hypothesis: Hypothesis) -> str:
    words = {
        "worse": f"{hypothesis.better} is worse than {hypothesis.worse}",
        "tie": f"no significant difference from {hypothesis.worse}",
        "mixed": "mean and iqm disagree",
    }
    return words[hypothesis.verdict]


def _task_table(task: str, rows: Sequence[Row], saved: Saved) -> str:
    headline = task_named(task).headline
    others = [
        metric
        for metric in dict.fromkeys(row.metric for row in rows)
        if direction(task, metric) and metric not in (headline, SURVIVAL)
    ]
    cells = {(row.agent, row.metric): row for row in rows}
    rival = next((row.against for row in rows if row.verdict), None)
    titles = ["agent", "kind", "trainings", "episodes", f"**{_title(task, headline)}**"]
    titles += [
        "normalised",
        _title(task, SURVIVAL),
        "iqm",
        *(_title(task, metric) for metric in others),
    ]
    titles += ["saves", f"against {rival}" if rival else "against"]
    lines: list[list[str]] = []
    for agent in dict.fromkeys(row.agent for row in rows):
        main, kind = cells[agent, headline], kind_of(agent)
        trainings = str(main.trainings) if kind in ("learned", ENTERED) else ""
        line = [agent, kind, trainings, str(main.episodes), bracketed(mean(main))]
        line.append("" if math.isnan(main.normalised) else f"{main.normalised:.3f}")
        line += [bracketed(mean(cells[agent, SURVIVAL])), bracketed(iqm(main))]
        line += [bracketed(mean(cells[agent, metric])) for metric in others]
        line.append(f"{saved[task, agent]:.1%}" if (task, agent) in saved else "")
        lines.append([*line, main.verdict or ("reference" if agent == rival else "")])
    return markdown_table(titles, lines)


def _title(task: str, metric: str) -> str:
    kind = ", share" if is_share(task, metric) else ", mean"
    arrow = "↑" if direction(task, metric) > 0 else "↓"
    return f"{words(metric)}{'' if metric == TIME_PER_FALL else kind} {arrow}"


def _levels_table(levels: Levels) -> str:
    cells = {(row.agent, level): row for level, rows in levels.items() for row in rows}
    agents = dict.fromkeys(agent for agent, _ in cells)
    return markdown_table(
        ["agent", *(f"{level:g}" for level in levels)],
        [[agent, *(bracketed(mean(cells[agent, level])) for level in levels)] for agent in agents],
    )
