"""What an environment's pictures need: the walks so far, kept only by environments that draw."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.envs.formulas import mean_heading
from lean_yaw_env.envs.info import FallCode
from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.parameters import Foot, Vector
from lean_yaw_env.rendering.filming import Frame
from lean_yaw_env.rendering.geometry import Pose, walker_shape
from lean_yaw_env.rendering.motion import SECONDS_PER_TIME_UNIT, StepMotion
from lean_yaw_env.rendering.pygame_renderer import Renderer
from lean_yaw_env.rendering.scene import Goal, Scene, status_lines
from lean_yaw_env.walker import Walker

STEPS_PER_SECOND = 4
"""Of a walker of a metre's leg at Table 1's gait: the rate of pictures of heel strikes alone."""
FRAMES_PER_SECOND = 30
"""Of pictures within the steps, in real time for legs of a metre."""
MOST_PICTURES = 64


class Footage:
    """One walker's walk so far, the first's by default, and scenes made of it."""

    def __init__(self, simulation: Simulation, row: int = 0) -> None:
        self._simulation = simulation
        self._row = row
        self._walker = Walker(simulation.body_parameters(row))
        self._footprints: list[Vector] = []
        self._headings: list[float] = []
        self._feet: list[Foot] = []
        self._goal_places: list[tuple[float, float]] = []
        self._motion: StepMotion | None = None
        pose = self._pose()
        self._path = walker_shape(self._walker.parameters, pose).centre[None, [0, 2]]
        self._set_down(pose)
        self._before = self._after = self._scene(pose)

    def extend(self) -> None:
        """Take in the step that the walker has just made."""
        walker, _ = self._simulation.records(self._row)
        fall = FallCode(int(walker.fall))
        stays = fall is FallCode.SOLVER  # the walker stands where the step began
        self._before = self._after
        self._motion = motion = StepMotion(
            self._walker,
            self._before.pose,
            inter_leg_angle=float(walker.inter_leg_angle),
            mass_offset=float(walker.commanded_offset),
            duration=0.0 if stays else float(walker.duration),
        )
        self._path = np.vstack([self._path, motion.path()])
        pose = motion.pose(1.0)
        if fall is FallCode.NONE:
            pose = self._pose()
            self._set_down(pose)
        self._after = self._scene(pose)

    @property
    def motion(self) -> StepMotion:
        """The motion within the last step; there is none before the first."""
        assert self._motion is not None, "the walk has not begun"
        return self._motion

    def scene(self, share: float = 1.0) -> Scene:
        """What there is to draw after a share of the last step: at 1, just after the heel strike or where the walker fell."""
        if share >= 1.0:
            return self._after
        path = np.vstack([self._before.path, self.motion.path(share)])
        return replace(self._before, pose=self.motion.pose(share), path=path)

    def shares(self) -> list[float]:
        """When in the last step a picture is due, ``FRAMES_PER_SECOND`` in real time, as shares of the step."""
        if self._motion is None:
            return [1.0]
        end = float(self._simulation.walkers["time"][self._row])
        rate, duration = FRAMES_PER_SECOND * SECONDS_PER_TIME_UNIT, self.motion.duration
        first, last = math.floor((end - duration) * rate) + 1, math.floor(end * rate)
        return [1.0 - (end - k / rate) / duration for k in range(first, last + 1)]

    def _set_down(self, pose: Pose) -> None:
        """Note the foot that now stands, and the goal if it is a new one."""
        self._footprints.append(pose.contact)
        self._headings.append(float(pose.state[0]))
        self._feet.append(pose.stance)
        fields = self._simulation.task.goal_fields
        if fields is not None:
            _, task = self._simulation.records(self._row)
            place = (float(task[fields[0]]), float(task[fields[1]]))
            if place not in self._goal_places[-1:]:
                self._goal_places.append(place)

    def _scene(self, pose: Pose) -> Scene:
        walker, task = self._simulation.records(self._row)
        kind = self._simulation.task
        command = None if kind.heading_field is None else float(task[kind.heading_field])
        time, fall = float(walker.time), FallCode(int(walker.fall)).word
        wanted = command  # or where the goal in force is from here, which may be beyond the picture
        if command is None and self._goal_places:
            downhill, right = np.subtract(self._goal_places[-1], self._path[-1])
            wanted = math.atan2(-right, downhill)
        reached = len(self._goal_places) - 1
        return Scene(
            parameters=self._walker.parameters,
            pose=pose,
            footprints=np.array(self._footprints),
            headings=np.array(self._headings),
            feet=tuple(self._feet),
            path=self._path,
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

    def _pose(self) -> Pose:
        """Just after a heel strike: both feet are on the floor."""
        walker, _ = self._simulation.records(self._row)
        return Pose(
            state=self._simulation.states[self._row].copy(),
            stance="left" if walker.side > 0.0 else "right",
            inter_leg_angle=-float(walker.inter_leg_angle),
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

    def walk(self, row: int = 0) -> Footage:
        """A walker's walk so far."""
        return self._walks[row]

    def frame(self, row: int = 0, share: float = 1.0) -> Frame:
        """The picture of a walker after a share of its last step, (height, width, 3)."""
        return self.renderer.frame(self._walks[row].scene(share))

    def frames(self) -> tuple[Frame, ...]:
        """A picture of each walker after its last step."""
        return tuple(self.frame(row) for row in sorted(self._walks))
