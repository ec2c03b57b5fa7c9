"""Experience to learn from again and again, discounted in time."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.type_aliases import ReplayBufferSamples
from stable_baselines3.common.vec_env import VecNormalize

from agents.learning.checkpoint import Arrays

_COLUMNS = (
    "observations", "next_observations", "actions", "rewards", "dones", "timeouts", "durations",
)  # fmt: skip


class TimeDiscountedReplay(ReplayBuffer):
    """Stable-Baselines3's replay buffer with a discount of exp(-duration / time constant) for each step, and rewards spread over it.

    Why is said in ``rollouts``. What an algorithm multiplies the next value by is (1 - done) times its own discount, so that here ``dones``
    are one less the step's discount, and the algorithm's own must be 1.

    Parameters
    ----------
    time_constant : simulated time
    typical_duration : stands in for that of an episode's last step, which no environment tells once it has begun the next

    ``durations`` (steps, walkers) is to be filled before each ``add``.
    """

    def __init__(
        self, *arguments: Any, time_constant: float, typical_duration: float, **keywords: Any
    ) -> None:
        super().__init__(*arguments, **keywords)
        self.time_constant = time_constant
        self.typical_duration = typical_duration
        self.durations: NDArray[np.float64] = np.zeros((self.buffer_size, self.n_envs))

    def add(
        self,
        obs: NDArray[Any],
        next_obs: NDArray[Any],
        action: NDArray[Any],
        reward: NDArray[Any],
        done: NDArray[Any],
        infos: list[dict[str, Any]],
    ) -> None:
        """Take a step of all walkers."""
        self.durations[self.pos][np.asarray(done, dtype=np.bool_)] = self.typical_duration
        super().add(obs, next_obs, action, reward, done, infos)

    def captured(self) -> Arrays:
        """The experience there is, and where the next goes."""
        filled = self.buffer_size if self.full else self.pos
        arrays: Arrays = {name: getattr(self, name)[:filled] for name in _COLUMNS}
        return arrays | {"position": np.array([self.pos, filled])}

    def restore(self, arrays: Arrays) -> None:
        """Bring the buffer to what ``captured`` gave, or raise ``KeyError`` or ``ValueError`` if it is another buffer's."""
        self.pos, filled = (int(value) for value in arrays["position"])
        self.full = filled == self.buffer_size
        for name in _COLUMNS:
            getattr(self, name)[:filled] = arrays[name]

    def _get_samples(
        self, batch_inds: NDArray[np.int64], env: VecNormalize | None = None
    ) -> ReplayBufferSamples:
        walkers = np.random.randint(0, self.n_envs, len(batch_inds))  # noqa: NPY002 - as SB3 draws
        index = (batch_inds, walkers)
        ratio = self.durations[index] / self.time_constant
        fell = self.dones[index] * (1.0 - self.timeouts[index])
        cut = 1.0 - (1.0 - fell) * np.exp(-ratio)
        within = np.where(ratio > 0.0, -np.expm1(-ratio) / np.where(ratio > 0.0, ratio, 1.0), 1.0)
        rewards = self._normalize_reward(self.rewards[index], env) * within
        data = (
            np.asarray(self._normalize_obs(self.observations[index], env)),
            self.actions[index],
            np.asarray(self._normalize_obs(self.next_observations[index], env)),
            cut.astype(np.float32)[:, None],
            rewards.astype(np.float32)[:, None],
        )
        return ReplayBufferSamples(*(self.to_torch(array) for array in data))
