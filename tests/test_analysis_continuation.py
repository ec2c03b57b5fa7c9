"""Continuation and critical speed: places known from elsewhere, folds, ends, bad input."""

from __future__ import annotations

import numpy as np
import pytest

from lean_yaw_env.analysis import continue_gait, find_limit_cycle, stable_speeds
from lean_yaw_env.parameters import WalkerParameters
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.vehicles.stability import critical_speed, stable_speed_range
from lean_yaw_env.walker import Walker

POINT_FEET = PassiveWalker(WalkerParameters(0.0, 0.0, 0.5, 0.009), planar=True)
FLAT = Walker(WalkerParameters(hip_width=0.0, ankle_tilt=0.4))


def test_period_doubling_of_the_simplest_walker_is_near_0_0151() -> None:
    branch = continue_gait(POINT_FEET, "slope", (0.005, 0.019))
    assert [event.kind for event in branch.events] == ["real -1"]
    # Garcia et al. 1998 print 0.0151
    assert branch.events[0].value == pytest.approx(0.0151, abs=5e-5)
    assert branch.events[0].eigenvalue == pytest.approx(-1.0, abs=1e-6)
    assert branch.events[0].is_leaving
    assert branch.values[-1] == 0.019
    assert branch.is_stable[0]
    assert not branch.is_stable[-1]


def test_every_point_of_a_branch_is_a_gait() -> None:
    branch = continue_gait(POINT_FEET, "slope", (0.005, 0.012), longest_step=0.2)
    for i in range(len(branch.values)):
        cycle = branch.cycle(i)
        # the corrector stops at 1e-11 of a mirrored step; the stride multiplies that by two or so
        assert cycle.residual < 1e-10
        assert np.sort(np.abs(cycle.eigenvalues)) == pytest.approx(
            np.sort(np.abs(branch.eigenvalues[i])) ** 2, abs=1e-8
        )


def test_arc_foot_walkers_steepest_slope_matches_section_4_1() -> None:
    walker = PassiveWalker(WalkerParameters(0.0, 0.5, 0.5, 0.00058), planar=True)
    branch = continue_gait(walker, "slope", (0.0001, 0.06))
    # the paper: no stable motion beyond 0.046; here the doubling is at 0.0454, past which a
    # limping gait is stable for a while
    assert branch.events[0].kind == "real -1"
    assert branch.events[0].value == pytest.approx(0.0454, abs=1e-4)


def test_stable_tilts_of_the_flat_active_walker_match_figure_10() -> None:
    up = continue_gait(FLAT, "ankle_tilt", (0.05, 0.8))
    down = continue_gait(FLAT, "ankle_tilt", (0.05, 0.8), upward=False)
    # Figure 10 B: stable from 0.15 to 0.55
    assert up.events[0].kind == "complex pair"
    assert up.events[0].value == pytest.approx(0.55, abs=0.005)
    assert abs(up.events[0].eigenvalue) == pytest.approx(1.0, abs=1e-9)
    assert down.events[0].kind == "real +1"
    assert down.events[0].value == pytest.approx(0.15, abs=0.005)


def test_slope_at_which_tilt_0_55_becomes_stable_matches_figure_11() -> None:
    steep = Walker(WalkerParameters(hip_width=0.0, slope=0.02))
    branch = continue_gait(steep, "slope", (0.001, 0.05), upward=False)
    assert branch.events[0].value == pytest.approx(0.01, abs=0.0005)


def test_branch_goes_round_its_folds() -> None:
    walker = Walker(WalkerParameters())
    branch = continue_gait(walker, "slope", (0.0005, 0.05), upward=False)
    folds = [event for event in branch.events if event.kind == "fold"]
    assert len(folds) >= 1
    # the least slope of the branch is the fold's, within the curvature of a step of the arc
    assert branch.values.min() == pytest.approx(folds[0].value, abs=1e-4)
    assert branch.values.min() >= folds[0].value
    # past it the slope grows again
    last = int(np.argmin(branch.values))
    assert branch.values[-1] > branch.values[last]
    # a fold is not reported as a crossing of +1 beside
    assert "real +1" not in [event.kind for event in branch.events]


def test_offset_for_both_feet_is_followed_over_strides() -> None:
    branch = continue_gait(Walker(WalkerParameters()), "mass_offset", (-0.006, 0.006))
    assert branch.n_steps == 2
    assert branch.values[-1] == 0.006
    # across the slope: sin(heading) = -offset / tan(slope)
    assert branch.cycle(-1).state[0] == pytest.approx(np.arcsin(-0.006 / np.tan(0.01)), abs=0.01)


def test_branch_ends_where_asked_or_says_why() -> None:
    short = continue_gait(POINT_FEET, "slope", (0.005, 0.019), most_points=3)
    assert len(short.values) == 3
    assert "number of points" in short.ended
    down = continue_gait(
        PassiveWalker(WalkerParameters(0.01, 0.5, 0.16, 0.00058)),
        "hip_width",
        (0.0, 0.02),
        upward=False,
    )
    assert down.values[-1] == 0.0
    assert down.ended == "hip_width reached 0"


@pytest.mark.parametrize(
    ("tilt", "radius", "expected"),
    [
        (np.pi / 8, 0.5, 0.36),
        (np.pi / 8, 0.2, 0.36),
        (np.pi / 4, 0.5, 0.72),
        (np.pi / 4, 0.2, 0.72),
    ],
)
def test_critical_speeds_match_figure_13(tilt: float, radius: float, expected: float) -> None:
    walker = Walker(WalkerParameters(hip_width=0.0, foot_radius=radius, ankle_tilt=tilt))
    # read off the paper's dashed lines, which "almost exactly" follow these speeds
    assert critical_speed(walker) == pytest.approx(expected, abs=0.02)


def test_walker_is_stable_within_its_speed_range_and_not_outside() -> None:
    speeds = stable_speed_range(Walker(WalkerParameters(hip_width=0.0)))
    assert speeds is not None
    for slope in (0.009, 0.011):
        cycle = find_limit_cycle(Walker(WalkerParameters(hip_width=0.0, slope=slope)))
        assert cycle.is_stable == (speeds.lower < cycle.speed < speeds.upper)
    # slope plays no part
    again = stable_speeds(Walker(WalkerParameters(hip_width=0.0, slope=0.03)))
    assert again == speeds


def test_walker_with_a_vertical_axis_at_the_end_of_a_step_has_no_stable_speed() -> None:
    upright = Walker(WalkerParameters(hip_width=0.0, ankle_tilt=0.1))
    assert stable_speed_range(upright) is None
    assert critical_speed(upright) == np.inf


def test_bad_limits_are_refused() -> None:
    with pytest.raises(ValueError, match="low < high"):
        continue_gait(FLAT, "slope", (0.02, 0.01))
    with pytest.raises(ValueError, match="must hold the start's slope"):
        continue_gait(FLAT, "slope", (0.02, 0.03))
    with pytest.raises(ValueError, match="parameter must be one of"):
        continue_gait(FLAT, "colour", (0.0, 1.0))
    with pytest.raises(ValueError, match="longest_step must be in"):
        continue_gait(FLAT, "slope", (0.001, 0.03), longest_step=0.0)
