"""Fixed points of section maps: the root finder, and following one along a path of maps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import root

from lean_yaw_env.analysis.section_map import SectionMap
from lean_yaw_env.errors import LeanYawError, NoGaitError
from lean_yaw_env.parameters import Vector

_NEWTON_STEPS = 30
_SHARES = (1.0, 0.5, 0.25, 0.125)
"""Of Newton's step, tried in turn."""
_ROUND_OFF = 1e-16
_FIRST_PIECE = 0.25
_SMALLEST_PIECE = 1.0 / 256.0


def solve_fixed_point(section_map: SectionMap, guess: Vector, *, exact: bool = True) -> Vector:
    """The fixed point that the root finder reaches from a guess (k,); coordinates that are not free stay as they are.

    It is Newton's method with the map's Jacobian or, if not ``exact``, a root finder that estimates its own slopes, so that nothing but the
    step itself is compiled.

    Raises
    ------
    NoGaitError
        If it stops anywhere else; says why.
    """
    solve = _newton if exact else _secant
    try:
        state, residual = solve(section_map, guess)
    except (LeanYawError, ValueError, np.linalg.LinAlgError) as error:
        raise NoGaitError(str(error)) from error
    if not residual <= section_map.precision:
        raise NoGaitError(f"the root finder stopped at a residual of {residual:.1e}")
    return state


def least_change(matrix: Vector, wanted: Vector, precision: float) -> Vector:
    """The smallest solution x of matrix x = wanted, which leaves directions alone that the matrix does not act on.

    ``precision`` is the size, relative to the largest, from which a singular value counts as zero.
    """
    return np.asarray(np.linalg.lstsq(matrix, wanted, rcond=precision)[0], dtype=float)


def side_of_folds(section_map: SectionMap, state: Vector) -> float:
    """A sign, +1 or -1, that a fixed point keeps along a path of maps until it passes a fold: that of det(Jacobian - 1)."""
    free = section_map.free
    matrix = section_map.derivative(state)[1]
    return float(np.sign(np.linalg.det(matrix[np.ix_(free, free)] - np.eye(len(free)))))


def _newton(section_map: SectionMap, guess: Vector) -> tuple[Vector, float]:
    """The state with the smallest residual that rounding allows, and that residual.

    A step that does not make the residual smaller is shortened. Neutral directions are not solved for.
    """
    free = section_map.free
    state = guess.copy()
    change = (section_map.image(state) - state)[free]
    for _ in range(_NEWTON_STEPS):
        size = np.abs(change).max()
        if size <= _ROUND_OFF:
            break
        matrix = section_map.derivative(state)[1]
        slope = matrix[np.ix_(free, free)] - np.eye(len(free))
        way = np.zeros(state.size)
        way[free] = least_change(slope, -change, section_map.precision)
        for share in _SHARES:
            trial = state + share * way
            try:
                after = (section_map.image(trial) - trial)[free]
            except (LeanYawError, ValueError):
                continue
            if np.abs(after).max() < size:
                state, change = trial, after
                break
        else:
            break
    return state, float(np.abs(change).max())


def _secant(section_map: SectionMap, guess: Vector) -> tuple[Vector, float]:
    free = section_map.free

    def full(x: Vector) -> Vector:
        state = guess.copy()
        state[free] = x
        return state

    def change(x: Vector) -> Vector:
        return section_map.image(full(x))[free] - x

    x = root(change, guess[free], options={"xtol": 1e-15}).x
    return full(x), float(np.abs(change(x)).max())


def follow_fixed_point(
    path: Callable[[float], SectionMap],
    start: Vector,
    *,
    exact: bool = True,
    side: float | None = None,
) -> Vector:
    """Follow a fixed point along a path of maps from 0 to 1, in pieces that shrink where it fails.

    Parameters
    ----------
    path : function of [0, 1]
        Gives the map there.
    start : shape (k,)
        The fixed point of ``path(0)``, or a guess of it.
    exact : see ``solve_fixed_point``
    side : +1 or -1, optional
        Only fixed points on this side of folds are followed, see ``side_of_folds``.

    Raises
    ------
    NoGaitError
        If it cannot be followed to the end; says how far it came.
    """
    state = solve_fixed_point(path(0.0), start, exact=exact)
    reached, piece = 0.0, _FIRST_PIECE
    earlier, before = state, -np.inf
    while reached < 1.0:
        target = min(1.0, reached + piece)
        guess = state + (target - reached) / (reached - before) * (state - earlier)
        try:
            found = solve_fixed_point(path(target), guess, exact=exact)
            if side is not None and side_of_folds(path(target), found) != side:
                raise NoGaitError("the root finder went past a fold")
        except NoGaitError as error:
            piece *= 0.5
            if piece < _SMALLEST_PIECE:
                raise NoGaitError(f"it ended at {reached:.3f} of the way: {error}") from error
            continue
        earlier, before, reached, state = state, reached, target, found
        piece *= 1.5
    return state
