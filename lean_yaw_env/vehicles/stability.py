"""What the vehicles share: one meaning of "critical speed", and the exact motion of a linear system."""

from __future__ import annotations

import math
from functools import singledispatch
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


class SpeedRange(NamedTuple):
    """Speeds between which upright straight motion is not unstable, in the vehicle's unit; ends included or not."""

    lower: float
    upper: float
    """``inf`` where there is no upper end."""


@singledispatch
def stable_speed_range(vehicle: object) -> SpeedRange | None:
    """Find the lowest range of forward speeds in which upright straight motion is not unstable; None if there is none.

    Not unstable: between the ends no eigenvalue has a positive real part. An undamped skateboard is only marginally stable there; a bicycle
    is, in general, asymptotically stable. Further ranges at higher speeds are not reported.

    Parameters
    ----------
    vehicle : Skateboard, LinearBicycle, Walker or another registered type
        ``stable_speed_range.register`` adds a type.

    Raises
    ------
    TypeError
        If no rule is registered for this type.
    """
    raise TypeError(
        f"vehicle must be of a class with a known stable speed range, got {vehicle!r}; "
        "register one with stable_speed_range.register"
    )


def critical_speed(vehicle: object) -> float:
    """The lower end of ``stable_speed_range``: 0 if the vehicle is not unstable however slowly it moves, ``inf`` if no speed makes it stable."""
    speeds = stable_speed_range(vehicle)
    return math.inf if speeds is None else speeds.lower


def linear_motion(matrix: FloatArray, start: FloatArray, times: FloatArray) -> FloatArray:
    """Solve x' = A x by the matrix exponential, for each of the ``times`` (n,) from the ``start`` (k,) itself; shape (n, k).

    Raises
    ------
    OverflowError
        If an unstable motion outgrows floating point before the last time.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        states = expm(times[:, None, None] * matrix) @ start
    lost = ~np.all(np.isfinite(states), axis=1)
    if np.any(lost):
        raise OverflowError(
            f"the motion outgrows floating point by time {times[lost].min():g} s; "
            "ask for a shorter time"
        )
    return states
