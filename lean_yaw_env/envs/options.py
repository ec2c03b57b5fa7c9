"""What an environment is made with: validated options, spaces, and the gait that episodes start near."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from lean_yaw_env.analysis import find_gait
from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.tasks import Task
from lean_yaw_env.envs.transition import (
    ANKLE_PUSH,
    BODY_DEVIATIONS,
    HELD_OUT,
    HELD_OUT_REACH,
    NOMINAL,
    OBSERVATION_LIMIT,
    PITCH_PUSH,
    TRAINING,
)
from lean_yaw_env.parameters import (
    INTER_LEG_ANGLE,
    PARAMETER_NAMES,
    QUARTER_TURN,
    STATE_FIELDS,
    Vector,
    WalkerParameters,
    require_number,
)
from lean_yaw_env.walker import Walker

RandomBody = Literal["training", "held-out"]
BODY_NAMES = PARAMETER_NAMES[: c.BODY_COLUMNS]
"""What a random body draws."""
_BODY_DRAWS: dict[str | None, float] = {None: NOMINAL, "training": TRAINING, "held-out": HELD_OUT}


@dataclass(frozen=True)
class EnvOptions:
    """An environment's constructor arguments, the same for one walker and for many. None changes the shape of actions or observations.

    Parameters
    ----------
    parameters : WalkerParameters, optional
        The walker and its slope; the task's default otherwise.
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
        Simulated time after which an episode is truncated.
    start_disturbance : [0, 5]
        Scales the random deviations of the start (``transition.START_DEVIATIONS``); 0 starts exactly in the gait, on either foot.
    mirror : bool
        Show and command a right stance as its mirror image, so that a policy learns one foot.
    sensor_noise : [0, 10]
        Standard deviation of noise on every number observed but the stance foot, in units of the observation.
    action_delay : bool
        A step is walked by the action given one step before, the first by the gait's own command.
    hidden_rates : bool
        Show both rates as zero.
    random_body : None, "training" or "held-out"
        Draw hip width, foot radius, ankle tilt and slope anew for each episode, uniformly within ``transition.BODY_DEVIATIONS`` of the
        parameters' for training, or outside that box but within one 1.5 times as large. The start is near the parameters' own gait; ``info``
        tells the body, the observation does not.
    push_level : [0, 10], optional
        Scales random impulses on both rates after every step; 1 is 0.08 on the pitch rate and 0.15 on the ankle rate (standard
        deviations). The observation, and the state in ``info``, are those after the push. The task's default otherwise, mostly 0.

    Raises
    ------
    ValueError
        If a value is outside its range.
    """

    parameters: WalkerParameters | None = None
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
    hidden_rates: bool = False
    random_body: RandomBody | None = None
    push_level: float | None = None

    def __post_init__(self) -> None:
        if self.parameters is not None and not isinstance(self.parameters, WalkerParameters):
            raise ValueError(f"parameters must be WalkerParameters, not {self.parameters!r}")
        least = min(INTER_LEG_ANGLE, QUARTER_TURN - INTER_LEG_ANGLE)
        require_number("inter_leg_angle_range", self.inter_leg_angle_range, 0.0, least, "[)")
        require_number("mass_offset_range", self.mass_offset_range, 0.0, 1.0)
        require_number("start_disturbance", self.start_disturbance, 0.0, 5.0)
        if self.max_offset_change is not None:
            require_number("max_offset_change", self.max_offset_change, 0.0, 2.0)
        if self.horizon is not None:
            require_number("horizon", self.horizon, 0.0, math.inf, "(]")
        if self.slope is not None:
            require_number("slope", self.slope, -0.5, 0.5)
        if self.friction_limit is not None:
            require_number("friction_limit", self.friction_limit, 0.0, math.inf, "(]")
        require_number("sensor_noise", self.sensor_noise, 0.0, 10.0)
        if self.push_level is not None:
            require_number("push_level", self.push_level, 0.0, 10.0)
        for name in ("mirror", "action_delay", "hidden_rates"):
            if not isinstance(getattr(self, name), (bool, np.bool_)):
                raise ValueError(f"{name} must be True or False, not {getattr(self, name)!r}")
        if not (self.random_body is None or isinstance(self.random_body, str)) or (
            self.random_body not in _BODY_DRAWS
        ):
            raise ValueError(
                f"random_body must be None, 'training' or 'held-out', not {self.random_body!r}"
            )

    def walker_parameters(self, task: Task) -> WalkerParameters:
        """The walker and its slope; of random bodies, the middle."""
        parameters = task.parameters if self.parameters is None else self.parameters
        if self.slope is not None:
            parameters = replace(parameters, slope=self.slope)
        if self.friction_limit is not None:
            parameters = replace(parameters, friction_limit=self.friction_limit)
        return parameters

    def settings(self, task: Task) -> Vector:
        """The options as the row of numbers that compiled steps read (``columns``).

        Raises
        ------
        NoGaitError
            If the walker has no gait to start from.
        ValueError
            If the box of random bodies holds impossible ones.
        """
        parameters = self.walker_parameters(task)
        push = task.push_level if self.push_level is None else self.push_level
        change = (
            task.max_offset_change if self.max_offset_change is None else self.max_offset_change
        )
        horizon = task.horizon if self.horizon is None else self.horizon
        row = np.zeros(c.SETTINGS)
        row[c.BASE_ANGLE] = INTER_LEG_ANGLE
        row[c.ANGLE_RANGE] = self.inter_leg_angle_range
        row[c.OFFSET_RANGE] = self.mass_offset_range
        row[c.OFFSET_CHANGE] = change
        row[c.HORIZON] = horizon
        row[c.MIRRORED] = 1.0 if self.mirror else 0.0
        row[c.DISTURBANCE] = self.start_disturbance
        row[c.BODY_DRAW] = _BODY_DRAWS[self.random_body]
        if self.random_body is not None:
            row[c.BODY_CENTRE : c.BODY_REACH] = _require_body_box(parameters)
            row[c.BODY_REACH : c.TASK_CONSTANTS] = BODY_DEVIATIONS
        row[c.GAIT : c.GAIT_OFFSET] = gait_of(parameters, task.pumping)
        row[c.GAIT_OFFSET] = 0.0 - task.pumping
        row[c.DELAYED] = self.action_delay
        row[c.NOISE] = self.sensor_noise
        row[c.HIDES_RATES] = self.hidden_rates
        row[c.HIDES_HEADING] = parameters.slope_turns
        row[c.PITCH_PUSH_SIZE] = push * PITCH_PUSH
        row[c.ANKLE_PUSH_SIZE] = push * ANKLE_PUSH
        row[c.TASK_CONSTANTS : c.TASK_CONSTANTS + len(task.constants)] = task.constants
        return row

    def observation_names(self, task: Task) -> tuple[str, ...]:
        """What each number of an observation is."""
        foot = () if self.mirror else ("stance_foot",)
        features = (feature.name for feature in task.features)
        return (*(field.name for field in STATE_FIELDS), "mass_offset", *foot, *features)

    def observation_space(self, task: Task) -> spaces.Space[NDArray[np.float32]]:
        size = len(self.observation_names(task))
        box: Any = spaces.Box(-OBSERVATION_LIMIT, OBSERVATION_LIMIT, (size,), np.float32)
        return box


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


def _require_body_box(parameters: WalkerParameters) -> tuple[float, ...]:
    """The middle of the random bodies, all of which must be possible."""
    middle = tuple(float(getattr(parameters, name)) for name in BODY_NAMES)
    for name, value, deviation in zip(BODY_NAMES, middle, BODY_DEVIATIONS, strict=True):
        for end in (value - HELD_OUT_REACH * deviation, value + HELD_OUT_REACH * deviation):
            try:
                replace(parameters, **{name: end})
            except ValueError as error:
                raise ValueError(
                    f"random_body: {name} within {HELD_OUT_REACH * deviation:g} of {value:g} leaves its range: {error}"
                ) from error
    return middle
