"""Time several cases side by side, in rounds that take turns, so that what a shared machine does meanwhile meets all alike; show values beside targets."""

from __future__ import annotations

import argparse
import json
import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from llvmlite import binding
from numpy.typing import NDArray
from tqdm import tqdm

_PACKAGES = (
    "numpy", "numba", "scipy", "gymnasium", "stable-baselines3", "torch", "mujoco", "envpool",
)  # fmt: skip


class Effort(NamedTuple):
    """How long to measure: rounds of every case, and about how many seconds a case runs in a round."""

    rounds: int
    seconds: float


FULL = Effort(rounds=51, seconds=0.02)
SMALLEST = Effort(rounds=3, seconds=0.0)


@dataclass(frozen=True)
class Timings:
    """Seconds per call of each case, one number per round."""

    seconds: dict[str, NDArray[np.float64]]

    def median(self, case: str) -> float:
        """Seconds per call."""
        return float(np.median(self.seconds[case]))

    def ratio(self, slow: str, fast: str) -> float:
        """The median over rounds of one case's time over another's in the same round."""
        return float(np.median(self.seconds[slow] / self.seconds[fast]))


def measure(
    cases: Mapping[str, Callable[[], object]], effort: Effort, label: str, *, threads: int = 1
) -> Timings:
    """Time each case, called often enough in each round for the clock; the first call of each is not counted.

    Work of one thread is measured by its processor time, which others on the machine do not add to, where that is fine enough;
    that of several threads by the wall clock.
    """
    fine = time.get_clock_info("thread_time").resolution <= 1e-6
    now = time.thread_time if fine and threads == 1 else time.perf_counter
    calls = {}
    for name, case in cases.items():
        case()
        began = now()
        case()
        calls[name] = max(1, int(effort.seconds / max(now() - began, 1e-7)))
    seconds: dict[str, list[float]] = {name: [] for name in cases}
    for _ in tqdm(range(effort.rounds), desc=label, leave=False, disable=None):
        for name, case in cases.items():
            repeats = range(calls[name])
            began = now()
            for _ in repeats:
                case()
            seconds[name].append((now() - began) / calls[name])
    return Timings({name: np.array(values) for name, values in seconds.items()})


@dataclass(frozen=True)
class Measurement:
    """One measured number.

    Parameters
    ----------
    name : str
        As in the JSON object.
    value : float
    unit : str
    sense : ">=" or "<=", optional
        How the value should compare with the target.
    target : float, optional
        None where there is nothing to reach.
    note : str
    """

    name: str
    value: float
    unit: str = ""
    sense: Literal[">=", "<=", ""] = ""
    target: float | None = None
    note: str = ""

    @property
    def verdict(self) -> str:
        """ "met", "missed", or nothing where there is no target."""
        if self.target is None:
            return ""
        met = self.value >= self.target if self.sense == ">=" else self.value <= self.target
        return "met" if met else "missed"


def as_json(measurements: Sequence[Measurement]) -> dict[str, Any]:
    """One object: every measured value by its name, the verdicts, and the machine."""
    judged = [m for m in measurements if m.target is not None]
    return {
        **{m.name: m.value for m in measurements},
        "verdicts": {m.name: m.verdict for m in judged},
        "targets": {m.name: f"{m.sense} {m.target:g}" for m in judged},
        "machine": machine(),
    }


def as_text(measurements: Sequence[Measurement]) -> str:
    """A table, one line per measurement."""
    width = max(len(m.name) for m in measurements)
    lines = []
    for m in measurements:
        target = "" if m.target is None else f"{m.sense} {m.target:g}"
        value = f"{m.value:>12,.4g}" if m.value < 1e4 else f"{m.value:>12,.0f}"
        line = f"{m.name:<{width}} {value} {m.unit:<10} {target:<9} {m.verdict:<7} {m.note}"
        lines.append(line.rstrip())
    return "\n".join(lines)


def parser(description: str | None) -> argparse.ArgumentParser:
    """The options that every benchmark has."""
    options = argparse.ArgumentParser(description=description)
    options.add_argument("--json", action="store_true", help="print one JSON object")
    options.add_argument(
        "--smallest", action="store_true", help="as little as possible: the values mean nothing"
    )
    return options


def command_line(
    benchmark: Callable[[bool], Sequence[Measurement]], description: str | None
) -> None:
    """Run a benchmark as a program."""
    options = parser(description).parse_args()
    measured = benchmark(options.smallest)
    print(json.dumps(as_json(measured), indent=2) if options.json else as_text(measured))


def machine() -> dict[str, Any]:
    """Processor, its vector units, cores, load, and the versions of what was measured."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    features = binding.get_host_cpu_features()
    widest = next((f for f in ("avx512f", "avx2", "neon") if features.get(f)), "none")
    versions = {}
    for package in _PACKAGES:
        try:
            versions[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return {
        "processor": models[0] if models else platform.processor() or platform.machine(),
        "architecture": binding.get_host_cpu_name(),
        "vector_instructions": widest,
        "cores": os.cpu_count(),
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        "system": platform.system(),
        "python": platform.python_version(),
        "versions": versions,
    }
