"""The comparison as a picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from lean_yaw_env.rendering.figures import new_figure, save_figure
from lean_yaw_env.rendering.palette import BLUE, LIGHT_GREY, unit_colour

OWN, OTHER = unit_colour(BLUE), unit_colour(LIGHT_GREY)


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
    figure = new_figure(9.0, 0.36 * len(bars) + 1.5)
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
    save_figure(figure, path, dpi=160)


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
