"""Equations of motion, contact forces and impact of the nine-coordinate walker.

The stance is a differential algebraic equation of index 1: accelerations and Lagrange multipliers
come together from one bordered linear system (Schwab and Wisse 2001, the paper's section 3.1)

    [ M   -D' ] [ q''    ]   [ T' m (g - bias)   ]
    [ D    0  ] [ lambda ] = [ - constraint bias ],      M = T' m T,

with T the Jacobian of the point masses' positions and D that of the constraints. The impact has the
same matrix: momentum takes the place of force and impulses that of the multipliers.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, cos, hypot, inf, pi, sin, tan

import numpy as np

from lean_yaw_env.multibody.kinematics import (
    N_CONSTRAINTS,
    N_COORDINATES,
    STANCE_ANKLE,
    STANCE_LEG,
    SWING_LEG,
    Kinematics,
    Vector,
    kinematics,
    rotation_ankle,
    rotation_x,
    rotation_y,
    rotation_z,
)
from lean_yaw_env.validation import require_number

HIP_MASS = 0.5
"""Each of the two hip masses; together they are the unit of mass."""


@dataclass(frozen=True)
class Body:
    """What the walker is made of: lengths in leg lengths, masses in hip masses, angles in rad.

    The unit of mass is both hip masses together.
    """

    hip_width: float
    foot_radius: float
    ankle_tilt: float
    slope: float
    foot_mass: float

    def __post_init__(self) -> None:
        require_number("hip_width", self.hip_width, 0.0, inf, "[)")
        require_number("foot_radius", self.foot_radius, 0.0, 1.0, "[)")
        require_number("ankle_tilt", self.ankle_tilt, 0.0, pi / 2, "(]")
        require_number("slope", self.slope, -pi / 2, pi / 2, "()")
        require_number("foot_mass", self.foot_mass, 0.0, inf, "()")

    @property
    def gravity(self) -> Vector:
        """Gravity in the frame of the slope, shape (3,)."""
        return np.array([sin(self.slope), -cos(self.slope), 0.0])

    @property
    def masses(self) -> Vector:
        """The mass that goes with each of the twelve positions, shape (12,)."""
        return np.repeat([HIP_MASS, HIP_MASS, self.foot_mass, self.foot_mass], 3)


@dataclass(frozen=True)
class Stance:
    """Constants of a step: side (+1 left foot, -1 right), heading, contact reference point."""

    side: float
    heading: float
    contact: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Offset:
    """Place of the hip masses along the axle, positive to the right, and two derivatives."""

    value: float = 0.0
    rate: float = 0.0
    acceleration: float = 0.0


@dataclass(frozen=True)
class ContactForces:
    """What the floor does to the stance foot, in units of the two hips' weight.

    Attributes
    ----------
    normal : float
        Along the floor's normal, positive when the floor pushes.
    forward, lateral : float
        In the floor, along the rolling direction and along the foot's cylinder axis (to the right).
    yaw_torque : float
        About the floor's normal through the contact, positive to the left.
    roll_torque : float
        About the rolling direction through the middle of the contact line; the floor can give it
        only by pressing ``-roll_torque / normal`` to the right of the middle.
    hip_torque : float
        On the swing leg, forward, that holds the inter-leg angle; 0 for a passive leg.
    """

    normal: float
    forward: float
    lateral: float
    yaw_torque: float
    roll_torque: float
    hip_torque: float = 0.0

    @property
    def friction_demand(self) -> float:
        """Tangential over normal force; infinite when the floor would have to pull."""
        return hypot(self.forward, self.lateral) / self.normal if self.normal > 0.0 else inf


def evaluate(
    body: Body, stance: Stance, coordinates: Vector, rates: Vector, offset: Offset
) -> Kinematics:
    """Kinematics in this stance at role ``coordinates`` and ``rates``, each of shape (8,)."""
    return kinematics(
        coordinates,
        rates,
        side=stance.side,
        hip_width=body.hip_width,
        foot_radius=body.foot_radius,
        ankle_tilt=body.ankle_tilt,
        heading=stance.heading,
        contact=np.array(stance.contact),
        mass_offset=offset.value,
        mass_offset_rate=offset.rate,
    )


def _hold_row() -> Vector:
    row = np.zeros(N_COORDINATES)
    row[SWING_LEG], row[STANCE_LEG] = 1.0, -1.0
    return row


def _bordered_solve(mass: Vector, constraint_rows: Vector, top: Vector, bottom: Vector) -> Vector:
    count = len(constraint_rows)
    size = N_COORDINATES + count
    matrix = np.zeros((size, size))
    matrix[:N_COORDINATES, :N_COORDINATES] = mass
    matrix[:N_COORDINATES, N_COORDINATES:] = -constraint_rows.T
    matrix[N_COORDINATES:, :N_COORDINATES] = constraint_rows
    return np.asarray(np.linalg.solve(matrix, np.concatenate([top, bottom])), dtype=np.float64)


def accelerations(
    body: Body,
    stance: Stance,
    coordinates: Vector,
    rates: Vector,
    *,
    offset: Offset,
    is_held: bool,
) -> tuple[Vector, Vector, Kinematics]:
    """Accelerations (8,), multipliers (5,) or, with the swing leg held, (6,), and kinematics."""
    here = evaluate(body, stance, coordinates, rates, offset)
    jacobian = here.position_jacobian[:, :N_COORDINATES]
    weighted = jacobian.T * body.masses
    gravity = np.tile(body.gravity, 4)
    carried = here.position_bias + here.position_jacobian[:, N_COORDINATES] * offset.acceleration
    rows = here.constraint_jacobian[:, :N_COORDINATES]
    bottom = -here.constraint_bias
    if is_held:
        rows = np.vstack([rows, _hold_row()])
        bottom = np.append(bottom, 0.0)
    solution = _bordered_solve(weighted @ jacobian, rows, weighted @ (gravity - carried), bottom)
    return solution[:N_COORDINATES], solution[N_COORDINATES:], here


def forces_from_multipliers(body: Body, multipliers: Vector) -> ContactForces:
    """Name the multipliers of the contact constraints (and of the held leg).

    Notes
    -----
    The lateral multiplier acts at the cylinder's centre, ``foot_radius`` above the floor, hence its
    part in the roll torque about the contact; the forward one acts at the contact itself, as its
    constraint has the pitch in it.
    """
    no_yaw, no_lean, normal, lateral, forward = (float(m) for m in multipliers[:N_CONSTRAINTS])
    return ContactForces(
        normal=normal,
        forward=forward,
        lateral=lateral,
        yaw_torque=no_yaw,
        roll_torque=body.foot_radius * lateral - no_lean,
        hip_torque=float(multipliers[N_CONSTRAINTS]) if len(multipliers) > N_CONSTRAINTS else 0.0,
    )


def energy(
    body: Body, stance: Stance, coordinates: Vector, rates: Vector, offset: Offset
) -> tuple[float, float]:
    """Kinetic and potential energy; the potential is zero at the origin of the floor."""
    here = evaluate(body, stance, coordinates, rates, offset)
    velocities = here.position_jacobian @ np.append(rates, offset.rate)
    kinetic = 0.5 * float(body.masses @ velocities**2)
    potential = -float((body.masses * np.tile(body.gravity, 4)) @ here.positions)
    return kinetic, potential


def impact(
    body: Body, new_stance: Stance, coordinates: Vector, rates: Vector, offset: Offset
) -> tuple[Vector, Vector]:
    """Plastic impact: only the new contact takes impulse, and the hip masses lock to the axle.

    Parameters
    ----------
    coordinates, rates : shape (8,)
        In the roles of the new stance; the rates are those before the impact.
    offset : Offset
        Place and rate of the hip masses before the impact; the rate is lost in it.

    Returns
    -------
    rates, impulses : shapes (8,) and (5,)
        Rates after the impact and the contact's impulsive multipliers in the order of
        `CONSTRAINTS`.
    """
    here = evaluate(body, new_stance, coordinates, rates, offset)
    jacobian = here.position_jacobian[:, :N_COORDINATES]
    weighted = jacobian.T * body.masses
    momentum = weighted @ (here.position_jacobian @ np.append(rates, offset.rate))
    rows = here.constraint_jacobian[:, :N_COORDINATES]
    solution = _bordered_solve(weighted @ jacobian, rows, momentum, np.zeros(N_CONSTRAINTS))
    return solution[:N_COORDINATES], solution[N_COORDINATES:]


def place(body: Body, stance: Stance, pitch: float, ankle: float, inter_leg_angle: float) -> Vector:
    """Role coordinates, shape (8,), that meet all five contact constraints."""
    ahead = np.array([cos(stance.heading), 0.0, -sin(stance.heading)])
    contact = np.array([stance.contact[0], 0.0, stance.contact[1]])
    up = np.array([0.0, 1.0, 0.0])
    foot = rotation_y(stance.heading) @ rotation_z(pitch)
    centre = contact - body.foot_radius * pitch * ahead + body.foot_radius * up
    leg = foot @ rotation_ankle(ankle, body.ankle_tilt)
    hip = centre - body.foot_radius * foot[:, 1] + leg[:, 1]
    axle_centre = hip + stance.side * body.hip_width / 2 * leg[:, 2]
    yaw = float(np.arctan2(leg[0, 2], leg[2, 2]))
    lean = float(-np.arcsin(leg[1, 2]))
    rest = rotation_x(-lean) @ rotation_y(-yaw) @ leg
    leg_pitch = float(np.arctan2(rest[1, 0], rest[0, 0]))
    return np.array([*axle_centre, yaw, lean, leg_pitch, leg_pitch + inter_leg_angle, ankle])


def rates_from_section(
    body: Body,
    stance: Stance,
    coordinates: Vector,
    pitch_rate: float,
    ankle_rate: float,
    inter_leg_rate: float,
) -> Vector:
    """Role rates, shape (8,), that the contact allows, from the three independent ones."""
    here = evaluate(body, stance, coordinates, np.zeros(N_COORDINATES), Offset())
    ankle_row = np.zeros(N_COORDINATES)
    ankle_row[STANCE_ANKLE] = 1.0
    matrix = np.vstack(
        [
            here.constraint_jacobian[:, :N_COORDINATES],
            here.pitch_jacobian[:N_COORDINATES],
            ankle_row,
            _hold_row(),
        ]
    )
    wanted = np.array([0.0] * N_CONSTRAINTS + [pitch_rate, ankle_rate, inter_leg_rate])
    return np.asarray(np.linalg.solve(matrix, wanted), dtype=np.float64)


@dataclass(frozen=True)
class SwingFoot:
    """The swing foot, turned about its ankle until its cylinder axis is horizontal.

    Attributes
    ----------
    clearance : float
        Height of the cylinder above the floor.
    pitch, heading : float
        Of the foot, rad.
    ankle : float
        Angle of the leg against the foot, rad.
    centre : shape (3,)
        Centre of the cylinder.
    is_before_vertical_axis : bool
        Whether the ankle axis points forward and down. A foot further back has no well-defined
        flat orientation.
    """

    clearance: float
    pitch: float
    heading: float
    ankle: float
    centre: Vector
    is_before_vertical_axis: bool


def swing_foot(body: Body, stance: Stance, coordinates: Vector) -> SwingFoot:
    """Where the swing foot is at role ``coordinates``, shape (8,)."""
    x, y, z, yaw, lean, _, leg_pitch, _ = coordinates
    axle_frame = rotation_y(yaw) @ rotation_x(lean)
    leg = axle_frame @ rotation_z(leg_pitch)
    hip = np.array([x, y, z]) + stance.side * body.hip_width / 2 * axle_frame[:, 2]
    # The ankle undoes the axle's slope: tan(ankle) = tan(lean) / sin(leg pitch + tilt).
    ahead = sin(leg_pitch + body.ankle_tilt)
    ankle = atan(tan(lean) / ahead) if ahead != 0.0 else pi / 2
    foot = leg @ rotation_ankle(-ankle, body.ankle_tilt)
    centre = hip - leg[:, 1] + body.foot_radius * foot[:, 1]
    return SwingFoot(
        clearance=float(centre[1]) - body.foot_radius,
        pitch=float(np.arctan2(foot[1, 0], foot[1, 1])),
        heading=float(np.arctan2(foot[0, 2], foot[2, 2])),
        ankle=ankle,
        centre=centre,
        is_before_vertical_axis=ahead > 0.0,
    )


def exchange_roles(coordinates: Vector, stance_ankle: float) -> Vector:
    """The same role vector seen from the other foot, whose ankle entry is ``stance_ankle``."""
    exchanged = coordinates.copy()
    exchanged[STANCE_LEG], exchanged[SWING_LEG] = coordinates[SWING_LEG], coordinates[STANCE_LEG]
    exchanged[STANCE_ANKLE] = stance_ankle
    return exchanged
