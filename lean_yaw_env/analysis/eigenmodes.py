"""A gait's modes: eigenvectors of its Jacobian, each named by the motion it is about.

A mode is fore-aft where only pitch and swing take part, three-dimensional where heading and ankle
do. Shares are participation factors, left times right eigenvector entry by entry, which depend on no
choice of units. Without hip width each mode is purely one or the other; with it, the larger share
names it.

The paper prints two zeros for the flat passive walker. One is exact, see ``Mode.explanation``. The
other, of its three-dimensional modes, is 3e-4 at its ankle tilt of 0.15: it is zero where the ankle
axis is vertical at heel strike, which makes the strike forget the lean.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from lean_yaw_env.analysis.limit_cycle import LimitCycle

LATERAL = ("heading", "ankle_angle", "ankle_rate")
"""Coordinates that only a three-dimensional motion moves."""

ZERO = 1e-6
"""A multiplier below this is zero but for round-off: its disturbance is gone within a cycle."""

ModeName = Literal["fore-aft", "three-dimensional"]


@dataclass(frozen=True)
class Mode:
    """One mode of a gait.

    Attributes
    ----------
    eigenvalue : complex
        Its multiplier over the cycle.
    vector : shape (n,), complex
        Right eigenvector in the gait's ``coordinates``, of unit length.
    left_vector : shape (n,)
        Left eigenvector: the combination of coordinates that the mode multiplies.
    name : "fore-aft" or "three-dimensional"
    lateral_share : float in [0, 1]
        Of heading, ankle angle and ankle rate in it.
    is_zero : bool
    explanation : str
        For a zero one, why; otherwise empty.
    """

    eigenvalue: complex
    vector: NDArray[np.complex128]
    left_vector: NDArray[np.complex128]
    name: ModeName
    lateral_share: float
    is_zero: bool
    explanation: str


def modes(cycle: LimitCycle) -> tuple[Mode, ...]:
    """Take a gait's Jacobian apart, by falling magnitude of the multipliers.

    Parameters
    ----------
    cycle : LimitCycle

    Returns
    -------
    tuple of Mode
        As many as ``cycle.eigenvalues``.
    """
    values, left, right = _eigen(cycle.jacobian)
    lateral = np.isin(cycle.coordinates, LATERAL)
    found = []
    for value, backward, forward in zip(values, left.T, right.T, strict=True):
        factors = np.abs(np.conj(backward) * forward)
        weights = factors if factors.sum() > 1e-12 else np.abs(forward) ** 2
        share = float(weights[lateral].sum() / weights.sum())
        is_zero = bool(abs(value) < ZERO)
        found.append(
            Mode(
                eigenvalue=complex(value),
                vector=forward.astype(complex),
                left_vector=np.conj(backward).astype(complex),
                name="three-dimensional" if share > 0.5 else "fore-aft",
                lateral_share=share,
                is_zero=is_zero,
                explanation=_explanation(cycle.coordinates) if is_zero else "",
            )
        )
    return tuple(sorted(found, key=lambda mode: (-abs(mode.eigenvalue), -mode.eigenvalue.imag)))


def _eigen(matrix: NDArray[np.float64]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Eigenvalues, left and right eigenvectors (columns)."""
    values, left, right = linalg.eig(matrix, left=True, right=True)  # pyright: ignore[reportAssignmentType]
    return values, left, right


def _explanation(coordinates: tuple[str, ...]) -> str:
    if "inter_leg_rate" in coordinates:
        return (
            "swing rate: the swing foot's mass acts on nothing, and at heel strike the new swing "
            "foot's momentum follows from the stance leg's pose and rates, so that the state after "
            "a strike has one freedom less than the section"
        )
    return (
        "section: the swing leg is held at a fixed angle, and two legs at a fixed angle with both "
        "feet on the floor determine the stance pitch from the ankle angle, so that the state "
        "after a strike has one freedom less than the section"
    )
