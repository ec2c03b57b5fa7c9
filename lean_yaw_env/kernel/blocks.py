"""Steps and derivatives of many walkers: any model's formulas in loops over lanes that LLVM vectorises.

A block keeps a row for each quantity in a flat work array, with places known at compile time, so that the compiler sees rows that cannot
overlap. Lanes still in flight are swapped to the front, past those that have landed or fallen, so that the work follows them. Loops run
over whole vectors: what the lanes of walkers gone hold is computed too, and not used. No fast-math: each walker's result has the bits of a single step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lean_yaw_env.kernel.compilation import inlined
from lean_yaw_env.kernel.lanes import LANES, ROW, lane_reader, lane_writer, padded
from lean_yaw_env.kernel.records import FLYING, WITHOUT_DERIVATIVE, Body

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


class _Block(NamedTuple):
    """Where a block's rows are, and what is done to its lanes."""

    state: int
    command: int
    body: int
    side: int
    seeds: int
    who: int
    outcome: int
    derivatives: int
    size: int
    begin: Any
    fly: Any
    finish: Any


def _block(model: Model, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> _Block:
    """A block whose lanes carry derivatives by ``inputs`` of ``outputs``, if there are any."""
    records = (model.stance, model.flight)
    carried = [
        [name for name in record._fields if inputs and name not in WITHOUT_DERIVATIVE]
        for record in records
    ]
    stance = 0
    stance_derivatives = stance + len(model.stance._fields) * ROW
    flight = stance_derivatives + len(carried[0]) * ROW
    flight_derivatives = flight + len(model.flight._fields) * ROW
    who = flight_derivatives + len(carried[1]) * ROW
    swapped = who // ROW + 1  # rows that a lane in flight needs
    status = flight + model.flight._fields.index("status") * ROW
    # What a step starts from is in rows only until the flight begins, in the place of its outcome
    state = outcome = who + ROW
    command = state + len(model.state._fields) * ROW
    body = command + len(model.command._fields) * ROW
    side = body + len(Body._fields) * ROW
    seeds = side + ROW
    derivatives = outcome + len(model.outcome._fields) * ROW
    size = max(seeds + len(inputs) * ROW, derivatives + len(outputs) * ROW)

    def of(record: type[Any]) -> list[str]:
        return [name for name in inputs if name in record._fields]

    command_seeds = seeds + len(of(model.state)) * ROW
    body_seeds = command_seeds + len(of(model.command)) * ROW
    read_state = lane_reader(model.state, state, of(model.state), seeds)
    read_command = lane_reader(model.command, command, of(model.command), command_seeds)
    read_body = lane_reader(Body, body, of(Body), body_seeds)
    read_stance = lane_reader(model.stance, stance, carried[0], stance_derivatives)
    write_stance = lane_writer(model.stance, stance, carried[0], stance_derivatives)
    read_flight = lane_reader(model.flight, flight, carried[1], flight_derivatives)
    write_flight = lane_writer(model.flight, flight, carried[1], flight_derivatives)
    write_outcome = lane_writer(model.outcome, outcome, outputs, derivatives)
    begin_step, advance_step, finish_step = model.begin, model.advance, model.finish

    @inlined
    def begin(work, n):
        """Start the flights of the first ``n`` lanes."""
        for i in range(padded(n)):
            started, flying = begin_step(
                read_body(work, i), read_command(work, i), read_state(work, i), work[side + i]
            )
            write_stance(work, i, started)
            write_flight(work, i, flying)

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
    def fly(work, n):
        """Follow the flights of the first ``n`` lanes to their ends."""
        flying = gather_flying(work, n)
        while flying > 0:
            for i in range(padded(flying)):
                before = read_flight(work, i)
                onward = advance_step(read_stance(work, i), before)
                if before.status == FLYING:
                    write_flight(work, i, onward)
            flying = gather_flying(work, flying)

    @inlined
    def finish(work, n):
        """Put the outcomes of the first ``n`` lanes into their rows."""
        for i in range(padded(n)):
            write_outcome(work, i, finish_step(read_stance(work, i), read_flight(work, i)))

    return _Block(
        state, command, body, side, seeds, who, outcome, derivatives, size, begin, fly, finish
    )


def steps_of(model: Model) -> Any:
    """``run(bodies, commands, states, sides, outcomes, first, last)``: step walkers ``first`` to ``last`` - 1.

    Rows of ``bodies`` (1 or n, 11), ``commands``, ``states`` and ``outcomes`` (n, .) are the model's records; ``sides`` (n,).
    """
    block = _block(model, (), ())
    copy_in, begin, fly, finish = _copied_in(model, block), block.begin, block.fly, block.finish
    who_row, outcome_rows, outcome_size, size = (
        block.who,
        block.outcome,
        len(model.outcome._fields),
        block.size,
    )

    @inlined
    def run(bodies, commands, states, sides, outcomes, first, last):
        work = np.zeros(size)
        for begun in range(first, last, LANES):
            n = min(LANES, last - begun)
            for i in range(n):
                copy_in(work, i, begun + i, bodies, commands, states, sides)
            begin(work, n)
            fly(work, n)
            finish(work, n)
            for i in range(n):
                who = int(work[who_row + i])
                for k in range(outcome_size):
                    outcomes[who, k] = work[outcome_rows + k * ROW + i]

    return run


def derivatives_of(model: Model) -> Any:
    """``run(bodies, commands, states, sides, statuses, outputs, jacobians, first, last)``: differentiate steps by the complex step.

    A lane follows a walker with one of its inputs seeded. Arguments as of ``steps_of``; written: how the steps ended in ``statuses`` (n,),
    the first of the model's outputs in ``outputs`` (n, .), and the derivatives of the first k of them by the first m inputs in
    ``jacobians`` (n, k, m).
    """
    block = _block(model, model.inputs, model.outputs)
    copy_in, begin, fly, finish = _copied_in(model, block), block.begin, block.fly, block.finish
    who_row, seeds, derivative_rows, size = block.who, block.seeds, block.derivatives, block.size
    inputs = len(model.inputs)
    fields = model.outcome._fields
    status_row = block.outcome + fields.index("status") * ROW
    output_rows = tuple(block.outcome + fields.index(name) * ROW for name in model.outputs)

    @inlined
    def run(bodies, commands, states, sides, statuses, outputs, jacobians, first, last):
        work = np.zeros(size)
        columns = jacobians.shape[2]
        together = LANES // columns
        for begun in range(first, last, together):
            n = min(together, last - begun) * columns
            for i in range(n):
                copy_in(work, i, begun + i // columns, bodies, commands, states, sides)
                work[who_row + i] = begun * columns + i
                for k in range(inputs):
                    work[seeds + k * ROW + i] = TINY if k == i % columns else 0.0
            begin(work, n)
            fly(work, n)
            finish(work, n)
            for i in range(n):
                lane = int(work[who_row + i])
                who, column = lane // columns, lane % columns
                for k in range(jacobians.shape[1]):
                    jacobians[who, k, column] = work[derivative_rows + k * ROW + i] / TINY
                if column == 0:
                    statuses[who] = work[status_row + i]
                    for k in range(outputs.shape[1]):
                        outputs[who, k] = work[output_rows[k] + i]

    return run


def _copied_in(model: Model, block: _Block) -> Any:
    """``copy_in(work, i, who, bodies, commands, states, sides)``: what walker ``who`` starts from, into lane ``i``."""
    body_rows, body_size = block.body, len(Body._fields)
    command_rows, command_size = block.command, len(model.command._fields)
    state_rows, state_size = block.state, len(model.state._fields)
    side_row, who_row = block.side, block.who

    @inlined
    def copy_in(work, i, who, bodies, commands, states, sides):
        body = who if bodies.shape[0] > 1 else 0
        for k in range(body_size):
            work[body_rows + k * ROW + i] = bodies[body, k]
        for k in range(command_size):
            work[command_rows + k * ROW + i] = commands[who, k]
        for k in range(state_size):
            work[state_rows + k * ROW + i] = states[who, k]
        work[side_row + i] = sides[who]
        work[who_row + i] = who

    return copy_in
