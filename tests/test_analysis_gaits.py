"""Gaits: fixed points, modes, pumping, period doubling, the floor's demand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lean_yaw_env.analysis import (
    ActiveMap,
    PassiveMap,
    find_gait,
    find_limit_cycle,
    find_periodic_gait,
    floor_demand,
    modes,
    section_map_of,
)
from lean_yaw_env.analysis.fixed_point import follow_fixed_point, solve_fixed_point
from lean_yaw_env.analysis.section_map import RESIDUAL_LIMIT
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.parameters import WalkerParameters
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.walker import Walker

TABLE_1 = Walker(WalkerParameters())
FLAT = Walker(WalkerParameters(hip_width=0.0, ankle_tilt=0.4))
LEVEL = Walker(WalkerParameters(slope=0.0))
PUMPING = (0.03, -0.03)


def point_feet(slope: float) -> PassiveWalker:
    return PassiveWalker(WalkerParameters(0.0, 0.0, 0.5, slope), planar=True)


# --- gaits


def test_symmetric_gait_is_a_fixed_point_of_the_mirrored_step_and_of_the_stride() -> None:
    cycle = find_limit_cycle(TABLE_1)
    assert cycle.n_steps == 1
    assert cycle.residual <= RESIDUAL_LIMIT
    one = section_map_of(TABLE_1).image(cycle.state)
    assert one == pytest.approx(cycle.state, abs=1e-12)  # the root finder's own limit
    second = section_map_of(TABLE_1).over(2).results(cycle.state)[1]
    assert second.state == pytest.approx(cycle.state, abs=1e-12)
    matrix = section_map_of(TABLE_1).over(2).derivative(cycle.state)[1]
    # the same product of the same two matrices
    assert matrix == pytest.approx(cycle.jacobian, abs=1e-12)


def test_table_2_gait_comes_out_with_ten_digits_of_its_own() -> None:
    state = find_limit_cycle(TABLE_1).state
    # the paper's Table 2 (phi from Figure 14), to its printed digits
    assert state == pytest.approx([0.00155, 0.155, -0.0041, -0.42, -0.070], abs=0.0055)
    assert state[[0, 1, 2]] == pytest.approx([0.00155, 0.155, -0.0041], abs=0.0006)
    # without the exact Jacobian the root finder ends at the same point
    assert find_gait(TABLE_1) == pytest.approx(state, abs=1e-10)


def test_work_per_distance_of_a_gait_down_a_slope_is_the_slopes_sine() -> None:
    cycle = find_limit_cycle(TABLE_1)
    # straight downhill over a whole stride: exactly, but for the residual
    assert cycle.gravity_work == pytest.approx(np.sin(0.01), rel=1e-9)
    assert cycle.shift_work == 0.0


def test_pumping_walks_on_the_level_and_uphill() -> None:
    level = find_limit_cycle(LEVEL, mass_offset=PUMPING)
    uphill = find_limit_cycle(Walker(WalkerParameters(slope=-0.005)), mass_offset=PUMPING)
    # speeds of about 0.6 and 0.53 are known from an earlier, plain program; here to three digits
    assert level.speed == pytest.approx(0.632, abs=0.001)
    assert uphill.speed == pytest.approx(0.561, abs=0.001)
    assert level.is_stable
    assert level.eigenvalues.size == 4  # every heading is like any other
    # uphill it turns round, slowly
    assert abs(uphill.eigenvalues[0]) == pytest.approx(1.0077, abs=1e-4)
    assert level.gravity_work == pytest.approx(0.0, abs=1e-12)
    assert uphill.gravity_work == pytest.approx(-np.sin(0.005), rel=1e-6)
    assert level.shift_work > 0.0
    # the prototype's claims: normal force never under 0.34, friction demand under 0.5
    for cycle in (level, uphill):
        assert cycle.least_normal_force > 0.34
        assert cycle.greatest_friction < 0.5


def test_pumped_walk_keeps_going_when_simulated() -> None:
    cycle = find_limit_cycle(LEVEL, mass_offset=PUMPING)
    walk = LEVEL.walk(
        100,
        state=cycle.state * [1, 1, 1, 1.02, 1],
        mass_offset=np.tile(PUMPING, 50),
        previous_offset=PUMPING[1],
    )
    assert walk.fall is None
    assert walk.distance / walk.durations.sum() == pytest.approx(cycle.speed, rel=0.01)


def test_pumping_towards_the_stance_foot_finds_no_gait_and_says_what_was_tried() -> None:
    with pytest.raises(NoGaitError, match=r"mass offset \(-0.03, 0.03\).*tried.*pumping"):
        find_limit_cycle(LEVEL, mass_offset=(-0.03, 0.03))


def test_strike_before_the_masses_arrive_is_refused() -> None:
    slow = Walker(WalkerParameters(shift_time=2.0))
    section_map = ActiveMap(slow, mass_offset=(0.001, -0.001), n_steps=1)
    with pytest.raises(NoGaitError, match="before the masses have moved"):
        section_map.results(find_gait(TABLE_1))


def test_a_pair_of_equal_offsets_is_one_offset() -> None:
    assert section_map_of(TABLE_1, mass_offset=(0.01, 0.01)) == section_map_of(
        TABLE_1, mass_offset=0.01
    )


@pytest.mark.parametrize(
    "parameter", ["hip_width", "slope", "inter_leg_angle", "mass_offset", "alternating_offset"]
)
def test_derivative_by_a_parameter_agrees_with_differences(parameter: str) -> None:
    section_map = ActiveMap(TABLE_1, 0.3, (0.012, 0.004), 2)
    state = find_gait(TABLE_1)
    exact = section_map.sensitivity(state, parameter)[2]
    value, step = section_map.value(parameter), 1e-5
    ahead, behind = (section_map.moved(parameter, value + h).image(state) for h in (step, -step))
    # steps good to 1e-10, divided by 2e-5; while the masses move somewhat less
    assert exact == pytest.approx((ahead - behind) / (2 * step), rel=1e-4, abs=1e-4)


def test_gait_is_followed_along_a_path_of_maps() -> None:
    def path(share: float) -> ActiveMap:
        return ActiveMap(Walker(WalkerParameters(hip_width=0.3 * share)), n_steps=1)

    start = find_gait(Walker(WalkerParameters(hip_width=0.0)))
    state = follow_fixed_point(path, start)
    assert state == pytest.approx(find_gait(TABLE_1), abs=1e-10)


# --- modes


def test_modes_without_hip_width_are_purely_fore_aft_or_three_dimensional() -> None:
    found = modes(find_limit_cycle(PassiveWalker(WalkerParameters(0.0, 0.5, 0.15, 0.00058))))
    # Table 3, column C: the planar walker's three, and three of their own
    assert [mode.name for mode in found] == ["three-dimensional", "fore-aft"] * 3
    assert all(min(mode.lateral_share, 1.0 - mode.lateral_share) < 1e-9 for mode in found)
    assert found[-1].is_zero
    assert "swing rate" in found[-1].explanation


def test_zero_mode_of_the_active_walker_is_the_section_it_lands_on() -> None:
    cycle = find_limit_cycle(TABLE_1)
    found = modes(cycle)
    zero = found[-1]
    assert zero.is_zero
    assert "stance pitch from the ankle angle" in zero.explanation
    # its left vector is the surface of poses with both feet down: no rates, no heading in it
    names = dict(zip(cycle.coordinates, np.abs(zero.left_vector), strict=True))
    assert max(names["heading"], names["stance_pitch_rate"], names["ankle_rate"]) < 1e-9
    assert [mode.name for mode in found[:2]] == ["three-dimensional", "fore-aft"]


def test_modes_are_eigenvectors() -> None:
    cycle = find_limit_cycle(TABLE_1)
    for mode in modes(cycle):
        assert cycle.jacobian @ mode.vector == pytest.approx(
            mode.eigenvalue * mode.vector, abs=1e-12
        )
        assert mode.left_vector @ cycle.jacobian == pytest.approx(
            mode.eigenvalue * mode.left_vector, abs=1e-12
        )


# --- period doubling


def test_simplest_walker_limps_past_the_doubling_and_not_before() -> None:
    limping = find_periodic_gait(point_feet(0.016), n_steps=2)
    assert limping.n_steps == 2
    assert limping.is_stable
    assert limping.residual < 1e-10  # a stride's, from a root finder that stops at 1e-12
    section_map = PassiveMap(point_feet(0.016))
    assert np.abs(section_map.image(limping.state) - limping.state).max() > 1e-3
    with pytest.raises(NoGaitError, match="settled to a gait of 1 steps"):
        find_periodic_gait(point_feet(0.0145), n_steps=2)


def test_simplest_walker_repeats_after_four_steps_at_0_018() -> None:
    four = find_periodic_gait(point_feet(0.018), n_steps=4)
    assert four.is_stable
    assert not find_periodic_gait(point_feet(0.018), n_steps=2).is_stable
    assert four.stride_period == pytest.approx(
        find_periodic_gait(point_feet(0.018), n_steps=2).stride_period, rel=0.02
    )


# --- the floor's demand


def test_floor_demand_bounds_what_the_integrator_saw() -> None:
    demand = floor_demand(TABLE_1, samples=400)
    cycle = find_limit_cycle(TABLE_1)
    # both look at instants only; 400 of them miss the extreme by less than 1e-3
    assert demand.least_normal_force == pytest.approx(cycle.least_normal_force, abs=1e-3)
    assert demand.greatest_friction == pytest.approx(cycle.greatest_friction, abs=1e-3)
    assert demand.greatest_normal_force < 1.0  # it arcs over its foot
    left, right = demand.steps
    assert left.normal_force == pytest.approx(right.normal_force, abs=1e-9)
    assert left.yaw_torque == pytest.approx(-right.yaw_torque, abs=1e-9)


def test_flat_passive_walker_asks_for_no_yaw_torque() -> None:
    demand = floor_demand(PassiveWalker(WalkerParameters(0.0, 0.5, 0.15, 0.00058)))
    assert demand.greatest_yaw_torque < 1e-12
    assert demand.greatest_friction < 0.1


# --- bad input


def test_bad_commands_are_refused_by_name() -> None:
    with pytest.raises(ValueError, match="pair"):
        find_limit_cycle(TABLE_1, mass_offset=(0.0, 0.0, 0.0))  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="right mass_offset must be in"):
        find_limit_cycle(TABLE_1, mass_offset=(0.0, 2.0))
    with pytest.raises(ValueError, match="takes no inter_leg_angle"):
        find_limit_cycle(point_feet(0.004), inter_leg_angle=0.2)
    with pytest.raises(ValueError, match="must be a Walker, a PassiveWalker or a SectionMap"):
        find_limit_cycle("walker")  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="odd number of steps"):
        ActiveMap(TABLE_1, mass_offset=(0.01, 0.01), n_steps=1)
    with pytest.raises(ValueError, match="parameter must be one of hip_width"):
        section_map_of(TABLE_1).value("length")
    with pytest.raises(ValueError, match="n_steps must be even"):
        find_periodic_gait(TABLE_1, n_steps=3)
    with pytest.raises(NoGaitError, match="the slope gives no energy"):
        find_limit_cycle(point_feet(-0.004))
    with pytest.raises(NoGaitError, match="gives no energy"):
        find_limit_cycle(LEVEL)


def test_guess_that_falls_is_named_as_such() -> None:
    with pytest.raises(NoGaitError, match="fell backward"):
        solve_fixed_point(section_map_of(TABLE_1), np.array([0.0, 0.15, 0.0, 0.2, 0.0]))


def test_mirrored_map_of_a_turned_state_is_the_mirror_image() -> None:
    section_map = replace(ActiveMap(FLAT), n_steps=2)
    state = np.array([0.1, 0.15, 0.01, -0.45, 0.02])
    one = ActiveMap(FLAT, n_steps=1)
    # two mirrored steps are a stride: the mirror image of a right step is a left one
    assert one.image(one.image(state)) == pytest.approx(section_map.image(state), abs=1e-12)
