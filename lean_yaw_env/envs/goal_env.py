"""Waypoint as a goal-conditioned environment, for learners that relabel goals in hindsight."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.utils import EzPickle
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.tasks.waypoint import GOAL_X, GOAL_Z, RADIUS
from lean_yaw_env.envs.transition import OBSERVATION_LIMIT, STATE_CENTRES
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.parameters import Vector

GOAL_SCALE = 8.0
"""Leg lengths that a goal's unit stands for."""
HORIZON = 150.0
"""Units of time: enough for a half circle and the farthest goal, at the gait's speed, twice over."""
_OWN = len(STATE_CENTRES) + 2  # the section state, the offset in force, the stance foot

GoalObservation = dict[str, NDArray[np.float32]]


class WaypointGoalEnv(WalkerEnv):
    """Waypoint with one goal an episode, in the dictionary layout of goal-conditioned learners such as SB3's ``HerReplayBuffer``.

    ## Observation space
    A dictionary of boxes within [-10, 10]:

    | key | shape | numbers |
    |---|---|---|
    | observation | (9,) | the section state, the mass offset and the stance foot as in ``WalkerEnv`` with ``mirror=False``, then cosine and sine of the mean heading of the last two footprints |
    | achieved_goal | (2,) | where the walker is: (downhill at the start, right) / 8 leg lengths |
    | desired_goal | (2,) | where it should be, alike |

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
    ValueError, NoGaitError, SolverError
        As ``WalkerEnv``.
    """

    def __init__(self, render_mode: str | None = None, **options: Any) -> None:
        if options.get("mirror"):
            raise ValueError(f"mirror must be False with goals in space, not {options['mirror']!r}")
        super().__init__(
            "Waypoint", render_mode, **{"horizon": HORIZON, **options, "mirror": False}
        )
        EzPickle.__init__(self, render_mode, **options)
        box = {
            "observation": _OWN + 2,
            "achieved_goal": 2,
            "desired_goal": 2,
        }
        space: Any = spaces.Dict(
            {
                key: spaces.Box(-OBSERVATION_LIMIT, OBSERVATION_LIMIT, (size,), np.float32)
                for key, size in box.items()
            }
        )
        self.observation_space = space
        self._goal = np.zeros(2, dtype=np.float32)

    def reset(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[GoalObservation, dict[str, Any]]:
        """As ``WalkerEnv.reset``."""
        observation, info = super().reset(seed=seed, options=options)
        self._goal = _scaled(self.rows.memory[0, [GOAL_X, GOAL_Z]])
        return self._conditioned(observation), info | {"is_success": False}

    def step(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, action: ArrayLike
    ) -> tuple[GoalObservation, float, bool, bool, dict[str, Any]]:
        """Walk one step."""
        observation, _, fell, truncated, info = super().step(action)
        shown = self._conditioned(observation)
        reward = float(self.compute_reward(shown["achieved_goal"], shown["desired_goal"], info))
        reached = reward > 0.0 and not fell
        self._running = self._running and not reached
        ends = fell or reached
        return shown, float(reached), ends, truncated and not ends, info | {"is_success": reached}

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
        apart = np.subtract(achieved_goal, desired_goal, dtype=np.float64)
        return (np.linalg.norm(apart, axis=-1) <= RADIUS / GOAL_SCALE).astype(np.float64)

    def _conditioned(self, observation: NDArray[np.float32]) -> GoalObservation:
        memory = self.rows.memory[0]
        heading = 0.5 * (memory[c.HEADING] + memory[c.PREVIOUS_HEADING])
        direction = np.array([np.cos(heading), np.sin(heading)], dtype=np.float32)
        return {
            "observation": np.concatenate([observation[:_OWN], direction]),
            "achieved_goal": _scaled(_middle(memory)),
            "desired_goal": self._goal.copy(),
        }


def _middle(memory: Vector) -> Vector:
    """Where the walker is: see ``transition.middle_place``."""
    aside = 0.5 * memory[c.SIDE] * memory[c.BODY]
    heading = memory[c.HEADING]
    beside = aside * np.array([np.sin(heading), np.cos(heading)])
    return memory[[c.PLACE_X, c.PLACE_Z]] + beside


def _scaled(place: Vector) -> NDArray[np.float32]:
    limited = np.clip(place / GOAL_SCALE, -OBSERVATION_LIMIT, OBSERVATION_LIMIT)
    return limited.astype(np.float32)
