"""The swing leg held in front: how high its foot is, with two time derivatives, and how it would lie on the floor.

The foot keeps its cylinder axis horizontal by its own ankle. With E the height component of the swing leg's e1, and n that of the
axle, its ankle axis makes the angle A' with the floor's normal, sin A' = S = sqrt(E^2 + n^2), cos A' = -Y, Y the axis's own height component.
"""

from __future__ import annotations

from lean_yaw_env.kernel.compilation import fused
from lean_yaw_env.kernel.elementary import quotient, square_root

# S is positive unless the swing leg's ankle axis is vertical, which no landing leg's is; this only keeps division defined.
_LEAST_SQUARE = 1e-12


@fused
def swing_axis(stance, sin_a, cos_a, sin_twist, cos_twist):
    """Height components Y (ankle axis), E (the leg's e1) and S of the swing leg."""
    y = stance.sin_inter_leg * cos_twist * sin_a - stance.cos_inter_leg * cos_a
    e = stance.cos_inter_leg * cos_twist * sin_a + stance.sin_inter_leg * cos_a
    n = sin_twist * sin_a
    square = e * e + n * n
    square = square if square.real > _LEAST_SQUARE else _LEAST_SQUARE + 0.0 * square
    return y, e, square_root(square)


@fused
def axis_motion(
    stance, sin_a, cos_a, sin_twist, cos_twist, pitch_rate, twist_rate,
    pitch_acceleration, twist_acceleration, y, e,
):  # fmt: skip
    """First and second time derivatives of Y and E of ``swing_axis`` at a fixed inter-leg angle."""
    sin_d = stance.sin_inter_leg
    cos_d = stance.cos_inter_leg

    # partial derivatives by A (= pitch) and b (twist)
    y_a = cos_d * sin_a + sin_d * cos_twist * cos_a
    y_b = -sin_d * sin_twist * sin_a
    y_ab = -sin_d * sin_twist * cos_a
    y_bb = -sin_d * cos_twist * sin_a
    e_a = cos_d * cos_twist * cos_a - sin_d * sin_a
    e_b = -cos_d * sin_twist * sin_a
    e_ab = -cos_d * sin_twist * cos_a
    e_bb = -cos_d * cos_twist * sin_a

    pp = pitch_rate * pitch_rate
    pt = 2.0 * pitch_rate * twist_rate
    tt = twist_rate * twist_rate
    y_rate = y_a * pitch_rate + y_b * twist_rate
    y_acceleration = (
        -y * pp + y_ab * pt + y_bb * tt + y_a * pitch_acceleration + y_b * twist_acceleration
    )
    e_rate = e_a * pitch_rate + e_b * twist_rate
    e_acceleration = (
        -e * pp + e_ab * pt + e_bb * tt + e_a * pitch_acceleration + e_b * twist_acceleration
    )
    return y_rate, y_acceleration, e_rate, e_acceleration


@fused
def gap_motion(
    stance, sin_a, cos_a, sin_twist, cos_twist, pitch_rate, twist_rate,
    pitch_acceleration, twist_acceleration,
    y, e, s, y_rate, y_acceleration, e_rate, e_acceleration,
):  # fmt: skip
    """Height of the swing foot above touching the floor, its rate and its acceleration, from Y, E, S and their motion."""
    arm = 2.0 * stance.half_axle
    k = stance.sin_tilt * (cos_twist - stance.radius) + arm * sin_twist
    k_b = arm * cos_twist - stance.sin_tilt * sin_twist
    k_bb = -stance.sin_tilt * cos_twist - arm * sin_twist

    pp = pitch_rate * pitch_rate
    tt = twist_rate * twist_rate
    per_s = quotient(-1.0, s)
    s_rate = per_s * (y * y_rate)
    s_acceleration = per_s * (y_rate * y_rate + y * y_acceleration + s_rate * s_rate)
    k_rate = k_b * twist_rate
    k_acceleration = k_bb * tt + k_b * twist_acceleration

    flat = (1.0 - stance.radius) * stance.cos_tilt
    roll = stance.radius * stance.sin_tilt
    gap = flat * (cos_a + y) + sin_a * k - stance.sin_tilt * e + roll * s
    gap_rate = (
        flat * (y_rate - sin_a * pitch_rate)
        + cos_a * pitch_rate * k
        + sin_a * k_rate
        - stance.sin_tilt * e_rate
        + roll * s_rate
    )
    gap_acceleration = (
        flat * (y_acceleration - cos_a * pp - sin_a * pitch_acceleration)
        + (cos_a * pitch_acceleration - sin_a * pp) * k
        + 2.0 * cos_a * pitch_rate * k_rate
        + sin_a * k_acceleration
        - stance.sin_tilt * e_acceleration
        + roll * s_acceleration
    )
    return gap, gap_rate, gap_acceleration


@fused
def foot_gap(
    stance, sin_a, cos_a, sin_twist, cos_twist, pitch_rate, twist_rate, pitch_acceleration, twist_acceleration,
):  # fmt: skip
    """Height of the held swing foot above touching the floor, its rate and its acceleration, and E of ``swing_axis``."""
    y, e, s = swing_axis(stance, sin_a, cos_a, sin_twist, cos_twist)
    y_rate, y_acceleration, e_rate, e_acceleration = axis_motion(
        stance, sin_a, cos_a, sin_twist, cos_twist, pitch_rate, twist_rate,
        pitch_acceleration, twist_acceleration, y, e,
    )  # fmt: skip
    gap, gap_rate, gap_acceleration = gap_motion(
        stance, sin_a, cos_a, sin_twist, cos_twist, pitch_rate, twist_rate,
        pitch_acceleration, twist_acceleration,
        y, e, s, y_rate, y_acceleration, e_rate, e_acceleration,
    )  # fmt: skip
    return gap, gap_rate, gap_acceleration, e
