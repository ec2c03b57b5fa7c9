"""Limit cycles: fixed points of section maps, with their multipliers.

Iterating strides finds no gait in practice: Table 1's converges by 0.986 a stride.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.analysis.active_map import ActiveMap, planar_gait_rate, search_active
from lean_yaw_env.analysis.fixed_point import RESIDUAL_LIMIT
from lean_yaw_env.analysis.path import axle_middle, distance_walked, turning_radius
from lean_yaw_env.analysis.section_map import CycleStep, SectionMap, section_map_of
from lean_yaw_env.parameters import INTER_LEG_ANGLE, Vector
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.walker import Walker

__all__ = [
    "RESIDUAL_LIMIT",
    "LimitCycle",
    "cycle_at",
    "find_gait",
    "find_limit_cycle",
    "find_passive_gaits",
    "planar_gait_rate",
    "sorted_eigenvalues",
    "spectral_radii",
]


@dataclass(frozen=True, eq=False)
class LimitCycle:
    """A periodic gait.

    Means are over the cycle: ``n_steps``, or two steps of a gait whose right step mirrors the left one.

    Attributes
    ----------
    state : shape (k,)
        State on the left foot: the section state, with what else the map's state holds.
    turn : float
        Heading gained per cycle, rad: zero but where every heading is like any other.
    residual : float
        Largest change of any coordinate over the cycle (not counting ``turn``).
    jacobian : shape (n, n)
        Of the cycle in ``coordinates``.
    jacobian_error : shape (n, n)
        A bound of its error; zero where derivatives are exact.
    coordinates : names of the state's coordinates that the gait repeats
        Where every heading is like any other (on the level, on a slope that turns with the walker),
        the heading is not among them; a planar walker has three.
    steps : tuple of CycleStep
        Of the cycle.
    section_map : SectionMap
        The map of which the gait is the fixed point.
    """

    state: Vector
    turn: float
    residual: float
    jacobian: Vector
    jacobian_error: Vector = field(repr=False)
    coordinates: tuple[str, ...]
    steps: tuple[CycleStep, ...] = field(repr=False)
    section_map: SectionMap = field(repr=False)

    @property
    def n_steps(self) -> int:
        """Steps until the state recurs: 1 if a right step mirrors a left one, 2, or 4 and more past a period doubling."""
        return self.section_map.n_steps

    @cached_property
    def eigenvalues(self) -> NDArray[np.complex128]:
        """Of the cycle's Jacobian (the Floquet multipliers), shape (n,), by falling magnitude."""
        return sorted_eigenvalues(self.jacobian)

    @property
    def spectral_radius(self) -> float:
        """The largest magnitude of the eigenvalues, neutral ones apart."""
        return float(spectral_radii(self.eigenvalues, self.section_map.neutral_within))

    @property
    def is_stable(self) -> bool:
        """Whether small disturbances die out, but for what is neutral."""
        return self.spectral_radius < 1.0

    @property
    def cycles_to_halve(self) -> float:
        """Cycles in which the slowest disturbance halves; infinite if it does not."""
        radius = self.spectral_radius
        return float(np.log(0.5) / np.log(radius)) if 0.0 < radius < 1.0 else float("inf")

    @property
    def duration(self) -> float:
        """Of the cycle."""
        return sum(step.duration for step in self.steps)

    @cached_property
    def distance(self) -> float:
        """Walked in the cycle: from a footprint to the same foot's next one, the mean of both feet."""
        return float(distance_walked([step.displacement for step in self.steps], self.turn))

    @property
    def stride_period(self) -> float:
        """Duration of two steps."""
        return 2.0 * self.duration / len(self.steps)

    @property
    def speed(self) -> float:
        """Distance over time."""
        return self.distance / self.duration

    @property
    def step_length(self) -> float:
        """Distance of a step."""
        return self.distance / len(self.steps)

    @property
    def gravity_work(self) -> float:
        """What gravity gives per distance, in weights."""
        return sum(step.gravity_work for step in self.steps) / self.distance

    @property
    def shift_work(self) -> float:
        """What moving the masses puts in per distance, in weights."""
        return sum(step.shift_work for step in self.steps) / self.distance

    @property
    def cost_of_transport(self) -> float:
        """Work of gravity and of moving the masses, per weight and distance."""
        return self.gravity_work + self.shift_work

    @property
    def least_normal_force(self) -> float:
        """Least normal force, in weights."""
        return min(step.least_normal_force for step in self.steps)

    @property
    def greatest_friction(self) -> float:
        """Greatest ratio of tangential to normal force."""
        return max(step.greatest_friction for step in self.steps)

    @cached_property
    def turning_radius(self) -> float:
        """Of the circle on which the middle of the hip axle walks, see ``path.turning_radius``; infinite without a turn."""
        walker = self.section_map.stander
        prints = np.cumsum([np.zeros(2), *(step.displacement for step in self.steps)], axis=0)
        middles = [axle_middle(walker, step.start, step.foot) for step in self.steps]
        return turning_radius(prints[:-1] + np.array(middles), prints[-1], self.turn)


def sorted_eigenvalues(matrices: Vector) -> NDArray[np.complex128]:
    """Eigenvalues (..., n) of matrices (..., n, n), by falling magnitude; of a pair the one above the real axis first."""
    values = np.asarray(np.linalg.eigvals(matrices), dtype=complex)
    order = np.lexsort((-np.imag(values), -np.abs(values)), axis=-1)
    return np.take_along_axis(values, order, axis=-1)


def spectral_radii(eigenvalues: NDArray[np.complex128], neutral_within: float) -> Vector:
    """The largest magnitudes (...) among eigenvalues (..., n), those nearer to one than ``neutral_within`` apart."""
    answers = np.abs(eigenvalues - 1.0) >= neutral_within
    return np.abs(eigenvalues).max(axis=-1, initial=0.0, where=answers)


def find_limit_cycle(
    walker: Walker | PassiveWalker | SectionMap,
    *,
    inter_leg_angle: float = INTER_LEG_ANGLE,
    mass_offset: float | tuple[float, float] = 0.0,
) -> LimitCycle:
    """Find a walker's gait at a constant command, or any map's, with its multipliers.

    Parameters
    ----------
    walker : Walker, PassiveWalker or SectionMap
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
    section_map = section_map_of(walker, inter_leg_angle=inter_leg_angle, mass_offset=mass_offset)
    return cycle_at(section_map, next(section_map.search()))


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
        raise ValueError(f"walker must be a Walker, got {walker!r}")
    return search_active(section_map, exact=False)


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
        raise ValueError(f"walker must be a PassiveWalker, got {walker!r}")
    section_map = section_map_of(walker)
    cycles = [cycle_at(section_map, state) for state in section_map.search()]
    return tuple(sorted(cycles, key=lambda cycle: -cycle.stride_period))


def cycle_at(section_map: SectionMap, state: Vector) -> LimitCycle:
    """Describe the gait at a fixed point of a section map.

    Parameters
    ----------
    section_map : SectionMap
    state : shape (k,)
        Its fixed point, as from ``solve_fixed_point``.
    """
    n_steps = section_map.n_steps
    cycle = section_map.over(2 * n_steps) if n_steps % 2 else section_map
    free = cycle.free
    linear = cycle.linearise(state)
    steps = cycle.results(state)
    change = steps[-1].state - state
    return LimitCycle(
        state=state,
        turn=0.0 if 0 in free else float(change[0]),
        residual=float(np.abs(change[free]).max()),
        jacobian=linear.matrix[np.ix_(free, free)],
        jacobian_error=linear.error[np.ix_(free, free)],
        coordinates=tuple(cycle.names[i] for i in free),
        steps=tuple(steps),
        section_map=section_map,
    )
