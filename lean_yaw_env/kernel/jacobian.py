"""Exact derivatives of a walking step, by the complex step through the very same formulas.

With an imaginary part of 1e-30 on one input, the imaginary parts of the outcome are 1e-30 times its derivatives, to round-off and with no
difference of nearby numbers. The landing time carries its own imaginary part, so the event's share (the saltation) is in.

The inputs go side by side, a lane each, in loops over lanes that LLVM vectorises, as those over walkers in ``batch``: all eight cost as
much as seven steps.
"""

from __future__ import annotations

import numpy as np

from lean_yaw_env.kernel.compilation import entry_point, inlined
from lean_yaw_env.kernel.flight import advance
from lean_yaw_env.kernel.records import FLYING, Command, Flight
from lean_yaw_env.kernel.step import finish, stance_of, start

_TINY = 1e-30

# Inputs in the order of the columns: the section state, then inter-leg angle, mass offset and the offset before.
INPUTS = 8
STATE_SIZE = 5
# Outputs in the order of the rows: the section state, then what else a step is judged by.
OUTPUTS = ("heading", "stance_pitch", "ankle_angle", "stance_pitch_rate", "ankle_rate", "duration", "displacement_x", "displacement_z", "mass_offset", "shift_work")  # fmt: skip
_ROWS = len(Flight._fields)
_IMAGINARY = _ROWS * INPUTS  # where the imaginary parts begin
_STATUS = Flight._fields.index("status") * INPUTS


@inlined
def _seeded(value, lane, column):
    """An input, with an imaginary part in its own lane."""
    return complex(value, _TINY if lane == column else 0.0)


@inlined
def _stance(body, command, heading, side, lane):
    """What is constant in the step, as lane ``lane`` differentiates it."""
    seeded = Command(
        _seeded(command.inter_leg_angle, lane, 5),
        _seeded(command.mass_offset, lane, 6),
        _seeded(command.previous_offset, lane, 7),
    )
    return stance_of(body, seeded, _seeded(heading, lane, 0), side)


@inlined
def _number(work, row, lane):
    place = row * INPUTS + lane
    return complex(work[place], work[_IMAGINARY + place])


@inlined
def _keep(work, row, lane, number):
    place = row * INPUTS + lane
    work[place] = number.real
    work[_IMAGINARY + place] = number.imag


@inlined
def _load(work, lane):
    return Flight(
        _number(work, 0, lane),  # time
        _number(work, 1, lane),  # pitch
        _number(work, 2, lane),  # twist
        _number(work, 3, lane),  # pitch_rate
        _number(work, 4, lane),  # twist_rate
        _number(work, 5, lane),  # pitch_acceleration
        _number(work, 6, lane),  # twist_acceleration
        _number(work, 7, lane),  # gap
        _number(work, 8, lane),  # gap_rate
        _number(work, 9, lane),  # gap_acceleration
        work[10 * INPUTS + lane],  # next_step
        work[11 * INPUTS + lane],  # normal_force
        work[12 * INPUTS + lane],  # tangential_squared
        work[13 * INPUTS + lane],  # least_normal_force
        work[14 * INPUTS + lane],  # friction_squared
        _number(work, 15, lane),  # damping_loss
        work[16 * INPUTS + lane],  # evaluations
        work[17 * INPUTS + lane],  # attempts
        work[18 * INPUTS + lane],  # status
        _number(work, 19, lane),  # start_pitch
        _number(work, 20, lane),  # start_twist
        _number(work, 21, lane),  # start_kinetic
    )


@inlined
def _store(work, lane, flight):
    _keep(work, 0, lane, flight.time)
    _keep(work, 1, lane, flight.pitch)
    _keep(work, 2, lane, flight.twist)
    _keep(work, 3, lane, flight.pitch_rate)
    _keep(work, 4, lane, flight.twist_rate)
    _keep(work, 5, lane, flight.pitch_acceleration)
    _keep(work, 6, lane, flight.twist_acceleration)
    _keep(work, 7, lane, flight.gap)
    _keep(work, 8, lane, flight.gap_rate)
    _keep(work, 9, lane, flight.gap_acceleration)
    work[10 * INPUTS + lane] = flight.next_step
    work[11 * INPUTS + lane] = flight.normal_force
    work[12 * INPUTS + lane] = flight.tangential_squared
    work[13 * INPUTS + lane] = flight.least_normal_force
    work[14 * INPUTS + lane] = flight.friction_squared
    _keep(work, 15, lane, flight.damping_loss)
    work[16 * INPUTS + lane] = flight.evaluations
    work[17 * INPUTS + lane] = flight.attempts
    work[18 * INPUTS + lane] = flight.status
    _keep(work, 19, lane, flight.start_pitch)
    _keep(work, 20, lane, flight.start_twist)
    _keep(work, 21, lane, flight.start_kinetic)


@inlined
def _is_any_flying(work):
    flying = False
    for lane in range(INPUTS):
        flying = flying | (work[_STATUS + lane] == FLYING)
    return flying


@inlined
def _begin(work, body, command, heading, pitch, ankle, pitch_rate, ankle_rate, side):
    for lane in range(INPUTS):
        flight = start(
            _stance(body, command, heading, side, lane),
            body,
            _seeded(pitch, lane, 1),
            -_seeded(ankle, lane, 2),
            _seeded(pitch_rate, lane, 3),
            -_seeded(ankle_rate, lane, 4),
        )
        _store(work, lane, flight)


@inlined
def _fly(work, body, command, heading, side):
    """Advance every lane until it lands or falls: one that looks at a command to move the masses stops where they do."""
    while _is_any_flying(work):
        for lane in range(INPUTS):
            flight = _load(work, lane)
            stance = _stance(body, command, heading, side, lane)
            onward = advance(stance, flight)
            if flight.status == FLYING:
                _store(work, lane, onward)


@inlined
def _end(work, body, command, heading, side):
    """Put the outcomes in the place of the flights: status, then ``OUTPUTS``."""
    for lane in range(INPUTS):
        stance = _stance(body, command, heading, side, lane)
        outcome = finish(stance, _seeded(heading, lane, 0), _load(work, lane))
        _keep(work, 0, lane, complex(outcome.status))
        _keep(work, 1, lane, outcome.heading)
        _keep(work, 2, lane, outcome.stance_pitch)
        _keep(work, 3, lane, outcome.ankle_angle)
        _keep(work, 4, lane, outcome.stance_pitch_rate)
        _keep(work, 5, lane, outcome.ankle_rate)
        _keep(work, 6, lane, outcome.duration)
        _keep(work, 7, lane, outcome.displacement_x)
        _keep(work, 8, lane, outcome.displacement_z)
        _keep(work, 9, lane, outcome.mass_offset)
        _keep(work, 10, lane, outcome.shift_work)


@entry_point()
def step_jacobian(
    body, command, heading, pitch, ankle, pitch_rate, ankle_rate, side, state, jacobian
):
    """Write the first k of ``OUTPUTS`` (k,), 5 of them the next section state, and their derivatives (m, 8) by state and command; return
    how the step ended.
    """
    work = np.zeros(2 * _IMAGINARY)
    _begin(work, body, command, heading, pitch, ankle, pitch_rate, ankle_rate, side)
    _fly(work, body, command, heading, side)
    _end(work, body, command, heading, side)
    for k in range(state.shape[0]):
        state[k] = work[(k + 1) * INPUTS]
    for k in range(jacobian.shape[0]):
        place = (k + 1) * INPUTS
        for lane in range(INPUTS):
            jacobian[k, lane] = work[_IMAGINARY + place + lane] / _TINY
    return work[0]
