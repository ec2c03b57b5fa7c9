"""What an environment is made with: validated options, spaces, and the gait that episodes start near."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from lean_yaw_env.analysis import find_gait
from lean_yaw_env.envs.dynamics import ANKLE_PUSH, PITCH_PUSH
from lean_yaw_env.envs.observation import COMMON_NAMES, OBSERVATION_LIMIT, STANCE_FOOT
from lean_yaw_env.envs.reset import HELD_OUT_REACH
from lean_yaw_env.envs.state import BODY_NAMES, SETTINGS, Records
from lean_yaw_env.envs.tasks import Task
from lean_yaw_env.envs.tasks.task import BODY_DRAWS, TASK_RANGES, RandomBody
from lean_yaw_env.parameters import (
    INTER_LEG_ANGLE,
    PARAMETER_NAMES,
    PARAMETER_RANGES,
    Range,
    WalkerParameters,
)
from lean_yaw_env.validation import (
    require_choice,
    require_flag,
    require_instance,
    require_mapping,
    suggestion,
)
from lean_yaw_env.walker import Walker

_RANGES = (
    Range("inter_leg_angle_range", 0.0, INTER_LEG_ANGLE, "[)"),
    Range("mass_offset_range", 0.0, 1.0),
    Range("start_disturbance", 0.0, 5.0),
    Range("sensor_noise", 0.0, 10.0),
)
_OPTIONAL_RANGES = (
    *TASK_RANGES,
    *(limits for limits in PARAMETER_RANGES if limits.name in ("slope", "friction_limit")),
)
_NO_LIMIT = 2**62  # steps
_Value = TypeVar("_Value")


@dataclass(frozen=True)
class EnvOptions:
    """An environment's constructor arguments, the same for one walker and for many.

    No option changes the shape of actions. Two change the shape of observations: ``mirror=False`` adds the stance foot, ``show_body`` the body.

    Parameters
    ----------
    parameters : WalkerParameters or a mapping of their names to numbers, optional
        The walker and its slope; the task's default otherwise. A mapping can be kept as JSON with the environment's spec.
    slope : [-0.5, 0.5], optional
        In place of the parameters' slope, rad.
    friction_limit : (0, inf], optional
        In place of the parameters' limit: a step that demands more friction is a fall named slip.
    inter_leg_angle_range : [0, 0.3)
        What an action of 1 adds to the inter-leg angle of 0.3 rad.
    mass_offset_range : [0, 1]
        Mass offset that an action of 1 commands, in leg lengths.
    max_offset_change : [0, 2], optional
        Largest change of the offset in a step; the task's default otherwise. The tasks of steering down a slope keep it gentle, 0.005,
        as the paper does: larger ones let a policy power the walk by pumping.
    horizon : (0, inf], optional
        Simulated time after which an episode is truncated; the task's default otherwise.
    start_disturbance : [0, 5]
        Scales the random deviations of the start (``reset.START_DEVIATIONS``); 0 starts exactly in the gait, on either foot.
    mirror : bool
        Show and command a right stance as its mirror image, so that a policy learns one foot. Without, observations contain the stance foot.
    sensor_noise : [0, 10]
        Standard deviation of noise on every number observed but the stance foot, in units of the observation.
    action_delay : bool
        A step is walked by the action given one step before, the first by the gait's own command.
    hidden_rates : bool, optional
        Show both rates as zero. The task's default otherwise, mostly False.
    random_body : "nominal", "training" or "held-out", optional
        Draw hip width, foot radius, ankle tilt and slope anew for each episode, uniformly within the task's ``body_reach`` of the
        parameters' for training, or outside that box but within one 1.5 times as large. The start is near the parameters' own gait. ``info``
        contains the body, the observation does not. The task's default otherwise, mostly "nominal": the parameters' own body.
    show_body : bool
        Append hip width, foot radius, ankle tilt and slope to the observation: each less the parameters', divided by the task's ``body_reach``.
    push_level : [0, 10], optional
        Scales random impulses on both rates after every step; 1 is 0.08 on the pitch rate and 0.15 on the ankle rate (standard
        deviations). The observation, and the state in ``info``, are those after the push. The task's default otherwise, mostly 0.

    Raises
    ------
    ValueError
        If a value is outside its range.
    """

    parameters: WalkerParameters | Mapping[str, Any] | None = None
    inter_leg_angle_range: float = 0.15
    mass_offset_range: float = 0.05
    max_offset_change: float | None = None
    horizon: float | None = None
    start_disturbance: float = 1.0
    mirror: bool = True
    slope: float | None = None
    friction_limit: float | None = None
    sensor_noise: float = 0.0
    action_delay: bool = False
    hidden_rates: bool | None = None
    random_body: RandomBody | None = None
    show_body: bool = False
    push_level: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", _parameters(self.parameters))
        given = [limits for limits in _OPTIONAL_RANGES if getattr(self, limits.name) is not None]
        for limits in (*_RANGES, *given):
            limits.require(getattr(self, limits.name))
        for name in ("mirror", "action_delay", "show_body"):
            require_flag(name, getattr(self, name))
        if self.hidden_rates is not None:
            require_flag("hidden_rates", self.hidden_rates)
        if self.random_body is not None:
            require_choice("random_body", self.random_body, BODY_DRAWS)

    @classmethod
    def of(cls, arguments: Mapping[str, Any], others: Sequence[str] = ()) -> EnvOptions:
        """Options from an environment's keyword arguments, or ``TypeError`` naming one that there is not, and the nearest that there is.

        ``others`` are the environment's arguments that are no options; a misspelt one is among ``arguments``.
        """
        known = [field.name for field in fields(cls)]
        for name in require_mapping("arguments", arguments):
            if name not in known:
                raise TypeError(
                    f"unexpected keyword argument {name!r}{suggestion(name, [*known, *others])}"
                )
        return cls(**arguments)

    def for_task(self, task: Task) -> TaskOptions:
        """These options with the task's defaults in the place of None, and slope and friction limit among the parameters."""
        require_instance("task", task, Task)
        parameters = task.parameters if self.parameters is None else self.parameters
        assert isinstance(parameters, WalkerParameters)
        return TaskOptions(
            parameters=replace(
                parameters,
                slope=_given(self.slope, parameters.slope),
                friction_limit=_given(self.friction_limit, parameters.friction_limit),
            ),
            max_offset_change=_given(self.max_offset_change, task.max_offset_change),
            horizon=_given(self.horizon, task.horizon),
            push_level=_given(self.push_level, task.push_level),
            hidden_rates=_given(self.hidden_rates, task.hidden_rates),
            random_body=_given(self.random_body, task.random_body),
        )

    def walker_parameters(self, task: Task) -> WalkerParameters:
        """The walker and its slope; of random bodies, the middle."""
        return self.for_task(task).parameters

    def observation_names(self, task: Task) -> tuple[str, ...]:
        """What each number of an observation is."""
        common = COMMON_NAMES[:STANCE_FOOT] if self.mirror else COMMON_NAMES
        own = require_instance("task", task, Task).observed
        body = BODY_NAMES if self.show_body else ()
        return (*common, *(feature.name for feature in own), *body)

    def observation_space(self, task: Task) -> spaces.Space[NDArray[np.float32]]:
        """A box as large as ``observation_names``."""
        size = len(self.observation_names(task))
        box: Any = spaces.Box(-OBSERVATION_LIMIT, OBSERVATION_LIMIT, (size,), np.float32)
        return box


@dataclass(frozen=True)
class TaskOptions:
    """The options that have a default of each task's own, as they are in force."""

    parameters: WalkerParameters
    max_offset_change: float
    horizon: float
    push_level: float
    hidden_rates: bool
    random_body: RandomBody


def settings_of(
    options: EnvOptions, task: Task, *, max_episode_steps: int | None = None
) -> Records:
    """The record of settings (1,) that compiled steps read.

    Raises
    ------
    NoGaitError
        If the walker has no gait to start from.
    ValueError
        If the box of random bodies holds impossible ones.
    """
    own = options.for_task(task)
    record = np.zeros(1, SETTINGS)
    record["inter_leg_angle"] = INTER_LEG_ANGLE
    for name in (
        "inter_leg_angle_range", "mass_offset_range", "mirror", "action_delay", "sensor_noise",
        "start_disturbance", "show_body",
    ):  # fmt: skip
        record[name] = getattr(options, name)
    record["max_offset_change"] = own.max_offset_change
    record["horizon"] = own.horizon
    record["max_episode_steps"] = _NO_LIMIT if max_episode_steps is None else max_episode_steps
    record["hidden_heading"] = own.parameters.slope_turns
    record["pitch_push"] = own.push_level * PITCH_PUSH
    record["ankle_push"] = own.push_level * ANKLE_PUSH
    record["hidden_rates"] = own.hidden_rates
    record["random_body"] = BODY_DRAWS[own.random_body]
    record["body_centre"] = [getattr(own.parameters, name) for name in BODY_NAMES]
    record["body_reach"] = task.body_reach
    if own.random_body != "nominal":
        _require_body_box(own.parameters, task.body_reach)
    record["gait"] = gait_of(own.parameters, task.pumping)
    record["gait_offset"] = 0.0 - task.pumping
    return record


ACTION_SIZE = 2


def action_space() -> spaces.Space[NDArray[np.float32]]:
    """Inter-leg angle and mass offset, each from -1 to 1; zero is the paper's fixed controller."""
    box: Any = spaces.Box(-1.0, 1.0, (ACTION_SIZE,), np.float32)
    return box


@lru_cache(maxsize=256)
def gait_of(parameters: WalkerParameters, pumping: float = 0.0) -> tuple[float, ...]:
    """The walker's gait at the paper's inter-leg angle, on the left foot; with an offset away from the stance foot if it pumps.

    It is the gait on a floor that does not let the foot slip: a walker may start where its own floor does not let it go on.
    """
    offset = (pumping, -pumping) if pumping else 0.0
    walker = Walker(replace(parameters, friction_limit=math.inf))
    return tuple(find_gait(walker, mass_offset=offset).tolist())


def _given(value: _Value | None, default: _Value) -> _Value:
    return default if value is None else value


def _parameters(value: Any) -> WalkerParameters | None:
    if value is None or isinstance(value, WalkerParameters):
        return value
    if not isinstance(value, Mapping):
        raise ValueError(
            f"parameters must be WalkerParameters or a mapping of their names, got {value!r}"
        )
    for name in value:
        if name not in PARAMETER_NAMES:
            raise ValueError(f"parameters has no {name!r}{suggestion(name, PARAMETER_NAMES)}")
    return WalkerParameters(**value)


def _require_body_box(parameters: WalkerParameters, reach: tuple[float, ...]) -> None:
    """``ValueError`` unless all random bodies around these parameters are possible."""
    for name, deviation in zip(BODY_NAMES, reach, strict=True):
        value = getattr(parameters, name)
        for end in (value - HELD_OUT_REACH * deviation, value + HELD_OUT_REACH * deviation):
            try:
                replace(parameters, **{name: end})
            except ValueError as error:
                raise ValueError(
                    f"random_body: {name} within {HELD_OUT_REACH * deviation:g} of {value:g} leaves its range: {error}"
                ) from error
