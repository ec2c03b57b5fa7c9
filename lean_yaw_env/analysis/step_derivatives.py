"""A walking step with its exact derivatives."""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import ArrayLike

from lean_yaw_env.errors import FellError
from lean_yaw_env.kernel.jacobian import INPUTS, step_jacobian
from lean_yaw_env.kernel.records import Command
from lean_yaw_env.parameters import STATE_SIZE, Foot, Vector, require_state
from lean_yaw_env.walker import FALL_OF_STATUS, SIDE, Walker, raise_for_failure

BY_STATE, BY_COMMAND, BY_BODY = STATE_SIZE, STATE_SIZE + len(Command._fields), len(INPUTS)
"""Numbers of inputs by which a step is differentiated."""


class StepDerivatives(NamedTuple):
    """``kernel.jacobian.OUTPUTS`` (10,) of one walking step, and their derivatives (10, inputs) by the first of ``kernel.jacobian.INPUTS``.

    Those are the section state, the inter-leg angle, the mass offset, the offset before, then ``BODY_PARAMETERS``.
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


def differentiate_step(
    walker: Walker, state: ArrayLike, stance: Foot, command: Command, *, inputs: int = BY_COMMAND
) -> StepDerivatives:
    """One walking step with its exact derivatives (complex step through the kernel; the landing time's share included).

    ``inputs`` is how many columns of the Jacobian are wanted: ``BY_STATE``, ``BY_COMMAND`` too or ``BY_BODY`` too. Each costs.

    Raises
    ------
    FellError
        If the walker does not complete the step; names the way it fell.
    SolverError
        If the integrator fails.
    """
    start, body = require_state(state), walker.parameters.body()
    status, outputs, rows = step_jacobian(body, command, start, SIDE[stance], inputs)
    raise_for_failure(status, body, command, start, SIDE[stance])
    if status in FALL_OF_STATUS:
        raise FellError(
            f"the walker fell {FALL_OF_STATUS[status].value} in the step on its {stance} foot"
        )
    return StepDerivatives(outputs, rows)
