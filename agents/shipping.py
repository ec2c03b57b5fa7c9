"""What comes with the package: policies of finished runs and settings that were tuned, put in place on request only."""

from __future__ import annotations

from pathlib import Path

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.files import read_json, write_json

from .learning.runs import EVALUATION_FILE
from .learning.series import is_series, runs_of
from .policies.policy_files import load, save, shipping_folder
from .settings import all_settings, keep_settings, with_values
from .tuning.spaces import space_of


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


def _ship_policy(run: Path, replace: bool) -> Path:
    """Copy a finished run's policy and its evaluation to where ``load`` finds the package's agents."""
    card = (policy := load(run)).card
    evaluation = run / EVALUATION_FILE
    if not evaluation.exists():
        raise ValueError(f"the run in {str(run)!r} is not finished")
    rows = [row for row in read_json(evaluation) if row["agent"] == card.algorithm]
    if card.options != EnvOptions():
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
        with_values(type(space_of(agent, task).settings)(), values)
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{str(file)!r} is not what a tuning leaves: {error}") from error
    there = all_settings().get(agent, {}).get(task, {})
    if there and there != values and not replace:
        raise ValueError(
            f"there are settings of {agent} for {task} already; replace them by --replace"
        )
    return keep_settings(agent, task, values)
