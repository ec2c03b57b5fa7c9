"""What a gait asks of the floor and of a foot: normal force, friction, torque about the normal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lean_yaw_env.analysis.limit_cycle import find_limit_cycle
from lean_yaw_env.analysis.section_map import CommandArguments, WalkerOrMap
from lean_yaw_env.parameters import Foot, Vector
from lean_yaw_env.validation import require_count

if TYPE_CHECKING:
    from typing_extensions import Unpack


@dataclass(frozen=True)
class StepDemand:
    """Within one step of the gait, at uniform times from its start; shapes (n,).

    Normal force in weights, friction demand as tangential over normal force, and the yaw torque about the floor's normal through the contact
    in weight times leg length.
    """

    stance: Foot
    time: Vector
    normal_force: Vector
    friction_demand: Vector
    yaw_torque: Vector


@dataclass(frozen=True)
class FloorDemand:
    """Over the steps of a cycle, on the left and on the right foot by turns, and the extremes; the greatest torque is that by magnitude."""

    steps: tuple[StepDemand, ...]
    least_normal_force: float
    greatest_normal_force: float
    greatest_friction: float
    greatest_yaw_torque: float


def floor_demand(
    walker: WalkerOrMap, *, samples: int = 200, **command: Unpack[CommandArguments]
) -> FloorDemand:
    """Force and torque between floor and stance foot over a walker's gait.

    A plastic heel strike asks for an impulse beside, which no force within the steps shows.

    Parameters
    ----------
    walker : Walker, PassiveWalker or SectionMap
        A passive walker's swing leg is massless and asks nothing of the floor.
    samples : int >= 2
        Per step.
    inter_leg_angle, mass_offset : see ``find_limit_cycle``

    Raises
    ------
    NoGaitError
        If there is no gait.
    ValueError
        If an argument is outside its range.
    """
    require_count("samples", samples, 2, 1_000_000)
    cycle = find_limit_cycle(walker, **command)
    demands = []
    for step in cycle.steps:
        motion = cycle.stance_motion(step, samples)
        columns = ("time", "normal_force", "friction_demand", "yaw_torque")
        demands.append(StepDemand(step.foot, *(motion[name] for name in columns)))
    normal = np.concatenate([demand.normal_force for demand in demands])
    return FloorDemand(
        steps=tuple(demands),
        least_normal_force=float(normal.min()),
        greatest_normal_force=float(normal.max()),
        greatest_friction=float(max(demand.friction_demand.max() for demand in demands)),
        greatest_yaw_torque=float(max(np.abs(demand.yaw_torque).max() for demand in demands)),
    )
