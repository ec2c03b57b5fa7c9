"""Fixed points of section maps: the root finder, and following one along a path of maps."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from scipy.optimize import root

from lean_yaw_env.analysis.section_map import SectionMap
from lean_yaw_env.errors import LeanYawError, NoGaitError
from lean_yaw_env.parameters import Vector

RESIDUAL_LIMIT = 1e-12
"""Largest change of any coordinate over the map that still counts as a fixed point."""
_FIRST_PIECE = 0.25
_SMALLEST_PIECE = 1.0 / 256.0

Map = TypeVar("Map", bound=SectionMap)


def solve_fixed_point(section_map: SectionMap, guess: Vector, *, exact: bool = True) -> Vector:
    """The fixed point that the root finder reaches from a guess.

    Parameters
    ----------
    section_map : SectionMap
    guess : shape (5,) or (6,)
        Coordinates that are not free stay as they are.
    exact : bool
        With the exact Jacobian; otherwise the root finder estimates its own slopes, so that
        nothing but the step itself is compiled.

    Raises
    ------
    NoGaitError
        If it stops anywhere else; says why.
    """
    free = section_map.free

    def full(x: Vector) -> Vector:
        state = guess.copy()
        state[free] = x
        return state

    def change(x: Vector) -> Vector:
        state = full(x)
        return (section_map.image(state) - state)[free]

    def slope(x: Vector) -> Vector:
        matrix = section_map.derivative(full(x))[1]
        return matrix[np.ix_(free, free)] - np.eye(len(free))

    try:
        solution = root(change, guess[free], jac=slope if exact else None, options={"xtol": 1e-15})
        residual = float(np.abs(change(solution.x)).max())
    except (LeanYawError, ValueError, np.linalg.LinAlgError) as error:
        raise NoGaitError(str(error)) from error
    if not residual <= RESIDUAL_LIMIT:
        raise NoGaitError(f"the root finder stopped at a residual of {residual:.1e}")
    return full(solution.x)


def follow_fixed_point(
    path: Callable[[float], Map], start: Vector, *, exact: bool = True
) -> tuple[Map, Vector]:
    """Follow a fixed point along a path of maps from 0 to 1, in pieces that shrink where it fails.

    Parameters
    ----------
    path : function of [0, 1]
        Gives the map there.
    start : shape (5,) or (6,)
        The fixed point of ``path(0)``, or a guess of it.

    Returns
    -------
    map, state
        At the end of the path.

    Raises
    ------
    NoGaitError
        If it cannot be followed to the end; says how far it came.
    """
    state = solve_fixed_point(path(0.0), start, exact=exact)
    reached, piece = 0.0, _FIRST_PIECE
    previous: tuple[float, Vector] | None = None
    while reached < 1.0:
        target = min(1.0, reached + piece)
        guess = state
        if previous is not None:
            share = (target - reached) / (reached - previous[0])
            guess = state + share * (state - previous[1])
        try:
            found = solve_fixed_point(path(target), guess, exact=exact)
        except NoGaitError as error:
            piece *= 0.5
            if piece < _SMALLEST_PIECE:
                raise NoGaitError(f"it ended at {reached:.3f} of the way: {error}") from error
            continue
        previous, reached, state = (reached, state), target, found
        piece *= 1.5
    return path(1.0), state
