"""What comes with the package: policies of finished runs and settings that were tuned, put in place on request only."""

from __future__ import annotations

import shutil
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.files import locked, read_json, scratch, write_json
from lean_yaw_env.registration import ALL_ENV_IDS, NAMESPACE
from lean_yaw_env.validation import require_choice

from .learning.algorithms import ALGORITHMS
from .learning.runs import EVALUATION_FILE, Training, is_finished, read_run
from .learning.series import (
    finish_series,
    is_series,
    make_series,
    run_side_by_side,
    runs_of,
    trainings_of,
)
from .policies import policy_files
from .policies.policy_files import load, save, shipping_folder
from .registry import agent_entry
from .settings import all_settings, keep_settings, with_values
from .tuning.spaces import settings_of


def ship(source: Path, *, replace: bool = False) -> list[Path]:
    """Put what a run, a series of runs or a tuning left where the package finds it; return the places.

    Parameters
    ----------
    source : folder of a finished run or series that ``train`` left, or JSON file that ``tune`` left
    replace : whether to replace what is there already

    Raises
    ------
    ValueError
        If the source is none of these or not finished, a run's options are not the environment's own, or something is there already and
        ``replace`` is not set. That run or file has changed nothing then.
    """
    if source.is_file():
        return [_ship_settings(source, replace)]
    runs = runs_of(source).values() if is_series(source) else (source,)
    return [_ship_policy(run, replace) for run in runs]


def retrain(
    tasks: Collection[str],
    algorithms: Collection[str],
    out: Path,
    *,
    jobs: int = 1,
    shipped: bool = False,
    choices: Mapping[str, Any] | None = None,
    progress: bool = True,
) -> Iterator[Path]:
    """Train the agents that come with the package anew, as ``ALGORITHMS`` lists them; yield the folder of each series that is finished.

    Parameters
    ----------
    tasks, algorithms : those wanted
    out : folder for the series, each named ``<Task>-<algorithm>``; those begun there already go on
    jobs : number of processes
    shipped : put each finished series in the place of the package's agents of its task and algorithm
    choices : arguments of ``Training.of_task`` in place of the package's own

    Raises
    ------
    ValueError
        If a choice is bad, or ``out`` holds trainings with other settings.
    RunError
        If a run fails, after the others.
    """
    planned: dict[Path, list[Training]] = {}
    for name in algorithms:
        entry = ALGORITHMS[require_choice("algorithm", name, ALGORITHMS)]
        for task in [each for each in entry.shipped if each in tasks]:
            wanted = {**(choices or {}), "algorithm": name}
            planned[out / f"{task}-{name}"] = trainings_of(task, range(entry.seeds), wanted)
    out.mkdir(parents=True, exist_ok=True)
    with locked(out):
        for folder, trainings in planned.items():
            _begin(folder, trainings)
        runs = [run for folder in planned for run in runs_of(folder).values()]
        unfinished, waiting = [run for run in runs if not is_finished(run)], list(planned)
        for _ in chain((None,), run_side_by_side(unfinished, jobs, progress=progress)):
            for folder in waiting[:]:
                if all(map(is_finished, runs_of(folder).values())):
                    waiting.remove(folder)
                    finish_series(folder)
                    if shipped:
                        _ship_in_place(folder)
                    yield folder
    if shipped:
        _remove_unknown()


def _begin(folder: Path, trainings: Sequence[Training]) -> None:
    """Make a series' folder, whole or not at all, or check that the one there is of these trainings."""
    if not folder.exists():
        with scratch(folder.parent) as place:
            make_series(trainings, place / folder.name)
            (place / folder.name).rename(folder)
    elif not is_series(folder) or [*map(read_run, runs_of(folder).values())] != trainings:
        raise ValueError(
            f"{str(folder)!r} holds no trainings, or some with other settings; remove it or name another folder"
        )


def _ship_in_place(folder: Path) -> None:
    """Ship a series, and remove what else the package has of its task and algorithm."""
    places = ship(folder, replace=True)
    for other in places[0].parent.iterdir():
        if other not in places:
            shutil.rmtree(other)


def _remove_unknown() -> None:
    """Remove the package's agents for environments that there are no more."""
    for folder in policy_files.SHIPPED.iterdir():
        if f"{NAMESPACE}/{folder.name}" not in ALL_ENV_IDS:
            shutil.rmtree(folder)


def _ship_policy(run: Path, replace: bool) -> Path:
    """Copy a finished run's policy and its evaluation to where ``load`` finds the package's agents."""
    card = (policy := load(run)).card
    evaluation = run / EVALUATION_FILE
    if not evaluation.exists():
        raise ValueError(f"the run in {str(run)!r} is not finished")
    rows = [row for row in read_json(evaluation) if row["agent"] == card.algorithm]
    if card.options != agent_entry(card.algorithm).needed_options(EnvOptions()):
        raise ValueError(
            f"options of {str(run)!r} must be the environment's own, got {card.options}"
        )
    folder = shipping_folder(card.env_id, card.algorithm, card.seed)
    if folder.exists() and not replace:
        raise ValueError(f"there is an agent in {str(folder)!r} already; replace it by --replace")
    save(policy, folder)
    write_json(folder / EVALUATION_FILE, rows)
    return folder


def _ship_settings(file: Path, replace: bool) -> Path:
    """Put the best settings of a tuning among those that come with the package."""
    record = read_json(file)
    try:
        agent, task, values = (record[key] for key in ("agent", "task", "values"))
        with_values(type(settings_of(agent, task))(), values)
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{str(file)!r} is not what a tuning leaves: {error}") from error
    there = all_settings().get(agent, {}).get(task, {})
    if there and there != values and not replace:
        raise ValueError(
            f"there are settings of {agent} for {task} already; replace them by --replace"
        )
    return keep_settings(agent, task, values)
