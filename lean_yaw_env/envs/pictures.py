"""What an environment's pictures need: the walks so far, kept only by environments that draw."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.envs.formulas import mean_heading
from lean_yaw_env.envs.info import FallCode
from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.parameters import Foot, Vector
from lean_yaw_env.rendering.geometry import Pose, walker_shape
from lean_yaw_env.rendering.pygame_renderer import Renderer
from lean_yaw_env.rendering.scene import Goal, Scene, status_lines

RENDER_FPS = 4
"""Walking steps per second of a video: near a walker of a metre's leg at Table 1's gait."""
MOST_PICTURES = 64


class Footage:
    """Footprints and the centre of mass's path of one walker, the first by default, and scenes made of them."""

    def __init__(self, simulation: Simulation, row: int = 0) -> None:
        self._simulation = simulation
        self._row = row
        self._footprints: list[tuple[float, float]] = []
        self._headings: list[float] = []
        self._feet: list[Foot] = []
        self._path: list[Vector] = []
        self._goal_places: list[tuple[float, float]] = []
        self.extend()

    def extend(self) -> None:
        """Take in the step that the walker has just made."""
        walker, task = self._simulation.records(self._row)
        pose = self._pose(walker)
        self._footprints.append((float(walker.place_x), float(walker.place_z)))
        self._headings.append(float(walker.heading))
        self._feet.append(pose.stance)
        centre = walker_shape(self._simulation.body_parameters(self._row), pose).centre
        self._path.append(centre[[0, 2]])
        fields = self._simulation.task.goal_fields
        if fields is not None:
            place = (float(task[fields[0]]), float(task[fields[1]]))
            if place not in self._goal_places[-1:]:
                self._goal_places.append(place)

    def scene(self, fall: str | None) -> Scene:
        """What there is to draw; ``fall`` names how the walk ended, if it did."""
        walker, task = self._simulation.records(self._row)
        kind = self._simulation.task
        command = None if kind.heading_field is None else float(task[kind.heading_field])
        time = float(walker.time)
        wanted = command  # or where the goal in force is from here, which may be beyond the picture
        if command is None and self._goal_places:
            downhill, right = np.subtract(self._goal_places[-1], self._path[-1])
            wanted = math.atan2(-right, downhill)
        reached = len(self._goal_places) - 1
        return Scene(
            parameters=self._simulation.body_parameters(self._row),
            pose=self._pose(walker),
            footprints=np.array(self._footprints),
            headings=np.array(self._headings),
            feet=tuple(self._feet),
            path=np.array(self._path),
            commanded_heading=wanted,
            goals=[
                Goal(*place, kind.goal_radius, reached=k < reached)
                for k, place in enumerate(self._goal_places)
            ],
            reference_path=None
            if kind.reference_path is None
            else kind.reference_path(walker, task),
            lines=status_lines(
                step=int(walker.steps),
                time=time,
                speed=float(walker.distance) / time if time > 0.0 else None,
                heading=float(mean_heading(walker)),
                commanded_heading=command,
                status="walking" if fall is None else f"fell {fall}",
            ),
        )

    def _pose(self, walker: Any) -> Pose:
        return Pose(
            state=self._simulation.states[self._row].copy(),
            stance="left" if walker.side > 0.0 else "right",
            inter_leg_angle=float(walker.inter_leg_angle),
            mass_offset=float(walker.mass_offset),
            contact=np.array([walker.place_x, walker.place_z]),
        )


class Gallery:
    """Pictures of each of a simulation's walkers.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        If pygame is not installed.
    """

    def __init__(self, simulation: Simulation, renderer: Renderer) -> None:
        self.renderer = renderer
        self._simulation = simulation
        self._walks: dict[int, Footage] = {}

    def restart(self, mask: NDArray[np.bool_]) -> None:
        """Forget the walks of these walkers, whose episodes have just begun."""
        for row in np.flatnonzero(mask).tolist():
            self._walks[row] = Footage(self._simulation, row)

    def extend(self, mask: NDArray[np.bool_]) -> None:
        """Take in the step that these walkers have just made."""
        for row in np.flatnonzero(mask).tolist():
            self._walks[row].extend()

    def scene(self, row: int) -> Scene:
        """What there is to draw of a walker."""
        return self._walks[row].scene(FallCode(self._simulation.falls[row]).word)

    def frames(self) -> tuple[NDArray[np.uint8], ...]:
        """A picture of each walker, (height, width, 3)."""
        return tuple(self.renderer.frame(self.scene(row)) for row in sorted(self._walks))
