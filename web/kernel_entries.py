"""The kernel's functions as a web page calls them: flat rows of doubles in memory, one pointer each.

Every row's layout follows from the fields of the kernel's records; ``build_kernel`` writes the names down for the page.
A row of inputs holds a ``Body``, a ``Command``, the section state and the side of the foot that stands (+1 left, -1 right). The passive
walker's has no command, six coordinates, and before the side the swing leg's angle at the start, or NaN for both feet on the floor.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import carray, njit, types

from lean_yaw_env.kernel.blocks import block_of
from lean_yaw_env.kernel.jacobian import OUTPUTS, step_jacobians
from lean_yaw_env.kernel.passive import (
    INPUTS as PASSIVE_INPUTS,
)
from lean_yaw_env.kernel.passive import (
    PassiveOutcome,
    passive_jacobian,
    passive_trace,
)
from lean_yaw_env.kernel.passive import (
    passive_step as passive_walking_step,
)
from lean_yaw_env.kernel.records import STEPPED, Body, Command, Outcome, SectionState
from lean_yaw_env.kernel.step import ACTIVE, walking_step
from lean_yaw_env.kernel.trace import COLUMNS, trace

STATE_SIZE = len(SectionState._fields)
INPUTS = STATE_SIZE + len(Command._fields)
PASSIVE_STATE_SIZE = STATE_SIZE + 1
PASSIVE_COLUMNS = 8  # of ``passive_trace``

BODY = len(Body._fields)
COMMAND = len(Command._fields)
STATE = BODY + COMMAND
SIDE = STATE + STATE_SIZE
WALKER_ROW = SIDE + 1
INTER_LEG = BODY + PASSIVE_STATE_SIZE
PASSIVE_SIDE = INTER_LEG + 1
PASSIVE_ROW = PASSIVE_SIDE + 1

_OUTCOME = len(Outcome._fields)
_PASSIVE_OUTCOME = len(PassiveOutcome._fields)
_STATUS = Outcome._fields.index("status")
_IN_FORCE = Outcome._fields.index("mass_offset")
_BEFORE = BODY + Command._fields.index("previous_offset")
_PASSIVE_STATUS = PassiveOutcome._fields.index("status")
_SWING = PassiveOutcome._fields.index("inter_leg_angle")

_compiled: Any = njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)


def _reader(record: Any, first: int) -> Any:
    """A formula that reads a record from a row, from column ``first`` on."""
    numbers = ", ".join(f"row[{first + k}]" for k in range(len(record._fields)))
    names: dict[str, Any] = {"record": record}
    exec(f"def read(row):\n    return record({numbers})", names)
    return _compiled(names["read"])


_body = _reader(Body, 0)
_command = _reader(Command, BODY)


@_compiled
def _walk_step(row, outcome):
    s = STATE
    result = walking_step(
        _body(row), _command(row), row[s], row[s + 1], row[s + 2], row[s + 3], row[s + 4], row[SIDE]
    )
    for k, value in enumerate(result):
        outcome[k] = value


@_compiled
def _swing_step(row, outcome):
    s = BODY
    result = passive_walking_step(
        _body(row),
        row[s],
        row[s + 1],
        row[s + 2],
        row[s + 3],
        row[s + 4],
        row[s + 5],
        row[INTER_LEG],
        row[PASSIVE_SIDE],
    )
    for k, value in enumerate(result):
        outcome[k] = value


def walker_step(inputs, outcome):
    """One step of the walker."""
    _walk_step(carray(inputs, WALKER_ROW), carray(outcome, _OUTCOME))


def walker_trace(inputs, duration, n, rows):
    """The motion within a step at ``n`` uniform times from 0 to ``duration``."""
    row, s = carray(inputs, WALKER_ROW), STATE
    trace(
        _body(row),
        _command(row),
        row[s],
        row[s + 1],
        row[s + 2],
        row[s + 3],
        row[s + 4],
        row[SIDE],
        duration,
        carray(rows, (n, len(COLUMNS))),
    )


def walker_jacobian(inputs, state, jacobian):
    """The next section state and the derivatives of all outputs; returns the status."""
    rows, status = carray(inputs, (1, WALKER_ROW)), np.empty(1)
    step_jacobians(
        rows[:, :BODY].copy(),
        rows[:, BODY:STATE].copy(),
        rows[:, STATE:SIDE].copy(),
        rows[:, SIDE].copy(),
        status,
        carray(state, (1, STATE_SIZE)),
        carray(jacobian, (1, len(OUTPUTS), INPUTS)),
        0,
        1,
    )
    return status[0]


def walker_walk(inputs, n, outcome):
    """Up to ``n`` steps at the same command; returns how many were completed. The row of inputs ends where the last step began."""
    row, result = carray(inputs, WALKER_ROW), carray(outcome, _OUTCOME)
    for k in range(n):
        _walk_step(row, result)
        if result[_STATUS] != STEPPED:
            return k
        for i in range(STATE_SIZE):
            row[STATE + i] = result[i]
        row[_BEFORE] = result[_IN_FORCE]
        row[SIDE] = -row[SIDE]
    return n


def passive_step(inputs, outcome):
    """One step of the passive walker."""
    _swing_step(carray(inputs, PASSIVE_ROW), carray(outcome, _PASSIVE_OUTCOME))


def passive_motion(inputs, duration, n, rows):
    """The passive motion within a step at ``n`` uniform times from 0 to ``duration``."""
    row = carray(inputs, PASSIVE_ROW)
    passive_trace(
        _body(row),
        row[BODY:INTER_LEG],
        row[INTER_LEG],
        row[PASSIVE_SIDE],
        duration,
        carray(rows, (n, PASSIVE_COLUMNS)),
    )


def passive_derivative(inputs, state, jacobian):
    """The next section state and its derivatives, both feet on the floor; returns the status."""
    row = carray(inputs, PASSIVE_ROW)
    return passive_jacobian(
        _body(row),
        row[BODY:INTER_LEG],
        row[PASSIVE_SIDE],
        carray(state, PASSIVE_STATE_SIZE),
        carray(jacobian, (PASSIVE_STATE_SIZE, PASSIVE_INPUTS)),
    )


def passive_walk(inputs, n, outcome):
    """Up to ``n`` passive steps; returns how many were completed. The row of inputs ends where the last step began."""
    row, result = carray(inputs, PASSIVE_ROW), carray(outcome, _PASSIVE_OUTCOME)
    for k in range(n):
        _swing_step(row, result)
        if result[_PASSIVE_STATUS] != STEPPED:
            return k
        for i in range(PASSIVE_STATE_SIZE):
            row[BODY + i] = result[i]
        row[INTER_LEG] = result[_SWING]
        row[PASSIVE_SIDE] = -row[PASSIVE_SIDE]
    return n


_STEPS, _DERIVATIVES = block_of(ACTIVE), block_of(ACTIVE, ACTIVE.inputs, ACTIVE.outputs)
_STEPS_SIZE, _DERIVATIVES_SIZE = _STEPS.size, _DERIVATIVES.size
_careful_step, _careful_derivatives = _STEPS.carefully, _DERIVATIVES.carefully


def lean_yaw_careful_step(work, i):
    """The step in lane ``i`` of a work array, for the kernel's own code."""
    _careful_step(carray(work, _STEPS_SIZE), i)


def lean_yaw_careful_step_derivatives(work, i):
    """The same with derivatives."""
    _careful_derivatives(carray(work, _DERIVATIVES_SIZE), i)


_row, _count, _number = types.CPointer(types.float64), types.int32, types.float64

ENTRIES = {
    walker_step: types.void(_row, _row),
    walker_trace: types.void(_row, _number, _count, _row),
    walker_jacobian: _number(_row, _row, _row),
    walker_walk: _count(_row, _count, _row),
    passive_step: types.void(_row, _row),
    passive_motion: types.void(_row, _number, _count, _row),
    passive_derivative: _number(_row, _row, _row),
    passive_walk: _count(_row, _count, _row),
}
"""What the module exports, with its signatures."""

APART = {
    lean_yaw_careful_step: types.void(_row, types.int64),
    lean_yaw_careful_step_derivatives: types.void(_row, types.int64),
}
"""What the kernel calls by its name (``compiled_apart``), with its signatures."""
