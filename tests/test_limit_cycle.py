"""Gaits of the active walker: the paper's tables and figures, exact fixed points and multipliers, and what has no gait."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from lean_yaw_env import LimitCycle, NoGaitError, Walker, WalkerParameters, find_limit_cycle
from lean_yaw_env.analysis import ActiveMap, find_gait, planar_gait_rate, section_map_of
from lean_yaw_env.analysis.fixed_point import solve_fixed_point
from lean_yaw_env.analysis.path import axle_middle
from lean_yaw_env.errors import FellError
from lean_yaw_env.parameters import MIRROR, Vector
from tests.reference import ReferenceWalker

STRIDE = section_map_of(Walker()).over(2)


@pytest.fixture(scope="module")
def cycle() -> LimitCycle:
    return find_limit_cycle(Walker())


# --- laws


def test_the_gait_repeats_itself_to_round_off(cycle: LimitCycle) -> None:
    assert cycle.residual <= 1e-12
    first, second = STRIDE.results(cycle.state)
    assert np.abs(second.state - cycle.state).max() <= 1e-12
    # and a right step is a left step's mirror image
    assert np.abs(first.state - cycle.state * MIRROR).max() <= 1e-12


def test_the_gait_is_the_reference_s_to_ten_digits(cycle: LimitCycle) -> None:
    reference = ReferenceWalker()

    def stride(state: Vector) -> Vector:
        middle = reference.step(state, 1.0, 0.3, 0.0, 0.0)[0]
        return reference.step(middle, -1.0, 0.3, 0.0, 0.0)[0]

    state = cycle.state.copy()
    for _ in range(2):
        state -= np.linalg.solve(cycle.jacobian - np.eye(5), stride(state) - state)
    # A stride's error of 4e-13 moves a fixed point of multiplier 0.986 seventy times as far
    assert np.abs(state - cycle.state).max() < 5e-11


def test_multipliers_are_those_of_the_exact_jacobian(cycle: LimitCycle) -> None:
    state, matrix = STRIDE.derivative(cycle.state)
    assert np.abs(matrix - cycle.jacobian).max() < 1e-11
    assert np.abs(state - cycle.state).max() < 1e-12
    own = np.linalg.eigvals(matrix)
    own = own[np.argsort(-np.abs(own))]
    assert np.abs(np.abs(own) - np.abs(cycle.eigenvalues)).max() < 1e-10


def test_disturbances_die_out_as_the_first_multiplier_says(cycle: LimitCycle) -> None:
    state = cycle.state + 1e-4
    distances = []
    for _ in range(120):
        state = STRIDE.image(state)
        distances.append(np.abs(state - cycle.state).max())
    # after sixty strides the second multiplier, 0.959, has all but died out; second-order terms are of 1e-4
    ratio = (distances[119] / distances[79]) ** (1 / 40)
    assert ratio == pytest.approx(cycle.eigenvalues[0].real, abs=2e-3)
    assert cycle.is_stable


def test_one_multiplier_is_zero_as_heel_strike_ties_pitch_to_lean(cycle: LimitCycle) -> None:
    assert abs(cycle.eigenvalues[-1]) < 1e-12


def test_energy_gained_along_the_gait_is_the_slope_s(cycle: LimitCycle) -> None:
    assert cycle.gravity_work == pytest.approx(math.sin(0.01), abs=1e-12)
    assert cycle.shift_work == 0.0
    assert cycle.speed * cycle.stride_period == pytest.approx(2.0 * cycle.step_length, rel=1e-14)


@pytest.mark.parametrize(("radius", "slope"), [(0.0, 0.01), (0.5, 0.01), (0.5, 0.03), (0.8, 0.005)])
def test_without_hip_width_the_gait_is_the_planar_closed_form(radius: float, slope: float) -> None:
    walker = Walker(WalkerParameters(hip_width=0.0, foot_radius=radius, slope=slope))
    state = find_gait(walker)
    level, lift = radius + (1 - radius) * math.cos(0.15), (1 - radius) * math.sin(0.15)
    kept = (level**2 - lift**2) / (level**2 + lift**2)
    gained = 4.0 * (0.15 * radius + lift) * math.sin(slope) / (level**2 + lift**2)
    rate = -math.sqrt(gained * kept**2 / (1 - kept**2))
    # the residual of the search, times how far the softest multiplier lets the rate go
    assert np.abs(state - [0.0, 0.15, 0.0, rate, 0.0]).max() < 1e-10
    assert planar_gait_rate(walker, 0.3) == pytest.approx(rate, rel=1e-12)


def test_the_two_searches_agree(cycle: LimitCycle) -> None:
    assert np.abs(find_gait(Walker()) - cycle.state).max() < 1e-10


@pytest.mark.parametrize("slope", [0.008, 0.009])
def test_the_gait_alone_is_found_where_estimated_slopes_lead_nowhere(slope):
    walker = Walker(WalkerParameters(slope=slope))
    # both have the residual of a found gait, 1e-10, over multipliers that leave 0.1 of a deviation or more
    assert find_gait(walker) == pytest.approx(find_limit_cycle(walker).state, abs=1e-9)


def test_turns_to_either_side_are_mirror_images() -> None:
    walker = Walker(WalkerParameters(slope_turns=True))
    right, left = (find_limit_cycle(walker, mass_offset=offset) for offset in (0.05, -0.05))
    assert left.turn == pytest.approx(-right.turn, abs=1e-11)
    for name in ("speed", "step_length", "gravity_work", "turning_radius", "stride_period"):
        assert getattr(left, name) == pytest.approx(getattr(right, name), rel=1e-10)
    # the two feet walk on circles that lie a hip width apart, so that the mean of both counts
    chords = [
        float(np.linalg.norm(sum(step.displacement for step in gait.steps)))
        for gait in (right, left)
    ]
    assert abs(chords[0] - chords[1]) > 0.03 * chords[0]
    assert right.step_length == pytest.approx(0.25 * sum(chords), rel=1e-10)


def test_the_middle_of_the_axle_turns_about_one_centre_at_the_turning_radius() -> None:
    walker = Walker(WalkerParameters(slope_turns=True))
    gait = find_limit_cycle(walker, mass_offset=0.05)
    walk = walker.walk(60, state=gait.state, mass_offset=0.05)
    places = walk.footprints + [
        axle_middle(walker, state, foot)
        for state, foot in zip(walk.states, walk.stances, strict=True)
    ]
    # the circle through three left steps' places, and the one through three right steps'
    radii = [_circle_through(*places[first::20][:3]) for first in (0, 1)]
    assert gait.turning_radius == pytest.approx(np.mean(radii), rel=1e-5)
    assert find_limit_cycle(Walker()).turning_radius == math.inf


def _circle_through(a: Vector, b: Vector, c: Vector) -> float:
    """Its radius: product of the sides over four times the area."""
    sides = [float(np.linalg.norm(p - q)) for p, q in ((a, b), (b, c), (c, a))]
    (x1, z1), (x2, z2) = b - a, c - a
    return math.prod(sides) / (2.0 * abs(x1 * z2 - x2 * z1))


def test_of_two_gaits_that_meet_at_a_fold_it_is_the_one_that_the_planar_gait_leads_to() -> None:
    walker = Walker(WalkerParameters(0.42, 0.77, 0.9, 0.0082))
    found = find_limit_cycle(walker, inter_leg_angle=0.38)
    wide = ActiveMap(walker, 0.38, n_steps=1)
    state = np.array([0.0, 0.19, 0.0, planar_gait_rate(walker, 0.38), 0.0])
    for share in np.linspace(0.0, 1.0, 101):
        state = solve_fixed_point(wide.moved("hip_width", 0.42 * share), state)
    assert found.state == pytest.approx(state, abs=1e-10)
    assert found.is_stable


# --- published numbers


def test_table_2(cycle: LimitCycle) -> None:
    # This reading's digits; the paper gives 0.0016 (0.00155 in Figure 14), -0.0041, -0.42, -0.070
    known = [0.001539, 0.1553577, -0.004109, -0.415110, -0.070156]
    assert np.abs(cycle.state - known).max() < 6e-7
    # the paper's fourth coordinate is the leg's pitch, not the foot's: L = Ry(u1) Rx(u2) Rz(u4), 0.155
    _, leg = ReferenceWalker().pose(*cycle.state[:3], 1.0)
    assert math.atan2(leg[1, 0], leg[1, 1]) == pytest.approx(0.155354, abs=5e-7)


def test_section_4_2_step_length(cycle: LimitCycle) -> None:
    # "0.3 times the leg length"
    assert cycle.step_length == pytest.approx(0.3, abs=0.0025)


def test_figure_11_slope_at_which_the_walker_without_hip_width_becomes_stable() -> None:
    def instability(slope: float) -> float:
        walker = Walker(WalkerParameters(hip_width=0.0, slope=slope))
        return float(np.abs(find_limit_cycle(walker).eigenvalues).max()) - 1.0

    slope = brentq(instability, 0.009, 0.0109, xtol=1e-7)
    assert slope == pytest.approx(0.01, abs=2e-4)  # the paper's
    assert slope == pytest.approx(0.01016, abs=5e-6)


@pytest.mark.parametrize(
    ("tilt", "radius", "speed", "published"),
    [
        (math.pi / 8, 0.5, 0.364, 0.36),
        (math.pi / 8, 0.2, 0.364, 0.36),
        (math.pi / 4, 0.5, 0.705, 0.72),
        (math.pi / 4, 0.2, 0.715, 0.72),
    ],
)
def test_figure_13_critical_speed_depends_on_the_tilt_alone(
    tilt: float, radius: float, speed: float, published: float
) -> None:
    def cycle_at(slope: float) -> LimitCycle:
        parameters = WalkerParameters(
            hip_width=0.0, foot_radius=radius, ankle_tilt=tilt, slope=slope
        )
        return find_limit_cycle(Walker(parameters))

    def instability(log_slope: float) -> float:
        return float(np.abs(cycle_at(math.exp(log_slope)).eigenvalues).max()) - 1.0

    critical = cycle_at(
        math.exp(brentq(instability, math.log(0.004), math.log(0.055), xtol=1e-6))
    ).speed
    assert critical == pytest.approx(
        published, abs=0.016
    )  # read off a plot: 0.72 comes out as 0.705
    assert critical == pytest.approx(speed, abs=6e-4)


@pytest.mark.parametrize("offset", [0.002, 0.006, -0.006])
def test_figure_15_an_offset_turns_the_gait_to_where_the_slope_balances_it(offset: float) -> None:
    cycle = find_limit_cycle(Walker(), mass_offset=offset)
    first, second = cycle.steps
    heading = 0.5 * (first.state[0] + second.state[0])
    closed_form = -math.asin(offset / math.tan(0.01))
    # the closed form balances the moments at the mean heading: left and right steps differ by little
    assert heading == pytest.approx(closed_form, abs=4e-3)
    if offset == 0.006:
        assert heading == pytest.approx(-0.64, abs=5e-3)  # the paper: to the right
    # the walk itself goes exactly where the offset over the distance gives as much as the slope takes
    walked = first.displacement + second.displacement
    assert cycle.gravity_work == pytest.approx(
        math.sin(0.01) * walked[0] / np.linalg.norm(walked), abs=1e-12
    )


def test_a_pumping_walker_walks_on_the_level_and_uphill() -> None:
    for slope, speed in ((0.0, 0.632), (-0.005, 0.561)):
        walker = Walker(WalkerParameters(slope=slope))
        cycle = find_limit_cycle(walker, mass_offset=(0.03, -0.03))
        assert cycle.speed == pytest.approx(speed, abs=6e-4)
        assert cycle.least_normal_force > 0.34
        assert cycle.greatest_friction < 0.5
        # what pumping puts in is what the slope takes and the impacts lose
        assert cycle.shift_work > -cycle.gravity_work
        assert cycle.gravity_work == pytest.approx(math.sin(slope), abs=1e-10)


# --- bad input


@pytest.mark.parametrize(
    ("parameters", "command", "message"),
    [
        ({"slope": 0.0}, {}, "no closed form"),
        ({"slope": -0.02}, {}, "no closed form"),
        ({}, {"mass_offset": 0.2}, "no closed form|following"),
    ],
)
def test_a_walker_without_a_gait_is_told_what_was_tried(
    parameters: dict[str, float], command: dict[str, Any], message: str
) -> None:
    with pytest.raises(NoGaitError, match=message):
        find_limit_cycle(Walker(replace(WalkerParameters(), **parameters)), **command)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ({"inter_leg_angle": 0.0}, "inter_leg_angle must be in"),
        ({"inter_leg_angle": math.nan}, "inter_leg_angle must be in"),
        ({"mass_offset": 1.5}, "offset must be in"),
    ],
)
def test_a_bad_command_is_refused(command: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        find_limit_cycle(Walker(), **command)


def test_a_stride_that_falls_says_which_step_and_how(gait: Vector) -> None:
    with pytest.raises(FellError, match="fell backward in step 1 of the gait"):
        STRIDE.results(np.array([0.0, 0.155, 0.0, 0.15, 0.0]))
    with pytest.raises(FellError, match=r"fell .* in the step on its left foot"):
        STRIDE.derivative(np.array([0.0, 0.155, 0.0, 0.15, 0.0]))
    state = gait * [1.0, 1.0, 1.0, 0.3, 1.0]
    assert Walker().step(state).fall is None
    with pytest.raises(FellError, match="fell backward in step 2 of the gait"):
        STRIDE.results(state)
