"""Derivatives of many walking steps in one compiled call, for searches over many walkers."""

from __future__ import annotations

from lean_yaw_env.kernel.compilation import entry_point
from lean_yaw_env.kernel.jacobian import step_jacobian
from lean_yaw_env.kernel.records import Body, Command


@entry_point()
def step_jacobians(bodies, commands, states, sides, statuses, afters, jacobians, first, last):
    """``step_jacobian`` of walkers ``first`` to ``last`` - 1.

    ``bodies`` (1 or n, 11), ``commands`` (n, 3), ``states`` (n, 5), ``sides`` (n,); written: ``statuses``
    (n,), ``afters`` (n, 5), ``jacobians`` (n, k, 8) of the first k outputs.
    """
    for i in range(first, last):
        p, c, s = bodies[i if bodies.shape[0] > 1 else 0], commands[i], states[i]
        statuses[i] = step_jacobian(
            Body(p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10]),
            Command(c[0], c[1], c[2]),
            s[0],
            s[1],
            s[2],
            s[3],
            s[4],
            sides[i],
            afters[i],
            jacobians[i],
        )
