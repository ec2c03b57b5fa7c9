"""What an environment is made with: validated options, spaces, and the gait that episodes start near."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from gymnasium import spaces

from lean_yaw_env.analysis import find_gait
from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.tasks import Task
from lean_yaw_env.envs.transition import OBSERVATION_LIMIT
from lean_yaw_env.parameters import (
    INTER_LEG_ANGLE,
    QUARTER_TURN,
    STATE_FIELDS,
    Vector,
    WalkerParameters,
    require_number,
)
from lean_yaw_env.walker import Walker


@dataclass(frozen=True)
class EnvOptions:
    """An environment's constructor arguments, the same for one walker and for many.

    Parameters
    ----------
    parameters : WalkerParameters, optional
        The walker and its slope; the task's default otherwise.
    inter_leg_angle_range : [0, 0.3)
        What an action of 1 adds to the inter-leg angle of 0.3 rad.
    mass_offset_range : [0, 1]
        Mass offset that an action of 1 commands, in leg lengths.
    max_offset_change : [0, 2], optional
        Largest change of the offset in a step. The tasks on a slope keep it gentle, 0.005, as the paper does: larger ones let a
        policy power the walk by pumping.
    horizon : (0, inf], optional
        Simulated time after which an episode is truncated.
    start_disturbance : [0, 5]
        Scales the random deviations of the start (``transition.START_DEVIATIONS``); 0 starts exactly in the gait, on either foot.
    mirror : bool
        Show and command a right stance as its mirror image, so that a policy learns one foot.

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
        if not isinstance(self.mirror, (bool, np.bool_)):
            raise ValueError(f"mirror must be True or False, not {self.mirror!r}")

    def walker_parameters(self, task: Task) -> WalkerParameters:
        return task.parameters if self.parameters is None else self.parameters

    def settings(self, task: Task) -> Vector:
        """The options as the row of numbers that compiled steps read (``columns``).

        Raises
        ------
        NoGaitError
            If the walker has no gait to start from.
        """
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
        row[c.GAIT :] = gait_of(self.walker_parameters(task))
        return row

    def observation_names(self, task: Task) -> tuple[str, ...]:
        """What each number of an observation is."""
        foot = () if self.mirror else ("stance_foot",)
        return (*(field.name for field in STATE_FIELDS), "mass_offset", *foot, *task.features)

    def observation_space(self, task: Task) -> spaces.Box:
        size = len(self.observation_names(task))
        return spaces.Box(-OBSERVATION_LIMIT, OBSERVATION_LIMIT, (size,), np.float32)


ACTION_SIZE = 2


def action_space() -> spaces.Box:
    """Inter-leg angle and mass offset, each from -1 to 1; zero is the paper's fixed controller."""
    return spaces.Box(-1.0, 1.0, (ACTION_SIZE,), np.float32)


@lru_cache(maxsize=256)
def gait_of(parameters: WalkerParameters) -> tuple[float, ...]:
    """The walker's gait at the paper's command, on the left foot."""
    return tuple(find_gait(Walker(parameters)).tolist())
