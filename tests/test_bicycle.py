"""The bicycle of section 2.2: eqs. (4), (5), Figure 4, and the 2007 benchmark."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from lean_yaw_env.vehicles import (
    BENCHMARK_2007,
    BRANCH_NAMES,
    UNNAMED_BRANCHES,
    BicycleParameters,
    FrameBody,
    LinearBicycle,
    Wheel,
    benchmark_bicycle,
    canonical_matrices,
    critical_speed,
    follow_eigenvalues,
    paper_bicycle,
    parameters_2005,
    stable_speed_range,
)

PUBLISHED_DIGITS = 6e-14
"""The benchmark prints 14 decimals, so half a unit of the last one is the least to allow; the rest
is room for the round-off, relative 1e-15, of matrix entries up to 80."""

few = settings(max_examples=40)


def _varied_frame(frame: FrameBody, mass: float, x: float, z: float) -> FrameBody:
    return replace(frame, mass=frame.mass * mass, x=frame.x * x, z=frame.z * z)


factors = st.floats(0.75, 1.3)
bicycles = st.builds(
    lambda wheelbase, trail, tilt, body, fork, wheels: BicycleParameters(
        wheelbase=wheelbase,
        trail=trail,
        steer_axis_tilt=tilt,
        rear_frame=_varied_frame(BENCHMARK_2007.rear_frame, *body),
        front_frame=_varied_frame(BENCHMARK_2007.front_frame, *fork),
        rear_wheel=replace(BENCHMARK_2007.rear_wheel, radius=0.3 * wheels[0]),
        front_wheel=replace(BENCHMARK_2007.front_wheel, radius=0.35 * wheels[1]),
    ),
    wheelbase=st.floats(0.8, 1.4),
    trail=st.floats(-0.05, 0.15),
    tilt=st.floats(-0.1, 0.6),
    body=st.tuples(factors, factors, factors),
    fork=st.tuples(factors, factors, factors),
    wheels=st.tuples(factors, factors),
)


# Laws


@few
@given(parameters=bicycles, speed=st.floats(0.1, 15.0))
def test_rolling_backwards_reverses_time(parameters, speed):
    bicycle = benchmark_bicycle(parameters)
    forward, backward = bicycle.eigenvalues(speed)[0], bicycle.eigenvalues(-speed)[0]
    # Meeting eigenvalues carry the square root of round-off, 1e-8 of the greatest.
    gaps = np.min(np.abs(forward[:, None] + backward[None, :]), axis=1)
    assert np.max(gaps) < 1e-6 * np.max(np.abs(forward))


@few
@given(parameters=bicycles, speed=st.floats(0.0, 15.0))
def test_scaling_all_masses_changes_no_eigenvalue(parameters, speed):
    heavy = replace(
        parameters,
        rear_wheel=_scaled_wheel(parameters.rear_wheel, 1.0, 8.0),
        rear_frame=_scaled_frame(parameters.rear_frame, 1.0, 8.0),
        front_frame=_scaled_frame(parameters.front_frame, 1.0, 8.0),
        front_wheel=_scaled_wheel(parameters.front_wheel, 1.0, 8.0),
    )
    light_bicycle, heavy_bicycle = benchmark_bicycle(parameters), benchmark_bicycle(heavy)
    # A factor 8 is exact in binary, so nothing at all may change.
    assert np.array_equal(light_bicycle.eigenvalues(speed), heavy_bicycle.eigenvalues(speed))


def test_a_bicycle_four_times_as_long_is_stable_at_twice_the_speed():
    p = BENCHMARK_2007
    large = BicycleParameters(
        wheelbase=4 * p.wheelbase,
        trail=4 * p.trail,
        rear_wheel=_scaled_wheel(p.rear_wheel, 4.0, 1.0),
        rear_frame=_scaled_frame(p.rear_frame, 4.0, 1.0),
        front_frame=_scaled_frame(p.front_frame, 4.0, 1.0),
        front_wheel=_scaled_wheel(p.front_wheel, 4.0, 1.0),
    )
    small_range = stable_speed_range(benchmark_bicycle(p))
    large_range = stable_speed_range(benchmark_bicycle(large))
    assert small_range is not None and large_range is not None
    # Only round-off is left: Froude's law is exact.
    np.testing.assert_allclose(large_range, 2.0 * np.array(small_range), rtol=1e-12)


def _scaled_wheel(wheel: Wheel, length: float, mass: float) -> Wheel:
    inertia = mass * length**2
    return Wheel(
        wheel.radius * length,
        wheel.mass * mass,
        wheel.inertia_xx * inertia,
        wheel.inertia_yy * inertia,
    )


def _scaled_frame(frame: FrameBody, length: float, mass: float) -> FrameBody:
    inertia = mass * length**2
    return FrameBody(
        frame.mass * mass,
        frame.x * length,
        frame.z * length,
        frame.inertia_xx * inertia,
        frame.inertia_xz * inertia,
        frame.inertia_yy * inertia,
        frame.inertia_zz * inertia,
    )


def test_standing_bicycle_conserves_its_energy():
    bicycle = benchmark_bicycle()
    motion = bicycle.motion(0.0, np.linspace(0.0, 2.0, 41), lean=1e-3, steer_rate=0.02)
    positions = np.array([motion.lean, motion.steer])
    rates = np.array([motion.lean_rate, motion.steer_rate])
    kinetic = 0.5 * np.sum(rates * (bicycle.mass_matrix @ rates), axis=0)
    potential = 0.5 * np.sum(positions * (bicycle.static_stiffness @ positions), axis=0)
    # The two grow by e^20 and nearly cancel: round-off is judged by the terms, not the sum.
    change = kinetic + potential - kinetic[0] - potential[0]
    assert np.all(np.abs(change) < 1e-12 * (kinetic + np.abs(potential)))


@pytest.mark.parametrize("speed", [0.5, 3.0, 5.0, 8.0])
def test_motion_agrees_with_an_integration_of_eq_4(speed):
    bicycle = paper_bicycle()
    stiffness = bicycle.static_stiffness + speed**2 * bicycle.dynamic_stiffness

    def derivative(_, state):
        force = -speed * bicycle.damping_matrix @ state[2:] - stiffness @ state[:2]
        return np.concatenate([state[2:], np.linalg.solve(bicycle.mass_matrix, force)])

    times, start = np.linspace(0.0, 2.0, 21), [0.01, -0.02, 0.1, 0.05]
    reference = solve_ivp(derivative, (0.0, 2.0), start, "DOP853", times, rtol=1e-12, atol=1e-14).y
    motion = bicycle.motion(speed, times, lean=0.01, steer=-0.02, lean_rate=0.1, steer_rate=0.05)
    found = np.array([motion.lean, motion.steer, motion.lean_rate, motion.steer_rate])
    # The reference's tolerance over some hundred steps, relative to the largest motion.
    np.testing.assert_allclose(found, reference, rtol=0.0, atol=1e-9 * np.max(np.abs(reference)))


@few
@given(parameters=bicycles, speed=st.floats(0.0, 15.0))
def test_modes_solve_eq_4(parameters, speed):
    bicycle = benchmark_bicycle(parameters)
    stiffness = bicycle.static_stiffness + speed**2 * bicycle.dynamic_stiffness
    for value, shape in zip(*bicycle.modes(speed), strict=True):
        terms = (
            value**2 * bicycle.mass_matrix @ shape,
            value * speed * bicycle.damping_matrix @ shape,
            stiffness @ shape,
        )
        # Round-off relative to the terms that cancel, with room for meeting eigenvalues.
        assert np.max(np.abs(sum(terms))) < 1e-9 * max(np.max(np.abs(term)) for term in terms)
        assert shape[0].imag == pytest.approx(0.0, abs=1e-15) and shape[0].real >= 0.0
        assert np.linalg.norm(shape) == pytest.approx(1.0, rel=1e-12)


# Published: the 2007 benchmark (Meijaard, Papadopoulos, Ruina, Schwab, Proc. R. Soc. A 463)


def test_benchmark_matrices_are_those_published():
    matrices = canonical_matrices(BENCHMARK_2007)
    published = (
        [[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]],
        [[0.0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]],
        [[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]],
        [[0.0, 76.59734589573222], [0.0, 2.65431523794604]],
    )
    for found, expected in zip(matrices, published, strict=True):
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=PUBLISHED_DIGITS)


PUBLISHED_EIGENVALUES = (
    # speed, weave real, weave imaginary, capsize, caster: Table 2 (b) and (c)
    (1, 3.52696170990070, 0.80774027519930, -3.13423125066578, -7.11008014637442),
    (2, 2.68234517512745, 1.68066296590675, -3.07158645641514, -8.67387984831735),
    (3, 1.70675605663975, 2.31582447384325, -2.63366137253667, -10.35101467245920),
    (4, 0.41325331521125, 3.07910818603206, -1.42944427361326, -12.15861426576447),
    (5, -0.77534188219585, 4.46486771378823, -0.32286642900409, -14.07838969279822),
    (6, -1.52644486584142, 5.87673060598709, -0.00406690076970, -16.08537123098026),
    (7, -2.13875644258362, 7.19525913329805, 0.10268170574766, -18.15788466125262),
    (8, -2.69348683581097, 8.46037971396931, 0.14327879765713, -20.27940894394569),
    (9, -3.21675402252485, 9.69377351531791, 0.15790184030917, -22.43788559040858),
    (10, -3.72016840437287, 10.90681139476287, 0.16105338653172, -24.62459635017404),
)


@pytest.mark.parametrize(
    ("speed", "weave_real", "weave_imaginary", "capsize", "caster"), PUBLISHED_EIGENVALUES
)
def test_benchmark_eigenvalues_are_those_published_under_the_same_names(
    speed, weave_real, weave_imaginary, capsize, caster
):
    branches = follow_eigenvalues(benchmark_bicycle(), speed)
    found = branches.eigenvalues[0]
    expected = [
        complex(weave_real, weave_imaginary),
        complex(weave_real, -weave_imaginary),
        capsize,
        caster,
    ]
    # An eigenvalue solver's round-off is relative to the greatest eigenvalue: some hundred units.
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-13 * abs(caster))


def test_standing_benchmark_has_the_published_pendulum_roots():
    branches = follow_eigenvalues(benchmark_bicycle(), 0.0)
    expected = [5.53094371765393, 3.13164324790656, -3.13164324790656, -5.53094371765393]
    np.testing.assert_allclose(branches.eigenvalues[0], expected, rtol=0.0, atol=PUBLISHED_DIGITS)
    assert not branches.is_weave_oscillatory[0]


def test_benchmark_special_speeds_are_those_published():
    bicycle = benchmark_bicycle()
    (meeting,) = bicycle.double_roots()
    # Table 2 (a), 14 decimals.
    assert meeting.speed == pytest.approx(0.68428307889246, abs=PUBLISHED_DIGITS)
    assert meeting.eigenvalue == pytest.approx(3.78290405129320, abs=PUBLISHED_DIGITS)
    assert bicycle.weave_speed() == pytest.approx(4.29238253634111, abs=PUBLISHED_DIGITS)
    assert bicycle.capsize_speed() == pytest.approx(6.02426201538837, abs=PUBLISHED_DIGITS)
    ((_, frequency),) = bicycle.characteristic.imaginary_pairs()
    assert frequency == pytest.approx(3.43503384866144, abs=PUBLISHED_DIGITS)


# Published: the walking paper, from Schwab, Meijaard and Papadopoulos (2005)


def test_2005_parameters_give_every_printed_digit_of_eq_5():
    printed, computed = paper_bicycle(), benchmark_bicycle(parameters_2005())
    for name in ("mass_matrix", "damping_matrix", "static_stiffness", "dynamic_stiffness"):
        expected, found = getattr(printed, name), getattr(computed, name)
        # Five significant digits: at most half a unit of the fifth, 5e-5 of a number 1.xxxx.
        digits = 4 - np.floor(np.log10(np.where(expected == 0.0, 1.0, np.abs(expected))))
        unit = 10.0**-digits
        assert np.all(np.abs(found - expected) <= 0.5 * unit), name


@pytest.mark.parametrize("bicycle", [paper_bicycle(), benchmark_bicycle(parameters_2005())])
def test_special_speeds_are_the_papers(bicycle):
    # The paper prints one decimal.
    assert bicycle.double_root_speed() == pytest.approx(0.7, abs=0.05)
    assert bicycle.weave_speed() == pytest.approx(4.3, abs=0.05)
    assert bicycle.capsize_speed() == pytest.approx(6.1, abs=0.05)
    assert critical_speed(bicycle) == bicycle.weave_speed()
    assert stable_speed_range(bicycle) == (bicycle.weave_speed(), bicycle.capsize_speed())


def test_gravity_is_already_in_the_papers_static_stiffness():
    canonical = canonical_matrices(parameters_2005()).gravity_stiffness
    printed = paper_bicycle().static_stiffness
    np.testing.assert_allclose(printed, 9.81 * canonical, rtol=5e-5)  # five printed digits


def test_figure_4_has_two_positive_and_two_negative_roots_below_the_double_root():
    bicycle = paper_bicycle()
    meeting = bicycle.double_root_speed()
    assert meeting is not None
    values = bicycle.eigenvalues(np.linspace(0.0, 0.999 * meeting, 20))
    assert np.all(values.imag == 0.0)
    assert np.all(np.sum(values.real > 0.0, axis=1) == 2)
    assert np.sum(bicycle.eigenvalues(1.001 * meeting).imag != 0.0) == 2


def test_capsize_becomes_mildly_unstable_and_fades_while_weave_speeds_up_with_the_bicycle():
    branches = follow_eigenvalues(paper_bicycle(), [7.0, 10.0, 40.0, 80.0])
    assert np.all(branches.capsize.real > 0.0) and np.all(branches.capsize.real < 0.2)
    # "With further increase in speed, the capsize eigenvalue approaches zero."
    assert branches.capsize.real[3] < branches.capsize.real[2] < branches.capsize.real[1]
    # "The frequency of the weave motion is almost proportional to the forward speed": to 2 % here.
    slopes = branches.weave[:, 0].imag / branches.speeds
    assert slopes[3] == pytest.approx(slopes[2], rel=0.02)


# Special speeds and modes of any bicycle


@few
@given(parameters=bicycles)
def test_stable_range_is_stable_inside_and_unstable_below_and_just_above(parameters):
    bicycle = benchmark_bicycle(parameters)
    speeds = stable_speed_range(bicycle)
    grid = np.linspace(0.05, 30.0, 300)
    growth = np.max(bicycle.eigenvalues(grid).real, axis=1)
    if speeds is None:
        assert critical_speed(bicycle) == math.inf
        assert np.all(growth > 0.0)
        return
    assert critical_speed(bicycle) == speeds.lower
    # A millionth within and without the ends, so that the growth has a sign.
    inside = (grid > speeds.lower * (1 + 1e-6)) & (grid < speeds.upper * (1 - 1e-6))
    assert np.all(growth[inside] < 0.0)
    assert np.all(growth[grid < speeds.lower * (1 - 1e-6)] > 0.0)
    if math.isfinite(speeds.upper):
        assert np.max(bicycle.eigenvalues(speeds.upper * (1 + 1e-6)).real) > 0.0


@few
@given(parameters=bicycles)
def test_no_meeting_of_real_roots_is_missed_or_made_up(parameters):
    bicycle = benchmark_bicycle(parameters)
    for meeting in bicycle.double_roots():
        just_below, just_above = (
            np.sum(bicycle.eigenvalues(meeting.speed * (1 + side)).imag != 0.0)
            for side in (-1e-6, 1e-6)
        )
        assert abs(int(just_below) - int(just_above)) == 2
    grid = np.linspace(0.02, 30.0, 3000)
    oscillating = np.sum(bicycle.eigenvalues(grid).imag != 0.0, axis=1)
    changes = np.flatnonzero(np.diff(oscillating))
    meetings = np.array([meeting.speed for meeting in bicycle.double_roots()])
    for i in changes:
        assert np.any((meetings >= grid[i]) & (meetings <= grid[i + 1]))


# No trail and a fork that leans forward: four real eigenvalues at every speed
NO_OSCILLATION = replace(
    BENCHMARK_2007,
    wheelbase=1.25,
    trail=0.0,
    steer_axis_tilt=-0.0625,
    front_frame=replace(BENCHMARK_2007.front_frame, z=-0.525),
    front_wheel=replace(BENCHMARK_2007.front_wheel, radius=0.4375),
)
# Two real modes that come near each other below 0.1 m/s, where long and short steps once told them apart differently
CLOSE_MODES = replace(
    BENCHMARK_2007,
    wheelbase=0.953125,
    trail=0.0,
    steer_axis_tilt=0.01171875,
    rear_frame=replace(BENCHMARK_2007.rear_frame, mass=106.25, x=0.225, z=-1.0265625),
    front_frame=replace(BENCHMARK_2007.front_frame, mass=4.5, x=1.1671875, z=-0.896875),
    front_wheel=replace(BENCHMARK_2007.front_wheel, radius=0.415625),
)


@settings(max_examples=12)
@given(parameters=bicycles)
@example(parameters=CLOSE_MODES)
@example(parameters=NO_OSCILLATION)
def test_modes_followed_do_not_depend_on_the_grid(parameters):
    bicycle = benchmark_bicycle(parameters)
    fine = follow_eigenvalues(bicycle, np.linspace(0.0, 10.0, 201))
    coarse = follow_eigenvalues(bicycle, fine.speeds[::50][::-1])
    # The same matrices by the same steps, so the same numbers, in reverse order.
    np.testing.assert_array_equal(coarse.eigenvalues[::-1], fine.eigenvalues[::50])
    np.testing.assert_array_equal(coarse.mode_shapes[::-1], fine.mode_shapes[::50])


@pytest.mark.parametrize(
    "bicycle",
    [
        benchmark_bicycle(NO_OSCILLATION),
        LinearBicycle(np.eye(2), np.zeros((2, 2)), -np.eye(2), np.zeros((2, 2))),  # equal pairs
        LinearBicycle(np.eye(2), np.zeros((2, 2)), np.eye(2), np.zeros((2, 2))),  # two oscillations
        LinearBicycle(np.eye(2), np.eye(2), np.zeros((2, 2)), np.zeros((2, 2))),  # two zeros
        LinearBicycle(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), np.zeros((2, 2))),  # all zero
    ],
    ids=["no oscillation", "equal pairs", "two oscillations", "two zeros", "all zero"],
)
def test_a_bicycle_whose_modes_have_no_names_has_branches(bicycle):
    branches = follow_eigenvalues(bicycle, np.linspace(0.0, 10.0, 201))
    assert branches.names == UNNAMED_BRANCHES
    largest = np.max(np.abs(branches.eigenvalues))
    for speed, row in zip(branches.speeds, branches.eigenvalues, strict=True):
        # The same matrix by the same solver, only sorted in another way.
        np.testing.assert_array_equal(np.sort_complex(row)[::-1], bicycle.eigenvalues(speed)[0])
    # The benchmark's steepest branch rises by 1.4 / m over the grid's 0.05 m/s, a hundredth of 37 / s.
    assert np.all(np.abs(np.diff(branches.eigenvalues, axis=0)) <= 0.02 * largest)
    for name in ("weave", "capsize", "caster", "is_weave_oscillatory"):
        with pytest.raises(ValueError, match="this bicycle's modes have no names"):
            getattr(branches, name)


def test_modes_are_followed_continuously_through_the_double_root():
    bicycle = paper_bicycle()
    branches = follow_eigenvalues(bicycle, np.linspace(0.0, 10.0, 2001))
    assert branches.eigenvalues.shape == (2001, len(BRANCH_NAMES))
    jumps = np.abs(np.diff(branches.eigenvalues, axis=0))
    # Capsize and caster are smooth: their slope times the grid's 0.005 m/s. The weave has a square
    # root where its branches part, near 1.5 sqrt(dv) in SI units: 0.1 over one interval.
    assert np.max(jumps[:, 2:]) < 0.02
    assert np.max(jumps[:, :2]) < 0.2
    meeting = bicycle.double_root_speed()
    assert meeting is not None
    assert np.array_equal(branches.is_weave_oscillatory, branches.speeds > meeting)
    assert np.all(branches.weave[:, 0].imag >= 0.0)
    assert np.all(branches.capsize.imag == 0.0) and np.all(branches.caster.imag == 0.0)


def test_capsize_leans_and_caster_steers():
    shapes = np.abs(follow_eigenvalues(paper_bicycle(), [3.0, 5.0, 8.0]).mode_shapes)
    assert np.all(shapes[:, 2, 0] > shapes[:, 2, 1])
    assert np.all(shapes[:, 3, 1] > shapes[:, 3, 0])


def test_uncontrolled_bicycle_recovers_in_the_stable_range_and_falls_outside():
    bicycle, times = paper_bicycle(), [30.0, 60.0]
    # At 5 m/s the slowest mode decays by 0.3 to 0.4 per s: e^-9 at the least is left.
    assert abs(bicycle.motion(5.0, times, lean_rate=0.1).lean[0]) < 1e-3
    assert abs(bicycle.motion(4.0, times, lean_rate=0.1).lean[0]) > 1.0
    # At 8 m/s the weave has died out after 30 s (e^-80): what remains is capsizing alone.
    falling = bicycle.motion(8.0, times, lean_rate=0.1).lean
    capsize = follow_eigenvalues(bicycle, 8.0).capsize[0].real
    assert capsize > 0.0
    # Round-off of the rate, some 1e-14 relative to the caster's 20 per s, times 30 s.
    assert falling[1] / falling[0] == pytest.approx(math.exp(30.0 * capsize), rel=1e-9)


def test_bicycle_without_any_steering_torque_is_never_stable():
    bicycle = LinearBicycle(np.eye(2), np.zeros((2, 2)), -np.eye(2), np.zeros((2, 2)))
    assert bicycle.weave_speed() is None
    assert bicycle.capsize_speed() is None
    assert bicycle.double_root_speed() is None
    assert stable_speed_range(bicycle) is None
    assert critical_speed(bicycle) == math.inf


# Bad input


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: BicycleParameters(wheelbase=0.0), "wheelbase must be in"),
        (lambda: BicycleParameters(trail=math.nan), "trail must be a finite number"),
        (lambda: BicycleParameters(steer_axis_tilt=2.0), "steer_axis_tilt must be in"),
        (lambda: BicycleParameters(gravity=-9.81), "gravity must be in"),
        (lambda: Wheel(0.0, 1.0, 0.1, 0.1), "wheel radius must be in"),
        (lambda: Wheel(0.3, -1.0, 0.1, 0.1), "wheel mass must be in"),
        (lambda: Wheel(0.3, 1.0, 0.1, 0.3), "wheel inertia_yy must be in"),
        (lambda: FrameBody(-1.0, 0, 0, 1, 0, 1, 1), "frame mass must be in"),
        (lambda: FrameBody(1.0, 0, math.inf, 1, 0, 1, 1), "frame z must be a finite"),
        (lambda: FrameBody(1.0, 0, 0, 1, 0, 3, 1), "frame inertia is impossible"),
        (lambda: FrameBody(1.0, 0, 0, 1, 2, 1, 1), "frame inertia is impossible"),
        (
            lambda: BicycleParameters(
                front_frame=FrameBody(0.0, 0.9, -0.7, 0, 0, 0, 0),
                front_wheel=Wheel(0.35, 0.0, 0.0, 0.0),
            ),
            "mass of front_frame and front_wheel together must be in",
        ),
    ],
)
def test_impossible_bicycle_is_refused_by_name(build, message):
    with pytest.raises(ValueError, match=message):
        build()


@pytest.mark.parametrize(
    ("name", "matrix"),
    [
        ("mass_matrix", [[1.0, 2.0], [2.0, 1.0]]),
        ("mass_matrix", [[1.0, 0.5], [0.0, 1.0]]),
        ("damping_matrix", [1.0, 2.0]),
        ("static_stiffness", [[math.nan, 0.0], [0.0, 1.0]]),
        ("dynamic_stiffness", np.eye(3)),
    ],
)
def test_impossible_matrix_is_refused_by_name(name, matrix):
    with pytest.raises(ValueError, match=f"{name} must (be|have|hold)"):
        replace(paper_bicycle(), **{name: matrix})


def test_bad_arguments_are_refused_by_name():
    bicycle = paper_bicycle()
    with pytest.raises(ValueError, match="speeds must hold finite numbers, got nan"):
        bicycle.eigenvalues(math.nan)
    with pytest.raises(ValueError, match=r"speeds must hold numbers in \[0, inf\), got -1.0"):
        follow_eigenvalues(bicycle, [-1.0, 2.0])
    with pytest.raises(ValueError, match="steer must be a finite number"):
        bicycle.motion(1.0, [0.0], steer=math.inf)


def test_matrices_of_a_bicycle_cannot_be_changed():
    source = np.eye(2)
    bicycle = LinearBicycle(source, np.zeros((2, 2)), np.eye(2), np.zeros((2, 2)))
    source[0, 0] = 5.0
    assert bicycle.mass_matrix[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        bicycle.mass_matrix[0, 0] = 2.0
