"""Outlines of footprints on the floor: a left and a right sole, turned to their headings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from lean_yaw_env.parameters import Foot, Vector
from lean_yaw_env.rendering.geometry import half_arc
from lean_yaw_env.walker import SIDE

LEAST_LENGTH = 0.14
"""A point foot leaves a print too, for the eye, in leg lengths."""

# A left sole of length one, from the heel clockwise: (ahead, to the right); the inner edge, on the
# right, is hollow.
_SOLE_KNOTS = np.array(
    [
        (-0.50, 0.01),
        (-0.47, 0.09),
        (-0.38, 0.145),
        (-0.24, 0.145),
        (-0.06, 0.105),
        (0.10, 0.13),
        (0.25, 0.185),
        (0.38, 0.18),
        (0.47, 0.12),
        (0.50, 0.03),
        (0.46, -0.07),
        (0.36, -0.15),
        (0.20, -0.19),
        (0.02, -0.17),
        (-0.20, -0.135),
        (-0.38, -0.12),
        (-0.47, -0.07),
    ]
)
CORNERS_PER_KNOT = 3
"""Corners of an outline for each of the points that shape it."""


def _smooth_sole() -> Vector:
    closed = np.vstack([_SOLE_KNOTS, _SOLE_KNOTS[:1]])
    curve = CubicSpline(np.arange(len(closed)), closed, bc_type="periodic")
    return curve(np.arange(len(_SOLE_KNOTS) * CORNERS_PER_KNOT) / CORNERS_PER_KNOT)


_SOLE = _smooth_sole()
_SOLE.flags.writeable = False


def footprint_length(foot_radius: float) -> float:
    """Length of the drawn print of a foot of this radius, in leg lengths."""
    return max(2.0 * foot_radius * half_arc(foot_radius), LEAST_LENGTH)


def footprint_outlines(
    positions: Vector, headings: Vector, feet: Sequence[Foot], length: float
) -> Vector:
    """Outlines of footprints on the floor.

    Parameters
    ----------
    positions : shape (n, 2)
        Contact reference points, (downhill, right).
    headings : shape (n,)
        rad, positive to the left.
    feet : n of "left" or "right"
    length : float
        Of a sole, in leg lengths.

    Returns
    -------
    shape (n, k, 2)
        Closed outlines, (downhill, right).
    """
    sides = np.array([SIDE[foot] for foot in feet])[:, None]
    ahead = length * _SOLE[None, :, 0]
    right = length * _SOLE[None, :, 1] * sides
    cosine, sine = np.cos(headings)[:, None], np.sin(headings)[:, None]
    downhill = positions[:, None, 0] + cosine * ahead + sine * right
    aside = positions[:, None, 1] - sine * ahead + cosine * right
    return np.stack([downhill, aside], axis=-1)
