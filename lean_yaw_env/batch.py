"""Many walking steps in one compiled call: the friendly layer over the batch kernel, for analysis, controllers and sampling."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.errors import SolverError
from lean_yaw_env.extras import is_gpu
from lean_yaw_env.kernel import records
from lean_yaw_env.kernel.batch import step_batch as step_batch_kernel
from lean_yaw_env.kernel.bounds import count_outside
from lean_yaw_env.kernel.records import Body, Command, Outcome
from lean_yaw_env.parameters import (
    COMMAND_RANGES,
    INTER_LEG_ANGLE,
    PARAMETER_RANGES,
    STATE_RANGES,
    STATE_SIZE,
    Range,
    Vector,
    WalkerParameters,
)
from lean_yaw_env.threads import MOST_THREADS, share_out
from lean_yaw_env.validation import (
    require_count,
    require_instance,
    require_one_or_each,
    require_shape,
)
from lean_yaw_env.walker import failure_of

_REPEATS = 64  # of a row's ranges: the compiled check goes through so many rows at a time


class _Limits:
    """The ranges of a row's columns, as the compiled check takes them."""

    def __init__(self, ranges: Sequence[Range]) -> None:
        self._ranges = ranges
        # an end that does not belong to its range: the next number inside takes its place
        low = [r.low if r.bounds[0] == "[" else math.nextafter(r.low, math.inf) for r in ranges]
        high = [r.high if r.bounds[1] == "]" else math.nextafter(r.high, -math.inf) for r in ranges]
        self._low, self._high = np.tile(low, _REPEATS), np.tile(high, _REPEATS)

    def check(self, rows: Vector, name: str) -> None:
        """Raise ``ValueError`` for the first number of ``rows`` (n, k) outside its column's range; ``name`` with its row and column."""
        if not count_outside(rows.ravel(), self._low, self._high):
            return
        k = len(self._ranges)
        inside = (rows >= self._low[:k]) & (rows <= self._high[:k])
        row, column = (int(place[0]) for place in np.nonzero(~inside))
        limits = self._ranges[column]
        limits.require(float(rows[row, column]), name.format(row=row, column=limits.name))


_STATE_LIMITS = _Limits(STATE_RANGES)
_COMMAND_LIMITS = _Limits(COMMAND_RANGES)
_BODY_LIMITS = _Limits(
    (*PARAMETER_RANGES, Range("slope_turns", 0.0, 1.0), Range("strike_at_start", 0.0, 1.0))
)


class BatchResult:
    """The outcomes of a batch of ``n`` steps; every attribute holds a row for each walker.

    Attributes
    ----------
    outcomes : shape (n, 18)
        All fields of ``kernel.records.Outcome``, in order; each is an attribute of shape (n,) too.
    states : shape (n, 5)
        Section states just after the heel strikes, or where the walkers were when they fell.
    stepped : shape (n,), bool
        Whether each walker completed its step: its ``status`` is ``kernel.records.STEPPED`` and not a way to fall.
    """

    heading: Vector
    stance_pitch: Vector
    ankle_angle: Vector
    stance_pitch_rate: Vector
    ankle_rate: Vector
    status: Vector
    duration: Vector
    displacement_x: Vector
    displacement_z: Vector
    heading_change: Vector
    mass_offset: Vector
    least_normal_force: Vector
    greatest_friction: Vector
    gravity_work: Vector
    shift_work: Vector
    impact_loss: Vector
    ankle_loss: Vector
    evaluations: Vector

    def __init__(self, outcomes: Vector) -> None:
        self.outcomes = outcomes
        for name, column in zip(Outcome._fields, outcomes.T, strict=True):
            setattr(self, name, column)
        self.states = outcomes[:, :STATE_SIZE]
        self.stepped: NDArray[np.bool_] = self.status == records.STEPPED


def bodies_of(parameters: WalkerParameters | Sequence[WalkerParameters] | Vector) -> Vector:
    """Parameters as rows (1 or n, 11) of ``kernel.records.Body``; an array of such rows is checked and passed through."""
    if isinstance(parameters, WalkerParameters):
        return np.array([parameters.body()])
    if not isinstance(parameters, np.ndarray):
        is_many = isinstance(parameters, Sequence) and not isinstance(parameters, str)
        if not (is_many and parameters):
            raise ValueError(
                f"parameters must be WalkerParameters, or n of them, got {parameters!r}"
            )
        each = [
            require_instance(f"parameters[{i}]", walker, WalkerParameters)
            for i, walker in enumerate(parameters)
        ]
        return np.array([walker.body() for walker in each])
    rows = require_shape("parameters", parameters, (None, len(Body._fields)))
    _BODY_LIMITS.check(rows, "parameters[{row}]: {column}")
    return rows


def step_batch(
    parameters: WalkerParameters | Sequence[WalkerParameters] | Vector,
    states: ArrayLike,
    sides: ArrayLike,
    *,
    inter_leg_angles: ArrayLike = INTER_LEG_ANGLE,
    mass_offsets: ArrayLike = 0.0,
    previous_offsets: ArrayLike | None = None,
    threads: int = 1,
    device: str = "cpu",
) -> BatchResult:
    """Step ``n`` walkers once, bit for bit as ``Walker.step`` does one.

    Parameters
    ----------
    parameters : WalkerParameters, or n of them, or rows (1 or n, 11) of ``kernel.records.Body``
    states : shape (n, 5)
        Section states; see ``STATE_FIELDS``.
    sides : shape (n,) or a number
        +1 where the left foot stands, -1 where the right one does.
    inter_leg_angles, mass_offsets, previous_offsets : shape (n,) or a number
        See ``Walker.step``; by default the masses are at their offsets already.
    threads : int >= 1
    device : "cpu" or "cuda"
        "cuda" steps the walkers on a GPU: experimental, with the extra ``gpu``.

    Raises
    ------
    ValueError
        If a shape does not fit, or a number is outside its range, which is that of ``Walker.step``.
    MissingLibraryError, NoGpuError
        If ``device`` is "cuda", and the extra ``gpu`` is not installed, or there is no GPU.
    SolverError
        If the integrator gives up on a walker; never for a fall.
    """
    start = require_shape("states", states, (None, STATE_SIZE))
    _STATE_LIMITS.check(start, "states[{row}]: {column}")
    n = len(start)
    side = np.ascontiguousarray(require_one_or_each("sides", sides, n))
    other = np.abs(side) != 1.0
    if other.any():
        raise ValueError(f"sides must be +1 (left) or -1 (right), got {side[other][0]}")
    commands = np.empty((n, len(Command._fields)))
    before = mass_offsets if previous_offsets is None else previous_offsets
    commands[:, 0] = require_one_or_each("inter_leg_angles", inter_leg_angles, n)
    commands[:, 1] = require_one_or_each("mass_offsets", mass_offsets, n)
    commands[:, 2] = require_one_or_each("previous_offsets", before, n)
    _COMMAND_LIMITS.check(commands, "{column}s[{row}]")
    bodies = bodies_of(parameters)
    if len(bodies) not in (1, n):
        raise ValueError(f"parameters must be of one or {n} walkers, got {len(bodies)}")
    workers = require_count("threads", threads, 1, MOST_THREADS)
    if is_gpu(device):
        from lean_yaw_env.kernel import cuda

        outcomes = cuda.step_batch(bodies, commands, start, side)
    else:
        outcomes = np.empty((n, len(Outcome._fields)))
        share_out(
            lambda first, last: step_batch_kernel(
                bodies, commands, start, side, outcomes, first, last
            ),
            n,
            workers,
        )
    result = BatchResult(outcomes)
    for i in np.flatnonzero(result.status == records.FAILED)[:1]:
        body, command = Body(*bodies[i % len(bodies)].tolist()), Command(*commands[i].tolist())
        raise SolverError(f"walker {i}: {failure_of(body, command, start[i], float(side[i]))}")
    return result
