"""What an agent is: anything with Stable-Baselines3's ``predict``."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

State = tuple[NDArray[Any], ...] | None
"""What an agent remembers from one call to the next; None for no memory."""


class Agent(Protocol):
    """Chooses actions from observations, for one walker or any batch of them."""

    def predict(
        self,
        observation: ArrayLike,
        state: State = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], State]:
        """Choose actions.

        Parameters
        ----------
        observation : shape (..., features), as the environment gives it
        state : what the last call returned; None at first
        episode_start : shape (...); where a new episode begins, and the memory of the last one is dropped
        deterministic : take the best action rather than draw one

        Returns
        -------
        actions, shape (..., 2), in [-1, 1], and the new state
        """
        ...


@runtime_checkable
class Planner(Protocol):
    """An agent that needs the environment itself, to try plans on."""

    def attach(self, env: Any) -> None:
        """Act in this environment from now on; called before the first ``predict``."""
        ...


def attach(agent: Agent, env: Any) -> None:
    """Give an agent the environment that it is about to act in, if it needs it."""
    if isinstance(agent, Planner):
        agent.attach(env)
