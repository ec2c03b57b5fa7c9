"""Gaits that repeat after 2, 4 or more steps, past the period doubling of a symmetric one."""

from __future__ import annotations

import numpy as np

from lean_yaw_env.analysis.fixed_point import solve_fixed_point
from lean_yaw_env.analysis.limit_cycle import LimitCycle, cycle_at, find_limit_cycle
from lean_yaw_env.analysis.section_map import SectionMap, section_map_of
from lean_yaw_env.errors import LeanYawError, NoGaitError
from lean_yaw_env.parameters import INTER_LEG_ANGLE, Vector
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.validation import require_count
from lean_yaw_env.walker import Walker

_KICKS = (1e-3, -1e-3, 1e-2, -1e-2)
"""How far along the unstable mode to start, as a share of the state's length."""
_SETTLING = 600
"""Cycles to let the walk settle; slowest just past the doubling."""
_RECURS = 1e-9
_DIFFERENT = 1e-7
"""A cycle whose halves are closer than this has the half period."""


def find_periodic_gait(
    walker: Walker | PassiveWalker | SectionMap,
    *,
    n_steps: int,
    inter_leg_angle: float = INTER_LEG_ANGLE,
    mass_offset: float | tuple[float, float] = 0.0,
) -> LimitCycle:
    """Find a gait that repeats after exactly ``n_steps`` steps, and not after half of them.

    The walk is started a little off the unstable simple gait, along its most unstable mode, left to
    settle, and the cycle it settles to is solved for. So only cycles that attract are found.

    Parameters
    ----------
    walker : Walker, PassiveWalker or SectionMap
    n_steps : even int in [2, 64]
        Steps of one leg: 2 is a gait that limps, 4 its doubling.
    inter_leg_angle, mass_offset : see ``find_limit_cycle``

    Raises
    ------
    NoGaitError
        If the walk settles to no such cycle; says what it did.
    ValueError
        If an argument is outside its range.
    """
    if require_count("n_steps", n_steps, 2, 64) % 2:
        raise ValueError(f"n_steps must be even, got {n_steps!r}")
    single = section_map_of(walker, inter_leg_angle=inter_leg_angle, mass_offset=mass_offset)
    simple = find_limit_cycle(single)
    cycle = single.over(n_steps)
    reasons: list[str] = []
    for kick in _KICKS:
        try:
            settled = _settle(single, _kicked(single, simple.state, kick), cycle.n_steps)
            state = solve_fixed_point(cycle, settled)
            _require_full_period(single, cycle, state)
        except (LeanYawError, ValueError) as error:
            reasons.append(f"kicked by {kick:g}: {error}")
            continue
        return cycle_at(cycle, state)
    raise NoGaitError(f"no gait of {n_steps} steps found; " + "; ".join(reasons))


def _kicked(single: SectionMap, state: Vector, kick: float) -> Vector:
    """The fixed point moved along its most unstable mode."""
    free = single.free
    matrix = single.derivative(state)[1][np.ix_(free, free)]
    values, vectors = np.linalg.eig(matrix)
    direction = np.real(vectors[:, np.argmax(np.abs(values))])
    moved = state.copy()
    moved[free] += kick * np.linalg.norm(state) * direction / np.linalg.norm(direction)
    return moved


def _settle(single: SectionMap, state: Vector, n_steps: int) -> Vector:
    """Walk until the state recurs after ``n_steps``, or for as long as is bearable."""
    cycle = single.over(n_steps)
    for _ in range(_SETTLING):
        after = cycle.image(state)
        if float(np.abs(after - state)[cycle.free].max()) < max(_RECURS, cycle.precision):
            return after
        state = after
    return state


def _require_full_period(single: SectionMap, cycle: SectionMap, state: Vector) -> None:
    """Raise ``NoGaitError`` if the state recurs earlier."""
    half = cycle.n_steps // 2
    if half < single.n_steps:
        return
    apart = (single.over(half).image(state) - state)[cycle.free]
    if float(np.abs(apart).max()) < max(_DIFFERENT, 10.0 * cycle.precision):
        raise NoGaitError(f"the walk settled to a gait of {half} steps or fewer")
