"""A gait's modes: eigenvectors of its Jacobian, each named by the motion it is about.

A mode is fore-aft where only pitch and swing take part, three-dimensional where heading and ankle do. Shares are participation factors, left
times right eigenvector entry by entry, which depend on no choice of units. Without hip width each mode is purely one or the other; with it,
the larger share names it.

The paper prints two zeros for the flat passive walker. One is exact, see ``Mode.explanation``. The other, of its three-dimensional modes, is
3e-4 at its ankle tilt of 0.15: it is zero where the ankle axis is vertical at heel strike, which makes the strike forget the lean.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from lean_yaw_env.analysis.limit_cycle import LimitCycle
from lean_yaw_env.analysis.section_map import Motion
from lean_yaw_env.validation import require_instance

ZERO = 1e-6
"""A multiplier below this is zero but for round-off: its disturbance is gone within a cycle."""
_NO_PART = 1e-9
"""Participation factors that sum to less say nothing: left and right eigenvector of a multiple eigenvalue are square to each other."""

ModeName = Literal["fore-aft", "three-dimensional"]


@dataclass(frozen=True)
class Mode:
    """One mode of a gait.

    Attributes
    ----------
    eigenvalue : complex
        Its multiplier over the cycle.
    error : float
        Of the eigenvalue, to first order, from what the Jacobian leaves uncertain; zero where that is exact, infinite for a multiple one.
    vector : shape (n,), complex
        Right eigenvector in the gait's ``coordinates``, of unit length.
    left_vector : shape (n,)
        Left eigenvector: the combination of coordinates that the mode multiplies.
    name : "fore-aft" or "three-dimensional"
    lateral_share : float in [0, 1]
        Of all but the fore-aft motion in it.
    about : "heading", "lean", "pitch" or "masses"
        The motion that takes the largest part in it; "pitch" is the fore-aft one.
    is_zero : bool
    is_neutral : bool
        Whether it multiplies by one, as nothing answers to what it moves.
    explanation : str
        For a zero one, why; otherwise empty.
    """

    eigenvalue: complex
    error: float
    vector: NDArray[np.complex128]
    left_vector: NDArray[np.complex128]
    name: ModeName
    lateral_share: float
    about: Motion
    is_zero: bool
    is_neutral: bool
    explanation: str


def modes(cycle: LimitCycle) -> tuple[Mode, ...]:
    """Take a gait's Jacobian apart: as many modes as ``cycle.eigenvalues``, by falling magnitude."""
    require_instance("cycle", cycle, LimitCycle)
    values, left, right = linalg.eig(cycle.jacobian, left=True, right=True)  # pyright: ignore[reportAssignmentType]
    found = [
        _mode(cycle, complex(value), np.conj(backward), forward)
        for value, backward, forward in zip(values, left.T, right.T, strict=True)
    ]
    return tuple(sorted(found, key=lambda mode: (-abs(mode.eigenvalue), -mode.eigenvalue.imag)))


def _mode(
    cycle: LimitCycle, value: complex, left: NDArray[np.complex128], right: NDArray[np.complex128]
) -> Mode:
    factors = np.abs(left * right)
    weights = factors if factors.sum() > _NO_PART else np.abs(right) ** 2
    section_map = cycle.section_map
    of_name = dict(zip(section_map.names, section_map.motions, strict=True))
    motions = np.array([of_name[name] for name in cycle.coordinates])
    shares: dict[Motion, float] = {
        each: float(weights[motions == each].sum() / weights.sum()) for each in get_args(Motion)
    }
    lateral, is_zero = 1.0 - shares["pitch"], abs(value) < ZERO
    bound = float(np.abs(left) @ cycle.jacobian_error @ np.abs(right))
    overlap = float(abs(left @ right))
    return Mode(
        eigenvalue=value,
        error=0.0 if bound == 0.0 else bound / overlap if overlap > 0.0 else float("inf"),
        vector=right.astype(complex),
        left_vector=left.astype(complex),
        name="three-dimensional" if lateral > 0.5 else "fore-aft",
        lateral_share=lateral,
        about=max(shares, key=lambda each: shares[each]),
        is_zero=is_zero,
        is_neutral=abs(value - 1.0) < section_map.neutral_within,
        explanation=section_map.zero_explanation if is_zero else "",
    )
