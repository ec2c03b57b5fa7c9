"""Controllers that need no model of the walker: the paper's, which never acts, and one that acts at random."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.agent import State
from lean_yaw_env.envs.options import ACTION_SIZE


class FixedController:
    """The paper's controller: inter-leg angle 0.3, no mass offset, whatever happens."""

    def predict(
        self,
        observation: ArrayLike,
        state: State = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], State]:
        """Zero actions; see ``Agent.predict``."""
        return np.zeros(_action_shape(observation), dtype=np.float32), None


class RandomController:
    """Draws every action uniformly from the whole action space.

    Parameters
    ----------
    seed : int >= 0
        The same seed draws the same actions.
    """

    def __init__(self, seed: int = 0) -> None:
        self._generator = np.random.default_rng(seed)

    def predict(
        self,
        observation: ArrayLike,
        state: State = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[np.float32], State]:
        """Random actions, also if asked for deterministic ones; see ``Agent.predict``."""
        shape = _action_shape(observation)
        return self._generator.uniform(-1.0, 1.0, shape).astype(np.float32), None


def _action_shape(observation: ArrayLike) -> tuple[int, ...]:
    shape = np.shape(observation)
    if not shape:
        raise ValueError(f"observation must have shape (..., features), not {shape}")
    return (*shape[:-1], ACTION_SIZE)
