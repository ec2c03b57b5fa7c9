"""Steering by a mass offset: the heading it settles to, the radius it turns with, circles."""

from __future__ import annotations

import math

import numpy as np

from lean_yaw_env.analysis import LimitCycle, find_limit_cycle
from lean_yaw_env.paper import numbers
from lean_yaw_env.parameters import Vector, WalkerParameters
from lean_yaw_env.walker import Walk, Walker


def settled_heading(mass_offset: float = numbers.SMALL_OFFSET) -> float:
    """Heading, rad to the right, of the gait across the slope, the mean of both feet."""
    walker = Walker()
    gait = find_limit_cycle(walker, mass_offset=mass_offset)
    step = walker.step(gait.state, mass_offset=mass_offset)
    return -0.5 * float(gait.state[0] + step.state[0])


def asymptotic_heading(mass_offset: float = numbers.SMALL_OFFSET) -> float:
    """The same in closed form, sin(heading) = offset / tan(slope), rad to the right.

    Where the line from foot to centre of mass, moved aside, is plumb across the course.
    """
    return math.asin(mass_offset / math.tan(WalkerParameters().slope))


def turned(walk: Walk) -> float:
    """Greatest change of heading from the first footprint, degrees."""
    return math.degrees(float(np.abs(walk.headings - walk.headings[0]).max()))


def circle_through(points: Vector) -> tuple[float, float]:
    """Radius of the circle that fits points, shape (n, 2), best, and the farthest point's distance from it."""
    matrix = np.column_stack([2.0 * points, np.ones(len(points))])
    x, y, constant = np.linalg.lstsq(matrix, (points**2).sum(axis=1), rcond=None)[0]
    radius = math.sqrt(constant + x * x + y * y)
    distances = np.hypot(points[:, 0] - x, points[:, 1] - y)
    return radius, float(np.abs(distances - radius).max())


def first_right_angle(walk: Walk, samples: int) -> Vector:
    """The centre of mass's path, (downhill, right), until the heading has turned by 90°."""
    quarter = int(np.argmax(np.abs(walk.headings - walk.headings[0]) >= 0.5 * math.pi))
    return walk.path[: quarter * samples, [1, 3]]


def circling_walker() -> Walker:
    """Table 1's walker on a slope that turns with it."""
    return Walker(WalkerParameters(slope_turns=True))


def circling_gait() -> LimitCycle:
    """Its gait with the large offset, which turns by as much every stride."""
    return find_limit_cycle(circling_walker(), mass_offset=numbers.LARGE_OFFSET)


def circling_radius() -> float:
    """Radius on which the centre of mass walks with the large offset, on a slope that turns along."""
    gait = circling_gait()
    steps = 2 * math.ceil(2.0 * math.pi / abs(gait.turn))
    walk = circling_walker().walk(
        steps, state=gait.state, mass_offset=numbers.LARGE_OFFSET, samples_per_step=10
    )
    return circle_through(walk.path[:, [1, 3]])[0]
