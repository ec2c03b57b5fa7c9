"""The tuner: trials of an agent's settings by Optuna, kept in a file that a later call goes on with."""

from __future__ import annotations

import contextlib
import math
import os
import platform
import sqlite3
import warnings
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import optuna
from optuna.trial import FrozenTrial, TrialState
from sqlalchemy.exc import SQLAlchemyError

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.errors import LeanYawError
from lean_yaw_env.files import is_running, write_json
from lean_yaw_env.validation import require_count, require_number

from ..agent import Agent
from ..evaluation.scoring import run_episodes
from ..learning.algorithms import train
from ..registry import env_id_of
from ..seeds import MOST_EPISODES, TRAINING_SEEDS
from ..settings import values_of
from .spaces import Space, space_of

FIRST_SEED = 1000
"""Seed of the first training of a trial: none whose policy is kept or judged elsewhere."""
REPORTS = 20
"""How often in a training its returns are compared with other trials'."""
_FINISHED = (TrialState.COMPLETE, TrialState.PRUNED)
_WAITING_TRIALS = 5  # before any is given up
_WAITING_REPORTS = 5  # of each
_AS_THEY_ARE = "as_they_are"
"""Marks the trial of the settings that come with the package."""
_PROCESS = "process"
_TABLES = ("stud", "trial", "version_info", "alembic")
"""How names of Optuna's tables begin."""
_AGAIN = "again"
_VALUES = "enqueued"
"""Mark the trial that tries an unfinished one again, by the number and the values of that one."""


@dataclass(frozen=True)
class Tuning:
    """What is tuned; a study continues only with the same tuning, from the same settings.

    Attributes
    ----------
    agent, task : whose settings
    episodes : number of tuning episodes that settings are scored on
    horizon : of these episodes, for a controller; None for the task's
    steps : of each training, for an agent that is trained; None for its settings' own
    repeats : trainings of a trial, with seeds of their own; its score is their mean
    """

    agent: str
    task: str
    episodes: int
    horizon: float | None = None
    steps: int | None = None
    repeats: int = 1

    @classmethod
    def of(cls, agent: str, task: str, *, episodes: int | None = None, **others: Any) -> Tuning:
        """Checked, with the agent's usual number of episodes where none is given; ``ValueError`` for a bad name or number."""
        env_id_of(task)
        space = space_of(agent, task)
        tuning = cls(agent, task, space.episodes if episodes is None else episodes, **others)
        require_count("episodes", tuning.episodes, 1, MOST_EPISODES)
        require_count("repeats", tuning.repeats, 1, TRAINING_SEEDS - FIRST_SEED)
        if space.make is None and tuning.horizon is not None:
            raise ValueError(f"horizon must not be given for {agent}, which is trained")
        if space.make is not None and (tuning.steps is not None or tuning.repeats > 1):
            raise ValueError(f"steps and repeats must not be given for {agent}: it is not trained")
        if tuning.horizon is not None:
            require_number("horizon", tuning.horizon, 0.0, math.inf, "()")
        tuning.space()
        return tuning

    def space(self) -> Space:
        """What may be tuned, from the settings as they are."""
        space = space_of(self.agent, self.task, self.horizon)
        if self.steps is None:
            return space
        return replace(space, settings=replace(space.settings, steps=self.steps))


def tune(
    tuning: Tuning,
    trials: int,
    storage: Path | None = None,
    *,
    out: Path | None = None,
    progress: bool = True,
    shown: Callable[[str], object] = print,
) -> optuna.Study:
    """Try settings until ``trials`` are done, those of earlier calls with the same file counted.

    The first trial is the present settings. CMA-ES searches from them where all values are real numbers, tree-structured Parzen
    estimators elsewhere. A training whose returns lie below the median of other trials' at the same step is ended early.
    An interrupted or killed study loses only the trial under way, and if that was the first, it is tried again.

    Parameters
    ----------
    storage : file of the study, made if it does not exist; None to keep it in memory
    out : JSON file for the best settings so far, written after each trial, as ``shipping.ship`` takes it
    progress : show a bar for each training
    shown : takes a line for each trial

    Raises
    ------
    ValueError
        If the file holds the study of another tuning, or is none.
    OSError
        If the file cannot be written.
    """
    require_count("trials", trials, 1, 10**6)
    with _stored(storage):
        return _tune(tuning, trials, storage, out, progress, shown)


@contextlib.contextmanager
def _stored(storage: Path | None) -> Iterator[None]:
    """Report that a study's file cannot be read or written as ``OSError``."""
    try:
        yield
    except (SQLAlchemyError, optuna.exceptions.StorageInternalError) as error:
        cause = error.__cause__ or error
        reason = str(getattr(cause, "orig", cause)).splitlines()[0]
        raise OSError(f"the study in {str(storage)!r} cannot be kept: {reason}") from error


def _tune(
    tuning: Tuning,
    trials: int,
    storage: Path | None,
    out: Path | None,
    progress: bool,
    shown: Callable[[str], object],
) -> optuna.Study:
    space = tuning.space()
    study = _study(tuning, space, storage)

    def done() -> int:
        return len(study.get_trials(deepcopy=False, states=_FINISHED))

    def show(study: optuna.Study, trial: FrozenTrial) -> None:
        best = best_trial(study)
        if best is not None and out is not None:
            out.parent.mkdir(parents=True, exist_ok=True)
            found = {"trial": best.number, "score": best.value, "values": best.user_attrs["values"]}
            write_json(out, asdict(tuning) | found)
        shown(f"{done()} of {trials}: {result_words(trial)}; {result_words(best)} is the best")

    if done() < trials:
        study.optimize(
            lambda trial: _score(trial, tuning, space, progress), trials - done(), callbacks=[show]
        )
    return study


def best_trial(study: optuna.Study) -> FrozenTrial | None:
    """The trial with the highest score, or None if none is complete."""
    complete = study.get_trials(states=(TrialState.COMPLETE,))
    sound = [trial for trial in complete if "values" in trial.user_attrs]
    return max(sound, key=lambda trial: trial.values[0], default=None)


def result_words(trial: FrozenTrial | None) -> str:
    """A trial and its score, in words."""
    if trial is None:
        return "none"
    score = f"{trial.value:.2f}" if trial.state is TrialState.COMPLETE else trial.state.name.lower()
    return f"trial {trial.number} ({score})"


def _study(tuning: Tuning, space: Space, storage: Path | None) -> optuna.Study:
    """The file's study, a new one where there is none."""
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    name = f"{tuning.agent} {tuning.task}"
    if storage is not None:
        storage.parent.mkdir(parents=True, exist_ok=True)
        _require_study_file(storage, name)
    study = optuna.create_study(
        study_name=name,
        storage=None if storage is None else f"sqlite:///{storage.absolute()}",
        direction="maximize",
        load_if_exists=True,
        pruner=optuna.pruners.MedianPruner(_WAITING_TRIALS, _WAITING_REPORTS),
    )
    # seeded by the number of trials, or a study that is continued would draw its first trials again
    sampler = optuna.samplers.CmaEsSampler if space.is_continuous else optuna.samplers.TPESampler
    study.sampler = sampler(seed=len(study.get_trials(deepcopy=False)))
    record = {**asdict(tuning), "settings": values_of(space.settings)}
    found = study.user_attrs.get("tuning")
    if found is None:
        study.set_user_attr("tuning", record)
    elif found != record:
        raise ValueError(
            f"storage must be the study of the same tuning, got {str(storage)!r}, which holds {found}, not {record}"
        )
    _take_up(study, space)
    return study


def _require_study_file(storage: Path, name: str) -> None:
    """``ValueError`` unless the file is this study's, or is yet to be made."""
    if not storage.exists():
        return
    try:
        # to be written, since SQLite may have to undo what a killed process was writing; nothing else is changed
        place = f"{storage.absolute().as_uri()}?mode=rw"
        with contextlib.closing(sqlite3.connect(place, uri=True)) as file:
            tables = [
                row[0]
                for row in file.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
            ]
            if all(table.startswith(_TABLES) for table in tables) and "studies" not in tables:
                return  # a process was killed while it made the file
            names = [row[0] for row in file.execute("SELECT study_name FROM studies")]
    except sqlite3.Error as error:
        raise ValueError(
            f"storage must be a study's file or a new one, got {str(storage)!r}, which is neither: {error}"
        ) from error
    if names and names != [name]:
        raise ValueError(
            f"storage must be the file of {name!r} or a new one, got {str(storage)!r}, which holds {', '.join(map(repr, names))}"
        )


def _take_up(study: optuna.Study, space: Space) -> None:
    """Enqueue the settings as they are in a new study, and again the trials that an interruption or a killed process left unfinished."""
    for trial in study.get_trials(deepcopy=False, states=(TrialState.RUNNING,)):
        host, process = trial.user_attrs.get(_PROCESS, (platform.node(), 0))
        if host == platform.node() and not (process and is_running(process)):
            study.tell(trial.number, state=TrialState.FAIL)
    trials = study.get_trials(deepcopy=False)
    enqueued: list[tuple[dict[str, Any], dict[str, Any]]] = []
    if not trials:
        enqueued.append((dict(space.start), {_AS_THEY_ARE: True}))
    again = {trial.user_attrs.get(_AGAIN) for trial in trials}
    for trial in trials:
        if trial.state is TrialState.FAIL and trial.number not in again:
            first = {_AS_THEY_ARE: True} if _AS_THEY_ARE in trial.user_attrs else {}
            # what was enqueued may have been killed before it took its values
            values = dict(space.start) if first else trial.user_attrs.get(_VALUES, trial.params)
            enqueued.append((values, {_AGAIN: trial.number, _VALUES: values, **first}))
    with warnings.catch_warnings():
        # the settings as they are may lie outside what is searched; Optuna says so and takes these values
        warnings.simplefilter("ignore", UserWarning)
        for values, attributes in enqueued:
            study.enqueue_trial(values, user_attrs=attributes)


def _score(trial: optuna.Trial, tuning: Tuning, space: Space, progress: bool) -> float:
    """The mean return of a trial's agents on episodes for tuning; minus infinity where the values make no agent."""
    trial.set_user_attr(_PROCESS, [platform.node(), os.getpid()])
    try:
        settings = _settings(trial, space)
        agents = [(each, space.make(each, settings)) for each in space.options if space.make]
    except (LeanYawError, ValueError, np.linalg.LinAlgError):
        if _AS_THEY_ARE in trial.user_attrs:
            raise  # then hardly any trial will succeed
        return -math.inf
    kept = settings
    if tuning.steps is not None:  # trainings may be shorter than those that the settings are for
        own = space_of(tuning.agent, tuning.task).settings.steps
        kept = replace(settings, steps=own)
    trial.set_user_attr("values", values_of(kept))
    if space.make:
        scores = [_mean_return(agent, tuning, options) for options, agent in agents]
    else:
        scores = [
            _trained_score(trial, tuning, settings, repeat, progress)
            for repeat in range(tuning.repeats)
        ]
    return float(np.mean(scores))


def _settings(trial: optuna.Trial, space: Space) -> Any:
    if _AS_THEY_ARE not in trial.user_attrs:
        return space.suggest(trial)
    with contextlib.suppress(ValueError), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        space.suggest(trial)  # records the values, which need not be exact
    return space.settings


def _mean_return(agent: Agent, tuning: Tuning, options: EnvOptions | None = None) -> float:
    walked = run_episodes(agent, tuning.task, episodes=tuning.episodes, options=options)
    return float(walked.metrics["return"].mean())


def _trained_score(
    trial: optuna.Trial, tuning: Tuning, settings: Any, repeat: int, progress: bool
) -> float:
    reported = 0

    def report(steps: int, recent: float) -> None:
        nonlocal reported
        now = steps * REPORTS // settings.steps
        # only the first training's returns are compared, since all trials have one
        if repeat > 0 or now <= reported or math.isnan(recent):
            return
        reported = now
        trial.report(recent, now)
        if now < REPORTS and trial.should_prune():
            raise optuna.TrialPruned

    trained = train(
        tuning.agent,
        env_id_of(tuning.task),
        settings,
        seed=FIRST_SEED + repeat,
        progress=progress,
        report=report,
    )
    return _mean_return(trained.policy, tuning)
