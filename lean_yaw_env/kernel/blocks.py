"""Steps and derivatives of many walkers: any model's formulas in loops over lanes that LLVM vectorises.

A block keeps a row for each quantity in a flat work array, with places known at compile time, so that the compiler sees rows that cannot
overlap. Lanes still in flight are swapped to the front, past those that have landed or fallen, so that the work follows them. Loops run
over whole vectors: what the lanes of walkers gone hold is computed too, and not used. No fast-math: each walker's result has the bits of a single step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from lean_yaw_env.kernel.compilation import apart, called, inlined
from lean_yaw_env.kernel.lanes import LANES, ROW, lane_reader, lane_writer, padded
from lean_yaw_env.kernel.records import FAILED, FLYING, WITHOUT_DERIVATIVE, Body

# An imaginary part so small that its square vanishes: what it becomes is as many times a derivative, to round-off
TINY = 1e-30


@dataclass(frozen=True)
class Model:
    """A kind of walker as the kernels take it: records of numbers, and formulas from one to the next.

    Parameters
    ----------
    command, state : records of what a step starts from, beside ``Body`` and the side of the foot that stands
    stance : record of what is constant in a step
    flight : record of where the walker is on its way, and its ``status``
    outcome : record of how the step ended, which begins as ``state`` does
    inputs : fields of ``state``, ``command`` and ``Body``, in this order, by which the outcome is differentiated
    outputs : fields of ``outcome`` that are differentiated
    begin : ``begin(body, command, state, side)`` returns the stance and the flight at the start
    advance : ``advance(stance, flight)`` returns the flight an integrator step later
    finish : ``finish(stance, flight)`` returns the outcome of a flight that has ended
    carefully : ``carefully(body, command, state, side)`` returns the outcome of a step that has come out as ``FAILED``, found another way
    name : of what is compiled apart for this model
    """

    command: type[Any]
    state: type[Any]
    stance: type[Any]
    flight: type[Any]
    outcome: type[Any]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    begin: Callable[..., Any]
    advance: Callable[..., Any]
    finish: Callable[..., Any]
    carefully: Callable[..., Any]
    name: str


class Block(NamedTuple):
    """Where a block's rows are, and formulas for its lanes.

    Attributes
    ----------
    who, outcome, derivatives : first places of these rows
    size : of the work array
    ended : first place of the outcomes' status
    name : under which the careful steps are compiled apart
    walk : walks the lanes
    carefully : ``carefully(work, i)`` finds the outcome of lane ``i`` carefully
    walk_carefully : ``walk_carefully(body, command, state, side)`` returns the outcome of one step, through a lane
    """

    who: int
    outcome: int
    derivatives: int
    size: int
    ended: int
    name: str
    walk: Any
    carefully: Any
    walk_carefully: Any


@lru_cache
def block_of(model: Model, inputs: tuple[str, ...] = (), outputs: tuple[str, ...] = ()) -> Block:
    """A block whose lanes carry derivatives by ``inputs`` of ``outputs``, if there are any."""

    def rows(record: type[Any]) -> int:
        return len(record._fields) * ROW

    def carried(record: type[Any]) -> list[str]:
        return [name for name in record._fields if inputs and name not in WITHOUT_DERIVATIVE]

    def among(record: type[Any]) -> list[str]:
        return [name for name in inputs if name in record._fields]

    stance = 0
    stance_derivatives = stance + rows(model.stance)
    flight = stance_derivatives + len(carried(model.stance)) * ROW
    flight_derivatives = flight + rows(model.flight)
    who = flight_derivatives + len(carried(model.flight)) * ROW
    # What a step starts from is in rows only until the flight begins, in the place of its outcome
    state = outcome = who + ROW
    command = state + rows(model.state)
    body = command + rows(model.command)
    side = body + rows(Body)
    seeds = side + ROW
    command_seeds = seeds + len(among(model.state)) * ROW
    body_seeds = command_seeds + len(among(model.command)) * ROW
    derivatives = outcome + rows(model.outcome)

    formulas = _Formulas(
        lane_reader(model.state, state, among(model.state), seeds),
        lane_reader(model.command, command, among(model.command), command_seeds),
        lane_reader(Body, body, among(Body), body_seeds),
        lane_reader(model.stance, stance, carried(model.stance), stance_derivatives),
        lane_writer(model.stance, stance, carried(model.stance), stance_derivatives),
        lane_reader(model.flight, flight, carried(model.flight), flight_derivatives),
        lane_writer(model.flight, flight, carried(model.flight), flight_derivatives),
        lane_writer(model.outcome, outcome, outputs, derivatives),
    )
    places = _Places(
        state, command, body, side, seeds, who,
        flight + model.flight._fields.index("status") * ROW,
        outcome + model.outcome._fields.index("status") * ROW,
    )  # fmt: skip
    size = max(seeds + len(inputs) * ROW, derivatives + len(outputs) * ROW)
    name = model.name + ("_derivatives" if inputs else "")
    walk, carefully = _walk(model, places, formulas, len(inputs), name)

    write_state, write_command = (
        lane_writer(model.state, state),
        lane_writer(model.command, command),
    )
    write_body, read_outcome = lane_writer(Body, body), lane_reader(model.outcome, outcome)
    called_apart = apart(name)

    @called
    def walk_carefully(a_body, a_command, a_state, a_side):
        work = np.zeros(size)
        write_body(work, 0, a_body)
        write_command(work, 0, a_command)
        write_state(work, 0, a_state)
        work[side] = a_side
        called_apart(work, 0)
        return read_outcome(work, 0)

    return Block(
        who, outcome, derivatives, size, places.ended, name, walk, carefully, walk_carefully
    )


class _Formulas(NamedTuple):
    """What reads and writes a block's records."""

    read_state: Any
    read_command: Any
    read_body: Any
    read_stance: Any
    write_stance: Any
    read_flight: Any
    write_flight: Any
    write_outcome: Any


class _Places(NamedTuple):
    """The first places of a block's rows."""

    state: int
    command: int
    body: int
    side: int
    seeds: int
    who: int
    status: int
    ended: int  # the outcome's status


def _walk(model: Model, places: _Places, formulas: _Formulas, inputs: int, name: str) -> Any:
    """``walk(work, first, n, columns, bodies, commands, states, sides)``: follow ``n`` lanes to their outcomes.

    Lane ``first`` + i is that of walker (``first`` + i) // ``columns``, differentiated by the input of number (``first`` + i) % ``columns``.
    """
    state, command, body, side, seeds, who, status, ended = places
    read_state, read_command, read_body, read_stance = formulas[:4]
    write_stance, read_flight, write_flight, write_outcome = formulas[4:]
    begin, advance, finish, carefully = model.begin, model.advance, model.finish, model.carefully
    states_size, commands_size, bodies_size = (
        len(record._fields) for record in (model.state, model.command, Body)
    )
    swapped = who // ROW + 1  # rows that a lane in flight needs
    called_apart = apart(name)

    @inlined
    def enter(work, i, lane, columns, bodies, commands, states, sides):
        """Put what a step starts from into lane ``i``."""
        walker, column = lane // columns, lane % columns
        for k in range(states_size):
            work[state + k * ROW + i] = states[walker, k]
        for k in range(commands_size):
            work[command + k * ROW + i] = commands[walker, k]
        row = walker if bodies.shape[0] > 1 else 0
        for k in range(bodies_size):
            work[body + k * ROW + i] = bodies[row, k]
        work[side + i] = sides[walker]
        for k in range(inputs):
            work[seeds + k * ROW + i] = TINY if k == column else 0.0
        work[who + i] = lane

    @inlined
    def gather_flying(work, n):
        """Swap lanes so that those in flight come first, of ``n``; return how many they are."""
        i = 0
        while i < n:
            if work[status + i] == FLYING:
                i += 1
            else:
                n -= 1
                if work[status + n] == FLYING:
                    for k in range(swapped):
                        place = k * ROW
                        work[place + i], work[place + n] = work[place + n], work[place + i]
                    i += 1
        return i

    @inlined
    def walk(work, first, n, columns, bodies, commands, states, sides):
        for i in range(n):
            enter(work, i, first + i, columns, bodies, commands, states, sides)
        for i in range(padded(n)):
            stance, flight = begin(
                read_body(work, i), read_command(work, i), read_state(work, i), work[side + i]
            )
            write_stance(work, i, stance)
            write_flight(work, i, flight)
        flying = gather_flying(work, n)
        while flying > 0:
            for i in range(padded(flying)):
                flight = read_flight(work, i)
                onward = advance(read_stance(work, i), flight)
                if flight.status == FLYING:
                    write_flight(work, i, onward)
            flying = gather_flying(work, flying)
        for i in range(padded(n)):
            write_outcome(work, i, finish(read_stance(work, i), read_flight(work, i)))
        for i in range(n):
            if work[ended + i] == FAILED:
                enter(work, i, int(work[who + i]), columns, bodies, commands, states, sides)
                called_apart(work, i)

    @inlined
    def walk_carefully(work, i):
        found = carefully(
            read_body(work, i), read_command(work, i), read_state(work, i), work[side + i]
        )
        write_outcome(work, i, found)

    return walk, walk_carefully


def steps_of(model: Model) -> Any:
    """``run(bodies, commands, states, sides, outcomes, first, last)``: step walkers ``first`` to ``last`` - 1.

    Rows of ``bodies`` (1 or n, 11), ``commands``, ``states`` and ``outcomes`` (n, .) are the model's records; ``sides`` (n,).
    """
    block = block_of(model)
    who, outcome, size, walk = block.who, block.outcome, block.size, block.walk
    fields = len(model.outcome._fields)

    @inlined
    def run(bodies, commands, states, sides, outcomes, first, last):
        work = np.zeros(size)
        for begun in range(first, last, LANES):
            n = min(LANES, last - begun)
            walk(work, begun, n, 1, bodies, commands, states, sides)
            for i in range(n):
                walker = int(work[who + i])
                for k in range(fields):
                    outcomes[walker, k] = work[outcome + k * ROW + i]

    return run


def derivatives_of(model: Model) -> Any:
    """``run(bodies, commands, states, sides, statuses, outputs, jacobians, first, last)``: differentiate steps by the complex step.

    A lane follows a walker with one of its inputs seeded. Arguments as of ``steps_of``; written: how the steps ended in ``statuses`` (n,),
    the first of the model's outputs in ``outputs`` (n, .), and the derivatives of the first k of them by the first m inputs in
    ``jacobians`` (n, k, m).
    """
    block = block_of(model, model.inputs, model.outputs)
    who, outcome, derivatives, size, walk = *block[:4], block.walk
    fields = model.outcome._fields
    status = outcome + fields.index("status") * ROW
    values = tuple(outcome + fields.index(name) * ROW for name in model.outputs)

    @inlined
    def run(bodies, commands, states, sides, statuses, outputs, jacobians, first, last):
        work = np.zeros(size)
        columns = jacobians.shape[2]
        together = LANES // columns
        for begun in range(first, last, together):
            n = min(together, last - begun) * columns
            walk(work, begun * columns, n, columns, bodies, commands, states, sides)
            for i in range(n):
                lane = int(work[who + i])
                walker, column = lane // columns, lane % columns
                for k in range(jacobians.shape[1]):
                    jacobians[walker, k, column] = work[derivatives + k * ROW + i] / TINY
                if column == 0:
                    statuses[walker] = work[status + i]
                    for k in range(outputs.shape[1]):
                        outputs[walker, k] = work[values[k] + i]

    return run
