"""Waypoint as a goal-conditioned environment, for learners that relabel goals in hindsight; one walker and many."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.utils import EzPickle
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.envs.tasks.waypoint import RADIUS
from lean_yaw_env.envs.tasks.waypointgoal import TASK
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.parameters import Vector

GOAL_SCALE = 8.0
"""Leg lengths that a goal's unit stands for; a power of two, so that scaling rounds nothing."""

GOAL_LIMIT = 1e6
"""Bound of a goal's numbers, beyond any walk: what is observed is never cut to it."""

GoalObservation = dict[str, NDArray[Any]]


class WaypointGoalEnv(WalkerEnv):
    """Waypoint with one goal an episode, in the dictionary layout of goal-conditioned learners such as SB3's ``HerReplayBuffer``.

    ## Observation space
    A dictionary of boxes:

    | key | shape | numbers |
    |---|---|---|
    | observation | (9,) float32 | the section state, the mass offset and the stance foot as in ``WalkerEnv`` with ``mirror=False``, then cosine and sine of the mean heading of the last two footprints |
    | achieved_goal | (2,) float64 | where the walker is: (downhill at the start, right) / 8 leg lengths |
    | desired_goal | (2,) float64 | where it should be, alike |

    ## Rewards and ends
    1 for the step that comes within 0.5 leg lengths of the goal, which ends the episode as a termination; 0 for any other. A fall is a
    termination too. The horizon is 150 units of time unless given.

    ``info["is_success"]`` tells whether the goal is reached.

    Parameters
    ----------
    render_mode : as ``WalkerEnv``
    **options
        See ``EnvOptions``; ``mirror`` is always False, as places do not change sides with the stance foot.

    Raises
    ------
    TypeError, ValueError, NoGaitError
        As ``WalkerEnv``.
    """

    def __init__(self, render_mode: str | None = None, **options: Any) -> None:
        super().__init__(TASK, render_mode, **_unmirrored(options))
        EzPickle.__init__(self, render_mode, **options)
        self.observation_space = _goal_space(self.observation_space)

    def reset(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[GoalObservation, dict[str, Any]]:
        """As ``WalkerEnv.reset``."""
        observation, info = super().reset(seed=seed, options=options)
        return self._conditioned(observation), info

    def step(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, action: ArrayLike
    ) -> tuple[GoalObservation, float, bool, bool, dict[str, Any]]:
        """Walk one step."""
        observation, *rest = super().step(action)
        return self._conditioned(observation), *rest  # pyright: ignore[reportReturnType]

    def compute_reward(
        self, achieved_goal: ArrayLike, desired_goal: ArrayLike, info: Any
    ) -> NDArray[np.float64]:
        """1 where the goal is reached, else 0.

        Parameters
        ----------
        achieved_goal, desired_goal : shape (..., 2)
        info : not looked at

        Returns
        -------
        shape (...)
        """
        return is_reached(achieved_goal, desired_goal).astype(np.float64)

    def compute_terminated(
        self, achieved_goal: ArrayLike, desired_goal: ArrayLike, info: Mapping[str, Any]
    ) -> NDArray[np.bool_]:
        """Whether the episode ends there: the goal is reached, or the walker has fallen."""
        return is_reached(achieved_goal, desired_goal) | (np.asarray(info["fall"]) != 0)

    def compute_truncated(
        self, achieved_goal: ArrayLike, desired_goal: ArrayLike, info: Mapping[str, Any]
    ) -> bool:
        """Whether the horizon of simulated time cuts the episode there."""
        horizon = float(self.simulation.settings["horizon"][0])
        ends = self.compute_terminated(achieved_goal, desired_goal, info)
        return bool(info["time"] >= horizon and not ends)

    def _conditioned(self, observation: NDArray[np.float32]) -> GoalObservation:
        goals = {key: goal[0] for key, goal in _goals(self.simulation).items()}
        return {"observation": observation, **goals}


class WaypointGoalVectorEnv(WalkerVectorEnv):
    """``num_envs`` walkers, bit for bit as so many ``WaypointGoalEnv`` seeded ``seed + i``; parameters as ``WalkerVectorEnv``."""

    def __init__(self, num_envs: int = 1, **arguments: Any) -> None:
        super().__init__(num_envs, TASK, **_unmirrored(arguments))
        EzPickle.__init__(self, num_envs, **arguments)
        self.single_observation_space = _goal_space(self.single_observation_space)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)

    def _observations(self) -> Any:
        return {"observation": super()._observations(), **_goals(self.simulation)}

    def _observation(self, row: int) -> Any:
        goals = {key: goal[row] for key, goal in _goals(self.simulation).items()}
        return {"observation": super()._observation(row), **goals}


def is_reached(achieved_goal: ArrayLike, desired_goal: ArrayLike) -> NDArray[np.bool_]:
    """Whether places (..., 2) are within the goal's radius, shape (...), as the task itself decides it."""
    apart = np.subtract(achieved_goal, desired_goal, dtype=np.float64)
    square = apart[..., 0] * apart[..., 0] + apart[..., 1] * apart[..., 1]
    return np.asarray(np.sqrt(square) <= RADIUS / GOAL_SCALE)


def _goals(simulation: Simulation) -> dict[str, Vector]:
    """Where walkers are and should be, each (n, 2)."""
    tasks = simulation.tasks
    return {
        "achieved_goal": _scaled(tasks["own_x"], tasks["own_z"]),
        "desired_goal": _scaled(tasks["goal_x"], tasks["goal_z"]),
    }


def _scaled(downhill: Vector, right: Vector) -> Vector:
    return np.stack([downhill, right], axis=1) / GOAL_SCALE


def _goal_space(observation: Any) -> Any:
    goal = spaces.Box(-GOAL_LIMIT, GOAL_LIMIT, (2,), np.float64)
    return spaces.Dict({"observation": observation, "achieved_goal": goal, "desired_goal": goal})


def _unmirrored(options: Mapping[str, Any]) -> dict[str, Any]:
    if options.get("mirror"):
        raise ValueError(f"mirror must be False with goals in space, got {options['mirror']!r}")
    return {**options, "mirror": False}
