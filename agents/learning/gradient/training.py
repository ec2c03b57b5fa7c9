"""A gradient agent's training from settings to a policy: log, bar, checkpoints, and going on from one."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from torch.utils.tensorboard import SummaryWriter
from tqdm import tqdm

from agents.learning.checkpoint import CheckpointError, read_checkpoint, write_checkpoint
from agents.learning.gradient.learner import Ended, Learner
from agents.learning.gradient.networks import layer_weights
from agents.learning.gradient.settings import GradientSettings
from agents.learning.keeper import torch_threads
from agents.learning.results import Report, Trained, TrainingLog
from agents.observations import ObservationLayout
from agents.policies.policy import Policy, PolicyCard
from agents.policies.storage import task_of
from agents.versions import package_versions
from lean_yaw_env.envs.options import ACTION_SIZE, EnvOptions

ALGORITHM = "apg"
_RECENT = 128  # episodes that the progress bar's mean is of
_LOG = "log."


def train_gradient(
    env_id: str,
    settings: GradientSettings,
    *,
    seed: int = 0,
    options: EnvOptions | None = None,
    checkpoint: Path | None = None,
    checkpoint_seconds: float = 5.0,
    threads: int = 1,
    progress: bool = True,
    report: Report | None = None,
    tensorboard: Path | None = None,
) -> Trained:
    """Train a policy through the walkers' exact derivatives, going on from the checkpoint if its file is there.

    Interrupted and gone on with the same arguments, a training gives what it would have given uninterrupted, bit for bit.

    Parameters
    ----------
    env_id, settings, seed, options : what to train
    checkpoint : file for the training's state, written whole; none without
    checkpoint_seconds : least time between two of them
    threads : of torch and of the walkers
    progress : show a bar
    report : told of the steps done, between updates
    tensorboard : folder for TensorBoard's logs; none without

    Raises
    ------
    ValueError
        If a number is out of its range, the task has no differentiable formulas, or actions are delayed.
    CheckpointError
        If the checkpoint is damaged or another training's.
    """
    chosen = EnvOptions() if options is None else options
    with torch_threads(threads):
        learner = Learner(env_id, settings, seed, chosen, threads)
        diary = _Diary(checkpoint, checkpoint_seconds)
        diary.resume(learner)
        writer = None if tensorboard is None else SummaryWriter(str(tensorboard))
        with tqdm(
            total=settings.steps,
            initial=min(learner.steps, settings.steps),
            desc=f"training, seed {seed}",
            unit="step",
            unit_scale=True,
            disable=not progress,
        ) as bar:
            while learner.steps < settings.steps:
                ended = learner.update()
                diary.take(learner, ended)
                done = min(learner.steps, settings.steps)
                if report is not None:
                    report(done, diary.recent_mean())
                if writer is not None and ended:
                    writer.add_scalar("rollout/ep_rew_mean", diary.recent_mean(), learner.steps)
                bar.set_postfix({"return": f"{diary.recent_mean():.1f}"}, refresh=False)
                bar.update(done - bar.n)
        if writer is not None:
            writer.close()
        diary.write(learner)
    log = diary.log()
    return Trained(policy_of(learner, env_id, seed, chosen, log), log)


def policy_of(
    learner: Learner, env_id: str, seed: int, options: EnvOptions, log: TrainingLog
) -> Policy:
    """The learner's policy for inference. Observations come scaled already: their statistics are those that change nothing."""
    layout = ObservationLayout.of(task_of(env_id), options)
    settings = learner.settings
    deviation = np.full(ACTION_SIZE, math.log(settings.exploration), dtype=np.float32)
    weights = layer_weights(learner.policy) | {
        "observation_mean": np.zeros(len(layout.names), dtype=np.float32),
        "observation_variance": np.ones(len(layout.names), dtype=np.float32),
        "log_std": deviation,
    }
    card = PolicyCard(
        env_id=env_id,
        options=options,
        layout=layout,
        algorithm=ALGORITHM,
        activation="tanh",
        output="clip",
        seed=seed,
        settings={**asdict(settings), "hidden": list(settings.hidden)},
        training={"steps": learner.steps, "seconds": round(log.seconds, 1)},
        versions=package_versions(),
    )
    return Policy(card, weights)


class _Diary:
    """Keeps a training's log and its checkpoints."""

    def __init__(self, path: Path | None, pause: float) -> None:
        self._path = path
        self._pause = pause
        self._episodes: list[Ended] = []
        self._earlier = 0.0
        self._began = self._written = time.monotonic()

    def take(self, learner: Learner, ended: list[Ended]) -> None:
        """Note an update's episodes, and write a checkpoint if it is time for one."""
        self._episodes += ended
        if time.monotonic() - self._written >= self._pause:
            self.write(learner)

    def recent_mean(self) -> float:
        """Mean return of the last episodes; NaN before the first."""
        recent = [episode.value for episode in self._episodes[-_RECENT:]]
        return sum(recent) / len(recent) if recent else math.nan

    def log(self) -> TrainingLog:
        """The episodes so far."""
        steps, values, lengths, survived = (
            zip(*self._episodes, strict=True) if self._episodes else ((),) * 4
        )
        return TrainingLog(
            steps=np.array(steps, dtype=np.int64),
            returns=np.array(values, dtype=np.float64),
            lengths=np.array(lengths, dtype=np.int64),
            survived=np.array(survived, dtype=np.bool_),
            seconds=self._earlier + time.monotonic() - self._began,
        )

    def write(self, learner: Learner) -> None:
        """Write a checkpoint, if one is wanted."""
        if self._path is None:
            return
        log = {_LOG + k: np.asarray(v) for k, v in asdict(self.log()).items()}
        write_checkpoint(self._path, learner.capture() | log)
        self._written = time.monotonic()

    def resume(self, learner: Learner) -> None:
        """Bring learner and log to the checkpoint's state, if its file is there."""
        if self._path is None or not self._path.exists():
            return
        arrays = read_checkpoint(self._path)
        learner.restore(arrays)
        self._read_log(arrays)

    def _read_log(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        try:
            columns = [
                arrays[_LOG + name].tolist() for name in ("steps", "returns", "lengths", "survived")
            ]
            self._earlier = float(arrays[_LOG + "seconds"])
        except KeyError as error:
            raise CheckpointError(f"the checkpoint holds no log: {error}") from error
        self._episodes = [Ended(*row) for row in zip(*columns, strict=True)]
