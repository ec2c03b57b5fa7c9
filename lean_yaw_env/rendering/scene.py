"""What a picture of a walk holds, whoever made the walk: an environment, a film, a notebook."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from lean_yaw_env.parameters import Foot, Vector, WalkerParameters, require_foot
from lean_yaw_env.rendering.geometry import Pose
from lean_yaw_env.validation import (
    require_array,
    require_count,
    require_finite,
    require_instance,
    require_number,
    require_text,
)


class Goal(NamedTuple):
    """A place on the floor to be reached."""

    downhill: float
    right: float
    radius: float
    reached: bool = False


@dataclass(frozen=True, eq=False)
class Scene:
    """A walker on its slope at one instant, with the walk behind it and what it is asked to do.

    Parameters
    ----------
    parameters : WalkerParameters
    pose : Pose
        The walker now.
    footprints, headings, feet : shapes (n, 2) and (n,), and n of "left" or "right"
        Contact reference points so far, (downhill, right), in leg lengths, the last the stance foot's; heading of each, rad.
    path : shape (m, 2)
        The centre of mass so far, (downhill, right).
    commanded_heading : float, optional
        rad, positive to the left.
    goals : sequence of Goal
    reference_path : shape (k, 2), optional
        Line on the floor to be followed.
    lines : sequence of str
        A few words beside the picture; ``status_lines`` makes the usual ones.

    Raises
    ------
    ValueError
        If an array has another shape or holds what is not a finite number, or a foot or goal is none.
    """

    parameters: WalkerParameters
    pose: Pose
    footprints: Vector = field(default_factory=lambda: np.empty((0, 2)))
    headings: Vector = field(default_factory=lambda: np.empty(0))
    feet: Sequence[Foot] = ()
    path: Vector = field(default_factory=lambda: np.empty((0, 2)))
    commanded_heading: float | None = None
    goals: Sequence[Goal] = ()
    reference_path: Vector | None = None
    lines: Sequence[str] = ()

    def __post_init__(self) -> None:
        require_instance("parameters", self.parameters, WalkerParameters)
        require_instance("pose", self.pose, Pose)
        for name in ("feet", "goals", "lines"):
            if not isinstance(getattr(self, name), (list, tuple)):
                raise ValueError(f"{name} must be a sequence, got {getattr(self, name)!r}")
        footprints = require_array("footprints", self.footprints, (None, 2))
        headings = require_array("headings", self.headings, (len(footprints),))
        feet = tuple(require_foot(foot) for foot in self.feet)
        if len(feet) != len(footprints):
            raise ValueError(
                f"feet must hold {len(footprints)}, one per footprint, got {len(feet)}"
            )
        heading, line = self.commanded_heading, self.reference_path
        checked = {
            "footprints": footprints,
            "headings": headings,
            "feet": feet,
            "path": require_array("path", self.path, (None, 2)),
            "goals": tuple(_require_goal(goal) for goal in self.goals),
            "lines": tuple(str(line) for line in self.lines),
            "commanded_heading": None
            if heading is None
            else require_finite("commanded_heading", heading),
            "reference_path": None
            if line is None
            else require_array("reference_path", line, (None, 2)),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @property
    def heading(self) -> float:
        """Mean heading of the last two footprints, for left and right alternate, rad; the stance foot's if there are not two."""
        if len(self.headings) < 2:
            return float(self.pose.state[0])
        return float(self.headings[-2:].mean())


def status_lines(
    *,
    step: int,
    time: float,
    speed: float | None = None,
    heading: float | None = None,
    commanded_heading: float | None = None,
    status: str = "walking",
) -> tuple[str, ...]:
    """The usual words beside a walk's picture, the same from a film and an environment."""
    require_count("step", step, 0)
    numbers = {"time": time, "speed": speed, "heading": heading}
    for name, value in {**numbers, "commanded_heading": commanded_heading}.items():
        if value is not None or name == "time":
            require_finite(name, value)
    require_text("status", status)
    lines = [f"step {step}", f"time {time:.1f}"]
    if speed is not None:
        lines.append(f"speed {speed:.3f}")
    if heading is not None:
        lines.append(f"heading {heading:+.3f} rad")
    if commanded_heading is not None:
        lines.append(f"commanded {commanded_heading:+.3f} rad")
    return (*lines, status)


def _require_goal(goal: Goal) -> Goal:
    try:
        downhill, right, radius, reached = goal
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"a goal must be (downhill, right, radius, reached), got {goal!r}"
        ) from error
    return Goal(
        require_finite("goal's downhill", downhill),
        require_finite("goal's right", right),
        require_number("goal's radius", radius, 0.0, math.inf, "()"),
        bool(reached),
    )
