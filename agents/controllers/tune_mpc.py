"""How the settings of ``MpcController`` are sought: Optuna's tree-structured Parzen estimator on the mean return over episodes kept for tuning.

Run as ``python -m agents.controllers.tune_mpc Slalom``; it shows the best settings so far and prints those found. Every trial may walk the same
number of steps for a decision, so that it is the search that gets better and not the time that it takes. Trials begin with
the settings that are kept.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import optuna
import typer
from tqdm import tqdm

from agents.controllers.mpc import MpcController
from agents.controllers.mpc_settings import SETTINGS, MpcSettings, Spread
from agents.evaluation.scoring import run_seeds
from agents.seeds import TUNING_SEEDS
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.errors import LeanYawError

STEPS_PER_DECISION = 2400
"""Walked by all plans together: near 2 ms on one core."""
_KNOTS = (0.0, 0.15, 0.35, 0.7)
"""Shares of the horizon."""
_WIDE_OFFSET_TASKS = ("Push", "UTurn", "Level")
"""Where the masses may change sides from step to step."""


def suggested(trial: optuna.Trial, task: str) -> MpcSettings:
    """Settings of a trial.

    Raises
    ------
    ValueError
        If they leave too few plans to choose from.
    """
    kept = SETTINGS[task]
    pumps = task in _WIDE_OFFSET_TASKS
    horizon = trial.suggest_int("horizon", 1, 24)
    tail = trial.suggest_int("tail", 0, 8)
    iterations = trial.suggest_int("iterations", 1, 4)
    scenarios = trial.suggest_int("scenarios", 0, 16) if kept.scenarios else 0
    steps = iterations * (horizon + tail) * max(scenarios, 1)
    samples = min(STEPS_PER_DECISION // steps, 200)
    return replace(
        kept,
        horizon=horizon,
        tail=tail,
        knots=tuple(sorted({int(share * horizon) for share in _KNOTS})),
        samples=samples,
        iterations=iterations,
        elites=max(2, samples // 6),
        spread=Spread(
            trial.suggest_float("angle", 0.05, 1.0, log=True),
            trial.suggest_float("steady", 0.05, 1.0, log=True),
            trial.suggest_float("alternating", 0.05, 1.0, log=True) if pumps else 0.0,
        ),
        window=trial.suggest_float("window", 4.0, 40.0, log=True),
        step_price=trial.suggest_float("step_price", 0.0, 0.1),
        trust=trial.suggest_float("trust", 0.01, 100.0, log=True),
        margin=trial.suggest_float("margin", 0.0, 3.0),
        scenarios=scenarios,
        push_scale=trial.suggest_float("push_scale", 0.5, 3.0) if scenarios else 1.0,
    )


def _mean_return(task: str, settings: MpcSettings, episodes: int, horizon: float | None) -> float:
    options = EnvOptions(horizon=horizon)
    seeds = range(TUNING_SEEDS, TUNING_SEEDS + episodes)
    planner = MpcController(task, options, settings)
    return float(run_seeds(planner, task, seeds, options=options).metrics["return"].mean())


def tune(
    task: str, *, trials: int, episodes: int, horizon: float | None = None
) -> tuple[MpcSettings, float]:
    """The best settings of as many trials, those kept among them, and their mean return; the same every time."""
    best, most = SETTINGS[task], _mean_return(task, SETTINGS[task], episodes, horizon)
    study = optuna.create_study(
        direction="maximize", sampler=optuna.samplers.TPESampler(seed=0, multivariate=True)
    )
    with tqdm(total=trials, desc=f"tuning mpc for {task}", unit="trial") as bar:
        for _ in range(trials):
            trial = study.ask()
            try:
                settings = suggested(trial, task)
                found = _mean_return(task, settings, episodes, horizon)
            except (LeanYawError, ValueError):
                study.tell(trial, state=optuna.trial.TrialState.FAIL)
                bar.update(1)
                continue
            study.tell(trial, found)
            if found > most:
                best, most = settings, found
            bar.set_postfix({"return": f"{most:.2f}"}, refresh=False)
            bar.update(1)
    return best, most


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def main(
    task: Annotated[str, typer.Argument(help="The task's name.")],
    trials: Annotated[int, typer.Option(help="Settings tried.")] = 100,
    episodes: Annotated[int, typer.Option(help="Episodes that each is tried in.")] = 24,
    horizon: Annotated[
        float | None,
        typer.Option(help="Length of these episodes; the task's by default.", show_default=False),
    ] = None,
) -> None:
    """Seek settings for a task and print them."""
    if task not in SETTINGS:
        raise typer.BadParameter(f"task must be one of {', '.join(SETTINGS)}, not {task!r}")
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    settings, most = tune(task, trials=trials, episodes=episodes, horizon=horizon)
    typer.echo(f"{task}: return {most:.2f} with {settings}")


if __name__ == "__main__":
    app()
