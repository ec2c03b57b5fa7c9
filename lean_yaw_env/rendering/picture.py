"""Footprints of several walks side by side, for paper and page."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from lean_yaw_env.files import require_ending
from lean_yaw_env.parameters import Foot, Vector
from lean_yaw_env.rendering.figures import ENDINGS, new_figure, save_figure
from lean_yaw_env.rendering.footprints import footprint_length, footprint_outlines
from lean_yaw_env.rendering.palette import FOOT_COLOURS, INK, STRONG_GRID, unit_colour
from lean_yaw_env.validation import require_mapping, require_number, require_numbers

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MARGIN = 1.0  # leg lengths around the footprints
_LEAST_WIDTH = (
    0.3  # of a panel, relative to its height: a straight walk would be a line without a width
)
_COLUMNS = 5
_INCHES = 14.0  # at most, of all panels beside each other


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
    walks: Mapping[str, WalkRecord],
    axes: Sequence[Axes],
    *,
    foot_radius: float = 0.5,
    places: ArrayLike = (),
) -> None:
    """Draw footprints and the centre of mass's path from above, one walk to an axes, all to one scale; downhill is up.

    Parameters
    ----------
    walks : mapping of names to walks
        With ``footprints`` (n, 2), ``headings`` (n,), ``stances`` (n) and ``path`` (m, 4) (time, downhill, up, right) as ``Walk`` has them; the
        path may be empty.
    axes : one for each walk
    foot_radius : [0, 1)
        Gives the prints' length.
    places : shape (k, 2)
        Further places on the floor that every axes must show, (downhill, right).

    Raises
    ------
    ValueError
        If there are not as many axes as walks, or no walks.
    """
    _require_walks(walks, foot_radius)
    points = _points(places)
    axes = list(np.ravel(np.asarray(axes, dtype=object)))
    if not walks or len(axes) != len(walks):
        raise ValueError(f"axes must be as many as walks, 1 or more: {len(axes)} and {len(walks)}")
    length = footprint_length(foot_radius)
    low, high = _extent(walks, points)
    for (name, walk), panel in zip(walks.items(), axes, strict=True):
        _draw_walk(panel, walk, length)
        panel.set_title(name)
        panel.set_aspect("equal")
        panel.set_xlim(low[1], high[1])
        panel.set_ylim(low[0], high[0])
        panel.set_xlabel("right (leg lengths)")
        panel.set_ylabel("downhill (leg lengths)")
        panel.grid(color=unit_colour(STRONG_GRID), linewidth=0.5)
        panel.set_axisbelow(True)


def footprint_figure(
    walks: Mapping[str, WalkRecord], *, foot_radius: float = 0.5, places: ArrayLike = ()
) -> tuple[Figure, list[Axes]]:
    """A figure of ``draw_footprints`` in lines of up to five panels, and the panels in the walks' order.

    Raises
    ------
    ValueError
        If there are no walks.
    gymnasium.error.DependencyNotInstalled
        If matplotlib is not installed.
    """
    if not walks:
        raise ValueError("walks must hold one walk or more, got none")
    low, high = _extent(walks, _points(places))
    lines = math.ceil(len(walks) / _COLUMNS)
    columns = math.ceil(len(walks) / lines)  # lines of equal length, but for the last
    # As tall as wide a panel would be, within bounds that suit a page
    shape = float(np.clip((high[0] - low[0]) / (high[1] - low[1]), 0.4, 3.0))
    width = min(4.0, _INCHES / columns, 7.5 / shape)
    figure = new_figure(width * columns + 0.9, (width * shape + 0.8) * lines + 0.3)
    # The layout for panels whose sides have a fixed ratio; the usual one pushes their titles off the picture
    figure.set_layout_engine("compressed")
    grid = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    panels, spare = list(grid.flat)[: len(walks)], list(grid.flat)[len(walks) :]
    for panel in spare:
        panel.remove()
    draw_footprints(walks, panels, foot_radius=foot_radius, places=places)
    for k, panel in enumerate(panels):
        is_lowest = k + columns >= len(panels)
        panel.tick_params(labelbottom=is_lowest)
        panel.xaxis.label.set_visible(is_lowest)
        panel.yaxis.label.set_visible(k % columns == 0)
    return figure, panels


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
    require_ending(path, ENDINGS)
    _require_walks(walks, foot_radius)
    save_figure(footprint_figure(walks, foot_radius=foot_radius)[0], path)


def _require_walks(walks: Any, foot_radius: Any) -> None:
    for name, walk in require_mapping("walks", walks).items():
        if not hasattr(walk, "footprints"):
            raise ValueError(f"walks must hold walks, got {walk!r} for {name!r}")
    require_number("foot_radius", foot_radius, 0.0, 1.0, "[)")


def _points(places: ArrayLike) -> Vector:
    """Places as an array (k, 2), with k = 0 of an empty sequence; ``ValueError`` for anything else."""
    is_empty = places.size == 0 if isinstance(places, np.ndarray) else places in ((), [])
    return np.empty((0, 2)) if is_empty else require_numbers("places", places, 2).reshape(-1, 2)


def _extent(walks: Mapping[str, WalkRecord], places: Vector) -> tuple[Vector, Vector]:
    """Corners (downhill, right) of what holds every footprint and place, wide enough to be a picture."""
    points = np.vstack([*(walk.footprints for walk in walks.values()), places])
    low, high = points.min(axis=0) - _MARGIN, points.max(axis=0) + _MARGIN
    short = np.maximum(_LEAST_WIDTH * (high - low).max() - (high - low), 0.0)
    return low - 0.5 * short, high + 0.5 * short


def _draw_walk(axes: Axes, walk: WalkRecord, length: float) -> None:
    from matplotlib.collections import PolyCollection

    outlines = footprint_outlines(walk.footprints, walk.headings, walk.stances, length)
    colours = [unit_colour(FOOT_COLOURS[foot]) for foot in walk.stances]
    # an edge of its own colour keeps prints visible where they are smaller than a dot
    prints = PolyCollection(
        list(outlines[:, :, ::-1]), facecolors=colours, edgecolors=colours, linewidths=0.4
    )
    axes.add_collection(prints)
    if len(walk.path):
        axes.plot(walk.path[:, 3], walk.path[:, 1], color=unit_colour(INK), linewidth=0.7)
