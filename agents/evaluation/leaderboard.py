"""The leaderboard: every agent at every task, written as one page with its numbers and pictures."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from pathlib import Path

from agents.agent import Agent
from agents.evaluation.agenda import Entrant
from agents.evaluation.documents import Circumstances, leaderboard_page
from agents.evaluation.pictures import save_agents_footprints
from agents.evaluation.plots import save_leaderboard_plot, save_push_levels_plot
from agents.evaluation.push_levels import LevelRow, level_entrants, level_rows
from agents.evaluation.reporting import Evaluation, by_task, task_rows
from agents.evaluation.results import Row
from agents.evaluation.tables import rows_to_csv
from agents.registry import AgentRequest, env_id_of, make_agent
from agents.seeds import evaluation_seed
from agents.versions import package_versions
from lean_yaw_env.files import written_whole

PAGE_FILE = "leaderboard.md"
NUMBERS_FILE = "leaderboard.csv"
LEVELS_FILE = "push_levels.csv"
IMAGES = "images"


def make_leaderboard(
    tasks: Sequence[str],
    names: Sequence[str],
    evaluation: Evaluation,
    out: Path,
    command: str,
) -> list[Row]:
    """Evaluate agents at tasks, and Push's at other levels, and write page, numbers and pictures into a folder.

    Parameters
    ----------
    tasks, names : as for ``reporting.evaluate_named``
    evaluation : Evaluation
    out : folder, which is made if it is not there
    command : what is said to have made it

    Raises
    ------
    ValueError
        If a name or number is bad, or a trained agent is not found.
    """
    entrants = evaluation.entrants(tasks, names)
    walked = evaluation.walk([*entrants, *level_entrants(entrants)])
    samples = by_task(walked[: len(entrants)])
    rows = task_rows(samples, evaluation.processes)
    level_results = level_rows(walked)
    made = Circumstances(
        command, evaluation.seed, sum(each.seconds for each in walked), machine_in_words()
    )
    images = out / IMAGES
    images.mkdir(parents=True, exist_ok=True)
    save_leaderboard_plot(rows, images / "leaderboard.png")
    if level_results:
        save_push_levels_plot(level_results, images / "push_levels.png")
        _write_text(out / LEVELS_FILE, _levels_to_csv(level_results))
    save_footprints(entrants, images, seed=evaluation.seed)
    _write_text(out / NUMBERS_FILE, rows_to_csv(rows))
    _write_text(out / PAGE_FILE, leaderboard_page(rows, samples, level_results, made))
    return rows


def save_footprints(entrants: Sequence[Entrant], images: Path, *, seed: int = 0) -> None:
    """Write a picture for each task, ``footprints_<task>.png``: the agents on its first episode."""
    images.mkdir(parents=True, exist_ok=True)
    for task in dict.fromkeys(entrant.task for entrant in entrants):
        present = [entrant for entrant in entrants if entrant.task == task]
        save_agents_footprints(
            {entrant.agent: _first_agent(entrant, seed) for entrant in present},
            task,
            images / f"footprints_{task.lower()}.png",
            seed=evaluation_seed(seed),
            options=present[0].options,
        )


def machine_in_words() -> str:
    """Processor, cores and the versions that numbers depend on."""
    versions = ", ".join(f"{name} {version}" for name, version in package_versions().items())
    return f"{platform.machine()}, {os.cpu_count()} cores, {versions}"


def _first_agent(entrant: Entrant, seed: int) -> Agent:
    """The agent; of several trainings the first."""
    request = AgentRequest(
        env_id_of(entrant.task),
        entrant.options,
        seed=evaluation_seed(seed),
        path=entrant.folders[0],
        runs=None,
    )
    return make_agent(entrant.agent, request)


def _levels_to_csv(rows: Sequence[LevelRow]) -> str:
    lines = ["level,agent,share,low,high,episodes,trainings"]
    lines += [
        f"{each.level:g},{each.row.agent},{each.row.mean!r},{each.row.low!r},{each.row.high!r},"
        f"{each.row.episodes},{each.row.trainings}"
        for each in rows
    ]
    return "\n".join(lines) + "\n"


def _write_text(path: Path, text: str) -> None:
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
