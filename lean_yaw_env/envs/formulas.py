"""Formulas that tasks share, on numbers of any kind: floats, arrays in Python, or complex numbers that carry a derivative.

``walker`` is a record with the fields of ``state.WALKER_FIELDS``. A decision looks at real parts (``x.real``), as those of the kernel do.
"""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
from numba.core import types

from lean_yaw_env.kernel.compilation import by_type, formula

_TURN = 2.0 * pi


@formula
def wrapped(angle: Any) -> Any:
    """An angle's equal between -pi and pi."""
    return angle - _TURN * np.floor(angle.real / _TURN + 0.5)


@formula
def positive(x: Any) -> Any:
    """A number, or zero if it is negative."""
    return x if x.real > 0.0 else 0.0 * x


@formula
def closeness(error: Any, width: float) -> Any:
    """1 without error, a half at ``width``, falling to 0."""
    ratio = error / width
    return 1.0 / (1.0 + ratio * ratio)


def direction(y: Any, x: Any) -> Any:
    """The angle of a point from the x axis towards the y axis, between -pi and pi."""
    return np.arctan2(y, x)


@by_type(direction)
def _direction(y, x):
    if not (isinstance(y, types.Complex) or isinstance(x, types.Complex)):
        return lambda y, x: np.arctan2(y, x)

    def with_derivative(y, x):
        square = x.real * x.real + y.real * y.real
        turn = (x.real * y.imag - y.real * x.imag) / square
        return complex(np.arctan2(y.real, x.real), turn)

    return with_derivative


@formula
def mean_heading(walker: Any) -> Any:
    """Mean heading of the last two footprints, which alternate in a straight walk."""
    return 0.5 * (walker.heading + walker.previous_heading)


@formula
def counted_time(walker: Any) -> Any:
    """How much of the last step's duration lies before the horizon: what sums over time add up."""
    return walker.share * walker.duration


@formula
def ends_in_time(walker: Any) -> bool:
    """Whether the last step ended before the horizon."""
    return walker.share.real == 1.0


@formula
def advance(x: Any, z: Any, heading: Any) -> Any:
    """How far a displacement, downhill and to the right, leads along a heading."""
    return x * np.cos(heading) - z * np.sin(heading)


@formula
def place(walker: Any) -> Any:
    """Where the walker is, downhill and to the right: the middle of the hips above the floor, beside the stance foot's contact reference point."""
    aside = 0.5 * walker.side * walker.hip_width
    return (
        walker.place_x + aside * np.sin(walker.heading),
        walker.place_z + aside * np.cos(walker.heading),
    )
