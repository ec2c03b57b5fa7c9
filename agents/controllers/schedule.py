"""Gains scheduled over a family of gaits: optimal about each, linear between."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.controllers.gaits import (
    ANGLES,
    GaitNode,
    Pumping,
    gait_nodes,
    has_downhill,
    headings_of,
)
from agents.controllers.regulator import SIZE, LqrWeights, last_turn, periodic_gains
from lean_yaw_env.kernel.compilation import entry_point
from lean_yaw_env.parameters import STATE_SIZE, Vector, WalkerParameters

_SCALARS = STATE_SIZE  # first column after the state
_GAIN = _SCALARS + 4
_TURN = _GAIN + 2 * SIZE


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
    """What to do near a gait, for any batch of walkers that stand on their left foot.

    Attributes
    ----------
    state : shape (..., 5)
        The gait's section state; its heading is that of the mean of two footprints apart.
    inter_leg_angle : shape (...)
        The gait's, rad: what was asked for, or the nearest of which there is a gait.
    held_offset : shape (...)
        Mean of both feet's offsets.
    pumping : shape (...)
        What the left foot's has more than that.
    gain : shape (..., 2, 6)
    turn : shape (..., 5)
        Times (state without heading, offset), less the gait's: how far the last step turned, less the gait's turn.
    """

    state: Vector
    inter_leg_angle: Vector
    held_offset: Vector
    pumping: Vector
    gain: Vector
    turn: Vector


class GainSchedule:
    """Gaits and optimal gains over inter-leg angle and heading, linear between the nodes of a grid.

    Parameters
    ----------
    parameters : WalkerParameters
    weights : LqrWeights
    pumping : Pumping
        What drives the gaits beside the slope.

    Attributes
    ----------
    angles, headings : rad
        The grid. Without a downhill the heading means nothing.
    has_downhill : bool
        Whether headings are from downhill.
    speeds : shape (angles, headings)

    Raises
    ------
    NoGaitError
        If the walker has no gait straight downhill at 0.3 rad.
    """

    def __init__(
        self, parameters: WalkerParameters, weights: LqrWeights, pumping: Pumping | None = None
    ) -> None:
        drive = Pumping() if pumping is None else pumping
        self.has_downhill = has_downhill(parameters)
        self.angles = np.array(ANGLES)
        # without a downhill one column stands for all, at either end of any range
        self.headings = np.array(headings_of(parameters, drive)) if self.has_downhill else np.array([-1.0, 1.0])  # fmt: skip
        nodes = gait_nodes(parameters, drive)
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
        found = found.reshape(*angles.shape, -1)
        gain = found[..., _GAIN:_TURN].reshape(*angles.shape, 2, SIZE)
        angle, held, pumping, _ = np.moveaxis(found[..., _SCALARS:_GAIN], -1, 0)
        return Scheduled(found[..., :STATE_SIZE], angle, held, pumping, gain, found[..., _TURN:])

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
    values: dict[int, Vector] = {}
    for k in range((len(row) + 1) // 2):
        node, opposite = row[k], row[-1 - k]
        gains = periodic_gains(node.step, opposite.step, weights)
        values[k] = _values(node, gains[0], last_turn(opposite.step, weights))
        values[len(row) - 1 - k] = _values(opposite, gains[1], last_turn(node.step, weights))
    return [values[k] for k in range(len(row))]


def _values(node: GaitNode, gain: Vector, turn: Vector) -> Vector:
    scalars = [node.inter_leg_angle, node.held_offset, node.pumping, node.speed]
    return np.concatenate([node.state, scalars, gain.ravel(), turn])


@lru_cache(maxsize=16)
def schedule_of(
    parameters: WalkerParameters, weights: LqrWeights, pumping: Pumping
) -> GainSchedule:
    """The schedule of a walker, weights and pumping, made once.

    Raises
    ------
    NoGaitError
        As ``GainSchedule``.
    """
    return GainSchedule(parameters, weights, pumping)
