"""A family of gaits over inter-leg angle and heading, driven by the slope or by pumping, with the step map linearised about each.

A right stance is taken as its mirror image, so that walking straight is one map repeated, z' = A z + B v, with

    z = (section state, mass offset in force) less the gait's,
    v = (inter-leg angle, change of the offset) less the gait's.

A heading phi off downhill is held by the offset of the closed form, sin(phi) = -offset / tan(slope); its mirror image is the gait of -phi,
so that the two alternate. A gait that pumps has the masses on alternate sides: its own change of the offset is part of it, and v is what is
added.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import root

from lean_yaw_env.analysis.active_map import ActiveMap, has_downhill
from lean_yaw_env.analysis.fixed_point import solve_fixed_point
from lean_yaw_env.analysis.path import distance_walked
from lean_yaw_env.analysis.section_map import RESIDUAL_LIMIT
from lean_yaw_env.analysis.step_derivatives import StepDerivatives, differentiate_step
from lean_yaw_env.envs.formulas import advance
from lean_yaw_env.envs.options import gait_of
from lean_yaw_env.errors import LeanYawError, NoGaitError
from lean_yaw_env.kernel.jacobian import OUTPUTS
from lean_yaw_env.kernel.records import Command
from lean_yaw_env.parameters import INTER_LEG_ANGLE, MIRROR, STATE_SIZE, Vector, WalkerParameters
from lean_yaw_env.validation import require_number
from lean_yaw_env.walker import Walker

ANGLES = tuple(np.linspace(0.15, 0.45, 13).tolist())
DOWNHILL_HEADINGS = tuple(np.linspace(-0.7, 0.7, 9).tolist())
ALL_HEADINGS = tuple(np.linspace(-math.pi, math.pi, 17).tolist())
SIZE = STATE_SIZE + 1
"""Of the regulated state: the section state and the mass offset in force."""
_TINY = 1e-30


@dataclass(frozen=True)
class Pumping:
    """Mass offsets away from the stance foot that drive gaits; none, where both are zero.

    Attributes
    ----------
    downhill, uphill : leg lengths, in [0, 0.1]
        Straight down and straight up; in between as the slope along the heading is. Without one for uphill, that for downhill counts
        everywhere, as it does on the level and where the slope turns with the walker.
    """

    downhill: float = 0.0
    uphill: float = 0.0

    def __post_init__(self) -> None:
        require_number("pumping downhill", self.downhill, 0.0, 0.1)
        require_number("pumping uphill", self.uphill, 0.0, 0.1)

    def along(self, headings: ArrayLike) -> Vector:
        """The offsets for headings from downhill, of any shape."""
        headings = np.asarray(headings, dtype=float)
        if not self.uphill:
            return np.full(headings.shape, self.downhill)
        return self.downhill + 0.5 * (1.0 - np.cos(headings)) * (self.uphill - self.downhill)


class LinearStep(NamedTuple):
    """The mirrored step map about a state on the left foot, and the gradient of its speed."""

    by_state: Vector
    """Shape (6, 6)."""
    by_input: Vector
    """Shape (6, 2)."""
    speed: Vector
    """Shape (8,): how the speed along the mean heading of the step's two footprints follows from state and inputs."""


def linearise_step(walker: Walker, state: Vector, command: Command) -> LinearStep:
    """Linearise the mirrored step from a left-stance section state (5,), exactly: see ``differentiate_step``.

    Raises
    ------
    FellError
        If the walker does not complete the step.
    """
    step = differentiate_step(walker, state, "left", command)
    by_state, by_input = np.zeros((SIZE, SIZE)), np.zeros((SIZE, 2))
    by_state[:STATE_SIZE, :STATE_SIZE] = MIRROR[:, None] * step.by_state
    by_state[:STATE_SIZE, -1] = MIRROR * (step.by_mass_offset + step.by_previous_offset)
    by_input[:STATE_SIZE, 0] = MIRROR * step.by_inter_leg_angle
    by_input[:STATE_SIZE, 1] = MIRROR * step.by_mass_offset
    # the masses arrive at old offset + change within the step, and the mirror turns their side round
    by_state[-1, -1] = by_input[-1, 1] = -1.0
    gradient = _speed_gradient(state, step)
    by_angle, by_offset, by_before = gradient[STATE_SIZE:]
    speed = np.array([*gradient[:STATE_SIZE], by_offset + by_before, by_angle, by_offset])
    return LinearStep(by_state, by_input, speed)


def _speed_gradient(state: Vector, step: StepDerivatives) -> Vector:
    """A step's speed along its mean heading by the inputs of its Jacobian, shape (8,): the imaginary part of numbers that carry derivatives."""
    carrying = step.outputs[:, None] + 1j * _TINY * step.jacobian
    named = dict(zip(OUTPUTS, carrying, strict=True))
    before = state[0] + 1j * _TINY * np.eye(1, step.jacobian.shape[1])[0]
    along = advance(
        named["displacement_x"], named["displacement_z"], 0.5 * (before + named["heading"])
    )
    return (along / named["duration"]).imag / _TINY


class GaitNode(NamedTuple):
    """A gait on the left foot, and the step map about it."""

    inter_leg_angle: float
    state: Vector
    """Its heading is that of the mean of two footprints apart."""
    held_offset: float
    """What holds the heading: the mean of both feet's offsets."""
    pumping: float
    """What the left foot's offset has more than that."""
    speed: float
    step: LinearStep


def headings_of(parameters: WalkerParameters, pumping: Pumping) -> tuple[float, ...]:
    """The headings of a family's gaits: those that the slope gives energy for, or all if it pumps uphill. Without a downhill all headings are equal."""
    if not has_downhill(parameters):
        return (0.0, 0.0)
    return ALL_HEADINGS if pumping.uphill else DOWNHILL_HEADINGS


class _GaitGrid:
    """Finds gaits over a grid of inter-leg angles and headings."""

    def __init__(self, parameters: WalkerParameters, pumping: Pumping) -> None:
        self._walker = Walker(replace(parameters, friction_limit=math.inf))
        self._has_downhill = has_downhill(parameters)
        self._pumping = pumping
        self._headings = headings_of(parameters, pumping)

    def nodes(self, start: Vector) -> list[list[GaitNode]]:
        """Gaits of the grid, each found from its neighbour. Where no gait is found, the last one found is repeated up to the grid's edge."""
        middle = int(np.argmin(np.abs(np.array(ANGLES) - INTER_LEG_ANGLE)))
        straight = self._solve(ANGLES[middle], 0.0, start, 0.0)
        shorter = self._chain(straight, [(angle, 0.0) for angle in ANGLES[middle - 1 :: -1]])
        longer = self._chain(straight, [(angle, 0.0) for angle in ANGLES[middle + 1 :]])
        straights = [*shorter[::-1], straight, *longer]
        rows = {
            id(node): self._row(node) for node in straights
        }  # a repeated gait's row is computed once
        return [rows[id(node)] for node in straights]

    def _row(self, straight: GaitNode) -> list[GaitNode]:
        """Gaits along all headings at the inter-leg angle of a straight gait."""
        headings, half = self._headings, len(self._headings) // 2
        if not self._has_downhill:
            return [straight] * len(headings)
        angle = straight.inter_leg_angle
        right = self._chain(straight, [(angle, each) for each in headings[half - 1 :: -1]])
        left = self._chain(straight, [(angle, each) for each in headings[half + 1 :]])
        return [*right[::-1], straight, *left]

    def _chain(self, node: GaitNode, targets: Sequence[tuple[float, float]]) -> list[GaitNode]:
        """Gaits at targets (inter-leg angle, heading), each found from the one before. Where no gait is found, the last one found is repeated."""
        found: list[GaitNode] = []
        for angle, heading in targets:
            start = node.state.copy()
            start[0] += heading
            try:
                node = self._solve(angle, heading, start, node.held_offset)
            except NoGaitError:
                break
            found.append(node)
        return found + [node] * (len(targets) - len(found))

    def _solve(self, angle: float, heading: float, start: Vector, held: float) -> GaitNode:
        """The gait that repeats at this heading, and the offset that holds it."""
        aside = float(self._pumping.along(heading if self._has_downhill else 0.0))
        two_steps = ActiveMap(self._walker, angle, (held + aside, held - aside), 2)
        if self._has_downhill:
            two_steps, state = _held_gait(two_steps, start)
        else:
            state = solve_fixed_point(two_steps, start)
        first, second = two_steps.results(state)
        distance = float(distance_walked([first.displacement, second.displacement]))
        left, right = two_steps.mass_offset
        apart = state.copy()
        apart[0] = 0.5 * (state[0] - first.state[0])
        return GaitNode(
            inter_leg_angle=angle,
            state=apart,
            held_offset=0.5 * (left + right),
            pumping=aside,
            speed=distance / (first.duration + second.duration),
            step=linearise_step(self._walker, state, Command(angle, left, right)),
        )


def _held_gait(two_steps: ActiveMap, start: Vector) -> tuple[ActiveMap, Vector]:
    """The gait along the start's heading, with the map whose mean offset holds it.

    Across the slope a heading moves without end as the offset does, so that the heading is given and the offset found.

    Raises
    ------
    NoGaitError
        If the root finder stops anywhere else.
    """

    def split(x: Vector) -> tuple[ActiveMap, Vector]:
        return two_steps.moved("mass_offset", float(x[0])), np.array([start[0], *x[1:]])

    def change(x: Vector) -> Vector:
        moved, state = split(x)
        return moved.image(state) - state

    def slope(x: Vector) -> Vector:
        moved, state = split(x)
        _, matrix, by_offset = moved.sensitivity(state, "mass_offset")
        return np.column_stack([by_offset, (matrix - np.eye(len(state)))[:, 1:]])

    guess = np.array([two_steps.value("mass_offset"), *start[1:]])
    try:
        found = root(change, guess, jac=slope, options={"xtol": 1e-12}).x
        residual = float(np.abs(change(found)).max())
    except (LeanYawError, ValueError, np.linalg.LinAlgError) as error:
        raise NoGaitError(str(error)) from error
    if not residual <= RESIDUAL_LIMIT:
        raise NoGaitError(f"the root finder stopped at a residual of {residual:.1e}")
    return split(found)


@lru_cache(maxsize=64)
def gait_nodes(parameters: WalkerParameters, pumping: Pumping) -> list[list[GaitNode]]:
    """Gaits and linear steps over ``ANGLES`` and the family's headings.

    Raises
    ------
    NoGaitError
        If the walker has no gait straight downhill at the paper's inter-leg angle.
    """
    start = np.array(gait_of(parameters, pumping.downhill))
    return _GaitGrid(parameters, pumping).nodes(start)
