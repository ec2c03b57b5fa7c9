"""Search for a training's settings by Optuna, kept in a file and gone on with: ``python -m agents.learning.search --help``."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import optuna
import typer
from optuna.trial import FrozenTrial, TrialState

from agents.evaluation.scoring import run_seeds
from agents.files import write_json
from agents.learning.algorithms import algorithm_named, settings_to_plain
from agents.learning.search_spaces import SPACES, start_of
from agents.learning.training import Training
from agents.policies.storage import task_of
from agents.seeds import MOST_EPISODES, TRAINING_SEEDS, TUNING_SEEDS
from lean_yaw_env.parameters import require_number

FIRST_SEED = 1000
"""Seed of the first training of a trial: none whose policy is kept or judged elsewhere."""
REPORTS = 20
"""How often in a training its returns are compared with other trials'."""
_FINISHED = (TrialState.COMPLETE, TrialState.PRUNED)
_WAITING_TRIALS = 5  # before any is given up
_WAITING_REPORTS = 5  # of each

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@dataclass(frozen=True)
class Search:
    """What is searched; a study goes on only with the same, and from the same settings.

    Attributes
    ----------
    env_id, algorithm : whose settings
    steps : of each training
    repeats : trainings of a trial, with seeds of their own; its score is their mean
    episodes : that each policy is scored on, of those for tuning
    """

    env_id: str
    algorithm: str
    steps: int
    repeats: int = 1
    episodes: int = 512

    @classmethod
    def of_task(cls, task: str, *, steps: int | None = None, **others: Any) -> Search:
        """A search for a task, with the steps of its settings if none are given; ``ValueError`` for a bad name or number."""
        algorithm = others.pop("algorithm", "ppo")
        training = Training.of_task(task, steps=steps, algorithm=algorithm)
        if algorithm not in SPACES:
            raise ValueError(f"algorithm must be one of {', '.join(SPACES)}, not {algorithm!r}")
        search = cls(training.env_id, algorithm, training.settings.steps, **others)
        require_number("repeats", search.repeats, 1, TRAINING_SEEDS - FIRST_SEED)
        require_number("episodes", search.episodes, 1, MOST_EPISODES)
        return search

    def settings(self) -> Any:
        """Those that the search begins with."""
        task = task_of(self.env_id)
        return Training.of_task(task, steps=self.steps, algorithm=self.algorithm).settings


Shown = Callable[[str], object]


def search(
    wanted: Search, trials: int, storage: Path, *, progress: bool = True, shown: Shown = print
) -> optuna.Study:
    """Try settings until so many trials are done, those of earlier calls with the same file counted.

    The first trial is the settings as they are. A trial whose returns, while it trains, lie below the median of the others at the same
    step is given up. After each, the best settings there are stand in a JSON file beside the study's; an interruption loses the trial
    under way only.

    Parameters
    ----------
    wanted : what is searched
    trials : how many in all
    storage : file of the study, made if it is not there
    progress : show a bar for each training
    shown : takes a line for each trial

    Raises
    ------
    ValueError
        If the file holds the study of another search, or is none.
    """
    require_number("trials", trials, 1, 10**6)
    study = _study(wanted, storage)

    def told(study: optuna.Study, trial: FrozenTrial) -> None:
        best = best_trial(study)
        if best is not None:
            write_json(best_file(storage), best_record(wanted, best))
        done = len(study.get_trials(deepcopy=False, states=_FINISHED))
        shown(f"{done} of {trials}: {_result(trial)}; {_result(best)} is the best")

    done = len(study.get_trials(deepcopy=False, states=_FINISHED))
    if done < trials:
        study.optimize(
            lambda trial: _score(trial, wanted, progress), n_trials=trials - done, callbacks=[told]
        )
    return study


def best_trial(study: optuna.Study) -> FrozenTrial | None:
    """The trial with the highest score, or None if none is complete."""
    complete = study.get_trials(states=(TrialState.COMPLETE,))
    return max(complete, key=lambda trial: trial.value or -math.inf, default=None)


def best_file(storage: Path) -> Path:
    """Where the best settings are written."""
    return storage.with_suffix(".best.json")


def best_record(wanted: Search, best: FrozenTrial) -> dict[str, Any]:
    """The best settings and where they come from, as plain values."""
    return {
        **asdict(wanted),
        "trial": best.number,
        "score": best.value,
        "settings": best.user_attrs["settings"],
    }


def _study(wanted: Search, storage: Path) -> optuna.Study:
    """The file's study, a new one where there is none."""
    storage.parent.mkdir(parents=True, exist_ok=True)
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    try:
        study = optuna.create_study(
            study_name=f"{wanted.env_id} {wanted.algorithm}",
            storage=f"sqlite:///{storage.absolute()}",
            direction="maximize",
            load_if_exists=True,
            pruner=optuna.pruners.MedianPruner(_WAITING_TRIALS, _WAITING_REPORTS),
        )
    except Exception as error:  # of SQLAlchemy's many
        raise ValueError(f"{str(storage)!r} holds no study: {error}") from error
    count = len(study.get_trials(deepcopy=False))
    # seeded by what there is, or a study that is gone on with would draw its first trials again
    study.sampler = optuna.samplers.TPESampler(seed=count)
    record = {**asdict(wanted), "settings": settings_to_plain(wanted.settings())}
    found = study.user_attrs.get("search")
    if found is None:
        study.set_user_attr("search", record)
        with warnings.catch_warnings():
            # the settings as they are may lie outside what is searched; Optuna says so and draws these values
            warnings.simplefilter("ignore", UserWarning)
            study.enqueue_trial(start_of(wanted.algorithm, wanted.settings()))
    elif found != record:
        raise ValueError(f"{str(storage)!r} holds a search of {found}, not of {record}")
    return study


def _score(trial: optuna.Trial, wanted: Search, progress: bool) -> float:
    """The mean return of a trial's policies on episodes for tuning."""
    settings = SPACES[wanted.algorithm](trial, wanted.settings())
    trial.set_user_attr("settings", settings_to_plain(settings))
    scores = [_trained_score(trial, wanted, settings, k, progress) for k in range(wanted.repeats)]
    return float(np.mean(scores))


def _trained_score(
    trial: optuna.Trial, wanted: Search, settings: Any, repeat: int, progress: bool
) -> float:
    reported = 0

    def report(steps: int, recent: float) -> None:
        nonlocal reported
        now = steps * REPORTS // wanted.steps
        # only the first training's returns are compared, since all trials have one
        if repeat > 0 or now <= reported or math.isnan(recent):
            return
        reported = now
        trial.report(recent, now)
        if now < REPORTS and trial.should_prune():
            raise optuna.TrialPruned

    trained = algorithm_named(wanted.algorithm).train(
        wanted.env_id, settings, seed=FIRST_SEED + repeat, progress=progress, report=report
    )
    seeds = range(TUNING_SEEDS, TUNING_SEEDS + wanted.episodes)
    episodes = run_seeds(trained.policy, task_of(wanted.env_id), seeds)
    return float(episodes.metrics["return"].mean())


def _result(trial: FrozenTrial | None) -> str:
    if trial is None:
        return "none"
    score = f"{trial.value:.2f}" if trial.state is TrialState.COMPLETE else trial.state.name.lower()
    return f"trial {trial.number} ({score})"


@app.command()
def main(
    task: Annotated[str, typer.Option(help="The task's name.")] = "Heading",
    algorithm: Annotated[str, typer.Option(help=f"One of {', '.join(SPACES)}.")] = "ppo",
    trials: Annotated[
        int, typer.Option(help="Trials in all, those already in the file counted.")
    ] = 40,
    storage: Annotated[
        Path | None,
        typer.Option(
            help="SQLite file that the study is kept in and gone on with; runs/search/TASK-ALGORITHM.db otherwise.",
            show_default=False,
        ),
    ] = None,
    steps: Annotated[
        int | None,
        typer.Option(
            help="Steps of each training; the task's own number otherwise.", show_default=False
        ),
    ] = None,
    repeats: Annotated[int, typer.Option(help="Trainings of a trial, each of another seed.")] = 1,
    episodes: Annotated[int, typer.Option(help="Episodes that each policy is scored on.")] = 512,
) -> None:
    """Search for a training's settings, pruning what does worse than the median, and print the best.

    Trials are trained and scored on seeds set aside for tuning. Interrupted or not, a second call goes on where the first ended.
    """
    place = Path("runs", "search", f"{task}-{algorithm}.db") if storage is None else storage
    try:
        wanted = Search.of_task(
            task, algorithm=algorithm, steps=steps, repeats=repeats, episodes=episodes
        )
        study = search(wanted, trials, place, shown=typer.echo)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    except KeyboardInterrupt as interruption:
        typer.echo("interrupted; what is done is kept, and the same command goes on")
        raise typer.Exit(130) from interruption
    best = best_trial(study)
    if best is None:
        typer.echo("no trial is complete")
        return
    typer.echo(f"best: {_result(best)}, written to {best_file(place)}")
    for name, value in best.user_attrs["settings"].items():
        typer.echo(f"  {name} = {value}")


if __name__ == "__main__":
    app()
