"""What a gait asks of the floor and of a foot: normal force, friction, torque about the normal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lean_yaw_env.analysis.limit_cycle import find_limit_cycle
from lean_yaw_env.analysis.section_map import SectionMap
from lean_yaw_env.parameters import INTER_LEG_ANGLE, STATE_SIZE, Foot, Vector
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.validation import require_count
from lean_yaw_env.walker import Walker


@dataclass(frozen=True)
class StepDemand:
    """Within one step of the gait, at uniform times; shapes (n,).

    Attributes
    ----------
    stance : "left" or "right"
    time : from the start of the step
    normal_force : in weights
    friction_demand : tangential over normal force
    yaw_torque : about the floor's normal through the contact, in weight times leg length
    """

    stance: Foot
    time: Vector
    normal_force: Vector
    friction_demand: Vector
    yaw_torque: Vector


@dataclass(frozen=True)
class FloorDemand:
    """Over the steps of a cycle, two of them but for a gait that repeats after more.

    Attributes
    ----------
    steps : tuple of StepDemand
        On the left and on the right foot by turns.
    least_normal_force, greatest_normal_force, greatest_friction, greatest_yaw_torque : float
        The last by magnitude.
    """

    steps: tuple[StepDemand, ...]
    least_normal_force: float
    greatest_normal_force: float
    greatest_friction: float
    greatest_yaw_torque: float


def floor_demand(
    walker: Walker | PassiveWalker | SectionMap,
    *,
    inter_leg_angle: float = INTER_LEG_ANGLE,
    mass_offset: float | tuple[float, float] = 0.0,
    samples: int = 200,
) -> FloorDemand:
    """Force and torque between floor and stance foot over a walker's gait.

    A plastic heel strike asks for an impulse beside, which no force within the steps shows.

    Parameters
    ----------
    walker : Walker, PassiveWalker or SectionMap
        A passive walker's swing leg is massless and asks nothing of the floor.
    inter_leg_angle, mass_offset : see ``find_limit_cycle``
    samples : int >= 2
        Per step.

    Raises
    ------
    NoGaitError
        If there is no gait.
    ValueError
        If an argument is outside its range.
    """
    require_count("samples", samples, 2, 1_000_000)
    cycle = find_limit_cycle(walker, inter_leg_angle=inter_leg_angle, mass_offset=mass_offset)
    stander = cycle.section_map.stander
    demands = []
    for step in cycle.steps:
        angle, offset, before = step.command
        motion = stander.stance_motion(
            step.start[:STATE_SIZE],
            duration=step.duration,
            samples=samples,
            stance=step.foot,
            inter_leg_angle=angle,
            mass_offset=offset,
            previous_offset=before,
        )
        named = {
            name: motion[name] for name in ("time", "normal_force", "friction_demand", "yaw_torque")
        }
        demands.append(StepDemand(stance=step.foot, **named))
    normal = np.concatenate([demand.normal_force for demand in demands])
    return FloorDemand(
        steps=tuple(demands),
        least_normal_force=float(normal.min()),
        greatest_normal_force=float(normal.max()),
        greatest_friction=float(max(demand.friction_demand.max() for demand in demands)),
        greatest_yaw_torque=float(max(np.abs(demand.yaw_torque).max() for demand in demands)),
    )
