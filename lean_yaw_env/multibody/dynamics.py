"""Equations of motion, contact forces and impact of the nine-coordinate walker.

The stance is a differential algebraic equation of index 1: accelerations and Lagrange multipliers come together from one bordered linear
system (Schwab and Wisse 2001, the paper's section 3.1)

    [ M   -D' ] [ q''    ]   [ T' m (g - bias)   ]
    [ D    0  ] [ lambda ] = [ - constraint bias ],      M = T' m T,

with T the Jacobian of the point masses' positions and D that of the constraints. The impact has the same matrix: momentum takes the place of
force and impulses that of the multipliers.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, cos, hypot, inf, pi, sin, tan
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from lean_yaw_env.multibody.kinematics import (
    CONTACT,
    N_CONSTRAINTS,
    N_COORDINATES,
    PITCH,
    POSITIONS,
    STANCE_ANKLE,
    STANCE_LEG,
    SWING_LEG,
    Kinematics,
    Vector,
    kinematics,
)
from lean_yaw_env.validation import require_number

HIP_MASS = 0.5
"""Each of the two hip masses; together they are the unit of mass."""
_UP = np.array([0.0, 1.0, 0.0])
_INTER_LEG_ROW = np.eye(N_COORDINATES)[SWING_LEG] - np.eye(N_COORDINATES)[STANCE_LEG]


@dataclass(frozen=True)
class Body:
    """What the walker is made of: lengths in leg lengths, masses in units of both hip masses, angles in rad."""

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
        """Gravity on each of the twelve positions in the frame of the slope, shape (12,)."""
        return np.tile([sin(self.slope), -cos(self.slope), 0.0], 4)

    @property
    def masses(self) -> Vector:
        """The mass that goes with each of the twelve positions, shape (12,)."""
        return np.repeat([HIP_MASS, HIP_MASS, self.foot_mass, self.foot_mass], 3)

    def ankle_rotation(self, angle: float) -> Vector:
        """Rotation by an angle about the ankle axis, which points forward and down; shape (3, 3)."""
        axis = np.array([sin(self.ankle_tilt), -cos(self.ankle_tilt), 0.0])
        return Rotation.from_rotvec(angle * axis).as_matrix()


class Offset(NamedTuple):
    """Place of the hip masses along the axle, positive to the right, and two derivatives."""

    value: float = 0.0
    rate: float = 0.0
    acceleration: float = 0.0


@dataclass(frozen=True)
class Shift:
    """The hip masses' way from ``start`` to ``target`` in ``duration``: the polynomial 10 s^3 - 15 s^4 + 6 s^5 of s = t / duration.

    Velocity and acceleration are zero at both ends.
    """

    start: float = 0.0
    target: float = 0.0
    duration: float = 1.0

    def at(self, time: float) -> Offset:
        """Place, rate and acceleration of the masses at ``time`` since the start of the step."""
        distance = self.target - self.start
        s = time / self.duration
        if distance == 0.0 or s >= 1.0:
            return Offset(self.target)
        return Offset(
            self.start + distance * s**3 * (10.0 - 15.0 * s + 6.0 * s**2),
            distance * 30.0 * s**2 * (1.0 - s) ** 2 / self.duration,
            distance * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / self.duration**2,
        )


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
        About the rolling direction through the middle of the contact line; the floor can give it only by pressing ``-roll_torque / normal``
        to the right of the middle.
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


class SwingFoot(NamedTuple):
    """The swing foot, turned about its ankle until its cylinder axis is horizontal; angles in rad."""

    clearance: float
    """Height of the cylinder above the floor."""
    pitch: float
    heading: float
    ankle: float
    """Angle of the leg against the foot."""
    centre: Vector
    """Of the cylinder, shape (3,)."""
    is_before_vertical_axis: bool
    """Whether the ankle axis points forward and down. A foot further back has no well-defined flat orientation."""


@dataclass(frozen=True)
class Stance:
    """A stance phase: its constants, and what follows from ``y`` = (role coordinates, their rates), shape (16,).

    Attributes
    ----------
    side : +1 when the left foot stands, -1 when the right one does
    heading : of the stance foot, rad
    contact : x and z of its contact reference point
    shift : of the hip masses
    is_held : whether a torque at the hip holds the inter-leg angle
    """

    body: Body
    side: float
    heading: float
    contact: tuple[float, float] = (0.0, 0.0)
    shift: Shift = Shift()
    is_held: bool = True

    def kinematics(self, y: Vector, offset: Offset = Offset()) -> Kinematics:  # noqa: B008 - immutable
        """Kinematics with the masses at an offset that has a rate."""
        body = self.body
        return kinematics(
            np.append(y[:N_COORDINATES], offset.value),
            np.append(y[N_COORDINATES:], offset.rate),
            side=self.side,
            hip_width=body.hip_width,
            foot_radius=body.foot_radius,
            ankle_tilt=body.ankle_tilt,
            heading=self.heading,
            contact=self.contact,
        )

    def accelerations(self, time: float, y: Vector) -> tuple[Vector, Vector, Kinematics]:
        """Accelerations (8,), multipliers (5,) or, with the swing leg held, (6,), and kinematics."""
        offset = self.shift.at(time)
        here = self.kinematics(y, offset)
        shifted = here.bias + here.jacobian[:, N_COORDINATES] * offset.acceleration
        force = self.body.gravity - shifted[POSITIONS]
        return *self._bordered_solve(here, force, -here.bias[CONTACT], self.is_held), here

    def derivative(self, time: float, y: Vector) -> Vector:
        """Time derivative of ``y``."""
        return np.concatenate([y[N_COORDINATES:], self.accelerations(time, y)[0]])

    def forces(self, time: float, y: Vector) -> ContactForces:
        """What the floor does to the stance foot."""
        return self._named(self.accelerations(time, y)[1])

    def energies(self, y: Vector, offset: Offset) -> tuple[float, float]:
        """Kinetic and potential energy; the potential is zero at the origin of the floor."""
        here, body = self.kinematics(y, offset), self.body
        velocities = _velocities(here, y, offset)
        kinetic = 0.5 * float(body.masses @ velocities**2)
        return kinetic, -float((body.masses * body.gravity) @ here.values[POSITIONS])

    def impact(self, y: Vector, offset: Offset) -> tuple[Vector, ContactForces]:
        """Plastic impact: only this stance's contact takes impulse, and the hip masses lock to the axle.

        Parameters
        ----------
        y : shape (16,)
            In the roles of this stance, with the rates before the impact.
        offset : Offset
            Place and rate of the hip masses before the impact; the rate is lost in it.

        Returns
        -------
        y, impulses
            Just after the impact, and what the floor gave to the foot.
        """
        here = self.kinematics(y, offset)
        nothing = np.zeros(N_CONSTRAINTS)
        rates, impulses = self._bordered_solve(here, _velocities(here, y, offset), nothing, False)
        return np.concatenate([y[:N_COORDINATES], rates]), self._named(impulses)

    def _bordered_solve(
        self, here: Kinematics, top: Vector, bottom: Vector, is_held: bool
    ) -> tuple[Vector, Vector]:
        """The unknowns (8,) and multipliers for ``top`` per unit of mass, (12,), and ``bottom``, (5,)."""
        positions = here.jacobian[POSITIONS, :N_COORDINATES]
        weighted = positions.T * self.body.masses
        rows = here.jacobian[CONTACT, :N_COORDINATES]
        if is_held:
            rows, bottom = np.vstack([rows, _INTER_LEG_ROW]), np.append(bottom, 0.0)
        size = N_COORDINATES + len(rows)
        matrix = np.zeros((size, size))  # filled by parts: np.block takes longer than the solution
        matrix[:N_COORDINATES, :N_COORDINATES] = weighted @ positions
        matrix[:N_COORDINATES, N_COORDINATES:] = -rows.T
        matrix[N_COORDINATES:, :N_COORDINATES] = rows
        right_side = np.concatenate([weighted @ top, bottom])
        solution = np.asarray(np.linalg.solve(matrix, right_side), dtype=np.float64)
        return solution[:N_COORDINATES], solution[N_COORDINATES:]

    def _named(self, multipliers: Vector) -> ContactForces:
        """Multipliers of the contact constraints (and of the held leg) as forces.

        The lateral multiplier acts at the cylinder's centre, ``foot_radius`` above the floor, hence its part in the roll torque about the
        contact; the forward one acts at the contact itself, as its constraint has the pitch in it.
        """
        no_yaw, no_lean, normal, lateral, forward, *held = multipliers.tolist()
        roll_torque = self.body.foot_radius * lateral - no_lean
        return ContactForces(normal, forward, lateral, no_yaw, roll_torque, *held)

    def placed(
        self, section: tuple[float, ...], inter_leg_angle: float, inter_leg_rate: float
    ) -> Vector:
        """``y`` of a section state of this stance (stance pitch, ankle angle and their rates) that meets the contact constraints."""
        pitch, ankle, pitch_rate, ankle_rate = section
        radius, heading = self.body.foot_radius, self.heading
        contact = np.array([self.contact[0], 0.0, self.contact[1]])
        foot = _frame("YZ", heading, pitch)
        rolled = -radius * pitch * np.array([cos(heading), 0.0, -sin(heading)])
        leg = foot @ self.body.ankle_rotation(ankle)
        hip = contact + rolled + radius * (_UP - foot[:, 1]) + leg[:, 1]
        axle_centre = hip + self.side * self.body.hip_width / 2 * leg[:, 2]
        yaw, lean, leg_pitch = Rotation.from_matrix(leg).as_euler("YXZ").tolist()
        coordinates = [*axle_centre, yaw, lean, leg_pitch, leg_pitch + inter_leg_angle, ankle]
        y = np.array([*coordinates, *np.zeros(N_COORDINATES)])
        rows = self.kinematics(y).jacobian[CONTACT.start :, :N_COORDINATES]
        matrix = np.vstack([rows, np.eye(N_COORDINATES)[STANCE_ANKLE], _INTER_LEG_ROW])
        rates = np.array([0.0] * N_CONSTRAINTS + [pitch_rate, ankle_rate, inter_leg_rate])
        y[N_COORDINATES:] = np.linalg.solve(matrix, rates)
        return y

    def pitch(self, y: Vector) -> tuple[float, float]:
        """Pitch of the stance foot and its rate."""
        here = self.kinematics(y)
        rate = here.jacobian[PITCH, :N_COORDINATES] @ y[N_COORDINATES:]
        return float(here.values[PITCH]), float(rate)

    def swing_foot(self, y: Vector) -> SwingFoot:
        """Where the swing foot is, turned flat."""
        body = self.body
        x, y_hip, z, yaw, lean, _, leg_pitch, _ = y[:N_COORDINATES].tolist()
        leg = _frame("YXZ", yaw, lean, leg_pitch)
        hip = np.array([x, y_hip, z]) + self.side * body.hip_width / 2 * leg[:, 2]
        # The ankle undoes the axle's slope: tan(ankle) = tan(lean) / sin(leg pitch + tilt).
        ahead = sin(leg_pitch + body.ankle_tilt)
        ankle = atan(tan(lean) / ahead) if ahead != 0.0 else pi / 2
        foot = leg @ body.ankle_rotation(-ankle)
        centre = hip - leg[:, 1] + body.foot_radius * foot[:, 1]
        return SwingFoot(
            clearance=float(centre[1]) - body.foot_radius,
            pitch=float(np.arctan2(foot[1, 0], foot[1, 1])),
            heading=float(np.arctan2(foot[0, 2], foot[2, 2])),
            ankle=ankle,
            centre=centre,
            is_before_vertical_axis=ahead > 0.0,
        )


def _velocities(here: Kinematics, y: Vector, offset: Offset) -> Vector:
    """Of the point masses, shape (12,)."""
    return here.jacobian[POSITIONS] @ np.append(y[N_COORDINATES:], offset.rate)


def _frame(axes: str, *angles: float) -> Vector:
    """Rotation by angles about two or more axes, each of the frame that the last has turned; shape (3, 3)."""
    return Rotation.from_euler(axes, angles).as_matrix()


def exchange_roles(y: Vector, stance_ankle: float) -> Vector:
    """The same ``y`` seen from the other foot, whose ankle is at an angle and, as its foot is massless in rotation, has no rate of its own."""
    exchanged = y.copy()
    for first in (0, N_COORDINATES):
        stance, swing = first + STANCE_LEG, first + SWING_LEG
        exchanged[[stance, swing]] = y[[swing, stance]]
    exchanged[[STANCE_ANKLE, N_COORDINATES + STANCE_ANKLE]] = stance_ankle, 0.0
    return exchanged
