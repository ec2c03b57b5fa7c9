"""Train an agent to walk and steer: ``python train.py`` trains PPO on Heading; ``python train.py --help`` explains every option."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from agents.evaluation.reporting import show
from agents.learning.training import resumed_run, run, started_run

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def main(
    task: Annotated[
        str, typer.Option(help="The task's name, as in LeanYaw/<task>-v0.")
    ] = "Heading",
    seed: Annotated[
        int | None, typer.Option(help="Of all that is drawn; 0 otherwise.", show_default=False)
    ] = None,
    steps: Annotated[
        int | None,
        typer.Option(
            help="Walking steps to train for, over all walkers; the task's own number otherwise.",
            show_default=False,
        ),
    ] = None,
    episodes: Annotated[
        int | None,
        typer.Option(
            help="Episodes that each agent is judged by; 1000 otherwise.", show_default=False
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="Where runs leave their folders.")] = Path("runs"),
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Go on with the task's newest unfinished run under --out, or with --run; its options are kept.",
        ),
    ] = False,
    folder: Annotated[
        Path | None,
        typer.Option(
            "--run", help="The run's folder to resume, in place of the newest.", show_default=False
        ),
    ] = None,
    threads: Annotated[
        int | None,
        typer.Option(
            help="Threads of torch and of the walkers; one is best for small networks, and used otherwise.",
            show_default=False,
        ),
    ] = None,
    tensorboard: Annotated[
        bool, typer.Option("--tensorboard", help="Write TensorBoard's logs into the run's folder.")
    ] = False,
) -> None:
    """Train PPO on a task, judge it beside the fixed controller, feedback and random actions, and leave all of it under runs/."""
    console = Console()
    given = {"seed": seed, "steps": steps, "episodes": episodes, "threads": threads}
    chosen = {name: value for name, value in given.items() if value is not None}
    if tensorboard:
        chosen["tensorboard"] = True
    try:
        place = (
            resumed_run(task, out, folder, chosen)
            if resume
            else started_run(task, out, folder, chosen)
        )
        console.print(
            f"training in {place}; after an interruption: python train.py --resume --run {place}"
        )
        result = run(place)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    except KeyboardInterrupt as interruption:
        console.print("interrupted; go on by: python train.py --resume --task " + task)
        raise typer.Exit(130) from interruption
    show(result.rows, console)
    console.print(f"agent, settings, learning curve and footprints are in {result.folder}")


if __name__ == "__main__":
    app()
