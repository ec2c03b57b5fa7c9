"""Many walking steps at once: the same formulas as ``step``, in loops over walkers that LLVM vectorises.

Walkers are taken in blocks of ``LANES``. A block keeps one row per quantity in a flat work array, its offsets known at compile time, so
that the compiler sees rows that cannot overlap. Walkers still in flight are swapped to the front, past those that have landed or
fallen, so that the work follows them. Loops run over whole vectors: what the lanes of walkers gone hold is computed too, and not used. No fast-math: each walker's result has the bits that ``step`` gives.
"""

from __future__ import annotations

import numpy as np

from lean_yaw_env.kernel.compilation import entry_point, inlined
from lean_yaw_env.kernel.flight import advance
from lean_yaw_env.kernel.records import FLYING, Body, Command, Flight, Stance
from lean_yaw_env.kernel.step import finish, stance_of, start

LANES = 128
_VECTOR = 8  # doubles in the widest vector registers
# Rows are a vector longer than their lanes: at a distance of a power of two they would compete for the same places in the cache
_ROW = LANES + _VECTOR

_STANCE = 0
_FLIGHT = _STANCE + 18 * _ROW
_HEADING = _FLIGHT + 22 * _ROW
_WHO = _HEADING + _ROW
_ROWS = 42
_OUTCOME = _ROWS * _ROW
# A walker's constants and command are rows only until its flight starts, in the place of its outcome
_BODY = _OUTCOME
_COMMAND = _BODY + 11 * _ROW
_SIDE = _COMMAND + 3 * _ROW
_SIZE = _OUTCOME + 18 * _ROW
_STATUS = _FLIGHT + 18 * _ROW


@inlined
def _load_stance(work, i):
    return Stance(
        work[_STANCE + 0 * _ROW + i],  # radius
        work[_STANCE + 1 * _ROW + i],  # tilt
        work[_STANCE + 2 * _ROW + i],  # sin_tilt
        work[_STANCE + 3 * _ROW + i],  # cos_tilt
        work[_STANCE + 4 * _ROW + i],  # half_axle
        work[_STANCE + 5 * _ROW + i],  # axle_inertia
        work[_STANCE + 6 * _ROW + i],  # gravity_x
        work[_STANCE + 7 * _ROW + i],  # gravity_y
        work[_STANCE + 8 * _ROW + i],  # gravity_z
        work[_STANCE + 9 * _ROW + i],  # sin_inter_leg
        work[_STANCE + 10 * _ROW + i],  # cos_inter_leg
        work[_STANCE + 11 * _ROW + i],  # ankle_stiffness
        work[_STANCE + 12 * _ROW + i],  # ankle_damping
        work[_STANCE + 13 * _ROW + i],  # previous_offset
        work[_STANCE + 14 * _ROW + i],  # offset_change
        work[_STANCE + 15 * _ROW + i],  # shift_rate
        work[_STANCE + 16 * _ROW + i],  # friction_limit_squared
        work[_STANCE + 17 * _ROW + i],  # max_duration
    )


@inlined
def _store_stance(work, i, stance):
    work[_STANCE + 0 * _ROW + i] = stance.radius
    work[_STANCE + 1 * _ROW + i] = stance.tilt
    work[_STANCE + 2 * _ROW + i] = stance.sin_tilt
    work[_STANCE + 3 * _ROW + i] = stance.cos_tilt
    work[_STANCE + 4 * _ROW + i] = stance.half_axle
    work[_STANCE + 5 * _ROW + i] = stance.axle_inertia
    work[_STANCE + 6 * _ROW + i] = stance.gravity_x
    work[_STANCE + 7 * _ROW + i] = stance.gravity_y
    work[_STANCE + 8 * _ROW + i] = stance.gravity_z
    work[_STANCE + 9 * _ROW + i] = stance.sin_inter_leg
    work[_STANCE + 10 * _ROW + i] = stance.cos_inter_leg
    work[_STANCE + 11 * _ROW + i] = stance.ankle_stiffness
    work[_STANCE + 12 * _ROW + i] = stance.ankle_damping
    work[_STANCE + 13 * _ROW + i] = stance.previous_offset
    work[_STANCE + 14 * _ROW + i] = stance.offset_change
    work[_STANCE + 15 * _ROW + i] = stance.shift_rate
    work[_STANCE + 16 * _ROW + i] = stance.friction_limit_squared
    work[_STANCE + 17 * _ROW + i] = stance.max_duration


@inlined
def _load_flight(work, i):
    return Flight(
        work[_FLIGHT + 0 * _ROW + i],  # time
        work[_FLIGHT + 1 * _ROW + i],  # pitch
        work[_FLIGHT + 2 * _ROW + i],  # twist
        work[_FLIGHT + 3 * _ROW + i],  # pitch_rate
        work[_FLIGHT + 4 * _ROW + i],  # twist_rate
        work[_FLIGHT + 5 * _ROW + i],  # pitch_acceleration
        work[_FLIGHT + 6 * _ROW + i],  # twist_acceleration
        work[_FLIGHT + 7 * _ROW + i],  # gap
        work[_FLIGHT + 8 * _ROW + i],  # gap_rate
        work[_FLIGHT + 9 * _ROW + i],  # gap_acceleration
        work[_FLIGHT + 10 * _ROW + i],  # next_step
        work[_FLIGHT + 11 * _ROW + i],  # normal_force
        work[_FLIGHT + 12 * _ROW + i],  # tangential_squared
        work[_FLIGHT + 13 * _ROW + i],  # least_normal_force
        work[_FLIGHT + 14 * _ROW + i],  # friction_squared
        work[_FLIGHT + 15 * _ROW + i],  # damping_loss
        work[_FLIGHT + 16 * _ROW + i],  # evaluations
        work[_FLIGHT + 17 * _ROW + i],  # attempts
        work[_FLIGHT + 18 * _ROW + i],  # status
        work[_FLIGHT + 19 * _ROW + i],  # start_pitch
        work[_FLIGHT + 20 * _ROW + i],  # start_twist
        work[_FLIGHT + 21 * _ROW + i],  # start_kinetic
    )


@inlined
def _store_flight(work, i, flight):
    work[_FLIGHT + 0 * _ROW + i] = flight.time
    work[_FLIGHT + 1 * _ROW + i] = flight.pitch
    work[_FLIGHT + 2 * _ROW + i] = flight.twist
    work[_FLIGHT + 3 * _ROW + i] = flight.pitch_rate
    work[_FLIGHT + 4 * _ROW + i] = flight.twist_rate
    work[_FLIGHT + 5 * _ROW + i] = flight.pitch_acceleration
    work[_FLIGHT + 6 * _ROW + i] = flight.twist_acceleration
    work[_FLIGHT + 7 * _ROW + i] = flight.gap
    work[_FLIGHT + 8 * _ROW + i] = flight.gap_rate
    work[_FLIGHT + 9 * _ROW + i] = flight.gap_acceleration
    work[_FLIGHT + 10 * _ROW + i] = flight.next_step
    work[_FLIGHT + 11 * _ROW + i] = flight.normal_force
    work[_FLIGHT + 12 * _ROW + i] = flight.tangential_squared
    work[_FLIGHT + 13 * _ROW + i] = flight.least_normal_force
    work[_FLIGHT + 14 * _ROW + i] = flight.friction_squared
    work[_FLIGHT + 15 * _ROW + i] = flight.damping_loss
    work[_FLIGHT + 16 * _ROW + i] = flight.evaluations
    work[_FLIGHT + 17 * _ROW + i] = flight.attempts
    work[_FLIGHT + 18 * _ROW + i] = flight.status
    work[_FLIGHT + 19 * _ROW + i] = flight.start_pitch
    work[_FLIGHT + 20 * _ROW + i] = flight.start_twist
    work[_FLIGHT + 21 * _ROW + i] = flight.start_kinetic


@inlined
def _load_body(work, i):
    return Body(
        work[_BODY + 0 * _ROW + i],  # hip_width
        work[_BODY + 1 * _ROW + i],  # foot_radius
        work[_BODY + 2 * _ROW + i],  # ankle_tilt
        work[_BODY + 3 * _ROW + i],  # slope
        work[_BODY + 4 * _ROW + i],  # ankle_stiffness
        work[_BODY + 5 * _ROW + i],  # ankle_damping
        work[_BODY + 6 * _ROW + i],  # shift_time
        work[_BODY + 7 * _ROW + i],  # friction_limit
        work[_BODY + 8 * _ROW + i],  # max_step_duration
        work[_BODY + 9 * _ROW + i],  # slope_turns
        work[_BODY + 10 * _ROW + i],  # strike_at_start
    )


@inlined
def _load_command(work, i):
    return Command(
        work[_COMMAND + 0 * _ROW + i],  # inter_leg_angle
        work[_COMMAND + 1 * _ROW + i],  # mass_offset
        work[_COMMAND + 2 * _ROW + i],  # previous_offset
    )


@inlined
def _store_outcome(work, i, outcome):
    work[_OUTCOME + 0 * _ROW + i] = outcome.heading
    work[_OUTCOME + 1 * _ROW + i] = outcome.stance_pitch
    work[_OUTCOME + 2 * _ROW + i] = outcome.ankle_angle
    work[_OUTCOME + 3 * _ROW + i] = outcome.stance_pitch_rate
    work[_OUTCOME + 4 * _ROW + i] = outcome.ankle_rate
    work[_OUTCOME + 5 * _ROW + i] = outcome.status
    work[_OUTCOME + 6 * _ROW + i] = outcome.duration
    work[_OUTCOME + 7 * _ROW + i] = outcome.displacement_x
    work[_OUTCOME + 8 * _ROW + i] = outcome.displacement_z
    work[_OUTCOME + 9 * _ROW + i] = outcome.heading_change
    work[_OUTCOME + 10 * _ROW + i] = outcome.mass_offset
    work[_OUTCOME + 11 * _ROW + i] = outcome.least_normal_force
    work[_OUTCOME + 12 * _ROW + i] = outcome.greatest_friction
    work[_OUTCOME + 13 * _ROW + i] = outcome.gravity_work
    work[_OUTCOME + 14 * _ROW + i] = outcome.shift_work
    work[_OUTCOME + 15 * _ROW + i] = outcome.impact_loss
    work[_OUTCOME + 16 * _ROW + i] = outcome.ankle_loss
    work[_OUTCOME + 17 * _ROW + i] = outcome.evaluations


@inlined
def _padded(n):
    """The next multiple of the vector length: no lane is left to a loop of single ones."""
    return (n + _VECTOR - 1) // _VECTOR * _VECTOR


@inlined
def _begin(work, n, first, bodies, commands, states, sides):
    """Copy ``n`` walkers into the work rows and start their flights."""
    for i in range(n):
        who = first + i
        b = who if bodies.shape[0] > 1 else 0
        for k in range(11):
            work[_BODY + k * _ROW + i] = bodies[b, k]
        for k in range(3):
            work[_COMMAND + k * _ROW + i] = commands[who, k]
        work[_HEADING + i] = states[who, 0]
        work[_SIDE + i] = sides[who]
        work[_WHO + i] = who
        # until the flight starts, its rows hold the state
        for k in range(1, 5):
            work[_FLIGHT + k * _ROW + i] = states[who, k]
    for i in range(_padded(n)):
        body = _load_body(work, i)
        command = _load_command(work, i)
        stance = stance_of(body, command, work[_HEADING + i], work[_SIDE + i])
        pitch = work[_FLIGHT + 1 * _ROW + i]
        ankle = work[_FLIGHT + 2 * _ROW + i]
        pitch_rate = work[_FLIGHT + 3 * _ROW + i]
        ankle_rate = work[_FLIGHT + 4 * _ROW + i]
        flight = start(stance, body, pitch, -ankle, pitch_rate, -ankle_rate)
        _store_stance(work, i, stance)
        _store_flight(work, i, flight)


@inlined
def _gather_flying(work, n):
    """Swap lanes so that those in flight come first, of ``n``; return how many they are."""
    i = 0
    while i < n:
        if work[_STATUS + i] == FLYING:
            i += 1
        else:
            n -= 1
            if work[_STATUS + n] == FLYING:
                for k in range(_ROWS):
                    place = k * _ROW
                    work[place + i], work[place + n] = work[place + n], work[place + i]
                i += 1
    return i


@inlined
def _end(work, n, outcomes):
    """Heel strikes and falls, written to the walkers' rows of ``outcomes``."""
    for i in range(_padded(n)):
        outcome = finish(_load_stance(work, i), work[_HEADING + i], _load_flight(work, i))
        _store_outcome(work, i, outcome)
    for i in range(n):
        who = int(work[_WHO + i])
        for k in range(18):
            outcomes[who, k] = work[_OUTCOME + k * _ROW + i]


@entry_point()
def step_batch(bodies, commands, states, sides, outcomes, first, last):
    """Step walkers ``first`` to ``last`` - 1.

    ``bodies`` (1 or n, 11), ``commands`` (n, 3), ``states`` (n, 5), ``sides`` (n,) and ``outcomes`` (n, 18) hold a record a row, in the
    order of ``records``.
    """
    work = np.zeros(_SIZE)
    for begin in range(first, last, LANES):
        n = min(LANES, last - begin)
        _begin(work, n, begin, bodies, commands, states, sides)
        flying = _gather_flying(work, n)
        while flying > 0:
            for i in range(_padded(flying)):
                flight = _load_flight(work, i)
                onward = advance(_load_stance(work, i), flight)
                if flight.status == FLYING:
                    _store_flight(work, i, onward)
            flying = _gather_flying(work, flying)
        _end(work, n, outcomes)
