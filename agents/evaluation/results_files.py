"""Files that hold every episode of an evaluated agent, so that it can be compared elsewhere; see docs/enter_your_agent.md."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.files import read_json, write_json
from lean_yaw_env.parameters import Vector

from ..policies.policy import package_versions
from ..policies.policy_files import options_to_plain, require_env_id, task_of
from ..registry import env_id_of
from ..seeds import EpisodeSet
from .episodes import Episodes, Results, metric_names
from .plan import evaluated_options

FORMAT, FORMAT_VERSION = "lean-yaw-results", 1


def write_results(results: Results, folder: Path, episode_set: EpisodeSet, seed: int) -> Path:
    """Write ``<Task>-<agent>.json`` into a folder, which is made if it does not exist; return the file."""
    folder.mkdir(parents=True, exist_ok=True)
    record = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "env_id": env_id_of(results.task),
        "agent": results.agent,
        "options": options_to_plain(results.options),
        "episode_set": episode_set,
        "seed": seed,
        "seconds": results.seconds,
        "versions": package_versions(),
        "trainings": [
            {
                "survived": run.survived.tolist(),
                "metrics": {name: _plain(values) for name, values in run.metrics.items()},
            }
            for run in results.runs
        ],
    }
    path = folder / f"{results.task}-{results.agent}.json"
    write_json(path, record, indent=None)  # a line for each number would make a long file
    return path


def read_results(path: Path, episode_set: EpisodeSet, seed: int) -> Results:
    """Read what ``write_results`` wrote of episodes under the options that all agents of a task are evaluated under.

    Raises
    ------
    ValueError
        If the file is damaged, or of another format, environment, set of episodes or seed.
    """
    record = read_json(path)
    if not isinstance(record, dict):
        raise ValueError(f"{str(path)!r} must hold an object, got {record!r}")
    try:
        task = task_of(require_env_id(record["env_id"]))
        options = evaluated_options(task, EnvOptions())
        wanted = {
            "format": FORMAT, "format_version": FORMAT_VERSION, "options": options_to_plain(options), "episode_set": episode_set, "seed": seed,
        }  # fmt: skip
        for key, value in wanted.items():
            if record[key] != value:
                raise ValueError(f"{key} in {str(path)!r} must be {value!r}, got {record[key]!r}")
        runs = tuple(
            Episodes(
                np.array(run["survived"], dtype=np.bool_),
                {name: np.array(each, dtype=float) for name, each in run["metrics"].items()},
            )
            for run in record["trainings"]
        )
        metrics = set(metric_names(task))
        if any(
            set(run.metrics) != metrics
            or any(each.shape != run.survived.shape for each in run.metrics.values())
            for run in runs
        ):
            raise ValueError(
                f"{str(path)!r} must hold {', '.join(sorted(metrics))} of every episode"
            )
        return Results(task, record["agent"], runs, options, float(record["seconds"]))
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{str(path)!r} is damaged: {error}") from error


def _plain(values: Vector) -> list[Any]:
    return [value if np.isfinite(value) else None for value in values.tolist()]
