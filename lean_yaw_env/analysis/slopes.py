"""Derivatives of a function that computes in single precision, by differences that choose their own step size."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from lean_yaw_env.parameters import Vector

_COARSEST, _SIZES = 0.25, 14
"""The largest step, in units of the scales, and how many there are, each half the one before."""
_ROUNDING = 2.0**-24
"""Of a number between a half and one in single precision."""


class Slopes(NamedTuple):
    """A function's ``values`` (m,) at a place, its ``slopes`` (m, k), and bounds of their ``errors`` (m, k)."""

    values: Vector
    slopes: Vector
    errors: Vector


def slopes_of(
    function: Callable[[Vector], Vector], place: Vector, scales: Vector, reach: Vector
) -> Slopes:
    """Derivatives by central differences.

    Each derivative is extrapolated from two step sizes, at the size where those beside it agree best: larger ones see the function's curve
    and its limits, smaller ones its rounding. How far they agree, and the rounding, is the error.

    Parameters
    ----------
    function : from places (n, k) to values (n, m)
    place : shape (k,)
    scales : shape (k,)
        Of each coordinate: what the function sees as a change of about one.
    reach : shape (m,)
        Of the values, whose rounding is relative to it.
    """
    size = len(place)
    steps = _COARSEST * 0.5 ** np.arange(_SIZES)[:, None] * scales
    offsets = steps[:, :, None] * np.eye(size)  # (sizes, k, k)
    both = np.concatenate([offsets, -offsets]).reshape(-1, size)
    found = function(np.vstack([place, place + both]))
    sides = found[1:].reshape(2, _SIZES, size, len(reach))
    central = (sides[0] - sides[1]) / (2.0 * steps[:, :, None])
    better = (4.0 * central[1:] - central[:-1]) / 3.0
    apart = np.abs(np.diff(better, axis=0))
    spread = np.maximum(apart[:-1], apart[1:]) + _ROUNDING * reach / steps[2:-1, :, None]
    best = spread.argmin(axis=0)[None]
    slopes = np.take_along_axis(better[1:-1], best, axis=0)[0]
    errors = np.take_along_axis(spread, best, axis=0)[0]
    return Slopes(found[0], slopes.T, errors.T)
