"""Steering by a mass offset: the heading it settles to, the radius it turns with, circles."""

from __future__ import annotations

import math

import numpy as np

from lean_yaw_env.analysis import LimitCycle, find_limit_cycle
from lean_yaw_env.paper.numbers import LARGE_OFFSET, SMALL_OFFSET
from lean_yaw_env.parameters import WalkerParameters
from lean_yaw_env.walker import Walk, Walker


def settled_heading(mass_offset: float = SMALL_OFFSET) -> float:
    """Heading, rad to the right, of the gait across the slope, the mean of both feet."""
    walker = Walker()
    gait = find_limit_cycle(walker, mass_offset=mass_offset)
    step = walker.step(gait.state, mass_offset=mass_offset)
    return -0.5 * float(gait.state[0] + step.state[0])


def asymptotic_heading(mass_offset: float = SMALL_OFFSET) -> float:
    """The same in closed form, sin(heading) = offset / tan(slope), rad to the right.

    Where the line from foot to centre of mass, moved aside, is plumb across the course.
    """
    return math.asin(mass_offset / math.tan(WalkerParameters().slope))


def turned(walk: Walk) -> float:
    """Greatest change of heading from the first footprint, degrees."""
    return math.degrees(float(np.abs(walk.headings - walk.headings[0]).max()))


def circling_walker() -> Walker:
    """Table 1's walker on a slope that turns with it."""
    return Walker(WalkerParameters(slope_turns=True))


def circling_gait() -> LimitCycle:
    """Its gait with the large offset, which turns by as much every stride."""
    return find_limit_cycle(circling_walker(), mass_offset=LARGE_OFFSET)
