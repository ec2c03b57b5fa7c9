"""From a walker's coordinates to its shape in space: hips, masses, legs, tilted ankle axes and cylinder feet.

The floor frame has x straight downhill, y along the floor's normal and z to the right of someone facing downhill; lengths are in leg lengths.
These are not the kernels' formulas: they go by rotation matrices, so that pictures and kernels check each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from lean_yaw_env.parameters import (
    INTER_LEG_ANGLE,
    QUARTER_TURN,
    STATE_SIZE,
    Foot,
    Vector,
    WalkerParameters,
    require_foot,
    require_mass_offset,
)
from lean_yaw_env.validation import require_array, require_instance, require_number
from lean_yaw_env.walker import OTHER_FOOT, SIDE

FOOT_HALF_LENGTH = 0.16
"""Arc from the sole's middle to its end, of which a step of 0.3 rolls over half either way."""
LEAST_HALF_ARC, GREATEST_HALF_ARC = 0.3, QUARTER_TURN
"""Bounds of the arc's half angle, rad: what large commands roll over, and half a circle in all."""
FOOT_HALF_WIDTH = 0.04
"""Half width of the drawn cylinder; the model's is any that does not tip over (section 3)."""
_ARC_POINTS = 13
_LEAST_UPRIGHT = 1e-9  # below it the swing foot's axis is vertical, and no ankle angle lays it flat


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a walker is: the coordinates of a step at one instant.

    Parameters
    ----------
    state : shape (5,)
        Section state, or its coordinates within the step or in a fall; the rates are not drawn.
    stance : "left" or "right"
    inter_leg_angle : [-pi/2, pi/2]
        Swing leg's pitch in front of the stance leg's, rad; negative while the swing leg is behind.
    mass_offset : [-1, 1]
        Offset of both masses along the axle, positive to the right.
    contact : shape (2,)
        Contact reference point of the stance foot on the floor, (downhill, right).

    Raises
    ------
    ValueError
        If a value is outside its range.
    """

    state: Vector
    stance: Foot = "left"
    inter_leg_angle: float = INTER_LEG_ANGLE
    mass_offset: float = 0.0
    contact: Vector = field(default_factory=lambda: np.zeros(2))

    def __post_init__(self) -> None:
        angle = require_number("inter_leg_angle", self.inter_leg_angle, -QUARTER_TURN, QUARTER_TURN)
        checked = {
            "state": require_array("state", self.state, (STATE_SIZE,)),
            "stance": require_foot(self.stance),
            "inter_leg_angle": angle,
            "mass_offset": require_mass_offset(self.mass_offset),
            "contact": require_array("contact", self.contact, (2,)),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)


@dataclass(frozen=True, eq=False)
class LegShape:
    """A leg with its foot in space; points and directions in the floor frame.

    Attributes
    ----------
    foot : "left" or "right"
    hip, ankle : shape (3,)
        The leg's ends; the ankle is on the sole, a leg length from the hip.
    ankle_axis : shape (3,)
        Unit vector along the ankle axis, forward and down from the ankle.
    centre : shape (3,), on the cylinder's axis
    rotation : shape (3, 3)
        The foot's axes as columns: forward along the untilted sole, up, and the cylinder's axis.
    inner_arc, outer_arc : shape (k, 3), the sole's two edges, from heel to toe
    """

    foot: Foot
    hip: Vector
    ankle: Vector
    ankle_axis: Vector
    centre: Vector
    rotation: Vector
    inner_arc: Vector
    outer_arc: Vector

    @property
    def heading(self) -> float:
        """Direction in which the foot rolls, rad, positive to the left."""
        return math.atan2(self.rotation[0, 2], self.rotation[2, 2])

    @property
    def pitch(self) -> float:
        """Pitch of the foot, rad, positive with the foot ahead of the hip."""
        return math.atan2(self.rotation[1, 0], self.rotation[1, 1])

    @property
    def clearance(self) -> float:
        """Height of the cylinder's lowest line above the floor."""
        return float(self.centre[1] - np.linalg.norm(self.centre - self.ankle))

    def axis_ends(self, below: float, above: float) -> Vector:
        """Places on the ankle axis, in front of and below the ankle and on the other side; shape (2, 3)."""
        return np.array(
            [self.ankle + below * self.ankle_axis, self.ankle - above * self.ankle_axis]
        )


@dataclass(frozen=True, eq=False)
class WalkerShape:
    """The walker in space.

    Attributes
    ----------
    stance_leg, swing_leg : LegShape
    axle : shape (3,), unit vector along the hip axle, to the right
    masses : shape (2, 3), the left and the right hip mass
    contact : shape (3,)
        Where the stance foot touches the floor now; it rolls away from the reference point.
    """

    stance_leg: LegShape
    swing_leg: LegShape
    axle: Vector
    masses: Vector
    contact: Vector

    @property
    def centre(self) -> Vector:
        """Centre of mass; shape (3,)."""
        return self.masses.mean(axis=0)


def rotation(axis: ArrayLike, angle: float) -> Vector:
    """Matrix of the right-handed rotation about a unit vector (Rodrigues); shape (3, 3)."""
    x, y, z = np.asarray(axis, dtype=float)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross


def half_arc(foot_radius: float) -> float:
    """Half the angle of the drawn part of a foot's cylinder, rad."""
    if foot_radius == 0.0:
        return GREATEST_HALF_ARC
    return min(max(FOOT_HALF_LENGTH / foot_radius, LEAST_HALF_ARC), GREATEST_HALF_ARC)


def walker_shape(parameters: WalkerParameters, pose: Pose) -> WalkerShape:
    """The walker's shape in a pose.

    Notes
    -----
    Foot frame F = Ry(heading) Rz(pitch); the cylinder's centre rolls to C = P0 - r pitch h + r n; the ankle is on the sole at A = C + F (0, -r, 0);
    the leg's frame is L = F Ra(ankle angle), the hip a leg length along its second axis, the axle its third. The swing leg is turned by the
    inter-leg angle about the axle, and its ankle keeps the cylinder's axis horizontal.
    """
    require_instance("pose", pose, Pose)
    heading, pitch, ankle_angle = (float(value) for value in pose.state[:3])
    radius = require_instance("parameters", parameters, WalkerParameters).foot_radius
    ankle_axis = np.array([math.sin(parameters.ankle_tilt), -math.cos(parameters.ankle_tilt), 0.0])
    reference = np.array([pose.contact[0], 0.0, pose.contact[1]])
    ahead = np.array([math.cos(heading), 0.0, -math.sin(heading)])
    contact = reference - radius * pitch * ahead

    foot = rotation((0.0, 1.0, 0.0), heading) @ rotation((0.0, 0.0, 1.0), pitch)
    centre = contact + np.array([0.0, radius, 0.0])
    leg = foot @ rotation(ankle_axis, ankle_angle)
    ankle = centre - radius * foot[:, 1]
    hip = ankle + leg[:, 1]
    axle = leg[:, 2]
    stance_leg = _leg_shape(pose.stance, hip, ankle, leg @ ankle_axis, foot, radius)

    other_hip = hip + SIDE[pose.stance] * parameters.hip_width * axle
    swing = leg @ rotation((0.0, 0.0, 1.0), pose.inter_leg_angle)
    swing_foot = swing @ rotation(ankle_axis, -_flat_ankle_angle(swing, ankle_axis))
    other_ankle, other_axis = other_hip - swing[:, 1], swing @ ankle_axis
    other = OTHER_FOOT[pose.stance]
    swing_leg = _leg_shape(other, other_hip, other_ankle, other_axis, swing_foot, radius)
    left, right = (hip, other_hip) if pose.stance == "left" else (other_hip, hip)
    masses = np.array([left, right]) + pose.mass_offset * axle
    return WalkerShape(stance_leg, swing_leg, axle, masses, contact)


def _flat_ankle_angle(leg: Vector, ankle_axis: Vector) -> float:
    """The ankle angle, less than a quarter turn, that makes a foot's cylinder axis horizontal under a leg of this frame.

    The cylinder's axis is e3 cos(b) + e1 sin(b), with e1 square to the ankle axis and to the axle. A leg so far back that its ankle axis is past
    the vertical has no such angle; its foot is drawn square to it.
    """
    e1 = leg @ np.array([-ankle_axis[1], ankle_axis[0], 0.0])
    if e1[1] < _LEAST_UPRIGHT:
        return 0.0
    return math.atan2(-leg[1, 2], e1[1])


def _leg_shape(
    foot: Foot, hip: Vector, ankle: Vector, ankle_axis: Vector, frame: Vector, radius: float
) -> LegShape:
    centre = ankle + radius * frame[:, 1]
    reach = half_arc(radius)
    angles = np.linspace(-reach, reach, _ARC_POINTS)
    zeros = np.zeros_like(angles)
    sole = np.column_stack([radius * np.sin(angles), -radius * np.cos(angles), zeros])
    arc = centre + sole @ frame.T
    inward = SIDE[foot] * FOOT_HALF_WIDTH * frame[:, 2]
    return LegShape(foot, hip, ankle, ankle_axis, centre, frame, arc + inward, arc - inward)
