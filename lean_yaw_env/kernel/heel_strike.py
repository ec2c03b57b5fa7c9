"""Heel strike: the swing foot's pose on the floor, and the plastic impact in which only the new contact takes impulse."""

from __future__ import annotations

from lean_yaw_env.kernel.compilation import fused
from lean_yaw_env.kernel.elementary import angle_of, quotient
from lean_yaw_env.kernel.stance import kinetic_energy, mass_matrix, middle_of_masses
from lean_yaw_env.kernel.swing import swing_axis


@fused
def landing_pose(stance, sin_a, cos_a, sin_twist, cos_twist):
    """The swing foot flat on the floor: heading change, pitch and twist, and the sines and cosines the impact needs."""
    y, e, s = swing_axis(stance, sin_a, cos_a, sin_twist, cos_twist)
    axis_x = stance.cos_inter_leg * sin_a + stance.sin_inter_leg * cos_twist * cos_a
    per_s = quotient(1.0, s)
    sin_heading = stance.sin_inter_leg * sin_twist * per_s
    cos_heading = axis_x * per_s
    new_sin_twist = sin_twist * sin_a * per_s
    new_cos_twist = e * per_s
    heading_change = angle_of(sin_heading, cos_heading)
    new_pitch = angle_of(s, -y) - stance.tilt
    new_twist = angle_of(new_sin_twist, new_cos_twist)
    return (
        heading_change, sin_heading, cos_heading, new_pitch, s, -y, new_twist, new_sin_twist, new_cos_twist
    )  # fmt: skip


@fused
def landing_place(
    stance, pitch, sin_a, cos_a, sin_twist, cos_twist, new_pitch, new_sin_a, new_cos_a, sin_heading,
    cos_heading,
):  # fmt: skip
    """From the old contact reference point to the new one, along the old heading and to its right."""
    sin_pitch = sin_a * stance.cos_tilt - cos_a * stance.sin_tilt
    arm = 2.0 * stance.half_axle
    hip_x = (
        stance.radius * (sin_pitch - pitch)
        + stance.sin_tilt * cos_twist * cos_a
        - stance.cos_tilt * sin_a
    )
    hip_z = -stance.sin_tilt * sin_twist
    axis_x = stance.cos_inter_leg * sin_a + stance.sin_inter_leg * cos_twist * cos_a
    axis_z = -stance.sin_inter_leg * sin_twist
    e_x = stance.cos_inter_leg * cos_twist * cos_a - stance.sin_inter_leg * sin_a
    e_z = -stance.cos_inter_leg * sin_twist
    pivot_x = hip_x + arm * sin_twist * cos_a - stance.sin_tilt * e_x + stance.cos_tilt * axis_x
    pivot_z = hip_z + arm * cos_twist - stance.sin_tilt * e_z + stance.cos_tilt * axis_z
    new_sin_pitch = new_sin_a * stance.cos_tilt - new_cos_a * stance.sin_tilt
    rolled = stance.radius * (new_pitch - new_sin_pitch)
    return pivot_x + rolled * cos_heading, pivot_z - rolled * sin_heading


@fused
def impact(
    stance, sin_a, cos_a, sin_twist, cos_twist, pitch_rate, twist_rate, offset, offset_rate,
    new_sin_a, new_cos_a, new_sin_twist, new_cos_twist,
):  # fmt: skip
    """New rates by solving (J' M J) q' = J' M v, and the kinetic energy before and after.

    The masses' velocity before includes their motion along the axle, which the impact stops.
    """
    h2 = stance.axle_inertia
    z, q, dq = middle_of_masses(stance, sin_twist, cos_twist, offset)
    u, w, m11, m12, m22 = mass_matrix(stance, sin_a, cos_a, sin_twist, z, q, dq)
    # velocity of the masses' middle and rate of the axle's direction, along e1, a, e3 of the old foot
    v1 = -u * pitch_rate + dq * twist_rate + sin_twist * offset_rate
    va = -w * pitch_rate
    v3 = -q * twist_rate + cos_twist * offset_rate
    n1 = cos_twist * twist_rate
    na = -sin_twist * pitch_rate
    n3 = -sin_twist * twist_rate
    before = 0.5 * (v1 * v1 + va * va + v3 * v3 + h2 * (n1 * n1 + na * na + n3 * n3))

    v1, va, v3 = _to_new_foot(
        stance, v1, va, v3, sin_twist, cos_twist, new_sin_twist, new_cos_twist
    )
    n1, na, n3 = _to_new_foot(
        stance, n1, na, n3, sin_twist, cos_twist, new_sin_twist, new_cos_twist
    )

    new_z = offset - stance.half_axle
    new_q = stance.sin_tilt * new_cos_twist + new_z * new_sin_twist
    new_dq = new_z * new_cos_twist - stance.sin_tilt * new_sin_twist
    u, w, m11, m12, m22 = mass_matrix(
        stance, new_sin_a, new_cos_a, new_sin_twist, new_z, new_q, new_dq
    )
    p1 = -u * v1 - w * va - h2 * new_sin_twist * na
    p2 = new_dq * v1 - new_q * v3 + h2 * (new_cos_twist * n1 - new_sin_twist * n3)
    inverse = quotient(1.0, m11 * m22 - m12 * m12)
    new_pitch_rate = (m22 * p1 - m12 * p2) * inverse
    new_twist_rate = (m11 * p2 - m12 * p1) * inverse
    after = kinetic_energy(m11, m12, m22, new_pitch_rate, new_twist_rate)
    return new_pitch_rate, new_twist_rate, before, after


@fused
def _to_new_foot(stance, v1, va, v3, sin_twist, cos_twist, new_sin_twist, new_cos_twist):
    """A vector's components in the new foot's e1, a, e3: undo the old ankle, the inter-leg angle, then the new ankle."""
    leg1 = cos_twist * v1 - sin_twist * v3
    leg3 = sin_twist * v1 + cos_twist * v3
    swing1 = stance.cos_inter_leg * leg1 - stance.sin_inter_leg * va
    swinga = stance.sin_inter_leg * leg1 + stance.cos_inter_leg * va
    return (
        new_cos_twist * swing1 + new_sin_twist * leg3,
        swinga,
        new_cos_twist * leg3 - new_sin_twist * swing1,
    )
