"""Hindsight experience replay on ``LeanYaw/WaypointGoal-v1`` with Stable-Baselines3: what its own parts leave out.

- ``HindsightReplay`` is SB3's ``HerReplayBuffer`` that gives a relabelled step not only a new reward but also a new end. Reaching the goal
  ends an episode. SB3 keeps the end of the original goal (its issue 627), so that values of relabelled steps count rewards after the goal;
  they grow beyond 1, the largest return there is.
- ``GoalFromWalker`` shows networks the goal's bearing and distance from the walker. What a network of plain layers learns last is to turn a
  place in the world into the walker's own frame.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3 import HerReplayBuffer
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.type_aliases import DictReplayBufferSamples
from stable_baselines3.common.vec_env import VecNormalize

from lean_yaw_env.envs.goal_env import seen_from_walker
from lean_yaw_env.validation import require_flag, require_instance


class HindsightReplay(HerReplayBuffer):
    """SB3's replay buffer for relabelled goals, of steps that end where their goal is reached or the walker falls."""

    def _get_virtual_samples(
        self,
        batch_indices: NDArray[np.int64],
        env_indices: NDArray[np.int64],
        env: VecNormalize | None = None,
    ) -> DictReplayBufferSamples:
        relabelled = super()._get_virtual_samples(batch_indices, env_indices, env)
        # an end that paid nothing was a fall, whatever the goal
        paid = self.to_torch(self.rewards[batch_indices, env_indices]).reshape(-1, 1)
        fell = relabelled.dones * (paid == 0.0)
        reached = relabelled.rewards * (1.0 - fell)
        return relabelled._replace(rewards=reached, dones=torch.maximum(fell, reached))


class GoalFromWalker(BaseFeaturesExtractor):
    """What ``WalkerEnv("WaypointGoal")`` observes, made from the dictionary of the goal-conditioned environment; see ``seen_from_walker``.

    Parameters
    ----------
    observation_space : of ``WaypointGoalEnv``
    mirror : bool
        As the environment's.
    """

    def __init__(self, observation_space: spaces.Dict, mirror: bool = True) -> None:
        require_flag("mirror", mirror)
        require_instance("observation_space", observation_space, spaces.Dict)
        zeros = {key: np.zeros(box.shape or ()) for key, box in observation_space.items()}
        super().__init__(observation_space, len(seen_from_walker(zeros, mirror=mirror)))
        self._mirror = mirror

    def forward(self, observations: dict[str, torch.Tensor]) -> Any:
        """Tensors (batch, features)."""
        return seen_from_walker(observations, mirror=self._mirror, xp=torch)
