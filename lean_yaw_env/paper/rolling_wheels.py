"""The rimless wheel, wheels with round feet, the synthetic wheel, and rocking sideways."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from lean_yaw_env.analysis import PassiveMap, find_limit_cycle, planar_gait_rate
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.paper.checks import Check, judge
from lean_yaw_env.paper.numbers import statement
from lean_yaw_env.paper.results import Result
from lean_yaw_env.paper.walkers import passive_gait
from lean_yaw_env.parameters import WalkerParameters
from lean_yaw_env.passive import FORE_AFT, PassiveWalker
from lean_yaw_env.walker import Walker

_WHEELS = ((math.pi / 8.0, 0.2), (0.15, 0.02), (0.3, 0.1))
"""Half the angle between two spokes, and slope, rad."""
_RADII = (0.2, 0.5, 0.8)
_UNLESS = "It does not hold."
_NEARLY_ROUND, _SMALL_STEP = 0.9999, 0.01
_WALKING_SLOPE = 0.004


def wheel(slope: float, foot_radius: float = 0.0) -> Walker:
    """A wheel with spokes: the active walker without hip width, whose swing leg is held in front."""
    return Walker(WalkerParameters(hip_width=0.0, foot_radius=foot_radius, slope=slope))


def rate_error(slope: float, half_angle: float, foot_radius: float = 0.0) -> float:
    """Relative error of the computed gait's squared rate against the closed form's."""
    walker = wheel(slope, foot_radius)
    cycle = find_limit_cycle(walker, inter_leg_angle=2.0 * half_angle)
    return abs((cycle.state[3] / planar_gait_rate(walker, 2.0 * half_angle)) ** 2 - 1.0)


def rolling_wheels() -> Result:
    """Closed forms against the compiled walkers."""
    return Result(
        (*_rimless_checks(), _rolling_check(), _synthetic_check(), _lateral_check()),
    )


def _rimless_checks() -> list[Check]:
    worst = max(rate_error(slope, half) for half, slope in _WHEELS)
    multipliers = [
        # The rate alone: the strike sets the angle
        abs(find_limit_cycle(wheel(slope), inter_leg_angle=2.0 * half).jacobian[3, 3]
            - math.cos(2.0 * half) ** 4)
        for half, slope in _WHEELS
    ]  # fmt: skip
    good, multiplies = worst < 1e-10, max(multipliers) < 1e-10
    least = [least_slope(half) for half, _ in _WHEELS]
    ends = all(
        _has_gait(half, 1.001 * slope) and not _has_gait(half, 0.999 * slope)
        for (half, _), slope in zip(_WHEELS, least, strict=True)
    )
    angles = ", ".join(f"{half:.3f}" for half, _ in _WHEELS)
    return [
        judge(
            statement("rimless wheel, rate"),
            good,
            ours=f"relative {worst:.0e} at α = {angles}",
            unless=_UNLESS,
        ),
        judge(
            statement("rimless wheel, multiplier"),
            multiplies,
            ours=f"{max(multipliers):.0e} at α = {angles}",
            unless=_UNLESS,
        ),
        judge(
            statement("rimless wheel, least slope"),
            ends,
            ours=", ".join(f"{slope:.5f}" for slope in least) + f" at α = {angles}",
            unless=_UNLESS,
        ),
    ]


def least_slope(half_angle: float) -> float:
    """The slope on which the wheel just gets over the top of a spoke."""

    def excess(slope: float) -> float:
        needed = 2.0 - 2.0 * math.cos(half_angle - slope)
        return planar_gait_rate(wheel(slope), 2.0 * half_angle) ** 2 - needed

    return float(brentq(excess, 1e-6, half_angle, xtol=1e-14))  # pyright: ignore[reportArgumentType]


def _has_gait(half_angle: float, slope: float) -> bool:
    try:
        find_limit_cycle(wheel(slope), inter_leg_angle=2.0 * half_angle)
    except NoGaitError:
        return False
    return True


def _rolling_check() -> Check:
    worst = max(rate_error(0.01, 0.15, radius) for radius in _RADII)
    holds = worst < 1e-10
    return judge(
        statement("wheel with round feet"),
        holds,
        ours=f"relative {worst:.0e}",
        unless=_UNLESS,
    )


def synthetic_step_time() -> float:
    """A step of the synthetic wheel, in a pendulum's units: the smallest root of 1 + cos τ + 2 sin(τ) / τ = 0.

    The hip rolls at a constant speed, so that the stance leg goes from one angle to the opposite one at a constant rate -2 / τ; the
    swing leg, a pendulum that starts at the other angle with that rate, has to be in front at the same time.
    """
    root = brentq(lambda time: 1.0 + math.cos(time) + 2.0 * math.sin(time) / time, 3.5, 4.5)
    return float(root)  # pyright: ignore[reportArgumentType]


def _synthetic_check() -> Check:
    time = synthetic_step_time()
    walker = PassiveWalker(
        WalkerParameters(hip_width=0.0, foot_radius=_NEARLY_ROUND, slope=0.0), planar=True
    )
    start = np.array([0.0, _SMALL_STEP, 0.0, -2.0 * _SMALL_STEP / time, 0.0, 0.0])
    step = walker.step(start)
    holds = step.fall is None and abs(step.duration / time - 1.0) < 1e-4
    return judge(
        statement("synthetic wheel"),
        holds,
        ours=f"{step.duration:.4f}, the equation's root {time:.4f}",
        unless=_UNLESS,
    )


def _lateral_check() -> Check:
    body = WalkerParameters(
        hip_width=0.0, ankle_tilt=0.5 * math.pi, foot_radius=0.3, slope=_WALKING_SLOPE
    )
    planar = passive_gait(PassiveWalker(body, planar=True))
    section_map = PassiveMap(PassiveWalker(body))
    matrix = section_map.derivative(planar.state)[1]
    values = np.linalg.eigvals(matrix)
    beyond = values[np.abs(values) > 1.01]
    fore_aft = np.sort_complex(np.linalg.eigvals(matrix[np.ix_(FORE_AFT, FORE_AFT)]) ** 2)
    same = float(np.abs(fore_aft - np.sort_complex(planar.eigenvalues)).max())
    holds = beyond.size == 1 and beyond[0].real < 0.0 and beyond[0].imag == 0.0 and same < 1e-6
    return judge(
        statement("rocking sideways"),
        bool(holds),
        ours=f"{', '.join(f'{value.real:.1f}' for value in beyond)}; the fore-aft ones within {same:.0e}",
        remark="His page has about -30, for legs with masses, which ours have not: that number is not compared. "
        "Our model has a heading besides, whose multiplier is within 0.002 of -1 here."
        if holds
        else "It has other modes.",
    )
