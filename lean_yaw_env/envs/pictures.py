"""What an environment's pictures need: the walk so far, kept only by environments that draw."""

from __future__ import annotations

import math

import numpy as np

from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.rows import WalkerRows
from lean_yaw_env.parameters import STATE_SIZE, Foot, Vector
from lean_yaw_env.rendering.geometry import Pose, walker_shape
from lean_yaw_env.rendering.scene import Goal, Scene, status_lines


class Footage:
    """Footprints and the centre of mass's path of row 0, and scenes made of them."""

    def __init__(self, rows: WalkerRows) -> None:
        self._rows = rows
        self.restart()

    def restart(self) -> None:
        self._footprints: list[Vector] = []
        self._headings: list[float] = []
        self._feet: list[Foot] = []
        self._path: list[Vector] = []
        self._goal_places: list[tuple[float, float]] = []
        self.extend()

    def extend(self) -> None:
        """Take in the step that row 0 has just made."""
        memory = self._rows.memory[0]
        self._footprints.append(memory[[c.PLACE_X, c.PLACE_Z]])
        self._headings.append(float(memory[c.HEADING]))
        self._feet.append(self._foot())
        centre = walker_shape(self._rows.body_parameters(0), self._pose()).centre
        self._path.append(centre[[0, 2]])
        columns = self._rows.task.goal_columns
        if columns is not None:
            place = (float(memory[columns[0]]), float(memory[columns[1]]))
            if place not in self._goal_places[-1:]:
                self._goal_places.append(place)

    def scene(self, fall: str | None) -> Scene:
        memory = self._rows.memory[0]
        task = self._rows.task
        column = task.command_column
        command = None if column is None else float(memory[column])
        return Scene(
            parameters=self._rows.body_parameters(0),
            pose=self._pose(),
            footprints=np.array(self._footprints),
            headings=np.array(self._headings),
            feet=tuple(self._feet),
            path=np.array(self._path),
            commanded_heading=self._goal_direction() if command is None else command,
            goals=self._goals(),
            reference_path=None if task.reference_path is None else task.reference_path(memory),
            lines=status_lines(
                step=int(memory[c.STEPS]),
                time=float(memory[c.TIME]),
                speed=float(memory[c.DISTANCE] / memory[c.TIME]) if memory[c.TIME] > 0.0 else None,
                heading=float(0.5 * (memory[c.HEADING] + memory[c.PREVIOUS_HEADING])),
                commanded_heading=command,
                status="walking" if fall is None else f"fell {fall}",
            ),
        )

    def _goal_direction(self) -> float | None:
        """Where the goal in force is from here, which may be beyond the picture."""
        if not self._goal_places:
            return None
        downhill, right = np.subtract(self._goal_places[-1], self._path[-1])
        return math.atan2(-right, downhill)

    def _goals(self) -> list[Goal]:
        """The goals reached so far, and the one in force."""
        return [
            Goal(x, z, self._rows.task.goal_radius, reached=k < len(self._goal_places) - 1)
            for k, (x, z) in enumerate(self._goal_places)
        ]

    def _foot(self) -> Foot:
        return "left" if self._rows.memory[0, c.SIDE] > 0.0 else "right"

    def _pose(self) -> Pose:
        memory = self._rows.memory[0]
        return Pose(
            state=memory[:STATE_SIZE].copy(),
            stance=self._foot(),
            inter_leg_angle=float(memory[c.INTER_LEG_ANGLE]),
            mass_offset=float(memory[c.OFFSET]),
            contact=memory[[c.PLACE_X, c.PLACE_Z]],
        )
