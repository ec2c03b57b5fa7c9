"""The walker's critical speed, with the meaning that skateboard and bicycle give it.

A walker's speed is not a parameter: the slope sets it. So the gait is followed along the slope, and
the speeds are those between which it is stable.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lean_yaw_env.analysis.continuation import continue_gait
from lean_yaw_env.analysis.limit_cycle import LimitCycle, cycle_at, find_limit_cycle
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.parameters import INTER_LEG_ANGLE
from lean_yaw_env.validation import require_instance
from lean_yaw_env.vehicles.stability import SpeedRange, stable_speed_range
from lean_yaw_env.walker import Walker

LEAST_SLOPE, GREATEST_SLOPE = 1e-5, 0.3
"""Between which slopes the gait is looked for, rad."""
_TRIED = tuple(np.geomspace(0.0005, 0.25, 28).tolist())
"""Slopes at which a stable gait is looked for, the gentlest first."""


@stable_speed_range.register(Walker)
def stable_speeds(walker: Walker, *, inter_leg_angle: float = INTER_LEG_ANGLE) -> SpeedRange | None:
    """Find the lowest range of speeds in which a walker's straight gait is stable, whatever its slope.

    Returns
    -------
    SpeedRange or None
        In leg lengths per unit of time. The upper end is the speed at which the gait loses its
        stability or ceases (it lifts off); ``inf`` if neither happens up to a slope of 0.3. None
        if no gait on the slopes tried is stable.
    """
    require_instance("walker", walker, Walker)
    for slope in _TRIED:
        here = Walker(replace(walker.parameters, slope=slope))
        try:
            cycle = find_limit_cycle(here, inter_leg_angle=inter_leg_angle)
        except NoGaitError:
            continue
        if cycle.is_stable:
            lower, upper = _end_speed(cycle, upward=False), _end_speed(cycle, upward=True)
            return SpeedRange(
                0.0 if lower is None else lower, float("inf") if upper is None else upper
            )
    return None


def _end_speed(cycle: LimitCycle, *, upward: bool) -> float | None:
    """The speed at which stability, or the gait itself, ends on steeper or gentler slopes; None if at neither."""
    limits = (LEAST_SLOPE, GREATEST_SLOPE)
    branch = continue_gait(
        cycle.section_map, "slope", limits, state=cycle.state, upward=upward, longest_step=0.02
    )
    for event in branch.events:
        if event.is_leaving:
            return cycle_at(branch.section_map.moved("slope", event.value), event.state).speed
    return None if branch.values[-1] in limits else branch.cycle(-1).speed
