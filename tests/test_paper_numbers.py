"""The paper's numbers that our walkers reproduce, and the pieces at a reduced size."""

from __future__ import annotations

import numpy as np
import pytest

from lean_yaw_env.analysis import continue_gait, find_limit_cycle
from lean_yaw_env.analysis.path import radius_of_walk
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.paper import active, passive, steering, tables, vehicles, wide_hips
from lean_yaw_env.paper.checks import Result
from lean_yaw_env.paper.walkers import (
    FlatGait,
    arc_foot_walker,
    circling_gait,
    circling_walker,
    doubling_slope,
    flat_active_walker,
    flat_passive_walker,
    gait_of,
    lateral_radius,
    point_foot_walker,
    table_1_gait,
)
from lean_yaw_env.paper.wide_hips import WideHipRow, gait_at
from lean_yaw_env.vehicles import Skateboard

OPEN = {"heading", "C: λ4", "C: λ5", "footprint angle", "maximal slope, C"}
"""Disagreements that are known and stay open."""
DIFFERENT = {
    "eq. (2), springs",
    "weave frequency",
    "v_min over α, Figure 10 left",
    "v_min over α, Figure 13, π/4",
    "steep slopes",
    "any combination",
    "turning radius, as drawn",
    "beyond -50 %",
    "limp",
}
"""Disagreements that are known and explained."""


def _require_known(result: Result) -> None:
    for check in result.checks:
        text = f"{check.name}: {check.paper} and {check.ours}"
        if check.name in OPEN:
            assert check.verdict == "open", text
        elif check.name in DIFFERENT:
            assert check.verdict == "differs", text
        else:
            assert check.agrees, text


@pytest.mark.parametrize(
    "make",
    [
        tables.table_1,
        tables.table_2,
        tables.table_3,
        vehicles.figure_4,
        passive.figure_7,
        steering.figure_14,
        steering.figure_15,
        vehicles.skateboard,
        active.active_claims,
        steering.steering_claims,
    ],
)
def test_the_pieces_agree_with_the_paper_but_for_what_is_known(make) -> None:
    result = make()
    assert result.checks
    _require_known(result)
    # What is open has a section of what was tried, but for Figure 14's heading, which is Table 2's
    is_open = any(check.verdict == "open" for check in result.checks)
    assert is_open == bool(result.sections) or make is steering.figure_14


def test_figure_8_and_10_multipliers_vanish_together_where_the_ankle_axis_becomes_vertical() -> (
    None
):
    # At the tilt of the greatest pitch the strike forgets the lean: the smallest lateral one is 0
    gait = FlatGait.of(flat_active_walker())
    pitch = float(gait.cycle.state[1])
    assert gait.multipliers(pitch)[1][-1] < 1e-9
    assert gait.multipliers(pitch + 0.02)[1][-1] > 1e-4


def test_fore_aft_multipliers_do_not_depend_on_the_ankle_tilt() -> None:
    gait = FlatGait.of(flat_passive_walker())
    first, second = gait.multipliers(0.14)[0], gait.multipliers(0.3)[0]
    # Same gait, another block of the same matrix: round-off, amplified by its norm
    np.testing.assert_allclose(first, second, atol=1e-9)


def test_flat_multipliers_are_those_of_the_whole_jacobian() -> None:
    walker = flat_passive_walker(ankle_tilt=0.152)
    gait = FlatGait.of(walker)
    blocks = np.sort(np.concatenate(gait.multipliers(0.152)))
    # The zero ones only to the square root of round-off, should they be defective
    np.testing.assert_allclose(blocks, np.sort(np.abs(gait_of(walker).eigenvalues)), atol=1e-7)


def test_stable_tilts_end_where_a_multiplier_is_one() -> None:
    gait = FlatGait.of(flat_active_walker())
    low, high = gait.stable_tilts(0.05, 0.8, points=60)
    assert low == pytest.approx(0.15, abs=0.005)  # section 4.2, two digits
    assert high == pytest.approx(0.55, abs=0.005)
    for end in (low, high):
        assert gait.spectral_radius(end) == pytest.approx(1.0, abs=1e-6)


def test_the_active_flat_walker_with_tilt_055_becomes_stable_at_slope_001() -> None:
    assert active.stable_slope() == pytest.approx(0.01, abs=0.0005)  # Figure 11's two digits


def test_slope_limits_of_the_planar_passive_walkers() -> None:
    # Garcia et al. 1998: "near 0.0151"; the arc-foot one is ours, the paper has 0.046
    slope = doubling_slope(point_foot_walker(), (0.001, 0.03))
    assert slope == pytest.approx(0.0151, abs=5e-5)
    slope = doubling_slope(arc_foot_walker(), (0.0003, 0.08))
    assert slope == pytest.approx(0.04542, abs=1e-5)


def test_arc_feet_survive_four_times_the_deviation_of_point_feet() -> None:
    points, _ = passive.least_deviation(point_foot_walker())
    arcs, _ = passive.least_deviation(arc_foot_walker())
    assert points == pytest.approx(0.02, abs=0.005)  # 2 %, section 4.1
    assert 0.075 < arcs < 0.095  # "8 %", a crude analysis; ours is 8.6 %


def test_the_flat_passive_walker_falls_sideways_on_slopes_where_its_legs_would_still_do() -> None:
    assert lateral_radius(0.038) < 1.0
    assert lateral_radius(0.0425) > 1.0


def test_a_passive_gait_wider_than_the_papers_limit_is_stable_and_walks_back_to_itself() -> None:
    row = WideHipRow.at(0.06)
    low, high = row.stable_tilts
    assert 0.0005 < high - low < 0.003
    middle = 0.5 * (low + high)
    assert row.radii_on(np.array([middle]))[0] < 0.9
    start, state = gait_at(0.18, 0.06)
    branch = continue_gait(start, "ankle_tilt", (middle, 0.18), state=state, upward=False)
    gait = branch.states[-1]
    walker = flat_passive_walker(ankle_tilt=middle, hip_width=0.06)
    walk = walker.walk(40, state=gait + 1e-5)
    # Twenty strides at less than 0.9 each leave a tenth
    assert walk.fall is None
    assert np.abs(walk.states[-1] - gait).max() < 2e-6


def test_wider_hips_widen_the_active_walkers_stable_tilts() -> None:
    narrow, wide = (wide_hips.stable_tilt_ends(width) for width in (0.0, 0.2))
    assert wide[0] < narrow[0] < narrow[1] < wide[1]


def test_the_active_surface_is_figure_10_at_no_hip_width() -> None:
    table = wide_hips.figure_12(tilts=5, widths=3).tables["figure12"]
    tilts, greatest = (
        np.reshape(table[key], (5, 3))[:, 0] for key in ("ankle_tilt", "greatest_multiplier")
    )
    gait = FlatGait.of(flat_active_walker())
    line = [gait.spectral_radius(tilt) for tilt in tilts]
    # Two ways to the same gait, each to 1e-12; multipliers up to 2e4
    np.testing.assert_allclose(greatest, line, rtol=1e-6)


def test_critical_speeds_of_figure_13_hardly_depend_on_the_foot_radius() -> None:
    for tilt, paper in ((np.pi / 8, 0.36), (np.pi / 4, 0.72)):
        speeds = [active.flat_critical_speed(tilt, radius) for radius in (0.2, 0.5)]
        # "Almost exactly equal": the paper reads a boundary off a grid
        np.testing.assert_allclose(speeds, paper, rtol=0.03)
        assert np.ptp(speeds) < 0.02 * np.mean(speeds)


def test_equation_8_overestimates_the_speed_and_less_so_the_faster_the_walk() -> None:
    slow, fast, faster = (active.overestimate(slope, 0.5) for slope in (0.002, 0.01, 0.05))
    assert slow > fast > faster > 0.0


def test_velocity_map_holds_the_speed_of_the_gaits() -> None:
    table = {key: list(column) for key, column in active.figure_13(4, 3).tables["figure13"].items()}
    assert {len(column) for column in table.values()} == {12}
    for slope, radius, speed in zip(
        table["slope"], table["foot_radius"], table["speed"], strict=True
    ):
        if np.isfinite(speed):
            gait = gait_of(flat_active_walker(slope, foot_radius=radius))
            assert speed == pytest.approx(gait.speed, rel=1e-9)
    assert np.isfinite(table["speed"]).sum() > 6
    # The flat walker is 22 % faster than the wide one on the same slope
    assert 1.0 < FlatGait.of(flat_active_walker()).cycle.speed / table_1_gait().speed < 1.3


def test_the_settled_heading_is_the_closed_form() -> None:
    # The closed form balances moments without the path's own sway: good to a few parts in 1e3
    assert steering.settled_heading() == pytest.approx(steering.asymptotic_heading(), rel=3e-3)


def test_the_circle_that_the_walk_closes_has_the_gaits_turning_radius() -> None:
    gait = circling_gait()
    strides = round(2.0 * np.pi / abs(gait.turn))
    walker = circling_walker()
    walk = walker.walk(2 * strides, state=gait.state, mass_offset=0.05, samples_per_step=2)
    # The centre of mass is moved by 0.05 to the inside of the turn
    centre = walk.path[:, 1].mean(), walk.path[:, 3].mean()
    radii = np.hypot(walk.path[:, 1] - centre[0], walk.path[:, 3] - centre[1])
    assert radii.mean() == pytest.approx(8.11, abs=0.005)
    assert gait.turning_radius == pytest.approx(radii.mean() + 0.05, abs=0.005)
    # the first quarter has the same radius, but for the sway of its ends
    assert radius_of_walk(walker, walk) == pytest.approx(gait.turning_radius, rel=3e-4)


@pytest.mark.parametrize(
    "make",
    [
        lambda: passive.figure_8(points=5),
        lambda: active.figure_10(points=5),
        lambda: active.figure_11(points=3),
        lambda: vehicles.figure_4(points=5),
        steering.figure_14,
    ],
)
def test_data_of_a_figure_are_equally_long_columns(make) -> None:
    tables = make().tables
    assert tables
    for table in tables.values():
        (length,) = {len(list(column)) for column in table.values()}
        assert length > 0


def test_the_passive_surface_follows_the_stable_valley() -> None:
    rows = [WideHipRow.at(width) for width in (0.0, 0.02)]
    surface = wide_hips.passive_surface(rows, points=41)
    assert (np.nanmin(surface.greatest, axis=0) < 1.0).all()


def test_an_axle_under_a_leaning_board_stays_level_and_points_at_the_turning_circle() -> None:
    lean, board = 0.2, Skateboard()
    tilt, turn = board.steering_tilt, vehicles.truck_turn(0.2, board.steering_tilt)
    about = -np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    axle = np.array([0.0, 1.0, 0.0])
    turned = np.cos(turn) * axle + np.sin(turn) * np.cross(about, axle)
    leant = np.array(
        [
            turned[0],
            np.cos(lean) * turned[1] - np.sin(lean) * turned[2],
            np.sin(lean) * turned[1] + np.cos(lean) * turned[2],
        ]
    )
    assert abs(leant[2]) < 1e-15
    radius = 0.5 * board.wheelbase / abs(leant[0] / leant[1])
    assert vehicles.turning_circle(board, lean) == pytest.approx(radius, rel=1e-12)


def test_the_floor_must_pull_at_the_foot_of_a_gait_steeper_than_the_lift_off_slope() -> None:
    slope = active.lift_off_slope()
    assert slope == pytest.approx(0.0737, abs=1e-4)
    # The compiled walker, whose foot the floor cannot pull at, has a gait just below it and none above
    find_limit_cycle(flat_active_walker(0.999 * slope))
    with pytest.raises(NoGaitError):
        find_limit_cycle(flat_active_walker(1.001 * slope))


def test_a_walker_whose_feet_step_alike_walks_straight_and_others_mirror_each_other() -> None:
    assert abs(steering.asymmetric_turn()) < 1e-12
    turn = steering.asymmetric_turn(inter_leg_angle=0.303)
    back = steering.asymmetric_turn(inter_leg_angle=0.297)
    assert turn > 1e-5
    # Opposite to first order; a hundredth of the angle leaves a hundredth of the second
    assert back == pytest.approx(-turn, rel=0.05)


def test_the_lateral_pair_of_table_3_is_as_sensitive_as_its_section_says() -> None:
    pair = tables.lateral_pair(flat_passive_walker())
    assert pair.sum() == pytest.approx(1.248, abs=5e-4)
    assert pair.prod() == pytest.approx(0.3633, abs=5e-5)
    # Forward differences small enough give the same
    np.testing.assert_allclose(tables.forward_difference_pair(1e-5), pair, atol=1e-3)


def test_the_lower_edge_of_figure_12_is_where_the_followed_gait_folds_back() -> None:
    tilts, radii = wide_hips.lower_edge(0.2)
    assert tilts[0] == pytest.approx(0.1405, abs=5e-4)
    assert radii[0] == 1.0
    assert (radii[1:] < 1.0).all()
    assert (np.diff(tilts) > 0.0).all()


def test_the_usual_gait_is_taken_of_a_walker_that_has_a_third_one() -> None:
    gait = gait_of(arc_foot_walker(foot_radius=0.505))
    assert gait.is_stable
    assert gait.stride_period == pytest.approx(7.83, abs=0.01)
