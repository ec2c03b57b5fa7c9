"""Matplotlib figures: made without a display and without global state, and written whole."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from lean_yaw_env.extras import needs_extra
from lean_yaw_env.files import require_ending, written_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ENDINGS = (".png", ".svg", ".pdf")
_DPI = 150


def new_figure(width: float, height: float) -> Figure:
    """A figure of a size in inches that needs no display and leaves no global state.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        If matplotlib is not installed.
    """
    with needs_extra("render"):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def panels(
    count: int, columns: int, size: tuple[float, float], margin: tuple[float, float], **shared: Any
) -> tuple[Figure, list[Axes]]:
    """A figure with so many panels, up to ``columns`` beside one another: ``size`` inches each, within a margin. ``shared`` may hold ``sharex`` and
    ``sharey``."""
    columns = min(count, columns)
    lines = -(-count // columns)
    figure = new_figure(size[0] * columns + margin[0], size[1] * lines + margin[1])
    places = list(figure.subplots(lines, columns, squeeze=False, **shared).flat)
    for spare in places[count:]:
        spare.set_axis_off()
    return figure, places[:count]


def save_figure(figure: Figure, path: str | os.PathLike[str], *, dpi: float = _DPI) -> None:
    """Write a figure to a .png, .svg or .pdf, whole or not at all.

    Raises
    ------
    ValueError
        If the path has another ending or its folder does not exist.
    """
    with written_whole(require_ending(path, ENDINGS)) as temporary:
        figure.savefig(temporary, dpi=dpi)
