"""Positions and contact constraints of the nine-coordinate walker, differentiated by sympy.

The paper, section 3.1, writes twelve dependent coordinates (x, y, z of each of four point masses) in terms of the generalized coordinates and
adds five contact constraints. Both are stated here once, as symbols; sympy supplies their first derivatives and the terms quadratic in the
rates. Nothing else in the project shares this code, so that agreement with the compiled walker means something.

A step is written in *roles*, stance and swing, rather than left and right: the side enters as the sign ``side`` (+1 when the left foot
stands).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.extras import needs_extra

Vector = NDArray[np.float64]

ROLE_COORDINATES = (
    "x_h", "y_h", "z_h", "yaw", "lean", "stance_leg_pitch", "swing_leg_pitch", "stance_ankle",
)  # fmt: skip
"""Coordinates that carry inertia or constraints; the swing ankle, the ninth, carries neither."""
N_COORDINATES = len(ROLE_COORDINATES)
LEAN, STANCE_LEG, SWING_LEG, STANCE_ANKLE = 4, 5, 6, 7
"""Places of lean, the two leg pitches and the stance ankle in a role vector."""

POSITIONS, CONTACT, PITCH = slice(0, 12), slice(12, 17), 17
"""Rows of ``Kinematics``: x, y, z of stance hip mass, swing hip mass, stance foot and swing foot; the contact constraints in the paper's order
(no yaw, no lean, height, no lateral slip, no forward slip); pitch of the stance foot."""
N_CONSTRAINTS = 5


class Kinematics(NamedTuple):
    """Values (18,), their derivatives (18, 9) in (role coordinates, mass offset), and their second time derivatives (18,) without accelerations."""

    values: Vector
    jacobian: Vector
    bias: Vector


@cache
def _compiled() -> Callable[..., Any]:
    """Derive and compile the model; about two seconds, once per process."""
    with needs_extra("analysis"):
        import sympy as sp  # heavy and only needed by this second opinion

    coordinates = sp.symbols("x y z u1 u2 p_stance p_swing ankle mu")
    rates = sp.symbols("v0:9")
    constants = sp.symbols("side d r alpha phi x_c z_c")
    side, hip_width, foot_radius, tilt, heading, contact_x, contact_z = constants
    x, y, z, yaw, lean, stance_pitch, swing_pitch, ankle, offset = coordinates
    about_x, about_y, about_z = sp.rot_ccw_axis1, sp.rot_ccw_axis2, sp.rot_ccw_axis3

    e1, e2, e3 = (sp.Matrix([int(i == j) for i in range(3)]) for j in range(3))
    axle_frame = about_y(yaw) * about_x(lean)
    axle = axle_frame * e3
    centre = sp.Matrix([x, y, z])
    stance_hip = centre - side * hip_width / 2 * axle
    swing_hip = centre + side * hip_width / 2 * axle
    stance_leg = axle_frame * about_z(stance_pitch)
    stance_end = stance_hip - stance_leg * e2
    swing_end = swing_hip - axle_frame * about_z(swing_pitch) * e2

    # leg = foot * R_a(ankle); the ankle axis is the y axis turned over and tilted about z.
    foot = stance_leg * about_z(tilt) * about_y(ankle) * about_z(-tilt)
    ahead = sp.Matrix([sp.cos(heading), 0, -sp.sin(heading)])
    across = sp.Matrix([sp.sin(heading), 0, sp.cos(heading)])
    foot_pitch = sp.atan2((foot * e1)[1], (foot * e2)[1])
    cylinder = stance_end + foot_radius * foot * e2
    from_contact = cylinder - sp.Matrix([contact_x, 0, contact_z])
    contact = [
        ahead.dot(foot * e3),
        (foot * e3)[1],
        cylinder[1] - foot_radius,
        across.dot(from_contact),
        ahead.dot(from_contact) + foot_radius * foot_pitch,
    ]
    masses = (stance_hip + offset * axle, swing_hip + offset * axle, stance_end, swing_end)
    values = sp.Matrix([*masses, sp.Matrix([*contact, foot_pitch])])
    rate = sp.Matrix(rates)
    jacobian = values.jacobian(coordinates)
    bias = (jacobian * rate).jacobian(coordinates) * rate
    outputs = [*values, *jacobian, *bias]
    return sp.lambdify((*coordinates, *rates, *constants), outputs, modules="math", cse=True)


def kinematics(
    coordinates: Vector,
    rates: Vector,
    *,
    side: float,
    hip_width: float,
    foot_radius: float,
    ankle_tilt: float,
    heading: float,
    contact: tuple[float, float],
) -> Kinematics:
    """Positions, contact constraints of section 3.1 with the ankle axis through the sole, foot pitch, and their derivatives.

    Parameters
    ----------
    coordinates, rates : shape (9,)
        In the order of ``ROLE_COORDINATES``, then the place of both hip masses along the axle, positive to the right.
    side : float
        +1 when the left foot stands, -1 when the right one does.
    heading : float
        Direction in which the stance foot rolls, rad.
    contact : two floats
        x and z of the contact reference point.
    """
    body = (side, hip_width, foot_radius, ankle_tilt, heading, *contact)
    flat = np.array(_compiled()(*coordinates.tolist(), *rates.tolist(), *body))
    values, jacobian, bias = np.split(flat, [PITCH + 1, -(PITCH + 1)])
    return Kinematics(values, jacobian.reshape(PITCH + 1, -1), bias)
