"""SAC on the compiled batch of walkers: its settings, its model, and its policy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from torch.optim import Optimizer

from lean_yaw_env.envs.options import ACTION_SIZE
from lean_yaw_env.validation import require_count, require_number

from .experience import TimeDiscountedReplay
from .learner import GAIT_STEP, LearnerSettings
from .recorder import State
from .stable_baselines import StableBaselinesLearner


@dataclass(frozen=True)
class SACSettings(LearnerSettings):
    """Settings of Stable-Baselines3's SAC, with those of ``LearnerSettings``; layers are rectified.

    Attributes
    ----------
    gradient_steps : updates after each step of all walkers
    batch_size : samples of one update
    buffer_size : steps that are remembered, over all walkers
    random_steps : steps of actions drawn evenly, before the first update
    target_rate : share of the critics that their slow copies take at each update
    target_entropy : of the actions before they are bounded, in nats; the entropy's weight is what keeps it there
    initial_entropy_weight : that weight at the start
    """

    steps: int = 300_000
    walkers: int = 64
    learning_rate: float = 1e-3
    final_learning_rate: float = 0.1
    gradient_steps: int = 8
    batch_size: int = 512
    buffer_size: int = 200_000
    random_steps: int = 4_096
    target_rate: float = 0.01
    target_entropy: float = -4.0
    initial_entropy_weight: float = 0.1

    @property
    def update_steps(self) -> int:
        return self.walkers

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require_counts("gradient_steps", "batch_size")
        self.require_counts("random_steps", low=0)
        require_count("buffer_size", self.buffer_size, self.walkers, 10**9)
        require_number("target_rate", self.target_rate, 0.0, 1.0, "(]")
        self.require_positive("initial_entropy_weight")
        require_number("target_entropy", self.target_entropy, -100.0, 100.0)


class EvenlyStarted(OffPolicyAlgorithm):
    """An algorithm whose first random actions come from numpy's shared generator, as all else does, so that they can be resumed."""

    def _sample_action(
        self, learning_starts: int, action_noise: Any = None, n_envs: int = 1
    ) -> tuple[NDArray[Any], NDArray[Any]]:
        if self.num_timesteps >= learning_starts:
            return super()._sample_action(learning_starts, action_noise, n_envs)
        drawn = np.random.uniform(-1.0, 1.0, (n_envs, ACTION_SIZE)).astype(np.float32)  # noqa: NPY002
        return drawn, drawn


class EvenlyStartedSAC(EvenlyStarted, SAC):
    """SB3's SAC, resumable."""


class SACLearner(StableBaselinesLearner):
    """SAC with a discount in time; see ``learner.Learner``.

    Its checkpoint holds the replay buffer too, some 90 bytes for each of ``buffer_size`` steps. Its actions are the hyperbolic
    tangent of what is drawn around the policy's last layer.
    """

    activation = "relu"
    output = "tanh"
    network = "MlpPolicy"
    algorithm: type[Any] = EvenlyStartedSAC
    replay: type[Any] = TimeDiscountedReplay
    model: Any

    def make_model(self, settings: SACSettings, **common: Any) -> BaseAlgorithm:
        return self.algorithm(
            self.network,
            buffer_size=settings.buffer_size,
            learning_starts=settings.random_steps,
            batch_size=settings.batch_size,
            tau=settings.target_rate,
            gamma=1.0,  # the buffer discounts
            train_freq=1,
            gradient_steps=settings.gradient_steps,
            ent_coef=f"auto_{settings.initial_entropy_weight}",
            target_entropy=settings.target_entropy,
            policy_kwargs=self.network_arguments(settings),
            replay_buffer_class=self.replay,
            replay_buffer_kwargs=self.replay_arguments(settings),
            **common,
        )

    def network_arguments(self, settings: Any) -> dict[str, Any]:
        """Arguments of the networks."""
        return {"net_arch": list(settings.hidden), "activation_fn": torch.nn.ReLU}

    def replay_arguments(self, settings: Any) -> dict[str, Any]:
        """Arguments of the replay buffer."""
        return {"time_constant": settings.time_constant, "typical_duration": GAIT_STEP}

    @property
    def buffer(self) -> TimeDiscountedReplay:
        return cast(TimeDiscountedReplay, self.model.replay_buffer)

    @property
    def optimizers(self) -> Mapping[str, Optimizer]:
        model = self.model
        assert model.ent_coef_optimizer is not None  # the entropy's weight is learnt
        return {
            "adam_actor": model.actor.optimizer,
            "adam_critic": model.critic.optimizer,
            "adam_entropy": model.ent_coef_optimizer,
        }

    def layers(self) -> dict[str, str]:
        """The actor's hidden layers, the one that gives the mean action, and the one that gives the deviation."""
        hidden = {f"layers.{k}": f"actor.latent_pi.{2 * k}" for k in range(self._depth)}
        return hidden | {f"layers.{self._depth}": "actor.mu", "log_std": "actor.log_std"}

    def capture(self) -> State:
        """With the replay buffer and the entropy's weight."""
        return {
            **super().capture(),
            "unnormalised": {"observations": self.model._last_original_obs},
            "replay": self.buffer.captured(),
            "log_entropy_weight": self._log_entropy_weight.detach(),
        }

    def restore(self, state: Any) -> None:
        """Bring the model to a captured state."""
        super().restore(state)
        self.model._last_original_obs = state["unnormalised"]["observations"]
        self.buffer.restore(state["replay"])
        with torch.no_grad():
            self._log_entropy_weight.copy_(torch.from_numpy(state["log_entropy_weight"]))

    @property
    def _log_entropy_weight(self) -> torch.Tensor:
        assert self.model.log_ent_coef is not None  # it is learnt
        return self.model.log_ent_coef
