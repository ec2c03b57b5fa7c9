"""Guidance over the heading regulator: along a path, and from goal to goal. They say where to head; ``lqr`` brings the walker there."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.envs.formulas import wrapped
from lean_yaw_env.envs.observation import OFFSET_SCALE
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.parameters import Vector
from lean_yaw_env.validation import require_number

from ..observations import ObservationLayout
from .lqr import HeadingLqr, LqrSettings, Regulator, UprightLqr

_PREVIEW = "preview_"


@dataclass(frozen=True)
class PathSettings:
    """Settings of ``PathGuidance``, in leg lengths."""

    ahead: float = 2.4
    """How far downhill the path's direction is taken: the walker answers that much late."""
    approach: float = 6.0
    """Distance within which a small cross-track error is corrected."""
    loop: LqrSettings = field(default_factory=LqrSettings)

    def __post_init__(self) -> None:
        require_number("ahead", self.ahead, 0.0, 8.0)
        require_number("approach", self.approach, 0.0, math.inf, "()")


class PathGuidance(Regulator):
    """Follows a path that is seen ahead: its direction there, and towards it as far as the walker is beside it; see ``Regulator``.

    The path ahead is the polynomial through where it is beside the walker, its direction there, and its previews.
    """

    Settings = PathSettings
    needs = ("cross_track_error", "path_heading_error")

    def __init__(self, task: str, options: EnvOptions | None = None, settings: Any = None) -> None:
        super().__init__(task, options, settings)
        names = [name for name in self.loop.layout.names if name.startswith(_PREVIEW)]
        self._previews = [(name, float(name.removeprefix(_PREVIEW))) for name in names]
        self._slope_ahead = self._slope_weights()

    def _regulated(self, seen: NDArray[np.float32]) -> NDArray[np.float32]:
        layout = self.loop.layout
        # the mean of the last two footprints', within what previews can be turned back from
        heading = layout.quantity(seen, "heading") - 0.5 * self.loop.last_turn(seen)
        heading = np.clip(heading, -1.4, 1.4)
        aside = layout.quantity(seen, "cross_track_error")
        path_heading = heading + layout.quantity(seen, "path_heading_error")
        slope = np.tan(-np.clip(path_heading, -1.4, 1.4))  # to the right per downhill
        points = [-aside * np.sqrt(1.0 + slope**2), slope]
        for name, ahead in self._previews:
            left = layout.quantity(seen, name)
            points.append(-(left + ahead * np.sin(heading)) / np.cos(heading))
        there = np.stack(points, axis=-1) @ self._slope_ahead
        wanted = -np.arctan(there) + np.arctan(aside / self.settings.approach)
        return self.loop.actions(seen, wanted - heading)

    def _slope_weights(self) -> Vector:
        """What the polynomial's slope ahead is made of: the path's place and slope beside the walker, and its places ahead."""
        distances = np.array([ahead for _, ahead in self._previews])
        powers = np.arange(len(distances) + 2)
        conditions = np.vstack(
            [0.0**powers, np.where(powers == 1, 1.0, 0.0), distances[:, None] ** powers]
        )
        ahead = self.settings.ahead
        slope = np.where(powers > 0, powers * ahead ** np.maximum(powers - 1, 0), 0.0)
        return np.asarray(slope @ np.linalg.inv(conditions), dtype=float)


@dataclass(frozen=True)
class WaypointSettings:
    """Settings of ``WaypointGuidance``."""

    radius: float = 4.1
    """Leg lengths, of the turn that can be relied on. A goal within that turn's circle is not turned to, which would be orbiting it; the walker
    goes straight on until it can."""
    persistence: float = 0.0
    """Rad: how far beyond half a turn the walker turns on in the direction that the largest offset turns it to, rather than turn round; in
    proportion for smaller offsets. To lean over to the other side takes twenty steps."""
    loop: LqrSettings = field(default_factory=LqrSettings)

    def __post_init__(self) -> None:
        require_number("radius", self.radius, 0.0, math.inf, "[)")
        require_number("persistence", self.persistence, 0.0, math.pi)


class WaypointGuidance(Regulator):
    """Walks to goals, past those that it cannot turn to, and back; see ``Regulator``."""

    Settings = WaypointSettings
    needs = ("goal_bearing", "goal_distance")

    def _regulated(self, seen: NDArray[np.float32]) -> NDArray[np.float32]:
        layout = self.loop.layout
        bearing = layout.quantity(seen, "goal_bearing")
        distance = layout.quantity(seen, "goal_distance")
        # a circle through here along the heading and through the goal has this radius: distance / (2 sin(bearing))
        can_turn = distance >= 2.0 * self.settings.radius * np.abs(np.sin(bearing))
        error = np.where(can_turn, self._shortest_turn(seen, bearing), 0.0)
        return self.loop.actions(seen, error)

    def _shortest_turn(self, seen: NDArray[np.float32], bearing: Vector) -> Vector:
        """The turn to a bearing on the side that the walker leans to, unless that is longer by more than leaning over is worth."""
        # an offset to the right (positive) turns to the right (negative)
        lean = np.clip(-self.loop.layout.quantity(seen, "mass_offset") / OFFSET_SCALE, -1.0, 1.0)
        preferred = self.settings.persistence * lean
        return preferred + wrapped(bearing - preferred)


def regulator_for(task: str, options: EnvOptions) -> type[Regulator]:
    """The regulator, with the guidance that a task's observations call for; made of task, options and settings."""
    names = ObservationLayout.of(task, options).names
    if "goal_bearing" in names:
        return WaypointGuidance
    if "cross_track_error" in names:
        return PathGuidance
    return HeadingLqr if "heading_error" in names else UprightLqr


def guided(task: str, options: EnvOptions) -> Regulator:
    """The regulator for a task with the settings that come with the package.

    Raises
    ------
    NoGaitError
        If the walker has no gait to regulate about.
    """
    return regulator_for(task, options)(task, options)
