"""What passes between kernels: named tuples of floats.

Signs inside the kernels: ``twist`` is minus the ankle angle, and ``side`` is +1 when the left foot stands, -1 when the right one does.
All quantities are dimensionless (leg length, gravity and total mass are one) or radians.
"""

from __future__ import annotations

from typing import NamedTuple

# How an attempt at a step stands. These are not ends: in the air, near the floor, and on it.
FLYING, LANDING, LANDED = 0.0, 1.0, 10.0
STEPPED, BACKWARD, SIDEWAYS, TRIP, LIFT_OFF, SLIP, NO_STRIKE, FAILED = (
    2.0,
    3.0,
    4.0,
    5.0,
    6.0,
    7.0,
    8.0,
    9.0,
)


class Body(NamedTuple):
    """A walker's constants, in the order of a row of a batch's parameter array."""

    hip_width: float
    foot_radius: float
    ankle_tilt: float
    slope: float
    ankle_stiffness: float
    ankle_damping: float
    shift_time: float
    friction_limit: float
    max_step_duration: float
    slope_turns: float
    strike_at_start: float


class Command(NamedTuple):
    """What the controller sets for one step; the masses move from ``previous_offset`` to ``mass_offset``."""

    inter_leg_angle: float
    mass_offset: float
    previous_offset: float


class SectionState(NamedTuple):
    """Where a walker is just after heel strike."""

    heading: float
    stance_pitch: float
    ankle_angle: float
    stance_pitch_rate: float
    ankle_rate: float


class Stance(NamedTuple):
    """What is constant while one foot stands. Axes: the stance foot's heading, the floor's normal, to the right."""

    radius: float
    tilt: float
    sin_tilt: float
    cos_tilt: float
    half_axle: float  # signed: from the stance hip to the axle's middle
    axle_inertia: float  # of the two hip masses about the axle's middle
    gravity_x: float
    gravity_y: float
    gravity_z: float
    sin_inter_leg: float
    cos_inter_leg: float
    ankle_stiffness: float
    ankle_damping: float
    previous_offset: float
    offset_change: float
    shift_rate: float  # one over the shift's duration
    friction_limit_squared: float
    max_duration: float
    heading: float


class Flight(NamedTuple):
    """A walker on its way from one heel strike to the next: where the integrator stands, and what it tries next."""

    time: float
    pitch: float
    twist: float
    pitch_rate: float
    twist_rate: float
    pitch_acceleration: float
    twist_acceleration: float
    gap: float
    gap_rate: float
    gap_acceleration: float
    next_step: float
    normal_force: float
    tangential_squared: float
    least_normal_force: float
    friction_squared: float
    damping_loss: float
    evaluations: float
    attempts: float
    status: float
    start_pitch: float
    start_twist: float
    start_kinetic: float


class Outcome(NamedTuple):
    """One walking step's result. A step that ends in a fall gives where the walker was last, and no displacement."""

    heading: float
    stance_pitch: float
    ankle_angle: float
    stance_pitch_rate: float
    ankle_rate: float
    status: float
    duration: float
    displacement_x: float
    displacement_z: float
    heading_change: float
    mass_offset: float
    least_normal_force: float
    greatest_friction: float
    gravity_work: float
    shift_work: float
    impact_loss: float
    ankle_loss: float
    evaluations: float


BODY_INPUTS = Body._fields[:6]
"""The constants of a walker by which a step is differentiated."""

WITHOUT_DERIVATIVE = frozenset(
    {
        *Body._fields[6:], "shift_rate", "friction_limit_squared", "max_duration", "next_step", "normal_force", "tangential_squared",
        "least_normal_force", "friction_squared", "evaluations", "attempts", "status",
    }
)  # fmt: skip
"""Fields of all these records that stay real where others are complex to carry a derivative."""
