"""Gaits of the passive nine-coordinate walker, and what they settle about Table 3, column C.

Everything here is by finite differences of a reference model: good to about six digits, and no more is claimed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lean_yaw_env.multibody.kinematics import Vector
from lean_yaw_env.multibody.results import MultibodyStep
from lean_yaw_env.multibody.walker import MultibodyWalker

PASSIVE_STATE_FIELDS = (
    "heading",
    "stance_pitch",
    "ankle_angle",
    "stance_pitch_rate",
    "ankle_rate",
    "inter_leg_rate",
    "inter_leg_angle",
)
"""Section state of a passive step followed by the angle at which the swing leg starts.

The angle is no independent initial condition: at heel strike both feet touch the floor. It is kept as one, since it is
ill-conditioned to compute when the trailing foot's ankle axis is vertical, and adds one eigenvalue of zero.
"""

_MIRROR = np.array([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, 1.0])
_LATERAL = (0, 2, 4)
_FORE_AFT = (1, 3, 5, 6)
_TABLE_3_GUESS = np.array([0.0, 0.153, 0.0, -0.1222, 0.0, 0.0028, -0.306])


class NoPassiveGaitError(RuntimeError):
    """No passive gait was found from the given guess; the message says what was tried."""


@dataclass(frozen=True)
class PassiveGait:
    """A symmetric passive gait and its linearised stride.

    Attributes
    ----------
    state : shape (7,)
        In the order of `PASSIVE_STATE_FIELDS`, for left stance.
    step : MultibodyStep
        The left stance's step from there.
    eigenvalues : shape (7,), complex
        Of the stride map, by falling magnitude. One zero belongs to the inter-leg angle, see `PASSIVE_STATE_FIELDS`.
    stride_jacobian : shape (7, 7)
        By central differences of the mirrored step map, squared.
    residual : float
        Largest change of any entry in one mirrored step.
    """

    state: Vector
    step: MultibodyStep
    eigenvalues: Vector
    stride_jacobian: Vector
    residual: float


def mirrored_passive_step(walker: MultibodyWalker, state: Vector) -> tuple[Vector, MultibodyStep]:
    """One left step, its end mirrored back to left stance; twice this is a stride, mirrored twice.

    Raises
    ------
    NoPassiveGaitError
        If the walker falls; names the way.
    """
    step = walker.step(state[:6], inter_leg_angle=float(state[6]), swing="passive")
    if step.fall is not None:
        raise NoPassiveGaitError(
            f"the step from {np.array2string(state, precision=6)} fell: {step.fall}"
        )
    return _MIRROR * np.array([*step.state, step.inter_leg_angle]), step


def _step_jacobian(walker: MultibodyWalker, state: Vector, width: float) -> Vector:
    columns = []
    for index in range(len(state)):
        shift = np.zeros(len(state))
        shift[index] = width
        ahead, _ = mirrored_passive_step(walker, state + shift)
        behind, _ = mirrored_passive_step(walker, state - shift)
        columns.append((ahead - behind) / (2.0 * width))
    return np.array(columns).T


def find_passive_gait(
    walker: MultibodyWalker,
    guess: Vector,
    *,
    difference: float = 1e-5,
    residual: float = 1e-9,
    max_iterations: int = 12,
) -> PassiveGait:
    """Find a symmetric passive gait by Newton's method on the mirrored step, and its stride's eigenvalues.

    Parameters
    ----------
    guess : shape (7,)
        In the order of `PASSIVE_STATE_FIELDS`, for left stance.
    difference : float
        Half-width of the central differences.
    residual : float
        Largest entry of the fixed-point equation that is accepted.

    Raises
    ------
    ValueError
        If ``guess`` has another shape.
    NoPassiveGaitError
        If the walker falls on the way or the iteration does not converge.
    """
    state = np.array(guess, dtype=float)
    if state.shape != (len(PASSIVE_STATE_FIELDS),):
        raise ValueError(f"guess must have shape (7,), got {state.shape}")
    error = np.inf
    for _ in range(max_iterations):
        after, step = mirrored_passive_step(walker, state)
        error = float(np.abs(after - state).max())
        jacobian = _step_jacobian(walker, state, difference)
        if error <= residual:
            stride = jacobian @ jacobian
            values = np.linalg.eigvals(stride)
            return PassiveGait(
                state, step, values[np.argsort(-np.abs(values))], stride, error
            )
        state = state + np.linalg.solve(np.eye(len(state)) - jacobian, after - state)
    raise NoPassiveGaitError(
        f"Newton's method did not converge in {max_iterations} iterations from "
        f"{np.array2string(np.array(guess), precision=6)}: residual {error:.3g}"
    )


@dataclass(frozen=True)
class Table3Column:
    """Eigenvalues of the flat passive walker's stride, Table 3, column C, at one foot mass.

    Attributes
    ----------
    foot_mass : float
        Of each foot.
    fore_aft, lateral : shapes (4,) and (3,)
        Eigenvalues by falling magnitude. At zero hip width the two kinds of motion decouple exactly.
    gait : PassiveGait
        The gait they belong to.
    """

    foot_mass: float
    fore_aft: Vector
    lateral: Vector
    gait: PassiveGait


def table3_c_eigenvalues(
    foot_mass: float, *, ankle_tilt: float = 0.15, slope: float = 0.00058, difference: float = 1e-5
) -> Table3Column:
    """Eigenvalues of Table 3, column C (hip width 0, foot radius 0.5, passive) at a finite foot mass.

    By central finite differences of the nine-coordinate model; about 5 s.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    NoPassiveGaitError
        If there is no gait near the paper's, stance pitch 0.15.
    """
    walker = MultibodyWalker(0.0, 0.5, ankle_tilt, slope, foot_mass=foot_mass)
    gait = find_passive_gait(walker, _TABLE_3_GUESS, difference=difference)

    def block(indices: tuple[int, ...]) -> Vector:
        values = np.linalg.eigvals(gait.stride_jacobian[np.ix_(indices, indices)])
        return values[np.argsort(-np.abs(values))]

    return Table3Column(foot_mass, block(_FORE_AFT), block(_LATERAL), gait)
