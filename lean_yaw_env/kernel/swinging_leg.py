"""The swing leg as a pendulum that the hip carries: its motion, its foot's gap, its start.

Its only mass is the foot's point mass at the leg's end, in the limit zero: it feels the hip's
acceleration and the leg's turning, and does not act back, so the stance phase is that of
``stance`` unchanged. In the leg's axes the tangent of the foot's path about the hip is the swing
leg's own x axis, at the angle alpha - Delta from e1 towards a; projecting the foot's acceleration
onto it gives Delta'' = -(turning rate about the axle)' - (Omega . tangent)(Omega . radius) -
tangent . (hip's acceleration - gravity).
"""

from __future__ import annotations

from typing import NamedTuple

from lean_yaw_env.kernel import verner
from lean_yaw_env.kernel.compilation import inlined
from lean_yaw_env.kernel.elementary import sine_cosine, within_half_turn
from lean_yaw_env.kernel.lanes import replacer
from lean_yaw_env.kernel.records import Stance
from lean_yaw_env.kernel.stance import Pose, accelerations_in, pose_of, velocity_products
from lean_yaw_env.kernel.swing import axis_motion, gap_motion, swing_axis

# Newton's method doubles the digits each time; a walker's start is known to 10 % beforehand.
_NEWTON_STEPS = 12

_at_angle = replacer(Stance, "sin_inter_leg", "cos_inter_leg")


@inlined
def with_inter_leg_angle(c, inter_leg):
    """A step's constants with the swing leg at this angle, for the formulas of the leg held."""
    sine, cosine = sine_cosine(within_half_turn(inter_leg))
    return _at_angle(c, sine, cosine)


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


class SwingingPose(NamedTuple):
    """What the equations of motion take from the three angles: all that does not depend on the rates."""

    stance: Pose
    sin_inter_leg: float
    cos_inter_leg: float
    cosine: float  # of alpha - Delta
    sine: float
    q: float  # of the other hip, as are the rest
    dq: float
    lever_u: float
    lever_w: float


@inlined
def swinging_pose(c, t, x, b, d):
    """See ``SwingingPose``."""
    pose = pose_of(c, t, x, b)
    sin_d, cos_d = sine_cosine(within_half_turn(d))
    q, dq, lever_u, lever_w = swing_hip_levers(
        c, 2.0 * c.half_axle, pose.sin_a, pose.cos_a, pose.sin_twist, pose.cos_twist
    )
    cosine = c.cos_tilt * cos_d + c.sin_tilt * sin_d
    sine = c.sin_tilt * cos_d - c.cos_tilt * sin_d
    return SwingingPose(pose, sin_d, cos_d, cosine, sine, q, dq, lever_u, lever_w)


@inlined
def swinging_accelerations_in(c, pose, w, v, u):
    """Accelerations of pitch, twist and inter-leg angle in a pose, their rates being w, v, u."""
    stance = pose.stance
    dw, dv = accelerations_in(c, stance, w, v)
    still = 0.0 * w
    b1, ba, b3 = velocity_products(
        c, stance.sin_twist, stance.cos_twist, pose.q, pose.dq, w, v, still, still
    )
    # the hip's acceleration less gravity, along e1, a and e3
    f1 = (
        b1
        - pose.lever_u * dw
        + pose.dq * dv
        - c.gravity_x * stance.cos_a
        - c.gravity_y * stance.sin_a
    )
    fa = ba - pose.lever_w * dw - c.gravity_x * stance.sin_a + c.gravity_y * stance.cos_a
    f3 = b3 - pose.q * dv - c.gravity_z
    turning = w * stance.sin_twist
    about_tangent = -pose.cosine * turning - pose.sine * v
    about_radius = pose.sine * turning - pose.cosine * v
    du = (
        v * turning
        - stance.cos_twist * dw
        - about_tangent * about_radius
        - along_tangent(
            c,
            pose.sin_inter_leg,
            pose.cos_inter_leg,
            stance.sin_twist,
            stance.cos_twist,
            f1,
            fa,
            f3,
        )
    )
    return dw, dv, du


@inlined
def swinging_accelerations(c, x, b, d, w, v, u):
    """Accelerations of pitch ``x``, twist ``b``, inter-leg angle ``d``; rates are w, v, u."""
    return swinging_accelerations_in(c, swinging_pose(c, 0.0 * x, x, b, d), w, v, u)


@inlined
def signed_axis(c, sin_a, cos_a, sin_b, cos_b):
    """``swing_axis`` for a leg that may trail: its ankle axis past the vertical, S is negative."""
    y, e, s = swing_axis(c, sin_a, cos_a, sin_b, cos_b)
    return y, e, (s if e.real > 0.0 else -s)


@inlined
def swinging_gap(c, x, b, d, w, v, u, dw, dv, du):
    """Height of the swinging foot, its rate and acceleration, E of ``swing_axis``, and the sine of that foot's pitch."""
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
    return gap, gap_rate, gap_acceleration, e, s * c.cos_tilt + y * c.sin_tilt


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


_integrate = verner.stepper(3, swinging_pose, swinging_accelerations_in)


@inlined
def swinging_step(c, x, b, d, w, v, u, dw, dv, du, h):
    """One step of Verner's pair for three angles and their rates; also the largest error."""
    return _integrate(c, 0.0, x, b, d, w, v, u, dw, dv, du, h)[:7]
