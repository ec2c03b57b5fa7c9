"""Checks and the exact time history shared by the linear vehicles."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def require_finite(name: str, value: float) -> float:
    """Return ``value`` as a float.

    Raises
    ------
    ValueError
        If it is not a finite number.
    """
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"{name} must be a finite number, got {value!r}")
    return number


def require_within(
    name: str, value: float, low: float, high: float = math.inf, *, low_included: bool = False
) -> float:
    """Return ``value`` as a float if it lies between ``low`` and ``high``.

    Raises
    ------
    ValueError
        If it is not finite, not below ``high``, or not above ``low`` (or equal to it, where
        ``low_included``).
    """
    number = float(value)
    above = number >= low if low_included else number > low
    if not (math.isfinite(number) and above and number < high):
        opening = "[" if low_included else "("
        raise ValueError(f"{name} must be in {opening}{low:g}, {high:g}), got {value!r}")
    return number


def finite_vector(name: str, values: ArrayLike) -> FloatArray:
    """Return a scalar or a sequence as a new vector of finite floats, shape (n,).

    Raises
    ------
    ValueError
        If it has more than one dimension, is empty or holds a value that is not finite.
    """
    vector = np.array(values, dtype=np.float64, ndmin=1)
    if vector.ndim != 1 or vector.size == 0:
        raise ValueError(
            f"{name} must be a number or a non-empty sequence, got shape {np.shape(values)}"
        )
    if not np.all(np.isfinite(vector)):
        raise ValueError(f"{name} must be finite, got {vector[~np.isfinite(vector)][0]!r}")
    return vector


def linear_motion(
    state_matrix: FloatArray, initial_state: FloatArray, times: FloatArray
) -> FloatArray:
    """Solve x' = A x by the matrix exponential, exact but for round-off.

    Every sample is computed from the initial state itself, so errors do not add up along the
    motion and the times need not be ordered.

    Parameters
    ----------
    state_matrix : shape (k, k)
        A, in 1/s.
    initial_state : shape (k,)
        State at time 0.
    times : shape (n,)
        Times of the samples in s.

    Returns
    -------
    shape (n, k)
        The state at each time.

    Raises
    ------
    OverflowError
        If an unstable motion outgrows floating point before the last time.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        states = expm(times[:, None, None] * state_matrix) @ initial_state
    lost = ~np.all(np.isfinite(states), axis=1)
    if np.any(lost):
        raise OverflowError(
            f"the motion outgrows floating point by time {times[lost].min():g} s; "
            "ask for a shorter time"
        )
    return states
