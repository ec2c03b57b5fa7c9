"""Exact derivatives of a walking step by state, command and the body's constants, by the complex step."""

from __future__ import annotations

from lean_yaw_env.kernel.compilation import entry_point
from lean_yaw_env.kernel.records import Body, Command
from lean_yaw_env.kernel.step import walking_step

_TINY = 1e-30

# Columns: the section state (5), the command (3), then the body's first six constants.
INPUTS = 14


@entry_point()
def step_sensitivity(body, command, state, side, after, jacobian):
    """Write ``jacobian.OUTPUTS`` (10,) and their derivatives (10, 14); return how the step ended."""
    status = 0.0
    for column in range(INPUTS):
        seed = 1j * _TINY
        outcome = walking_step(
            Body(
                body.hip_width + (seed if column == 8 else 0j),
                body.foot_radius + (seed if column == 9 else 0j),
                body.ankle_tilt + (seed if column == 10 else 0j),
                body.slope + (seed if column == 11 else 0j),
                body.ankle_stiffness + (seed if column == 12 else 0j),
                body.ankle_damping + (seed if column == 13 else 0j),
                body.shift_time,
                body.friction_limit,
                body.max_step_duration,
                body.slope_turns,
                body.strike_at_start,
            ),
            Command(
                command.inter_leg_angle + (seed if column == 5 else 0j),
                command.mass_offset + (seed if column == 6 else 0j),
                command.previous_offset + (seed if column == 7 else 0j),
            ),
            state[0] + (seed if column == 0 else 0j),
            state[1] + (seed if column == 1 else 0j),
            state[2] + (seed if column == 2 else 0j),
            state[3] + (seed if column == 3 else 0j),
            state[4] + (seed if column == 4 else 0j),
            side,
        )
        jacobian[0, column] = outcome.heading.imag / _TINY
        jacobian[1, column] = outcome.stance_pitch.imag / _TINY
        jacobian[2, column] = outcome.ankle_angle.imag / _TINY
        jacobian[3, column] = outcome.stance_pitch_rate.imag / _TINY
        jacobian[4, column] = outcome.ankle_rate.imag / _TINY
        jacobian[5, column] = outcome.duration.imag / _TINY
        jacobian[6, column] = outcome.displacement_x.imag / _TINY
        jacobian[7, column] = outcome.displacement_z.imag / _TINY
        jacobian[8, column] = outcome.mass_offset.imag / _TINY
        jacobian[9, column] = outcome.shift_work.imag / _TINY
        if column == 0:
            after[0] = outcome.heading.real
            after[1] = outcome.stance_pitch.real
            after[2] = outcome.ankle_angle.real
            after[3] = outcome.stance_pitch_rate.real
            after[4] = outcome.ankle_rate.real
            after[5] = outcome.duration.real
            after[6] = outcome.displacement_x.real
            after[7] = outcome.displacement_z.real
            after[8] = outcome.mass_offset.real
            after[9] = outcome.shift_work.real
            status = outcome.status
    return status
