"""The dynamicist's view of an agent, from the command line: ``python -m agents.evaluation.closed_loop --help``."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from tqdm import tqdm

from agents.agent import Agent
from agents.evaluation.closed_loop_gait import find_closed_loop_gait
from agents.evaluation.closed_loop_map import ClosedLoop
from agents.evaluation.closed_loop_page import markdown_page
from agents.evaluation.closed_loop_pictures import save_basins, save_eigenvalues, save_pushes
from agents.evaluation.closed_loop_report import (
    ClosedLoopReport,
    csv_text,
    eigenvalue_table,
    plain,
    terminal_table,
)
from agents.evaluation.closed_loop_survival import (
    PLANES,
    basin_slice,
    box_survival,
    largest_pushes,
)
from agents.registry import AgentRequest, env_id_of, make_agent
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.errors import LeanYawError, NoGaitError
from lean_yaw_env.files import written_whole

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)

POINTS, STARTS, DIRECTIONS = 81, 4096, 24
"""To a side of a basin's picture, in the box, and of pushes."""
IMAGES = "images"
"""Folder of the pictures beside the page."""


def examine(
    name: str,
    agent: Agent,
    task: str,
    options: EnvOptions | None = None,
    *,
    points: int = POINTS,
    starts: int = STARTS,
    directions: int = DIRECTIONS,
) -> ClosedLoopReport:
    """Everything about one agent at one task whose command is held.

    Raises
    ------
    ValueError
        If the agent remembers or draws, or a number is out of its range.
    """
    loop = ClosedLoop(agent, task, options)
    try:
        gait, why = find_closed_loop_gait(loop), ""
    except NoGaitError as error:
        gait, why = None, str(error)
    return ClosedLoopReport(
        task=task,
        agent=name,
        gait=gait,
        why_no_gait=why,
        basins=tuple(basin_slice(loop, x, y, points=points) for x, y in PLANES),
        box=box_survival(loop, starts=starts),
        pushes=None if gait is None else largest_pushes(loop, gait, directions=directions),
    )


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
    for path, text in (
        (page, markdown_page(by_task, command, picture_name, notes or {})),
        (out / "closed_loop.csv", csv_text(reports)),
    ):
        with written_whole(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
    return page


_PICTURES = {"eigenvalues": save_eigenvalues, "basins": save_basins, "pushes": save_pushes}


def picture_name(task: str, what: str) -> str:
    """The file of a task's picture, in ``IMAGES``."""
    return f"closed_loop_{task.lower()}_{what}.png"


def _by_task(reports: Sequence[ClosedLoopReport]) -> dict[str, list[ClosedLoopReport]]:
    return {
        task: [report for report in reports if report.task == task]
        for task in dict.fromkeys(report.task for report in reports)
    }


def _names(text: str, what: str) -> list[str]:
    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names:
        raise ValueError(f"{what} must name one or more, with commas between, not {text!r}")
    return list(dict.fromkeys(names))


def _made(
    tasks: list[str], names: list[str], path: Path | None, runs: Path
) -> tuple[list[tuple[str, str, Agent]], dict[str, str]]:
    """The agents of every task, and why those that are left out are."""
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
    return made, notes


@app.command()
def main(
    task: Annotated[
        str, typer.Option(help="Tasks' names, with commas between; each gets its own section.")
    ] = "Heading",
    agents: Annotated[
        str,
        typer.Option(
            help="Agents, with commas between; those that remember or draw are refused. With several tasks, one that is not "
            "for a task is left out there."
        ),
    ] = "fixed,lqr,ppo",
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for closed_loop.md, closed_loop.csv and images/closed_loop_*.png."
        ),
    ] = None,
    agent_path: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the trained agent; the newest under --runs, or the package's, otherwise."
        ),
    ] = None,
    runs: Annotated[Path, typer.Option(help="Where trainings left their folders.")] = Path("runs"),
    points: Annotated[int, typer.Option(help="To a side of a basin's picture.")] = POINTS,
    starts: Annotated[int, typer.Option(help="In the box of starts.")] = STARTS,
    directions: Annotated[int, typer.Option(help="Of pushes.")] = DIRECTIONS,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False,
) -> None:
    """Take walker and agent as one dynamical system: gait, eigenvalues, basins of attraction, largest pushes, floor and work."""
    try:
        made, notes = _made(_names(task, "task"), _names(agents, "agents"), agent_path, runs)
        reports = [
            examine(name, agent, of_task, points=points, starts=starts, directions=directions)
            for of_task, name, agent in tqdm(
                made, desc="closed loops", unit="agent", file=sys.stderr
            )
        ]
    except (ValueError, LeanYawError) as error:
        raise typer.BadParameter(str(error)) from error
    if as_json:
        typer.echo(json.dumps([plain(report) for report in reports], indent=2, allow_nan=False))
    else:
        _show(reports, notes)
    if out is not None and reports:
        given = [word for word in sys.argv[1:] if word != "--json"]
        said = shlex.join(["python", "-m", "agents.evaluation.closed_loop", *given])
        page = write_report(reports, out, said, notes)
        typer.echo(f"written: {page}", err=True)


def _show(reports: Sequence[ClosedLoopReport], notes: dict[str, str]) -> None:
    console = Console()
    for found in _by_task(reports).values():
        console.print(terminal_table(found))
        console.print(eigenvalue_table(found), markup=False, highlight=False, soft_wrap=True)
    for what, why in notes.items():
        console.print(f"left out: {what}: {why}", markup=False, highlight=False)


if __name__ == "__main__":
    app()
