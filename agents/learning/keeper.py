"""What Stable-Baselines3's trainings have in common here: a log, a bar, checkpoints, and going on from one."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from tqdm import tqdm

from agents.learning.checkpoint import Arrays, CheckpointError, read_checkpoint, write_checkpoint
from agents.learning.results import Report, TrainingLog
from lean_yaw_env.envs.sb3 import WalkerVecEnv

_LOG = "log."
_LOG_COLUMNS = ("steps", "returns", "lengths", "survived")
_RECENT = 128  # episodes that the mean which is shown and reported is of


class TimedBuffer(Protocol):
    """Experience that knows how long each step took."""

    pos: int
    durations: NDArray[np.float64]


@dataclass(frozen=True)
class Keeping:
    """What is kept of a training while it runs.

    Attributes
    ----------
    total : environment steps of the whole training
    capture : gives all that decides how the training goes on
    checkpoint : file for it, written whole; none without
    seconds : least time between two of them
    progress : show a bar
    label : of the bar
    report : told of the steps done and the latest returns, between updates
    """

    total: int
    capture: Callable[[], Arrays]
    checkpoint: Path | None = None
    seconds: float = 5.0
    progress: bool = True
    label: str = "training"
    report: Report | None = None


class Keeper(BaseCallback):
    """Keeps the log, shows the progress and writes checkpoints, all between updates; tells the buffer the steps' durations."""

    def __init__(self, keeping: Keeping, buffer: TimedBuffer) -> None:
        super().__init__()
        self._keeping = keeping
        self._buffer = buffer
        self._episodes: list[tuple[int, float, int, bool]] = []
        self._earlier = 0.0
        self._began = time.monotonic()
        self._written = self._began
        self._bar: Any = None

    def log(self) -> TrainingLog:
        """The episodes so far."""
        steps, returns, lengths, survived = (
            zip(*self._episodes, strict=True) if self._episodes else ((),) * 4
        )
        return TrainingLog(
            steps=np.array(steps, dtype=np.int64),
            returns=np.array(returns, dtype=np.float64),
            lengths=np.array(lengths, dtype=np.int64),
            survived=np.array(survived, dtype=np.bool_),
            seconds=self._earlier + time.monotonic() - self._began,
        )

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Go on with the log of a checkpoint, or raise ``CheckpointError``."""
        try:
            columns = [arrays[_LOG + name].tolist() for name in _LOG_COLUMNS]
            self._earlier = float(arrays[_LOG + "seconds"])
        except KeyError as error:
            raise CheckpointError(f"the checkpoint holds no log: {error}") from error
        self._episodes = list(zip(*columns, strict=True))

    def close(self) -> None:
        """Leave the bar as it is."""
        if self._bar is not None:
            self._bar.close()

    @property
    def _walkers(self) -> WalkerVecEnv:
        return self.training_env.unwrapped  # pyright: ignore[reportReturnType]

    def _on_training_start(self) -> None:
        self._began = self._written = time.monotonic()
        self._bar = tqdm(
            total=self._keeping.total,
            initial=min(self.num_timesteps, self._keeping.total),
            desc=self._keeping.label,
            unit="step",
            unit_scale=True,
            disable=not self._keeping.progress,
        )

    def _on_rollout_start(self) -> None:
        """Called between two updates: the one moment at which a state is complete."""
        self._show(self.num_timesteps)
        if time.monotonic() - self._written >= self._keeping.seconds:
            self._write()

    def _on_step(self) -> bool:
        """Called after each step of the walkers, before the buffer takes it."""
        self._buffer.durations[self._buffer.pos] = self._walkers.step_durations()
        for i in np.flatnonzero(self.locals["dones"]):
            info = self.locals["infos"][i]
            episode = info["episode"]
            self._episodes.append(
                (self.num_timesteps, episode["r"], episode["l"], info["TimeLimit.truncated"])
            )
        return True

    def _on_training_end(self) -> None:
        self._write()
        self._show(self._keeping.total)

    def _show(self, steps: int) -> None:
        done = min(steps, self._keeping.total)
        recent = [episode[1] for episode in self._episodes[-_RECENT:]]
        mean = sum(recent) / len(recent) if recent else math.nan
        if self._bar is not None:
            if recent:
                self._bar.set_postfix({"return": f"{mean:.1f}"}, refresh=False)
            self._bar.update(done - self._bar.n)
        if self._keeping.report is not None:
            self._keeping.report(done, mean)

    def _write(self) -> None:
        if self._keeping.checkpoint is None:
            return
        log = self.log()
        arrays = self._keeping.capture()
        for name in (*_LOG_COLUMNS, "seconds"):
            arrays[_LOG + name] = np.asarray(getattr(log, name))
        write_checkpoint(self._keeping.checkpoint, arrays)
        self._written = time.monotonic()


def learn(
    model: BaseAlgorithm,
    keeping: Keeping,
    buffer: TimedBuffer,
    restore: Callable[[Arrays], None],
) -> TrainingLog:
    """Train a model to the end, from its checkpoint on if the file is there, and close its environment.

    Raises
    ------
    CheckpointError
        If the checkpoint is damaged or another training's.
    """
    keeper = Keeper(keeping, buffer)
    if keeping.checkpoint is not None and keeping.checkpoint.exists():
        arrays = read_checkpoint(keeping.checkpoint)
        restore(arrays)
        keeper.restore(arrays)
    left = keeping.total - model.num_timesteps
    assert model.env is not None
    try:
        if left > 0:
            # SB3 counts what is left from where the model is, and so keeps the schedule's end
            model.learn(left, keeper, reset_num_timesteps=model.num_timesteps == 0)
    finally:
        keeper.close()
        model.env.close()
    return keeper.log()


@contextlib.contextmanager
def torch_threads(threads: int) -> Iterator[None]:
    """Torch's own default is a thread for every core, which small networks only lose by."""
    before = torch.get_num_threads()
    torch.set_num_threads(threads)
    try:
        yield
    finally:
        torch.set_num_threads(before)
