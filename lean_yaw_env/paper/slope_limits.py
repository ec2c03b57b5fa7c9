"""Slopes on which the passive walkers of the paper stop being stable."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from lean_yaw_env.analysis import continue_gait
from lean_yaw_env.paper.walkers import FlatGait, flat_passive_walker, passive_gait
from lean_yaw_env.passive import PassiveWalker

_SEARCH = (0.03, 0.045)
"""Slopes between which no ankle tilt stabilises the flat passive walker any more."""


@lru_cache(maxsize=16)
def doubling_slope(walker: PassiveWalker, limits: tuple[float, float]) -> float:
    """The slope at which the planar gait's period doubles, so that it stops being stable; or nan."""
    branch = continue_gait(walker, "slope", limits, state=passive_gait(walker).state)
    leaving = [event.value for event in branch.events if event.is_leaving]
    return leaving[0] if leaving else float("nan")


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
    best_found: Any = minimize_scalar(
        radius, bounds=around, method="bounded", options={"xatol": 1e-6}
    )
    return float(best_found.fun)


@lru_cache(maxsize=1)
def lateral_limit_slope() -> float:
    """The slope beyond which no ankle tilt stabilises the flat passive walker."""
    return float(
        brentq(lambda slope: lateral_radius(slope) - 1.0, *_SEARCH, xtol=1e-6)  # pyright: ignore[reportArgumentType]
    )
