"""What every training keeps while it runs: a log of its episodes, a bar, and checkpoints that it can be resumed from bit for bit."""

from __future__ import annotations

import contextlib
import csv
import io
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import safetensors.numpy
from numpy.typing import NDArray
from safetensors import SafetensorError
from tqdm import tqdm

from lean_yaw_env.files import write_text, written_whole

Arrays = dict[str, NDArray[Any]]

Report = Callable[[int, float], object]
"""Told between updates how many environment steps a training has done, and the mean return of its latest episodes, NaN before the first.

An exception that it raises ends the training.
"""

_LOG = "log."
_CSV_COLUMNS = ("steps", "return", "length", "survived")
_RECENT = 128  # episodes that the mean which is shown and reported is of


class CheckpointError(ValueError):
    """A checkpoint that is not this training's; the message says what is wrong."""


class EndedEpisode(NamedTuple):
    """An episode of a training that has ended.

    Attributes
    ----------
    steps : environment steps of the training when it ended
    value : its return
    length : its steps
    survived : whether the time limit or a success ended it
    """

    steps: int
    value: float
    length: int
    survived: bool


@dataclass(frozen=True)
class TrainingLog:
    """Every episode of a training, in the order in which they ended.

    Attributes
    ----------
    steps : shape (episodes,)
        Environment steps of the training when the episode ended.
    returns, lengths : shape (episodes,)
        The episode's return and its steps.
    survived : bool, shape (episodes,)
    seconds : wall-clock time of training, over all its sittings
    """

    steps: NDArray[np.int64]
    returns: NDArray[np.float64]
    lengths: NDArray[np.int64]
    survived: NDArray[np.bool_]
    seconds: float

    @classmethod
    def of(cls, rows: list[Any], seconds: float) -> TrainingLog:
        """A log of rows (steps, return, length, survived)."""
        steps, returns, lengths, survived = zip(*rows, strict=True) if rows else ((),) * 4
        return cls(
            np.array(steps, dtype=np.int64),
            np.array(returns, dtype=np.float64),
            np.array(lengths, dtype=np.int64),
            np.array(survived, dtype=np.bool_),
            seconds,
        )

    def rows(self) -> list[EndedEpisode]:
        """The episodes one by one."""
        columns = (self.steps, self.returns, self.lengths, self.survived)
        return [
            EndedEpisode(*row) for row in zip(*(each.tolist() for each in columns), strict=True)
        ]

    def write(self, path: Path) -> None:
        """Write the episodes as CSV."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(_CSV_COLUMNS)
        writer.writerows((*row[:3], int(row.survived)) for row in self.rows())
        write_text(path, text.getvalue())

    @classmethod
    def read(cls, path: Path, seconds: float) -> TrainingLog:
        """Read what ``write`` wrote, or raise ``ValueError``."""
        try:
            with path.open(encoding="utf-8", newline="") as file:
                header, *lines = csv.reader(file)
            if tuple(header) != _CSV_COLUMNS:
                raise ValueError(f"its columns must be {', '.join(_CSV_COLUMNS)}")
            rows = [(int(n), float(r), int(m), s != "0") for n, r, m, s in lines]
        except (OSError, ValueError) as error:
            raise ValueError(f"no episodes can be read from {str(path)!r}: {error}") from error
        return cls.of(rows, seconds)


def write_checkpoint(path: Path, arrays: Arrays) -> None:
    """Write arrays to a file, whole or not at all."""
    data = safetensors.numpy.save({k: np.asarray(v, order="C") for k, v in arrays.items()})
    with written_whole(path) as temporary:
        temporary.write_bytes(data)


def read_checkpoint(path: Path) -> Arrays:
    """Read what ``write_checkpoint`` wrote, or raise ``CheckpointError``."""
    try:
        return safetensors.numpy.load(path.read_bytes())
    except (OSError, SafetensorError) as error:
        raise CheckpointError(f"no checkpoint can be read from {str(path)!r}: {error}") from error


@contextlib.contextmanager
def restoring() -> Iterator[None]:
    """Within it, what does not fit is reported as a checkpoint of other settings: ``CheckpointError``."""
    try:
        yield
    except (KeyError, RuntimeError, ValueError) as error:
        raise CheckpointError(
            f"the checkpoint is not of a training with these settings: {error}"
        ) from error


def under(prefix: str, arrays: Arrays) -> Arrays:
    """The arrays whose names begin with a prefix, without it."""
    return {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}


class Recorder:
    """Keeps a training's log, shows its progress and writes its checkpoints.

    Parameters
    ----------
    total : environment steps of the whole training
    capture : gives all that decides how the training goes on, between two updates
    checkpoint : file for it, written whole; none without
    seconds : least time between two of them
    progress : show a bar
    label : of the bar
    report : told of the steps done and the latest returns, between updates
    """

    def __init__(
        self,
        total: int,
        capture: Callable[[], Arrays],
        *,
        checkpoint: Path | None = None,
        seconds: float = 5.0,
        progress: bool = True,
        label: str = "training",
        report: Report | None = None,
    ) -> None:
        self._total = total
        self._capture = capture
        self._checkpoint = checkpoint
        self._pause = seconds
        self._report = report
        self._episodes: list[EndedEpisode] = []
        self._earlier = 0.0
        self._began = self._written = time.monotonic()
        self._label, self._progress = label, progress
        self._bar = tqdm(disable=True)

    def saved(self) -> Arrays | None:
        """The arrays of the checkpoint, whose log is gone on with; None if there is none.

        Raises
        ------
        CheckpointError
            If the file is damaged or holds no log.
        """
        if self._checkpoint is None or not self._checkpoint.exists():
            return None
        arrays = read_checkpoint(self._checkpoint)
        log = under(_LOG, arrays)
        try:
            kept = TrainingLog(**{field.name: log[field.name] for field in fields(TrainingLog)})  # type: ignore[arg-type]
        except KeyError as error:
            raise CheckpointError(f"the checkpoint holds no log: {error}") from error
        self._earlier, self._episodes = float(kept.seconds), kept.rows()
        return arrays

    def start(self, steps: int) -> None:
        """Begin the clock and the bar of a training that has done so many steps."""
        self._began = self._written = time.monotonic()
        self._bar = tqdm(
            total=self._total,
            initial=min(steps, self._total),
            desc=self._label,
            unit="step",
            unit_scale=True,
            disable=not self._progress,
        )

    def add(self, episode: EndedEpisode) -> None:
        """Note an episode that has ended."""
        self._episodes.append(episode)

    def recent_return(self) -> float:
        """Mean return of the latest episodes; NaN before the first."""
        recent = [episode.value for episode in self._episodes[-_RECENT:]]
        return sum(recent) / len(recent) if recent else math.nan

    def between_updates(self, steps: int) -> None:
        """Show and report progress, and write a checkpoint if it is time for one."""
        self._show(steps)
        if time.monotonic() - self._written >= self._pause:
            self._write()

    def finish(self, steps: int) -> None:
        """Write the last checkpoint and show the end."""
        self._write()
        self._show(steps)

    def close(self) -> None:
        """Leave the bar as it is."""
        self._bar.close()

    def log(self) -> TrainingLog:
        """The episodes so far."""
        return TrainingLog.of(self._episodes, self._earlier + time.monotonic() - self._began)

    def _show(self, steps: int) -> None:
        done = min(steps, self._total)
        recent = self.recent_return()
        if not math.isnan(recent):
            self._bar.set_postfix({"return": f"{recent:.1f}"}, refresh=False)
        self._bar.update(done - self._bar.n)
        if self._report is not None:
            self._report(done, recent)

    def _write(self) -> None:
        if self._checkpoint is None:
            return
        log = {_LOG + name: np.asarray(value) for name, value in vars(self.log()).items()}
        write_checkpoint(self._checkpoint, self._capture() | log)
        self._written = time.monotonic()
