"""Agents examined as closed loops, and the page about them; ``python -m agents closed-loop``."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from tqdm import tqdm

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.errors import LeanYawError
from lean_yaw_env.files import write_text

from ..agent import Agent
from ..registry import AgentRequest, env_id_of, make_agent
from .closed_loop_pictures import save_basins, save_eigenvalues, save_pushes
from .closed_loop_report import (
    ClosedLoopReport,
    csv_text,
    eigenvalue_table,
    examine,
    markdown_page,
    picture_name,
    terminal_table,
)

IMAGES = "images"
"""Folder of the pictures beside the page."""
_PICTURES = {"eigenvalues": save_eigenvalues, "basins": save_basins, "pushes": save_pushes}


def examine_all(
    tasks: Sequence[str],
    names: Sequence[str],
    *,
    path: Path | None,
    runs: Path,
    points: int,
    starts: int,
    directions: int,
) -> tuple[list[ClosedLoopReport], dict[str, str]]:
    """Examine agents at tasks, with a progress bar; the reports, and by "task: agent" why one is left out.

    Of several tasks, an agent that is not for a task is left out there.

    Raises
    ------
    ValueError
        If an agent is unknown, remembers or draws, or a number is out of its range.
    """
    made: list[tuple[str, str, Agent]] = []
    notes: dict[str, str] = {}
    for task in tasks:
        request = AgentRequest(env_id_of(task), EnvOptions(), path=path, runs=runs)
        for name in names:
            try:
                made.append((task, name, make_agent(name, request)))
            except (ValueError, LeanYawError) as error:
                if len(tasks) == 1:
                    raise
                notes[f"{task}: {name}"] = str(error)
    reports = [
        examine(name, agent, task, points=points, starts=starts, directions=directions)
        for task, name, agent in tqdm(made, desc="closed loops", unit="agent", file=sys.stderr)
    ]
    return reports, notes


def write_report(
    reports: Sequence[ClosedLoopReport],
    out: Path,
    command: str,
    notes: dict[str, str] | None = None,
) -> Path:
    """Write page, numbers and pictures of all tasks into a folder; return the page's path."""
    (out / IMAGES).mkdir(parents=True, exist_ok=True)
    by_task = _by_task(reports)
    for task, found in by_task.items():
        for what, save in _PICTURES.items():
            save(found, out / IMAGES / picture_name(task, what))
    page = out / "closed_loop.md"
    write_text(page, markdown_page(by_task, command, notes or {}))
    write_text(out / "closed_loop.csv", csv_text(reports))
    return page


def show(reports: Sequence[ClosedLoopReport], notes: dict[str, str]) -> None:
    """Print tables, and what is left out."""
    console = Console()
    for found in _by_task(reports).values():
        console.print(terminal_table(found))
        console.print(eigenvalue_table(found), markup=False, highlight=False, soft_wrap=True)
    for what, why in notes.items():
        console.print(f"left out: {what}: {why}", markup=False, highlight=False)


def _by_task(reports: Sequence[ClosedLoopReport]) -> dict[str, list[ClosedLoopReport]]:
    return {
        task: [report for report in reports if report.task == task]
        for task in dict.fromkeys(report.task for report in reports)
    }
