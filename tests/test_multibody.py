"""The nine-coordinate model: laws of mechanics, massless limit, published numbers, bad input."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.multibody import (
    FALLS,
    MultibodyStep,
    MultibodyWalker,
    find_passive_gait,
    table3_c_eigenvalues,
)
from lean_yaw_env.multibody.dynamics import Offset, Shift, Stance
from lean_yaw_env.multibody.gait import Table3Column
from lean_yaw_env.multibody.kinematics import kinematics
from lean_yaw_env.parameters import WalkerParameters
from lean_yaw_env.walker import Walker

Array = NDArray[np.float64]

TABLE_1 = {"hip_width": 0.3, "foot_radius": 0.5, "ankle_tilt": 0.55, "slope": 0.01}
TABLE_2 = (0.001539, 0.155354, -0.004109, -0.415110, -0.070156)
"""The paper's Table 2 with more digits, the fixed point for left stance at foot mass zero.

The second entry is the leg's pitch u4, 4e-6 less than the foot's; the fourth is the rate of the
foot's pitch (that of u4 is -0.415252).
"""
UNEVEN = (0.2, 0.17, -0.02, -0.45, -0.03)
"""A state off the gait and off the slope's direction, so that nothing vanishes by symmetry."""
MIRROR = np.array([-1.0, 1.0, -1.0, 1.0, -1.0])
UP = np.array([0.0, 1.0, 0.0])

nearby = st.tuples(*(st.floats(1.0 - 0.2, 1.0 + 0.2) for _ in range(5)))
headings = st.floats(-0.4, 0.4)


def walker(foot_mass: float = 1e-3, **changes: float) -> MultibodyWalker:
    return MultibodyWalker(**{**TABLE_1, **changes}, foot_mass=foot_mass)


def compiled_parameters(**changes: float) -> WalkerParameters:
    values = {**TABLE_1, **changes}
    return WalkerParameters(
        values["hip_width"], values["foot_radius"], values["ankle_tilt"], values["slope"]
    )


def floor_axes(heading: float) -> tuple[Array, Array]:
    """Rolling direction and the foot's cylinder axis."""
    c, s = np.cos(heading), np.sin(heading)
    return np.array([c, 0.0, -s]), np.array([s, 0.0, c])


@dataclass(frozen=True)
class Motion:
    """The point masses of a left step, put together here from the nine coordinates alone."""

    body: MultibodyWalker
    heading: float
    step: MultibodyStep
    shift: Shift

    @property
    def time(self) -> Array:
        assert self.step.trajectory is not None
        return self.step.trajectory.time

    @property
    def frames(self) -> tuple[Rotation, Rotation, Rotation]:
        """Axle, right leg, left leg."""
        assert self.step.trajectory is not None
        q = self.step.trajectory.coordinates
        return (
            Rotation.from_euler("YX", q[:, 3:5]),
            Rotation.from_euler("YXZ", q[:, [3, 4, 5]]),
            Rotation.from_euler("YXZ", q[:, [3, 4, 6]]),
        )

    @property
    def axle(self) -> Array:
        return self.frames[0].apply([0.0, 0.0, 1.0])

    @property
    def positions(self) -> Array:
        """Right hip mass, left hip mass, right foot, left foot: shape (4, n, 3)."""
        assert self.step.trajectory is not None
        centre = self.step.trajectory.coordinates[:, :3]
        half = self.body.hip_width / 2 * self.axle
        moved = np.array([self.shift.at(t).value for t in self.time])[:, None] * self.axle
        right, left = centre + half, centre - half
        _, right_leg, left_leg = self.frames
        feet = (right - right_leg.apply(UP), left - left_leg.apply(UP))
        return np.array([right + moved, left + moved, *feet])

    @property
    def forces(self) -> Array:
        """What must act on each mass beside its weight, shape (4, n, 3)."""
        # Degree 7 through about 80 samples: inside, the second derivative is good to about 1e-8.
        second = make_interp_spline(self.time, self.positions, k=7, axis=1).derivative(2)(self.time)
        gravity = [np.sin(self.body.slope), -np.cos(self.body.slope), 0.0]
        masses = np.array([0.5, 0.5, self.body.foot_mass, self.body.foot_mass])
        return masses[:, None, None] * (second - np.array(gravity))

    @property
    def contact(self) -> Array:
        """Where the left foot touches the floor: under the cylinder's centre, shape (n, 3)."""
        assert self.step.trajectory is not None
        tilt = self.body.ankle_tilt
        axis = np.array([np.sin(tilt), -np.cos(tilt), 0.0])
        ankle = self.step.trajectory.coordinates[:, 8]
        foot = self.frames[2] * Rotation.from_rotvec(-ankle[:, None] * axis)
        return self.positions[3] + self.body.foot_radius * (foot.apply(UP) - UP)


def motion(
    state: tuple[float, ...] = UNEVEN,
    body: MultibodyWalker | None = None,
    shift_from: float | None = None,
    **options: Any,
) -> Motion:
    body = walker() if body is None else body
    step = body.step(state, trajectory=True, previous_offset=shift_from, **options)
    target = options.get("mass_offset", 0.0)
    start = target if shift_from is None else shift_from
    return Motion(body, state[0], step, Shift(start, target, body.shift_time))


INSIDE = slice(6, -6)
"""Samples away from the ends, where a spline's derivative loses digits."""


def reported(moved: Motion, name: str) -> Array:
    assert moved.step.trajectory is not None
    return np.array([getattr(force, name) for force in moved.step.trajectory.forces])[INSIDE]


# Laws of mechanics


@pytest.mark.parametrize(
    "options",
    [{}, {"inter_leg_angle": -0.3, "swing": "passive", "swing_rate": 0.5}, {"mass_offset": 0.03}],
    ids=["held", "passive", "offset"],
)
def test_contact_forces_balance_the_momentum_of_the_masses(options: dict[str, Any]) -> None:
    moved = motion(**options)
    total = moved.forces.sum(axis=0)[INSIDE]
    ahead, across = floor_axes(moved.heading)
    # The spline's error, about 1e-7 where the integrator's samples are widest.
    for name, direction in (("normal", UP), ("forward", ahead), ("lateral", across)):
        np.testing.assert_allclose(total @ direction, reported(moved, name), atol=1e-6)


@pytest.mark.parametrize("foot_radius", [0.0, 0.5])
def test_foot_torques_balance_angular_momentum_and_the_foot_rolls_freely(
    foot_radius: float,
) -> None:
    moved = motion(body=walker(foot_radius=foot_radius))
    arms = moved.positions - moved.contact
    torque = np.cross(arms, moved.forces).sum(axis=0)[INSIDE]
    ahead, across = floor_axes(moved.heading)
    # The spline's error, as above.
    np.testing.assert_allclose(torque @ UP, reported(moved, "yaw_torque"), atol=1e-6)
    np.testing.assert_allclose(torque @ ahead, reported(moved, "roll_torque"), atol=1e-6)
    np.testing.assert_allclose(torque @ across, 0.0, atol=1e-6)


def test_hip_torque_is_what_the_swing_foot_needs_to_stay_put() -> None:
    moved = motion(body=walker(foot_mass=1e-2))
    swing_hip = moved.positions[0]
    lever = moved.positions[2] - swing_hip
    torque = (np.cross(lever, moved.forces[2]) * moved.axle).sum(axis=1)[INSIDE]
    # The spline's error times the foot mass.
    np.testing.assert_allclose(torque, reported(moved, "hip_torque"), atol=1e-8)
    assert np.abs(torque).max() > 1e-4


def test_swing_foot_stays_over_the_floor_and_lands_where_the_contact_is_reported() -> None:
    moved = motion()
    assert moved.step.trajectory is not None
    swing_pivot = moved.positions[2]
    assert swing_pivot[:-1, 1].min() > 0.0
    after = moved.step.state
    ahead, _ = floor_axes(after[0])
    radius, pitch = moved.body.foot_radius, after[1]
    # The pivot from the contact: centre C = P0 - r pitch h + r n, then down to the sole.
    sole = -radius * (np.cos(pitch) * UP - np.sin(pitch) * ahead)
    contact = np.array([moved.step.displacement[0], 0.0, moved.step.displacement[1]])
    expected = contact - radius * pitch * ahead + radius * UP + sole
    # Round-off of positions of order one, and the integrator's 1e-11.
    np.testing.assert_allclose(swing_pivot[-1], expected, atol=1e-11)


@settings(max_examples=12)
@given(nearby, headings, st.sampled_from(["left", "right"]), st.floats(-0.03, 0.03))
def test_stance_keeps_energy_and_constraints_and_impact_takes_energy(
    factors: tuple[float, ...], heading: float, stance: str, offset: float
) -> None:
    state = np.array(TABLE_2) * factors
    state[0] += heading
    step = walker().step(state, stance=stance, mass_offset=offset, inter_leg_angle=0.25)
    start, before, after = step.energies
    # A relative tolerance of 1e-11 a step of the integrator, some ten of them.
    assert abs(before - start) < 1e-10
    assert step.constraint_residual < 1e-10
    if step.fall is None:
        assert after < before
        assert step.impulse is not None and step.impulse.normal > 0.0
    else:
        assert step.fall in FALLS


@settings(max_examples=8)
@given(nearby, headings, st.floats(-0.03, 0.03))
def test_a_mirrored_walker_walks_a_mirrored_step(
    factors: tuple[float, ...], heading: float, offset: float
) -> None:
    state = np.array(TABLE_2) * factors
    state[0] += heading
    left = walker().step(state, mass_offset=offset)
    right = walker().step(MIRROR * state, stance="right", mass_offset=-offset)
    assert left.fall == right.fall
    # Two runs of the same integrator on mirrored numbers: round-off, amplified by a step.
    np.testing.assert_allclose(MIRROR * right.state, left.state, atol=1e-11)
    np.testing.assert_allclose(
        right.displacement, np.array([1, -1]) * left.displacement, atol=1e-11
    )


def test_on_the_level_every_direction_is_the_same() -> None:
    level = walker(slope=0.0)
    turned = np.add(UNEVEN, (1.3, 0.0, 0.0, 0.0, 0.0))
    here, there = level.step(UNEVEN), level.step(turned)
    # Round-off and the integrator's error, which differs as the coordinates do.
    np.testing.assert_allclose(
        np.array(there.state) - [1.3, 0.0, 0.0, 0.0, 0.0], here.state, atol=1e-10
    )
    assert there.duration == pytest.approx(here.duration, abs=1e-10)


def test_moving_the_mass_does_the_work_that_its_drive_puts_in() -> None:
    moved = motion(TABLE_2, shift_from=-0.02, mass_offset=0.02)
    assert moved.step.trajectory is not None
    is_shifting = (moved.time > 0.02) & (moved.time < 0.33)
    energy = make_interp_spline(moved.time, moved.step.trajectory.energies.sum(axis=1), k=5)
    drive = (moved.forces[:2].sum(axis=0) * moved.axle).sum(axis=1)
    rate = np.array([moved.shift.at(t).rate for t in moved.time])
    power = (drive * rate)[is_shifting]
    # The path's third derivative jumps at the end of the shift; a spline rings by about 1e-5.
    np.testing.assert_allclose(power, energy.derivative()(moved.time)[is_shifting], atol=1e-4)
    assert np.abs(power).max() > 1e-2


def test_derivatives_by_sympy_agree_with_differences_of_what_they_derive() -> None:
    rng = np.random.default_rng(7)
    q, v = rng.uniform(-0.4, 0.4, (2, 9))
    place_kwargs: dict[str, Any] = {
        "side": -1.0,
        "hip_width": 0.3,
        "foot_radius": 0.5,
        "ankle_tilt": 0.55,
        "heading": 0.3,
        "contact": (0.2, -0.1),
    }

    def at(coordinates: Array) -> tuple[Array, Array]:
        here = kinematics(coordinates, v, **place_kwargs)
        return here.values, here.jacobian

    h = 1e-5
    # Central differences: truncation h^2, round-off 1e-16 / h.
    for j in range(9):
        e = h * np.eye(9)[j]
        np.testing.assert_allclose(
            (at(q + e)[0] - at(q - e)[0]) / (2 * h), at(q)[1][:, j], atol=1e-9
        )
    along = (at(q + h * v)[1] - at(q - h * v)[1]) / (2 * h) @ v
    np.testing.assert_allclose(along, kinematics(q, v, **place_kwargs).bias, atol=1e-9)


# Impact


def impact_case() -> tuple[Stance, Array]:
    stance = Stance(walker(foot_mass=1e-2), -1.0, 0.2)
    y = stance.placed((0.15, 0.02, 0.0, 0.0), -0.3, 0.0)
    y[8:] = np.random.default_rng(3).uniform(-0.5, 0.5, 8)
    return stance, y


def test_impact_changes_momentum_by_the_new_contacts_impulse_only() -> None:
    stance, y = impact_case()
    after, impulse = stance.impact(y, Offset())
    here = stance.kinematics(y)
    change = stance.body.masses * (here.jacobian[:12, :8] @ (after - y)[8:])
    ahead, across = floor_axes(stance.heading)
    expected = impulse.normal * UP + impulse.lateral * across + impulse.forward * ahead
    # Round-off of a 13 by 13 solve.
    np.testing.assert_allclose(change.reshape(4, 3).sum(axis=0), expected, atol=1e-12)
    centre_to_contact = -stance.body.foot_radius * 0.15 * ahead
    arms = here.values[:12].reshape(4, 3) - centre_to_contact
    moment = np.cross(arms, change.reshape(4, 3)).sum(axis=0)
    # About the new contact's cylinder axis nothing acts: that component of angular momentum stays.
    assert abs(moment @ across) < 1e-12
    assert moment @ UP == pytest.approx(impulse.yaw_torque, abs=1e-12)


def test_impact_leaves_the_new_foot_rolling_and_a_second_impact_does_nothing() -> None:
    stance, y = impact_case()
    after, _ = stance.impact(y, Offset())
    # Round-off of the solve.
    contact = stance.kinematics(after).jacobian[12:17, :8]
    np.testing.assert_allclose(contact @ after[8:], 0.0, atol=1e-13)
    again, impulse = stance.impact(after, Offset())
    np.testing.assert_allclose(again, after, atol=1e-12)
    np.testing.assert_allclose(list(vars(impulse).values()), 0.0, atol=1e-12)


def test_heel_strike_in_mid_shift_locks_the_masses_where_they_are() -> None:
    slow = MultibodyWalker(**TABLE_1, shift_time=2.0)
    step = slow.step(TABLE_2, previous_offset=0.0, mass_offset=0.01)
    assert step.fall is None
    # Strike at 0.72 of 2.0: the blend is at 0.25.
    assert step.mass_offset == pytest.approx(Shift(0.0, 0.01, 2.0).at(step.duration).value)
    assert 0.001 < step.mass_offset < 0.005


# The massless limit


def half_as_heavy_ratio(values: list[Array]) -> Array:
    """(f(4m) - f(2m)) / (f(2m) - f(m)): two for a first-order approach to the limit."""
    return (values[0] - values[1]) / (values[1] - values[2])


def test_stance_and_forces_approach_the_massless_limit_at_first_order() -> None:
    values = []
    for mass in (4e-5, 2e-5, 1e-5):
        body = walker(mass)
        force = body.contact_forces(UNEVEN)
        numbers = (force.normal, force.forward, force.lateral, force.yaw_torque, force.hip_torque)
        values.append(np.array([*body.stance_accelerations(UNEVEN), *numbers]))
    # Second-order remainder: some factors of ten times the mass.
    np.testing.assert_allclose(half_as_heavy_ratio(values), 2.0, rtol=5e-3)


def test_heel_strike_and_impact_approach_the_massless_limit_at_first_order() -> None:
    values = []
    for mass in (4e-5, 2e-5, 1e-5):
        step = walker(mass).step(UNEVEN)
        values.append(np.array([*step.state, step.duration, *step.displacement]))
    # Second-order remainder, as above; the integrator's 1e-11 over differences of 1e-5 adds 1e-6.
    np.testing.assert_allclose(half_as_heavy_ratio(values), 2.0, rtol=2e-2)


def test_passive_step_approaches_the_massless_limit_at_first_order() -> None:
    state = (0.0, 0.153, 0.004, -0.1222, 0.003, 0.0028)
    values = []
    for mass in (4e-5, 2e-5, 1e-5):
        body = walker(mass, hip_width=0.0, ankle_tilt=0.15, slope=0.00058)
        step = body.step(state, swing="passive", inter_leg_angle=-0.306)
        values.append(np.array([*step.state, step.inter_leg_angle, step.duration]))
    # Second-order remainder: lateral motion is sensitive here, with the ankle axis near vertical.
    np.testing.assert_allclose(half_as_heavy_ratio(values), 2.0, rtol=5e-2)


def held_gait(foot_mass: float) -> Array:
    body = walker(foot_mass)

    def change(state: Array) -> Array:
        return MIRROR * body.step(state).state - state

    # Differences of 1e-6: the integrator's 1e-11 leaves five digits of the Jacobian.
    found = root(change, TABLE_2, options={"eps": 1e-6, "xtol": 1e-12})
    assert np.abs(found.fun).max() < 1e-10
    return found.x


def test_gait_of_table_2_is_the_massless_limit_of_the_gait() -> None:
    rows = []
    for mass in (1e-5, 2e-5):
        gait = held_gait(mass)
        step = walker(mass).step(gait, trajectory=True)
        assert step.trajectory is not None
        leg_pitch = step.trajectory.coordinates[0, 6]
        rows.append(np.array([gait[0], leg_pitch, *gait[2:]]))
    # Six published decimals; the second-order remainder is about 1e-7.
    np.testing.assert_allclose(2.0 * rows[0] - rows[1], TABLE_2, atol=1e-6)


def massless(values: list[Array]) -> Array:
    """Limit of values at masses 4m, 2m and m, the first two orders of the mass removed."""
    return (values[0] - 6.0 * values[1] + 8.0 * values[2]) / 3.0


@pytest.mark.parametrize(
    ("state", "options"),
    [
        (UNEVEN, {}),
        (TABLE_2, {"stance": "right", "inter_leg_angle": 0.25}),
        (UNEVEN, {"mass_offset": 0.03, "inter_leg_angle": 0.4}),
        (TABLE_2, {"mass_offset": 0.02, "previous_offset": -0.01}),
    ],
    ids=["left", "right", "offset", "shift"],
)
@pytest.mark.parametrize("changes", [{}, {"hip_width": 0.0, "foot_radius": 0.0, "slope": 0.03}])
def test_the_massless_limit_is_the_compiled_walkers_step(
    state: tuple[float, ...], options: dict[str, Any], changes: dict[str, float]
) -> None:
    steps = [walker(mass, **changes).step(state, **options) for mass in (4e-5, 2e-5, 1e-5)]
    compiled = Walker(compiled_parameters(**changes)).step(state, **options)
    assert compiled.fall is None and [step.fall for step in steps] == [None] * 3
    limit = massless([np.array([*s.state, s.duration, *s.displacement]) for s in steps])
    expected = [*compiled.state, compiled.duration, *compiled.displacement]
    # Third-order remainder far under round-off; both integrators' 1e-10, times the weights' 5.
    np.testing.assert_allclose(limit, expected, atol=1e-9)


def test_the_massless_limit_of_a_heel_strike_in_mid_shift_is_the_compiled_walkers() -> None:
    shift: dict[str, Any] = {"previous_offset": -0.02, "mass_offset": 0.02}
    steps = [
        MultibodyWalker(**TABLE_1, foot_mass=mass, shift_time=1.4).step(TABLE_2, **shift)
        for mass in (4e-5, 2e-5, 1e-5)
    ]
    compiled = Walker(replace(compiled_parameters(), shift_time=1.4)).step(TABLE_2, **shift)
    limit = massless([np.array([*s.state, s.duration, s.mass_offset]) for s in steps])
    # As above.
    expected = [*compiled.state, compiled.duration, compiled.mass_offset]
    np.testing.assert_allclose(limit, expected, atol=1e-9)


@pytest.mark.parametrize("stance", ["left", "right"])
def test_the_massless_limit_has_the_compiled_walkers_contact_forces(stance: str) -> None:
    values = []
    for mass in (4e-5, 2e-5, 1e-5):
        force = walker(mass).contact_forces(UNEVEN, stance=stance, mass_offset=0.02)
        values.append(np.array([force.normal, force.friction_demand, force.yaw_torque]))
    compiled = Walker(compiled_parameters()).stance_motion(
        UNEVEN, duration=0.1, stance="left" if stance == "left" else "right", mass_offset=0.02
    )
    expected = [compiled[name][0] for name in ("normal_force", "friction_demand", "yaw_torque")]
    # Two linear solves at one instant: round-off, and a third-order remainder below it.
    np.testing.assert_allclose(massless(values), expected, atol=1e-10)


# Published numbers


@cache
def column_c(foot_mass: float) -> Table3Column:
    return table3_c_eigenvalues(foot_mass)


def test_simplest_walker_has_the_gait_of_garcia_and_others() -> None:
    # Garcia, Chatterjee, Ruina, Coleman 1998, slope 0.009, long period; foot mass zero.
    guess = np.array([0.0, 0.2003, 0.0, -0.1998, 0.0, 0.0158, -0.4006])
    light, heavy = (
        find_passive_gait(
            MultibodyWalker(0.0, 0.0, 0.15, 0.009, foot_mass=mass), guess, residual=1e-10
        ).state
        for mass in (1e-5, 2e-5)
    )
    limit = 2.0 * light - heavy
    # Second-order remainder at a mass of 1e-5.
    assert limit[1] == pytest.approx(0.20031090049483, abs=2e-8)
    assert limit[3] == pytest.approx(-0.19983247291764, abs=2e-8)


def test_table_3_fore_aft_pair_comes_out_and_the_lateral_pair_is_of_the_massless_limit() -> None:
    light = column_c(1e-4)
    # The paper's 0.69 and 0.12, two digits each.
    np.testing.assert_allclose(light.fore_aft.real[:2], [0.69, 0.12], atol=5e-3)
    np.testing.assert_allclose(light.fore_aft[2:], 0.0, atol=1e-6)
    limit = 2.0 * light.lateral.real - column_c(2e-4).lateral.real
    # The massless walker's pair to the digits known; differences are good to 1e-6 here.
    np.testing.assert_allclose(limit[:2], [0.785, 0.463], atol=5e-4)
    assert abs(limit[2]) < 1e-3


def test_foot_mass_moves_the_first_lateral_eigenvalue_away_from_the_papers() -> None:
    # The paper: 0.72 and 0.51. Mass makes the first larger still, and spoils 0.69 and 0.12.
    light, heavy = column_c(1e-4), column_c(1e-2)
    assert 0.78 < light.lateral[0].real < heavy.lateral[0].real
    assert light.lateral[1].real < 0.51 < heavy.lateral[1].real
    assert heavy.fore_aft[0].real > 0.70 and heavy.fore_aft[1].real < 0.10


# Falls


@pytest.mark.parametrize(
    ("changes", "state", "fall"),
    [
        ({"hip_width": 0.0}, (0.0, 0.155, 0.0, -0.05, 0.0), "backward"),
        ({}, (0.0, 0.155, 0.0, -1.5, 0.0), "lift-off"),
        ({}, (0.0, 0.155, 0.5, -0.4, 0.0), "trip"),
        ({"ankle_tilt": 1.5}, (0.0, 0.05, -0.1, -0.1, -0.2), "sideways"),
    ],
)
def test_a_fall_is_named_and_leaves_the_stance_foot(
    changes: dict[str, float], state: tuple[float, ...], fall: str
) -> None:
    step = walker(**changes).step(state)
    assert step.fall == fall
    assert step.stance == "left" and step.impulse is None and step.displacement == (0.0, 0.0)


def test_no_gait_near_the_guess_is_a_named_error() -> None:
    with pytest.raises(NoGaitError, match=r"Newton's method from .* fell: "):
        find_passive_gait(walker(hip_width=0.0), np.array([0.0, 0.15, 0.0, -0.02, 0.0, 0.0, -0.3]))


# Bad input


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("hip_width", -0.1, r"\[0, inf\)"),
        ("hip_width", float("nan"), r"\[0, inf\)"),
        ("foot_radius", 1.0, r"\[0, 1\)"),
        ("ankle_tilt", 0.0, r"\(0, 1.5708\]"),
        ("slope", 1.6, r"\(-1.5708, 1.5708\)"),
        ("foot_mass", 0.0, r"\(0, inf\)"),
        ("shift_time", 0.0, r"\(0, inf\)"),
        ("tolerance", 1e-15, r"\[1e-13, 0.001\]"),
    ],
)
def test_a_bad_parameter_is_refused_by_name(name: str, value: float, allowed: str) -> None:
    with pytest.raises(ValueError, match=f"{name} must be .*{allowed}.*{value!r}"):
        MultibodyWalker(**{**TABLE_1, name: value})


@pytest.mark.parametrize(
    ("state", "options", "message"),
    [
        (TABLE_2, {"stance": "middle"}, "stance must be one of left, right, got 'middle'"),
        (TABLE_2, {"swing": "kicked"}, "swing must be one of held, passive, got 'kicked'"),
        (TABLE_2[:4], {}, "state of a held step must have 5 entries, got 4"),
        ((0.0, float("nan"), 0.0, -0.4, 0.0), {}, "state must hold finite numbers, got nan"),
        (TABLE_2, {"inter_leg_angle": -0.3}, r"must be in \(0, 3.14159\), got -0.3"),
        (TABLE_2, {"mass_offset": float("inf")}, "mass_offset must be a finite number, got inf"),
        (TABLE_2, {"swing_rate": 0.1}, "swing_rate is for a passive leg, got 0.1"),
        (TABLE_2, {"swing": "passive"}, "a passive step needs a state of 6 entries"),
        (
            (*TABLE_2, 0.0),
            {"swing": "passive", "swing_rate": 0.1},
            "a passive step needs a state of 6 entries",
        ),
    ],
)
def test_a_bad_argument_is_refused_with_its_value(
    state: tuple[float, ...], options: dict[str, Any], message: str
) -> None:
    for method in (walker().step, walker().contact_forces, walker().stance_accelerations):
        with pytest.raises(ValueError, match=message):
            method(state, **options)


def test_a_guess_of_the_wrong_shape_is_refused() -> None:
    with pytest.raises(ValueError, match=r"guess must have shape \(7,\), got \(6,\)"):
        find_passive_gait(walker(), np.zeros(6))
