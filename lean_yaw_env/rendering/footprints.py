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

# A left sole of length one, from the heel clockwise: (ahead, to the right); the inner edge, on the right, is hollow.
_SOLE_KNOTS = [
    (-0.50, 0.01), (-0.47, 0.09), (-0.38, 0.145), (-0.24, 0.145), (-0.06, 0.105), (0.10, 0.13),
    (0.25, 0.185), (0.38, 0.18), (0.47, 0.12), (0.50, 0.03), (0.46, -0.07), (0.36, -0.15),
    (0.20, -0.19), (0.02, -0.17), (-0.20, -0.135), (-0.38, -0.12), (-0.47, -0.07), (-0.50, 0.01),
]  # fmt: skip
CORNERS_PER_KNOT = 3
"""Corners of an outline for each of the points that shape it."""
_CORNERS = (len(_SOLE_KNOTS) - 1) * CORNERS_PER_KNOT
_SOLE = CubicSpline(np.arange(len(_SOLE_KNOTS)), _SOLE_KNOTS, bc_type="periodic")(
    np.arange(_CORNERS) / CORNERS_PER_KNOT
)


def footprint_length(foot_radius: float) -> float:
    """Length of the drawn print of a foot of this radius, in leg lengths."""
    return max(2.0 * foot_radius * half_arc(foot_radius), LEAST_LENGTH)


def footprint_outlines(
    positions: Vector, headings: Vector, feet: Sequence[Foot], length: float
) -> Vector:
    """Outlines of footprints on the floor, (downhill, right); shape (n, k, 2).

    Parameters
    ----------
    positions, headings, feet : shapes (n, 2) and (n,), and n of "left" or "right"
        Contact reference points, (downhill, right), and headings, rad, positive to the left.
    length : float
        Of a sole, in leg lengths.
    """
    sides = np.array([SIDE[foot] for foot in feet])[:, None]
    ahead = length * _SOLE[None, :, 0]
    right = length * _SOLE[None, :, 1] * sides
    cosine, sine = np.cos(headings)[:, None], np.sin(headings)[:, None]
    downhill = positions[:, None, 0] + cosine * ahead + sine * right
    aside = positions[:, None, 1] - sine * ahead + cosine * right
    return np.stack([downhill, aside], axis=-1)
