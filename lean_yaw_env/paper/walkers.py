"""The paper's walkers, the stability of the flat ones, whose gaits no ankle tilt changes, and where it ends."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from lean_yaw_env.analysis import (
    LimitCycle,
    SectionMap,
    continue_gait,
    find_limit_cycle,
    section_map_of,
)
from lean_yaw_env.analysis.limit_cycle import sorted_eigenvalues
from lean_yaw_env.errors import LeanYawError, NoGaitError
from lean_yaw_env.parameters import Vector, WalkerParameters
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.walker import Walker

PASSIVE_SLOPE = 0.00058
"""Slope of the arc-foot walkers, section 4.1."""
POINT_FOOT_SLOPE = 0.004
"""Slope of the point-foot walker, section 4.1."""
FLAT_TILT = 0.15
"""Ankle tilt of Table 3, column C."""
SMALL_OFFSET, LARGE_OFFSET = 0.006, 0.05
"""Mass offsets of Figure 15, to the right."""
CRITICAL_TILTS = (math.pi / 8.0, math.pi / 4.0)
"""Ankle tilts of Figure 13."""
LATERAL = [0, 2, 4]
"""Heading, ankle angle, ankle rate: without hip width they do not feel the other coordinates."""


def point_foot_walker(slope: float = POINT_FOOT_SLOPE) -> PassiveWalker:
    """Figure 6 A."""
    return PassiveWalker(WalkerParameters(hip_width=0.0, foot_radius=0.0, slope=slope), planar=True)


def arc_foot_walker(slope: float = PASSIVE_SLOPE, foot_radius: float = 0.5) -> PassiveWalker:
    """Figure 6 B."""
    body = WalkerParameters(hip_width=0.0, foot_radius=foot_radius, slope=slope)
    return PassiveWalker(body, planar=True)


def flat_passive_walker(
    slope: float = PASSIVE_SLOPE,
    ankle_tilt: float = FLAT_TILT,
    hip_width: float = 0.0,
    foot_radius: float = 0.5,
) -> PassiveWalker:
    """Figure 6 C, passive; with a hip width, D."""
    return PassiveWalker(WalkerParameters(hip_width, foot_radius, ankle_tilt, slope))


def flat_active_walker(
    slope: float = 0.01, ankle_tilt: float = 0.55, foot_radius: float = 0.5
) -> Walker:
    """Figure 6 C with the swing leg held in front."""
    return Walker(WalkerParameters(0.0, foot_radius, ankle_tilt, slope))


def circling_walker() -> Walker:
    """Table 1's walker on a slope that turns with it."""
    return Walker(WalkerParameters(slope_turns=True))


gait_of = lru_cache(maxsize=64)(find_limit_cycle)


def table_1_gait() -> LimitCycle:
    """The gait of Figure 6 E at Table 1's parameters."""
    return gait_of(Walker())


def circling_gait() -> LimitCycle:
    """The circling walker's gait with the large offset, which turns by as much every stride."""
    return gait_of(circling_walker(), mass_offset=LARGE_OFFSET)


@dataclass(frozen=True)
class FlatGait:
    """A flat walker's gait, which is a planar one whatever the ankle tilt.

    Attributes
    ----------
    section_map : SectionMap
        Over a stride.
    cycle : LimitCycle
    """

    section_map: SectionMap
    cycle: LimitCycle

    @classmethod
    def of(cls, walker: Walker | PassiveWalker) -> FlatGait:
        """The gait of a walker without hip width; raises ``NoGaitError`` if it has none."""
        return cls(section_map_of(walker).over(2), gait_of(walker))

    def multipliers(self, ankle_tilt: float) -> tuple[Vector, Vector]:
        """Magnitudes of the stride's multipliers at another ankle tilt, each falling.

        Returns
        -------
        fore_aft : shape (2,) or (3,)
        lateral : shape (3,)
            nan where the swing foot cannot be laid flat.
        """
        fore_aft = [i for i in range(self.cycle.state.size) if i not in LATERAL]
        try:
            moved = self.section_map.moved("ankle_tilt", ankle_tilt)
            matrix = moved.derivative(self.cycle.state)[1]
        except (LeanYawError, ValueError):
            return np.full(len(fore_aft), np.nan), np.full(3, np.nan)
        return np.abs(eigenvalues(matrix, fore_aft)), np.abs(eigenvalues(matrix, LATERAL))

    def spectral_radius(self, ankle_tilt: float) -> float:
        """Greatest magnitude of all multipliers; nan where the gait ends."""
        return float(np.concatenate(self.multipliers(ankle_tilt)).max())

    def stable_tilts(self, low: float, high: float, points: int = 400) -> tuple[float, float]:
        """Ends of the first stable interval of ankle tilts seen on a grid, to round-off.

        Raises
        ------
        NoGaitError
            If no tilt on the grid is stable.
        """
        tilts = np.linspace(low, high, points)
        stable = np.array([self.spectral_radius(tilt) < 1.0 for tilt in tilts])
        if not stable.any():
            raise NoGaitError(f"no stable ankle tilt between {low:g} and {high:g}")
        first = int(np.argmax(stable))
        after = np.flatnonzero(~stable[first:])
        last = first + int(after[0]) - 1 if after.size else points - 1

        def boundary(inside: int, outside: int) -> float:
            def excess(tilt: float) -> float:
                return self.spectral_radius(tilt) - 1.0

            return root(excess, tilts[inside], tilts[outside], 1e-10)

        lower = boundary(first, first - 1) if first else low
        return lower, boundary(last, last + 1) if last + 1 < points else high


def eigenvalues(matrix: Vector, index: list[int]) -> np.ndarray:
    """Eigenvalues of a diagonal block of a matrix, by falling magnitude."""
    return sorted_eigenvalues(matrix[np.ix_(index, index)])


def root(function: Any, low: float, high: float, tolerance: float) -> float:
    """Where a function of one number passes zero between two values, to a tolerance."""
    return float(brentq(function, low, high, xtol=tolerance))  # pyright: ignore[reportArgumentType]


@lru_cache(maxsize=16)
def doubling_slope(walker: PassiveWalker, limits: tuple[float, float]) -> float:
    """The slope at which the planar gait's period doubles, so that it stops being stable; or nan."""
    branch = continue_gait(walker, "slope", limits, state=gait_of(walker).state)
    return next(iter(branch.ends_of_stability), math.nan)


def lateral_radius(slope: float) -> float:
    """Least spectral radius, over the ankle tilt, of the three-dimensional modes of C.

    The best tilt is near the initial stance leg angle.
    """
    gait = FlatGait.of(flat_passive_walker(slope))
    pitch = float(gait.cycle.state[1])

    def radius(tilt: float) -> float:
        value = float(gait.multipliers(tilt)[1].max())
        return value if np.isfinite(value) else 1e3

    tilts = np.linspace(pitch - 0.03, pitch + 0.03, 61)
    best = int(np.argmin([radius(tilt) for tilt in tilts]))
    around = (tilts[max(best - 1, 0)], tilts[min(best + 1, tilts.size - 1)])
    found: Any = minimize_scalar(radius, bounds=around, method="bounded", options={"xatol": 1e-6})
    return float(found.fun)


@lru_cache(maxsize=1)
def lateral_limit_slope() -> float:
    """The slope beyond which no ankle tilt stabilises the flat passive walker."""
    return root(lambda slope: lateral_radius(slope) - 1.0, 0.03, 0.045, 1e-6)
