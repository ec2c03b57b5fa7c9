"""Limit cycles of the walkers: fixed points of section maps, with their multipliers.

Iterating strides finds no gait in practice: Table 1's converges by 0.986 a stride.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.analysis.fixed_point import (
    RESIDUAL_LIMIT,
    follow_fixed_point,
    solve_fixed_point,
)
from lean_yaw_env.analysis.passive_search import search_passive
from lean_yaw_env.analysis.section_map import ActiveMap, PassiveMap, section_map_of
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.parameters import INTER_LEG_ANGLE, Vector
from lean_yaw_env.passive import PassiveStep, PassiveWalker
from lean_yaw_env.walker import StepResult, Walker

__all__ = [
    "RESIDUAL_LIMIT",
    "LimitCycle",
    "cycle_at",
    "find_gait",
    "find_limit_cycle",
    "find_passive_gaits",
    "planar_gait_rate",
]

_HELPING_SLOPES = (0.01, 0.02)
"""Where to start from a gait that a slope drives, on the way to one that pumping drives."""


@dataclass(frozen=True)
class LimitCycle:
    """A periodic gait.

    Attributes
    ----------
    state : shape (5,), or (6,) of a passive walker
        Section state on the left foot.
    eigenvalues : shape (n,), complex
        Of the cycle's Jacobian (the Floquet multipliers), by falling magnitude; all below one is
        stable. Where every heading is like any other (on the level, on a slope that turns with
        the walker) the heading's multiplier of one is left out; a planar walker has three.
    stride_period : float
        Duration of two steps.
    speed : float
        Distance from a footprint to the same foot's next one, by the time between.
    step_length : float
        Half of that distance.
    turn : float
        Heading gained per cycle, rad: zero but where every heading is like any other.
    residual : float
        Largest change of any coordinate over the cycle (not counting ``turn``).
    n_steps : int
        Steps until the state recurs: 1 if a right step mirrors a left one, 2, or 4 and more past
        a period doubling. Means are over the cycle.
    jacobian : shape (n, n)
        Of the cycle (of two steps if ``n_steps`` is 1) in ``coordinates``.
    coordinates : names of the section's coordinates that the gait repeats
    gravity_work, shift_work : float
        Per distance, in weights: what gravity gives, and what moving the masses puts in.
    least_normal_force, greatest_friction : float
        Least normal force (in weights) and greatest tangential over normal force.
    """

    state: Vector
    eigenvalues: NDArray[np.complex128]
    stride_period: float
    speed: float
    step_length: float
    turn: float
    residual: float
    n_steps: int
    jacobian: Vector
    coordinates: tuple[str, ...]
    gravity_work: float
    shift_work: float
    least_normal_force: float
    greatest_friction: float

    @property
    def is_stable(self) -> bool:
        """Whether small disturbances die out."""
        return bool(np.abs(self.eigenvalues).max() < 1.0)


def planar_gait_rate(walker: Walker, inter_leg_angle: float, heading: float = 0.0) -> float:
    """Stance pitch rate just after heel strike of the planar active walker, in closed form.

    Without hip width, one step multiplies the squared rate by k^2, k the planar impact's ratio,
    after gravity has added the slope's work. Returns nan where the slope gives no energy, or no
    impact takes any.
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
    walker: Walker | PassiveWalker,
    *,
    inter_leg_angle: float = INTER_LEG_ANGLE,
    mass_offset: float | tuple[float, float] = 0.0,
) -> LimitCycle:
    """Find a walker's gait at a constant command, with its multipliers.

    Parameters
    ----------
    walker : Walker or PassiveWalker
        Of a passive walker's gaits, the one with the longest period, which alone can be stable.
    inter_leg_angle : (0, pi/2)
        Of the active walker only.
    mass_offset : [-1, 1], or a pair of them
        Of the active walker only. One number: an offset that the slope can balance, sin(heading) =
        -offset / tan(slope), gives a gait across the slope. A pair: the offset while the left and
        while the right foot stands; (a, -a) with positive a, away from the stance foot, is pumping,
        which can drive the walker on the level and uphill.

    Raises
    ------
    NoGaitError
        If no gait was found; says what was tried.
    ValueError
        If an argument is outside its range.
    """
    if isinstance(walker, PassiveWalker):
        section_map_of(walker, inter_leg_angle=inter_leg_angle, mass_offset=mass_offset)
        return find_passive_gaits(walker)[0]
    section_map = section_map_of(walker, inter_leg_angle=inter_leg_angle, mass_offset=mass_offset)
    assert isinstance(section_map, ActiveMap)
    return cycle_at(section_map, _search(section_map, exact=True))


def find_gait(
    walker: Walker,
    *,
    inter_leg_angle: float = INTER_LEG_ANGLE,
    mass_offset: float | tuple[float, float] = 0.0,
) -> Vector:
    """The section state of ``find_limit_cycle`` alone, on the left foot, to the same residual.

    The root finder estimates its own slopes here, so that nothing but the step itself is compiled.

    Raises
    ------
    NoGaitError, ValueError
        As ``find_limit_cycle``.
    """
    section_map = section_map_of(walker, inter_leg_angle=inter_leg_angle, mass_offset=mass_offset)
    if not isinstance(section_map, ActiveMap):
        raise ValueError(f"walker must be a Walker, not {walker!r}")
    return _search(section_map, exact=False)


def find_passive_gaits(walker: PassiveWalker) -> tuple[LimitCycle, ...]:
    """Find a passive walker's symmetric gaits, that of the longest period first.

    Without hip width they are the planar walker's, found from many starts around the scaling law
    stance pitch ~ (slope / (1 - radius)^2)^(1/3); with hip width these are followed from none.

    Raises
    ------
    NoGaitError
        If there is none; says what was tried.
    """
    if not isinstance(walker, PassiveWalker):
        raise ValueError(f"walker must be a PassiveWalker, not {walker!r}")
    cycles = [cycle_at(PassiveMap(walker), state) for state in search_passive(walker)]
    return tuple(sorted(cycles, key=lambda cycle: -cycle.stride_period))


def cycle_at(section_map: ActiveMap | PassiveMap, state: Vector) -> LimitCycle:
    """Describe the gait at a fixed point of a section map.

    Parameters
    ----------
    section_map : ActiveMap or PassiveMap
    state : shape (5,) or (6,)
        Its fixed point, as from ``solve_fixed_point``.
    """
    n_steps = section_map.n_steps
    cycle = section_map.over(2 * n_steps) if n_steps % 2 else section_map
    results = cycle.results(state)
    free = cycle.free
    _, matrix = cycle.derivative(state)
    jacobian = matrix[np.ix_(free, free)]
    eigenvalues = np.asarray(np.linalg.eigvals(jacobian), dtype=complex)
    duration = sum(result.duration for result in results)
    # Chords between the same foot's prints: along a turn they are what is walked
    chord = sum(
        float(np.linalg.norm(first.displacement + second.displacement))
        for first, second in zip(results[::2], results[1::2], strict=True)
    )
    change = results[-1].state - state
    gravity, shift = np.sum([_works(result) for result in results], axis=0).tolist()
    return LimitCycle(
        state=state,
        eigenvalues=eigenvalues[np.lexsort((-np.imag(eigenvalues), -np.abs(eigenvalues)))],
        stride_period=2.0 * duration / len(results),
        speed=chord / duration,
        step_length=chord / len(results),
        turn=0.0 if 0 in free or cycle.n_steps % 2 else float(change[0]),
        residual=float(np.abs(change[free]).max()),
        n_steps=n_steps,
        jacobian=jacobian,
        coordinates=tuple(cycle.names[i] for i in free),
        gravity_work=gravity / chord,
        shift_work=shift / chord,
        least_normal_force=min(result.least_normal_force for result in results),
        greatest_friction=max(result.greatest_friction for result in results),
    )


def _works(result: StepResult | PassiveStep) -> tuple[float, float]:
    """Gravity's and the shift's work of a step."""
    if isinstance(result, StepResult):
        return result.energy.gravity_work, result.energy.shift_work
    return result.gravity_work, 0.0


def _search(section_map: ActiveMap, exact: bool) -> Vector:
    """Solve from the planar gait's closed form; failing that, follow a gait from a simpler one."""
    tried: list[str] = []
    guess = _planar_guess(section_map)
    if guess is None:
        tried.append(
            "the planar gait has no closed form here: the slope gives no energy along any heading "
            "that balances the offset"
        )
    else:
        try:
            return solve_fixed_point(section_map, guess, exact=exact)
        except NoGaitError as error:
            tried.append(f"from the planar gait: {error}")
        try:
            return _widened(section_map, exact)
        except NoGaitError as error:
            tried.append(f"following the gait from no hip width and no offset: {error}")
    if section_map.value("alternating_offset") != 0.0:
        for slope in _HELPING_SLOPES:
            try:
                return _pumped(section_map, slope, exact)
            except NoGaitError as error:
                tried.append(f"following the gait from slope {slope:g} without pumping: {error}")
    raise NoGaitError(
        f"no gait found for {section_map.walker.parameters} with inter-leg angle "
        f"{section_map.inter_leg_angle:g} and mass offset {_shown(section_map.mass_offset)}; "
        "tried: " + "; ".join(tried)
    )


def _shown(offsets: tuple[float, float]) -> str:
    left, right = offsets
    return f"{left:g}" if left == right else f"({left:g}, {right:g})"


def _planar_guess(section_map: ActiveMap) -> Vector | None:
    heading, offset = 0.0, section_map.value("mass_offset")
    parameters = section_map.walker.parameters
    if offset != 0.0 and not parameters.slope_turns:
        sine = -offset / math.tan(parameters.slope or math.inf)
        if not abs(sine) < 1.0:
            return None
        heading = math.asin(sine)
    rate = planar_gait_rate(section_map.walker, section_map.inter_leg_angle, heading)
    if math.isnan(rate):
        return None
    return np.array([heading, 0.5 * section_map.inter_leg_angle, 0.0, rate, 0.0])


def _widened(section_map: ActiveMap, exact: bool) -> Vector:
    """Raise hip width and offsets together from zero."""
    width = section_map.value("hip_width")
    left, right = section_map.mass_offset

    def path(share: float) -> ActiveMap:
        moved = section_map.moved("hip_width", share * width)
        return ActiveMap(
            moved.walker, moved.inter_leg_angle, (share * left, share * right), moved.n_steps
        )

    start = _planar_guess(path(0.0))
    if start is None:
        raise NoGaitError("the slope gives no energy")
    return follow_fixed_point(path, start, exact=exact)[1]


def _pumped(section_map: ActiveMap, slope: float, exact: bool) -> Vector:
    """From a slope that drives the gait alone: raise the offsets from zero as the slope levels."""
    left, right = section_map.mass_offset
    target = section_map.value("slope")

    def path(share: float) -> ActiveMap:
        moved = section_map.moved("slope", slope + share * (target - slope))
        return ActiveMap(
            moved.walker, moved.inter_leg_angle, (share * left, share * right), moved.n_steps
        )

    return follow_fixed_point(path, _search(path(0.0), exact), exact=exact)[1]
