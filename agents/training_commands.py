"""The commands that train, tune and ship; see ``command_line``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console


def train(
    task: Annotated[
        str, typer.Option(help="The task's name, as in LeanYaw/<task>-v0.")
    ] = "Heading",
    seed: Annotated[
        int | None, typer.Option(help="Random seed; 0 by default.", show_default=False)
    ] = None,
    seeds: Annotated[
        str | None,
        typer.Option(
            help="Several seeds instead of one, a run for each: 0-4, or 5 for the same, or 0,3,7.",
            show_default=False,
        ),
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Number of processes for several seeds.")] = 1,
    algorithm: Annotated[
        str | None,
        typer.Option(
            help="ppo, sac, apg or, for WaypointGoal, her; ppo otherwise.", show_default=False
        ),
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
            help="Evaluation episodes of each agent; 1000 by default.", show_default=False
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="Where runs leave their folders.")] = Path("runs"),
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Continue the newest unfinished run (or series of seeds) of the task under --out, or the one named by --run. Its options are kept. "
            "The result is equal, bit for bit, to that of a training without interruption.",
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
    option: Annotated[
        list[str] | None,
        typer.Option(
            help="An option of the environment as NAME=VALUE, for example random_body=training or hidden_rates=true. May be repeated.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Train an agent on a task, compare it with random actions, the fixed controller and feedback, and write the results under runs/.

    With --seeds, also draw all learning curves in one picture and print the spread of the results.
    """
    from .evaluation.row_tables import show
    from .learning.runs import run
    from .learning.series import RunError, is_series
    from .options import env_options

    console = Console()
    try:
        options = env_options(option) if option else None
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    given = {
        "seed": seed, "options": options, "steps": steps, "episodes": episodes, "threads": threads,
        "algorithm": algorithm, "tensorboard": tensorboard or None,
    }  # fmt: skip
    chosen = {name: value for name, value in given.items() if value is not None}
    try:
        place = _training_place(task, seeds, out, folder, chosen, resume)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    again = f"python -m {__package__} train --resume --run {place}"
    console.print(
        f"training in {place}; after an interruption, continue with: {again}", soft_wrap=True
    )
    try:
        if is_series(place):
            _train_series(place, jobs, console)
        else:
            show(run(place).rows, console)
    except KeyboardInterrupt as interruption:
        console.print(f"interrupted; continue with: {again}", soft_wrap=True)
        raise typer.Exit(130) from interruption
    except (ValueError, RunError) as error:
        raise typer.BadParameter(str(error)) from error
    console.print(f"agent, settings, learning curve and evaluation are in {place}", soft_wrap=True)


def _training_place(
    task: str,
    seeds: str | None,
    out: Path,
    folder: Path | None,
    chosen: dict[str, Any],
    resume: bool,
) -> Path:
    """The folder of the run or series to train, made if it is a new one; ``ValueError`` for choices that go ill together."""
    from .learning.runs import Training, new_run
    from .learning.series import new_series, parse_seeds, resumed

    if resume:
        return resumed(task, out, folder, chosen if seeds is None else {**chosen, "seeds": seeds})
    if folder is not None:
        raise ValueError(f"run must not be given without --resume, got {str(folder)!r}")
    if seeds is None:
        return new_run(Training.of_task(task, **chosen), out)
    if "seed" in chosen:
        raise ValueError("seeds must not be given together with --seed")
    return new_series(task, parse_seeds(seeds), out, chosen)


def _train_series(place: Path, jobs: int, console: Console) -> None:
    from .learning.series import run_series, seeds_table

    result = run_series(place, jobs=jobs)
    for metric, means in result.others.items():
        others = ", ".join(f"{agent} {mean:.4g}" for agent, mean in means.items())
        console.print(f"{metric.replace('_', ' ')}: {others}", highlight=False)
    console.print(seeds_table(result))


def tune(
    agent: Annotated[str, typer.Argument(help="feedback, lqr, mpc, ppo or sac.")],
    task: Annotated[str, typer.Argument(help="The task's name.")],
    trials: Annotated[
        int, typer.Option(help="Total number of trials, including those in the study already.")
    ] = 100,
    episodes: Annotated[
        int | None,
        typer.Option(
            help="Episodes that settings are scored on; 128 for feedback and lqr, 24 for mpc, 512 for learners otherwise.",
            show_default=False,
        ),
    ] = None,
    horizon: Annotated[
        float | None,
        typer.Option(help="Length of these episodes, of controllers; the task's otherwise.", show_default=False),
    ] = None,
    steps: Annotated[
        int | None,
        typer.Option(help="Steps of each training, of learners; the task's own number otherwise.", show_default=False),
    ] = None,
    repeats: Annotated[
        int, typer.Option(help="Trainings of a trial, of learners, each of another seed.")
    ] = 1,
    storage: Annotated[
        Path | None,
        typer.Option(
            help="SQLite file that the study is kept in and gone on with; runs/tuning/AGENT-TASK.db otherwise.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="JSON file for the best settings so far; beside the study's file otherwise. The package's own settings stay as they are: see ship.",
            show_default=False,
        ),
    ] = None,
) -> None:  # fmt: skip
    """Search for settings of a controller or a learner, beginning with those that come with the package, and print the best.

    Trials are scored on episodes set aside for tuning. The same command continues an interrupted study.
    """
    from .tuning.study import Tuning, best_trial, result_words
    from .tuning.study import tune as run_trials

    place = Path("runs", "tuning", f"{agent}-{task}.db") if storage is None else storage
    best_file = place.with_suffix(".best.json") if out is None else out
    try:
        tuning = Tuning.of(
            agent, task, episodes=episodes, horizon=horizon, steps=steps, repeats=repeats
        )
        study = run_trials(tuning, trials, place, out=best_file, shown=typer.echo)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    except KeyboardInterrupt as interruption:
        typer.echo("interrupted; run the same command again to continue")
        raise typer.Exit(130) from interruption
    best = best_trial(study)
    if best is None:
        typer.echo("no trial is complete")
        return
    typer.echo(
        f"best: {result_words(best)}, written to {best_file}; keep it by: python -m {__package__} ship {best_file} --replace"
    )
    for name, value in best.user_attrs["values"].items():
        typer.echo(f"  {name} = {value}")


def ship(
    sources: Annotated[
        list[Path],
        typer.Argument(
            metavar="SOURCE...",
            help="Folders of finished runs or series of them, or files of best settings that tune left.",
        ),
    ],
    replace: Annotated[
        bool, typer.Option("--replace", help="Replace what is there already.")
    ] = False,
) -> None:
    """Put trained policies and tuned settings among those that come with the package."""
    from . import shipping

    try:
        for source in sources:
            for place in shipping.ship(source, replace=replace):
                typer.echo(f"{source} -> {place}")
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
