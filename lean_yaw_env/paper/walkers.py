"""The paper's walkers, and the stability of the flat ones, whose gaits no ankle tilt changes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.optimize import brentq

from lean_yaw_env.analysis import (
    ActiveMap,
    LimitCycle,
    PassiveMap,
    find_limit_cycle,
    find_passive_gaits,
)
from lean_yaw_env.errors import LeanYawError, NoGaitError
from lean_yaw_env.paper.numbers import FLAT_TILT, PASSIVE_SLOPE, POINT_FOOT_SLOPE
from lean_yaw_env.parameters import Vector, WalkerParameters
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.walker import Walker

LATERAL = [0, 2, 4]
"""Heading, ankle angle, ankle rate: without hip width they do not feel the other coordinates."""


def point_foot_walker(slope: float = POINT_FOOT_SLOPE) -> PassiveWalker:
    """Figure 6 A."""
    return PassiveWalker(WalkerParameters(hip_width=0.0, foot_radius=0.0, slope=slope), planar=True)


def arc_foot_walker(slope: float = PASSIVE_SLOPE) -> PassiveWalker:
    """Figure 6 B."""
    return PassiveWalker(WalkerParameters(hip_width=0.0, slope=slope), planar=True)


def flat_passive_walker(
    slope: float = PASSIVE_SLOPE, ankle_tilt: float = FLAT_TILT, hip_width: float = 0.0
) -> PassiveWalker:
    """Figure 6 C, passive; with a hip width, D."""
    return PassiveWalker(WalkerParameters(hip_width=hip_width, ankle_tilt=ankle_tilt, slope=slope))


def flat_active_walker(
    slope: float = 0.01, ankle_tilt: float = 0.55, foot_radius: float = 0.5
) -> Walker:
    """Figure 6 C with the swing leg held in front."""
    return Walker(
        WalkerParameters(hip_width=0.0, foot_radius=foot_radius, ankle_tilt=ankle_tilt, slope=slope)
    )


@lru_cache(maxsize=1)
def table_1_gait() -> LimitCycle:
    """The gait of Figure 6 E at Table 1's parameters."""
    return find_limit_cycle(Walker())


@lru_cache(maxsize=32)
def passive_gait(walker: PassiveWalker) -> LimitCycle:
    """Its gait of the longest period, which alone can be stable."""
    return find_passive_gaits(walker)[0]


@dataclass(frozen=True)
class FlatGait:
    """A flat walker's gait, which is a planar one whatever the ankle tilt.

    Attributes
    ----------
    section_map : ActiveMap or PassiveMap
        Over a stride.
    cycle : LimitCycle
    """

    section_map: ActiveMap | PassiveMap
    cycle: LimitCycle

    @classmethod
    def of(cls, walker: Walker | PassiveWalker) -> FlatGait:
        """The gait of a walker without hip width.

        Raises
        ------
        NoGaitError
            If it has none.
        """
        if isinstance(walker, PassiveWalker):
            return cls(PassiveMap(walker, 2), passive_gait(walker))
        return cls(ActiveMap(walker, n_steps=2), find_limit_cycle(walker))

    def multipliers(self, ankle_tilt: float) -> tuple[Vector, Vector]:
        """Magnitudes of the stride's multipliers at another ankle tilt, each falling.

        Returns
        -------
        fore_aft : shape (2,) or (3,)
        lateral : shape (3,)
            nan where the swing foot cannot be laid flat.
        """
        n = self.cycle.state.size
        fore_aft = [i for i in range(n) if i not in LATERAL]
        try:
            moved = self.section_map.moved("ankle_tilt", ankle_tilt)
            matrix = moved.derivative(self.cycle.state)[1]
        except (LeanYawError, ValueError):
            return np.full(len(fore_aft), np.nan), np.full(3, np.nan)
        return _magnitudes(matrix, fore_aft), _magnitudes(matrix, LATERAL)

    def spectral_radius(self, ankle_tilt: float) -> float:
        """Greatest magnitude of all multipliers; nan where the gait ends."""
        return float(np.concatenate(self.multipliers(ankle_tilt)).max())

    def boundary(self, inside: float, outside: float) -> float:
        """The ankle tilt between a stable one and an unstable one at which |λ| = 1."""
        return float(
            brentq(  # pyright: ignore[reportArgumentType]
                lambda tilt: self.spectral_radius(tilt) - 1.0, inside, outside, xtol=1e-10
            )
        )

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
        lower = self.boundary(tilts[first], tilts[first - 1]) if first else low
        upper = self.boundary(tilts[last], tilts[last + 1]) if last + 1 < points else high
        return lower, upper


def _magnitudes(matrix: Vector, index: list[int]) -> Vector:
    values = np.abs(np.linalg.eigvals(matrix[np.ix_(index, index)]))
    return np.sort(values)[::-1]
