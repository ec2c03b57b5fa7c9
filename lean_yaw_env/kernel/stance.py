"""The stance phase: geometry, mass matrix, equations of motion, contact force and energy of the walker on one foot.

Two degrees of freedom: ``pitch`` (theta) of the foot that rolls, and ``twist`` (b, minus the ankle angle) about the ankle axis.
Vectors are taken apart in the foot's own axes e1 = (cos alpha, sin alpha, 0), a = (sin alpha, -cos alpha, 0), e3, where a is the ankle axis:
with A = theta + alpha these point along (cos A, sin A, 0), (sin A, -cos A, 0) and (0, 0, 1) of the stance frame (heading, normal, right).
The masses' middle lies at q e1 - cos(alpha) a + q' e3 from the pivot, q = sin(alpha) cos b + z sin b, q' = dq/db, z its place on the axle.
The derivation is in docs/model.md.
"""

from __future__ import annotations

from typing import NamedTuple

from lean_yaw_env.kernel.compilation import fused
from lean_yaw_env.kernel.elementary import quotient, sine_cosine


@fused
def mass_offset(stance, time):
    """Offset of the masses along the axle with its two rates, on the smooth path 10 s^3 - 15 s^4 + 6 s^5."""
    s = time * stance.shift_rate
    s = s if s.real < 1.0 else 1.0 + 0.0 * s
    rest = 1.0 - s
    change = stance.offset_change
    rate = stance.shift_rate
    offset = stance.previous_offset + change * (s * s * s * (10.0 + s * (6.0 * s - 15.0)))
    offset_rate = change * rate * (30.0 * s * s * rest * rest)
    offset_acceleration = change * rate * rate * (60.0 * s * rest * (rest - s))
    return offset, offset_rate, offset_acceleration


@fused
def middle_of_masses(stance, sin_twist, cos_twist, offset):
    """The middle's distance q along e1 from the pivot and q' along e3 (which is also dq/db)."""
    z = stance.half_axle + offset
    q = stance.sin_tilt * cos_twist + z * sin_twist
    dq = z * cos_twist - stance.sin_tilt * sin_twist
    return z, q, dq


@fused
def mass_matrix(stance, sin_a, cos_a, sin_twist, z, q, dq):
    """Entries of the 2x2 mass matrix, after the two levers U and W of the middle about the contact."""
    u = stance.radius * cos_a + (1.0 - stance.radius) * stance.cos_tilt
    w = stance.radius * sin_a + q - stance.radius * stance.sin_tilt
    m11 = u * u + w * w + stance.axle_inertia * sin_twist * sin_twist
    m12 = -u * dq
    m22 = stance.sin_tilt * stance.sin_tilt + z * z + stance.axle_inertia
    return u, w, m11, m12, m22


@fused
def kinetic_energy(m11, m12, m22, pitch_rate, twist_rate):
    return (
        0.5 * m11 * pitch_rate * pitch_rate
        + m12 * pitch_rate * twist_rate
        + 0.5 * m22 * twist_rate * twist_rate
    )


@fused
def velocity_products(
    stance, sin_twist, cos_twist, q, dq, pitch_rate, twist_rate, offset_rate, offset_acceleration
):
    """The middle's acceleration along e1, a and e3 that is not due to the two angular accelerations."""
    p1 = q - stance.radius * stance.sin_tilt
    p2 = (1.0 - stance.radius) * stance.cos_tilt
    pitch_squared = pitch_rate * pitch_rate
    twist_squared = twist_rate * twist_rate
    b1 = (
        -p1 * pitch_squared
        - q * twist_squared
        + 2.0 * offset_rate * cos_twist * twist_rate
        + offset_acceleration * sin_twist
    )
    ba = (
        p2 * pitch_squared
        - 2.0 * dq * pitch_rate * twist_rate
        - 2.0 * offset_rate * sin_twist * pitch_rate
    )
    b3 = (
        -dq * twist_squared
        - 2.0 * offset_rate * sin_twist * twist_rate
        + offset_acceleration * cos_twist
    )
    return b1, ba, b3


class Pose(NamedTuple):
    """What the equations of motion take from the two angles and the masses' place: all that does not depend on the rates."""

    sin_a: float
    cos_a: float
    sin_twist: float
    cos_twist: float
    q: float
    dq: float
    u: float
    w: float
    m11: float
    m12: float
    m22: float
    inverse: float  # one over the mass matrix's determinant
    offset_rate: float
    offset_acceleration: float
    spring: float  # moment of the ankle's spring


@fused
def pose_of(stance, time, pitch, twist):
    """See ``Pose``."""
    sin_a, cos_a = sine_cosine(pitch + stance.tilt)
    sin_twist, cos_twist = sine_cosine(twist)
    offset, offset_rate, offset_acceleration = mass_offset(stance, time)
    z, q, dq = middle_of_masses(stance, sin_twist, cos_twist, offset)
    u, w, m11, m12, m22 = mass_matrix(stance, sin_a, cos_a, sin_twist, z, q, dq)
    inverse = quotient(1.0, m11 * m22 - m12 * m12)
    return Pose(
        sin_a, cos_a, sin_twist, cos_twist, q, dq, u, w, m11, m12, m22, inverse,
        offset_rate, offset_acceleration, stance.ankle_stiffness * twist,
    )  # fmt: skip


@fused
def _balance(stance, pose, pitch_rate, twist_rate):
    """Solve D'Alembert's principle along both degrees of freedom for the angular accelerations.

    Also returned: what the contact force needs, which is gravity less velocity products along e1, a and e3.
    """
    b1, ba, b3 = velocity_products(
        stance, pose.sin_twist, pose.cos_twist, pose.q, pose.dq, pitch_rate, twist_rate, pose.offset_rate,
        pose.offset_acceleration,
    )  # fmt: skip
    along_e1 = stance.gravity_x * pose.cos_a + stance.gravity_y * pose.sin_a - b1
    along_a = stance.gravity_x * pose.sin_a - stance.gravity_y * pose.cos_a - ba
    along_e3 = stance.gravity_z - b3
    turning = stance.axle_inertia * pose.sin_twist * pose.cos_twist * pitch_rate
    f1 = -pose.u * along_e1 - pose.w * along_a - 2.0 * turning * twist_rate
    f2 = (
        pose.dq * along_e1
        - pose.q * along_e3
        + turning * pitch_rate
        - pose.spring
        - stance.ankle_damping * twist_rate
    )
    pitch_acceleration = (pose.m22 * f1 - pose.m12 * f2) * pose.inverse
    twist_acceleration = (pose.m11 * f2 - pose.m12 * f1) * pose.inverse
    return pitch_acceleration, twist_acceleration, along_e1, along_a, along_e3


@fused
def accelerations_in(stance, pose, pitch_rate, twist_rate):
    """Angular accelerations of pitch and twist in a pose."""
    balance = _balance(stance, pose, pitch_rate, twist_rate)
    return balance[0], balance[1]


@fused
def accelerations(stance, time, pitch, twist, pitch_rate, twist_rate):
    """Angular accelerations of pitch and twist."""
    return accelerations_in(stance, pose_of(stance, time, pitch, twist), pitch_rate, twist_rate)


@fused
def _force_in(stance, pose, pitch_rate, twist_rate):
    """Angular accelerations, and the floor's force on the foot in a pose."""
    dw, dv, along_e1, along_a, along_e3 = _balance(stance, pose, pitch_rate, twist_rate)
    f1 = pose.dq * dv - pose.u * dw - along_e1
    fa = -pose.w * dw - along_a
    f3 = -pose.q * dv - along_e3
    return dw, dv, pose.cos_a * f1 + pose.sin_a * fa, pose.sin_a * f1 - pose.cos_a * fa, f3


@fused
def floor_force(stance, time, pitch, twist, pitch_rate, twist_rate):
    """Angular accelerations, and the floor's force on the foot: ahead, up (normal) and to the right."""
    return _force_in(stance, pose_of(stance, time, pitch, twist), pitch_rate, twist_rate)


@fused
def forces_in(stance, pose, pitch_rate, twist_rate):
    """Angular accelerations, normal force, and the square of the tangential force in a pose."""
    dw, dv, ahead, normal, aside = _force_in(stance, pose, pitch_rate, twist_rate)
    return dw, dv, normal, ahead * ahead + aside * aside


@fused
def accelerations_and_forces(stance, time, pitch, twist, pitch_rate, twist_rate):
    """Angular accelerations, normal force, and the square of the tangential force."""
    return forces_in(stance, pose_of(stance, time, pitch, twist), pitch_rate, twist_rate)


@fused
def accelerations_and_contact(stance, time, pitch, twist, pitch_rate, twist_rate):
    """Angular accelerations, normal force, and the squared ratio of tangential to normal force."""
    dw, dv, normal, square = accelerations_and_forces(
        stance, time, pitch, twist, pitch_rate, twist_rate
    )
    return dw, dv, normal, quotient(square, normal * normal)


@fused
def middle_position(stance, pitch, sin_a, cos_a, q, dq):
    """Where the masses' middle is in the stance frame, from the contact point at zero pitch."""
    sin_pitch = sin_a * stance.cos_tilt - cos_a * stance.sin_tilt
    cos_pitch = cos_a * stance.cos_tilt + sin_a * stance.sin_tilt
    x = stance.radius * (sin_pitch - pitch) + q * cos_a - stance.cos_tilt * sin_a
    y = stance.radius * (1.0 - cos_pitch) + q * sin_a + stance.cos_tilt * cos_a
    return x, y, dq
