"""Gains scheduled over a family of gaits: optimal about each, linear between."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from agents.controllers.gaits import (
    ANGLES,
    GaitNode,
    Pumping,
    gait_nodes,
    has_downhill,
    headings_of,
)
from agents.controllers.regulator import SIZE, LqrWeights, last_turn, periodic_gains
from lean_yaw_env.parameters import STATE_SIZE, Vector, WalkerParameters

_COLUMNS = np.cumsum((STATE_SIZE, 1, 1, 1, 1, 2 * SIZE, STATE_SIZE))[:-1]


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
        values = np.array([_row_values(row, weights) for row in nodes])
        self._table = RegularGridInterpolator((self.angles, self.headings), values)
        self.speeds = np.array([[node.speed for node in row] for row in nodes])

    def at(self, angles: Vector, headings: Vector) -> Scheduled:
        """Gaits and gains at points of any shape, held at the grid's edges."""
        points = np.stack(
            [
                np.clip(angles, self.angles[0], self.angles[-1]),
                np.clip(headings, self.headings[0], self.headings[-1]),
            ],
            axis=-1,
        )
        # the interpolator makes a row of a single point
        found = self._table(points).reshape(*points.shape[:-1], -1)
        state, angle, held, pumping, _, gain, turn = np.split(found, _COLUMNS, axis=-1)
        gain = gain.reshape(*gain.shape[:-1], 2, SIZE)
        return Scheduled(state, angle[..., 0], held[..., 0], pumping[..., 0], gain, turn)

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
