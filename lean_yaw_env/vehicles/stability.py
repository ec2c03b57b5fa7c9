"""One meaning of "critical speed" for every vehicle.

A vehicle takes part by registering with ``stable_speed_range``; ``critical_speed`` follows from it,
unless the vehicle registers its own there too.
"""

from __future__ import annotations

import math
from functools import singledispatch
from typing import NamedTuple


class SpeedRange(NamedTuple):
    """Speeds between which upright straight motion is not unstable; ends included or not."""

    lower: float
    """In the vehicle's unit of speed."""
    upper: float
    """``inf`` where there is no upper end."""


@singledispatch
def stable_speed_range(vehicle: object) -> SpeedRange | None:
    """Find the lowest range of forward speeds in which upright straight motion is not unstable.

    Not unstable: between the ends no eigenvalue has a positive real part. An undamped skateboard
    is only marginally stable there; a bicycle is, in general, asymptotically stable.

    Parameters
    ----------
    vehicle : object
        Of a registered type, such as ``Skateboard`` or ``LinearBicycle``.

    Returns
    -------
    SpeedRange or None
        None if the motion is unstable at every forward speed. Further ranges at higher speeds, if
        any, are not reported.

    Raises
    ------
    TypeError
        If no rule is registered for this type.
    """
    raise TypeError(
        f"no stable speed range is known for {type(vehicle).__name__}; "
        "register one with stable_speed_range.register"
    )


@singledispatch
def critical_speed(vehicle: object) -> float:
    """Find the lowest speed above which upright straight motion is not unstable.

    For a vehicle whose stable range also has an upper end, such as a bicycle, "above" means just
    above: up to ``stable_speed_range(vehicle).upper``.

    Parameters
    ----------
    vehicle : object
        Of a registered type, such as ``Skateboard`` or ``LinearBicycle``.

    Returns
    -------
    float
        In the vehicle's unit of speed; 0 if it is not unstable however slowly it moves, ``inf`` if
        no speed makes it stable.

    Raises
    ------
    TypeError
        If no rule is registered for this type.
    """
    speeds = stable_speed_range(vehicle)
    return math.inf if speeds is None else speeds.lower
