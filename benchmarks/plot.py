"""The comparison as a picture."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

OWN, OTHER = "#1b6ca8", "#9a9a9a"


class Bar(Protocol):
    """What a bar shows."""

    @property
    def name(self) -> str: ...
    @property
    def steps_per_second(self) -> float: ...
    @property
    def ours(self) -> bool: ...


def save_plot(bars: Sequence[Bar], machine: Mapping[str, Any], path: Path) -> None:
    """Draw steps per second on a logarithmic axis, fastest on top, and write the picture whole."""
    figure = Figure(figsize=(9.0, 0.36 * len(bars) + 1.5), layout="constrained")
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    places = range(len(bars))
    speeds = [bar.steps_per_second for bar in bars]
    axes.barh(places, speeds, color=[OWN if bar.ours else OTHER for bar in bars])
    for place, speed in zip(places, speeds, strict=True):
        axes.text(speed * 1.1, place, _short(speed), va="center", fontsize=9)
    axes.set_yticks(places, [bar.name for bar in bars])
    for label, bar in zip(axes.get_yticklabels(), bars, strict=True):
        label.set_color(OWN if bar.ours else "black")
    axes.invert_yaxis()
    axes.set_xscale("log")
    axes.set_xlim(min(speeds) * 0.6, max(speeds) * 6.0)
    axes.set_xlabel("steps per second; this package (blue): whole walking steps")
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_title(_caption(machine), fontsize=9, loc="left", color="dimgray")
    _write(canvas, path)


def _caption(machine: Mapping[str, Any]) -> str:
    units = machine["vector_instructions"].upper().replace("AVX512F", "AVX-512")
    return (
        f"{machine['processor']} ({machine['architecture']}, {units}, {machine['cores']} cores), one thread "
        f"unless said, Python {machine['python']}"
    )


def _short(speed: float) -> str:
    for unit, size in (("M", 1e6), ("k", 1e3)):
        if speed >= size:
            return f"{speed / size:.3g} {unit}"
    return f"{speed:.3g}"


def _write(canvas: FigureCanvasAgg, path: Path) -> None:
    """Write beside the file first: a picture is there whole or not at all."""
    handle, name = tempfile.mkstemp(suffix=".png", dir=path.parent)
    os.close(handle)
    try:
        canvas.figure.savefig(name, dpi=160)
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise
