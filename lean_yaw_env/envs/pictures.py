"""What an environment's pictures need: the walks so far, kept only by environments that draw."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

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


class _Instant(NamedTuple):
    """What a scene just after a heel strike, or after a fall, is made from: the pose, both records as they were, and what lay behind."""

    pose: Pose
    walker: Any
    task: Any
    footprints: int
    goals: int
    motions: int


class Footage:
    """One walker's walk so far, the first's by default, and scenes made of it.

    To take in a step only notes what has happened; the motion and the scene are made when they are asked for.
    """

    def __init__(self, simulation: Simulation, row: int = 0) -> None:
        self._simulation = simulation
        self._row = row
        self._parameters = simulation.body_parameters(row)
        self._footprints: list[Vector] = []
        self._headings: list[float] = []
        self._feet: list[Foot] = []
        self._goal_places: list[tuple[float, float]] = []
        self._motions: list[StepMotion] = []
        pose = self._pose()
        self._path = walker_shape(self._parameters, pose).centre[None, [0, 2]]
        self._path_ends = [1]  # rows of the path after so many steps, as far as it is made
        self._set_down(pose)
        self._before = self._after = self._instant(pose)

    def extend(self) -> None:
        """Take in the step that the walker has just made."""
        walker, _ = self._simulation.records(self._row)
        fall = FallCode(int(walker.fall))
        stays = fall is FallCode.SOLVER  # the walker stands where the step began
        self._before = self._after
        slope = float(self._before.walker.slope)
        motion = StepMotion(
            Walker(replace(self._parameters, slope=slope)),
            self._before.pose,
            inter_leg_angle=float(walker.inter_leg_angle),
            mass_offset=float(walker.commanded_offset),
            duration=0.0 if stays else float(walker.duration),
        )
        self._motions.append(motion)
        if fall is FallCode.NONE:
            pose = self._pose()
            self._set_down(pose)
        else:
            pose = motion.pose(1.0)
        self._after = self._instant(pose)

    @property
    def motion(self) -> StepMotion:
        """The motion within the last step; there is none before the first."""
        assert self._motions, "the walk has not begun"
        return self._motions[-1]

    def scene(self, share: float = 1.0) -> Scene:
        """What there is to draw after a share of the last step: at 1, just after the heel strike or where the walker fell."""
        if share >= 1.0:
            return self._scene(self._after)
        scene = self._scene(self._before)
        path = np.vstack([scene.path, self.motion.path(share)])
        return replace(scene, pose=self.motion.pose(share), path=path)

    def shares(self) -> list[float]:
        """When in the last step a picture is due, ``FRAMES_PER_SECOND`` in real time, as shares of the step."""
        if not self._motions:
            return [1.0]
        walker, _ = self._simulation.records(self._row)
        # the step across the horizon is shown to its end
        end = float(walker.time + (1.0 - walker.share) * walker.duration)
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

    def _instant(self, pose: Pose) -> _Instant:
        walker, task = (each.copy() for each in self._simulation.records(self._row))
        n_prints, n_goals = len(self._footprints), len(self._goal_places)
        return _Instant(pose, walker, task, n_prints, n_goals, len(self._motions))

    def _path_after(self, steps: int) -> Vector:
        """The centre of mass until so many steps were made, (downhill, right), shape (k, 2)."""
        made = len(self._path_ends) - 1
        if made < steps:
            new = [motion.path() for motion in self._motions[made:steps]]
            self._path = np.vstack([self._path, *new])
            self._path_ends += (
                self._path_ends[-1] + np.cumsum([len(each) for each in new])
            ).tolist()
        return self._path[: self._path_ends[steps]]

    def _scene(self, instant: _Instant) -> Scene:
        walker, task, kind = instant.walker, instant.task, self._simulation.task
        path, goals = self._path_after(instant.motions), self._goal_places[: instant.goals]
        command = None if kind.heading_field is None else float(task[kind.heading_field])
        time, fall = float(walker.time), FallCode(int(walker.fall)).word
        wanted = command  # or where the goal in force is from here, which may be beyond the picture
        if command is None and goals:
            downhill, right = np.subtract(goals[-1], path[-1])
            wanted = math.atan2(-right, downhill)
        return Scene(
            parameters=self._parameters,
            pose=instant.pose,
            footprints=np.array(self._footprints[: instant.footprints]),
            headings=np.array(self._headings[: instant.footprints]),
            feet=tuple(self._feet[: instant.footprints]),
            path=path,
            commanded_heading=wanted,
            goals=[
                Goal(*place, kind.goal_radius, reached=k < len(goals) - 1)
                for k, place in enumerate(goals)
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
