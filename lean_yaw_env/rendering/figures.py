"""Matplotlib figures: made without a display and without global state, and written whole."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from lean_yaw_env.extras import needs_extra
from lean_yaw_env.files import require_ending, written_whole

if TYPE_CHECKING:
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


def save_figure(figure: Figure, path: str | os.PathLike[str], *, dpi: float = _DPI) -> None:
    """Write a figure to a .png, .svg or .pdf, whole or not at all.

    Raises
    ------
    ValueError
        If the path has another ending or its folder does not exist.
    """
    with written_whole(require_ending(path, ENDINGS)) as temporary:
        figure.savefig(temporary, dpi=dpi)
