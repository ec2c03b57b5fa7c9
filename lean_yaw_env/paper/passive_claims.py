"""Section 4.1's claims about the passive walkers that are in no figure."""

from __future__ import annotations

from lean_yaw_env.analysis import find_limit_cycle, largest_disturbance, modes
from lean_yaw_env.paper.checks import Check, compare, judge
from lean_yaw_env.paper.numbers import number, statement
from lean_yaw_env.paper.open_points import maximal_slope_section
from lean_yaw_env.paper.passive_figures import tilt_check
from lean_yaw_env.paper.results import Result
from lean_yaw_env.paper.slope_limits import doubling_slope, lateral_limit_slope
from lean_yaw_env.paper.walkers import (
    arc_foot_walker,
    flat_passive_walker,
    passive_gait,
    point_foot_walker,
)
from lean_yaw_env.passive import PassiveWalker

_FARTHEST, _TOLERANCE = 1.0, 1e-4
"""Relative deviations looked at, and how finely."""
_STEEP = 0.004


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


def _slope_checks() -> list[Check]:
    return [
        compare(
            number("slope limit, A"),
            doubling_slope(point_foot_walker(), (0.001, 0.03)),
            remark="Where the gait's period doubles; gaits of longer periods are stable a little "
            "further, to 0.019.",
        ),
        compare(
            number("maximal slope, C"),
            doubling_slope(arc_foot_walker(), (0.0003, 0.08)),
            unless="Fore-aft the gait is stable to where its period doubles, 1.3 % short of the "
            f"paper's slope. No ankle tilt keeps the flat walker upright beyond {lateral_limit_slope():.4f}.",
            is_open=True,
        ),
    ]


def _basin_checks() -> list[Check]:
    checks = []
    for name, walker in (("A", point_foot_walker()), ("B", arc_foot_walker())):
        printed = statement(f"basin, {name}")
        share, what = least_deviation(walker)
        percent = int(printed.printed.split()[0])
        holds = percent <= 100.0 * share < percent + 1
        checks.append(
            judge(
                printed,
                holds,
                ours=f"{100.0 * share:.2f} %",
                remark=f"The least over both signs and all initial conditions, one at a time ({what}).",
            )
        )
    return checks


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


def _steeper_checks() -> list[Check]:
    gait = passive_gait(flat_passive_walker(_STEEP))
    pitch = float(gait.state[1])
    return [
        compare(
            number("stance leg angle at γ = 0.004"),
            pitch,
            remark=f"The stance leg's angle, not the step length, which is {gait.step_length:.3f}.",
        ),
        tilt_check(statement("stable tilt at γ = 0.004"), _STEEP, (pitch - 0.03, pitch + 0.03)),
    ]


def passive_claims() -> Result:
    """Slope limits, basins, modes, steeper slopes."""
    return Result(
        (*_slope_checks(), *_basin_checks(), _mode_check(), *_steeper_checks()),
        sections=(maximal_slope_section(),),
    )
