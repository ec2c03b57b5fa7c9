"""Exact derivatives of a walking step, by the complex step through the very same formulas.

With an imaginary part of 1e-30 on one input, the imaginary parts of the outcome are 1e-30 times its derivatives, to round-off and with no
difference of nearby numbers. The landing time carries its own imaginary part, so the event's share (the saltation) is in.
"""

from __future__ import annotations

from lean_yaw_env.kernel.compilation import entry_point
from lean_yaw_env.kernel.records import Command
from lean_yaw_env.kernel.step import walking_step

_TINY = 1e-30

# Inputs in the order of the columns: the section state, then inter-leg angle, mass offset and the offset before.
INPUTS = 8


@entry_point()
def step_jacobian(
    body, command, heading, pitch, ankle, pitch_rate, ankle_rate, side, state, jacobian
):
    """Write the next section state (5,) and its derivatives (5, 8) by state and command; return how the step ended."""
    status = 0.0
    for column in range(INPUTS):
        seed = 1j * _TINY
        outcome = walking_step(
            body,
            Command(
                command.inter_leg_angle + (seed if column == 5 else 0j),
                command.offset + (seed if column == 6 else 0j),
                command.offset_before + (seed if column == 7 else 0j),
            ),
            heading + (seed if column == 0 else 0j),
            pitch + (seed if column == 1 else 0j),
            ankle + (seed if column == 2 else 0j),
            pitch_rate + (seed if column == 3 else 0j),
            ankle_rate + (seed if column == 4 else 0j),
            side,
        )
        jacobian[0, column] = outcome.heading.imag / _TINY
        jacobian[1, column] = outcome.stance_pitch.imag / _TINY
        jacobian[2, column] = outcome.ankle_angle.imag / _TINY
        jacobian[3, column] = outcome.stance_pitch_rate.imag / _TINY
        jacobian[4, column] = outcome.ankle_rate.imag / _TINY
        if column == 0:
            state[0] = outcome.heading.real
            state[1] = outcome.stance_pitch.real
            state[2] = outcome.ankle_angle.real
            state[3] = outcome.stance_pitch_rate.real
            state[4] = outcome.ankle_rate.real
            status = outcome.status
    return status
