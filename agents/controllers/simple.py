"""Controllers that need no linear model: the paper's, which never acts; one that acts at random; and proportional-derivative feedback."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.analysis.active_map import has_downhill
from lean_yaw_env.envs.options import ACTION_SIZE, EnvOptions, gait_of
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.parameters import STATE_FIELDS, Vector
from lean_yaw_env.validation import LARGEST_SEED, require_count, require_finite, require_instance

from ..agent import State
from ..observations import ObservationLayout, require_observation
from ..settings import tuned
from .gaits import Pumping

_ERROR = "heading_error"
_SPEED, _SPEED_ERROR = "commanded_speed", "speed_error"
_ANKLE = [field.name for field in STATE_FIELDS].index("ankle_angle")
_ANKLE_RATE = [field.name for field in STATE_FIELDS].index("ankle_rate")
_MIDDLE_SPEED = 0.42
"""Of the gait at the paper's inter-leg angle on the paper's slope."""


class MemorylessController:
    """A controller that answers from its observation alone; a subclass says how in ``_actions``."""

    def predict(
        self,
        observation: ArrayLike | Mapping[str, ArrayLike],
        state: State = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], State]:
        """Actions; see ``Agent.predict``. Nothing is remembered, and nothing drawn but by ``RandomController``."""
        return self._actions(observation), None

    def _actions(self, observation: Any) -> NDArray[np.float32]:
        raise NotImplementedError


class FixedController(MemorylessController):
    """The paper's controller: inter-leg angle 0.3, no mass offset, whatever happens.

    With a ``layout`` it refuses observations of another shape.
    """

    def __init__(self, layout: ObservationLayout | None = None) -> None:
        self._layout = layout

    def _actions(self, observation: Any) -> NDArray[np.float32]:
        return np.zeros(_action_shape(observation, self._layout), dtype=np.float32)


class RandomController(MemorylessController):
    """Draws every action uniformly from the whole action space, also if asked for deterministic ones.

    The same seed, a whole number from 0 on, draws the same actions. With a ``layout`` it refuses observations of another shape.
    """

    def __init__(self, seed: int = 0, layout: ObservationLayout | None = None) -> None:
        self._generator = np.random.default_rng(require_count("seed", seed, 0, LARGEST_SEED))
        self._layout = layout

    def _actions(self, observation: Any) -> NDArray[np.float32]:
        shape = _action_shape(observation, self._layout)
        return self._generator.uniform(-1.0, 1.0, shape).astype(np.float32)


def _action_shape(
    observation: ArrayLike | Mapping[str, ArrayLike], layout: ObservationLayout | None
) -> tuple[int, ...]:
    if layout is not None:
        seen = layout.require(observation)
    elif isinstance(observation, Mapping):
        own: Any = observation.get("observation", observation)
        seen = require_observation(own)
    else:
        seen = require_observation(observation)
    return (*seen.shape[:-1], ACTION_SIZE)


def as_actions(angle_change: Vector, offset: Vector, options: EnvOptions) -> NDArray[np.float32]:
    """Actions (..., 2) that mean changes of the inter-leg angle from 0.3 rad and mass offsets, of shape (...), as far as they reach."""
    actions = np.zeros((*np.shape(offset), ACTION_SIZE), dtype=np.float32)
    reaches = (options.inter_leg_angle_range, options.mass_offset_range)
    for k, (value, reach) in enumerate(zip((angle_change, offset), reaches, strict=True)):
        if reach > 0.0:
            actions[..., k] = value / reach
    return np.clip(actions, -1.0, 1.0)


@dataclass(frozen=True)
class HeadingGains:
    """Gains of ``HeadingFeedback``."""

    proportional: float = 0.051
    """Mass offset per rad of heading error."""
    ankle: float = -0.056
    """Mass offset per rad of the ankle's deviation from the gait. A walker turns as far as it leans, so that its lean is the rate of its heading,
    observed without a delay: the derivative term."""
    ankle_rate: float = 0.0104
    """The same per rad / time unit."""
    feedforward: float = 0.947
    """Share of the offset that holds the commanded heading."""
    inter_leg_angle: float = 0.106
    """Change of the inter-leg angle from 0.3, rad, held all the time. Longer steps are slower in time but lean, and so turn, faster."""
    speed: float = 0.0
    """Rad of inter-leg angle per commanded speed above 0.42."""
    speed_error: float = 0.0
    """Rad of inter-leg angle per speed that is lacking."""
    pumping: Pumping = field(default_factory=Pumping)
    """Offsets away from the stance foot that drive the walker beside the slope."""
    pumping_by_speed: float = 0.0
    """What is added to them per commanded speed above 0.42."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if name != "pumping":
                require_finite(name, value)
        require_instance("pumping", self.pumping, Pumping)


class HeadingFeedback(MemorylessController):
    """Steers to the commanded heading by moving the masses; sets a commanded speed by the inter-leg angle.

    The feedforward is the offset that holds a heading phi for good, sin(phi) = -mu / tan(slope); feedback is on the heading error
    and, as its derivative, on the lean of the ankle. Where the slope does not drive the walker, pumping does.

    Parameters
    ----------
    task : one that shows a heading error
    options : the environment's
    gains : those tuned for the task otherwise

    Raises
    ------
    ValueError
        If the task shows no heading error.
    NoGaitError
        If the walker has no gait to take the ankle's deviation from.
    """

    def __init__(
        self,
        task: str = "Heading",
        options: EnvOptions | None = None,
        gains: HeadingGains | None = None,
    ) -> None:
        self._options = EnvOptions() if options is None else options
        require_instance("options", self._options, EnvOptions)
        self._layout = ObservationLayout.of(task, self._options, needs=(_ERROR,))
        self._gains = tuned("feedback", task, HeadingGains()) if gains is None else gains
        require_instance("gains", self._gains, HeadingGains)
        parameters = self._options.walker_parameters(task_named(task))
        gait = gait_of(parameters, self._gains.pumping.downhill)
        self._gait_ankle, self._gait_ankle_rate = gait[_ANKLE], gait[_ANKLE_RATE]
        self._tangent = math.tan(parameters.slope)
        self._has_downhill = has_downhill(parameters)

    def _actions(self, observation: Any) -> NDArray[np.float32]:
        seen = self._layout.require(observation)
        return as_actions(self._angle_change(seen), self._offset(seen), self._options)

    def _angle_change(self, seen: NDArray[np.float32]) -> Vector:
        """How far from 0.3 rad the inter-leg angle is to be."""
        change = np.full(seen.shape[:-1], self._gains.inter_leg_angle)
        if _SPEED in self._layout.names:
            wanted = self._layout.quantity(seen, _SPEED)
            lacking = self._layout.quantity(seen, _SPEED_ERROR)
            change += self._gains.speed * (wanted - _MIDDLE_SPEED)
            change += self._gains.speed_error * lacking
        return change

    def _offset(self, seen: NDArray[np.float32]) -> Vector:
        """The mass offset to command, in the frame of the observation: mirrored where that is."""
        layout, gains = self._layout, self._gains
        error = layout.quantity(seen, _ERROR)
        heading = layout.quantity(seen, "heading")
        # in a mirrored observation the walker always stands on its left foot
        side = 1.0 if self._options.mirror else layout.quantity(seen, "stance_foot")
        ankle = layout.quantity(seen, "ankle_angle") - side * self._gait_ankle
        ankle_rate = layout.quantity(seen, "ankle_rate") - side * self._gait_ankle_rate
        holding = -self._tangent * np.sin(heading + error)
        from_downhill = heading if self._has_downhill else np.zeros_like(heading)
        pumped = gains.pumping.along(from_downhill)
        if _SPEED in layout.names:
            pumped += gains.pumping_by_speed * (layout.quantity(seen, _SPEED) - _MIDDLE_SPEED)
        return (
            gains.feedforward * holding
            - gains.proportional * error
            + gains.ankle * ankle
            + gains.ankle_rate * ankle_rate
            + side * pumped
        )
