"""Numbers of other publications, held against the walkers and against independent calculations."""

from __future__ import annotations

import importlib.util
import sys

import numpy as np
import pytest

from lean_yaw_env.analysis import find_limit_cycle
from lean_yaw_env.errors import LeanYawError
from lean_yaw_env.paper import simplest_walker, uneven_ground, wheels
from lean_yaw_env.paper.checks import names_of, printed
from lean_yaw_env.paper.steering import froude_number, steering_robots
from lean_yaw_env.paper.walkers import flat_active_walker, point_foot_walker

LONG = -0.19009984106588815 + 0.55759877668206827j
SHORT = (4.0038643589297072, 0.45958958979767159)
"""One step's multipliers at slope 0.009, from Garcia's equations integrated with thirty digits (Taylor series of order 24)."""


def test_multipliers_of_the_simplest_walker_are_those_of_an_integration_with_thirty_digits() -> (
    None
):
    long, short = (simplest_walker.step_multipliers(gait) for gait in simplest_walker.gaits())
    # The exact derivative of a step whose landing is corrected to second order, 8e-10 here
    assert long[0] == pytest.approx(LONG, abs=2e-9)
    np.testing.assert_allclose(np.real(short[:2]), SHORT, atol=2e-9)


def test_the_simplest_walker_agrees_with_its_publications_but_for_what_is_known() -> None:
    result = simplest_walker.simplest_walker()
    different = {check.name for check in result.checks if not check.agrees}
    assert different == {
        *names_of("multiplier, "),
        "series, long gait, Θ1",
    }


def test_the_printed_slope_of_the_long_gait_contradicts_the_printed_fixed_point() -> None:
    slope = printed("series, long gait, Θ1").value
    root = 0.009 ** (1.0 / 3.0)
    theirs = printed("series, long gait, Θ0").value * root + slope * 0.009
    fixed_point = printed("fixed point, long gait, θ").value
    # The next term of the series is of the order of γ^(5/3), 4e-4; the short gait's is off by less
    assert abs(theirs - fixed_point) > 7e-4
    short = (
        printed("series, short gait, Θ0").value * root
        + printed("series, short gait, Θ1").value * 0.009
    )
    assert abs(short - printed("fixed point, short gait, θ").value) < 1e-4
    _, angle, angle_slope, _, _ = simplest_walker.small_slopes(simplest_walker.gaits()[0])
    assert abs(angle * root + angle_slope * 0.009 - fixed_point) < 1e-4


def test_wheels_agree_with_their_closed_forms() -> None:
    assert all(check.agrees for check in wheels.rolling_wheels().checks)
    # McGeer's synthetic wheel: the root of an equation, to its rounding
    assert wheels.synthetic_step_time() == pytest.approx(4.0575156762, abs=1e-9)


def test_a_rimless_wheel_slows_down_the_more_the_nearer_its_slope_is_to_the_least() -> None:
    slope = wheels.least_slope(np.pi / 8.0)
    steps = [
        find_limit_cycle(
            flat_active_walker(factor * slope, foot_radius=0.0), inter_leg_angle=np.pi / 4.0
        ).stride_period
        for factor in (1.001, 1.01, 1.1)
    ]
    # The time on top of a spoke grows with the logarithm of what is left: as much for each tenth
    assert steps[0] - steps[1] == pytest.approx(steps[1] - steps[2], rel=0.1)


def test_a_step_on_even_ground_is_the_walkers_own() -> None:
    gait = simplest_walker.gaits()[0]
    state = uneven_ground.gait_state(0.009)
    steps = uneven_ground.uneven_steps(0.009, state[None], np.zeros(1))
    np.testing.assert_allclose(steps.states[0], state, atol=1e-11)
    assert steps.durations[0] == pytest.approx(0.5 * gait.stride_period, abs=1e-11)


def test_a_slope_that_changes_for_good_leads_to_that_slopes_gait() -> None:
    # All footholds lower by the same: the walk on the steeper slope, seen from the gentler one
    change, gait = 2e-5, simplest_walker.gaits(0.00902)[0]
    states = uneven_ground.gait_state(0.009)[None]
    for _ in range(60):
        states = uneven_ground.uneven_steps(0.009, states, np.array([change])).states
    # Multipliers of magnitude 0.59
    assert states[0, 0] + change == pytest.approx(gait.state[1], abs=1e-10)


def test_the_sensitivity_norm_is_that_of_the_walk_after_a_small_drop() -> None:
    drop, state = 1e-6, uneven_ground.gait_state(0.009)
    change = drop / (2.0 * np.sin(state[0]))
    usual = 0.5 * simplest_walker.gaits()[0].stride_period
    states, squares = state[None], 0.0
    for k in range(60):
        steps = uneven_ground.uneven_steps(0.009, states, np.array([change if k == 0 else 0.0]))
        states, squares = steps.states, squares + float(steps.durations[0] - usual) ** 2
    # A drop so small that its square changes the sixth digit only
    norm = uneven_ground.gait_sensitivity_norm(0.009)
    assert np.sqrt(squares) / drop == pytest.approx(norm, rel=1e-3)


def test_rougher_ground_makes_the_walker_fall_sooner() -> None:
    smooth, rough = (uneven_ground.first_passage_time(0.009, sigma) for sigma in (0.001, 0.002))
    # Some thirteen and four steps; thousands of falls are counted
    assert smooth == pytest.approx(13.0, rel=0.1)
    assert rough == pytest.approx(4.4, rel=0.1)


def test_a_drop_larger_than_the_largest_is_not_survived() -> None:
    largest = uneven_ground.largest_drop(0.009)
    states = uneven_ground.gait_state(0.009)[None]
    change = (largest + 1e-5) / (2.0 * np.sin(states[0, 0]))
    completed = True
    for k in range(100):
        steps = uneven_ground.uneven_steps(0.009, states, np.array([change if k == 0 else 0.0]))
        states, completed = steps.states, completed and bool(steps.completed[0])
        if not completed:
            break
    assert not completed


def test_the_benchmark_bicycle_has_every_published_digit() -> None:
    result = wheels.bicycle_benchmark()
    assert len(result.checks) >= 20
    assert all(check.agrees for check in result.checks)
    installed = importlib.util.find_spec("bicycleparameters") is not None
    assert bool(result.sections) != installed


def test_a_second_opinion_that_fails_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wheels, "PROGRAM", "raise SystemExit('no such model')")
    with pytest.raises(LeanYawError, match="no such model"):
        wheels.their_eigenvalues()


def test_a_second_opinion_is_read_from_the_programs_output(monkeypatch: pytest.MonkeyPatch) -> None:
    program = "import json, sys; given = json.load(sys.stdin); print(json.dumps([[[v, 1.0]] * 4 for v in given['speeds']]))"
    monkeypatch.setattr(wheels, "PROGRAM", program)
    found = wheels.their_eigenvalues()
    assert sys.executable
    np.testing.assert_array_equal(found[:, 0], np.linspace(0.0, 10.0, 41) + 1j)


def test_zippys_froude_number_follows_from_its_abstract() -> None:
    # 25 cm/s are 10 leg lengths a second: a leg of 2.5 cm
    assert froude_number(0.25, 0.025) == pytest.approx(0.2548, abs=1e-4)
    (section,) = steering_robots().sections
    assert "could not be read" in section.text


def test_the_end_of_walking_is_a_slope_on_which_a_walk_still_goes_on() -> None:
    slope = simplest_walker.end_of_walking()
    assert 0.0185 < slope < 0.0192
    assert point_foot_walker(slope).parameters.slope == slope
