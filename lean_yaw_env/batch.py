"""Many walking steps in one compiled call: the friendly layer over the batch kernel, for analysis, controllers and sampling."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.errors import SolverError
from lean_yaw_env.kernel import records
from lean_yaw_env.kernel.batch import step_batch as step_batch_kernel
from lean_yaw_env.kernel.records import Body, Command, Outcome
from lean_yaw_env.parameters import (
    INTER_LEG_ANGLE,
    QUARTER_TURN,
    STATE_SIZE,
    Vector,
    WalkerParameters,
    require_number,
)
from lean_yaw_env.threads import share_out


class BatchResult:
    """The outcomes of a batch: one attribute for each field of ``kernel.records.Outcome``, each of shape (n,).

    Attributes
    ----------
    states : shape (n, 5)
    statuses : shape (n,)
        ``kernel.records.STEPPED`` or a way to fall.
    stepped : shape (n,), bool
    outcomes : shape (n, 18)
        All fields, in order.
    """

    def __init__(self, outcomes: Vector) -> None:
        self.outcomes = outcomes
        self.states = outcomes[:, :STATE_SIZE]
        self.statuses = outcomes[:, Outcome._fields.index("status")]
        self.stepped: NDArray[np.bool_] = self.statuses == records.STEPPED

    def __getattr__(self, name: str) -> Vector:
        if name not in Outcome._fields:
            raise AttributeError(f"BatchResult has no attribute {name!r}")
        return self.outcomes[:, Outcome._fields.index(name)]


def bodies_of(parameters: WalkerParameters | Sequence[WalkerParameters] | Vector) -> Vector:
    """Parameters as rows (1 or n, 11) of ``kernel.records.Body``; an array of such rows is passed through."""
    if isinstance(parameters, WalkerParameters):
        return np.array([parameters.body()])
    if isinstance(parameters, np.ndarray):
        if parameters.ndim != 2 or parameters.shape[1] != len(Body._fields):
            raise ValueError(
                f"parameters must have shape (n, {len(Body._fields)}), not {parameters.shape}"
            )
        return np.ascontiguousarray(parameters, dtype=float)
    return np.array([each.body() for each in parameters])


def step_batch(
    parameters: WalkerParameters | Sequence[WalkerParameters] | Vector,
    states: ArrayLike,
    sides: ArrayLike,
    *,
    inter_leg_angles: ArrayLike = INTER_LEG_ANGLE,
    mass_offsets: ArrayLike = 0.0,
    previous_offsets: ArrayLike | None = None,
    threads: int = 1,
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

    Raises
    ------
    ValueError
        If a shape does not fit, or a number is outside its range.
    SolverError
        If the integrator gives up on a walker; never for a fall.
    """
    start = np.ascontiguousarray(states, dtype=float)
    if start.ndim != 2 or start.shape[1] != STATE_SIZE:
        raise ValueError(f"states must have shape (n, {STATE_SIZE}), not {start.shape}")
    n = len(start)
    if not np.isfinite(start).all() or not (np.abs(start[:, 1:3]) < QUARTER_TURN).all():
        raise ValueError(
            "states must be finite, with stance pitch and ankle angle within a quarter turn"
        )
    side = _column("sides", sides, n)
    if not (np.abs(side) == 1.0).all():
        raise ValueError("sides must be +1 (left) or -1 (right)")
    commands = np.empty((n, len(Command._fields)))
    commands[:, 0] = _column("inter_leg_angles", inter_leg_angles, n, 0.0, QUARTER_TURN)
    commands[:, 1] = _column("mass_offsets", mass_offsets, n, -1.0, 1.0)
    before = mass_offsets if previous_offsets is None else previous_offsets
    commands[:, 2] = _column("previous_offsets", before, n, -1.0, 1.0)
    bodies = bodies_of(parameters)
    if len(bodies) not in (1, n):
        raise ValueError(f"parameters must be one or {n} walkers', not {len(bodies)}")
    outcomes = np.empty((n, len(Outcome._fields)))
    workers = int(require_number("threads", threads, 1, 1024))
    share_out(
        lambda first, last: step_batch_kernel(bodies, commands, start, side, outcomes, first, last),
        n,
        workers,
    )
    result = BatchResult(outcomes)
    failed = np.flatnonzero(result.statuses == records.FAILED)
    if len(failed):
        raise SolverError(
            f"the step of walker {failed[0]} from {start[failed[0]].tolist()} did not converge"
        )
    return result


def _column(
    name: str, value: ArrayLike, n: int, low: float = -np.inf, high: float = np.inf
) -> Vector:
    array = np.asarray(value, dtype=float)
    if array.shape not in ((), (n,)):
        raise ValueError(f"{name} must be a number or have shape ({n},), not {array.shape}")
    if not ((array >= low) & (array <= high)).all():
        raise ValueError(
            f"{name} must be in [{low:g}, {high:g}], not {array[~((array >= low) & (array <= high))].flat[0] if array.ndim else array}"
        )
    return np.ascontiguousarray(np.broadcast_to(array, (n,)))
