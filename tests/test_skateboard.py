"""The skateboard of section 2.1: eqs. (1) to (3), damping and time histories."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from lean_yaw_env.vehicles import Skateboard, critical_speed, stable_speed_range

ROUND_OFF = 1e-12
"""Relative; a few dozen operations in double precision stay orders of magnitude below it."""

skateboards = st.builds(
    Skateboard,
    mass=st.floats(20.0, 150.0),
    rider_height=st.floats(0.3, 1.5),
    wheelbase=st.floats(0.2, 1.2),
    steering_tilt=st.floats(0.1, 1.4),
    spring_stiffness=st.floats(0.0, 2000.0),
    gravity=st.floats(1.0, 25.0),
    damping=st.floats(0.0, 300.0),
)
few = settings(max_examples=60)


# Laws


def test_lateral_acceleration_is_the_centripetal_acceleration_on_the_turning_circle():
    board = Skateboard(wheelbase=0.5, steering_tilt=0.6)
    # A wheel axis turned by delta = lean / tan(tilt) at either end: both meet on a circle about
    # (w / 2) / delta away.
    lean, speed = 0.02, 3.0
    radius = 0.25 / (lean / math.tan(0.6))
    assert board.lateral_acceleration(lean, speed) == pytest.approx(speed**2 / radius, ROUND_OFF)


def test_undamped_motion_conserves_the_energy_of_eq_2():
    board = Skateboard()
    motion = board.motion(2.0, np.linspace(0.0, 20.0, 101), lean=0.05, lean_rate=0.1)
    equation = board.equation_of_motion(2.0)
    energy = 0.5 * (equation.inertia * motion.lean_rate**2 + equation.stiffness * motion.lean**2)
    # The exponential is exact up to round-off times the phase, here about 80 rad.
    assert np.ptp(energy) < 1e-11 * energy[0]


def test_motion_agrees_with_an_integration_of_eqs_1_and_2():
    board, speed = Skateboard(damping=20.0), 1.4
    equation = board.equation_of_motion(speed)

    def derivative(_, state):
        lean, lean_rate, heading, _ = state
        torque = equation.damping * lean_rate + equation.stiffness * lean
        yaw_rate = board.lateral_acceleration(lean, speed) / speed
        return [lean_rate, -torque / equation.inertia, yaw_rate, speed * heading]

    times = np.linspace(0.0, 5.0, 26)
    reference = solve_ivp(
        derivative, (0.0, 5.0), [0.05, -0.1, 0.0, 0.0], "DOP853", times, rtol=1e-12, atol=1e-13
    ).y
    motion = board.motion(speed, times, lean=0.05, lean_rate=-0.1)
    found = [motion.lean, motion.lean_rate, motion.heading, motion.lateral_position]
    # The reference's own tolerance, accumulated over some hundred steps.
    np.testing.assert_allclose(found, reference, rtol=0.0, atol=1e-10)


@few
@given(board=skateboards, speed=st.floats(0.0, 20.0))
def test_eigenvalues_solve_eq_2(board, speed):
    equation = board.equation_of_motion(speed)
    first, second = board.eigenvalues(speed)[0]
    scale = max(abs(first), abs(second))
    # Vieta: sum and product of the roots.
    assert abs(first + second + equation.damping / equation.inertia) <= ROUND_OFF * scale
    assert abs(first * second - equation.stiffness / equation.inertia) <= ROUND_OFF * scale**2


@few
@given(board=skateboards)
def test_board_falls_below_its_critical_speed_and_not_above(board):
    critical = board.critical_speed()
    # One thousandth away the eigenvalues are far enough from zero to have a sign.
    assert np.max(board.eigenvalues(1.001 * critical + 1e-3).real) <= 0.0
    if critical > 0.0:
        assert np.max(board.eigenvalues(0.999 * critical).real) > 0.0


@few
@given(board=skateboards, speed=st.floats(0.0, 20.0))
def test_board_is_symmetric_fore_and_aft(board, speed):
    assert np.array_equal(board.eigenvalues(speed), board.eigenvalues(-speed))


# The paper's statements


@few
@given(board=skateboards)
def test_critical_speed_is_eq_3_or_zero_where_the_springs_suffice(board):
    m, h, w, k = board.mass, board.rider_height, board.wheelbase, board.spring_stiffness
    lacking = m * board.gravity * h - 2 * k
    radicand = lacking * w * math.tan(board.steering_tilt) / (2 * m * h)
    expected = math.sqrt(radicand) if radicand > 0 else 0.0
    assert board.critical_speed() == pytest.approx(expected, ROUND_OFF)
    assert critical_speed(board) == board.critical_speed()
    assert stable_speed_range(board) == (board.critical_speed(), math.inf)


def test_stiff_springs_are_never_unstable():
    board = Skateboard(spring_stiffness=400.0)
    assert 2 * board.spring_stiffness > board.mass * board.gravity * board.rider_height
    assert board.critical_speed() == 0.0
    assert np.all(board.eigenvalues(np.linspace(0.0, 30.0, 61)).real <= 0.0)


def test_without_damping_the_board_is_at_best_marginally_stable():
    values = Skateboard().eigenvalues(np.linspace(1.2, 10.0, 30))
    assert np.all(values.real == 0.0)
    assert np.all(values[:, 0].imag > 0.0)


def test_damping_makes_the_board_asymptotically_stable_above_the_same_critical_speed():
    damped, undamped = Skateboard(damping=10.0), Skateboard()
    assert damped.critical_speed() == undamped.critical_speed()
    above = damped.critical_speed() * np.linspace(1.01, 8.0, 40)
    assert np.all(damped.eigenvalues(above).real < 0.0)
    below = damped.critical_speed() * np.linspace(0.0, 0.99, 10)
    assert np.all(np.max(damped.eigenvalues(below).real, axis=1) > 0.0)
    # Slowest decay 10 / 70 per s: e^-17 is left after two minutes.
    assert abs(damped.motion(3.0, 120.0, lean=0.1).lean[0]) < 1e-6


def test_a_larger_tilt_needs_more_speed():
    speeds = [Skateboard(steering_tilt=tilt).critical_speed() for tilt in np.linspace(0.1, 1.5, 15)]
    assert np.all(np.diff(speeds) > 0.0)


def test_board_steers_towards_the_lean_and_rights_itself():
    motion = Skateboard(damping=30.0).motion(3.0, [0.0, 0.2, 20.0], lean=0.1)
    assert motion.heading[0] == 0.0 and motion.heading[1] > 0.0
    # Decay 30 / 70 per s over 20 s leaves e^-8.6 of the lean.
    assert abs(motion.lean[2]) < 1e-4
    assert motion.heading[2] > 0.0


def test_default_board_has_a_critical_speed_of_a_walking_pace():
    # sqrt((70 * 9.81 * 1 - 300) * 0.4 / 140)
    assert Skateboard().critical_speed() == pytest.approx(1.0511, abs=1e-4)


# Bad input


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("mass", 0.0),
        ("rider_height", -1.0),
        ("wheelbase", math.nan),
        ("steering_tilt", 0.0),
        ("steering_tilt", math.pi / 2),
        ("spring_stiffness", -1.0),
        ("gravity", math.inf),
        ("damping", -0.1),
    ],
)
def test_impossible_parameter_is_refused_by_name(name, value):
    with pytest.raises(ValueError, match=rf"{name} must be in .*got"):
        Skateboard(**{name: value})


def test_bad_arguments_are_refused_by_name():
    board = Skateboard()
    with pytest.raises(ValueError, match="speeds must hold finite numbers, got nan"):
        board.eigenvalues([1.0, math.nan])
    with pytest.raises(ValueError, match="speeds must hold one number or more, got none"):
        board.eigenvalues([])
    with pytest.raises(ValueError, match="speed must be a finite number"):
        board.equation_of_motion(math.inf)
    with pytest.raises(ValueError, match="lean must hold finite numbers"):
        board.lateral_acceleration(math.nan, 1.0)
    with pytest.raises(ValueError, match="lean_rate must be a finite number"):
        board.motion(1.0, [0.0], lean_rate=math.nan)
    with pytest.raises(ValueError, match=r"times must have shape \(n,\), got \(1, 1\)"):
        board.motion(1.0, [[0.0]])


def test_motion_beyond_floating_point_is_refused():
    with pytest.raises(OverflowError, match="by time 1000 s"):
        Skateboard().motion(0.0, [0.0, 1000.0])


def test_unknown_vehicle_has_no_critical_speed():
    with pytest.raises(
        TypeError, match="vehicle must be of a class with a known stable speed range"
    ):
        critical_speed("tricycle")
