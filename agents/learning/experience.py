"""Experience discounted in time: a walking step's duration is the policy's choice, and must not change what a rate of reward is worth.

With one discount for every step, long or short, a rate of reward R is worth R times duration / (1 - discount): a policy gains by taking
longer steps at the same rate. With a discount of exp(-duration / time constant) for each step it is worth R times the time constant, whatever
the steps, since a step's reward, spread evenly over its duration, is discounted within the step too.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import torch
from numpy.typing import NDArray
from sb3_contrib.common.recurrent.buffers import RecurrentRolloutBuffer
from stable_baselines3.common.buffers import ReplayBuffer, RolloutBuffer
from stable_baselines3.common.type_aliases import DictReplayBufferSamples, ReplayBufferSamples
from stable_baselines3.common.vec_env import VecNormalize

from lean_yaw_env.envs.hindsight import HindsightReplay

from .recorder import Arrays, State, flattened


def mean_discount(ratio: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean of exp(-t / time constant) over steps of durations ``ratio`` times the time constant; 1 at its limit of no duration."""
    return np.where(ratio > 0.0, -np.expm1(-ratio) / np.where(ratio > 0.0, ratio, 1.0), 1.0)


class TimeDiscountedBuffer(RolloutBuffer):
    """Stable-Baselines3's rollout buffer with a discount of exp(-duration / time constant) for each step.

    ``durations`` (steps, walkers) must be filled while experience is collected; 0 where an episode ended.
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
        surprises = self.rewards * mean_discount(ratio) + discounts * values[1:] - values[:-1]
        advantage = np.zeros(self.n_envs)
        for step in reversed(range(self.buffer_size)):
            advantage = surprises[step] + discounts[step] * self.gae_lambda * advantage
            self.advantages[step] = advantage
        self.returns = self.advantages + self.values


class TimeDiscountedSequences(TimeDiscountedBuffer, RecurrentRolloutBuffer):
    """The same for sb3-contrib's rollout buffer, which keeps sequences and the states of the memory."""


class TimeDiscountedReplay(ReplayBuffer):
    """Stable-Baselines3's replay buffer with a discount of exp(-duration / time constant) for each step.

    An algorithm multiplies the next value by (1 - done) times its own discount. Here ``dones`` are therefore one less the step's discount,
    and the algorithm's own discount must be 1. ``durations`` (steps, walkers) must be filled before each ``add``; ``typical_duration`` stands
    in for the duration of an episode's last step, which the environment does not report once it has begun the next episode.
    """

    columns: ClassVar[tuple[str, ...]] = (
        "observations", "next_observations", "actions", "rewards", "dones", "timeouts", "durations",
    )  # fmt: skip

    def __init__(
        self, *arguments: Any, time_constant: float, typical_duration: float, **keywords: Any
    ) -> None:
        super().__init__(*arguments, **keywords)
        self.time_constant = time_constant
        self.typical_duration = typical_duration
        self.durations: NDArray[np.float64] = np.zeros((self.buffer_size, self.n_envs))

    def add(self, *step: Any) -> None:
        """Take a step of all walkers: observations, next observations, actions, rewards, whether episodes ended, and infos."""
        self.durations[self.pos][np.asarray(step[4], dtype=np.bool_)] = self.typical_duration
        super().add(*step)  # pyright: ignore[reportAttributeAccessIssue]

    def captured(self) -> Arrays:
        """The experience there is, and where the next goes; views."""
        filled = self.buffer_size if self.full else self.pos
        arrays = {name: column[:filled] for name, column in self._columns().items()}
        return arrays | {"position": np.array([self.pos, filled])}

    def restore(self, state: State) -> None:
        """Bring the buffer to what ``captured`` returned, or raise ``KeyError`` or ``ValueError`` if it is another buffer's."""
        arrays = flattened(state)
        self.pos, filled = (int(value) for value in arrays["position"])
        if not 0 <= self.pos < self.buffer_size or filled not in (self.pos, self.buffer_size):
            raise ValueError(
                f"position must be in the buffer of {self.buffer_size}, got {self.pos}"
            )
        self.full = filled == self.buffer_size
        for name, column in self._columns().items():
            column[:filled] = arrays[name]

    def _columns(self) -> Arrays:
        return flattened({name: getattr(self, name) for name in self.columns})

    def _get_samples(
        self, batch_inds: NDArray[np.int64], env: VecNormalize | None = None
    ) -> ReplayBufferSamples:
        walkers = np.random.randint(0, self.n_envs, len(batch_inds))  # noqa: NPY002 - as SB3 draws
        index = (batch_inds, walkers)
        ratio = self.durations[index] / self.time_constant
        fell = self.dones[index] * (1.0 - self.timeouts[index])
        cut = 1.0 - (1.0 - fell) * np.exp(-ratio)
        rewards = self._normalize_reward(self.rewards[index], env) * mean_discount(ratio)
        data = (
            np.asarray(self._normalize_obs(self.observations[index], env)),
            self.actions[index],
            np.asarray(self._normalize_obs(self.next_observations[index], env)),
            cut.astype(np.float32)[:, None],
            rewards.astype(np.float32)[:, None],
        )
        return ReplayBufferSamples(*(self.to_torch(array) for array in data))


class TimeDiscountedHindsight(TimeDiscountedReplay, HindsightReplay):
    """Hindsight replay, discounted in time: to be at a goal at the time t is worth exp(-t / time constant)."""

    columns: ClassVar[tuple[str, ...]] = (*TimeDiscountedReplay.columns, "ep_start", "ep_length")

    def captured(self) -> Arrays:
        """With the starts of the episodes under way."""
        return super().captured() | {"under_way": self._current_ep_start}

    def restore(self, state: State) -> None:
        """With the starts of the episodes under way."""
        super().restore(state)
        self._current_ep_start[:] = state["under_way"]

    def _get_real_samples(
        self, batch_indices: Any, env_indices: Any, env: VecNormalize | None = None
    ) -> DictReplayBufferSamples:
        samples = super()._get_real_samples(batch_indices, env_indices, env)
        return self._discounted(samples, batch_indices, env_indices)

    def _get_virtual_samples(
        self, batch_indices: Any, env_indices: Any, env: VecNormalize | None = None
    ) -> DictReplayBufferSamples:
        samples = super()._get_virtual_samples(batch_indices, env_indices, env)
        return self._discounted(samples, batch_indices, env_indices)

    def _discounted(
        self, samples: DictReplayBufferSamples, batch_indices: Any, env_indices: Any
    ) -> DictReplayBufferSamples:
        ratio = self.durations[batch_indices, env_indices] / self.time_constant
        discount = self.to_torch(np.exp(-ratio).astype(np.float32)).reshape(-1, 1)
        cut = 1.0 - (1.0 - samples.dones) * discount
        return samples._replace(dones=cut, rewards=samples.rewards * discount)
