"""Optimal linear feedback (LQR) on the exact step map about the gaits, scheduled over inter-leg angle and heading.

A right stance is taken as its mirror image, so that walking straight is one map repeated, z' = A z + B v, with

    z = (section state, mass offset in force) less the gait's,
    v = (inter-leg angle, change of the offset) less the gait's.

With the offset in the state and its change as the input, the limit on the change is part of what is optimised: asking for more costs more.
A heading phi off downhill is held by the offset of the closed form, sin(phi) = -offset / tan(slope); its mirror image is the gait of -phi,
so that the two alternate and the optimal gains are periodic, of period two.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator
from scipy.linalg import solve_discrete_are

from lean_yaw_env.analysis.fixed_point import solve_fixed_point
from lean_yaw_env.analysis.section_map import ActiveMap
from lean_yaw_env.analysis.stride import differentiate_step
from lean_yaw_env.envs.options import gait_of
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.kernel.records import Command
from lean_yaw_env.parameters import (
    INTER_LEG_ANGLE,
    MIRROR,
    STATE_SIZE,
    Vector,
    WalkerParameters,
)
from lean_yaw_env.walker import Walker

SIZE = STATE_SIZE + 1
"""Of the regulated state: the section state and the mass offset in force."""
ANGLES = tuple(np.linspace(0.15, 0.45, 13).tolist())
HEADINGS = tuple(np.linspace(-0.7, 0.7, 9).tolist())
_PRIOR = (0.01, 0.03, 0.05, 0.08, 0.03)
"""How far states stray from the gait, heading apart; weighs what the last step's turn is estimated from."""
_COLUMNS = np.cumsum((STATE_SIZE, 1, 1, 2 * SIZE, STATE_SIZE))


@dataclass(frozen=True)
class LqrWeights:
    """Deviations that cost as much as one another; infinite ones cost nothing.

    Attributes
    ----------
    heading, ankle_angle : rad
    stance_pitch_rate, ankle_rate : rad / time unit
    mass_offset, offset_change : leg lengths
    inter_leg_angle : rad
    """

    heading: float = 0.08
    ankle_angle: float = 0.8
    stance_pitch_rate: float = 2.6
    ankle_rate: float = 0.22
    mass_offset: float = math.inf
    inter_leg_angle: float = 0.035
    offset_change: float = 0.016

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0.0:
                raise ValueError(f"{name} must be in (0, inf], not {value!r}")
        for name in ("heading", "inter_leg_angle", "offset_change"):
            if math.isinf(getattr(self, name)):
                raise ValueError(
                    f"{name} must be in (0, inf), not inf: the feedback needs its cost"
                )

    def matrices(self) -> tuple[Vector, Vector]:
        """Costs of the state (6, 6) and of the inputs (2, 2)."""
        scales = np.array(
            [self.heading, math.inf, self.ankle_angle, self.stance_pitch_rate, self.ankle_rate, self.mass_offset]
        )  # fmt: skip
        inputs = np.array([self.inter_leg_angle, self.offset_change])
        return np.diag(scales**-2), np.diag(inputs**-2)


@dataclass(frozen=True)
class LinearStep:
    """The mirrored step map about a state on the left foot.

    Attributes
    ----------
    by_state : shape (6, 6)
    by_input : shape (6, 2)
    """

    by_state: Vector
    by_input: Vector


def linearise_step(
    walker: Walker, state: Vector, inter_leg_angle: float, mass_offset: float
) -> LinearStep:
    """Linearise the mirrored step from a left-stance section state (5,) with the masses held at ``mass_offset``.

    Raises
    ------
    FellError
        If the walker does not complete the step.
    """
    step = differentiate_step(
        walker, state, "left", Command(inter_leg_angle, mass_offset, mass_offset)
    )
    by_state, by_input = np.zeros((SIZE, SIZE)), np.zeros((SIZE, 2))
    by_state[:STATE_SIZE, :STATE_SIZE] = MIRROR[:, None] * step.by_state
    by_state[:STATE_SIZE, -1] = MIRROR * (step.by_mass_offset + step.by_previous_offset)
    by_input[:STATE_SIZE, 0] = MIRROR * step.by_inter_leg_angle
    by_input[:STATE_SIZE, 1] = MIRROR * step.by_mass_offset
    # the masses arrive at old offset + change within the step, and the mirror turns their side round
    by_state[-1, -1] = by_input[-1, 1] = -1.0
    return LinearStep(by_state, by_input)


def periodic_gain(now: LinearStep, then: LinearStep, weights: LqrWeights) -> Vector:
    """The optimal gain (2, 6), input = -gain z, for ``now`` where the two steps alternate for ever.

    The Riccati equation is that of two steps at once; its solution is the cost to go before ``now``, and the one before ``then`` follows
    by one step of the recursion.
    """
    costs, inputs = weights.matrices()
    a, b = now.by_state, now.by_input
    both = then.by_state @ a
    by_both = np.hstack([then.by_state @ b, then.by_input])
    state_cost = costs + a.T @ costs @ a
    cross = np.hstack([a.T @ costs @ b, np.zeros((SIZE, 2))])
    input_cost = np.block([[inputs + b.T @ costs @ b, np.zeros((2, 2))], [np.zeros((2, 2)), inputs]])  # fmt: skip
    cost_to_go = solve_discrete_are(both, by_both, state_cost, input_cost, s=cross)
    gain = _gain(then, cost_to_go, inputs)
    before_then = costs + then.by_state.T @ cost_to_go @ (then.by_state - then.by_input @ gain)
    return _gain(now, 0.5 * (before_then + before_then.T), inputs)


def _gain(step: LinearStep, cost_to_go: Vector, inputs: Vector) -> Vector:
    weighed = step.by_input.T @ cost_to_go
    return np.linalg.solve(inputs + weighed @ step.by_input, weighed @ step.by_state)


def last_turn(before: LinearStep, weights: LqrWeights) -> Vector:
    """What (5,) times (state without heading, offset) best estimates how far the last step turned.

    Feedback is on the heading of the last footprint, tasks show the error of the mean of two. The last step's heading change follows
    from what the step before started with, of which as much is left in the state as the map tells: the Gaussian estimate.
    """
    spread = np.array([*_PRIOR, 0.5 * weights.inter_leg_angle, weights.offset_change])
    ways = np.hstack([before.by_state[:, 1:], before.by_input]) * spread
    turned, seen = ways[0], ways[1:]
    floor = 1e-6 * np.diag(np.square(_PRIOR))
    return np.linalg.solve(seen @ seen.T + floor, seen @ turned)


@dataclass(frozen=True)
class GaitNode:
    """A gait on the left foot, and the feedback about it.

    Attributes
    ----------
    state : shape (5,)
        Its heading is that of the mean of two footprints apart.
    mass_offset, speed : float
    step : LinearStep
    """

    state: Vector
    mass_offset: float
    speed: float
    step: LinearStep


class _GaitGrid:
    """Follows gaits over a grid of inter-leg angles and headings."""

    def __init__(self, parameters: WalkerParameters, angles: Vector, headings: Vector) -> None:
        self._walker = Walker(replace(parameters, friction_limit=math.inf))
        self._turns = parameters.slope_turns
        self.angles, self.headings = angles, headings

    def nodes(self, start: Vector) -> list[list[GaitNode]]:
        """Gaits of the grid, each followed from its neighbour; where one is lost, its neighbour stands for it."""
        rows: dict[int, list[GaitNode]] = {}
        middle = int(np.argmin(np.abs(self.angles - INTER_LEG_ANGLE)))
        straight = self._node(self.angles[middle], 0.0, start)
        for way in (range(middle, -1, -1), range(middle, len(self.angles))):
            seed = straight
            for i in way:
                seed = self._node_or(seed, self.angles[i], 0.0)
                rows[i] = self._row(self.angles[i], seed)
        return [rows[i] for i in range(len(self.angles))]

    def _row(self, angle: float, straight: GaitNode) -> list[GaitNode]:
        if self._turns:
            return [straight] * len(self.headings)
        half = len(self.headings) // 2
        sides: list[list[GaitNode]] = []
        for headings in (self.headings[half - 1 :: -1], self.headings[half + 1 :]):
            side, node = [], straight
            for heading in headings:
                node = self._node_or(node, angle, float(heading))
                side.append(node)
            sides.append(side)
        return [*sides[0][::-1], straight, *sides[1]]

    def _node_or(self, seed: GaitNode, angle: float, heading: float) -> GaitNode:
        start = seed.state.copy()
        start[0] += heading
        try:
            return self._node(angle, heading, start)
        except NoGaitError:
            return seed

    def _node(self, angle: float, heading: float, start: Vector) -> GaitNode:
        walker = self._walker
        offset = 0.0 if self._turns else -math.tan(walker.parameters.slope) * math.sin(heading)
        two_steps = ActiveMap(walker, angle, (offset, offset))
        state = solve_fixed_point(two_steps, start, exact=True)
        first, second = two_steps.results(state)
        chord = float(np.linalg.norm(first.displacement + second.displacement))
        step = linearise_step(walker, state, angle, offset)
        apart = state.copy()
        apart[0] = 0.5 * (state[0] - first.state[0])
        return GaitNode(apart, offset, chord / (first.duration + second.duration), step)


@lru_cache(maxsize=16)
def _gait_nodes(parameters: WalkerParameters) -> tuple[tuple[GaitNode, ...], ...]:
    """Gaits and linear steps of the whole grid, which do not depend on what is optimised."""
    grid = _GaitGrid(parameters, np.array(ANGLES), np.array(HEADINGS))
    return tuple(tuple(row) for row in grid.nodes(np.array(gait_of(parameters))))


class GainSchedule:
    """Gaits and optimal gains over inter-leg angle and heading, linear between the nodes of a grid.

    Parameters
    ----------
    parameters : WalkerParameters
        With a slope to walk down.
    weights : LqrWeights

    Attributes
    ----------
    angles, headings : rad
        The grid. Where the slope turns with the walker the heading means nothing.
    has_downhill : bool
        Whether headings are from downhill.
    speeds : shape (angles, headings)

    Raises
    ------
    NoGaitError
        If the walker has no gait straight downhill at 0.3 rad.
    """

    def __init__(self, parameters: WalkerParameters, weights: LqrWeights) -> None:
        self.has_downhill = not parameters.slope_turns
        self.angles = np.array(ANGLES)
        self.headings = np.array(HEADINGS)
        nodes = _gait_nodes(parameters)
        values = np.array(
            [[self._values(row[k], row[-1 - k], weights) for k in range(len(row))] for row in nodes]
        )
        self._table = RegularGridInterpolator((self.angles, self.headings), values)
        self.speeds = values[..., STATE_SIZE + 1]

    def at(self, angles: Vector, headings: Vector) -> tuple[Vector, Vector, Vector, Vector]:
        """Gait states (..., 5), offsets (...), gains (..., 2, 6) and estimators of the last turn (..., 5), held at the grid's edges."""
        points = np.stack(
            [
                np.clip(angles, self.angles[0], self.angles[-1]),
                np.clip(headings, self.headings[0], self.headings[-1]),
            ],
            axis=-1,
        )
        found = self._table(points).reshape(
            *points.shape[:-1], -1
        )  # it makes a row of a single point
        states, offsets, _, gains, turns, _ = np.split(found, _COLUMNS, axis=-1)
        return states, offsets[..., 0], gains.reshape(*gains.shape[:-1], 2, SIZE), turns

    def angles_of(self, speeds: Vector, headings: Vector) -> Vector:
        """The inter-leg angles whose gaits walk at these speeds along these headings, or the nearest of the grid."""
        share = np.interp(headings, self.headings, np.arange(len(self.headings)))
        low = np.minimum(share.astype(int), len(self.headings) - 2)
        candidates = np.stack([self._inverse(speeds, low), self._inverse(speeds, low + 1)])
        return candidates[0] + (share - low) * (candidates[1] - candidates[0])

    def _inverse(self, speeds: Vector, columns: NDArray[np.int64]) -> Vector:
        found = np.empty(np.shape(speeds))
        for column in range(len(self.headings)):
            # longer steps are slower
            inverse = np.interp(speeds, self.speeds[::-1, column], self.angles[::-1])
            found = np.where(columns == column, inverse, found)
        return found

    @staticmethod
    def _values(node: GaitNode, mirrored: GaitNode, weights: LqrWeights) -> Vector:
        gain = periodic_gain(node.step, mirrored.step, weights)
        turn = last_turn(mirrored.step, weights)
        return np.concatenate([node.state, [node.mass_offset, node.speed], gain.ravel(), turn])


@lru_cache(maxsize=16)
def schedule_of(parameters: WalkerParameters, weights: LqrWeights) -> GainSchedule:
    """The schedule of a walker and weights, made once.

    Raises
    ------
    NoGaitError
        As ``GainSchedule``.
    """
    return GainSchedule(parameters, weights)
