"""Many walking steps at once: the same formulas as ``step``, in loops over walkers that LLVM vectorises.

Walkers are taken in blocks of ``LANES``. A block keeps one row per quantity in a flat work array, its offsets known at compile time, so
that the compiler sees rows that cannot overlap. Walkers that have landed or fallen are copied out of the way, so that the work
follows those still in flight. Loops run over whole vectors: what the lanes of walkers gone hold is computed too, and not used. No fast-math: each walker's result has the bits that ``step`` gives.
"""

from __future__ import annotations

import numpy as np

from lean_yaw_env.kernel.compilation import entry_point, inlined
from lean_yaw_env.kernel.flight import advance
from lean_yaw_env.kernel.records import FLYING, Body, Command, Flight, Stance
from lean_yaw_env.kernel.step import finish, stance_of, start

LANES = 64
_VECTOR = 8  # doubles in the widest vector registers

_STANCE = 0
_FLIGHT = _STANCE + 18 * LANES
_HEADING = _FLIGHT + 22 * LANES
_WHO = _HEADING + LANES
_ROWS = 42
_RETIRED = _ROWS * LANES
_OUTCOME = 2 * _RETIRED
# A walker's constants and command are rows only until its flight starts, in the place of its outcome
_BODY = _OUTCOME
_COMMAND = _BODY + 11 * LANES
_SIDE = _COMMAND + 3 * LANES
_SIZE = _OUTCOME + 18 * LANES
_STATUS = _FLIGHT + 18 * LANES


@inlined
def _load_stance(work, i):
    return Stance(
        work[_STANCE + 0 * LANES + i],  # radius
        work[_STANCE + 1 * LANES + i],  # tilt
        work[_STANCE + 2 * LANES + i],  # sin_tilt
        work[_STANCE + 3 * LANES + i],  # cos_tilt
        work[_STANCE + 4 * LANES + i],  # half_axle
        work[_STANCE + 5 * LANES + i],  # axle_inertia
        work[_STANCE + 6 * LANES + i],  # gravity_x
        work[_STANCE + 7 * LANES + i],  # gravity_y
        work[_STANCE + 8 * LANES + i],  # gravity_z
        work[_STANCE + 9 * LANES + i],  # sin_inter_leg
        work[_STANCE + 10 * LANES + i],  # cos_inter_leg
        work[_STANCE + 11 * LANES + i],  # ankle_stiffness
        work[_STANCE + 12 * LANES + i],  # ankle_damping
        work[_STANCE + 13 * LANES + i],  # offset_before
        work[_STANCE + 14 * LANES + i],  # offset_change
        work[_STANCE + 15 * LANES + i],  # shift_rate
        work[_STANCE + 16 * LANES + i],  # friction_limit_squared
        work[_STANCE + 17 * LANES + i],  # max_duration
    )


@inlined
def _store_stance(work, i, stance):
    work[_STANCE + 0 * LANES + i] = stance.radius
    work[_STANCE + 1 * LANES + i] = stance.tilt
    work[_STANCE + 2 * LANES + i] = stance.sin_tilt
    work[_STANCE + 3 * LANES + i] = stance.cos_tilt
    work[_STANCE + 4 * LANES + i] = stance.half_axle
    work[_STANCE + 5 * LANES + i] = stance.axle_inertia
    work[_STANCE + 6 * LANES + i] = stance.gravity_x
    work[_STANCE + 7 * LANES + i] = stance.gravity_y
    work[_STANCE + 8 * LANES + i] = stance.gravity_z
    work[_STANCE + 9 * LANES + i] = stance.sin_inter_leg
    work[_STANCE + 10 * LANES + i] = stance.cos_inter_leg
    work[_STANCE + 11 * LANES + i] = stance.ankle_stiffness
    work[_STANCE + 12 * LANES + i] = stance.ankle_damping
    work[_STANCE + 13 * LANES + i] = stance.offset_before
    work[_STANCE + 14 * LANES + i] = stance.offset_change
    work[_STANCE + 15 * LANES + i] = stance.shift_rate
    work[_STANCE + 16 * LANES + i] = stance.friction_limit_squared
    work[_STANCE + 17 * LANES + i] = stance.max_duration


@inlined
def _load_flight(work, i):
    return Flight(
        work[_FLIGHT + 0 * LANES + i],  # time
        work[_FLIGHT + 1 * LANES + i],  # pitch
        work[_FLIGHT + 2 * LANES + i],  # twist
        work[_FLIGHT + 3 * LANES + i],  # pitch_rate
        work[_FLIGHT + 4 * LANES + i],  # twist_rate
        work[_FLIGHT + 5 * LANES + i],  # pitch_acceleration
        work[_FLIGHT + 6 * LANES + i],  # twist_acceleration
        work[_FLIGHT + 7 * LANES + i],  # gap
        work[_FLIGHT + 8 * LANES + i],  # gap_rate
        work[_FLIGHT + 9 * LANES + i],  # gap_acceleration
        work[_FLIGHT + 10 * LANES + i],  # next_step
        work[_FLIGHT + 11 * LANES + i],  # normal_force
        work[_FLIGHT + 12 * LANES + i],  # tangential_squared
        work[_FLIGHT + 13 * LANES + i],  # least_normal_force
        work[_FLIGHT + 14 * LANES + i],  # friction_squared
        work[_FLIGHT + 15 * LANES + i],  # damping_loss
        work[_FLIGHT + 16 * LANES + i],  # evaluations
        work[_FLIGHT + 17 * LANES + i],  # attempts
        work[_FLIGHT + 18 * LANES + i],  # status
        work[_FLIGHT + 19 * LANES + i],  # start_pitch
        work[_FLIGHT + 20 * LANES + i],  # start_twist
        work[_FLIGHT + 21 * LANES + i],  # start_kinetic
    )


@inlined
def _store_flight(work, i, flight):
    work[_FLIGHT + 0 * LANES + i] = flight.time
    work[_FLIGHT + 1 * LANES + i] = flight.pitch
    work[_FLIGHT + 2 * LANES + i] = flight.twist
    work[_FLIGHT + 3 * LANES + i] = flight.pitch_rate
    work[_FLIGHT + 4 * LANES + i] = flight.twist_rate
    work[_FLIGHT + 5 * LANES + i] = flight.pitch_acceleration
    work[_FLIGHT + 6 * LANES + i] = flight.twist_acceleration
    work[_FLIGHT + 7 * LANES + i] = flight.gap
    work[_FLIGHT + 8 * LANES + i] = flight.gap_rate
    work[_FLIGHT + 9 * LANES + i] = flight.gap_acceleration
    work[_FLIGHT + 10 * LANES + i] = flight.next_step
    work[_FLIGHT + 11 * LANES + i] = flight.normal_force
    work[_FLIGHT + 12 * LANES + i] = flight.tangential_squared
    work[_FLIGHT + 13 * LANES + i] = flight.least_normal_force
    work[_FLIGHT + 14 * LANES + i] = flight.friction_squared
    work[_FLIGHT + 15 * LANES + i] = flight.damping_loss
    work[_FLIGHT + 16 * LANES + i] = flight.evaluations
    work[_FLIGHT + 17 * LANES + i] = flight.attempts
    work[_FLIGHT + 18 * LANES + i] = flight.status
    work[_FLIGHT + 19 * LANES + i] = flight.start_pitch
    work[_FLIGHT + 20 * LANES + i] = flight.start_twist
    work[_FLIGHT + 21 * LANES + i] = flight.start_kinetic


@inlined
def _load_body(work, i):
    return Body(
        work[_BODY + 0 * LANES + i],  # hip_width
        work[_BODY + 1 * LANES + i],  # foot_radius
        work[_BODY + 2 * LANES + i],  # ankle_tilt
        work[_BODY + 3 * LANES + i],  # slope
        work[_BODY + 4 * LANES + i],  # ankle_stiffness
        work[_BODY + 5 * LANES + i],  # ankle_damping
        work[_BODY + 6 * LANES + i],  # shift_time
        work[_BODY + 7 * LANES + i],  # friction_limit
        work[_BODY + 8 * LANES + i],  # max_step_duration
        work[_BODY + 9 * LANES + i],  # slope_turns
        work[_BODY + 10 * LANES + i],  # strike_at_start
    )


@inlined
def _load_command(work, i):
    return Command(
        work[_COMMAND + 0 * LANES + i],  # inter_leg_angle
        work[_COMMAND + 1 * LANES + i],  # offset
        work[_COMMAND + 2 * LANES + i],  # offset_before
    )


@inlined
def _store_outcome(work, i, outcome):
    work[_OUTCOME + 0 * LANES + i] = outcome.heading
    work[_OUTCOME + 1 * LANES + i] = outcome.stance_pitch
    work[_OUTCOME + 2 * LANES + i] = outcome.ankle_angle
    work[_OUTCOME + 3 * LANES + i] = outcome.stance_pitch_rate
    work[_OUTCOME + 4 * LANES + i] = outcome.ankle_rate
    work[_OUTCOME + 5 * LANES + i] = outcome.status
    work[_OUTCOME + 6 * LANES + i] = outcome.duration
    work[_OUTCOME + 7 * LANES + i] = outcome.displacement_x
    work[_OUTCOME + 8 * LANES + i] = outcome.displacement_z
    work[_OUTCOME + 9 * LANES + i] = outcome.heading_change
    work[_OUTCOME + 10 * LANES + i] = outcome.offset
    work[_OUTCOME + 11 * LANES + i] = outcome.least_normal_force
    work[_OUTCOME + 12 * LANES + i] = outcome.greatest_friction
    work[_OUTCOME + 13 * LANES + i] = outcome.gravity_work
    work[_OUTCOME + 14 * LANES + i] = outcome.shift_work
    work[_OUTCOME + 15 * LANES + i] = outcome.impact_loss
    work[_OUTCOME + 16 * LANES + i] = outcome.ankle_loss
    work[_OUTCOME + 17 * LANES + i] = outcome.evaluations


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
            work[_BODY + k * LANES + i] = bodies[b, k]
        for k in range(3):
            work[_COMMAND + k * LANES + i] = commands[who, k]
        work[_HEADING + i] = states[who, 0]
        work[_SIDE + i] = sides[who]
        work[_WHO + i] = who
        # until the flight starts, its rows hold the state
        for k in range(1, 5):
            work[_FLIGHT + k * LANES + i] = states[who, k]
    for i in range(_padded(n)):
        body = _load_body(work, i)
        command = _load_command(work, i)
        stance = stance_of(body, command, work[_HEADING + i], work[_SIDE + i])
        pitch = work[_FLIGHT + 1 * LANES + i]
        ankle = work[_FLIGHT + 2 * LANES + i]
        pitch_rate = work[_FLIGHT + 3 * LANES + i]
        ankle_rate = work[_FLIGHT + 4 * LANES + i]
        flight = start(stance, body, pitch, -ankle, pitch_rate, -ankle_rate)
        _store_stance(work, i, stance)
        _store_flight(work, i, flight)


@inlined
def _retire(work, flying, retired):
    """Copy walkers that have landed or fallen out of the way, the last one in flight taking each place; count both kinds."""
    i = 0
    while i < flying:
        if work[_STATUS + i] == FLYING:
            i += 1
        else:
            flying -= 1
            for k in range(_ROWS):
                work[_RETIRED + k * LANES + retired] = work[k * LANES + i]
                work[k * LANES + i] = work[k * LANES + flying]
            retired += 1
    return flying, retired


@inlined
def _end(work, n, outcomes):
    """Heel strikes and falls, written to the walkers' rows of ``outcomes``."""
    for i in range(_padded(n)):
        outcome = finish(
            _load_stance(work, _RETIRED + i),
            work[_RETIRED + _HEADING + i],
            _load_flight(work, _RETIRED + i),
        )
        _store_outcome(work, i, outcome)
    for i in range(n):
        who = int(work[_RETIRED + _WHO + i])
        for k in range(18):
            outcomes[who, k] = work[_OUTCOME + k * LANES + i]


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
        flying, retired = _retire(work, n, 0)
        while flying > 0:
            for i in range(_padded(flying)):
                flight = advance(_load_stance(work, i), _load_flight(work, i))
                _store_flight(work, i, flight)
            flying, retired = _retire(work, flying, retired)
        _end(work, n, outcomes)
