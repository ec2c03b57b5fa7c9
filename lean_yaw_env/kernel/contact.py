"""How small the normal force and how great the friction get within an integrator step.

The forces are known at the step's ends and at three of its stages. Between these looks a quartic through all five is evaluated at four more
places. What a dip between two places goes deeper is missed: in a step without a shift less than 1e-5 of the walker's weight, in one that
shifts the masses by 0.06 in the default time less than 1e-3, in a third of that time about 2e-3 (the tests measure it). The ratio
of the forces has no bound where the normal force vanishes: there the greatest friction only says that it is large.
"""

from __future__ import annotations

from lean_yaw_env.kernel import verner
from lean_yaw_env.kernel.compilation import fused

_LOOKS = (0.0, verner.NODES[7], verner.NODES[6], verner.NODES[9], 1.0)


def _weights(place: float) -> tuple[float, float, float, float, float]:
    """What each look counts in the quartic's value at a place within the step (Lagrange)."""
    values = []
    for i, look in enumerate(_LOOKS):
        value = 1.0
        for j, other in enumerate(_LOOKS):
            if j != i:
                value *= (place - other) / (look - other)
        values.append(value)
    first, second, third, fourth, fifth = values
    return first, second, third, fourth, fifth


# In the widest intervals between looks
_PLACE_1, _PLACE_2, _PLACE_3, _PLACE_4 = (
    _weights(0.08),
    _weights(0.30),
    _weights(0.60),
    _weights(0.76),
)


@fused
def _between(weights, looks):
    return (
        weights[0] * looks[0]
        + weights[1] * looks[1]
        + weights[2] * looks[2]
        + weights[3] * looks[3]
        + weights[4] * looks[4]
    )


@fused
def _worse(weights, normals, tangentials, least, normal, tangential):
    """Compare one more place with the worst so far: least normal force, and the two forces where their ratio is greatest."""
    n = _between(weights, normals)
    t = _between(weights, tangentials)
    more = t * normal * normal > tangential * n * n
    return min(least, n), n if more else normal, t if more else tangential


@fused
def _worse_look(n, t, least, normal, tangential):
    more = t * normal * normal > tangential * n * n
    return min(least, n), n if more else normal, t if more else tangential


@fused
def worst_contact(normals, tangentials):
    """Least normal force, and greatest squared ratio of tangential to normal force, of a step.

    Both arguments are looks at the start, at stages 7, 6 and 9, and at the end; the second are squares.
    """
    n, t = normals, tangentials
    least, normal, tangential = _worse_look(n[1], t[1], n[0], n[0], t[0])
    least, normal, tangential = _worse_look(n[2], t[2], least, normal, tangential)
    least, normal, tangential = _worse_look(n[3], t[3], least, normal, tangential)
    least, normal, tangential = _worse_look(n[4], t[4], least, normal, tangential)
    least, normal, tangential = _worse(_PLACE_1, n, t, least, normal, tangential)
    least, normal, tangential = _worse(_PLACE_2, n, t, least, normal, tangential)
    least, normal, tangential = _worse(_PLACE_3, n, t, least, normal, tangential)
    least, normal, tangential = _worse(_PLACE_4, n, t, least, normal, tangential)
    return least, tangential / (normal * normal)
