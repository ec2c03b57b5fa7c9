"""Experience discounted in time: a walking step's length is the policy's choice, and must not be paid for."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.buffers import RolloutBuffer


class TimeDiscountedBuffer(RolloutBuffer):
    """Stable-Baselines3's rollout buffer with a discount of exp(-duration / time constant) for each step.

    With one discount for every step, long or short, a rate of reward R earns R times duration / (1 - discount): a policy gains by taking
    longer steps at the same rate. Here it earns R times the time constant, whatever the steps, since a step's reward, spread evenly
    over its duration, is discounted within the step too.

    ``durations`` (steps, walkers) is to be filled while experience is collected; 0 where an episode ended.
    """

    time_constant: float
    durations: NDArray[np.float64]

    def __init__(self, *arguments: Any, time_constant: float, **keywords: Any) -> None:
        self.time_constant = time_constant
        super().__init__(*arguments, **keywords)

    def reset(self) -> None:
        """Empty the buffer."""
        super().reset()
        self.durations = np.zeros((self.buffer_size, self.n_envs))

    def compute_returns_and_advantage(
        self, last_values: torch.Tensor, dones: NDArray[np.bool_]
    ) -> None:
        """Generalised advantage estimates (Schulman et al. 2016), with each step's own discount."""
        values = np.vstack([self.values, last_values.cpu().numpy().reshape(1, -1)])
        goes_on = 1.0 - np.vstack([self.episode_starts[1:], np.asarray(dones).reshape(1, -1)])
        ratio = self.durations / self.time_constant
        discounts = np.exp(-ratio) * goes_on
        # mean of exp(-t / time constant) over the step; 1 at its limit of no duration
        within = np.where(ratio > 0.0, -np.expm1(-ratio) / np.where(ratio > 0.0, ratio, 1.0), 1.0)
        surprises = self.rewards * within + discounts * values[1:] - values[:-1]
        advantage = np.zeros(self.n_envs)
        for step in reversed(range(self.buffer_size)):
            advantage = surprises[step] + discounts[step] * self.gae_lambda * advantage
            self.advantages[step] = advantage
        self.returns = self.advantages + self.values
