"""Where things on the floor and on the walker come on the picture: pixels from leg lengths."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.parameters import Vector, WalkerParameters


class Panel(NamedTuple):
    """A rectangle of the picture, in pixels from its upper left corner."""

    left: float
    top: float
    width: float
    height: float

    @property
    def middle(self) -> Vector:
        return np.array([self.left + 0.5 * self.width, self.top + 0.5 * self.height])

    @property
    def right(self) -> float:
        return self.left + self.width

    @property
    def bottom(self) -> float:
        return self.top + self.height


@dataclass(frozen=True, eq=False)
class FloorCamera:
    """Looks straight down on the floor: downhill is up on the picture, right is right.

    ``centre`` (2,) is the point of the floor in the panel's middle, (downhill, right); ``scale`` is in pixels per leg length.
    """

    panel: Panel
    centre: Vector
    scale: float

    def pixels(self, points: Vector) -> Vector:
        """Picture coordinates of floor points; shape (..., 2) to (..., 2)."""
        offset = self.scale * (points - self.centre)
        return self.panel.middle + np.stack([offset[..., 1], -offset[..., 0]], axis=-1)

    @property
    def reach(self) -> Vector:
        """Half of what the panel shows, (downhill, right), in leg lengths."""
        return 0.5 * np.array([self.panel.height, self.panel.width]) / self.scale

    def sees(self, points: Vector, margin: float = 0.0) -> NDArray[np.bool_]:
        """Which floor points are within ``margin`` leg lengths of the panel; shape (n,), bool."""
        return np.all(np.abs(points - self.centre) <= self.reach + margin, axis=-1)


def floor_camera(
    panel: Panel,
    points: Vector,
    subject: Vector,
    *,
    border: float,
    least_scale: float,
    greatest_scale: float,
) -> FloorCamera:
    """A camera that shows all points (n, 2) as long as its least scale allows it, and always the subject (2,).

    It depends on its arguments continuously, so it follows a moving subject without a jolt. ``border`` is in pixels, to be left around the
    points; scales are in pixels per leg length.
    """
    shown = np.vstack([points, subject])
    low, high = shown.min(axis=0), shown.max(axis=0)
    room = np.array([panel.height, panel.width]) - 2.0 * border
    fit = float((room / np.maximum(high - low, 1e-9)).min())
    scale = min(max(fit, least_scale), greatest_scale)
    slack = 0.5 * room / scale
    centre = np.clip(0.5 * (low + high), subject - slack, subject + slack)
    return FloorCamera(panel, centre, scale)


@dataclass(frozen=True, eq=False)
class BodyCamera:
    """Looks at the walker along a level line, without perspective; gravity points down on the picture.

    ``right``, ``up`` and ``toward`` (3,) are unit vectors in the floor frame: rightward and upward on the picture, and to the viewer. The point
    ``subject`` (3,) of space comes to ``place`` (2,) on the picture; ``scale`` is in pixels per leg length.
    """

    panel: Panel
    right: Vector
    up: Vector
    toward: Vector
    subject: Vector
    place: Vector
    scale: float

    def pixels(self, points: Vector) -> Vector:
        """Picture coordinates of points in space; shape (..., 3) to (..., 2)."""
        offset = self.scale * (points - self.subject)
        return self.place + np.stack([offset @ self.right, -(offset @ self.up)], axis=-1)

    def nearness(self, point: Vector) -> float:
        """How far a point is on the viewer's side of the subject."""
        return float((point - self.subject) @ self.toward)


def upward(parameters: WalkerParameters, heading: float) -> Vector:
    """Unit vector against gravity in the floor frame, (3,). A slope that turns with the walker falls to where its stance foot heads."""
    falls_to = heading if parameters.slope_turns else 0.0
    sine, cosine = math.sin(parameters.slope), math.cos(parameters.slope)
    return np.array([-sine * math.cos(falls_to), cosine, sine * math.sin(falls_to)])


def body_camera(
    panel: Panel, toward: Vector, up: Vector, subject: Vector, place: Vector, scale: float
) -> BodyCamera:
    """A camera on the side of ``toward``, made level; ``up`` is a unit vector."""
    level = toward - (toward @ up) * up
    level = level / np.linalg.norm(level)
    return BodyCamera(panel, np.cross(up, level), up, level, subject, place, scale)
