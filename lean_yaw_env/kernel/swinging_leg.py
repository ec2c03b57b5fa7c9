"""The swing leg as a pendulum that the hip carries: its motion, its foot's gap, its start.

Its only mass is the foot's point mass at the leg's end, in the limit zero: it feels the hip's
acceleration and the leg's turning, and does not act back, so the stance phase is that of
``stance`` unchanged. In the leg's axes the tangent of the foot's path about the hip is the swing
leg's own x axis, at the angle alpha - Delta from e1 towards a; projecting the foot's acceleration
onto it gives Delta'' = -(turning rate about the axle)' - (Omega . tangent)(Omega . radius) -
tangent . (hip's acceleration - gravity).
"""

from __future__ import annotations

from lean_yaw_env.kernel import verner
from lean_yaw_env.kernel.compilation import inlined
from lean_yaw_env.kernel.elementary import sine_cosine, within_half_turn
from lean_yaw_env.kernel.records import Stance
from lean_yaw_env.kernel.stance import accelerations, velocity_products
from lean_yaw_env.kernel.swing import axis_motion, gap_motion, swing_axis

# Newton's method doubles the digits each time; a walker's start is known to 10 % beforehand.
_NEWTON_STEPS = 12


@inlined
def with_inter_leg_angle(c, inter_leg):
    """A step's constants with the swing leg at this angle, for the formulas of the leg held."""
    sine, cosine = sine_cosine(within_half_turn(inter_leg))
    return Stance(
        c.radius, c.tilt, c.sin_tilt, c.cos_tilt, c.half_axle, c.axle_inertia,
        c.gravity_x, c.gravity_y, c.gravity_z, sine, cosine,
        c.ankle_stiffness, c.ankle_damping, c.previous_offset, c.offset_change, c.shift_rate,
        c.friction_limit_squared, c.max_duration,
    )  # fmt: skip


@inlined
def swing_hip_levers(c, arm, sin_a, cos_a, sin_b, cos_b):
    """The other hip's q, q' (as in ``middle_of_masses``) and levers U, W about the contact."""
    q = c.sin_tilt * cos_b + arm * sin_b
    dq = arm * cos_b - c.sin_tilt * sin_b
    u = c.radius * cos_a + (1.0 - c.radius) * c.cos_tilt
    w = c.radius * sin_a + q - c.radius * c.sin_tilt
    return q, dq, u, w


@inlined
def along_tangent(c, sin_d, cos_d, sin_b, cos_b, f1, fa, f3):
    """Component along the foot's path about the hip of a vector in the stance foot's e1, a, e3."""
    cosine = c.cos_tilt * cos_d + c.sin_tilt * sin_d  # of alpha - Delta
    sine = c.sin_tilt * cos_d - c.cos_tilt * sin_d
    return cosine * (cos_b * f1 - sin_b * f3) + sine * fa


@inlined
def swinging_accelerations(c, x, b, d, w, v, u):
    """Accelerations of pitch ``x``, twist ``b``, inter-leg angle ``d``; rates are w, v, u."""
    dw, dv = accelerations(c, 0.0 * x, x, b, w, v)
    sin_a, cos_a = sine_cosine(x + c.tilt)
    sin_b, cos_b = sine_cosine(b)
    sin_d, cos_d = sine_cosine(within_half_turn(d))
    q, dq, lever_u, lever_w = swing_hip_levers(c, 2.0 * c.half_axle, sin_a, cos_a, sin_b, cos_b)
    still = 0.0 * x
    b1, ba, b3 = velocity_products(c, sin_b, cos_b, q, dq, w, v, still, still)
    # the hip's acceleration less gravity, along e1, a and e3
    f1 = b1 - lever_u * dw + dq * dv - c.gravity_x * cos_a - c.gravity_y * sin_a
    fa = ba - lever_w * dw - c.gravity_x * sin_a + c.gravity_y * cos_a
    f3 = b3 - q * dv - c.gravity_z
    cosine = c.cos_tilt * cos_d + c.sin_tilt * sin_d  # of alpha - Delta
    sine = c.sin_tilt * cos_d - c.cos_tilt * sin_d
    turning = w * sin_b
    about_tangent = -cosine * turning - sine * v
    about_radius = sine * turning - cosine * v
    du = (
        v * turning
        - cos_b * dw
        - about_tangent * about_radius
        - along_tangent(c, sin_d, cos_d, sin_b, cos_b, f1, fa, f3)
    )
    return dw, dv, du


@inlined
def signed_axis(c, sin_a, cos_a, sin_b, cos_b):
    """``swing_axis`` for a leg that may trail: its ankle axis past the vertical, S is negative."""
    y, e, s = swing_axis(c, sin_a, cos_a, sin_b, cos_b)
    return y, e, (s if e.real > 0.0 else -s)


@inlined
def swinging_gap(c, x, b, d, w, v, u, dw, dv, du):
    """Height of the swinging foot, its rate and acceleration, and the sine of that foot's pitch."""
    held = with_inter_leg_angle(c, d)
    sin_a, cos_a = sine_cosine(x + c.tilt)
    sin_b, cos_b = sine_cosine(b)
    y, e, s = signed_axis(held, sin_a, cos_a, sin_b, cos_b)
    y_rate, y_acceleration, e_rate, e_acceleration = axis_motion(
        held, sin_a, cos_a, sin_b, cos_b, w, v, dw, dv, y, e
    )
    # the inter-leg angle's own share: dY/dDelta = E and dE/dDelta = -Y
    uu = u * u
    y_acceleration = y_acceleration + 2.0 * e_rate * u - y * uu + e * du
    e_acceleration = e_acceleration - 2.0 * y_rate * u - e * uu - y * du
    y_rate = y_rate + e * u
    e_rate = e_rate - y * u
    gap, gap_rate, gap_acceleration = gap_motion(
        held, sin_a, cos_a, sin_b, cos_b, w, v, dw, dv,
        y, e, s, y_rate, y_acceleration, e_rate, e_acceleration,
    )  # fmt: skip
    return gap, gap_rate, gap_acceleration, s * c.cos_tilt + y * c.sin_tilt


@inlined
def trailing_angle(c, x, b):
    """Inter-leg angle with the other foot on the floor behind, and the gap left (zero if found)."""
    sin_a, cos_a = sine_cosine(x + c.tilt)
    sin_b, cos_b = sine_cosine(b)
    flat = (1.0 - c.radius) * c.cos_tilt
    roll = c.radius * c.sin_tilt
    k = c.sin_tilt * (cos_b - c.radius) + 2.0 * c.half_axle * sin_b
    d = -2.0 * x
    gap = 0.0 * x
    for _ in range(_NEWTON_STEPS):
        y, e, s = signed_axis(with_inter_leg_angle(c, d), sin_a, cos_a, sin_b, cos_b)
        gap = flat * (cos_a + y) + sin_a * k - c.sin_tilt * e + roll * s
        slope = flat * e + c.sin_tilt * y - roll * y * e / s
        d = d - gap / slope
    return d, gap


@inlined
def swinging_step(c, x, b, d, w, v, u, dw1, dv1, du1, h):
    """One step of Verner's pair for three angles and their rates; also the largest error."""
    # fmt: off
    w2 = verner.stage_2(w, h, dw1)
    v2 = verner.stage_2(v, h, dv1)
    u2 = verner.stage_2(u, h, du1)
    x2 = verner.stage_2(x, h, w)
    b2 = verner.stage_2(b, h, v)
    d2 = verner.stage_2(d, h, u)
    dw2, dv2, du2 = swinging_accelerations(c, x2, b2, d2, w2, v2, u2)
    w3 = verner.stage_3(w, h, dw1, dw2)
    v3 = verner.stage_3(v, h, dv1, dv2)
    u3 = verner.stage_3(u, h, du1, du2)
    x3 = verner.stage_3(x, h, w, w2)
    b3 = verner.stage_3(b, h, v, v2)
    d3 = verner.stage_3(d, h, u, u2)
    dw3, dv3, du3 = swinging_accelerations(c, x3, b3, d3, w3, v3, u3)
    w4 = verner.stage_4(w, h, dw1, dw3)
    v4 = verner.stage_4(v, h, dv1, dv3)
    u4 = verner.stage_4(u, h, du1, du3)
    x4 = verner.stage_4(x, h, w, w3)
    b4 = verner.stage_4(b, h, v, v3)
    d4 = verner.stage_4(d, h, u, u3)
    dw4, dv4, du4 = swinging_accelerations(c, x4, b4, d4, w4, v4, u4)
    w5 = verner.stage_5(w, h, dw1, dw3, dw4)
    v5 = verner.stage_5(v, h, dv1, dv3, dv4)
    u5 = verner.stage_5(u, h, du1, du3, du4)
    x5 = verner.stage_5(x, h, w, w3, w4)
    b5 = verner.stage_5(b, h, v, v3, v4)
    d5 = verner.stage_5(d, h, u, u3, u4)
    dw5, dv5, du5 = swinging_accelerations(c, x5, b5, d5, w5, v5, u5)
    w6 = verner.stage_6(w, h, dw1, dw4, dw5)
    v6 = verner.stage_6(v, h, dv1, dv4, dv5)
    u6 = verner.stage_6(u, h, du1, du4, du5)
    x6 = verner.stage_6(x, h, w, w4, w5)
    b6 = verner.stage_6(b, h, v, v4, v5)
    d6 = verner.stage_6(d, h, u, u4, u5)
    dw6, dv6, du6 = swinging_accelerations(c, x6, b6, d6, w6, v6, u6)
    w7 = verner.stage_7(w, h, dw1, dw4, dw5, dw6)
    v7 = verner.stage_7(v, h, dv1, dv4, dv5, dv6)
    u7 = verner.stage_7(u, h, du1, du4, du5, du6)
    x7 = verner.stage_7(x, h, w, w4, w5, w6)
    b7 = verner.stage_7(b, h, v, v4, v5, v6)
    d7 = verner.stage_7(d, h, u, u4, u5, u6)
    dw7, dv7, du7 = swinging_accelerations(c, x7, b7, d7, w7, v7, u7)
    w8 = verner.stage_8(w, h, dw1, dw4, dw5, dw6, dw7)
    v8 = verner.stage_8(v, h, dv1, dv4, dv5, dv6, dv7)
    u8 = verner.stage_8(u, h, du1, du4, du5, du6, du7)
    x8 = verner.stage_8(x, h, w, w4, w5, w6, w7)
    b8 = verner.stage_8(b, h, v, v4, v5, v6, v7)
    d8 = verner.stage_8(d, h, u, u4, u5, u6, u7)
    dw8, dv8, du8 = swinging_accelerations(c, x8, b8, d8, w8, v8, u8)
    w9 = verner.stage_9(w, h, dw1, dw4, dw5, dw6, dw7, dw8)
    v9 = verner.stage_9(v, h, dv1, dv4, dv5, dv6, dv7, dv8)
    u9 = verner.stage_9(u, h, du1, du4, du5, du6, du7, du8)
    x9 = verner.stage_9(x, h, w, w4, w5, w6, w7, w8)
    b9 = verner.stage_9(b, h, v, v4, v5, v6, v7, v8)
    d9 = verner.stage_9(d, h, u, u4, u5, u6, u7, u8)
    dw9, dv9, du9 = swinging_accelerations(c, x9, b9, d9, w9, v9, u9)
    w10 = verner.stage_10(w, h, dw1, dw4, dw5, dw6, dw7, dw8, dw9)
    v10 = verner.stage_10(v, h, dv1, dv4, dv5, dv6, dv7, dv8, dv9)
    u10 = verner.stage_10(u, h, du1, du4, du5, du6, du7, du8, du9)
    x10 = verner.stage_10(x, h, w, w4, w5, w6, w7, w8, w9)
    b10 = verner.stage_10(b, h, v, v4, v5, v6, v7, v8, v9)
    d10 = verner.stage_10(d, h, u, u4, u5, u6, u7, u8, u9)
    dw10, dv10, du10 = swinging_accelerations(c, x10, b10, d10, w10, v10, u10)
    w11 = verner.stage_11(w, h, dw1, dw4, dw5, dw6, dw7, dw8, dw9, dw10)
    v11 = verner.stage_11(v, h, dv1, dv4, dv5, dv6, dv7, dv8, dv9, dv10)
    u11 = verner.stage_11(u, h, du1, du4, du5, du6, du7, du8, du9, du10)
    x11 = verner.stage_11(x, h, w, w4, w5, w6, w7, w8, w9, w10)
    b11 = verner.stage_11(b, h, v, v4, v5, v6, v7, v8, v9, v10)
    d11 = verner.stage_11(d, h, u, u4, u5, u6, u7, u8, u9, u10)
    dw11, dv11, du11 = swinging_accelerations(c, x11, b11, d11, w11, v11, u11)
    w12 = verner.stage_12(w, h, dw1, dw4, dw5, dw6, dw7, dw8, dw9, dw10, dw11)
    v12 = verner.stage_12(v, h, dv1, dv4, dv5, dv6, dv7, dv8, dv9, dv10, dv11)
    u12 = verner.stage_12(u, h, du1, du4, du5, du6, du7, du8, du9, du10, du11)
    x12 = verner.stage_12(x, h, w, w4, w5, w6, w7, w8, w9, w10, w11)
    b12 = verner.stage_12(b, h, v, v4, v5, v6, v7, v8, v9, v10, v11)
    d12 = verner.stage_12(d, h, u, u4, u5, u6, u7, u8, u9, u10, u11)
    dw12, dv12, du12 = swinging_accelerations(c, x12, b12, d12, w12, v12, u12)
    w13 = verner.stage_13(w, h, dw1, dw4, dw5, dw6, dw7, dw8, dw9, dw10)
    v13 = verner.stage_13(v, h, dv1, dv4, dv5, dv6, dv7, dv8, dv9, dv10)
    u13 = verner.stage_13(u, h, du1, du4, du5, du6, du7, du8, du9, du10)
    x13 = verner.stage_13(x, h, w, w4, w5, w6, w7, w8, w9, w10)
    b13 = verner.stage_13(b, h, v, v4, v5, v6, v7, v8, v9, v10)
    d13 = verner.stage_13(d, h, u, u4, u5, u6, u7, u8, u9, u10)
    dw13, dv13, du13 = swinging_accelerations(c, x13, b13, d13, w13, v13, u13)
    error_w = abs(verner.error(h, w, w6, w7, w8, w9, w10, w11, w12, w13).real)
    error_v = abs(verner.error(h, v, v6, v7, v8, v9, v10, v11, v12, v13).real)
    error_u = abs(verner.error(h, u, u6, u7, u8, u9, u10, u11, u12, u13).real)
    error_dw = abs(verner.error(h, dw1, dw6, dw7, dw8, dw9, dw10, dw11, dw12, dw13).real)
    error_dv = abs(verner.error(h, dv1, dv6, dv7, dv8, dv9, dv10, dv11, dv12, dv13).real)
    error_du = abs(verner.error(h, du1, du6, du7, du8, du9, du10, du11, du12, du13).real)
    return (
        verner.result(x, h, w, w6, w7, w8, w9, w10, w11, w12),
        verner.result(b, h, v, v6, v7, v8, v9, v10, v11, v12),
        verner.result(d, h, u, u6, u7, u8, u9, u10, u11, u12),
        verner.result(w, h, dw1, dw6, dw7, dw8, dw9, dw10, dw11, dw12),
        verner.result(v, h, dv1, dv6, dv7, dv8, dv9, dv10, dv11, dv12),
        verner.result(u, h, du1, du6, du7, du8, du9, du10, du11, du12),
        max(max(max(error_w, error_v), max(error_u, error_dw)), max(error_dv, error_du)),
    )
    # fmt: on
