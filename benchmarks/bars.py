"""What was measured beside what it should be."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from benchmarks.machine import machine


@dataclass(frozen=True)
class Figure:
    """One measured number.

    Parameters
    ----------
    name : str
        As in the JSON object.
    value : float
    unit : str
    sense : ">=" or "<=", optional
        How the value should compare with the bar.
    bar : float, optional
        None where there is nothing to reach.
    note : str
    """

    name: str
    value: float
    unit: str = ""
    sense: Literal[">=", "<=", ""] = ""
    bar: float | None = None
    note: str = ""

    @property
    def verdict(self) -> str:
        """ "met", "missed", or nothing where there is no bar."""
        if self.bar is None:
            return ""
        met = self.value >= self.bar if self.sense == ">=" else self.value <= self.bar
        return "met" if met else "missed"


Benchmark = Callable[[bool], Sequence[Figure]]


def as_json(figures: Sequence[Figure]) -> dict[str, Any]:
    """One object: every figure's value by its name, the verdicts, and the machine."""
    return {
        **{figure.name: figure.value for figure in figures},
        "verdicts": {figure.name: figure.verdict for figure in figures if figure.verdict},
        "bars": {f.name: f"{f.sense} {f.bar:g}" for f in figures if f.bar is not None},
        "machine": machine(),
    }


def as_text(figures: Sequence[Figure]) -> str:
    """A table, one line per figure."""
    width = max(len(figure.name) for figure in figures)
    lines = []
    for figure in figures:
        bar = "" if figure.bar is None else f"{figure.sense} {figure.bar:g}"
        value = f"{figure.value:>12,.4g}" if figure.value < 1e4 else f"{figure.value:>12,.0f}"
        line = f"{figure.name:<{width}} {value} {figure.unit:<10} {bar:<9} {figure.verdict:<7} {figure.note}"
        lines.append(line.rstrip())
    return "\n".join(lines)


def command_line(benchmark: Benchmark, description: str | None) -> None:
    """Run a benchmark as a program: ``--json`` for one JSON object, ``--smallest`` to see that it runs."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument(
        "--smallest", action="store_true", help="as little as possible: the figures mean nothing"
    )
    arguments = parser.parse_args()
    figures = benchmark(arguments.smallest)
    print(json.dumps(as_json(figures), indent=2) if arguments.json else as_text(figures))
