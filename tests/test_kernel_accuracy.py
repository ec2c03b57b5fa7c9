"""The walking step against the second version in ``tests.reference``, and its exact derivatives against differences of that."""

from __future__ import annotations

import numpy as np
import pytest

from lean_yaw_env import Walker, WalkerParameters
from lean_yaw_env.analysis.step_derivatives import differentiate_step
from lean_yaw_env.kernel.records import Command
from lean_yaw_env.parameters import Foot, Vector
from lean_yaw_env.walker import SIDE, StepResult
from tests.reference import ReferenceWalker

ACCURACY = 1e-10
"""What the step promises over random states around the gait."""


def _reference(parameters: WalkerParameters) -> ReferenceWalker:
    return ReferenceWalker(
        hip_width=parameters.hip_width,
        foot_radius=parameters.foot_radius,
        ankle_tilt=parameters.ankle_tilt,
        slope=parameters.slope,
        ankle_stiffness=parameters.ankle_stiffness,
        ankle_damping=parameters.ankle_damping,
        shift_time=parameters.shift_time,
    )


def _error(
    parameters: WalkerParameters,
    state: Vector,
    stance: Foot,
    command: Command,
) -> tuple[float, StepResult]:
    """Largest difference of a step from the reference's in state, duration and displacement."""
    result = Walker(parameters).step(
        state,
        stance=stance,
        inter_leg_angle=command.inter_leg_angle,
        mass_offset=command.mass_offset,
        previous_offset=command.previous_offset,
    )
    assert result.fall is None
    after, duration, displacement = _reference(parameters).step(
        state, SIDE[stance], command.inter_leg_angle, command.previous_offset, command.mass_offset
    )
    # the reference reads headings from a rotation, which knows no full turns
    turns = np.round((result.state[0] - after[0]) / (2 * np.pi)) * 2 * np.pi
    after = after + np.array([turns, 0.0, 0.0, 0.0, 0.0])
    error = max(
        np.abs(result.state - after).max(),
        abs(result.duration - duration),
        np.abs(result.displacement - displacement).max(),
    )
    return float(error), result


def _around_the_gait(rng: np.random.Generator, gait: Vector) -> tuple[Vector, Foot]:
    return gait * rng.uniform(0.5, 1.5, 5), "left" if rng.random() < 0.5 else "right"


def test_steps_at_an_offset_agree_with_the_reference(gait: Vector) -> None:
    rng = np.random.default_rng(1)
    errors = []
    for _ in range(30):
        state, stance = _around_the_gait(rng, gait)
        offset = rng.uniform(-0.05, 0.05)
        command = Command(rng.uniform(0.15, 0.5), offset, offset)
        parameters = WalkerParameters(slope=rng.uniform(0.002, 0.05))
        errors.append(_error(parameters, state, stance, command)[0])
    assert max(errors) < ACCURACY


def test_steps_that_move_the_masses_agree_with_the_reference(gait: Vector) -> None:
    rng = np.random.default_rng(2)
    errors = []
    for _ in range(12):
        state, stance = _around_the_gait(rng, gait)
        before = rng.uniform(-0.05, 0.05)
        # up to a pumping walker's shift; larger ones lift the foot from some of these states
        command = Command(rng.uniform(0.15, 0.5), before + rng.uniform(-0.06, 0.06), before)
        parameters = WalkerParameters(slope=rng.uniform(0.002, 0.05))
        errors.append(_error(parameters, state, stance, command)[0])
    assert max(errors) < ACCURACY


def test_a_heel_strike_in_mid_shift_agrees_with_the_reference(gait: Vector) -> None:
    rng = np.random.default_rng(3)
    for _ in range(6):
        state, stance = _around_the_gait(rng, gait)
        command = Command(0.3, rng.uniform(-0.1, 0.1), 0.0)
        parameters = WalkerParameters(shift_time=2.0)
        error, result = _error(parameters, state, stance, command)
        assert error < ACCURACY
        assert abs(result.mass_offset) < abs(command.mass_offset)  # locked on the way


def test_other_bodies_with_springs_agree_with_the_reference(gait: Vector) -> None:
    rng = np.random.default_rng(4)
    errors = []
    for _ in range(20):
        state, stance = _around_the_gait(rng, gait)
        state[0] = rng.uniform(-1.2, 1.2)
        parameters = WalkerParameters(
            hip_width=rng.uniform(0.0, 1.0),
            foot_radius=rng.uniform(0.0, 0.9),
            ankle_tilt=rng.uniform(0.2, 1.2),
            slope=rng.uniform(-0.02, 0.05),
            ankle_stiffness=rng.uniform(0.0, 0.05),
            ankle_damping=rng.uniform(0.0, 0.05),
        )
        state[3] -= 0.1
        offset = rng.uniform(-0.05, 0.05)
        errors.append(_error(parameters, state, stance, Command(0.3, offset, offset))[0])
    assert max(errors) < ACCURACY


def test_near_falls_are_stepped_as_exactly_as_their_sensitivity_allows(gait: Vector) -> None:
    walker = Walker()
    rate = _slowest_rate(walker, gait)
    for above in (1e-6, 1e-4, 1e-2):
        state = gait.copy()
        state[3] = rate * (1.0 + above)
        command = Command(0.3, 0.0, 0.0)
        error, result = _error(walker.parameters, state, "left", command)
        # an integrator's error anywhere on the way grows like a disturbance of the start
        growth = np.abs(differentiate_step(walker, state, "left", command).by_state).max()
        assert error < ACCURACY * max(1.0, growth)
        assert result.duration > 1.2  # the gait's is 0.72


def _slowest_rate(walker: Walker, gait: Vector) -> float:
    """The stance pitch rate of least magnitude with which the gait's other coordinates still make a step, by bisection."""
    falls, steps = 0.0, -0.4
    state = gait.copy()
    for _ in range(48):
        state[3] = 0.5 * (falls + steps)
        if walker.step(state).fall is None:
            steps = state[3]
        else:
            falls = state[3]
    return steps


@pytest.mark.parametrize("before", [0.02, 0.01])
def test_exact_derivatives_agree_with_differences_of_the_reference(
    before: float, gait: Vector
) -> None:
    parameters = WalkerParameters(slope=0.02)
    command = Command(0.32, 0.01, before)
    state = gait * np.array([40.0, 1.1, 2.0, 1.2, 0.7])
    exact = differentiate_step(Walker(parameters), state, "right", command)
    columns = np.column_stack(
        [
            exact.by_state,
            exact.by_inter_leg_angle,
            exact.by_mass_offset,
            exact.by_previous_offset,
        ]
    )
    reference = _reference(parameters)

    def after(change: Vector) -> Vector:
        angle, offset, old = np.array(command) + change[5:]
        return reference.step(state + change[:5], -1.0, angle, old, offset)[0]

    reach = 1e-4
    for k in range(8):
        change = reach * np.eye(8)[k]
        difference = (after(change) - after(-change)) / (2 * reach)
        # second-order differences: third derivatives of order ten times 1e-8 / 6
        assert np.abs(columns[:, k] - difference).max() < 2e-7 * max(1, np.abs(difference).max())
