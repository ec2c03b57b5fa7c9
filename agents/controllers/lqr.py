"""Linear-quadratic regulation of heading and speed: the optimal feedback of ``regulator``, from observations to actions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.agent import State
from agents.controllers.regulator import ANGLES, LqrWeights, schedule_of
from agents.observations import ObservationLayout
from lean_yaw_env.envs.options import ACTION_SIZE, EnvOptions
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.parameters import INTER_LEG_ANGLE, MIRROR, STATE_FIELDS, Vector


@dataclass(frozen=True)
class LqrSettings:
    """Settings of the walker's inner loop.

    Attributes
    ----------
    weights : LqrWeights
    inter_leg_angle : rad
        Of the gait to regulate about, where no speed is commanded.
    largest_error : rad
        Larger heading errors are taken as this one: a linear law knows no limits.
    """

    weights: LqrWeights = field(default_factory=LqrWeights)
    inter_leg_angle: float = 0.4
    largest_error: float = 1.4

    def __post_init__(self) -> None:
        if not ANGLES[0] <= self.inter_leg_angle <= ANGLES[-1]:
            raise ValueError(
                f"inter_leg_angle must be in [{ANGLES[0]}, {ANGLES[-1]}], not {self.inter_leg_angle!r}"
            )
        if not 0.0 < self.largest_error <= math.pi:
            raise ValueError(f"largest_error must be in (0, pi], not {self.largest_error!r}")


class LqrLoop:
    """The inner loop: actions that bring the walker to a heading, and to a speed.

    Parameters
    ----------
    task : str
        Any task down a slope.
    options : EnvOptions
        Those of the environment.
    settings : LqrSettings

    Raises
    ------
    ValueError
        If the slope does not go down.
    NoGaitError
        If the walker has no gait down its slope.
    """

    def __init__(self, task: str, options: EnvOptions, settings: LqrSettings) -> None:
        made = task_named(task)
        parameters = options.walker_parameters(made)
        if parameters.slope <= 0.0:
            raise ValueError(
                f"slope must be above 0 for a gait to regulate about, not {parameters.slope!r} (task {task})"
            )
        self.layout = ObservationLayout.of(task, options)
        self.schedule = schedule_of(parameters, settings.weights)
        self.settings = settings
        self._options = options
        change = options.max_offset_change
        self._largest_change = made.max_offset_change if change is None else change

    def side(self, seen: NDArray[np.float32]) -> Vector:
        """+1 where the observation is as of a left stance, -1 where it is to be mirrored; shape (...)."""
        if self._options.mirror:
            return np.ones(seen.shape[:-1])
        return np.where(self.layout.quantity(seen, "stance_foot") < 0.0, -1.0, 1.0)

    def actions(
        self,
        seen: NDArray[np.float32],
        error: Vector,
        *,
        speed: Vector | None = None,
        inter_leg_angle: Vector | None = None,
    ) -> NDArray[np.float32]:
        """Actions for observations.

        Parameters
        ----------
        seen : shape (..., features)
        error : shape (...)
            Wanted heading less the mean of the last two footprints', in the frame of the observation, rad.
        speed : shape (...), optional
            Wanted; in place of the inter-leg angle.
        inter_leg_angle : shape (...), optional
            Of the gait to regulate about, rad; the settings' otherwise.
        """
        side, settings = self.side(seen), self.settings
        state = self._section_state(seen, side)
        offset = side * self.layout.quantity(seen, "mass_offset")
        error = np.clip(side * error, -settings.largest_error, settings.largest_error)
        heading = state[..., 0]
        if self.schedule.has_downhill:
            # no gait is known beyond the schedule's headings
            low, high = self.schedule.headings[[0, -1]]
            heading = np.clip(state[..., 0] + error, low, high)
            error = heading - state[..., 0]
        angle = np.full(error.shape, settings.inter_leg_angle)
        if inter_leg_angle is not None:
            angle = inter_leg_angle
        if speed is not None:
            angle = self.schedule.angles_of(speed, heading)
        gait, held, gains, turns = self.schedule.at(angle, heading)
        rest = np.concatenate([state - gait, (offset - held)[..., None]], axis=-1)[..., 1:]
        # feedback is on the last footprint's heading, half of the last turn ahead of the mean
        ahead = 0.5 * np.sum(turns * rest, axis=-1)
        deviation = np.concatenate([(ahead - error)[..., None], rest], axis=-1)
        inputs = -np.einsum("...ij,...j->...i", gains, deviation)
        change = np.clip(inputs[..., 1], -self._largest_change, self._largest_change)
        return self._as_actions(angle + inputs[..., 0], side * (offset + change))

    def last_turn(self, seen: NDArray[np.float32]) -> Vector:
        """How far the last step turned, as far as the state tells it; in the frame of the observation, rad, shape (...)."""
        side = self.side(seen)
        state = self._section_state(seen, side)
        offset = side * self.layout.quantity(seen, "mass_offset")
        angle = np.full(side.shape, self.settings.inter_leg_angle)
        gait, held, _, turns = self.schedule.at(angle, state[..., 0])
        rest = np.concatenate([state - gait, (offset - held)[..., None]], axis=-1)[..., 1:]
        return side * np.sum(turns * rest, axis=-1)

    def _section_state(self, seen: NDArray[np.float32], side: Vector) -> Vector:
        columns = [self.layout.quantity(seen, field.name) for field in STATE_FIELDS]
        state = np.stack(columns, axis=-1)
        return np.where(side[..., None] < 0.0, MIRROR * state, state)

    def _as_actions(self, angle: Vector, offset: Vector) -> NDArray[np.float32]:
        options = self._options
        actions = np.zeros((*np.shape(angle), ACTION_SIZE), dtype=np.float32)
        if options.inter_leg_angle_range > 0.0:
            actions[..., 0] = (angle - INTER_LEG_ANGLE) / options.inter_leg_angle_range
        if options.mass_offset_range > 0.0:
            actions[..., 1] = offset / options.mass_offset_range
        return np.clip(actions, -1.0, 1.0)


SPEED_SETTINGS = LqrSettings(
    LqrWeights(
        heading=0.18,
        ankle_angle=0.17,
        stance_pitch_rate=1.1,
        ankle_rate=0.11,
        inter_leg_angle=0.35,
        offset_change=0.0052,
    ),
    largest_error=0.76,
)
"""Where a speed is commanded as well."""


class HeadingLqr:
    """Linear-quadratic regulator for tasks that command a heading, or a heading and a speed. It remembers nothing.

    Parameters
    ----------
    task : str
    options : EnvOptions
        Those of the environment.
    settings : LqrSettings

    Raises
    ------
    ValueError
        If the task shows no heading error.
    NoGaitError
        If the walker has no gait down its slope.
    """

    def __init__(
        self,
        task: str = "Heading",
        options: EnvOptions | None = None,
        settings: LqrSettings | None = None,
    ) -> None:
        chosen = EnvOptions() if options is None else options
        names = ObservationLayout.of(task, chosen).names
        if "heading_error" not in names:
            raise ValueError(
                f"task must show heading_error for feedback on it, but {task!r} shows {', '.join(names)}"
            )
        self._has_speed = "commanded_speed" in names
        default = SPEED_SETTINGS if self._has_speed else LqrSettings()
        self.loop = LqrLoop(task, chosen, default if settings is None else settings)

    def predict(
        self,
        observation: ArrayLike,
        state: State = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], State]:
        """Actions of the regulator; see ``Agent.predict``."""
        layout = self.loop.layout
        seen = layout.require(observation)
        speed = layout.quantity(seen, "commanded_speed") if self._has_speed else None
        return self.loop.actions(seen, layout.quantity(seen, "heading_error"), speed=speed), None
