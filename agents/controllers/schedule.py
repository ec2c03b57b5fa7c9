"""Optimal linear feedback (LQR) on the exact step map, scheduled over a family of gaits: optimal about each, linear between.

With the offset in the state and its change as the input (see ``gaits``), the limit on the change is part of what is optimised: asking for
more costs more. A gait off downhill alternates with its mirror image, and the optimal gains are periodic, of period two.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are

from lean_yaw_env.analysis.active_map import has_downhill
from lean_yaw_env.kernel.compilation import entry_point
from lean_yaw_env.parameters import STATE_SIZE, Vector, WalkerParameters
from lean_yaw_env.validation import require_number

from .gaits import ANGLES, SIZE, GaitNode, LinearStep, Pumping, gait_nodes, headings_of

_ENDS = np.cumsum(
    [STATE_SIZE, 4, 2 * SIZE]
)  # in a row of the table: state, scalars, gain; the rest is the turn
_PRIOR = (0.01, 0.03, 0.05, 0.08, 0.03)
"""How far states stray from the gait, heading apart; weighs what the last step's turn is estimated from."""


@dataclass(frozen=True)
class LqrWeights:
    """Deviations that cost as much as one another, in rad, rad / time unit and leg lengths; infinite ones cost nothing.

    The speed is the step's, which the state does not hold: a cost of state and inputs together.
    """

    heading: float = 0.08
    ankle_angle: float = 0.8
    stance_pitch_rate: float = 2.6
    ankle_rate: float = 0.22
    mass_offset: float = math.inf
    inter_leg_angle: float = 0.035
    offset_change: float = 0.016
    speed: float = math.inf

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            needed = name in ("heading", "inter_leg_angle", "offset_change")  # by the feedback
            require_number(name, value, 0.0, math.inf, "()" if needed else "(]")

    def matrices(self) -> tuple[Vector, Vector]:
        """Costs of the state (6, 6) and of the inputs (2, 2)."""
        scales = np.array(
            [self.heading, math.inf, self.ankle_angle, self.stance_pitch_rate, self.ankle_rate, self.mass_offset]
        )  # fmt: skip
        inputs = np.array([self.inter_leg_angle, self.offset_change])
        return np.diag(scales**-2), np.diag(inputs**-2)


def periodic_gains(now: LinearStep, then: LinearStep, weights: LqrWeights) -> tuple[Vector, Vector]:
    """The optimal gains (2, 6), input = -gain z, for ``now`` and for ``then`` where the two steps alternate for ever.

    The Riccati equation is that of two steps at once; its solution is the cost to go before ``now``, and the one before ``then`` follows
    by one step of the recursion.
    """
    first, second = _costs(now, weights), _costs(then, weights)
    a, b = now.by_state, now.by_input
    both = then.by_state @ a
    by_both = np.hstack([then.by_state @ b, then.by_input])
    state_cost = first.state + a.T @ second.state @ a
    cross = np.hstack([first.cross + a.T @ second.state @ b, a.T @ second.cross])
    mixed = b.T @ second.cross
    input_cost = np.block([[first.input + b.T @ second.state @ b, mixed], [mixed.T, second.input]])
    cost_to_go = solve_discrete_are(both, by_both, state_cost, input_cost, s=cross)
    gain = _gain(then, cost_to_go, second)
    a, b = then.by_state, then.by_input
    before_then = second.state + a.T @ cost_to_go @ (a - b @ gain) - second.cross @ gain
    return _gain(now, 0.5 * (before_then + before_then.T), first), gain


class _Costs(NamedTuple):
    """z' state z + 2 z' cross v + v' input v."""

    state: Vector
    cross: Vector
    input: Vector


def _costs(step: LinearStep, weights: LqrWeights) -> _Costs:
    state, inputs = weights.matrices()
    by_state, by_input = step.speed[:SIZE] / weights.speed, step.speed[SIZE:] / weights.speed
    return _Costs(
        state + np.outer(by_state, by_state),
        np.outer(by_state, by_input),
        inputs + np.outer(by_input, by_input),
    )


def _gain(step: LinearStep, cost_to_go: Vector, costs: _Costs) -> Vector:
    weighed = step.by_input.T @ cost_to_go
    return np.linalg.solve(
        costs.input + weighed @ step.by_input, weighed @ step.by_state + costs.cross.T
    )


def last_turn(before: LinearStep, weights: LqrWeights) -> Vector:
    """What (5,) times (state without heading, offset) best estimates how far the last step turned.

    Feedback is on the heading of the last footprint, tasks show the error of the mean of two. The last step's heading change follows
    from the start of the step before. The map says how much of that start is left in the state now: this is the Gaussian estimate.
    """
    spread = np.array([*_PRIOR, 0.5 * weights.inter_leg_angle, weights.offset_change])
    ways = np.hstack([before.by_state[:, 1:], before.by_input]) * spread
    turned, seen = ways[0], ways[1:]
    floor = 1e-6 * np.diag(np.square(_PRIOR))
    return np.linalg.solve(seen @ seen.T + floor, seen @ turned)


@entry_point()
def _interpolate(table, angles, headings, at_angles, at_headings, found):
    """Bilinear interpolation of ``table`` (angles, headings, k) at n points of the grid, into ``found`` (n, k)."""
    # compiled: scipy's interpolator for a regular grid takes longer than a walking step, and planners ask at every one
    for row in range(len(found)):
        angle, heading = at_angles[row], at_headings[row]
        i = min(max(np.searchsorted(angles, angle) - 1, 0), len(angles) - 2)
        j = min(max(np.searchsorted(headings, heading) - 1, 0), len(headings) - 2)
        up = (angle - angles[i]) / (angles[i + 1] - angles[i])
        right = (heading - headings[j]) / (headings[j + 1] - headings[j])
        for k in range(found.shape[1]):
            near = (1.0 - right) * table[i, j, k] + right * table[i, j + 1, k]
            far = (1.0 - right) * table[i + 1, j, k] + right * table[i + 1, j + 1, k]
            found[row, k] = (1.0 - up) * near + up * far


class Scheduled(NamedTuple):
    """What to do near a gait, for any batch of walkers that stand on their left foot."""

    state: Vector
    """The gait's section state, shape (..., 5); its heading is that of the mean of two footprints apart."""
    inter_leg_angle: Vector
    """The gait's, rad, shape (...): what was asked for, or the nearest of which there is a gait."""
    held_offset: Vector
    """Mean of both feet's offsets, shape (...)."""
    pumping: Vector
    """What the left foot's has more than that, shape (...)."""
    gain: Vector
    """Shape (..., 2, 6)."""
    turn: Vector
    """Shape (..., 5); times (state without heading, offset), less the gait's: how far the last step turned, less the gait's turn."""


class GainSchedule:
    """Gaits and optimal gains over inter-leg angle and heading, rad, linear between the nodes of a grid.

    ``pumping`` drives the gaits beside the slope; ``has_downhill`` says whether headings are from downhill, or mean nothing; ``speeds`` has the
    shape (angles, headings).

    Raises
    ------
    NoGaitError
        If the walker has no gait straight downhill at 0.3 rad.
    """

    def __init__(self, parameters: WalkerParameters, weights: LqrWeights, pumping: Pumping) -> None:
        self.has_downhill = has_downhill(parameters)
        self.angles = np.array(ANGLES)
        # without a downhill all headings are equal: two equal columns at the ends of any range
        headings = headings_of(parameters, pumping) if self.has_downhill else (-1.0, 1.0)
        self.headings = np.array(headings)
        nodes = gait_nodes(parameters, pumping)
        self._table = np.array([_row_values(row, weights) for row in nodes])
        self.speeds = np.array([[node.speed for node in row] for row in nodes])

    def at(self, angles: Vector, headings: Vector) -> Scheduled:
        """Gaits and gains at points of any shape, held at the grid's edges."""
        angles, headings = np.broadcast_arrays(
            np.clip(angles, self.angles[0], self.angles[-1]),
            np.clip(headings, self.headings[0], self.headings[-1]),
        )
        found = np.empty((angles.size, self._table.shape[-1]))
        grid = (self._table, self.angles, self.headings)
        _interpolate(*grid, angles.ravel(), headings.ravel(), found)
        state, scalars, gain, turn = np.split(found.reshape(*angles.shape, -1), _ENDS, axis=-1)
        angle, held, pumping, _ = np.moveaxis(scalars, -1, 0)
        return Scheduled(state, angle, held, pumping, gain.reshape(*angles.shape, 2, SIZE), turn)

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


def _row_values(row: Sequence[GaitNode], weights: LqrWeights) -> list[Vector]:
    """The table's numbers for gaits along headings from one end to the other: those of opposite headings alternate in a walk."""
    values: list[Vector] = [np.empty(0)] * len(row)
    for k in range((len(row) + 1) // 2):
        node, opposite = row[k], row[-1 - k]
        gains = periodic_gains(node.step, opposite.step, weights)
        values[k] = _values(node, gains[0], last_turn(opposite.step, weights))
        values[-1 - k] = _values(opposite, gains[1], last_turn(node.step, weights))
    return values


def _values(node: GaitNode, gain: Vector, turn: Vector) -> Vector:
    scalars = [node.inter_leg_angle, node.held_offset, node.pumping, node.speed]
    return np.concatenate([node.state, scalars, gain.ravel(), turn])


schedule_of = lru_cache(maxsize=16)(GainSchedule)
"""The schedule of a walker's parameters, weights and pumping, made once."""
