"""Linear-quadratic regulation of heading and speed: the optimal feedback of ``schedule``, from observations to actions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.envs.formulas import wrapped
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.parameters import INTER_LEG_ANGLE, MIRROR, STATE_FIELDS, Vector
from lean_yaw_env.validation import require_number

from ..observations import ObservationLayout
from ..settings import tuned
from .gaits import ANGLES, Pumping
from .schedule import LqrWeights, Scheduled, schedule_of
from .simple import MemorylessController, as_actions


@dataclass(frozen=True)
class LqrSettings:
    """Settings of the walker's inner loop; angles in rad."""

    weights: LqrWeights = field(default_factory=LqrWeights)
    inter_leg_angle: float = 0.4
    """Of the gait to regulate about on the wanted heading, where no speed is commanded."""
    turning_angle: float | None = None
    """Of the gait where the heading error is ``turning_error`` or more: long steps lean, and so turn, most. The same otherwise."""
    turning_error: float = 0.2
    largest_error: float = 1.4
    """Larger heading errors are taken as this one: a linear law knows no limits."""
    pumping: Pumping = field(default_factory=Pumping)
    """What drives the gait beside the slope."""

    def __post_init__(self) -> None:
        for name in ("inter_leg_angle", "turning_angle"):
            value = getattr(self, name)
            if value is not None:
                require_number(name, value, ANGLES[0], ANGLES[-1])
        for name in ("turning_error", "largest_error"):
            require_number(name, getattr(self, name), 0.0, math.pi, "(]")


class LqrLoop:
    """The inner loop: actions that bring the walker to a heading, and to a speed; ``options`` are the environment's.

    Raises
    ------
    NoGaitError
        If the walker has no gait to regulate about: none is without a slope or pumping.
    """

    def __init__(self, task: str, options: EnvOptions, settings: LqrSettings) -> None:
        made = task_named(task)
        self.layout = ObservationLayout.of(task, options)
        self.schedule = schedule_of(
            options.walker_parameters(made), settings.weights, settings.pumping
        )
        self.settings = settings
        self._options = options
        self._largest_change = options.for_task(made).max_offset_change

    def side(self, seen: NDArray[np.float32]) -> Vector:
        """+1 where the observation is as of a left stance, -1 where it is to be mirrored; shape (...)."""
        if self._options.mirror:
            return np.ones(seen.shape[:-1])
        return np.where(self.layout.quantity(seen, "stance_foot") < 0.0, -1.0, 1.0)

    def actions(
        self, seen: NDArray[np.float32], error: Vector, *, speed: Vector | None = None
    ) -> NDArray[np.float32]:
        """Actions for observations (..., features).

        The error, shape (...), is the wanted heading less the mean of the last two footprints', in the frame of the observation, rad; a wanted
        speed, shape (...), takes the place of the settings' inter-leg angles.
        """
        side = self.side(seen)
        state, offset = self._section_state(seen, side)
        error, heading = self._within_reach(side * error, state[..., 0])
        angle = self._angle(error) if speed is None else self.schedule.angles_of(speed, heading)
        gait = self.schedule.at(angle, heading)
        rest = _deviation(gait, state, offset)
        # feedback is on the last footprint's heading, half of the last turn ahead of the mean
        ahead = 0.5 * np.sum(gait.turn * rest, axis=-1)
        deviation = np.concatenate([(ahead - error)[..., None], rest], axis=-1)
        inputs = -np.einsum("...ij,...j->...i", gait.gain, deviation)
        # a gait that pumps moves the masses from one side to the other by itself
        change = 2.0 * gait.pumping + inputs[..., 1]
        change = np.clip(change, -self._largest_change, self._largest_change)
        angle = gait.inter_leg_angle + inputs[..., 0]
        return as_actions(angle - INTER_LEG_ANGLE, side * (offset + change), self._options)

    def last_turn(self, seen: NDArray[np.float32]) -> Vector:
        """How far the last step turned, as estimated from the state; in the frame of the observation, rad, shape (...)."""
        side = self.side(seen)
        state, offset = self._section_state(seen, side)
        gait = self.schedule.at(np.full(side.shape, self.settings.inter_leg_angle), state[..., 0])
        return side * np.sum(gait.turn * _deviation(gait, state, offset), axis=-1)

    def _within_reach(self, error: Vector, heading: Vector) -> tuple[Vector, Vector]:
        """The error that is answered, and the heading whose gait is regulated about."""
        largest = self.settings.largest_error
        error = np.clip(error, -largest, largest)
        if not self.schedule.has_downhill:
            return error, np.zeros_like(error)
        low, high = self.schedule.headings[[0, -1]]
        wanted = heading + error
        if high >= math.pi:
            return error, wrapped(wanted)
        # no gait is known beyond the schedule's headings
        wanted = np.clip(wanted, low, high)
        return wanted - heading, wanted

    def _angle(self, error: Vector) -> Vector:
        straight, turning = self.settings.inter_leg_angle, self.settings.turning_angle
        if turning is None:
            return np.full(np.shape(error), straight)
        share = np.minimum(np.abs(error) / self.settings.turning_error, 1.0)
        return straight + share * (turning - straight)

    def _section_state(self, seen: NDArray[np.float32], side: Vector) -> tuple[Vector, Vector]:
        """State and offset as of a left stance."""
        columns = [self.layout.quantity(seen, field.name) for field in STATE_FIELDS]
        state = np.stack(columns, axis=-1)
        state = np.where(side[..., None] < 0.0, MIRROR * state, state)
        return state, side * self.layout.quantity(seen, "mass_offset")


def _deviation(gait: Scheduled, state: Vector, offset: Vector) -> Vector:
    """(..., 5): state without heading, and offset, less the gait's; the masses are where the right foot's step left them."""
    before = gait.held_offset - gait.pumping
    rest = state[..., 1:] - gait.state[..., 1:]
    return np.concatenate([rest, (offset - before)[..., None]], axis=-1)


class Regulator(MemorylessController):
    """The common part of all tasks' regulators: the inner loop, and actions from the observation alone.

    Parameters
    ----------
    task : one that shows what the regulator needs
    options : the environment's
    settings : of the class ``Settings``; those that come with the package for the task otherwise

    Raises
    ------
    ValueError
        If the task does not show what is needed.
    NoGaitError
        If the walker has no gait to regulate about.
    """

    Settings: ClassVar[type[Any]] = LqrSettings
    needs: ClassVar[tuple[str, ...]] = ()

    def __init__(self, task: str, options: EnvOptions | None = None, settings: Any = None) -> None:
        chosen = EnvOptions() if options is None else options
        ObservationLayout.of(task, chosen, needs=self.needs)
        self.settings = tuned("lqr", task, self.Settings()) if settings is None else settings
        is_inner = isinstance(self.settings, LqrSettings)
        self.loop = LqrLoop(task, chosen, self.settings if is_inner else self.settings.loop)

    def _actions(self, observation: Any) -> NDArray[np.float32]:
        return self._regulated(self.loop.layout.require(observation))

    def _regulated(self, seen: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions for observations of the task's layout, shape (..., features)."""
        raise NotImplementedError


class HeadingLqr(Regulator):
    """Linear-quadratic regulator for tasks that command a heading, or a heading and a speed; see ``Regulator``."""

    needs = ("heading_error",)

    def _regulated(self, seen: NDArray[np.float32]) -> NDArray[np.float32]:
        layout, command = self.loop.layout, "commanded_speed"
        speed = layout.quantity(seen, command) if command in layout.names else None
        return self.loop.actions(seen, layout.quantity(seen, "heading_error"), speed=speed)


class UprightLqr(Regulator):
    """Linear-quadratic regulator for tasks that command nothing: it keeps the walker in its gait, straight downhill; see ``Regulator``."""

    def _regulated(self, seen: NDArray[np.float32]) -> NDArray[np.float32]:
        loop = self.loop
        # where the slope turns with the walker its heading is shown as zero, and any is as good
        mean = loop.layout.quantity(seen, "heading") - 0.5 * loop.last_turn(seen)
        return loop.actions(seen, -mean)
