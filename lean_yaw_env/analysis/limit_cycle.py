"""Limit cycles of the active walker: fixed points of the stride map, found by a root finder with the exact Jacobian.

Iterating strides finds no gait in practice: Table 1's converges by 0.986 a stride.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from lean_yaw_env.analysis.stride import stride_jacobian, stride_map
from lean_yaw_env.errors import LeanYawError, NoGaitError
from lean_yaw_env.parameters import (
    INTER_LEG_ANGLE,
    Vector,
    require_inter_leg_angle,
    require_mass_offset,
)
from lean_yaw_env.walker import Walker

RESIDUAL_LIMIT = 1e-12
"""Largest change of any coordinate over a stride that still counts as a fixed point."""
_SMALLEST_PIECE = 1.0 / 256.0


@dataclass(frozen=True)
class LimitCycle:
    """A periodic gait of two steps.

    Attributes
    ----------
    state : shape (5,)
        Section state on the left foot.
    eigenvalues : shape (5,), complex
        Of the stride map's Jacobian (the Floquet multipliers), by falling magnitude; all below one is stable. On a slope that turns with
        the walker the heading is free, its multiplier of one is left out, and the shape is (4,).
    stride_period, speed, step_length : float
        Duration of two steps; path length between footprints' stride chord divided by it; half of that chord.
    turn : float
        Heading gained per stride, rad: zero but on a slope that turns with the walker.
    residual : float
        Largest change of any coordinate over the stride (not counting ``turn``).
    """

    state: Vector
    eigenvalues: NDArray[np.complex128]
    stride_period: float
    speed: float
    step_length: float
    turn: float
    residual: float

    @property
    def is_stable(self) -> bool:
        """Whether small disturbances die out."""
        return bool(np.abs(self.eigenvalues).max() < 1.0)


def planar_gait_rate(walker: Walker, inter_leg_angle: float, heading: float = 0.0) -> float:
    """Stance pitch rate just after heel strike of the planar active walker (no hip width), in closed form.

    One step multiplies the squared rate by k^2, k the planar impact's ratio, after gravity has added the slope's work. Returns nan where the slope
    gives no energy, or no impact takes any.
    """
    r, slope = walker.parameters.foot_radius, walker.parameters.slope
    half = 0.5 * inter_leg_angle
    level = r + (1.0 - r) * math.cos(half)
    lift = (1.0 - r) * math.sin(half)
    inertia = level**2 + lift**2
    kept = (level**2 - lift**2) / inertia
    step_length = 2.0 * (r * half + lift)
    gained = 2.0 * step_length * math.sin(slope) * math.cos(heading) / inertia
    if gained <= 0.0 or kept**2 >= 1.0:
        return math.nan
    return -math.sqrt(gained * kept**2 / (1.0 - kept**2))


def find_limit_cycle(
    walker: Walker, *, inter_leg_angle: float = INTER_LEG_ANGLE, mass_offset: float = 0.0
) -> LimitCycle:
    """Find the gait at a constant command, with its multipliers.

    Parameters
    ----------
    walker : Walker
    inter_leg_angle : (0, pi/2)
    mass_offset : [-1, 1]
        An offset that the slope can balance, sin(heading) = -offset / tan(slope), gives a gait across the slope.

    Raises
    ------
    NoGaitError
        If no gait was found; says what was tried.
    ValueError
        If an argument is outside its range.
    """
    command = _Command(require_inter_leg_angle(inter_leg_angle), require_mass_offset(mass_offset))
    state = _search(walker, command, exact=True)
    first, second = stride_map(walker, state, **command.keywords)
    jacobian = stride_jacobian(walker, state, **command.keywords).matrix
    free = _free_coordinates(walker)
    eigenvalues = np.linalg.eigvals(jacobian[np.ix_(free, free)]).astype(complex)
    period = first.duration + second.duration
    stride = float(np.linalg.norm(first.displacement + second.displacement))
    change = second.state - state
    return LimitCycle(
        state=state,
        eigenvalues=eigenvalues[np.lexsort((-eigenvalues.imag, -np.abs(eigenvalues)))],
        stride_period=period,
        speed=stride / period,
        step_length=0.5 * stride,
        turn=float(change[0]) if walker.parameters.slope_turns else 0.0,
        residual=float(np.abs(change[free]).max()),
    )


def find_gait(
    walker: Walker, *, inter_leg_angle: float = INTER_LEG_ANGLE, mass_offset: float = 0.0
) -> Vector:
    """The section state of ``find_limit_cycle`` alone, on the left foot, to the same residual.

    The root finder estimates its own slopes here, so that nothing but the step itself is compiled.

    Raises
    ------
    NoGaitError, ValueError
        As ``find_limit_cycle``.
    """
    command = _Command(require_inter_leg_angle(inter_leg_angle), require_mass_offset(mass_offset))
    return _search(walker, command, exact=False)


@dataclass(frozen=True)
class _Command:
    inter_leg_angle: float
    mass_offset: float

    @property
    def keywords(self) -> dict[str, float]:
        return {"inter_leg_angle": self.inter_leg_angle, "mass_offset": self.mass_offset}


def _free_coordinates(walker: Walker) -> slice | list[int]:
    """Coordinates that a gait repeats: all, but for the heading where the slope turns with the walker."""
    return [1, 2, 3, 4] if walker.parameters.slope_turns else [0, 1, 2, 3, 4]


def _search(walker: Walker, command: _Command, exact: bool) -> Vector:
    """Solve from the planar gait's closed form; failing that, follow the gait from no hip width and no offset."""
    tried: list[str] = []
    guess = _planar_guess(walker, command)
    if guess is not None:
        found = _solve(walker, command, guess, exact, tried, "the planar gait")
        if found is not None:
            return found
        found = _follow(walker, command, exact, tried)
        if found is not None:
            return found
    else:
        tried.append("the planar gait has no closed form here: the slope gives no energy along any heading that balances the offset")
    raise NoGaitError(
        f"no gait found for {walker.parameters} with inter-leg angle {command.inter_leg_angle:g} and "
        f"mass offset {command.mass_offset:g}; tried: " + "; ".join(tried)
    )


def _planar_guess(walker: Walker, command: _Command) -> Vector | None:
    heading = 0.0
    if command.mass_offset != 0.0 and not walker.parameters.slope_turns:
        sine = -command.mass_offset / math.tan(walker.parameters.slope or math.inf)
        if abs(sine) >= 1.0:
            return None
        heading = math.asin(sine)
    rate = planar_gait_rate(walker, command.inter_leg_angle, heading)
    if math.isnan(rate):
        return None
    return np.array([heading, 0.5 * command.inter_leg_angle, 0.0, rate, 0.0])


def _follow(walker: Walker, command: _Command, exact: bool, tried: list[str]) -> Vector | None:
    """Raise hip width and offset together from zero, in pieces that shrink where the solver fails."""

    def at(fraction: float) -> tuple[Walker, _Command]:
        width = fraction * walker.parameters.hip_width
        return (
            Walker(replace(walker.parameters, hip_width=width)),
            replace(command, mass_offset=fraction * command.mass_offset),
        )

    start = _planar_guess(*at(0.0))
    if start is None:
        return None
    reached, piece, state = 0.0, 0.25, start
    previous: tuple[float, Vector] | None = None
    while reached < 1.0:
        target = min(1.0, reached + piece)
        guess = state
        if previous is not None:
            share = (target - reached) / (reached - previous[0])
            guess = state + share * (state - previous[1])
        found = _solve(*at(target), guess, exact, [], "")
        if found is None:
            piece *= 0.5
            if piece < _SMALLEST_PIECE:
                tried.append(
                    f"following the gait from no hip width and no offset, which ended at {reached:.3f} of both"
                )
                return None
            continue
        previous, reached, state = (reached, state), target, found
        piece *= 1.5
    return state


def _solve(
    walker: Walker, command: _Command, guess: Vector, exact: bool, tried: list[str], name: str
) -> Vector | None:
    """A fixed point near ``guess``, or None after noting in ``tried`` how it failed."""
    free = _free_coordinates(walker)

    def full(x: Vector) -> Vector:
        state = guess.copy()
        state[free] = x
        return state

    def change(x: Vector) -> Vector:
        _, second = stride_map(walker, full(x), **command.keywords)
        return (second.state - full(x))[free]

    def slope(x: Vector) -> Vector:
        matrix = stride_jacobian(walker, full(x), **command.keywords).matrix
        return matrix[np.ix_(free, free)] - np.eye(len(free))

    try:
        solution = root(
            change, guess[free], jac=slope if exact else None, options={"xtol": 1e-15}
        )
        residual = float(np.abs(change(solution.x)).max())
    except (LeanYawError, ValueError) as error:
        tried.append(f"from {name}: {error}")
        return None
    if residual <= RESIDUAL_LIMIT:
        return full(solution.x)
    tried.append(f"from {name}: the root finder stopped at a residual of {residual:.1e}")
    return None
