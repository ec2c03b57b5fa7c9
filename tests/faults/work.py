"""Small pieces of every kind of long work: each goes on with what is in its folder, and has a result that can be compared."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from agents.evaluation.plan import Evaluation
from agents.learning.ppo import PPOSettings
from agents.learning.runs import Training, make_run, run
from agents.learning.sac import SACSettings
from agents.learning.series import new_series, run_series
from agents.tuning.study import Tuning, tune
from lean_yaw_env import Walker
from lean_yaw_env.analysis import basin, filling, stability_map
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.paper import reproduce, write_report

SHORT = EnvOptions(horizon=15.0)
HEADING = "LeanYaw/Heading-v1"
SETTINGS: dict[str, Any] = {
    "ppo": PPOSettings(steps=4096, walkers=8, steps_per_update=32, batch_size=128, hidden=(8, 8)),
    "sac": SACSettings(steps=640, walkers=8, gradient_steps=1, batch_size=32, buffer_size=400, random_steps=64, hidden=(8, 6)),
}  # fmt: skip


def begin(kind: str, folder: Path) -> None:
    """What there is before the work begins."""
    if kind in SETTINGS:
        training = Training(
            HEADING, 0, SETTINGS[kind], SHORT, episodes=2, checkpoint_seconds=0.0, algorithm=kind
        )
        make_run(training, folder / "run")
    elif kind == "series":
        choices = {"steps": 4096, "episodes": 2, "checkpoint_seconds": 0.0}
        new_series("Walk", [0, 1], folder, choices).rename(folder / "series")


def go_on(kind: str, folder: Path) -> None:
    """The work, from where it is to its end."""
    if kind in SETTINGS:
        run(folder / "run", progress=False)
    elif kind == "series":
        run_series(folder / "series", progress=False)
    elif kind == "evaluate":
        _evaluation(folder)
    elif kind == "tune":
        tuning = Tuning("feedback", "Heading", episodes=4, horizon=20.0)
        tune(tuning, 6, folder / "study.db", out=folder / "best.json", shown=lambda line: None)
    elif kind == "reproduce":
        write_report(reproduce(["table1", "table2", "figure4", "skateboard"], folder), folder)
    else:
        _analysis(kind, folder)


def _evaluation(folder: Path) -> Any:
    evaluation = Evaluation(
        episodes=1100, options=SHORT, cache=folder / "cache", runs=None, progress=False
    )
    return evaluation.run(evaluation.candidates(["Walk", "Heading"], ["fixed", "lqr", "ppo"]))


def _analysis(kind: str, folder: Path) -> Any:
    filling.SAVED_EVERY = 0.0
    if kind == "map":
        axes = {"hip_width": np.linspace(0.1, 0.5, 70), "slope": np.linspace(0.005, 0.05, 70)}
        return stability_map(Walker(), axes, path=folder / "map.nc")
    first, second = (
        ("ankle_angle", np.linspace(-0.1, 0.1, 60)),
        ("heading", np.linspace(-0.5, 0.5, 60)),
    )
    return basin(Walker(), first, second, n_steps=60, path=folder / "basin.nc")


def result(kind: str, folder: Path) -> str:
    """A digest of all that the finished work comes to, but for the time that it took."""
    digest = hashlib.sha256()
    if kind == "evaluate":
        for found in _evaluation(folder):
            for run_ in found.runs:
                digest.update(run_.survived.tobytes())
                for name in sorted(run_.metrics):
                    digest.update(run_.metrics[name].tobytes())
    elif kind in ("map", "basin"):
        data = _analysis(kind, folder)
        for name in sorted(data):
            digest.update(data[name].to_numpy().tobytes())
    else:
        names = ("*.csv", "*.safetensors", "evaluation.json", "report.md")
        for file in sorted(file for name in names for file in folder.rglob(name)):
            if file.name != "checkpoint.safetensors":  # which holds the seconds
                digest.update(file.name.encode() + file.read_bytes())
    return digest.hexdigest()


def leftovers(folder: Path) -> list[Path]:
    """Files that only work under way has."""
    return [*folder.rglob(".partial-*"), *folder.rglob(".lock")]


KINDS: tuple[str, ...] = (*SETTINGS, "series", "evaluate", "tune", "reproduce", "map", "basin")
COMPARED = tuple(kind for kind in KINDS if kind != "tune")
"""Kinds with the same result however often they are interrupted; what a study tries next depends on the trials there are."""
