"""Many walking steps at once: the same formulas as ``step``, in loops over walkers that LLVM vectorises.

Walkers are taken in blocks of ``LANES``. A block keeps one row per quantity in a flat work array, its offsets known at compile time, so
that the compiler sees rows that cannot overlap. Walkers still in flight are swapped to the front, past those that have landed or
fallen, so that the work follows them. Loops run over whole vectors: what the lanes of walkers gone hold is computed too, and not used. No fast-math: each walker's result has the bits that ``step`` gives.
"""

from __future__ import annotations

import numpy as np

from lean_yaw_env.kernel.compilation import entry_point, inlined
from lean_yaw_env.kernel.flight import advance
from lean_yaw_env.kernel.lanes import LANES, ROW, lane_reader, lane_writer, padded, rows_of
from lean_yaw_env.kernel.records import FLYING, Body, Command, Flight, Outcome, Stance
from lean_yaw_env.kernel.step import finish, stance_of, start

_FLIGHT = rows_of(Stance) * ROW
_STATUS = _FLIGHT + Flight._fields.index("status") * ROW
_HEADING = _FLIGHT + rows_of(Flight) * ROW
_WHO = _HEADING + ROW
_OUTCOME = _WHO + ROW
_SWAPPED = _OUTCOME // ROW  # rows that a walker in flight needs
_OUTCOMES = rows_of(Outcome)
# A walker's constants and command are rows only until its flight starts, in the place of its outcome
_BODY = _OUTCOME
_BODIES = rows_of(Body)
_COMMAND = _BODY + _BODIES * ROW
_COMMANDS = rows_of(Command)
_SIDE = _COMMAND + _COMMANDS * ROW
_SIZE = _OUTCOME + _OUTCOMES * ROW

_load_body = lane_reader(Body, _BODY)
_load_command = lane_reader(Command, _COMMAND)
_load_stance = lane_reader(Stance, 0)
_store_stance = lane_writer(Stance, 0)
_load_flight = lane_reader(Flight, _FLIGHT)
_store_flight = lane_writer(Flight, _FLIGHT)
_store_outcome = lane_writer(Outcome, _OUTCOME)

@inlined
def _begin(work, n, first, bodies, commands, states, sides):
    """Copy ``n`` walkers into the work rows and start their flights."""
    for i in range(n):
        who = first + i
        b = who if bodies.shape[0] > 1 else 0
        for k in range(_BODIES):
            work[_BODY + k * ROW + i] = bodies[b, k]
        for k in range(_COMMANDS):
            work[_COMMAND + k * ROW + i] = commands[who, k]
        work[_HEADING + i] = states[who, 0]
        work[_SIDE + i] = sides[who]
        work[_WHO + i] = who
        # until the flight starts, its rows hold the state
        for k in range(1, 5):
            work[_FLIGHT + k * ROW + i] = states[who, k]
    for i in range(padded(n)):
        body = _load_body(work, i)
        command = _load_command(work, i)
        stance = stance_of(body, command, work[_HEADING + i], work[_SIDE + i])
        pitch = work[_FLIGHT + 1 * ROW + i]
        ankle = work[_FLIGHT + 2 * ROW + i]
        pitch_rate = work[_FLIGHT + 3 * ROW + i]
        ankle_rate = work[_FLIGHT + 4 * ROW + i]
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
                for k in range(_SWAPPED):
                    place = k * ROW
                    work[place + i], work[place + n] = work[place + n], work[place + i]
                i += 1
    return i


@inlined
def _end(work, n, outcomes):
    """Heel strikes and falls, written to the walkers' rows of ``outcomes``."""
    for i in range(padded(n)):
        outcome = finish(_load_stance(work, i), work[_HEADING + i], _load_flight(work, i))
        _store_outcome(work, i, outcome)
    for i in range(n):
        who = int(work[_WHO + i])
        for k in range(_OUTCOMES):
            outcomes[who, k] = work[_OUTCOME + k * ROW + i]


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
            for i in range(padded(flying)):
                flight = _load_flight(work, i)
                onward = advance(_load_stance(work, i), flight)
                if flight.status == FLYING:
                    _store_flight(work, i, onward)
            flying = _gather_flying(work, flying)
        _end(work, n, outcomes)
