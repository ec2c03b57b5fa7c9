"""The motion within a walking step, as pictures show it."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from lean_yaw_env.parameters import Vector
from lean_yaw_env.rendering.geometry import Pose
from lean_yaw_env.walker import Walker

SECONDS_PER_TIME_UNIT = 1.0 / math.sqrt(9.81)
"""sqrt(leg length / gravity) for legs of one metre on earth: real time."""
SWING_SHARE = 0.5
"""Share of a step in which the swing leg is drawn on its way; the model has it in front at once."""
_SAMPLES = 33  # per step; straight lines between them are wrong by less than 1e-4 leg lengths
_GRID = np.linspace(0.0, 1.0, _SAMPLES)


class StepMotion:
    """A walking step from heel strike to heel strike, or to a fall.

    Parameters
    ----------
    walker : Walker
    start : Pose
        Just after the heel strike, with the mass offset then in force, and the swing leg where it comes from.
    inter_leg_angle, mass_offset : float
        Commanded for this step.
    duration : float
        Of the step.
    swing_share : [0, 1]
        Share of the step in which the swing leg is drawn on its way to the front. The model has it there at once: massless, it acts on nothing.
    """

    def __init__(
        self,
        walker: Walker,
        start: Pose,
        *,
        inter_leg_angle: float,
        mass_offset: float,
        duration: float,
        swing_share: float = SWING_SHARE,
    ) -> None:
        self._walker, self._start = walker, start
        self._angles = start.inter_leg_angle, inter_leg_angle
        self._mass_offset = mass_offset
        self._swing_share = swing_share
        self.duration = max(duration, 1e-6)  # a fall at the start of a step lasts no time

    @cached_property
    def _samples(self) -> tuple[list[Vector], Vector]:
        """Stance pitch, ankle angle and mass offset, each (k,), and the centre of mass (k, 2); computed when the step is first drawn."""
        start = self._start
        motion = self._walker.stance_motion(
            start.state,
            duration=self.duration,
            samples=_SAMPLES,
            stance=start.stance,
            inter_leg_angle=self._angles[1],
            mass_offset=self._mass_offset,
            previous_offset=start.mass_offset,
        )
        cosine, sine = math.cos(start.state[0]), math.sin(start.state[0])
        ahead, right = motion["centre_x"], motion["centre_z"]
        turned = np.column_stack([cosine * ahead + sine * right, cosine * right - sine * ahead])
        columns = [motion[name] for name in ("stance_pitch", "ankle_angle", "mass_offset")]
        return columns, start.contact + turned

    def pose(self, share: float) -> Pose:
        """Where the walker is after a share of the step, from 0 to 1."""
        pitch, ankle, offset = (
            float(np.interp(share, _GRID, column)) for column in self._samples[0]
        )
        return Pose(
            state=np.array([self._start.state[0], pitch, ankle, 0.0, 0.0]),
            stance=self._start.stance,
            inter_leg_angle=self._inter_leg_angle(share),
            mass_offset=offset,
            contact=self._start.contact,
        )

    def path(self, share: float = 1.0) -> Vector:
        """The centre of mass so far, (downhill, right); shape (k, 2)."""
        return self._samples[1][: math.floor(share * (_SAMPLES - 1)) + 1]

    def _inter_leg_angle(self, share: float) -> float:
        """As drawn: from where the swing leg comes from to the front."""
        start, end = self._angles
        if share >= self._swing_share:
            return end
        s = share / self._swing_share
        return start + s * s * s * (10.0 + s * (6.0 * s - 15.0)) * (end - start)
