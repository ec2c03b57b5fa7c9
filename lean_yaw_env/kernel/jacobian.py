"""Exact derivatives of walking steps, by the complex step through the very same formulas.

With a tiny imaginary part on one input, the imaginary parts of the outcome are as many times its derivatives, to round-off and with no
difference of nearby numbers. The landing time carries its own imaginary part, so the event's share (the saltation) is in.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.kernel.blocks import block_of, derivatives_of
from lean_yaw_env.kernel.compilation import compiled_apart, entry_point
from lean_yaw_env.kernel.records import FAILED, Body, Command
from lean_yaw_env.kernel.step import ACTIVE

INPUTS = ACTIVE.inputs
"""Columns: the section state (5), the command (3), then the body's constants that are differentiable (6)."""

OUTPUTS = ACTIVE.outputs
"""Rows: the section state (5), then what else a step is judged by."""

_run = derivatives_of(ACTIVE)
_BLOCK = block_of(ACTIVE, INPUTS, OUTPUTS)
_carefully = _BLOCK.carefully


@compiled_apart(_BLOCK.name, _BLOCK.size, _BLOCK.ended, FAILED)
def careful_derivatives(work, i):
    """As ``careful_step``, with derivatives."""
    _carefully(work, i)


@entry_point()
def step_jacobians(bodies, commands, states, sides, statuses, outputs, jacobians, first, last):
    """Differentiate the steps of walkers ``first`` to ``last`` - 1.

    ``bodies`` (1 or n, 11), ``commands`` (n, 3), ``states`` (n, 5), ``sides`` (n,); written: how they ended in ``statuses`` (n,), the first of
    ``OUTPUTS`` in ``outputs`` (n, .), and in ``jacobians`` (n, k, m) the derivatives of the first k of them by the first m of ``INPUTS``.
    Columns that are not asked for cost nothing.
    """
    _run(bodies, commands, states, sides, statuses, outputs, jacobians, first, last)


def step_jacobian(
    body: Body, command: Command, state: NDArray[np.float64], side: float, inputs: int = len(INPUTS)
) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """How one walker's step ended, ``OUTPUTS`` (10,), and their derivatives (10, ``inputs``) by the first of ``INPUTS``."""
    status, outputs = np.empty(1), np.empty((1, len(OUTPUTS)))
    jacobian = np.empty((1, len(OUTPUTS), inputs))
    step_jacobians(
        np.array([body]), np.array([command]), np.array([state]), np.array([side]), status, outputs, jacobian,
        0, 1,
    )  # fmt: skip
    return float(status[0]), outputs[0], jacobian[0]
