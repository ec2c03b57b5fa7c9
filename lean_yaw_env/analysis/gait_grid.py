"""Gaits of many active walkers at once: Newton's method on all of them by compiled batches."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.analysis.fixed_point import RESIDUAL_LIMIT
from lean_yaw_env.kernel.batch import step_batch
from lean_yaw_env.kernel.jacobian import step_jacobians
from lean_yaw_env.kernel.records import STEPPED, Body, Outcome
from lean_yaw_env.parameters import MIRROR, QUARTER_TURN, STATE_SIZE, Vector

_NEWTON_STEPS = 30
_FIRST_PIECE = 0.25
_SMALLEST_PIECE = 1.0 / 64.0
_SLOPE = Body._fields.index("slope")
_SLOPE_TURNS = Body._fields.index("slope_turns")
_HIP_WIDTH = Body._fields.index("hip_width")
_STATUS = Outcome._fields.index("status")


@dataclass(frozen=True)
class WalkerGrid:
    """``n`` active walkers with their commands.

    Attributes
    ----------
    bodies : shape (n, 11)
        In the order of ``kernel.records.Body``.
    inter_leg_angles : shape (n,)
    offsets : shape (n, 2)
        In force while the left and while the right foot stands.
    """

    bodies: Vector
    inter_leg_angles: Vector
    offsets: Vector

    @property
    def n(self) -> int:
        return len(self.bodies)

    def at(self, index: NDArray[np.intp]) -> WalkerGrid:
        """Some of the walkers."""
        return WalkerGrid(self.bodies[index], self.inter_leg_angles[index], self.offsets[index])

    def towards(self, share: Vector) -> WalkerGrid:
        """With hip width and offsets at a share of their own, shape (n,)."""
        bodies = self.bodies.copy()
        bodies[:, _HIP_WIDTH] *= share
        return WalkerGrid(bodies, self.inter_leg_angles, self.offsets * share[:, None])

    @property
    def is_symmetric(self) -> NDArray[np.bool_]:
        """Whether right steps mirror left ones, shape (n,)."""
        return self.offsets[:, 0] == -self.offsets[:, 1]

    @property
    def has_downhill(self) -> NDArray[np.bool_]:
        """Whether headings differ, shape (n,)."""
        return (self.bodies[:, _SLOPE] != 0.0) & (self.bodies[:, _SLOPE_TURNS] == 0.0)

    def commands(self, foot: int) -> Vector:
        """Commands (n, 3) of steps on the left (0) or right (1) foot."""
        return np.column_stack(
            [self.inter_leg_angles, self.offsets[:, foot], self.offsets[:, 1 - foot]]
        )


@dataclass(frozen=True)
class GridGaits:
    """Gaits of a ``WalkerGrid``; rows where none was found hold nan.

    Attributes
    ----------
    found : shape (n,)
    states : shape (n, 5)
    strides : shape (n, 5, 5)
        Jacobians of the stride.
    outcomes : shape (n, 2, 18)
        Both steps in the order of ``kernel.records.Outcome``.
    """

    found: NDArray[np.bool_]
    states: Vector
    strides: Vector
    outcomes: Vector


def solve_grid(grid: WalkerGrid, guesses: Vector, *, threads: int = 1) -> GridGaits:
    """Newton's method from a guess for each walker, shape (n, 5)."""
    states, found = _newton(grid, guesses, threads)
    return _described(grid, states, found, threads)


def follow_grid(grid: WalkerGrid, starts: Vector, *, threads: int = 1) -> GridGaits:
    """Follow each gait from no hip width and no offset, where ``starts`` (n, 5) are gaits.

    So the gait found is of that branch, where several exist, and none beyond a fold.
    """
    n = grid.n
    reached, piece, known = np.zeros(n), np.full(n, _FIRST_PIECE), np.zeros(n, dtype=int)
    latest, earlier, reached_before = starts.copy(), starts.copy(), np.zeros(n)
    flying = np.arange(n)
    while flying.size:
        target = np.where(known[flying] == 0, 0.0, np.minimum(1.0, reached[flying] + piece[flying]))
        guess = latest[flying]
        behind = known[flying] > 1
        span = np.where(behind, reached[flying] - reached_before[flying], 1.0)
        share = np.where(behind, (target - reached[flying]) / span, 0.0)
        guess = guess + share[:, None] * (guess - earlier[flying])
        state, done = _newton(grid.at(flying).towards(target), guess, threads)
        good, bad = flying[done], flying[~done]
        earlier[good], latest[good] = latest[good], state[done]
        reached_before[good], reached[good] = reached[good], target[done]
        known[good] += 1
        piece[good] *= 1.5
        piece[bad] *= 0.5
        over = (reached >= 1.0) | (piece < _SMALLEST_PIECE)
        over[bad[known[bad] == 0]] = True
        flying = flying[~over[flying]]
    return _described(grid, latest, (reached >= 1.0) & (known > 0), threads)


def _newton(grid: WalkerGrid, guesses: Vector, threads: int) -> tuple[Vector, NDArray[np.bool_]]:
    x, found = guesses.copy(), np.zeros(grid.n, dtype=bool)
    active = np.arange(grid.n)
    for _ in range(_NEWTON_STEPS):
        sane = (np.abs(x[active][:, [1, 2]]) < QUARTER_TURN).all(axis=1)
        sane &= np.isfinite(x[active]).all(axis=1)
        active = active[sane]
        if not active.size:
            break
        some = grid.at(active)
        image, matrix, stepped = _map(some, x[active], threads)
        change = x[active] - image
        slope = matrix - np.eye(STATE_SIZE)
        change[~some.has_downhill, 0] = 0.0
        slope[~some.has_downhill, 0] = np.eye(STATE_SIZE)[0]
        done = stepped & (np.abs(change).max(axis=1) <= RESIDUAL_LIMIT)
        found[active[done]] = True
        going = stepped & ~done
        going[going] = np.abs(np.linalg.det(slope[going])) > 1e-14
        active, change, slope = active[going], change[going], slope[going]
        if active.size:
            x[active] += np.linalg.solve(slope, change[..., None])[..., 0]
    return x, found


def _map(
    grid: WalkerGrid, states: Vector, threads: int
) -> tuple[Vector, Vector, NDArray[np.bool_]]:
    """The section map: a mirrored step of symmetric walkers, a stride of others."""
    image, matrix, stepped = _differentiated(grid, states, 0, threads)
    symmetric = grid.is_symmetric
    image[symmetric] *= MIRROR
    matrix[symmetric] *= MIRROR[:, None]
    rest = np.flatnonzero(~symmetric & stepped)
    if rest.size:
        image[rest], second, stepped[rest] = _differentiated(grid.at(rest), image[rest], 1, threads)
        matrix[rest] = second @ matrix[rest]
    return image, matrix, stepped


def _differentiated(
    grid: WalkerGrid, states: Vector, foot: int, threads: int
) -> tuple[Vector, Vector, NDArray[np.bool_]]:
    n = grid.n
    statuses, afters = np.empty(n), np.empty((n, STATE_SIZE))
    rows = np.empty((n, STATE_SIZE, STATE_SIZE))
    commands, sides = grid.commands(foot), np.full(n, 1.0 - 2.0 * foot)
    bodies, states = np.ascontiguousarray(grid.bodies), np.ascontiguousarray(states)

    def part(first: int, last: int) -> None:
        step_jacobians(bodies, commands, states, sides, statuses, afters, rows, first, last)

    _in_parts(part, n, threads)
    return afters, rows, statuses == STEPPED


def _described(
    grid: WalkerGrid, states: Vector, found: NDArray[np.bool_], threads: int
) -> GridGaits:
    n = grid.n
    strides = np.full((n, STATE_SIZE, STATE_SIZE), np.nan)
    outcomes = np.full((n, 2, len(Outcome._fields)), np.nan)
    index = np.flatnonzero(found)
    if index.size:
        some, start = grid.at(index), np.ascontiguousarray(states[index])
        middle, first, _ = _differentiated(some, start, 0, threads)
        _, second, stepped = _differentiated(some, middle, 1, threads)
        strides[index] = second @ first
        for foot, at in ((0, start), (1, middle)):
            rows = np.empty((index.size, len(Outcome._fields)))
            sides = np.full(index.size, 1.0 - 2.0 * foot)
            bodies, commands = np.ascontiguousarray(some.bodies), some.commands(foot)
            step_batch(bodies, commands, at, sides, rows, 0, index.size)
            outcomes[index, foot] = rows
            stepped &= rows[:, _STATUS] == STEPPED
        found = found.copy()
        found[index[~stepped]] = False
    blank = ~found
    states = states.copy()
    states[blank], strides[blank], outcomes[blank] = np.nan, np.nan, np.nan
    return GridGaits(found, states, strides, outcomes)


def _in_parts(work: Callable[[int, int], None], n: int, threads: int) -> None:
    """Split ``n`` items among threads; the compiled code lets them run at once."""
    if threads == 1 or n < 2 * threads:
        work(0, n)
        return
    bounds = np.linspace(0, n, threads + 1).astype(int).tolist()
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, bounds[:-1], bounds[1:]))
