"""The passive walker with a finite hip width: its gaits followed along the ankle tilt.

At small widths the gait folds back in the tilt, so the branch is entered from both sides.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import root_scalar

from lean_yaw_env.analysis import Branch, continue_gait
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.paper.walkers import flat_passive_walker, passive_gait
from lean_yaw_env.parameters import Vector
from lean_yaw_env.passive import PassiveWalker

ROW_WIDTHS = np.concatenate(
    [
        np.linspace(0.0, 0.012, 5),
        np.linspace(0.018, 0.06, 8),
        (0.0635, 0.065),
        np.linspace(0.07, 0.1, 4),
    ]
)
"""Hip widths of Figure 9: close where the stable region changes fast, and nothing stable beyond."""
ROW_WIDTHS.flags.writeable = False
_TILTS = (0.13, 0.19)
_BETWEEN = 12
"""Points looked at between two of a branch."""
_WIDE_TILTS = (0.18, 0.5)
_ENTRIES = (0.14, 0.18)
"""Ankle tilts at which the branch is followed from no hip width, rad."""


@dataclass(frozen=True)
class WideHipRow:
    """The gaits at one hip width.

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

    @property
    def stable_tilts(self) -> tuple[float, float]:
        """Ends of the stable tilts; nan if there is none."""
        stable = [tilts[radii < 1.0] for tilts, radii in self.pieces]
        every = np.concatenate(stable)
        return (float(every.min()), float(every.max())) if every.size else (np.nan, np.nan)

    @property
    def valley(self) -> float:
        """The tilt of the least spectral radius."""
        return float(min(((r.min(), t[r.argmin()]) for t, r in self.pieces))[1])

    @property
    def radii(self) -> Vector:
        """All spectral radii known."""
        return np.concatenate([radii for _, radii in self.pieces])


def radii_on(row: WideHipRow, tilts: Vector) -> Vector:
    """Least spectral radius of the gaits known at each tilt; nan where there is none.

    Interpolated in its logarithm between points that are close together.
    """
    best = np.full(tilts.size, np.inf)
    for known, radii in row.pieces:
        inside = (tilts >= known[0]) & (tilts <= known[-1])
        values = np.exp(np.interp(tilts[inside], known, np.log(radii)))
        best[inside] = np.minimum(best[inside], values)
    return np.where(np.isfinite(best), best, np.nan)


def passive_rows(widths: Vector = ROW_WIDTHS) -> tuple[WideHipRow, ...]:
    """Gaits at some hip widths, shape (n,)."""
    return tuple(_row(float(width)) for width in widths)


@lru_cache(maxsize=1)
def widest_stable_hip() -> tuple[float, float]:
    """The widest hip with a stable gait, and its ankle tilt.

    The least spectral radius over the tilt rises through one at the width sought.
    """

    def excess(width: float) -> float:
        return _least_radius(width)[0] - 1.0

    width = float(root_scalar(excess, bracket=(0.06, 0.07), xtol=1e-5).root)
    return width, _least_radius(width)[1]


def widest_gait() -> float:
    """The widest hip with a passive gait, stable or not: where its branch folds back, at the tilts tried."""
    return max(
        float(_over_widths(_entry_walker(tilt, 0.0), 0.25).values.max()) for tilt in _WIDE_TILTS
    )


def _over_widths(flat: PassiveWalker, width: float) -> Branch:
    state = passive_gait(flat).state
    return continue_gait(flat, "hip_width", (0.0, width), state=state, most_points=60)


def _least_radius(width: float) -> tuple[float, float]:
    """The least spectral radius over the tilt at a hip width, and the tilt."""
    start, state = gait_at(_ENTRIES[1], width)
    tilts, radii, _ = _dense(_branch(start, state, upward=False))
    lowest = int(np.argmin(radii))
    return float(radii[lowest]), float(tilts[lowest])


def _row(width: float) -> WideHipRow:
    pieces, least = [], (np.inf, np.nan)
    for branch in _branches(width):
        tilts, radii, products = _dense(branch)
        least = min(least, (float(radii.min()), float(products[radii.argmin()])))
        folds = np.flatnonzero(np.diff(np.sign(np.diff(tilts))) != 0) + 1
        bounds = [0, *folds.tolist(), tilts.size - 1]
        for first, last in itertools.pairwise(bounds):
            order = np.argsort(tilts[first : last + 1]) + first
            pieces.append((tilts[order], radii[order]))
    return WideHipRow(width, tuple(pieces), least[1])


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
    """Branches along the tilt through the gaits at the entries; those that do not exist left out."""
    found = []
    for tilt in _ENTRIES:
        try:
            start, state = gait_at(tilt, width)
        except NoGaitError:
            continue
        found.extend(_branch(start, state, upward) for upward in (True, False))
    return [branch for branch in found if branch.values.size > 1]


def _branch(start: PassiveWalker, state: Vector, upward: bool) -> Branch:
    return continue_gait(
        start, "ankle_tilt", _TILTS, state=state, upward=upward, longest_step=0.03, most_points=150
    )


def gait_at(tilt: float, width: float) -> tuple[PassiveWalker, Vector]:
    """The gait at a tilt and hip width, of the branch from no hip width."""
    flat = _entry_walker(tilt, 0.0)
    if width == 0.0:
        return flat, passive_gait(flat).state
    branch = _over_widths(flat, width)
    if abs(branch.values[-1] - width) > 1e-9:
        raise NoGaitError(f"the gait at ankle tilt {tilt:g} ends before hip width {width:g}")
    return _entry_walker(tilt, width), branch.states[-1]


def _entry_walker(tilt: float, width: float) -> PassiveWalker:
    return flat_passive_walker(ankle_tilt=tilt, hip_width=width)
