"""Time several cases side by side: rounds that take turns, so that what a shared machine does meanwhile meets all alike."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm


@dataclass(frozen=True)
class Effort:
    """How long to measure.

    Parameters
    ----------
    rounds : int
        Of every case.
    seconds : float
        About how long a case runs in a round.
    """

    rounds: int
    seconds: float


FULL = Effort(rounds=51, seconds=0.02)
SMALLEST = Effort(rounds=3, seconds=0.0)


class Timings:
    """Seconds per call of each case, one number per round."""

    def __init__(self, seconds: dict[str, NDArray[np.float64]]) -> None:
        self.seconds = seconds

    def median(self, case: str) -> float:
        """Seconds per call."""
        return float(np.median(self.seconds[case]))

    def ratio(self, slow: str, fast: str) -> float:
        """The median over rounds of one case's time over another's in the same round."""
        return float(np.median(self.seconds[slow] / self.seconds[fast]))


def _own_time() -> Callable[[], float]:
    """The clock of one thread's work: its processor time, which others on the machine do not add to, where that is fine enough."""
    fine = time.get_clock_info("thread_time").resolution <= 1e-6
    return time.thread_time if fine else time.perf_counter


def measure(
    cases: Mapping[str, Callable[[], object]], effort: Effort, label: str, *, threads: int = 1
) -> Timings:
    """Time each case, called often enough in each round for the clock; the first call of each is not counted.

    Work of one thread is measured by its processor time, that of several by the wall clock.
    """
    now = _own_time() if threads == 1 else time.perf_counter
    calls = {}
    for name, case in cases.items():
        case()
        began = now()
        case()
        once = max(now() - began, 1e-7)
        calls[name] = max(1, int(effort.seconds / once))
    seconds: dict[str, list[float]] = {name: [] for name in cases}
    for _ in tqdm(range(effort.rounds), desc=label, leave=False, disable=None):
        for name, case in cases.items():
            repeats = range(calls[name])
            began = now()
            for _ in repeats:
                case()
            seconds[name].append((now() - began) / calls[name])
    return Timings({name: np.array(values) for name, values in seconds.items()})
