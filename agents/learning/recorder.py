"""What every training keeps while it runs: a log of its episodes, a progress bar, and checkpoints from which it resumes bit for bit."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import safetensors.numpy
from numpy.typing import NDArray
from safetensors import SafetensorError
from tqdm import tqdm

from lean_yaw_env.files import write_text, written_whole

Arrays = dict[str, NDArray[Any]]
State = Mapping[str, Any]
"""Arrays, tensors and numbers by name, nested as deep as wanted; a name must not contain "/"."""

Report = Callable[[int, float], object]
"""Called between updates with the environment steps done and the mean return of the latest episodes, NaN before the first.

An exception that it raises ends the training.
"""

_TYPES = (np.int64, np.float64, np.int64, np.bool_)
_CSV_HEADER = "steps,return,length,survived"
_RECENT = 128  # episodes in the mean return that is shown and reported


class CheckpointError(ValueError):
    """A checkpoint that is damaged or belongs to another training; the message says what is wrong."""


class EndedEpisode(NamedTuple):
    """An ended episode: environment steps of the training at its end, return, number of steps, and whether the time limit or a success ended it."""

    steps: int
    value: float
    length: int
    survived: bool


@dataclass(frozen=True)
class TrainingLog:
    """Every episode of a training, in the order in which they ended.

    Attributes
    ----------
    steps, returns, lengths, survived : shape (episodes,)
        As in ``EndedEpisode``.
    seconds : wall-clock time of training, without interruptions
    """

    steps: NDArray[np.int64]
    returns: NDArray[np.float64]
    lengths: NDArray[np.int64]
    survived: NDArray[np.bool_]
    seconds: float

    @classmethod
    def of(cls, episodes: Iterable[Any], seconds: float) -> TrainingLog:
        """A log of rows (steps, return, length, survived)."""
        rows = list(episodes)
        columns = zip(*rows, strict=True) if rows else ((),) * 4
        return cls(*map(np.array, columns, _TYPES), seconds)  # type: ignore[arg-type]

    def require_sound(self) -> None:
        """``ValueError`` unless these are the episodes of a training."""
        n = len(self.steps)
        columns = (self.steps, self.returns, self.lengths, self.survived)
        types = [(column.dtype, column.shape) for column in columns]
        if types != [(np.dtype(kind), (n,)) for kind in _TYPES] or np.shape(self.seconds) != ():
            raise ValueError(f"it has columns of {types}")
        is_ordered = np.all(np.diff(self.steps, prepend=0) >= 0) and np.all(self.lengths > 0)
        if not (is_ordered and np.isfinite(self.returns).all() and 0.0 <= self.seconds < np.inf):
            raise ValueError("its numbers are none of a training")

    def episodes(self) -> list[EndedEpisode]:
        """The episodes one by one."""
        columns = (self.steps, self.returns, self.lengths, self.survived)
        return list(map(EndedEpisode, *(column.tolist() for column in columns)))

    def write(self, path: Path) -> None:
        """Write the episodes as CSV."""
        lines = (f"{n},{value!r},{length},{ok:d}\n" for n, value, length, ok in self.episodes())
        write_text(path, f"{_CSV_HEADER}\n{''.join(lines)}")

    @classmethod
    def read(cls, path: Path, seconds: float) -> TrainingLog:
        """Read what ``write`` wrote, or raise ``ValueError``."""
        try:
            header, *lines = path.read_text(encoding="utf-8").splitlines()
            if header != _CSV_HEADER:
                raise ValueError(f"its columns must be {_CSV_HEADER}")
            cells = (line.split(",") for line in lines)
            rows = [(int(n), float(r), int(m), s != "0") for n, r, m, s in cells]
        except (OSError, ValueError) as error:
            raise ValueError(f"no episodes can be read from {str(path)!r}: {error}") from error
        return cls.of(rows, seconds)


def flattened(state: State, prefix: str = "") -> Arrays:
    """A state's arrays, each under its path, as ``policy/action_net.weight``; views where possible."""
    arrays: Arrays = {}
    for name, value in state.items():
        path = f"{prefix}{name}"
        arrays |= (
            flattened(value, f"{path}/")
            if isinstance(value, Mapping)
            else {path: np.asarray(value)}
        )
    return arrays


def nested(arrays: Arrays) -> dict[str, Any]:
    """The inverse of ``flattened``; empty parts are lost."""
    state: dict[str, Any] = {}
    for path, array in arrays.items():
        *parts, name = path.split("/")
        inner = state
        for part in parts:
            inner = inner.setdefault(part, {})
        inner[name] = array
    return state


def write_checkpoint(path: Path, state: State) -> None:
    """Write a state to a file, whole or not at all."""
    arrays = {name: np.asarray(v, order="C") for name, v in flattened(state).items()}
    data = safetensors.numpy.save(arrays)
    with written_whole(path) as temporary:
        temporary.write_bytes(data)


def read_checkpoint(path: Path) -> dict[str, Any]:
    """Read what ``write_checkpoint`` wrote, as new arrays, or raise ``CheckpointError``."""
    try:
        arrays = safetensors.numpy.load(path.read_bytes())
    except (OSError, SafetensorError) as error:
        raise CheckpointError(f"no checkpoint can be read from {str(path)!r}: {error}") from error
    return nested({name: array.copy() for name, array in arrays.items()})


def _require_numbers(state: State) -> None:
    """``ValueError`` for NaN, and for infinities anywhere but among the walkers, whose limits may be infinite."""
    for name, array in flattened(state).items():
        is_bad = np.isnan if name.startswith("walkers/") else lambda each: ~np.isfinite(each)
        if array.dtype.kind == "f" and is_bad(array).any():
            raise ValueError(f"{name} must hold finite numbers")


def require_like(state: State, read: State) -> None:
    """``ValueError`` unless a state that was read has the names, types and shapes of another; a replay buffer has as many rows as are filled."""
    arrays = flattened(read)
    for name, array in flattened(state).items():
        if name not in arrays:
            raise ValueError(f"it lacks {name}")
        size = slice(1 if name.startswith("replay/") else 0, None)
        kinds = [f"{each.dtype} of shape {each.shape[size]}" for each in (array, arrays[name])]
        if kinds[0] != kinds[1]:
            raise ValueError(f"{name} must be {kinds[0]}, got {kinds[1]}")


def _require_equal(own: Arrays, read: Arrays) -> None:
    """``ValueError`` unless a learner has taken every array that was read as it is."""
    for name in sorted({*own, *read}):
        if name not in own or name not in read or not np.array_equal(own[name], read[name]):
            raise ValueError(f"{name} does not belong to it or holds impossible values")


class Recorder:
    """Keeps the log of a training of ``total`` steps, shows its progress and writes its checkpoints, whose state ``capture`` returns."""

    def __init__(
        self,
        total: int,
        capture: Callable[[], State],
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
        self._label, self._progress = label, progress

    def resume(self, restore: Callable[[State], None]) -> None:
        """Call ``restore`` with the state in the checkpoint, if there is one, and continue its log.

        Raises
        ------
        CheckpointError
            If the file is damaged or its state does not fit.
        """
        if self._checkpoint is None or not self._checkpoint.exists():
            return
        state = read_checkpoint(self._checkpoint)
        try:
            log = TrainingLog(**state.pop("log"))
            log.require_sound()
        except (KeyError, TypeError, AttributeError, ValueError) as error:
            raise CheckpointError(f"the checkpoint holds no log: {error}") from error
        self._earlier, self._episodes = float(log.seconds), log.episodes()
        try:
            _require_numbers(state)
            restore(state)
            _require_equal(flattened(self._capture()), flattened(state))
        except (LookupError, RuntimeError, TypeError, AttributeError, ValueError) as error:
            raise CheckpointError(
                f"the checkpoint is not of a training with these settings: {error}"
            ) from error

    @contextlib.contextmanager
    def running(self, steps: int) -> Iterator[None]:
        """Run the clock and the bar of a training that has done ``steps``."""
        self._began = self._written = time.monotonic()
        with tqdm(
            total=self._total,
            initial=min(steps, self._total),
            desc=self._label,
            unit="step",
            unit_scale=True,
            disable=not self._progress,
        ) as self._bar:
            yield

    def add(self, episode: EndedEpisode) -> None:
        """Note an episode that has ended."""
        self._episodes.append(episode)

    def recent_return(self) -> float:
        """Mean return of the latest episodes; NaN before the first."""
        recent = [episode.value for episode in self._episodes[-_RECENT:]]
        return sum(recent) / len(recent) if recent else math.nan

    def between_updates(self, steps: int, *, last: bool = False) -> None:
        """Show and report progress, and write a checkpoint if it is time for one or the training has ended."""
        done, recent = min(steps, self._total), self.recent_return()
        if not math.isnan(recent):
            self._bar.set_postfix({"return": f"{recent:.1f}"}, refresh=False)
        self._bar.update(done - self._bar.n)
        if self._report is not None:
            self._report(done, recent)
        is_due = last or time.monotonic() - self._written >= self._pause
        # before the first step there is nothing to keep, and resumed walkers would be reset once more
        if self._checkpoint and steps and is_due:
            write_checkpoint(self._checkpoint, {**self._capture(), "log": vars(self.log())})
            self._written = time.monotonic()

    def log(self) -> TrainingLog:
        """The episodes so far."""
        return TrainingLog.of(self._episodes, self._earlier + time.monotonic() - self._began)
