"""Measured values beside their targets."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from benchmarks.machine import machine


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


Benchmark = Callable[[bool], Sequence[Measurement]]


def as_json(measurements: Sequence[Measurement]) -> dict[str, Any]:
    """One object: every measured value by its name, the verdicts, and the machine."""
    return {
        **{m.name: m.value for m in measurements},
        "verdicts": {m.name: m.verdict for m in measurements if m.verdict},
        "targets": {
            m.name: f"{m.sense} {m.target:g}" for m in measurements if m.target is not None
        },
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


def command_line(benchmark: Benchmark, description: str | None) -> None:
    """Run a benchmark as a program: ``--json`` for one JSON object, ``--smallest`` to see that it runs."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument(
        "--smallest", action="store_true", help="as little as possible: the values mean nothing"
    )
    arguments = parser.parse_args()
    measured = benchmark(arguments.smallest)
    print(json.dumps(as_json(measured), indent=2) if arguments.json else as_text(measured))
