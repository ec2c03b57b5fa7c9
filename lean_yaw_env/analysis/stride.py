"""The derivatives of a walking step, and the stride map (two steps, left foot to left foot) with its Jacobian; eqs. (6) and (7) of the paper."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from lean_yaw_env.errors import FellError
from lean_yaw_env.kernel.jacobian import INPUTS, step_jacobian
from lean_yaw_env.kernel.records import Command
from lean_yaw_env.parameters import (
    INTER_LEG_ANGLE,
    STATE_SIZE,
    Vector,
    require_mass_offset,
    require_state,
)
from lean_yaw_env.walker import (
    FALL_OF_STATUS,
    OTHER_FOOT,
    SIDE,
    Foot,
    StepResult,
    Walker,
    raise_for_failure,
    require_command,
    require_completed,
)


@dataclass(frozen=True)
class StrideJacobian:
    """The stride map and its derivatives at a point of the section.

    Attributes
    ----------
    state : shape (5,)
        Section state after the stride.
    matrix : shape (5, 5)
        Derivatives by the section state; entry (i, j) has unit(i) / unit(j).
    by_inter_leg_angle, by_mass_offset : shape (5,)
        Derivatives by the two commands, held over the stride.
    """

    state: Vector
    matrix: Vector
    by_inter_leg_angle: Vector
    by_mass_offset: Vector


@dataclass(frozen=True)
class StepDerivatives:
    """One walking step with its exact derivatives.

    Attributes
    ----------
    outputs : shape (10,)
        What comes out of the step, in the order of ``kernel.jacobian.OUTPUTS``.
    jacobian : shape (10, 8) or (10, 14)
        Its derivatives by the section state, the inter-leg angle, the mass offset, the offset before and, if asked for, the body's first
        six constants.
    """

    outputs: Vector
    jacobian: Vector

    @property
    def state(self) -> Vector:
        """Section state after the step, shape (5,)."""
        return self.outputs[:STATE_SIZE]

    @property
    def by_state(self) -> Vector:
        """Of the section state by the section state, shape (5, 5)."""
        return self.jacobian[:STATE_SIZE, :STATE_SIZE]

    @property
    def by_inter_leg_angle(self) -> Vector:
        """Of the section state, shape (5,); the same of the two offsets."""
        return self.jacobian[:STATE_SIZE, STATE_SIZE]

    @property
    def by_mass_offset(self) -> Vector:
        return self.jacobian[:STATE_SIZE, STATE_SIZE + 1]

    @property
    def by_previous_offset(self) -> Vector:
        return self.jacobian[:STATE_SIZE, STATE_SIZE + 2]


def require_offsets(mass_offset: float | tuple[float, float]) -> tuple[float, float]:
    """Offsets in force while the left and while the right foot stands, or ``ValueError``."""
    if isinstance(mass_offset, (tuple, list, np.ndarray)):
        if len(mass_offset) != 2:
            raise ValueError(
                f"mass_offset must be a number or a pair (left foot's, right foot's), "
                f"got {mass_offset!r}"
            )
        left, right = mass_offset
        return require_mass_offset(left, "left mass_offset"), require_mass_offset(
            right, "right mass_offset"
        )
    both = require_mass_offset(mass_offset)
    return both, both


def differentiate_step(
    walker: Walker, state: ArrayLike, stance: Foot, command: Command, *, with_body: bool = False
) -> StepDerivatives:
    """One walking step with its exact derivatives (complex step through the kernel; the landing time's share included).

    Raises
    ------
    FellError
        If the walker does not complete the step; names the way it fell.
    SolverError
        If the integrator fails.
    """
    start = require_state(state)
    body = walker.parameters.body()
    inputs = len(INPUTS) if with_body else STATE_SIZE + len(command)
    status, outputs, rows = step_jacobian(body, command, start, SIDE[stance], inputs)
    raise_for_failure(status, body, command, start, SIDE[stance])
    if status in FALL_OF_STATUS:
        raise FellError(
            f"the walker fell {FALL_OF_STATUS[status].value} in the step on its {stance} foot"
        )
    return StepDerivatives(outputs, rows)


def stride_map(
    walker: Walker,
    state: ArrayLike,
    *,
    inter_leg_angle: float = INTER_LEG_ANGLE,
    mass_offset: float | tuple[float, float] = 0.0,
) -> tuple[StepResult, StepResult]:
    """The two steps of a stride that starts on the left foot; the section state is the second one's.

    Parameters
    ----------
    walker : Walker
    state : shape (5,)
    inter_leg_angle : (0, pi/2)
    mass_offset : [-1, 1], or a pair of them
        Constant, or in force while the left and while the right foot stands: the masses then start
        the stride where the right foot's step has left them.

    Raises
    ------
    FellError
        If the walker does not complete the stride; names the step and the way it fell.
    ValueError
        If an argument is outside its range.
    """
    left, right = require_offsets(mass_offset)
    first = require_completed(
        walker.step(
            state, inter_leg_angle=inter_leg_angle, mass_offset=left, previous_offset=right
        ),
        "the stride's first step",
    )
    second = require_completed(
        walker.step(
            first.state,
            stance=first.stance,
            inter_leg_angle=inter_leg_angle,
            mass_offset=right,
            previous_offset=first.mass_offset,
        ),
        "the stride's second step",
    )
    return first, second


def stride_jacobian(
    walker: Walker,
    state: ArrayLike,
    *,
    inter_leg_angle: float = INTER_LEG_ANGLE,
    mass_offset: float | tuple[float, float] = 0.0,
) -> StrideJacobian:
    """Linearise the stride map at a point of the heel-strike section, left stance.

    At a fixed point the matrix's eigenvalues are the gait's Floquet multipliers; elsewhere they
    mean nothing of the kind. With an offset for each foot, the masses are taken to arrive within
    each step, and the derivative by the offset is by a change common to both.

    Raises
    ------
    FellError
        If the walker does not complete the stride.
    ValueError
        If an argument is outside its range.
    """
    left, right = require_offsets(mass_offset)
    first = differentiate_step(walker, state, "left", require_command(inter_leg_angle, left, right))
    second = differentiate_step(
        walker, first.state, OTHER_FOOT["left"], require_command(inter_leg_angle, right, left)
    )
    return StrideJacobian(
        state=second.state,
        matrix=second.by_state @ first.by_state,
        by_inter_leg_angle=second.by_state @ first.by_inter_leg_angle + second.by_inter_leg_angle,
        by_mass_offset=second.by_state @ (first.by_mass_offset + first.by_previous_offset)
        + second.by_mass_offset
        + second.by_previous_offset,
    )
