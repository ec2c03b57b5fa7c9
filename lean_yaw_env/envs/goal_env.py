"""Waypoint as a goal-conditioned environment, for learners that relabel goals in hindsight; one walker and many."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.utils import EzPickle
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.envs.observation import OBSERVATION_LIMIT, STANCE_FOOT
from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.envs.tasks.waypoints import (
    BEARING_SCALE,
    DISTANCE_SCALE,
    RADIUS,
    WAYPOINT_GOAL,
)
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.validation import require_mapping, require_numbers

GOAL_SCALE = 8.0
"""Leg lengths that a goal's unit stands for; a power of two, so that scaling rounds nothing."""
GOAL_LIMIT = 1e6
"""Bound of a goal's numbers, beyond any walk: what is observed is never cut to it."""

_FOOT, _COSINE, _SINE, _SIZE = STANCE_FOOT, STANCE_FOOT + 1, STANCE_FOOT + 2, STANCE_FOOT + 3

GoalObservation = dict[str, NDArray[Any]]
Infos = Mapping[str, Any] | Sequence[Mapping[str, Any]] | NDArray[np.object_]
"""Infos of ``step``: of one walker, of many in one mapping of arrays, or of many one by one."""


class GoalRules:
    """What is paid and what ends an episode, from places and infos, as ``gymnasium_robotics.core.GoalEnv`` has it.

    ``achieved_goal`` and ``desired_goal`` have the shape (..., 2). With those that ``step`` returned, and its ``info``, the results are what
    ``step`` returned. ``info`` may be a mapping or a sequence of mappings; without the keys "fall" and "time" it tells of a walker that
    neither fell nor came to the horizon. A step that ends in a fall, or after the horizon, reaches nothing.
    """

    simulation: Simulation

    def compute_reward(
        self, achieved_goal: ArrayLike, desired_goal: ArrayLike, info: Infos
    ) -> NDArray[np.float64]:
        """1 where the goal is reached, else 0; shape (...)."""
        is_in_time = ~(_fell(info) | self._is_over(info))
        return (is_reached(achieved_goal, desired_goal) & is_in_time).astype(np.float64)

    def compute_terminated(
        self, achieved_goal: ArrayLike, desired_goal: ArrayLike, info: Infos
    ) -> NDArray[np.bool_]:
        """Whether the goal is reached or the walker has fallen; shape (...)."""
        is_paid = self.compute_reward(achieved_goal, desired_goal, info) > 0.0
        return np.asarray(is_paid | _fell(info))

    def compute_truncated(
        self, achieved_goal: ArrayLike, desired_goal: ArrayLike, info: Infos
    ) -> NDArray[np.bool_]:
        """Whether the horizon, or the largest number of steps, cuts the episode; shape (...)."""
        most = self.simulation.settings["max_episode_steps"][0]
        is_cut = self._is_over(info) | (_numbers(info, "steps") >= most)
        return np.asarray(is_cut & ~self.compute_terminated(achieved_goal, desired_goal, info))

    def _is_over(self, info: Infos) -> NDArray[np.bool_]:
        return _numbers(info, "time") >= self.simulation.settings["horizon"][0]


class WaypointGoalEnv(GoalRules, WalkerEnv):
    """Waypoint with one goal an episode, in the dictionary layout of goal-conditioned learners such as SB3's ``HerReplayBuffer``.

    ## Observation space
    A dictionary of boxes:

    | key | shape | numbers |
    |---|---|---|
    | observation | (9,) float32 | the section state, the mass offset and the stance foot as in ``WalkerEnv``, then cosine and sine of the mean heading of the last two footprints |
    | achieved_goal | (2,) float64 | where the walker is: (downhill at the start, right) / 8 leg lengths |
    | desired_goal | (2,) float64 | where it should be, alike |

    ``seen_from_walker`` makes of it what ``WalkerEnv("WaypointGoal")`` observes.

    ## Rewards and ends
    1 for the step that comes within 0.5 leg lengths of the goal, which ends the episode as a termination; 0 for any other. A fall is a
    termination too, and pays nothing wherever it happens. The horizon is 150 units of time unless given.

    ``info["is_success"]`` tells whether the goal is reached.

    Parameters
    ----------
    render_mode : as ``WalkerEnv``
    **options
        See ``EnvOptions``. With ``mirror``, state, offset and actions of a right stance are mirrored; places, the heading and the stance
        foot, which is always observed, are not.

    Raises
    ------
    TypeError, ValueError, NoGaitError
        As ``WalkerEnv``.
    """

    def __init__(self, render_mode: str | None = None, **options: Any) -> None:
        super().__init__(WAYPOINT_GOAL, render_mode, **options)
        EzPickle.__init__(self, render_mode, **options)
        self.observation_space = _goal_space()

    def reset(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[GoalObservation, dict[str, Any]]:
        """As ``WalkerEnv.reset``."""
        _, info = super().reset(seed=seed, options=options)
        return self._conditioned(), info

    def step(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, action: ArrayLike
    ) -> tuple[GoalObservation, float, bool, bool, dict[str, Any]]:
        """Walk one step."""
        _, *rest = super().step(action)
        return self._conditioned(), *rest  # pyright: ignore[reportReturnType]

    def _conditioned(self) -> GoalObservation:
        return {key: value[0] for key, value in _conditioned(self.simulation).items()}


class WaypointGoalVectorEnv(GoalRules, WalkerVectorEnv):
    """``num_envs`` walkers, bit for bit as so many ``WaypointGoalEnv`` seeded ``seed + i``; parameters as ``WalkerVectorEnv``."""

    def __init__(self, num_envs: int = 1, **arguments: Any) -> None:
        super().__init__(num_envs, WAYPOINT_GOAL, **arguments)
        EzPickle.__init__(self, num_envs, **arguments)
        self.single_observation_space = _goal_space()
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)

    def _observations(self) -> Any:
        return _conditioned(self.simulation)

    def _observation(self, row: int) -> Any:
        return {key: value[row] for key, value in _conditioned(self.simulation).items()}


def is_reached(achieved_goal: ArrayLike, desired_goal: ArrayLike) -> NDArray[np.bool_]:
    """Whether places (..., 2) are within the goal's radius, shape (...), as the task itself decides it."""
    achieved = require_numbers("achieved_goal", achieved_goal, 2)
    desired = require_numbers("desired_goal", desired_goal, 2)
    apart = achieved - desired
    square = apart[..., 0] * apart[..., 0] + apart[..., 1] * apart[..., 1]
    return np.asarray(np.sqrt(square) <= RADIUS / GOAL_SCALE)


def seen_from_walker(goal_observation: Mapping[str, Any], *, mirror: bool, xp: Any = np) -> Any:
    """What ``WalkerEnv("WaypointGoal")`` observes: the goal as bearing and distance from the walker, whichever goal it is.

    Parameters
    ----------
    goal_observation : arrays (..., 9), (..., 2) and (..., 2)
        Of ``WaypointGoalEnv``, made with the same ``mirror``; the goal may be another one than the environment's.
    mirror : bool
    xp : numpy, or torch if the arrays are tensors

    Returns
    -------
    shape (..., 8), or (..., 9) without ``mirror``, which shows the stance foot
    """
    own = goal_observation["observation"]
    apart = GOAL_SCALE * (goal_observation["desired_goal"] - goal_observation["achieved_goal"])
    downhill, right = apart[..., :1], apart[..., 1:]
    cosine, sine = own[..., _COSINE : _COSINE + 1], own[..., _SINE : _SINE + 1]
    ahead = downhill * cosine - right * sine
    left = -downhill * sine - right * cosine
    bearing = xp.arctan2(left, ahead)
    if mirror:
        bearing = own[..., _FOOT : _FOOT + 1] * bearing
    distance = xp.hypot(downhill, right)
    numbers = [
        own[..., : _FOOT if mirror else _FOOT + 1],
        bearing / BEARING_SCALE,
        xp.clip(distance / DISTANCE_SCALE, 0.0, OBSERVATION_LIMIT),
    ]
    return xp.concatenate([each.astype(np.float32) if xp is np else each for each in numbers], -1)


def _conditioned(simulation: Simulation) -> GoalObservation:
    """The observations of all walkers: (n, 9), (n, 2) and (n, 2)."""
    tasks = simulation.tasks
    own = np.empty((simulation.n, _SIZE), dtype=np.float32)
    own[:, :_FOOT] = simulation.observations[:, :_FOOT]
    own[:, _FOOT] = simulation.walkers["side"]
    own[:, _COSINE] = tasks["heading_cosine"]
    own[:, _SINE] = tasks["heading_sine"]
    return {
        "observation": own,
        "achieved_goal": np.stack([tasks["own_x"], tasks["own_z"]], axis=1) / GOAL_SCALE,
        "desired_goal": np.stack([tasks["goal_x"], tasks["goal_z"]], axis=1) / GOAL_SCALE,
    }


def _goal_space() -> Any:
    own = spaces.Box(-OBSERVATION_LIMIT, OBSERVATION_LIMIT, (_SIZE,), np.float32)
    goal = spaces.Box(-GOAL_LIMIT, GOAL_LIMIT, (2,), np.float64)
    return spaces.Dict({"observation": own, "achieved_goal": goal, "desired_goal": goal})


def _fell(info: Infos) -> NDArray[np.bool_]:
    return _numbers(info, "fall") != 0


def _numbers(info: Infos, key: str) -> NDArray[Any]:
    """A number of each info; 0 where there is none."""
    if isinstance(info, Mapping):
        return np.asarray(info.get(key, 0))
    if not isinstance(info, (list, tuple, np.ndarray)):
        raise ValueError(f"info must be a mapping, or a sequence of them, got {info!r}")
    return np.array([require_mapping("info", each).get(key, 0) for each in info])
