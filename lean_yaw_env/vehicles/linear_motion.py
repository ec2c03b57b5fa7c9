"""The exact time history shared by the linear vehicles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


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
