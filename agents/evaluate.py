"""Evaluate agents from the command line: ``python -m agents.evaluate --help``."""

from __future__ import annotations

import os
import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from agents.evaluation.leaderboard import make_leaderboard, save_footprints
from agents.evaluation.reporting import (
    CACHE,
    COSTLY_EPISODES,
    Evaluation,
    agents_in,
    evaluate_named,
    show,
    tasks_in,
)

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def main(
    more_agents: Annotated[
        list[str] | None,
        typer.Argument(metavar="[AGENT]...", help="More agents.", show_default=False),
    ] = None,
    agents: Annotated[
        list[str] | None,
        typer.Option(
            help="Agents to evaluate, one after the other or separated by commas: random, fixed, feedback, lqr, ppo ... All there are for the "
            "task by default.",
            show_default=False,
        ),
    ] = None,
    task: Annotated[
        list[str] | None,
        typer.Option(
            help="The task's name, several separated by commas, or all. Heading by default.",
            show_default=False,
        ),
    ] = None,
    episodes: Annotated[
        int,
        typer.Option(help="Episodes of each agent, for each of its trainings; the same for all."),
    ] = 1000,
    costly_episodes: Annotated[
        int, typer.Option(help="Episodes of agents that plan at every step, at most.")
    ] = COSTLY_EPISODES,
    seed: Annotated[
        int, typer.Option(help="Another number draws other episodes; none is ever trained on.")
    ] = 0,
    agent_path: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the trained agent; the newest under --runs, or the package's, otherwise."
        ),
    ] = None,
    runs: Annotated[Path, typer.Option(help="Where trainings left their folders.")] = Path("runs"),
    cache: Annotated[
        Path | None,
        typer.Option(
            help="Keep finished episodes in this folder and go on with what is there; evaluations below --runs for all tasks.",
            show_default=False,
        ),
    ] = None,
    processes: Annotated[
        int | None,
        typer.Option(help="Processes that walk; as many as cores by default.", show_default=False),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Write the leaderboard into this folder: page, numbers, plots and pictures; of trained agents, those of the package.",
            show_default=False,
        ),
    ] = None,
    pictures: Annotated[
        Path | None,
        typer.Option(
            help="Only draw the agents' footprints on the first episode of each task, into this folder.",
            show_default=False,
        ),
    ] = None,
    json: Annotated[
        bool, typer.Option("--json", help="Print rows as JSON instead of tables.")
    ] = False,
) -> None:
    """Run agents through the same seeded episodes and print interquartile means with 95 % intervals, survival beside error."""
    names = agents_in([*(agents or []), *(more_agents or [])])
    try:
        tasks = tasks_in(task or ["Heading"])
        evaluation = Evaluation(
            episodes=episodes,
            costly_episodes=costly_episodes,
            seed=seed,
            path=agent_path,
            runs=None if out is not None and agent_path is None else runs,
            cache=runs / CACHE if cache is None and (out or len(tasks) > 1) else cache,
            processes=processes or os.cpu_count() or 1,
            progress=not json,
        )
        if pictures is not None:
            save_footprints(evaluation.entrants(tasks, names), pictures, seed=seed)
            return
        if out is None:
            rows = evaluate_named(tasks, names, evaluation)
        else:
            rows = make_leaderboard(tasks, names, evaluation, out, _command())
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    except KeyboardInterrupt as interruption:
        Console(stderr=True).print("interrupted; the same command goes on")
        raise typer.Exit(130) from interruption
    show(rows, Console(), as_json=json)


def _command() -> str:
    """What was typed, as far as it makes a difference."""
    return shlex.join(["python", "-m", "agents.evaluate", *sys.argv[1:]])


if __name__ == "__main__":
    app()
