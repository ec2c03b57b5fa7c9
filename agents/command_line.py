"""The command line: ``python -m agents --help``.

Each command imports what it needs when it is called: evaluating needs no torch, and a trained agent's film no Optuna.
"""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Callable, Iterable
from functools import partial
from json import dumps
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from rich.console import Console
from typer import Argument, Option

from lean_yaw_env.extras import needs_extra
from lean_yaw_env.files import require_writable
from lean_yaw_env.registration import TASK_VERSIONS
from lean_yaw_env.reporting import keep, reporting, uninterrupted

ALL = "all"
CACHE = "evaluations"
"""Folder, below that of the trainings, where finished episodes are kept."""
AGAIN = "run the same command again to continue"

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, no_args_is_help=True)

Runs = Annotated[Path, Option(help="Where trainings left their folders.")]
AgentPath = Annotated[
    Path | None,
    Option(exists=True, help="Folder of the trained agent; the newest under --runs, or the package's, otherwise."),
]  # fmt: skip
Tasks = Annotated[
    list[str] | None,
    Option("--task", help="The task's name, several separated by commas, or all. Heading by default."),
]  # fmt: skip
EnvOption = Annotated[
    list[str] | None,
    Option("--option", help="An option of the environment as NAME=VALUE, for example random_body=training or hidden_rates=true. May be repeated."),
]  # fmt: skip
AsJson = Annotated[bool, Option("--json", help="Print JSON instead of tables.")]


def _command(name: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """A decorator that makes a function a command of the app, which reports its errors and what installs a library that it lacks."""
    return lambda function: app.command(name)(reporting(name)(needs_extra("train")(function)))


@app.callback()
def main() -> None:
    """Agents for the walking environments: evaluate, train, tune, ship, examine and film them."""


@_command("train")
def train(
    task: Annotated[str, Option(help="The task's name, as in LeanYaw/<task>-v1.")] = "Heading",
    seed: Annotated[int | None, Option(help="Random seed; 0 by default.")] = None,
    seeds: Annotated[str | None, Option(help="Several seeds instead of one, a run for each: 0-4, or 5 for the same, or 0,3,7.")] = None,
    jobs: Annotated[int, Option(min=1, help="Number of processes for several seeds.")] = 1,
    algorithm: Annotated[str | None, Option(help="ppo, frames, recurrent, sac, tqc, apg, for UnknownBody oracle or for WaypointGoal her; ppo otherwise.")] = None,
    steps: Annotated[int | None, Option(help="Walking steps to train for, over all walkers; the task's own number otherwise.")] = None,
    episodes: Annotated[int | None, Option(help="Evaluation episodes of each agent; 1000 by default.")] = None,
    out: Annotated[Path, Option(help="Where runs leave their folders.")] = Path("runs"),
    resume: Annotated[bool, Option("--resume", help="Continue the newest unfinished run (or series of seeds) of the task under --out, or the one "
        "named by --run. Its options are kept. The result is equal, bit for bit, to that of a training without interruption.")] = False,
    folder: Annotated[Path | None, Option("--run", help="The folder to resume, in place of the newest.")] = None,
    threads: Annotated[int | None, Option(help="Threads of torch and of the walkers; one is best for small networks, and used otherwise.")] = None,
    tensorboard: Annotated[bool, Option("--tensorboard", help="Write TensorBoard's logs into the run's folder.")] = False,
    options: EnvOption = None,
) -> None:  # fmt: skip
    """Train an agent on a task, compare it with random actions, the fixed controller and feedback on validation episodes, and write the results under runs/.

    With --seeds, also draw all learning curves in one picture and print the spread of the results.
    """
    from .evaluation.row_tables import show
    from .learning.runs import run
    from .learning.series import is_series, run_series, seeds_table
    from .options import env_options

    given = {
        "seed": seed, "steps": steps, "episodes": episodes, "threads": threads,
        "algorithm": algorithm, "tensorboard": tensorboard or None, "options": env_options(options) if options else None,
    }  # fmt: skip
    chosen = {name: value for name, value in given.items() if value is not None}
    place = _training_place(task, seeds, out, folder, chosen, resume)
    again = shlex.join(["python", "-m", str(__package__), "train", "--resume", "--run", str(place)])
    typer.echo(f"training in {place}; after an interruption, continue with: {again}")
    keep(f"continue with: {again}")
    console = Console()
    if is_series(place):
        result = run_series(place, jobs=jobs)
        for metric, means in result.others.items():
            others = ", ".join(f"{agent} {mean:.4g}" for agent, mean in means.items())
            typer.echo(f"{metric.replace('_', ' ')}: {others}")
        console.print(seeds_table(result))
    else:
        show(run(place).rows, console)
    typer.echo(f"agent, settings, learning curve and evaluation are in {place}")


def _training_place(
    task: str,
    seeds: str | None,
    out: Path,
    folder: Path | None,
    chosen: dict[str, Any],
    resume: bool,
) -> Path:
    """The folder of the run or series to train, made if it is a new one; ``ValueError`` for choices that exclude each other."""
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


@_command("retrain")
def retrain(
    task: Annotated[list[str] | None, Option("--task", help="Tasks, separated by commas; all by default.")] = None,
    algorithm: Annotated[list[str] | None, Option("--algorithm", help="Algorithms, separated by commas; all by default.")] = None,
    jobs: Annotated[int, Option(min=1, help="Number of processes.")] = os.cpu_count() or 1,
    steps: Annotated[int | None, Option(help="Walking steps of each training; the task's own number otherwise.")] = None,
    episodes: Annotated[int | None, Option(help="Validation episodes of each agent; 1000 by default.")] = None,
    out: Annotated[Path, Option(help="Folder for the trainings. Those begun there already go on.")] = Path("runs/retrained"),
    shipped: Annotated[bool, Option("--ship", help="Put the new agents in the place of those of the package, and remove those of tasks that there are no more.")] = False,
) -> None:  # fmt: skip
    """Train all agents that come with the package anew: each algorithm on its tasks, with all seeds. The same command continues an interrupted training."""
    from lean_yaw_env.registration import ALL_TASKS

    from . import shipping
    from .learning.algorithms import ALGORITHMS

    names = names_in(task or [ALL])
    tasks = ALL_TASKS if ALL in names else tasks_in(names)
    given = {"steps": steps, "episodes": episodes}
    choices = {name: value for name, value in given.items() if value is not None}
    keep(f"finished trainings are in {out}; {AGAIN}")
    for folder in shipping.retrain(
        tasks, names_in(algorithm or ALGORITHMS), out, jobs=jobs, shipped=shipped, choices=choices
    ):
        typer.echo(f"finished: {folder}")


@_command("tune")
def tune(
    agent: Annotated[str, Argument(help="feedback, lqr, linear, ppo or sac.")],
    task: Annotated[str, Argument(help="The task's name.")],
    trials: Annotated[int, Option(help="Total number of trials, including those in the study already; of linear, generations of 16 laws.")] = 100,
    episodes: Annotated[int | None, Option(help="Episodes that settings are scored on; 128 for feedback and lqr, 512 for learners "
        "otherwise.")] = None,
    horizon: Annotated[float | None, Option(help="Length of these episodes, of controllers; the task's otherwise.")] = None,
    steps: Annotated[int | None, Option(help="Steps of each training, of learners; the task's own number otherwise.")] = None,
    repeats: Annotated[int, Option(help="Trainings of a trial, of learners, each of another seed.")] = 1,
    storage: Annotated[Path | None, Option(help="SQLite file that the study is kept in and gone on with; runs/tuning/AGENT-TASK.db otherwise.")] = None,
    out: Annotated[Path | None, Option(help="JSON file for the best settings so far; beside the study's file otherwise. The package's own settings "
        "stay as they are: see ship.")] = None,
) -> None:  # fmt: skip
    """Search for settings of a controller or a learner, beginning with those that come with the package, and print the best.

    Trials are scored on validation episodes. The same command continues an interrupted study.
    """
    from .tuning.study import Tuning, best_trial, result_words
    from .tuning.study import tune as run_trials

    if agent == "linear":
        from .tuning.linear import tune_linear

        file = out or Path("runs", "tuning", f"{agent}-{task}.best.json")
        keep(f"finished generations are beside {file}; {AGAIN}")
        score = tune_linear(task, trials, file, shown=typer.echo)
        typer.echo(
            f"best: {score:.2f}, written to {file}; keep it by: python -m {__package__} ship {file} --replace"
        )
        return
    place = Path("runs", "tuning", f"{agent}-{task}.db") if storage is None else storage
    best_file = place.with_suffix(".best.json") if out is None else out
    tuning = Tuning.of(
        agent, task, episodes=episodes, horizon=horizon, steps=steps, repeats=repeats
    )
    keep(f"finished trials are in {place}; {AGAIN}")
    best = best_trial(run_trials(tuning, trials, place, out=best_file, shown=typer.echo))
    if best is None:
        typer.echo("no trial is complete")
        return
    typer.echo(
        f"best: {result_words(best)}, written to {best_file}; keep it by: python -m {__package__} ship {best_file} --replace"
    )
    for name, value in best.user_attrs["values"].items():
        typer.echo(f"  {name} = {value}")


@_command("ship")
def ship(
    sources: Annotated[list[Path], Argument(metavar="SOURCE...", help="Folders of finished runs or series of them, or files of best settings "
        "that tune left.")],
    replace: Annotated[bool, Option("--replace", help="Replace what is there already.")] = False,
) -> None:  # fmt: skip
    """Put trained policies and tuned settings among those that come with the package."""
    from . import shipping

    for source in sources:
        for place in shipping.ship(source, replace=replace):
            typer.echo(f"{source} -> {place}")


@_command("evaluate")
def evaluate(
    more_agents: Annotated[list[str] | None, Argument(metavar="[AGENT]...", help="More agents.")] = None,
    agents: Annotated[list[str] | None, Option(help="Agents to evaluate, one after the other or separated by commas: random, fixed, feedback, lqr, "
        "ppo ... All there are for the task by default.")] = None,
    task: Tasks = None,
    episodes: Annotated[int, Option(help="Episodes of each agent, for each of its trainings; the same for all.")] = 1000,
    costly_episodes: Annotated[int, Option(help="Largest number of episodes for agents that plan at every step (mpc).")] = 40,
    seed: Annotated[int, Option(help="Seed of the episodes. No training uses them.")] = 0,
    options: EnvOption = None,
    agent_path: AgentPath = None,
    runs: Runs = Path("runs"),
    cache: Annotated[Path | None, Option(help="Folder in which finished episodes are kept, so that an interrupted evaluation can continue; evaluations "
        "below --runs for several tasks.")] = None,
    processes: Annotated[int | None, Option(help="Processes that walk; as many as cores by default.")] = None,
    out: Annotated[Path | None, Option(help="Write the leaderboard, on the test episodes, into this folder: page, numbers, plots and pictures; of trained agents, those of the package.")] = None,
    results: Annotated[Path | None, Option(help="Also write every episode into this folder, a JSON file for each task and agent.")] = None,
    others: Annotated[list[Path] | None, Option(help="A file that --results wrote elsewhere: its agent enters the leaderboard of --out. May be repeated.")] = None,
    pictures: Annotated[Path | None, Option(help="Only draw the agents' footprints on the first validation episode of each task, into this folder.")] = None,
    as_json: Annotated[bool, Option("--json", help="Print rows as JSON instead of tables.")] = False,
) -> None:  # fmt: skip
    """Run agents through the same validation episodes and print means with 95 % intervals; with --out, write the leaderboard on the test episodes.

    --agent-path is the folder of a run, or of an agent of your own: see docs/enter_your_agent.md.
    """
    from .evaluation.comparison import by_task, compared_rows, rivals_of
    from .evaluation.plan import Evaluation
    from .evaluation.results_files import read_results, write_results
    from .evaluation.row_tables import show
    from .options import env_options

    if out is not None and options:
        raise ValueError(
            "option must not be given with --out: a leaderboard is of the tasks as they are"
        )
    if out is None and others:
        raise ValueError("others must not be given without --out: they enter a leaderboard")
    given = names_in([*(agents or []), *(more_agents or [])])
    tasks = tasks_in(task or ["Heading"])
    evaluation = Evaluation(
        episodes=episodes,
        costly_episodes=costly_episodes,
        seed=seed,
        options=env_options(options or ()),
        path=agent_path,
        runs=None if out is not None and agent_path is None else runs,
        cache=runs / CACHE if cache is None and (out or len(tasks) > 1) else cache,
        processes=(os.cpu_count() or 1) if processes is None else processes,
        progress=not as_json,
    )
    if evaluation.cache is not None:
        keep(f"finished episodes are in {evaluation.cache}; {AGAIN}")
    candidates = evaluation.candidates(tasks, [] if ALL in given else given)
    if pictures is not None:
        from .evaluation.leaderboard import save_footprints
        from .evaluation.plan import make_candidate

        made = {each: make_candidate(each, each.folders[0], seed) for each in candidates}
        save_footprints(made, pictures, seed=seed)
        return
    if out is None:
        found = evaluation.run(candidates)
        compared = by_task(found)
        rows, _ = compared_rows(compared, rivals_of(compared), evaluation.processes)
    else:
        from .evaluation.leaderboard import make_leaderboard

        entered = [read_results(file, "test", seed) for file in others or ()]
        rows, found = make_leaderboard(candidates, evaluation, out, command_as_typed(), entered)
    if results is not None:
        for each in found:
            write_results(each, results, "validation" if out is None else "test", seed)
    show(rows, Console(), as_json=as_json)


def names_in(given: Iterable[str]) -> list[str]:
    """Names given one after another or separated by commas, each once."""
    names: list[str] = []
    for part in given:
        some = part.replace(",", " ").split()
        if not some:
            raise ValueError(f"a name must not be empty, got {part!r}")
        names += some
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
    """The command line, as a page quotes it."""
    return shlex.join(["python", "-m", str(__package__), *sys.argv[1:]])


@_command("reference")
def reference(
    task: Tasks = None,
    episodes: Annotated[int, Option(min=1, help="Validation episodes that are searched.")] = 16,
    again: Annotated[bool, Option("--again", help="Search also for tasks that the file has a reference of.")] = False,
    processes: Annotated[int, Option(min=1, help="Processes, each at a task of its own.")] = 1,
    out: Annotated[Path | None, Option(help="JSON file of references; the package's own otherwise.")] = None,
) -> None:  # fmt: skip
    """Search for each task's reference score by planning that sees the future: normalised scores call it 1. Finished tasks are kept."""
    from concurrent.futures import as_completed

    from .evaluation.plan import worker_pool
    from .evaluation.reference_search import find_reference, write_reference
    from .references import FILE, read_references

    file = FILE if out is None else out
    keep(f"finished tasks are in {file}; {AGAIN}")
    kept = read_references(file)
    require_writable(file.parent)
    wanted = [each for each in tasks_in(task or ["Heading"]) if again or each not in kept]
    with worker_pool(processes) as pool:
        with uninterrupted():
            begun = {
                pool.submit(find_reference, each, episodes, f"python -m {__package__} reference --task {each} --again"): each
                for each in wanted
            }  # fmt: skip
        for future in as_completed(begun):
            found, name = future.result(), begun[future]
            write_reference(file, name, found)
            typer.echo(f"{name}: fixed {found.fixed:.2f}, {found.base} {found.base_value:.2f}, reference {found.value:.2f}, "
                f"+- {found.standard_error:.2f}, in {found.seconds:.0f} s")  # fmt: skip


@_command("robustness")
def robustness(
    task: Tasks = None,
    agents: Annotated[str, Option(help="Agents, separated by commas, or all.")] = ALL,
    episodes: Annotated[int, Option(help="Episodes of each agent under each variation, for each of its trainings.")] = 100,
    costly_episodes: Annotated[int, Option(help="Largest number of episodes for agents that plan at every step (mpc).")] = 5,
    seed: Annotated[int, Option(help="Seed of the validation episodes.")] = 0,
    agent_path: AgentPath = None,
    runs: Runs = Path("runs"),
    processes: Annotated[int | None, Option(help="Processes that walk; as many as cores by default.")] = None,
    out: Annotated[Path, Option(help="Folder for robustness.md, robustness.csv and images/robustness.png.")] = Path("docs"),
) -> None:  # fmt: skip
    """Run agents, made for the tasks as they are, under noise, delay, hidden rates, other bodies, pushes, slopes and friction."""
    from .evaluation.plan import Evaluation
    from .evaluation.robustness import robustness_rows, write_robustness

    evaluation = Evaluation(
        episodes=episodes,
        costly_episodes=costly_episodes,
        seed=seed,
        path=agent_path,
        runs=None if agent_path is None else runs,
        cache=runs / CACHE,
        processes=(os.cpu_count() or 1) if processes is None else processes,
    )
    keep(f"finished episodes are in {evaluation.cache}; {AGAIN}")
    names = names_in([agents])
    candidates = evaluation.candidates(tasks_in(task or ["Heading"]), [] if ALL in names else names)
    rows = robustness_rows(candidates, evaluation)
    typer.echo(f"written: {write_robustness(rows, out, command_as_typed(), evaluation)}")


@_command("dataset")
def dataset(
    task: Tasks = None,
    kind: Annotated[str, Option(help="expert, medium (the expert with noise on its actions), random or mixed; several separated by commas, or all.")] = ALL,
    expert: Annotated[str, Option(help="The agent that the expert is.")] = "ppo",
    episodes: Annotated[int, Option(help="Episodes of each dataset.")] = 300,
    seed: Annotated[int, Option(help="Seed of a training: the episodes are of its environment seeds.")] = 0,
    out: Annotated[Path, Option(help="Folder of Minari's datasets.")] = Path("datasets"),
) -> None:  # fmt: skip
    """Write datasets for offline reinforcement learning in Minari's format: leanyaw/TASK/KIND-v1. Those that are there already stay."""
    from .datasets import KINDS, make_dataset

    keep(f"finished datasets are in {out}; {AGAIN}")
    kinds = names_in([kind])
    for each in tasks_in(task or ["Heading"]):
        for one in KINDS if ALL in kinds else kinds:
            name = make_dataset(each, one, out, expert=expert, episodes=episodes, seed=seed)  # pyright: ignore[reportArgumentType]
            typer.echo(f"{name} is in {out}")


@_command("closed-loop")
def closed_loop(
    task: Tasks = None,
    agents: Annotated[str, Option(help="Agents, separated by commas; those that remember or draw are refused. With several tasks, one that is not for a "
        "task is left out there.")] = "fixed,lqr,ppo",
    out: Annotated[Path | None, Option(help="Folder for closed_loop.md, closed_loop.csv and images/closed_loop_*.png.")] = None,
    agent_path: AgentPath = None,
    runs: Runs = Path("runs"),
    points: Annotated[int, Option(help="To a side of a basin's picture.")] = 81,
    starts: Annotated[int, Option(help="In the box of starts.")] = 4096,
    directions: Annotated[int, Option(help="Of pushes.")] = 24,
    as_json: AsJson = False,
) -> None:  # fmt: skip
    """Analyse walker and agent as one dynamical system: gait, eigenvalues, basins of attraction, largest pushes survived, contact forces and work."""
    from .evaluation.closed_loop_page import show, write_report
    from .evaluation.closed_loop_report import examine, examine_agents, plain

    if out is not None:
        require_writable(out)
    examined = partial(examine, points=points, starts=starts, directions=directions)
    reports, notes = examine_agents(
        tasks_in(task or ["Heading"]), names_in([agents]), examined, path=agent_path, runs=runs
    )
    if as_json:
        typer.echo(dumps([plain(report) for report in reports], indent=2, allow_nan=False))
    else:
        show(reports, notes)
    if out is not None and reports:
        page = write_report(reports, out, command_as_typed(), notes)
        typer.echo(f"written: {page}", err=True)


@_command("capture")
def capture(
    task: Tasks = None,
    agents: Annotated[str, Option(help="Agents, separated by commas; those that plan, remember or draw are left out.")] = "fixed,feedback,lqr,ppo",
    out: Annotated[Path | None, Option(help="Folder for capture.csv and images/capture_*.png.")] = None,
    agent_path: AgentPath = None,
    runs: Runs = Path("runs"),
    starts: Annotated[int, Option(help="In the box of starts.")] = 1024,
    points: Annotated[int, Option(help="To a side of the picture's plane.")] = 61,
    friction_limit: Annotated[list[float] | None, Option(help="Largest ratio of tangential to normal force; the task's own by default. May be "
        "repeated.", show_default=False)] = None,
    as_json: AsJson = False,
) -> None:  # fmt: skip
    """Hold agents against what can be saved: an exhaustive search over two chosen steps, each followed by the paper's controller."""
    from .evaluation.capture import examine_capture, show, write_captures
    from .evaluation.closed_loop_report import examine_agents

    if out is not None:
        require_writable(out)
    reports, notes = [], {}
    for limit in friction_limit or [None]:
        examined = partial(examine_capture, friction_limit=limit, starts=starts, points=points)
        found, left_out = examine_agents(
            tasks_in(task or ["Metastable"]),
            names_in([agents]),
            examined,
            path=agent_path,
            runs=runs,
        )
        reports, notes = reports + found, notes | left_out
    if as_json:
        typer.echo(dumps([row for each in reports for row in each.rows()], indent=2))
    else:
        show(reports, notes)
    for path in write_captures(reports, out) if out is not None and reports else ():
        typer.echo(f"written: {path}", err=True)


@_command("film")
def film(
    task: Annotated[str, Option(help="A task's name, or all.")] = ALL,
    agent: Annotated[str, Option(help="The agent. If it was not trained for a task, lqr is filmed instead.")] = "ppo",
    out: Annotated[Path, Option(help="Folder for <task>.gif.")] = Path("films"),
    seed: Annotated[int, Option(help="Another number films other episodes.")] = 0,
    seconds: Annotated[float, Option(help="Of each film.")] = 11.0,
    speed: Annotated[float, Option(help="Times real time for legs of a metre.")] = 2.0,
    fps: Annotated[float, Option(help="Frames per second.")] = 10.0,
    size: Annotated[tuple[int, int], Option(help="Width and height, pixels; films of 600 380 are small.")] = (600, 380),
    ending: Annotated[Literal["gif", "mp4"], Option("--format", help="gif, which web pages show, or mp4.")] = "gif",
    agent_path: AgentPath = None,
    runs: Runs = Path("runs"),
) -> None:  # fmt: skip
    """Film an agent at a task, in an evaluation episode. Heading, goal, path and pushes are drawn."""
    from .evaluation.videos import agent_for, film_agent

    keep(f"finished films are in {out}")
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
