"""Evaluate agents from the command line: ``python -m agents.evaluate --help``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from agents.evaluation.reporting import evaluate_named, show

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
            help="Agents to evaluate, one after the other: random, fixed, feedback, ppo. All there are for the task by default.",
            show_default=False,
        ),
    ] = None,
    task: Annotated[str, typer.Option(help="The task's name.")] = "Heading",
    episodes: Annotated[int, typer.Option(help="Episodes of each agent, the same for all.")] = 1000,
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
    json: Annotated[
        bool, typer.Option("--json", help="Print rows as JSON instead of a table.")
    ] = False,
) -> None:
    """Run agents through the same seeded episodes and print means with 95 % intervals, survival beside error."""
    names = [*(agents or []), *(more_agents or [])]
    try:
        rows = evaluate_named(
            task, names, episodes=episodes, seed=seed, path=agent_path, runs=runs, progress=not json
        )
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    show(rows, Console(), as_json=json)


if __name__ == "__main__":
    app()
