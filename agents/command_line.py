"""The command line: ``python -m agents --help``.

Each command imports what it needs when it is called: evaluating needs no torch, and a trained agent's film no Optuna.
"""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Iterable
from json import dumps
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console

from lean_yaw_env.errors import LeanYawError
from lean_yaw_env.registration import TASK_VERSIONS

from .training_commands import ship, train, tune

ALL = "all"
CACHE = "evaluations"
"""Folder, below that of the trainings, where finished episodes are kept."""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, no_args_is_help=True)
app.command()(train)
app.command()(tune)
app.command()(ship)

Runs = Annotated[Path, typer.Option(help="Where trainings left their folders.")]
AgentPath = Annotated[
    Path | None,
    typer.Option(
        help="Folder of the trained agent; the newest under --runs, or the package's, otherwise."
    ),
]


@app.callback()
def main() -> None:
    """Agents for the walking environments: evaluate, train, tune, ship, examine and film them."""


@app.command()
def evaluate(
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
        int,
        typer.Option(help="Largest number of episodes for agents that plan at every step (mpc)."),
    ] = 40,
    seed: Annotated[
        int, typer.Option(help="Seed of the evaluation episodes. No training uses these episodes.")
    ] = 0,
    agent_path: AgentPath = None,
    runs: Runs = Path("runs"),
    cache: Annotated[
        Path | None,
        typer.Option(
            help="Folder in which finished episodes are kept, so that an interrupted evaluation can continue; evaluations below --runs for several tasks.",
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
    from .evaluation.comparison import compared_rows, samples_by_task
    from .evaluation.leaderboard import make_leaderboard, save_footprints
    from .evaluation.plan import Evaluation
    from .evaluation.row_tables import show

    given = names_in([*(agents or []), *(more_agents or [])])
    names = [] if ALL in given else given
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
        candidates = evaluation.candidates(tasks, names)
        if pictures is not None:
            save_footprints(candidates, pictures, seed=seed)
            return
        if out is None:
            found = evaluation.run(candidates)
            samples = samples_by_task([each.results for each in found])
            rows = compared_rows(samples, evaluation.processes)
        else:
            rows = make_leaderboard(candidates, evaluation, out, command_as_typed())
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    except KeyboardInterrupt as interruption:
        Console(stderr=True).print("interrupted; run the same command again to continue")
        raise typer.Exit(130) from interruption
    show(rows, Console(), as_json=json)


def names_in(given: Iterable[str]) -> list[str]:
    """Names given one after another or separated by commas, each once."""
    names = [name for part in given for name in part.replace(",", " ").split()]
    return list(dict.fromkeys(names))


def tasks_in(given: Iterable[str]) -> list[str]:
    """Names of tasks, or ``ValueError``; ``all`` stands for every one."""
    from .registry import env_id_of

    names = names_in(given)
    if ALL in names:
        return list(TASK_VERSIONS)
    for name in names:
        env_id_of(name)
    return names


def command_as_typed() -> str:
    """What was typed, as a page quotes it."""
    return shlex.join(["python", "-m", str(__package__), *sys.argv[1:]])


@app.command("closed-loop")
def closed_loop(
    task: Annotated[
        list[str] | None,
        typer.Option(
            help="The task's name, several separated by commas, or all; each gets its own section. Heading by default.",
            show_default=False,
        ),
    ] = None,
    agents: Annotated[
        str,
        typer.Option(
            help="Agents, separated by commas; those that remember or draw are refused. With several tasks, one that is not for a task is "
            "left out there."
        ),
    ] = "fixed,lqr,ppo",
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for closed_loop.md, closed_loop.csv and images/closed_loop_*.png."
        ),
    ] = None,
    agent_path: AgentPath = None,
    runs: Runs = Path("runs"),
    points: Annotated[int, typer.Option(help="To a side of a basin's picture.")] = 81,
    starts: Annotated[int, typer.Option(help="In the box of starts.")] = 4096,
    directions: Annotated[int, typer.Option(help="Of pushes.")] = 24,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False,
) -> None:
    """Analyse walker and agent as one dynamical system: gait, eigenvalues, basins of attraction, largest pushes survived, contact forces and work."""
    from .evaluation.closed_loop import examine_all, show, write_report
    from .evaluation.closed_loop_report import plain

    try:
        names = names_in([agents])
        if not names:
            raise ValueError(f"agents must name one or more, got {agents!r}")
        reports, notes = examine_all(
            tasks_in(task or ["Heading"]), names,
            path=agent_path, runs=runs, points=points, starts=starts, directions=directions,
        )  # fmt: skip
    except (ValueError, LeanYawError) as error:
        raise typer.BadParameter(str(error)) from error
    if as_json:
        typer.echo(dumps([plain(report) for report in reports], indent=2, allow_nan=False))
    else:
        show(reports, notes)
    if out is not None and reports:
        page = write_report(reports, out, command_as_typed(), notes)
        typer.echo(f"written: {page}", err=True)


@app.command("capture")
def capture_command(
    task: Annotated[
        list[str] | None,
        typer.Option(
            help="The task's name, several separated by commas, or all. Push by default.",
            show_default=False,
        ),
    ] = None,
    agents: Annotated[
        str,
        typer.Option(
            help="Agents, separated by commas; those that plan, remember or draw are left out."
        ),
    ] = "fixed,feedback,lqr,ppo",
    out: Annotated[
        Path | None, typer.Option(help="Folder for capture.csv and images/capture_*.png.")
    ] = None,
    agent_path: AgentPath = None,
    runs: Runs = Path("runs"),
    starts: Annotated[int, typer.Option(help="In the box of starts.")] = 1024,
    points: Annotated[int, typer.Option(help="To a side of the picture's plane.")] = 61,
    friction_limit: Annotated[
        float,
        typer.Option(help="Largest ratio of tangential to normal force; inf is the tasks' own."),
    ] = float("inf"),
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Hold agents against what can be saved: an exhaustive search over two chosen steps, each followed by the paper's controller."""
    from .evaluation.capture import capture_table, examine_captures, write_captures

    try:
        reports, notes = examine_captures(
            tasks_in(task or ["Push"]), names_in([agents]), path=agent_path, runs=runs,
            starts=starts, points=points, friction_limit=friction_limit,
        )  # fmt: skip
    except (ValueError, LeanYawError) as error:
        raise typer.BadParameter(str(error)) from error
    if as_json:
        typer.echo(dumps([row for each in reports for row in each.rows()], indent=2))
    else:
        Console().print(capture_table(reports))
        for what, why in notes.items():
            typer.echo(f"left out: {what}: {why}", err=True)
    for path in write_captures(reports, out) if out is not None and reports else ():
        typer.echo(f"written: {path}", err=True)


@app.command()
def film(
    task: Annotated[str, typer.Option(help="A task's name, or all.")] = ALL,
    agent: Annotated[
        str,
        typer.Option(help="The agent. If it was not trained for a task, lqr is filmed instead."),
    ] = "ppo",
    out: Annotated[Path, typer.Option(help="Folder for <task>.gif.")] = Path("docs/videos"),
    seed: Annotated[int, typer.Option(help="Another number films other episodes.")] = 0,
    seconds: Annotated[float, typer.Option(help="Of each film.")] = 11.0,
    speed: Annotated[float, typer.Option(help="Times real time for legs of a metre.")] = 2.0,
    fps: Annotated[float, typer.Option(help="Frames per second.")] = 10.0,
    size: Annotated[
        tuple[int, int], typer.Option(help="Width and height, pixels; films of 600 380 are small.")
    ] = (600, 380),
    ending: Annotated[
        Literal["gif", "mp4"], typer.Option("--format", help="gif, which web pages show, or mp4.")
    ] = "gif",
    agent_path: AgentPath = None,
    runs: Runs = Path("runs"),
) -> None:
    """Film an agent at a task, in an evaluation episode. Heading, goal, path and pushes are drawn."""
    from .evaluation.videos import agent_for, film_agent

    try:
        filmed = [(each, *agent_for(agent, each, runs, agent_path)) for each in tasks_in([task])]
        out.mkdir(parents=True, exist_ok=True)
        for each, name, made in filmed:
            path = out / f"{each.lower()}.{ending}"
            fall = film_agent(
                made, each, path, seed=seed, seconds=seconds, speed=speed, fps=fps, size=size,
                name=f"{each}: {name}", progress=True,
            )  # fmt: skip
            how = f", falls {fall}" if fall else ""
            typer.echo(f"{path}: {name}, {path.stat().st_size / 1e6:.2f} MB{how}")
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
