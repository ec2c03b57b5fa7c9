"""What a gait asks of the floor and of a foot: normal force, friction, torque about the normal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lean_yaw_env.analysis.limit_cycle import find_limit_cycle
from lean_yaw_env.analysis.section_map import ActiveMap, section_map_of
from lean_yaw_env.parameters import INTER_LEG_ANGLE, Foot, Vector, require_number
from lean_yaw_env.passive import PassiveWalker
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
    """Over the two steps of a stride.

    Attributes
    ----------
    steps : two StepDemand
        On the left and on the right foot.
    least_normal_force, greatest_normal_force, greatest_friction, greatest_yaw_torque : float
        The last by magnitude.
    """

    steps: tuple[StepDemand, StepDemand]
    least_normal_force: float
    greatest_normal_force: float
    greatest_friction: float
    greatest_yaw_torque: float


def floor_demand(
    walker: Walker | PassiveWalker,
    *,
    inter_leg_angle: float = INTER_LEG_ANGLE,
    mass_offset: float | tuple[float, float] = 0.0,
    samples: int = 200,
) -> FloorDemand:
    """Force and torque between floor and stance foot over a walker's gait.

    A plastic heel strike asks for an impulse beside, which no force within the steps shows.

    Parameters
    ----------
    walker : Walker or PassiveWalker
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
    require_number("samples", samples, 2, 1_000_000)
    cycle = find_limit_cycle(walker, inter_leg_angle=inter_leg_angle, mass_offset=mass_offset)
    section_map = section_map_of(
        walker, inter_leg_angle=inter_leg_angle, mass_offset=mass_offset, n_steps=2
    )
    results = section_map.results(cycle.state)
    starts = (cycle.state, results[0].state)
    offsets = section_map.mass_offset if isinstance(section_map, ActiveMap) else (0.0, 0.0)
    stander = walker if isinstance(walker, Walker) else Walker(walker.moving_parameters)
    feet: tuple[Foot, Foot] = ("left", "right")
    steps = []
    for k in range(2):
        motion = stander.stance_motion(
            starts[k][:5],
            duration=results[k].duration,
            samples=samples,
            stance=feet[k],
            inter_leg_angle=inter_leg_angle,
            mass_offset=offsets[k],
            previous_offset=offsets[1 - k],
        )
        steps.append(
            StepDemand(
                stance=feet[k],
                time=motion["time"],
                normal_force=motion["normal_force"],
                friction_demand=motion["friction_demand"],
                yaw_torque=motion["yaw_torque"],
            )
        )
    normal = np.concatenate([step.normal_force for step in steps])
    return FloorDemand(
        steps=(steps[0], steps[1]),
        least_normal_force=float(normal.min()),
        greatest_normal_force=float(normal.max()),
        greatest_friction=float(max(step.friction_demand.max() for step in steps)),
        greatest_yaw_torque=float(max(np.abs(step.yaw_torque).max() for step in steps)),
    )
