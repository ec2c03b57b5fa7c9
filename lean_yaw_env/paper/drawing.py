"""What the paper's graphs have in common: black lines on white, a box, Greek names on the axes."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lean_yaw_env.rendering.figures import new_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STABLE_FACE = "#dfeee2"
"""Behind a stable region."""
LIGHT_GREY, DARK_GREY = "#d9d9d9", "#a6a6a6"
"""The two stability regions of Figure 13."""
FAINT = "#7c7d80"
MULTIPLIER = "|λ|"
_DPI = 130

__all__ = [
    "DARK_GREY",
    "FAINT",
    "LIGHT_GREY",
    "MULTIPLIER",
    "STABLE_FACE",
    "mark_unit_circle",
    "name_axes",
    "new_figure",
    "picture_of",
    "shade_intervals",
]


def name_axes(axes: Axes, x: str, y: str, *, title: str = "") -> None:
    """Label an axes and give it the paper's plain box with ticks inside."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    if title:
        axes.set_title(title, fontsize=11)
    axes.tick_params(direction="in", top=True, right=True)


def mark_unit_circle(axes: Axes) -> None:
    """A line at |λ| = 1, under which a gait is stable."""
    axes.axhline(1.0, color=FAINT, linewidth=0.8, linestyle=":")


def shade_intervals(axes: Axes, x: Any, inside: Any, *, label: str) -> None:
    """Shade where ``inside`` holds, over the axes' whole height; x and inside of shape (n,)."""
    axes.fill_between(
        x,
        0.0,
        1.0,
        where=inside,
        transform=axes.get_xaxis_transform(),
        color=STABLE_FACE,
        linewidth=0,
        label=label,
        zorder=0,
    )


def picture_of(figure: Any) -> Callable[[Path], None]:
    """What draws a matplotlib figure into a file."""
    return partial(save_figure, figure, dpi=_DPI)
