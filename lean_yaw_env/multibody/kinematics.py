"""Positions and contact constraints of the nine-coordinate walker, differentiated by sympy.

The paper, section 3.1, writes twelve dependent coordinates (x, y, z of each of four point masses)
in terms of the generalized coordinates and adds five contact constraints. Both are stated here
once, as symbols; sympy supplies their first derivatives and the terms quadratic in the rates.
Nothing else in the project shares this code, so that agreement with the compiled walker means
something.

A step is written in *roles*, stance and swing, rather than left and right: the side enters as the
sign ``side`` (+1 when the left foot stands). The coordinates of a role vector are named by
`ROLE_COORDINATES`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.extras import needs_extra

Vector = NDArray[np.float64]

ROLE_COORDINATES = (
    "x_h",
    "y_h",
    "z_h",
    "yaw",
    "lean",
    "stance_leg_pitch",
    "swing_leg_pitch",
    "stance_ankle",
)
"""Coordinates that carry inertia or constraints; the swing ankle, the ninth, carries neither."""

N_COORDINATES = len(ROLE_COORDINATES)
LEAN, STANCE_LEG, SWING_LEG, STANCE_ANKLE = 4, 5, 6, 7
"""Places of lean, the two leg pitches and the stance ankle in a role vector."""

N_POSITIONS = 12
N_CONSTRAINTS = 5
CONSTRAINTS = ("no yaw", "no lean", "height", "no lateral slip", "no forward slip")
"""The contact constraints in the paper's order."""


@dataclass(frozen=True)
class Kinematics:
    """Values and derivatives in ``v = (role coordinates, mass offset)``.

    Attributes
    ----------
    positions : shape (12,)
        x, y, z of stance hip mass, swing hip mass, stance foot and swing foot.
    position_jacobian : shape (12, 9)
        Derivative of the positions with respect to ``v``.
    position_bias : shape (12,)
        Acceleration of the masses when every second derivative of ``v`` is zero.
    constraints, constraint_jacobian, constraint_bias : shapes (5,), (5, 9), (5,)
        The same for the contact constraints, in the order of `CONSTRAINTS`.
    pitch : float
        Pitch of the stance foot, rad.
    pitch_jacobian, pitch_bias : shape (9,) and float
        The same for the pitch.
    """

    positions: Vector
    position_jacobian: Vector
    position_bias: Vector
    constraints: Vector
    constraint_jacobian: Vector
    constraint_bias: Vector
    pitch: float
    pitch_jacobian: Vector
    pitch_bias: float


def _about_x(c: Any, s: Any) -> list[list[Any]]:
    return [[1, 0, 0], [0, c, -s], [0, s, c]]


def _about_y(c: Any, s: Any) -> list[list[Any]]:
    return [[c, 0, s], [0, 1, 0], [-s, 0, c]]


def _about_z(c: Any, s: Any) -> list[list[Any]]:
    return [[c, -s, 0], [s, c, 0], [0, 0, 1]]


def rotation_x(angle: float) -> Vector:
    """Right-handed rotation about x by ``angle`` rad, shape (3, 3)."""
    return np.array(_about_x(np.cos(angle), np.sin(angle)), dtype=np.float64)


def rotation_y(angle: float) -> Vector:
    """Right-handed rotation about y by ``angle`` rad, shape (3, 3)."""
    return np.array(_about_y(np.cos(angle), np.sin(angle)), dtype=np.float64)


def rotation_z(angle: float) -> Vector:
    """Right-handed rotation about z by ``angle`` rad, shape (3, 3)."""
    return np.array(_about_z(np.cos(angle), np.sin(angle)), dtype=np.float64)


def rotation_ankle(angle: float, tilt: float) -> Vector:
    """Rotation by ``angle`` rad about the ankle axis (sin tilt, -cos tilt, 0), shape (3, 3).

    The axis is the y axis turned over and tilted about z: it points forward and down.
    """
    to_axis = rotation_z(tilt)
    return to_axis @ rotation_y(-angle) @ to_axis.T


@cache
def _compiled() -> Callable[..., Any]:
    """Derive and compile the model; about two seconds, once per process."""
    with needs_extra("analysis"):
        import sympy as sp  # heavy and only needed by this second opinion

    coordinates = sp.symbols("x y z u1 u2 p_stance p_swing ankle mu")
    rates = sp.symbols("v0:9")
    side, hip_width, foot_radius, tilt = sp.symbols("side d r alpha")
    heading, contact_x, contact_z = sp.symbols("phi x_c z_c")
    x, y, z, yaw, lean, stance_pitch, swing_pitch, ankle, offset = coordinates

    def turned(about: Callable[[Any, Any], list[list[Any]]], angle: Any) -> Any:
        return sp.Matrix(about(sp.cos(angle), sp.sin(angle)))

    e1, e2, e3 = (sp.Matrix([int(i == j) for i in range(3)]) for j in range(3))
    axle_frame = turned(_about_y, yaw) * turned(_about_x, lean)
    axle = axle_frame * e3
    centre = sp.Matrix([x, y, z])
    stance_hip = centre - side * hip_width / 2 * axle
    swing_hip = centre + side * hip_width / 2 * axle
    stance_leg = axle_frame * turned(_about_z, stance_pitch)
    swing_leg = axle_frame * turned(_about_z, swing_pitch)
    stance_end = stance_hip - stance_leg * e2
    swing_end = swing_hip - swing_leg * e2

    # leg = foot * R_a(ankle); the ankle axis is the y axis turned over and tilted about z.
    foot = stance_leg * turned(_about_z, tilt) * turned(_about_y, ankle) * turned(_about_z, -tilt)
    cylinder = stance_end + foot_radius * foot * e2
    ahead = sp.Matrix([sp.cos(heading), 0, -sp.sin(heading)])
    across = sp.Matrix([sp.sin(heading), 0, sp.cos(heading)])
    foot_pitch = sp.atan2((foot * e1)[1], (foot * e2)[1])
    from_contact = cylinder - sp.Matrix([contact_x, 0, contact_z])
    contact = [
        ahead.dot(foot * e3),
        (foot * e3)[1],
        cylinder[1] - foot_radius,
        across.dot(from_contact),
        ahead.dot(from_contact) + foot_radius * foot_pitch,
    ]

    values = sp.Matrix(
        [
            *(stance_hip + offset * axle),
            *(swing_hip + offset * axle),
            *stance_end,
            *swing_end,
            *contact,
            foot_pitch,
        ]
    )
    rate = sp.Matrix(rates)
    jacobian = values.jacobian(coordinates)
    bias = (jacobian * rate).jacobian(coordinates) * rate
    arguments = (
        *coordinates, *rates, side, hip_width, foot_radius, tilt, heading, contact_x, contact_z,
    )  # fmt: skip
    outputs = [*values, *jacobian, *bias]
    return sp.lambdify(arguments, outputs, modules="math", cse=True)


def kinematics(
    coordinates: Vector,
    rates: Vector,
    *,
    side: float,
    hip_width: float,
    foot_radius: float,
    ankle_tilt: float,
    heading: float,
    contact: Vector,
    mass_offset: float = 0.0,
    mass_offset_rate: float = 0.0,
) -> Kinematics:
    """Evaluate positions, constraints and their derivatives.

    Parameters
    ----------
    coordinates, rates : shape (8,)
        In the order of `ROLE_COORDINATES`.
    side : float
        +1 when the left foot stands, -1 when the right one does.
    heading : float
        Direction in which the stance foot rolls, rad.
    contact : shape (2,)
        x and z of the contact reference point.
    mass_offset, mass_offset_rate : float
        Place of both hip masses along the axle, positive to the right, and its rate.

    Notes
    -----
    Constraints of section 3.1 of the paper, with the ankle axis through the sole.
    """
    flat = np.array(
        _compiled()(
            *coordinates.tolist(), mass_offset,
            *rates.tolist(), mass_offset_rate,
            side, hip_width, foot_radius, ankle_tilt, heading, *contact.tolist(),
        )
    )  # fmt: skip
    rows, columns = N_POSITIONS + N_CONSTRAINTS + 1, N_COORDINATES + 1
    values = flat[:rows]
    jacobian = flat[rows : rows * (1 + columns)].reshape(rows, columns)
    bias = flat[rows * (1 + columns) :]
    on_floor = slice(N_POSITIONS, N_POSITIONS + N_CONSTRAINTS)
    return Kinematics(
        positions=values[:N_POSITIONS],
        position_jacobian=jacobian[:N_POSITIONS],
        position_bias=bias[:N_POSITIONS],
        constraints=values[on_floor],
        constraint_jacobian=jacobian[on_floor],
        constraint_bias=bias[on_floor],
        pitch=float(values[-1]),
        pitch_jacobian=jacobian[-1],
        pitch_bias=float(bias[-1]),
    )
