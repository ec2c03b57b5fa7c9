"""Limit cycles: fixed points of section maps, with their multipliers.

Iterating strides finds no gait in practice: Table 1's converges by 0.986 a stride.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.analysis.active_map import ActiveMap, search_active
from lean_yaw_env.analysis.fixed_point import solve_fixed_point
from lean_yaw_env.analysis.passive_map import PassiveMap
from lean_yaw_env.analysis.path import axle_middle, distance_walked, turning_radius
from lean_yaw_env.analysis.section_map import (
    CommandArguments,
    CycleStep,
    SectionMap,
    WalkerOrMap,
    section_map_of,
)
from lean_yaw_env.errors import LeanYawError, NoGaitError
from lean_yaw_env.parameters import STATE_SIZE, Vector
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.validation import require_count, require_instance
from lean_yaw_env.walker import Walker

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from lean_yaw_env.viewer import PageDisplay

OF_STEPS = (
    "duration", "displacement", "least_normal_force", "greatest_friction", "gravity_work", "shift_work"
)  # fmt: skip
"""What ``numbers_of_cycles`` takes of each step."""

_KICKS = (1e-3, -1e-3, 1e-2, -1e-2)
"""How far along the unstable mode to start, as a share of the state's length."""
_SETTLING = 600
"""Cycles to let the walk settle; slowest just past the doubling."""
_RECURS = 1e-9
_DIFFERENT = 1e-7
"""A cycle whose halves are closer than this has the half period."""


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
    duration, distance : float
        Of the cycle; the distance is from a footprint to the same foot's next one, the mean of both feet.
    speed, step_length, stride_period : float
        Distance over time, distance of a step, and duration of two steps.
    gravity_work, shift_work : float
        What gravity gives, and what moving the masses puts in, per distance, in weights.
    least_normal_force, greatest_friction : float
        Least normal force, in weights, and greatest ratio of tangential to normal force.
    """

    state: Vector
    turn: float
    residual: float
    jacobian: Vector
    jacobian_error: Vector = field(repr=False)
    coordinates: tuple[str, ...]
    steps: tuple[CycleStep, ...] = field(repr=False)
    section_map: SectionMap = field(repr=False)
    duration: float
    distance: float
    speed: float
    step_length: float
    stride_period: float
    gravity_work: float
    shift_work: float
    least_normal_force: float
    greatest_friction: float

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
    def cost_of_transport(self) -> float:
        """Work of gravity and of moving the masses, per weight and distance."""
        return self.gravity_work + self.shift_work

    def show(self, n_steps: int = 40, height: int = 620) -> PageDisplay:
        """So many steps of the gait on the web page, for a notebook; ``height`` is in pixels. See ``Walk.show``.

        Raises
        ------
        ValueError
            If it is no gait of a ``Walker`` with constant commands.
        """
        if not isinstance(self.section_map, ActiveMap):
            raise ValueError(f"only a Walker's gait can be shown, got one of {self.section_map}")
        require_count("n_steps", n_steps, 1, 100_000)
        commands = [self.steps[k % len(self.steps)].command for k in range(n_steps)]
        walk = self.section_map.walker.walk(
            n_steps,
            state=self.state,
            inter_leg_angle=[command.inter_leg_angle for command in commands],
            mass_offset=[command.mass_offset for command in commands],
            previous_offset=commands[0].previous_offset,
        )
        return walk.show(height)

    def stance_motion(self, step: CycleStep, samples: int = 50) -> dict[str, Vector]:
        """The motion and the contact forces within one of the gait's steps; see ``Walker.stance_motion``."""
        require_instance("step", step, CycleStep)
        return self.section_map.stander.stance_motion(
            step.start[:STATE_SIZE], duration=step.duration, samples=samples, stance=step.foot, **step.command._asdict()
        )  # fmt: skip

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


def numbers_of_cycles(steps: Mapping[str, Vector], turn: Vector) -> dict[str, Vector]:
    """Numbers (...) of cycles by the names in ``LimitCycle``, from those of their n steps by the names ``OF_STEPS`` and the heading gained (...).

    Each of ``steps`` has the shape (..., n), the displacement (..., n, 2).
    """
    n = steps["duration"].shape[-1]
    duration = steps["duration"].sum(axis=-1)
    distance = distance_walked(steps["displacement"], turn)
    return {
        "duration": duration,
        "distance": distance,
        "speed": distance / duration,
        "step_length": distance / n,
        "stride_period": 2.0 * duration / n,
        "gravity_work": steps["gravity_work"].sum(axis=-1) / distance,
        "shift_work": steps["shift_work"].sum(axis=-1) / distance,
        "least_normal_force": steps["least_normal_force"].min(axis=-1),
        "greatest_friction": steps["greatest_friction"].max(axis=-1),
    }


def find_limit_cycle(walker: WalkerOrMap, **command: Unpack[CommandArguments]) -> LimitCycle:
    """Find a walker's gait at a constant command, or any map's, with its multipliers.

    Parameters
    ----------
    walker : Walker, PassiveWalker or SectionMap
        Of a passive walker's gaits, the one with the longest period, which alone can be stable.
    inter_leg_angle : (0, pi/2)
        Of a ``Walker`` only.
    mass_offset : [-1, 1], or a pair of them
        Of a ``Walker`` only. One number: an offset that the slope can balance, sin(heading) = -offset / tan(slope), gives a gait across the
        slope. A pair: the offset while the left and while the right foot stands; (a, -a) with positive a, away from the stance foot, is
        pumping, which can drive the walker on the level and uphill.

    Raises
    ------
    NoGaitError
        If no gait was found; says what was tried.
    ValueError
        If an argument is outside its range.
    """
    section_map = section_map_of(walker, **command)
    return cycle_at(section_map, next(section_map.search()))


def find_gait(walker: Walker, **command: Unpack[CommandArguments]) -> Vector:
    """The section state of ``find_limit_cycle`` alone, on the left foot, to the same residual.

    The root finder estimates its own slopes here, so that nothing but the step itself is compiled; where that fails, it gets the Jacobian.

    Raises
    ------
    NoGaitError, ValueError
        As ``find_limit_cycle``.
    """
    section_map = section_map_of(walker, **command)
    if not isinstance(section_map, ActiveMap):
        raise ValueError(f"walker must be a Walker, got {walker!r}")
    try:
        return search_active(section_map, exact=False)
    except NoGaitError:
        return search_active(section_map, exact=True)


def find_passive_gaits(walker: PassiveWalker) -> tuple[LimitCycle, ...]:
    """Find a passive walker's symmetric gaits, that of the longest period first.

    Without hip width they are the planar walker's, found from many starts around the scaling law
    stance pitch ~ (slope / (1 - radius)^2)^(1/3); with hip width these are followed from none.

    Raises
    ------
    NoGaitError
        If there is none; says what was tried.
    """
    section_map = PassiveMap(walker)
    cycles = [cycle_at(section_map, state) for state in section_map.search()]
    return tuple(sorted(cycles, key=lambda cycle: -cycle.stride_period))


def cycle_at(section_map: SectionMap, state: Vector) -> LimitCycle:
    """Describe the gait at a fixed point (k,) of a section map, as from ``solve_fixed_point``."""
    n_steps = section_map.n_steps
    cycle = section_map.over(2 * n_steps) if n_steps % 2 else section_map
    free = cycle.free
    linear = cycle.linearise(state)
    steps = cycle.results(state)
    change = steps[-1].state - state
    turn = 0.0 if 0 in free else float(change[0])
    of_steps = {name: np.array([getattr(step, name) for step in steps]) for name in OF_STEPS}
    numbers = numbers_of_cycles(of_steps, np.array(turn))
    return LimitCycle(
        state=state,
        turn=turn,
        residual=float(np.abs(change[free]).max()),
        jacobian=linear.matrix[np.ix_(free, free)],
        jacobian_error=linear.error[np.ix_(free, free)],
        coordinates=tuple(cycle.names[i] for i in free),
        steps=tuple(steps),
        section_map=section_map,
        **{name: float(number) for name, number in numbers.items()},
    )


def find_periodic_gait(
    walker: WalkerOrMap, *, n_steps: int, **command: Unpack[CommandArguments]
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
    single = section_map_of(walker, **command)
    gait, cycle, free = find_limit_cycle(single).state, single.over(n_steps), single.free
    values, vectors = np.linalg.eig(single.derivative(gait)[1][np.ix_(free, free)])
    unstable = np.real(vectors[:, np.argmax(np.abs(values))])
    way = np.zeros(gait.size)
    way[free] = np.linalg.norm(gait) * unstable / np.linalg.norm(unstable)
    reasons: list[str] = []
    for kick in _KICKS:
        try:
            state = solve_fixed_point(cycle, _settled(cycle, gait + kick * way))
            if n_steps // 2 >= single.n_steps:
                half = single.over(n_steps // 2)
                change = np.abs(half.image(state) - state)[free].max()
                if change < max(_DIFFERENT, 10.0 * cycle.precision):
                    raise NoGaitError(
                        f"the walk settled to a gait of {half.n_steps} steps or fewer"
                    )
        except (LeanYawError, ValueError) as error:
            reasons.append(f"kicked by {kick:g}: {error}")
            continue
        return cycle_at(cycle, state)
    raise NoGaitError(f"no gait of {n_steps} steps found; " + "; ".join(reasons))


def _settled(cycle: SectionMap, state: Vector) -> Vector:
    """Where the walk is once the state recurs, or after as long as is bearable."""
    for _ in range(_SETTLING):
        before, state = state, cycle.image(state)
        if float(np.abs(state - before)[cycle.free].max()) < max(_RECURS, cycle.precision):
            break
    return state
