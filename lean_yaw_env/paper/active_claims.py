"""Claims about the active flat walker that are in no figure: its speed against its tilt, steep slopes."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from lean_yaw_env.analysis import planar_gait_rate
from lean_yaw_env.paper.checks import Check, compare, judge
from lean_yaw_env.paper.numbers import CRITICAL_TILTS, PASSIVE_SLOPE, number, numbers_of, statement
from lean_yaw_env.paper.results import Result
from lean_yaw_env.paper.velocity_figure import flat_critical_speed
from lean_yaw_env.paper.walkers import FlatGait, flat_active_walker
from lean_yaw_env.parameters import INTER_LEG_ANGLE

_LINEAR = 0.99


def active_claims() -> Result:
    """The heuristic that the critical speed is the ankle tilt, and how steep a slope may be."""
    gentle = FlatGait.of(flat_active_walker(PASSIVE_SLOPE))
    usual = FlatGait.of(flat_active_walker())
    points = [
        (gentle.cycle.speed, gentle.stable_tilts(0.13, 0.17)[1]),
        (usual.cycle.speed, usual.stable_tilts(0.1, 0.8)[1]),
        *((flat_critical_speed(tilt), tilt) for tilt in CRITICAL_TILTS),
    ]
    return Result(
        (*_speed_checks(points), steep_slope_check()),
        {
            "critical_speeds": {
                "ankle_tilt": [tilt for _, tilt in points],
                "critical_speed": [speed for speed, _ in points],
            }
        },
    )


def _speed_checks(points: list[tuple[float, float]]) -> list[Check]:
    checks = [
        compare(
            printed,
            speed / tilt,
            remark=f"v = {speed:.3f} at α = {tilt:.3f}.",
            unless="The straight line through the four points does not pass through zero.",
        )
        for printed, (speed, tilt) in zip(numbers_of("v_min over α"), points, strict=True)
    ]
    speeds, tilts = np.array(points).T
    slope, offset = np.polyfit(tilts, speeds, 1)
    apart = speeds - slope * tilts - offset
    explained = 1.0 - float(apart.var() / speeds.var())
    checks.append(
        compare(
            number("one-to-one"),
            float(slope),
            remark=f"v_min = {slope:.3f} α {offset:+.3f} through the four points.",
        )
    )
    checks.append(
        judge(
            statement("linear"),
            explained >= _LINEAR,
            ours=f"{explained:.1%} explained; at most {np.abs(apart).max():.3f} from the line",
            unless="They are farther from it.",
        )
    )
    return checks


def least_normal_force(slope: float) -> float:
    """Least normal force, in weights, over a step of the flat active gait; below zero the floor has to pull."""
    walker = flat_active_walker(slope)
    half, rate = 0.5 * INTER_LEG_ANGLE, planar_gait_rate(walker, INTER_LEG_ANGLE)
    state = np.array([0.0, half, 0.0, rate, 0.0])
    # It never turns as slowly as half of its rate just after a strike on slopes as steep as these
    motion = walker.stance_motion(state, duration=4.0 * half / abs(rate), samples=2001)
    return float(motion["normal_force"][motion["stance_pitch"] >= -half].min())


def lift_off_slope() -> float:
    """The slope beyond which the flat active walker's foot lifts off."""
    return float(brentq(least_normal_force, 0.04, 0.12, xtol=1e-6))  # pyright: ignore[reportArgumentType]


def steep_slope_check() -> Check:
    """Section 4.2: any arbitrarily steep slope."""
    slope = lift_off_slope()
    return judge(
        statement("steep slopes"),
        False,
        ours=f"{slope:.4f}",
        remark="There the floor would have to pull at the foot. The paper's foot is held to the floor "
        "by a constraint that can pull; with it the planar gait exists on every slope, in closed form.",
    )
