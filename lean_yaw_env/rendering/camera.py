"""Where things on the floor and on the walker come on the picture: pixels from leg lengths."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.parameters import Vector, WalkerParameters

NEAREST = 0.05
"""Leg lengths in front of a camera from which on things are seen."""


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
class PerspectiveCamera:
    """Looks from ``eye`` (3,) along ``forward``; ``right``, ``up`` and ``forward`` (3,) are unit vectors in the floor frame.

    A length at distance one is ``focal`` times as many pixels.
    """

    panel: Panel
    eye: Vector
    right: Vector
    up: Vector
    forward: Vector
    focal: float

    def seen(self, points: Vector) -> tuple[Vector, Vector]:
        """Picture coordinates (n, 2) of points in space (n, 3), NaN behind the camera, and their distances (n,)."""
        offset = points - self.eye
        depth = offset @ self.forward
        near = depth > NEAREST
        share = self.focal / np.where(near, depth, np.nan)
        aside = np.column_stack([share * (offset @ self.right), -share * (offset @ self.up)])
        return self.panel.middle + aside, depth

    def place(self, point: Vector) -> tuple[Vector, float]:
        """Picture coordinates of a point, and the pixels of a leg length there."""
        offset = point - self.eye
        scale = self.focal / max(float(offset @ self.forward), NEAREST)
        return self.panel.middle + scale * np.array(
            [offset @ self.right, -(offset @ self.up)]
        ), scale

    def distance(self, point: Vector) -> float:
        """From the eye."""
        return float(np.linalg.norm(point - self.eye))

    def on_floor(self, points: Vector) -> Vector:
        """Picture coordinates of floor points, (downhill, right); of those in front of the camera only."""
        places, _ = self.seen(np.insert(points, 1, 0.0, axis=1))
        return places[np.isfinite(places).all(axis=1)]

    def horizon(self) -> Vector:
        """Where the floor ends at the panel's left and right edges, (2,), pixels from the picture's upper edge."""
        # A direction is level with the floor where its second component is zero
        across = np.array([self.panel.left, self.panel.right]) - self.panel.middle[0]
        rise = (self.focal * self.forward[1] + across * self.right[1]) / self.up[1]
        return self.panel.middle[1] + rise


def upward(parameters: WalkerParameters, heading: float) -> Vector:
    """Unit vector against gravity in the floor frame, (3,). A slope that turns with the walker falls to where its stance foot heads."""
    falls_to = heading if parameters.slope_turns else 0.0
    sine, cosine = math.sin(parameters.slope), math.cos(parameters.slope)
    return np.array([-sine * math.cos(falls_to), cosine, sine * math.sin(falls_to)])


def perspective_camera(
    panel: Panel, eye: Vector, target: Vector, up: Vector, angle: float
) -> PerspectiveCamera:
    """A camera that looks from ``eye`` at ``target`` with ``up`` (unit vectors' frame: the floor's) upright; ``angle`` spans the lesser side, rad."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, up)
    right = right / np.linalg.norm(right)
    focal = 0.5 * min(panel.width, panel.height) / math.tan(0.5 * angle)
    return PerspectiveCamera(panel, eye, right, np.cross(right, forward), forward, focal)
