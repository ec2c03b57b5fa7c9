"""How far a gait walks, how fast, and on which circle it turns."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.parameters import STATE_SIZE, Foot, Vector
from lean_yaw_env.walker import Walk, Walker

_STRAIGHT = 1e-9
"""A gait that turns by less than this in a cycle, rad, walks straight but for round-off."""
_AN_INSTANT = 1e-6


def distance_walked(displacements: ArrayLike, turn: ArrayLike = 0.0) -> NDArray[np.float64]:
    """Distances (...) walked in cycles: from each footprint to the same foot's next one, the mean of both feet.

    ``displacements`` (..., n, 2) are those of a cycle's n steps, n even, each downhill and to the right; ``turn`` (...) is the heading gained.
    In a turn the outer foot walks farther than the inner one.
    """
    steps = np.asarray(displacements, dtype=float)
    following = np.concatenate([steps[..., 1:, :], rotated(steps[..., :1, :], turn)], axis=-2)
    strides = steps + following
    return 0.5 * np.hypot(strides[..., 0], strides[..., 1]).sum(axis=-1)


def rotated(places: Vector, turn: ArrayLike) -> Vector:
    """Places (..., n, 2) on the floor, downhill and to the right, after a turn (...) to the left about the origin."""
    cosine, sine = (
        function(np.asarray(turn, dtype=float))[..., None] for function in (np.cos, np.sin)
    )
    x, z = places[..., 0], places[..., 1]
    return np.stack([cosine * x + sine * z, cosine * z - sine * x], axis=-1)


def axle_middle(walker: Walker, state: Vector, foot: Foot) -> Vector:
    """Where the middle of the hip axle is in a section state, seen from the contact reference point: downhill and to the right, (2,).

    It is the centre of the two masses while they are not moved aside.
    """
    motion = walker.stance_motion(
        state[:STATE_SIZE], stance=foot, duration=_AN_INSTANT, samples=2, mass_offset=0.0
    )
    ahead, right = motion["centre_x"][0], motion["centre_z"][0]
    return rotated(np.array([[ahead, right]]), state[0])[0]


def turning_radius(middles: Vector, displacement: Vector, turn: float) -> float:
    """Radius of the circle on which the middle of the hip axle walks; infinite if the gait does not turn.

    Every cycle moves the walker about the same centre. The radius is the root mean square distance from it at the heel strikes: of ``middles``
    (n, 2), seen from the first contact reference point, which moves by ``displacement`` (2,) over the cycle and turns by ``turn``.
    """
    if abs(turn) < _STRAIGHT:
        return math.inf
    remaining = np.eye(2) - rotated(np.eye(2), turn).T
    centre = np.linalg.solve(remaining, displacement)
    return float(np.sqrt(((middles - centre) ** 2).sum(axis=1).mean()))


def radius_of_walk(walker: Walker, walk: Walk, most_turn: float = 0.5 * math.pi) -> float:
    """Radius of the circle that fits the axle's middle at the heel strikes of a walk best, over its first ``most_turn``.

    A walk on a fixed slope does not repeat itself, so that there is no one centre: least squares in the equation of the circle.
    """
    turned = np.abs(walk.headings - walk.headings[0])
    n = int(np.searchsorted(turned, most_turn)) if turned.max() >= most_turn else len(turned)
    places = walk.footprints[:n] + np.array(
        [axle_middle(walker, walk.states[i], walk.stances[i]) for i in range(n)]
    )
    rows = np.column_stack([2.0 * places, np.ones(n)])
    x, z, rest = np.linalg.lstsq(rows, (places**2).sum(axis=1), rcond=None)[0]
    return float(np.sqrt(rest + x * x + z * z))
