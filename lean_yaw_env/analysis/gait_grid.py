"""Gaits of many active walkers at once, by compiled batches.

A Jacobian costs as much as some fifty steps. So Newton's method takes an exact one at first, improves it by Broyden's rule from the steps
walked anyway, and takes another only where the residual does not fall fast.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.analysis.section_map import RESIDUAL_LIMIT
from lean_yaw_env.kernel.batch import step_batch
from lean_yaw_env.kernel.jacobian import step_jacobians
from lean_yaw_env.kernel.records import STEPPED, Body, Outcome
from lean_yaw_env.parameters import MIRROR, QUARTER_TURN, STATE_SIZE, Vector

_JACOBIANS = 6
"""Most exact ones on the way to a fixed point."""
_FAST = 0.7
"""A step that leaves more of the residual than this share asks for a new Jacobian."""
_ON_THE_WAY = 1e-6
"""Residual of gaits that only lead to others."""
_FIRST_PIECE = 0.25
_SMALLEST_PIECE = 1.0 / 64.0
_SLOPE = Body._fields.index("slope")
_SLOPE_TURNS = Body._fields.index("slope_turns")
_HIP_WIDTH = Body._fields.index("hip_width")
_STATUS = Outcome._fields.index("status")

Index = NDArray[np.intp]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class WalkerGrid:
    """``n`` active walkers with their commands.

    ``bodies`` (n, 11) are in the order of ``kernel.records.Body``, ``inter_leg_angles`` (n,). ``offsets`` (n, 2) are in force while the left and
    while the right foot stands. Where a walker ``is_symmetric`` (n,), right steps mirror left ones; a gait is then a fixed point of one
    mirrored step, otherwise of a stride.
    """

    bodies: Vector
    inter_leg_angles: Vector
    offsets: Vector
    is_symmetric: Flags

    @property
    def n(self) -> int:
        return len(self.bodies)

    def at(self, index: Index | Flags) -> WalkerGrid:
        """Some of the walkers."""
        return WalkerGrid(
            self.bodies[index], self.inter_leg_angles[index], self.offsets[index], self.is_symmetric[index]
        )  # fmt: skip

    def towards(self, share: Vector, *, width_first: bool) -> WalkerGrid:
        """On the way (n,), from 0 to 1, from no hip width and no offset: both grow together, or the offsets in the second half."""
        width, offset = (2.0 * share, 2.0 * share - 1.0) if width_first else (share, share)
        bodies = self.bodies.copy()
        bodies[:, _HIP_WIDTH] *= np.minimum(width, 1.0)
        return replace(self, bodies=bodies, offsets=self.offsets * np.maximum(offset, 0.0)[:, None])

    @property
    def has_downhill(self) -> Flags:
        """Whether headings differ, shape (n,)."""
        return (self.bodies[:, _SLOPE] != 0.0) & (self.bodies[:, _SLOPE_TURNS] == 0.0)

    def step(self, states: Vector, foot: int) -> Vector:
        """Outcomes (n, 18) of a step on the left (0) or right (1) foot, in the order of ``kernel.records.Outcome``."""
        rows = np.empty((self.n, len(Outcome._fields)))
        self._run(step_batch, states, foot, rows)
        return rows

    def differentiate(self, states: Vector, foot: int) -> tuple[Vector, Vector, Flags]:
        """States (n, 5) after a step, its Jacobians (n, 5, 5), and whether it was completed (n,)."""
        statuses, afters = np.empty(self.n), np.empty((self.n, STATE_SIZE))
        rows = np.empty((self.n, STATE_SIZE, STATE_SIZE))
        self._run(step_jacobians, states, foot, statuses, afters, rows)
        return afters, rows, statuses == STEPPED

    def _run(
        self, kernel: Callable[..., None], states: Vector, foot: int, *results: Vector
    ) -> None:
        offsets = self.offsets if foot == 0 else self.offsets[:, ::-1]
        commands = np.column_stack([self.inter_leg_angles, offsets])
        given = (
            self.bodies,
            commands,
            np.ascontiguousarray(states),
            np.full(self.n, 1.0 - 2.0 * foot),
        )
        kernel(*given, *results, 0, self.n)

    def residual(self, states: Vector) -> tuple[Vector, Flags]:
        """Change (n, 5) over a mirrored step of symmetric walkers, over a stride of others, and whether it was completed (n,).

        Where headings are all alike, theirs does not count.
        """
        rows = self.step(states, 0)
        image, stepped = rows[:, :STATE_SIZE].copy(), rows[:, _STATUS] == STEPPED
        image[self.is_symmetric] *= MIRROR
        rest = np.flatnonzero(~self.is_symmetric & stepped)
        if rest.size:
            rows = self.at(rest).step(image[rest], 1)
            image[rest], stepped[rest] = rows[:, :STATE_SIZE], rows[:, _STATUS] == STEPPED
        change = image - states
        change[~self.has_downhill, 0] = 0.0
        return change, stepped

    def jacobian(self, states: Vector) -> tuple[Vector, Flags]:
        """Jacobians (n, 5, 5) of the same map, and whether it was completed (n,)."""
        image, matrix, stepped = self.differentiate(states, 0)
        matrix[self.is_symmetric] *= MIRROR[:, None]
        rest = np.flatnonzero(~self.is_symmetric & stepped)
        if rest.size:
            _, second, stepped[rest] = self.at(rest).differentiate(image[rest], 1)
            matrix[rest] = second @ matrix[rest]
        return matrix, stepped


class GridGaits(NamedTuple):
    """Gaits of the walkers ``index`` (m,) of a grid.

    ``states`` (m, 5), the strides' Jacobians ``strides`` (m, 5, 5), and the ``outcomes`` (m, 2, 18) of both steps in the order of
    ``kernel.records.Outcome``.
    """

    index: Index
    states: Vector
    strides: Vector
    outcomes: Vector

    def at(self, some: Flags) -> GridGaits:
        return GridGaits(
            self.index[some], self.states[some], self.strides[some], self.outcomes[some]
        )


def solve_grid(grid: WalkerGrid, guesses: Vector) -> GridGaits:
    """Newton's method from a guess for each walker, shape (n, 5)."""
    search = _Search(grid.n)
    found = search.solve(grid, guesses, np.arange(grid.n), is_last=np.ones(grid.n, dtype=bool))
    return _described(grid, found, search.states, search.matrices)


def follow_grid(grid: WalkerGrid, starts: Vector, in_row: int = 1) -> GridGaits:
    """Follow each gait from no hip width and no offset, where ``starts`` (rows, 5) are gaits.

    So the gait found is of that branch, where several exist, and none beyond a fold. A narrow walker stands no offset: where hip width and
    offsets cannot grow together, the offsets grow last.

    Rows of ``in_row`` walkers differ in their hip widths only, which grow, and have no offsets if they are more than one. Then each gait
    is followed from the one before it in its row, and from no hip width where that fails. A row ends where both fail.
    """
    rows = np.arange(grid.n).reshape(-1, in_row)
    place = np.zeros(len(rows), dtype=np.intp)
    search, found = _Search(len(rows)), np.zeros(grid.n, dtype=bool)
    states, matrices = np.empty((grid.n, STATE_SIZE)), np.empty((grid.n, STATE_SIZE, STATE_SIZE))
    waiting = np.flatnonzero(_is_sane(starts))
    while waiting.size:
        walkers = grid.at(rows[np.arange(len(rows)), np.minimum(place, in_row - 1)])
        going, waiting = _followed(walkers, starts, search, waiting), waiting[:0]
        while going.size:
            here = rows[going, place[going]]
            found[here], states[here], matrices[here] = True, search.states[going], search.matrices[going]  # fmt: skip
            place[going] += 1
            going = going[place[going] < in_row]
            there = rows[going, place[going]]
            guesses = _extrapolated(grid.bodies[:, _HIP_WIDTH], states, there, place[going])
            last = np.ones(going.size, dtype=bool)
            done = search.solve(grid.at(there), guesses, going, last)
            waiting, going = np.append(waiting, going[~done]), going[done]
    return _described(grid, found, states, matrices)


def _extrapolated(widths: Vector, states: Vector, index: Index, place: Index) -> Vector:
    """States of walkers guessed from those of the two before each in its row; of the second walker of a row, that of the first."""
    guesses = states[index - 1]
    some = index[place > 1]
    share = (widths[some] - widths[some - 1]) / (widths[some - 1] - widths[some - 2])
    guesses[place > 1] += share[:, None] * (states[some - 1] - states[some - 2])
    return guesses


def _followed(grid: WalkerGrid, starts: Vector, search: _Search, who: Index) -> Index:
    """Those of some walkers whose gaits can be followed from no hip width and no offset."""
    together = _follow(grid, starts, search, who, width_first=False)
    rest = who[~together & (grid.offsets[who] != 0.0).any(axis=1)]
    after = _follow(grid, starts, search, rest, width_first=True)
    return np.concatenate([who[together], rest[after]])


def _follow(
    grid: WalkerGrid, starts: Vector, search: _Search, who: Index, *, width_first: bool
) -> Flags:
    """Follow the gaits of some walkers; which have come to their end."""
    n = grid.n
    reached, piece = np.zeros(n), np.full(n, _FIRST_PIECE)
    latest, earlier, reached_before = starts.copy(), starts.copy(), np.full(n, np.nan)
    at_start = grid.at(who).towards(reached[who], width_first=width_first)
    flying = search.begin(at_start, starts[who], who)
    while flying.size:
        target = np.minimum(1.0, reached[flying] + piece[flying])
        span = reached[flying] - reached_before[flying]
        share = np.where(np.isnan(span), 0.0, (target - reached[flying]) / span)
        guess = latest[flying] + share[:, None] * (latest[flying] - earlier[flying])
        there = grid.at(flying).towards(target, width_first=width_first)
        done = search.solve(there, guess, flying, target == 1.0)
        good, bad = flying[done], flying[~done]
        earlier[good], latest[good] = latest[good], search.states[good]
        reached_before[good], reached[good] = reached[good], target[done]
        piece[good] *= 1.5
        piece[bad] *= 0.25
        flying = flying[(reached[flying] < 1.0) & (piece[flying] >= _SMALLEST_PIECE)]
    return reached[who] >= 1.0


class _Search:
    """Newton's method for ``n`` walkers, which remembers where each one is and its inverse Jacobian.

    ``states`` (n, 5) are the fixed points where the last search ended well, ``matrices`` (n, 5, 5) the exact Jacobians there of the walkers
    that have come to their end.
    """

    def __init__(self, n: int) -> None:
        self.states = np.full((n, STATE_SIZE), np.nan)
        self.matrices = np.full((n, STATE_SIZE, STATE_SIZE), np.nan)
        self._inverse = np.full((n, STATE_SIZE, STATE_SIZE), np.nan)
        self._side = np.zeros(n)

    def begin(self, grid: WalkerGrid, states: Vector, who: Index) -> Index:
        """Start walkers from fixed points (m, 5); those that can. From then on their gaits on the other side of a fold are no solutions."""
        residual, stepped = grid.residual(states)
        able = np.flatnonzero(stepped & (_size(residual) <= _ON_THE_WAY))
        able = able[self._renew(grid.at(able), states[able], who[able])]
        self._side[who[able]] = np.sign(np.linalg.det(self._inverse[who[able]]))
        return who[able]

    def solve(self, grid: WalkerGrid, guesses: Vector, who: Index, is_last: Flags) -> Flags:
        """Search from guesses (m, 5) for the fixed points of a grid of the m walkers ``who``; whether each was found (m,).

        ``is_last`` says where no further search follows, so that the solution is wanted to round-off.
        """
        limits = np.where(is_last, RESIDUAL_LIMIT, _ON_THE_WAY)
        before = self._inverse[who]
        x, residual = guesses.copy(), np.zeros((grid.n, STATE_SIZE))
        found = np.zeros(grid.n, dtype=bool)
        jacobians = np.zeros(grid.n, dtype=int)
        lacks = np.isnan(self._inverse[who, 0, 0])
        active = np.flatnonzero(_is_sane(x))
        residual[active], stepped = grid.at(active).residual(x[active])
        active = active[stepped]
        while active.size:
            is_done = _size(residual[active]) <= limits[active]
            found[active[is_done]] = True
            active = active[~is_done]
            fresh = active[lacks[active]]
            if fresh.size:
                jacobians[fresh] += 1
                lacks[fresh] = ~self._renew(grid.at(fresh), x[fresh], who[fresh])
                lacks[fresh] |= jacobians[fresh] > _JACOBIANS
                active = active[~lacks[active]]
            step = -_times(self._inverse[who[active]], residual[active])
            x[active] += step
            sane = _is_sane(x[active])
            active, step = active[sane], step[sane]
            after, stepped = grid.at(active).residual(x[active])
            active, step, after = active[stepped], step[stepped], after[stepped]
            lacks[active] = ~(_size(after) <= _FAST * _size(residual[active]))
            self._improve(who[active], step, after - residual[active])
            residual[active] = after
        last = np.flatnonzero(found & is_last)
        found[last] = self._renew(grid.at(last), x[last], who[last])
        last = last[found[last]]
        # once more, without a look: from just below the limit to round-off
        x[last] -= _times(self._inverse[who[last]], residual[last])
        side = self._side[who[found]]
        found[found] = (side == 0.0) | (np.sign(np.linalg.det(self._inverse[who[found]])) == side)
        self.states[who[found]] = x[found]
        self._inverse[who[~found]] = before[~found]
        return found

    def _renew(self, grid: WalkerGrid, states: Vector, who: Index) -> Flags:
        """Take exact Jacobians; whether each exists and lets Newton's method go on."""
        matrix, exists = grid.jacobian(states)
        slope = matrix - np.eye(STATE_SIZE)
        slope[~grid.has_downhill, 0] = np.eye(STATE_SIZE)[0]
        exists[exists] = np.abs(np.linalg.det(slope[exists])) > 1e-14
        self.matrices[who[exists]] = matrix[exists]
        self._inverse[who[exists]] = np.linalg.inv(slope[exists])
        return exists

    def _improve(self, who: Index, step: Vector, change: Vector) -> None:
        """Broyden's rule: the smallest change of the Jacobian that explains what a step has done."""
        inverse = self._inverse[who]
        along = (step[:, :, None] * inverse).sum(axis=1)
        scale = (along * change).sum(axis=1)
        scale[scale == 0.0] = np.inf
        update = (step - _times(inverse, change)) / scale[:, None]
        self._inverse[who] = inverse + update[:, :, None] * along[:, None, :]


def _times(matrices: Vector, vectors: Vector) -> Vector:
    return (matrices * vectors[:, None, :]).sum(axis=2)


def _size(changes: Vector) -> Vector:
    return np.abs(changes).max(axis=1, initial=0.0)


def _is_sane(states: Vector) -> Flags:
    is_upright = np.abs(states[:, 1:3]) < QUARTER_TURN
    return np.isfinite(states).all(axis=1) & np.all(is_upright, axis=1)


def _described(grid: WalkerGrid, found: Flags, states: Vector, matrices: Vector) -> GridGaits:
    """The gaits found, with both steps and the stride's Jacobian."""
    index = np.flatnonzero(found)
    some, states, strides = grid.at(index), states[index], matrices[index]
    first = some.step(states, 0)
    outcomes = np.stack([first, some.step(first[:, :STATE_SIZE], 1)], axis=1)
    strides[some.is_symmetric] = strides[some.is_symmetric] @ strides[some.is_symmetric]
    is_whole = (outcomes[:, :, _STATUS] == STEPPED).all(axis=1)
    return GridGaits(index, states, strides, outcomes).at(is_whole)
