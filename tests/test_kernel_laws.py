"""Laws of mechanics that the walking step must obey, checked by the second version in ``tests.reference``."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lean_yaw_env import Walker, WalkerParameters
from lean_yaw_env.parameters import MIRROR, Foot, Vector
from lean_yaw_env.walker import OTHER_FOOT, SIDE, StepResult
from tests.reference import ReferenceWalker, X, rotation

CASES = tuple(range(12))


class Case:
    """A random walker, command and state that walks a step: around Table 1's gait, each coordinate +-50 %."""

    def __init__(self, seed: int, gait: Vector, *, shifts: bool = False, springs: bool = False):
        rng = np.random.default_rng(seed)
        self.parameters = WalkerParameters(
            hip_width=rng.uniform(0.0, 0.5),
            foot_radius=rng.uniform(0.0, 0.8),
            ankle_tilt=rng.uniform(0.4, 0.8),
            slope=rng.uniform(0.0, 0.05),
            ankle_stiffness=rng.uniform(0.0, 0.03) if springs else 0.0,
            ankle_damping=rng.uniform(0.0, 0.03) if springs else 0.0,
        )
        self.state = gait * rng.uniform(0.5, 1.5, 5)
        self.state[3] -= 0.1
        self.stance: Foot = "left" if rng.random() < 0.5 else "right"
        self.offset = rng.uniform(-0.05, 0.05)
        self.previous = self.offset + (rng.uniform(-0.04, 0.04) if shifts else 0.0)
        self.inter_leg_angle = rng.uniform(0.2, 0.4)
        self.walker = Walker(self.parameters)
        self.result = self.step(self.parameters)
        names = ("hip_width", "foot_radius", "ankle_tilt", "slope", "ankle_stiffness")
        self.reference = ReferenceWalker(
            **{name: getattr(self.parameters, name) for name in (*names, "ankle_damping")},
            shift_time=self.parameters.shift_time,
        )
        self.side = SIDE[self.stance]

    def step(self, parameters: WalkerParameters) -> StepResult:
        result = Walker(parameters).step(
            self.state,
            stance=self.stance,
            inter_leg_angle=self.inter_leg_angle,
            mass_offset=self.offset,
            previous_offset=self.previous,
        )
        assert result.fall is None
        return result

    def motion(self, samples: int = 60) -> dict[str, Vector]:
        return self.walker.stance_motion(
            self.state,
            duration=self.result.duration,
            samples=samples,
            stance=self.stance,
            inter_leg_angle=self.inter_leg_angle,
            mass_offset=self.offset,
            previous_offset=self.previous,
        )

    def velocities_before_strike(self) -> Vector:
        """Of both hip masses, the old stance hip first; shape (6,)."""
        end = {name: values[-1] for name, values in self.motion().items()}
        offset, rate, _ = self.reference.shift(self.result.duration, self.previous, self.offset)
        q = [end["stance_pitch"], end["ankle_angle"], offset]
        rates = [end["stance_pitch_rate"], end["ankle_rate"], rate]
        return self.reference.jacobian(self.state[0], q, self.side) @ rates

    def jacobian_after_strike(self) -> Vector:
        """Of both hip masses by pitch and ankle, the old stance hip first; shape (6, 2)."""
        heading, pitch, ankle = self.result.state[:3]
        q = [pitch, ankle, self.result.mass_offset]
        columns = self.reference.jacobian(heading, q, -self.side)[:, :2]
        return np.concatenate([columns[3:], columns[:3]])


def _kinetic(velocities: Vector) -> float:
    return 0.25 * float(velocities @ velocities)  # each hip mass is one half


@pytest.mark.parametrize("seed", CASES)
def test_energy_is_constant_in_stance_without_a_shift(seed: int, gait: Vector) -> None:
    energy = Case(seed, gait).motion()["mechanical_energy"]
    assert np.ptp(energy) < 1e-13  # rounding of numbers near one


@pytest.mark.parametrize("seed", CASES[:4])
def test_a_spring_takes_what_the_ledger_says_and_a_damper_only_takes(
    seed: int, gait: Vector
) -> None:
    case = Case(seed, gait, springs=True)
    motion = case.motion(400)
    stored = 0.5 * case.parameters.ankle_stiffness * motion["ankle_angle"] ** 2
    energy = motion["mechanical_energy"] + stored
    assert (np.diff(energy) < 1e-15).all()
    lost = motion["mechanical_energy"][0] - motion["mechanical_energy"][-1]
    # the damper's loss is integrated beside the motion, without an error control of its own
    assert case.result.energy.ankle_loss == pytest.approx(lost, abs=1e-9)


@pytest.mark.parametrize("seed", CASES[:6])
def test_the_shift_s_work_is_the_force_on_the_masses_along_the_axle_times_their_path(
    seed: int, gait: Vector
) -> None:
    case = Case(seed, gait, shifts=True)
    r = case.reference

    def rates(time: float, y: Vector) -> Vector:
        acceleration, bias, j = r.motion(
            case.state[0], time, y[:4], case.previous, case.offset, case.side
        )
        force = 0.5 * (j[:, :2] @ acceleration + bias - np.tile(r.gravity, 2))
        rate = r.shift(time, case.previous, case.offset)[1]
        return np.array([*y[2:4], *acceleration, rate * (j[:, 2] @ force)])

    end = min(case.result.duration, r.shift_time)
    start = np.append(case.state[1:], 0.0)
    work = solve_ivp(rates, (0.0, end), start, "DOP853", rtol=1e-10, atol=1e-12).y[4, -1]
    # solve_ivp's own error
    assert case.result.energy.shift_work == pytest.approx(work, abs=1e-9)


@pytest.mark.parametrize("shifts", [False, True])
@pytest.mark.parametrize("seed", CASES)
def test_the_ledger_closes_between_the_kinetic_energies_of_two_heel_strikes(
    seed: int, shifts: bool, gait: Vector
) -> None:
    case = Case(seed, gait, shifts=shifts, springs=True)
    q = [*case.state[1:3], case.previous]
    first = case.reference.jacobian(case.state[0], q, case.side)[:, :2] @ case.state[3:]
    last = case.jacobian_after_strike() @ case.result.state[3:]
    gravity, shift, impact, ankle = case.result.energy
    # the step's own accuracy
    assert _kinetic(last) - _kinetic(first) == pytest.approx(
        gravity + shift - impact - ankle, abs=1e-10
    )
    assert (shift != 0.0) == shifts


@pytest.mark.parametrize("seed", CASES)
def test_gravity_s_work_is_how_far_the_masses_come_down(seed: int, gait: Vector) -> None:
    case = Case(seed, gait, shifts=True)
    r, state, end = case.reference, case.state, case.result.state
    before = r.masses(*state[:3], case.previous, case.side).reshape(2, 3).mean(axis=0)
    after = r.masses(*end[:3], case.result.mass_offset, -case.side).reshape(2, 3).mean(axis=0)
    dx, dz = case.result.displacement
    way = after + np.array([dx, 0.0, dz]) - before
    # the masses stay where they are at heel strike, so the new stance's geometry must agree with the old one's
    assert case.result.energy.gravity_work == pytest.approx(r.gravity @ way, abs=1e-11)


@pytest.mark.parametrize("shifts", [False, True])
@pytest.mark.parametrize("seed", CASES)
def test_impact_conserves_momentum_allowed_by_the_new_contact(
    seed: int, shifts: bool, gait: Vector
) -> None:
    case = Case(seed, gait, shifts=shifts)
    allowed = case.jacobian_after_strike()
    change = allowed @ case.result.state[3:] - case.velocities_before_strike()
    # the step's own accuracy
    assert np.abs(allowed.T @ change).max() < 1e-10
    assert np.abs(change).max() > 1e-3


@pytest.mark.parametrize("seed", CASES)
def test_impact_loses_the_energy_of_the_velocities_it_takes(seed: int, gait: Vector) -> None:
    case = Case(seed, gait, shifts=True)
    before = case.velocities_before_strike()
    after = case.jacobian_after_strike() @ case.result.state[3:]
    assert case.result.energy.impact_loss > 0.0
    assert case.result.energy.impact_loss == pytest.approx(
        _kinetic(before) - _kinetic(after), abs=1e-10
    )
    # Carnot's theorem for a plastic impact: what is lost is the energy of the lost velocities
    assert case.result.energy.impact_loss == pytest.approx(_kinetic(before - after), abs=1e-10)


@pytest.mark.parametrize("seed", CASES)
def test_a_mirrored_start_walks_the_mirror_image_to_the_last_bit(seed: int, gait: Vector) -> None:
    case = Case(seed, gait, shifts=True, springs=True)
    mirrored = case.walker.step(
        case.state * MIRROR,
        stance=OTHER_FOOT[case.stance],
        inter_leg_angle=case.inter_leg_angle,
        mass_offset=-case.offset,
        previous_offset=-case.previous,
    )
    assert (mirrored.state == case.result.state * MIRROR).all()
    assert (mirrored.displacement == case.result.displacement * [1.0, -1.0]).all()
    assert mirrored.duration == case.result.duration
    assert mirrored.stance == OTHER_FOOT[case.result.stance]
    assert mirrored.energy == case.result.energy
    assert mirrored.heading_change == -case.result.heading_change


@pytest.mark.parametrize("change", [{"slope": 0.0}, {"slope_turns": True}])
@pytest.mark.parametrize("seed", CASES[:4])
def test_where_every_heading_is_like_any_other_a_turned_start_walks_the_turned_step(
    seed: int, change: dict[str, object], gait: Vector
) -> None:
    case = Case(seed, gait, shifts=True)
    parameters = replace(case.parameters, **change)  # pyright: ignore[reportArgumentType]
    straight = case.step(parameters)
    turn = 2.7
    case.state[0] += turn
    turned = case.step(parameters)
    # one rounding of numbers near three
    assert turned.state[0] == pytest.approx(straight.state[0] + turn, abs=1e-14)
    assert np.abs(turned.state[1:] - straight.state[1:]).max() < 1e-13
    direction = rotation([0.0, 1.0, 0.0], turn)
    dx, dz = straight.displacement
    expected = direction @ (dx * X + dz * np.array([0.0, 0.0, 1.0]))
    assert np.abs(turned.displacement - expected[[0, 2]]).max() < 1e-13


def _planar(radius: float, slope: float, rate: float, half: float) -> StepResult:
    walker = Walker(WalkerParameters(hip_width=0.0, foot_radius=radius, slope=slope))
    return walker.step([0.0, half, 0.0, rate, 0.0], inter_leg_angle=2 * half)


@pytest.mark.parametrize("radius", [0.0, 0.3, 0.7])
def test_a_planar_step_multiplies_the_squared_rate_by_a_constant_of_the_body_alone(
    radius: float,
) -> None:
    half = 0.2
    level, lift = radius + (1 - radius) * np.cos(half), (1 - radius) * np.sin(half)
    # The contact's lever about the mass before and after: what impulse along the new leg leaves of the rate
    kept = (level**2 - lift**2) / (level**2 + lift**2)
    for slope in (0.0, 0.03, 0.06):
        gained = 4.0 * (radius * half + lift) * np.sin(slope) / (level**2 + lift**2)
        result = _planar(radius, slope, -0.6, half)
        assert result.fall is None
        # the step's own accuracy
        assert result.state[3] ** 2 == pytest.approx(kept**2 * (0.36 + gained), abs=1e-10)
        assert np.abs(result.state - [0.0, half, 0.0, result.state[3], 0.0]).max() < 1e-12


def test_a_planar_walker_s_speed_goes_with_the_root_of_the_slope() -> None:
    half, radius, slope = 0.15, 0.5, 0.01
    level, lift = radius + (1 - radius) * np.cos(half), (1 - radius) * np.sin(half)
    kept = (level**2 - lift**2) / (level**2 + lift**2)
    gained = 4.0 * (radius * half + lift) * np.sin(slope) / (level**2 + lift**2)
    rate = -np.sqrt(gained * kept**2 / (1 - kept**2))
    assert _planar(radius, slope, rate, half).state[3] == pytest.approx(rate, abs=1e-11)
