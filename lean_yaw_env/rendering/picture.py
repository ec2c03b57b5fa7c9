"""Footprints of several walks side by side, for paper and page."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from lean_yaw_env.files import require_ending, written_whole
from lean_yaw_env.parameters import Foot, Vector
from lean_yaw_env.rendering.footprints import footprint_length, footprint_outlines
from lean_yaw_env.rendering.optional import require_matplotlib
from lean_yaw_env.rendering.palette import FOOT_COLOURS, INK, STRONG_GRID, unit_colour

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ENDINGS = (".png", ".svg", ".pdf")
DPI = 150
_MARGIN = 0.8  # leg lengths around the footprints


class WalkRecord(Protocol):
    """What footprints are drawn from; a ``Walk`` with a sampled path is one."""

    @property
    def footprints(self) -> Vector: ...
    @property
    def headings(self) -> Vector: ...
    @property
    def stances(self) -> Sequence[Foot]: ...
    @property
    def path(self) -> Vector: ...


def draw_footprints(
    walks: Mapping[str, WalkRecord], axes: Sequence[Axes], *, foot_radius: float = 0.5
) -> None:
    """Draw footprints and the centre of mass's path from above, one walk to an axes, all to one
    scale; downhill is up.

    Parameters
    ----------
    walks : mapping of names to walks
        With ``footprints`` (n, 2), ``headings`` (n,), ``stances`` (n) and ``path`` (m, 4) (time,
        downhill, up, right) as ``Walk`` has them; the path may be empty.
    axes : one for each walk
    foot_radius : [0, 1)
        Gives the prints' length.

    Raises
    ------
    ValueError
        If there are not as many axes as walks, or no walks.
    """
    axes = list(np.ravel(np.asarray(axes, dtype=object)))
    if not walks or len(axes) != len(walks):
        raise ValueError(f"axes must be as many as walks, 1 or more: {len(axes)} and {len(walks)}")
    length = footprint_length(foot_radius)
    low, high = _extent(walks)
    for (name, walk), place in zip(walks.items(), axes, strict=True):
        _draw_walk(place, walk, length)
        place.set_title(name)
        place.set_aspect("equal")
        place.set_xlim(low[1], high[1])
        place.set_ylim(low[0], high[0])
        place.set_xlabel("right (leg lengths)")
        place.grid(color=unit_colour(STRONG_GRID), linewidth=0.5)
        place.set_axisbelow(True)
    axes[0].set_ylabel("downhill (leg lengths)")


def save_footprints(
    walks: Mapping[str, WalkRecord], path: str | os.PathLike[str], *, foot_radius: float = 0.5
) -> None:
    """Write a picture of ``draw_footprints`` to a .png, .svg or .pdf, whole or not at all.

    Raises
    ------
    ValueError
        If the path has another ending, or there are no walks.
    gymnasium.error.DependencyNotInstalled
        If matplotlib is not installed.
    """
    place = require_ending(path, ENDINGS)
    if not walks:
        raise ValueError("walks must hold one walk or more, not none")
    low, high = _extent(walks)
    # as tall as wide a panel would be, within bounds that suit a page
    shape = min(max((high[0] - low[0]) / (high[1] - low[1]), 0.4), 2.5)
    width = min(4.0, 9.0 / shape)
    figure = new_figure(width * len(walks) + 0.9, width * shape + 1.1)
    axes = figure.subplots(1, len(walks), sharex=True, sharey=True, squeeze=False)
    draw_footprints(walks, list(axes[0]), foot_radius=foot_radius)
    save_figure(figure, place)


def save_figure(figure: Any, path: Path, *, dpi: int = DPI) -> None:
    """Write a figure to a file, whole or not at all."""
    figure.draw_without_rendering()  # panels of a fixed shape are laid out right at the second time only
    with written_whole(path) as temporary:
        figure.savefig(temporary, dpi=dpi)


def new_figure(width: float, height: float) -> Any:
    """A matplotlib figure, in inches, that needs no display and leaves no global state."""
    require_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _extent(walks: Mapping[str, WalkRecord]) -> tuple[Vector, Vector]:
    points = np.vstack([walk.footprints for walk in walks.values()])
    low, high = points.min(axis=0) - _MARGIN, points.max(axis=0) + _MARGIN
    # a straight walk would be a line without a width
    least = 0.25 * (high - low).max()
    short = np.maximum(least - (high - low), 0.0)
    return low - 0.5 * short, high + 0.5 * short


def _draw_walk(axes: Axes, walk: WalkRecord, length: float) -> None:
    from matplotlib.collections import PolyCollection

    outlines = footprint_outlines(walk.footprints, walk.headings, walk.stances, length)
    colours = [unit_colour(FOOT_COLOURS[foot]) for foot in walk.stances]
    # an edge of its own colour keeps prints visible where they are smaller than a dot
    axes.add_collection(
        PolyCollection(
            list(outlines[:, :, ::-1]), facecolors=colours, edgecolors=colours, linewidths=0.4
        )
    )
    if len(walk.path):
        axes.plot(walk.path[:, 3], walk.path[:, 1], color=unit_colour(INK), linewidth=0.7)
