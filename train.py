"""Train an agent to walk and steer: ``python train.py`` trains PPO on Heading; ``python train.py --help`` explains every option."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from agents.evaluation.reporting import show
from agents.learning.algorithms import ALGORITHMS
from agents.learning.processes import RunError
from agents.learning.series import (
    is_series,
    new_series,
    parse_seeds,
    resumed,
    run_series,
    spread_table,
)
from agents.learning.training import run, started_run

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def main(
    task: Annotated[
        str, typer.Option(help="The task's name, as in LeanYaw/<task>-v0.")
    ] = "Heading",
    seed: Annotated[
        int | None, typer.Option(help="Of all that is drawn; 0 otherwise.", show_default=False)
    ] = None,
    seeds: Annotated[
        str | None,
        typer.Option(
            help="Several seeds in place of one, each a run: 0-4, or 5 for the same, or 0,3,7.",
            show_default=False,
        ),
    ] = None,
    jobs: Annotated[
        int, typer.Option(min=1, help="Processes that several seeds are trained in.")
    ] = 1,
    algorithm: Annotated[
        str | None,
        typer.Option(help=f"One of {', '.join(ALGORITHMS)}; ppo otherwise.", show_default=False),
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
            help="Go on with what is unfinished of the task's newest run or series of seeds under --out, or of --run; "
            "its options are kept, and the result is bit for bit that of no interruption.",
        ),
    ] = False,
    folder: Annotated[
        Path | None,
        typer.Option(
            "--run", help="The folder to resume, in place of the newest.", show_default=False
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
    """Train an agent on a task, judge it beside random actions, the fixed controller and feedback, and leave all of it under runs/.

    With --seeds, also the learning curves of all of them in one picture, and how far their results lie apart.
    """
    console = Console()
    given = {
        "seed": seed, "steps": steps, "episodes": episodes, "threads": threads,
        "algorithm": algorithm, "tensorboard": tensorboard or None,
    }  # fmt: skip
    chosen = {name: value for name, value in given.items() if value is not None}
    try:
        place = _place(task, seeds, out, folder, chosen, resume)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    again = f"python train.py --resume --run {place}"
    console.print(f"training in {place}; after an interruption: {again}", soft_wrap=True)
    try:
        if is_series(place):
            _train_series(place, jobs, console)
        else:
            show(run(place).rows, console)
    except KeyboardInterrupt as interruption:
        console.print(f"interrupted; go on by: {again}", soft_wrap=True)
        raise typer.Exit(130) from interruption
    except (ValueError, RunError) as error:
        raise typer.BadParameter(str(error)) from error
    console.print(f"agent, settings, learning curve and judgement are in {place}", soft_wrap=True)


def _place(
    task: str,
    seeds: str | None,
    out: Path,
    folder: Path | None,
    chosen: dict[str, Any],
    resume: bool,
) -> Path:
    """The folder of the run or series to train, made if it is a new one; ``ValueError`` for choices that go ill together."""
    if resume:
        return resumed(task, out, folder, chosen if seeds is None else {**chosen, "seeds": seeds})
    if seeds is None:
        return started_run(task, out, folder, chosen)
    if folder is not None or "seed" in chosen:
        raise ValueError("seeds must not be given together with --seed or --run")
    return new_series(task, parse_seeds(seeds), out, chosen)


def _train_series(place: Path, jobs: int, console: Console) -> None:
    result = run_series(place, jobs=jobs)
    for metric, means in result.others.items():
        others = ", ".join(f"{agent} {mean:.4g}" for agent, mean in means.items())
        console.print(f"{metric.replace('_', ' ')}: {others}", highlight=False)
    console.print(spread_table(result))


if __name__ == "__main__":
    app()
