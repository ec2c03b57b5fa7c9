"""Section 4.1's claims about the passive walkers that are in no figure."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from lean_yaw_env.analysis import continue_gait, find_limit_cycle, largest_disturbance, modes
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.paper.checks import Check, compare, judge, judge_inside
from lean_yaw_env.paper.numbers import number, statement
from lean_yaw_env.paper.results import Result
from lean_yaw_env.paper.walkers import (
    FlatGait,
    arc_foot_walker,
    flat_passive_walker,
    passive_gait,
    point_foot_walker,
)
from lean_yaw_env.passive import PassiveWalker

_FARTHEST, _TOLERANCE = 1.0, 1e-3
"""Relative deviations looked at, and how finely."""
_STEEP = 0.004
_SECOND_SEARCH = (0.03, 0.045)
"""Slopes between which no ankle tilt stabilises the flat passive walker any more."""


def doubling_slope(walker: PassiveWalker, limits: tuple[float, float]) -> float:
    """The slope at which the planar gait's period doubles, so that it stops being stable; or nan."""
    branch = continue_gait(walker, "slope", limits)
    leaving = [event.value for event in branch.events if event.is_leaving]
    return leaving[0] if leaving else float("nan")


def least_deviation(walker: PassiveWalker) -> tuple[float, str]:
    """The smallest relative deviation of one initial condition that makes a planar gait fall.

    Returns
    -------
    deviation : float
        A share of the gait's value, at most 1.
    what : str
        Which coordinate and which way.
    """
    found = []
    for coordinate in ("stance_pitch", "stance_pitch_rate", "inter_leg_rate"):
        for upward in (True, False):
            survived = largest_disturbance(
                walker, coordinate, upward=upward, most=_FARTHEST, tolerance=_TOLERANCE
            )
            found.append((abs(survived.relative), f"{coordinate} {'up' if upward else 'down'}"))
    return min(found)


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


def lateral_limit_slope() -> float:
    """The slope beyond which no ankle tilt stabilises the flat passive walker."""
    return float(
        brentq(lambda slope: lateral_radius(slope) - 1.0, *_SECOND_SEARCH, xtol=1e-6)  # pyright: ignore[reportArgumentType]
    )


def _slope_checks() -> list[Check]:
    doubling = doubling_slope(arc_foot_walker(), (0.0003, 0.08))
    return [
        compare(
            number("slope limit, A"),
            doubling_slope(point_foot_walker(), (0.001, 0.03)),
            remark="Where the gait's period doubles; gaits of longer periods are stable a little "
            "further, to 0.019.",
        ),
        compare(
            number("maximal slope, C"),
            doubling,
            unless="Fore-aft the gait is stable to where its period doubles, 1.3 % short of the "
            "paper's slope; feet of finite mass end it earlier still (0.0450 at a mass of 0.003 "
            f"each). No ankle tilt keeps the flat walker upright beyond {lateral_limit_slope():.4f}.",
            is_open=True,
        ),
    ]


def _basin_checks() -> list[Check]:
    checks = []
    for name, walker in (("basin, A", point_foot_walker()), ("basin, B", arc_foot_walker())):
        share, what = least_deviation(walker)
        checks.append(
            compare(
                number(name),
                100.0 * share,
                remark=f"The least over both signs and all initial conditions, one at a time ({what}).",
            )
        )
    return checks


def _steeper_checks() -> list[Check]:
    gait = passive_gait(flat_passive_walker(_STEEP))
    pitch = float(gait.state[1])
    try:
        low, high = FlatGait.of(flat_passive_walker(_STEEP)).stable_tilts(
            pitch - 0.03, pitch + 0.03
        )
    except NoGaitError:
        low = high = float("nan")
    return [
        compare(
            number("stance leg angle at γ = 0.004"),
            pitch,
            remark=f"The stance leg's angle, not the step length, which is {gait.step_length:.3f}.",
        ),
        judge_inside(number("stable tilt at γ = 0.004"), low, high),
    ]


def _mode_check() -> Check:
    kinds = [mode.name for mode in modes(find_limit_cycle(flat_passive_walker()))]
    shares = [mode.lateral_share for mode in modes(find_limit_cycle(flat_passive_walker()))]
    fore_aft = kinds.count("fore-aft")
    pure = all(min(share, 1.0 - share) < 1e-9 for share in shares)
    return judge(
        statement("modes, C"),
        fore_aft == 3,
        ours=f"{fore_aft} fore-aft, {len(kinds) - fore_aft} three-dimensional"
        + (", each purely so" if pure else ""),
        remark="To first order the three-dimensional modes have no fore-aft part at all: without "
        "hip width the two kinds decouple by symmetry."
        if fore_aft == 3
        else "The kinds do not divide three and three.",
    )


def passive_claims() -> Result:
    """Slope limits, basins, modes, steeper slopes."""
    return Result((*_slope_checks(), *_basin_checks(), _mode_check(), *_steeper_checks()))
