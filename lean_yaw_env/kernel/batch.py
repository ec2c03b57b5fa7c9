"""Many walking steps at once: the same formulas as ``step``, in lanes."""

from __future__ import annotations

from lean_yaw_env.kernel.blocks import steps_of
from lean_yaw_env.kernel.compilation import entry_point
from lean_yaw_env.kernel.step import ACTIVE

_run = steps_of(ACTIVE)


@entry_point()
def step_batch(bodies, commands, states, sides, outcomes, first, last):
    """Step walkers ``first`` to ``last`` - 1.

    ``bodies`` (1 or n, 11), ``commands`` (n, 3), ``states`` (n, 5), ``sides`` (n,) and ``outcomes`` (n, 18) hold a record a row, in the
    order of ``records``.
    """
    _run(bodies, commands, states, sides, outcomes, first, last)
