"""Figures 9 and 12: the greatest multiplier as a surface over ankle tilt and hip width.

The passive walker's gaits are followed along the ankle tilt. At small widths the gait folds back in the tilt, so the
branch is entered from both sides.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from lean_yaw_env.analysis import Branch, continue_gait, stability_map
from lean_yaw_env.engine import Engine
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.paper.checks import Check, Result, assess, compare, printed
from lean_yaw_env.paper.drawing import MULTIPLIER, STABLE_FACE, TILT, TOP, name_axes, picture_of
from lean_yaw_env.paper.walkers import (
    flat_active_walker,
    flat_passive_walker,
    gait_of,
    root,
    table_1_gait,
)
from lean_yaw_env.parameters import Vector, WalkerParameters
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.rendering.figures import new_figure
from lean_yaw_env.walker import Walker

ROW_WIDTHS = (
    *np.linspace(0.0, 0.012, 5).tolist(), *np.linspace(0.018, 0.06, 8).tolist(), 0.0635, 0.065,
    *np.linspace(0.07, 0.1, 4).tolist(),
)  # fmt: skip
"""Hip widths of Figure 9: close where the stable region changes fast, and nothing stable beyond."""
_SHOWN_TILTS = (0.14, 0.18)
"""Of Figure 9; the first and the last of them are where the branch is followed from no hip width."""
_BETWEEN = 12
"""Points looked at between two of a branch."""
_EDGE = 0.2
"""Ankle tilt, rad, above which the lower edge of the active walker's stable region is not."""


@dataclass(frozen=True)
class WideHipRow:
    """The passive gaits at one hip width.

    Attributes
    ----------
    hip_width : float
    pieces : tuple of (tilts, radii)
        Spectral radii of the stride along pieces of branches between folds, tilts rising.
    contraction : float
        Magnitude of the product of the stride's four greatest multipliers, where the spectral radius is least.
    """

    hip_width: float
    pieces: tuple[tuple[Vector, Vector], ...]
    contraction: float

    @classmethod
    def at(cls, width: float) -> WideHipRow:
        """The gaits at a hip width that lead to those without hip width."""
        pieces, least = [], (np.inf, np.nan)
        for branch in _branches(width):
            tilts, radii, products = _dense(branch)
            least = min(least, (float(radii.min()), float(products[radii.argmin()])))
            folds = np.flatnonzero(np.diff(np.sign(np.diff(tilts))) != 0) + 1
            for first, last in itertools.pairwise([0, *folds.tolist(), tilts.size - 1]):
                order = np.argsort(tilts[first : last + 1]) + first
                pieces.append((tilts[order], radii[order]))
        return cls(width, tuple(pieces), least[1])

    @property
    def tilts(self) -> Vector:
        """All ankle tilts looked at."""
        return np.concatenate([tilts for tilts, _ in self.pieces])

    @property
    def radii(self) -> Vector:
        """The spectral radii there."""
        return np.concatenate([radii for _, radii in self.pieces])

    @property
    def stable_tilts(self) -> tuple[float, float]:
        """Ends of the stable tilts; nan if there is none."""
        stable = self.tilts[self.radii < 1.0]
        return (float(stable.min()), float(stable.max())) if stable.size else (np.nan, np.nan)

    @property
    def valley(self) -> float:
        """The tilt of the least spectral radius."""
        return float(self.tilts[self.radii.argmin()])

    def radii_on(self, tilts: Vector) -> Vector:
        """Least spectral radius of the gaits known at each tilt; nan where there is none.

        Interpolated in its logarithm between points that are close together.
        """
        best = np.full(tilts.size, np.inf)
        for known, radii in self.pieces:
            inside = (tilts >= known[0]) & (tilts <= known[-1])
            values = np.exp(np.interp(tilts[inside], known, np.log(radii)))
            best[inside] = np.minimum(best[inside], values)
        return np.where(np.isfinite(best), best, np.nan)


@lru_cache(maxsize=1)
def widest_stable_hip() -> tuple[float, float]:
    """The widest hip with a stable gait, and its ankle tilt.

    The least spectral radius over the tilt rises through one at the width sought.
    """
    width = root(lambda width: _least_radius(width)[0] - 1.0, 0.06, 0.07, 1e-5)
    return width, _least_radius(width)[1]


def widest_gait() -> float:
    """The widest hip with a passive gait, stable or not: where its branch folds back, at the tilts tried."""
    flat = (flat_passive_walker(ankle_tilt=tilt) for tilt in (0.18, 0.5))
    return max(float(_over_widths(walker, 0.25).values.max()) for walker in flat)


def _over_widths(flat: PassiveWalker, width: float) -> Branch:
    state = gait_of(flat).state
    return continue_gait(flat, "hip_width", (0.0, width), state=state, most_points=60)


def _least_radius(width: float) -> tuple[float, float]:
    """The least spectral radius over the tilt at a hip width, and the tilt."""
    tilts, radii, _ = _dense(_branch(*gait_at(_SHOWN_TILTS[1], width), upward=False))
    lowest = int(np.argmin(radii))
    return float(radii[lowest]), float(tilts[lowest])


def _dense(branch: Branch) -> tuple[Vector, Vector, Vector]:
    """Along a branch, between its points too: tilts, the stride's spectral radii, products of the four greatest multipliers.

    The multipliers branch where two meet, but their characteristic polynomial is smooth along the
    branch: its coefficients are splined, and its roots taken.
    """
    stride = branch.eigenvalues ** (2 // branch.n_steps)
    polynomials = np.array([np.poly(values).real for values in stride])
    points = np.arange(branch.values.size)
    fine = np.linspace(0, points[-1], _BETWEEN * points[-1] + 1)
    roots = np.sort([np.abs(np.roots(row)) for row in CubicSpline(points, polynomials)(fine)])
    return CubicSpline(points, branch.values)(fine), roots[:, -1], roots[:, -4:].prod(axis=1)


def _branches(width: float) -> list[Branch]:
    """Branches along the tilt through the gaits at both ends; those that do not exist left out."""
    found = []
    for tilt in _SHOWN_TILTS:
        try:
            start, state = gait_at(tilt, width)
        except NoGaitError:
            continue
        found.extend(_branch(start, state, upward) for upward in (True, False))
    return [branch for branch in found if branch.values.size > 1]


def _branch(start: PassiveWalker, state: Vector, upward: bool) -> Branch:
    return continue_gait(
        start, "ankle_tilt", (0.13, 0.19), state=state, upward=upward, longest_step=0.03, most_points=150
    )  # fmt: skip


def gait_at(tilt: float, width: float) -> tuple[PassiveWalker, Vector]:
    """The passive walker with a tilt and hip width, and its gait's state, of the branch from no hip width."""
    flat = flat_passive_walker(ankle_tilt=tilt)
    if width == 0.0:
        return flat, gait_of(flat).state
    branch = _over_widths(flat, width)
    if abs(branch.values[-1] - width) > 1e-9:
        raise NoGaitError(f"the gait at ankle tilt {tilt:g} ends before hip width {width:g}")
    return flat_passive_walker(ankle_tilt=tilt, hip_width=width), branch.states[-1]


@dataclass(frozen=True)
class Surface:
    """The greatest |λ| of the stride over ankle tilt and hip width; nan where no gait was found.

    Attributes
    ----------
    tilts, widths, greatest : shape (n, m)
        Hip width is the same along a column.
    """

    tilts: Vector
    widths: Vector
    greatest: Vector

    def columns(self) -> dict[str, Vector]:
        names = ("ankle_tilt", "hip_width", "greatest_multiplier")
        values = (self.tilts, self.widths, self.greatest)
        return {name: each.ravel() for name, each in zip(names, values, strict=True)}

    def draw(self, space: Any) -> None:
        """The surface cut at |λ| = 1.5, green where stable, with the section without hip width."""
        cut = np.minimum(self.greatest, TOP)
        stable, unstable = (0.62, 0.84, 0.67, 1.0), (0.9, 0.9, 0.9, 1.0)
        faces = np.where((self.greatest < 1.0)[..., None], stable, unstable)
        space.plot_surface(
            self.tilts, self.widths, cut, facecolors=faces, rcount=len(cut), ccount=cut.shape[1], linewidth=0
        )  # fmt: skip
        space.plot(self.tilts[:, 0], self.widths[:, 0], cut[:, 0], "k-", linewidth=1.6, zorder=9)
        space.set_xlabel("α (rad)", labelpad=8)
        space.set_ylabel("d")
        space.set_zlabel(f"greatest {MULTIPLIER}")
        space.set_zlim(0.0, TOP)
        space.locator_params(axis="x", nbins=5)
        space.locator_params(axis="y", nbins=5)
        # So that the plane of no hip width is the left front one
        space.view_init(28.0, -62.0)


def passive_surface(rows: list[WideHipRow], points: int = 121) -> Surface:
    """Figure 9's, on tilts that are dense along the stable valley, which is narrow and bends."""
    low, high = _SHOWN_TILTS
    reach = (high - low) * np.sinh(4.0 * np.linspace(-1.0, 1.0, points)) / np.sinh(4.0)
    tilts = np.array([np.clip(row.valley + reach, low, high) for row in rows]).T
    greatest = np.array([row.radii_on(tilts[:, j]) for j, row in enumerate(rows)]).T
    return Surface(tilts, np.tile([row.hip_width for row in rows], (points, 1)), greatest)


def figure_9(widths: tuple[float, ...] = ROW_WIDTHS) -> Result:
    """Figure 9: the surface, and beside it the stable tilts at each hip width."""
    rows = [WideHipRow.at(width) for width in widths]
    surface, limit = passive_surface(rows), printed("hip width limit, D").value
    least, greatest = zip(*(row.stable_tilts for row in rows), strict=True)
    figure = new_figure(11.0, 4.6)
    surface.draw(figure.add_subplot(1, 2, 1, projection="3d"))
    plane = figure.add_subplot(1, 2, 2)
    plane.fill_betweenx(widths, least, greatest, color=STABLE_FACE, edgecolor="k")
    plane.set_xlim(*_SHOWN_TILTS)
    plane.set_ylim(0.0, widths[-1])
    plane.axhline(limit, color="k", linewidth=0.8, linestyle=":")
    plane.annotate("the paper's limit", (0.165, limit + 0.001))
    name_axes(plane, TILT, "hip width d", title="stable region")
    tilts = {"hip_width": widths, "least": least, "greatest": greatest}
    tables = {"figure9": surface.columns(), "figure9_stable_tilts": tilts}
    return Result(_passive_checks(rows), tables, picture_of(figure))


def _passive_checks(rows: list[WideHipRow]) -> list[Check]:
    width, tilt = widest_stable_hip()
    inside = [row for row in rows if row.hip_width <= printed("hip width limit, D").value]
    narrow = [row.stable_tilts[1] - row.stable_tilts[0] for row in inside]
    least = int(np.argmin(narrow))
    stable = [row for row in rows if row.hip_width <= width]
    contraction = [row.contraction for row in stable]
    wide = [row for row in rows if row.hip_width > width]
    return [
        compare(
            "hip width limit, D",
            width,
            otherwise=f"Stable gaits go on to d = {width:.4f}, at α = {tilt:.4f}, in intervals "
            "of α no wider than 0.0015; the paper's sketch is drawn from a number of "
            "cross-sections, which can miss them.",
        ),
        assess(
            "stable region, D",
            bool(np.all(np.diff(narrow) < 0.0)),
            f"{narrow[0]:.4f} at d = 0, {narrow[least]:.5f} at d = {inside[least].hip_width:.3f}, "
            f"{narrow[-1]:.5f} at d = {inside[-1].hip_width:.3f}",
            remark="The interval ends where one or the other of two oscillating pairs of multipliers leaves "
            "the unit circle. What both share is their product, by which a stride contracts: it is "
            f"{contraction[0]:.2f} at d = 0, at most {max(contraction):.2f}, near "
            f"d = {stable[int(np.argmax(contraction))].hip_width:.3f}, and {contraction[-1]:.2f} at "
            f"d = {stable[-1].hip_width:.3f}. Where it is least, the pairs have most room.",
        ),
        assess(
            "no stable gait, D",
            False,
            f"least greatest |λ| at d = {', '.join(f'{row.hip_width:.2f}' for row in wide)}: "
            f"{', '.join(f'{row.radii.min():.2f}' for row in wide)}; no gait beyond {widest_gait():.3f}",
        ),
    ]


def active_surface(tilts: int = 79, widths: int = 45) -> Surface:
    """Figure 12's: slope 0.01, foot radius 0.5."""
    axes = {
        "ankle_tilt": np.linspace(0.02, 0.8, tilts),
        "hip_width": np.linspace(0.0, 0.44, widths),
    }
    data = stability_map(flat_active_walker(), axes, engine=Engine(threads=2))
    grid = np.meshgrid(*axes.values(), indexing="ij")
    surface = Surface(grid[0], grid[1], data["spectral_radius"].to_numpy().copy())
    # Several gaits share the lower edge, and a search finds now the one, now the other: follow one
    followed = {float(width): lower_edge(float(width)) for width in axes["hip_width"][::4]}
    followed = {width: edge for width, edge in followed.items() if edge[0].size}
    ends = [edge[0][0] for edge in followed.values()]
    for j, width in enumerate(axes["hip_width"]):
        edge = followed[min(followed, key=lambda known: abs(known - width))]
        column = surface.tilts[:, j]
        inside = (column >= np.interp(width, list(followed), ends)) & (column <= _EDGE)
        surface.greatest[inside, j] = np.interp(column[inside], *edge)
    return surface


def lower_edge(hip_width: float) -> tuple[Vector, Vector]:
    """Tilts and greatest |λ| of the active gait from the least stable tilt up to ``_EDGE``, tilts rising.

    Empty if the gait found at ``_EDGE`` is not stable.
    """
    walker = Walker(WalkerParameters(hip_width=hip_width, ankle_tilt=_EDGE))
    branch = continue_gait(walker, "ankle_tilt", (0.02, _EDGE), upward=False)
    radii = np.abs(branch.eigenvalues).max(axis=1) ** (2 // branch.n_steps)
    stable = int(np.argmax(~branch.is_stable)) if not branch.is_stable.all() else radii.size
    tilts, radii = branch.values[:stable], radii[:stable]
    leaving = branch.ends_of_stability
    if leaving and stable:
        tilts, radii = np.append(tilts, leaving[0]), np.append(radii, 1.0)
    return tilts[::-1], radii[::-1]


def stable_tilt_ends(hip_width: float) -> tuple[float, float]:
    """Ankle tilts between which the active walker's gait at slope 0.01 is stable.

    From a stable gait in the middle both ways, to where a multiplier leaves the unit circle, the
    branch folds back, or the tilt ends at a right angle.
    """
    walker = Walker(WalkerParameters(hip_width=hip_width, ankle_tilt=0.4))
    ends = []
    for upward in (False, True):
        branch = continue_gait(walker, "ankle_tilt", (0.02, 0.5 * np.pi), upward=upward)
        ends.append(next(iter(branch.ends_of_stability), float(branch.values[-1])))
    return ends[0], ends[1]


def figure_12(tilts: int = 79, widths: int = 45) -> Result:
    """Figure 12: the surface with Table 1's walker, and beside it the stable region."""
    surface = active_surface(tilts, widths)
    mark = (WalkerParameters().ankle_tilt, WalkerParameters().hip_width)
    figure = new_figure(11.0, 4.6)
    space = figure.add_subplot(1, 2, 1, projection="3d")
    surface.draw(space)
    space.plot([mark[0]], [mark[1]], [1.05], "k*", markersize=11, zorder=10)
    plane = figure.add_subplot(1, 2, 2)
    grid = (surface.tilts, surface.widths)
    plane.contourf(*grid, surface.greatest, levels=[0.0, 1.0], colors=[STABLE_FACE])
    plane.contour(*grid, surface.greatest, levels=[1.0], colors="k", linewidths=1.2)
    missing = np.isnan(surface.greatest).astype(float)
    if missing.any():
        plane.contourf(*grid, missing, levels=[0.5, 1.5], colors=["none"], hatches=["////"])
    plane.plot(*mark, "k*", markersize=11)
    plane.annotate("Table 1", mark, xytext=(8, 4), textcoords="offset points")
    name_axes(plane, TILT, "hip width d", title="stable (shaded), no gait found (hatched)")
    ends = {width: stable_tilt_ends(width) for width in (0.0, 0.1, 0.2, 0.3)}
    texts = [f"{low:.3f} to {high:.3f} at d = {d:g}" for d, (low, high) in ends.items()]
    checks = [
        assess(
            "asterisk",
            table_1_gait().is_stable,
            f"greatest |λ| = {abs(table_1_gait().eigenvalues[0]):.4f}",
        ),
        assess(
            "wider hips",
            all(a[0] > b[0] and a[1] <= b[1] for a, b in itertools.pairwise(ends.values())),
            f"stable α: {'; '.join(texts)} ({np.pi / 2:.3f} is the greatest there is)",
        ),
    ]
    return Result(checks, {"figure12": surface.columns()}, picture_of(figure))
