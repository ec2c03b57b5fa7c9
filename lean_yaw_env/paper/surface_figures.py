"""Figures 9 and 12: the greatest multiplier as a surface over ankle tilt and hip width."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lean_yaw_env.analysis import continue_gait, stability_map
from lean_yaw_env.paper.checks import Check, compare, judge
from lean_yaw_env.paper.drawing import MULTIPLIER, STABLE_FACE, name_axes, new_figure, picture_of
from lean_yaw_env.paper.numbers import number, statement
from lean_yaw_env.paper.results import Columns, Result
from lean_yaw_env.paper.walkers import flat_active_walker, table_1_gait
from lean_yaw_env.paper.wide_hips import (
    ROW_WIDTHS,
    WideHipRow,
    passive_rows,
    radii_on,
    widest_gait,
    widest_stable_hip,
)
from lean_yaw_env.parameters import Vector, WalkerParameters
from lean_yaw_env.walker import Walker

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_TOP = 1.5
_TILT, _WIDTH = "ankle joint orientation α (rad)", "hip width d"
_PASSIVE_TILTS = (0.14, 0.18)
_ACTIVE_TILTS, _ACTIVE_WIDTHS = (0.02, 0.8), (0.0, 0.44)
_EDGE = 0.2
"""Ankle tilt, rad, above which the lower edge of the active walker's stable region is not."""
_VIEW = (28.0, -62.0)
"""Elevation and azimuth, so that the plane of no hip width is the left front one."""
_STABLE, _UNSTABLE = (0.62, 0.84, 0.67, 1.0), (0.9, 0.9, 0.9, 1.0)
_COMPARED_WIDTHS = (0.0, 0.1, 0.2, 0.3)


@dataclass(frozen=True)
class MultiplierSurface:
    """The greatest |λ| of the stride over ankle tilt and hip width; nan where no gait was found.

    Attributes
    ----------
    tilts, widths, greatest : shape (n, m)
        Hip width is the same along a column.
    """

    tilts: Vector
    widths: Vector
    greatest: Vector

    def columns(self) -> Columns:
        return {
            "ankle_tilt": self.tilts.ravel(),
            "hip_width": self.widths.ravel(),
            "greatest_multiplier": self.greatest.ravel(),
        }


def passive_surface(rows: tuple[WideHipRow, ...], points: int = 121) -> MultiplierSurface:
    """Figure 9, on tilts that are dense along the stable valley, which is narrow and bends."""
    low, high = _PASSIVE_TILTS
    share = np.linspace(-1.0, 1.0, points)
    reach = (high - low) * np.sinh(4.0 * share) / np.sinh(4.0)
    tilts = np.array([np.clip(row.valley + reach, low, high) for row in rows]).T
    greatest = np.array([radii_on(row, tilts[:, j]) for j, row in enumerate(rows)]).T
    widths = np.tile([row.hip_width for row in rows], (points, 1))
    return MultiplierSurface(tilts, widths, greatest)


def active_surface(tilts: int = 79, widths: int = 45) -> MultiplierSurface:
    """Figure 12: slope 0.01, foot radius 0.5."""
    axes = {
        "ankle_tilt": np.linspace(*_ACTIVE_TILTS, tilts),
        "hip_width": np.linspace(*_ACTIVE_WIDTHS, widths),
    }
    data = stability_map(flat_active_walker(), axes, threads=2)
    grid = np.meshgrid(*axes.values(), indexing="ij")
    greatest = data["spectral_radius"].to_numpy().copy()
    # Several gaits share the lower edge, and a search finds now the one, now the other: follow one
    followed = {float(width): lower_edge(float(width)) for width in axes["hip_width"][::4]}
    followed = {width: edge for width, edge in followed.items() if edge[0].size}
    ends = [edge[0][0] for edge in followed.values()]
    for j, width in enumerate(axes["hip_width"]):
        edge = followed[min(followed, key=lambda known: abs(known - width))]
        least = np.interp(width, list(followed), ends)
        inside = (grid[0][:, j] >= least) & (grid[0][:, j] <= _EDGE)
        greatest[inside, j] = np.interp(grid[0][inside, j], *edge)
    return MultiplierSurface(grid[0], grid[1], greatest)


def lower_edge(hip_width: float) -> tuple[Vector, Vector]:
    """Tilts and greatest |λ| of the active gait from the least stable tilt up to ``_EDGE``, tilts rising.

    Empty if the gait found at ``_EDGE`` is not stable.
    """
    walker = Walker(WalkerParameters(hip_width=hip_width, ankle_tilt=_EDGE))
    branch = continue_gait(walker, "ankle_tilt", (_ACTIVE_TILTS[0], _EDGE), upward=False)
    radii = np.abs(branch.eigenvalues).max(axis=1) ** (2 // branch.n_steps)
    stable = int(np.argmax(~branch.is_stable)) if not branch.is_stable.all() else radii.size
    tilts, radii = branch.values[:stable], radii[:stable]
    leaving = [event.value for event in branch.events if event.is_leaving]
    if leaving and stable:
        tilts, radii = np.append(tilts, leaving[0]), np.append(radii, 1.0)
    return tilts[::-1], radii[::-1]


def draw_passive_surface(data: MultiplierSurface, rows: tuple[WideHipRow, ...]) -> Any:
    """Figure 9: the surface, and beside it the stable tilts at each hip width."""
    figure = new_figure(11.0, 4.6)
    _draw_in_space(figure.add_subplot(1, 2, 1, projection="3d"), data)
    plane = figure.add_subplot(1, 2, 2)
    ends = np.array([row.stable_tilts for row in rows])
    widths = [row.hip_width for row in rows]
    plane.fill_betweenx(widths, ends[:, 0], ends[:, 1], color=STABLE_FACE, edgecolor="k")
    plane.set_xlim(*_PASSIVE_TILTS)
    plane.set_ylim(0.0, widths[-1])
    plane.axhline(number("hip width limit, D").value, color="k", linewidth=0.8, linestyle=":")
    plane.annotate("the paper's limit", (0.165, number("hip width limit, D").value + 0.001))
    name_axes(plane, _TILT, _WIDTH, title="stable region")
    return figure


def draw_active_surface(data: MultiplierSurface) -> Any:
    """Figure 12: the surface with Table 1's walker, and beside it the stable region."""
    mark = (WalkerParameters().ankle_tilt, WalkerParameters().hip_width)
    figure = new_figure(11.0, 4.6)
    space = figure.add_subplot(1, 2, 1, projection="3d")
    _draw_in_space(space, data)
    space.plot([mark[0]], [mark[1]], [1.05], "k*", markersize=11, zorder=10)
    plane = figure.add_subplot(1, 2, 2)
    _draw_stable_region(plane, data)
    plane.plot(*mark, "k*", markersize=11)
    plane.annotate("Table 1", mark, xytext=(8, 4), textcoords="offset points")
    name_axes(plane, _TILT, _WIDTH, title="stable (shaded), no gait found (hatched)")
    return figure


def _draw_stable_region(plane: Axes, data: MultiplierSurface) -> None:
    grid = (data.tilts, data.widths)
    plane.contourf(*grid, data.greatest, levels=[0.0, 1.0], colors=[STABLE_FACE])
    plane.contour(*grid, data.greatest, levels=[1.0], colors="k", linewidths=1.2)
    missing = np.isnan(data.greatest).astype(float)
    if missing.any():
        plane.contourf(*grid, missing, levels=[0.5, 1.5], colors=["none"], hatches=["////"])


def _draw_in_space(space: Any, data: MultiplierSurface) -> None:
    """The surface cut at |λ| = 1.5, green where stable, with the section without hip width."""
    cut = np.minimum(data.greatest, _TOP)
    faces = np.where((data.greatest < 1.0)[..., None], _STABLE, _UNSTABLE)
    space.plot_surface(
        data.tilts,
        data.widths,
        cut,
        facecolors=faces,
        rcount=len(cut),
        ccount=cut.shape[1],
        linewidth=0,
    )
    space.plot(data.tilts[:, 0], data.widths[:, 0], cut[:, 0], "k-", linewidth=1.6, zorder=9)
    space.set_xlabel("α (rad)", labelpad=8)
    space.set_ylabel("d")
    space.set_zlabel(f"greatest {MULTIPLIER}")
    space.set_zlim(0.0, _TOP)
    space.locator_params(axis="x", nbins=5)
    space.locator_params(axis="y", nbins=5)
    space.view_init(*_VIEW)


def figure_9() -> Result:
    """Figure 9 with its checks."""
    rows = passive_rows()
    data = passive_surface(rows)
    return Result(
        checks=_passive_checks(rows),
        tables={
            "figure9": data.columns(),
            "figure9_stable_tilts": {
                "hip_width": ROW_WIDTHS,
                "least": [row.stable_tilts[0] for row in rows],
                "greatest": [row.stable_tilts[1] for row in rows],
            },
        },
        picture=picture_of(draw_passive_surface(data, rows)),
        caption=(
            "Greatest |λ| of the passive walker (r = 0.5, γ = 0.00058) over ankle tilt and hip "
            "width, cut at 1.5; the line at d = 0 is the upper envelope of Figure 8. Green is "
            "stable. Where several gaits exist, the least unstable one followed is shown."
        ),
    )


def _passive_checks(rows: tuple[WideHipRow, ...]) -> tuple[Check, ...]:
    width, tilt = widest_stable_hip()
    inside = [row for row in rows if row.hip_width <= number("hip width limit, D").value]
    narrow = [row.stable_tilts[1] - row.stable_tilts[0] for row in inside]
    least = int(np.argmin(narrow))
    contraction = [row.contraction for row in rows if row.hip_width <= width]
    wide = [row for row in rows if row.hip_width > width]
    return (
        compare(
            number("hip width limit, D"),
            width,
            unless=f"Stable gaits go on to d = {width:.4f}, at α = {tilt:.4f}, in intervals "
            "of α no wider than 0.0015; the paper's sketch is drawn from a number of "
            "cross-sections, which can miss them.",
        ),
        judge(
            statement("stable region, D"),
            bool(np.all(np.diff(narrow) < 0.0)),
            ours=f"{narrow[0]:.4f} at d = 0, {narrow[least]:.5f} at d = {inside[least].hip_width:.3f}, "
            f"{narrow[-1]:.5f} at d = {inside[-1].hip_width:.3f}",
            remark="The interval ends where one or the other of two oscillating pairs of multipliers leaves "
            "the unit circle. What both share is their product, by which a stride contracts: it is "
            f"{contraction[0]:.2f} at d = 0, at most {max(contraction):.2f}, near "
            f"d = {rows[int(np.argmax(contraction))].hip_width:.3f}, and {contraction[-1]:.2f} at "
            f"d = {rows[len(contraction) - 1].hip_width:.3f}. Where it is least, the pairs have most room.",
        ),
        judge(
            statement("no stable gait, D"),
            False,
            ours=f"least greatest |λ| at d = {', '.join(f'{row.hip_width:.2f}' for row in wide)}: "
            f"{', '.join(f'{row.radii.min():.2f}' for row in wide)}; no gait beyond {widest_gait():.3f}",
            remark="It grows as the paper says, but the gait ends in a fold long before d = 0.2, at every tilt "
            "tried; none was found beyond.",
        ),
    )


def figure_12() -> Result:
    """Figure 12 with its checks."""
    data = active_surface()
    gait = table_1_gait()
    ends = [stable_tilt_ends(width) for width in _COMPARED_WIDTHS]
    helps = all(a[0] > b[0] and a[1] <= b[1] for a, b in itertools.pairwise(ends))
    texts = [
        f"{low:.3f} to {high:.3f} at d = {d:g}"
        for d, (low, high) in zip(_COMPARED_WIDTHS, ends, strict=True)
    ]
    return Result(
        checks=(
            judge(
                statement("asterisk"),
                gait.is_stable,
                ours=f"greatest |λ| = {abs(gait.eigenvalues[0]):.4f}",
                unless="It is unstable.",
            ),
            judge(
                statement("wider hips"),
                helps,
                ours="stable α: "
                + "; ".join(texts)
                + f" ({np.pi / 2:.3f} is the greatest there is)",
                remark="The return to the course is a little slower with wider hips; no gait was "
                "found wider than about 0.4."
                if helps
                else "The stable interval does not grow on both sides.",
            ),
        ),
        tables={"figure12": data.columns()},
        picture=picture_of(draw_active_surface(data)),
        caption=(
            "Greatest |λ| of the active walker (r = 0.5, γ = 0.01) over ankle tilt and hip width, "
            "cut at 1.5; the line at d = 0 is the upper envelope of Figure 10 (right), the "
            "asterisk the parameter set of Table 1. Green is stable. Near α = 0.15 several gaits exist; "
            "shown is the one followed from larger tilts, to where it folds back or stops being stable, and "
            "below that what a search finds."
        ),
    )


def stable_tilt_ends(hip_width: float) -> tuple[float, float]:
    """Ankle tilts between which the active walker's gait at slope 0.01 is stable.

    From a stable gait in the middle both ways, to where a multiplier leaves the unit circle, the
    branch folds back, or the tilt ends at a right angle.
    """
    walker = Walker(WalkerParameters(hip_width=hip_width, ankle_tilt=0.4))
    ends = []
    for upward in (False, True):
        branch = continue_gait(walker, "ankle_tilt", (0.02, 0.5 * np.pi), upward=upward)
        leaving = [event.value for event in branch.events if event.is_leaving]
        ends.append(leaving[0] if leaving else float(branch.values[-1]))
    return ends[0], ends[1]
