"""PPO on the compiled batch of walkers: its settings, its model, and its policy."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from torch.optim import Optimizer

from lean_yaw_env.validation import require_number

from .experience import TimeDiscountedBuffer
from .learner import LearnerSettings, float_array
from .stable_baselines import StableBaselinesLearner, TimedBuffer


@dataclass(frozen=True)
class PPOSettings(LearnerSettings):
    """Settings of Stable-Baselines3's PPO, with those of ``LearnerSettings``; layers are tanh.

    Attributes
    ----------
    steps_per_update : steps of each walker between two updates of the policy
    batch_size : samples of one gradient step
    epochs : passes over the samples of an update
    gae_lambda : of the generalised advantage estimate
    clip_range : of the policy's ratio
    entropy : weight of the entropy bonus
    value_weight : weight of the value's loss
    largest_gradient : norm that gradients are clipped to
    initial_log_std : logarithm of the standard deviation of actions at the start
    frames : latest observations that the networks see; 1 sees no memory
    """

    steps: int = 2_000_000
    walkers: int = 256
    steps_per_update: int = 128
    batch_size: int = 2048
    epochs: int = 4
    gae_lambda: float = 0.9
    clip_range: float = 0.2
    entropy: float = 0.0
    value_weight: float = 0.5
    largest_gradient: float = 0.5
    initial_log_std: float = -0.5
    frames: int = 1

    @property
    def update_steps(self) -> int:
        return self.walkers * self.steps_per_update

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require_counts("steps_per_update", "batch_size", "epochs", "frames")
        self.require_shares("gae_lambda")
        self.require_positive("clip_range", "largest_gradient")
        for name in ("entropy", "value_weight"):
            require_number(name, getattr(self, name), 0.0, math.inf, "[)")
        require_number("initial_log_std", self.initial_log_std, -20.0, 2.0)
        if self.update_steps % self.batch_size:
            raise ValueError(
                f"batch_size must divide the {self.update_steps} samples of an update, got {self.batch_size}"
            )


@dataclass(frozen=True)
class FramesSettings(PPOSettings):
    """Settings of PPO whose policy sees its latest observations."""

    frames: int = 8


class PPOLearner(StableBaselinesLearner):
    """PPO with a discount in time; see ``learner.Learner``."""

    activation = "tanh"
    output = "clip"
    model: PPO

    def make_model(self, settings: PPOSettings, **common: Any) -> PPO:
        return PPO(
            "MlpPolicy",
            policy_kwargs=self.network_arguments(settings),
            rollout_buffer_class=TimeDiscountedBuffer,
            rollout_buffer_kwargs={"time_constant": settings.time_constant},
            **self.model_arguments(settings),
            **common,
        )

    def model_arguments(self, settings: PPOSettings) -> dict[str, Any]:
        """Arguments of the model."""
        return {
            "n_steps": settings.steps_per_update,
            "batch_size": settings.batch_size,
            "n_epochs": settings.epochs,
            "gamma": settings.typical_discount,
            "gae_lambda": settings.gae_lambda,
            "clip_range": settings.clip_range,
            "ent_coef": settings.entropy,
            "vf_coef": settings.value_weight,
            "max_grad_norm": settings.largest_gradient,
        }

    def network_arguments(self, settings: PPOSettings) -> dict[str, Any]:
        """Arguments of the networks."""
        return {
            "net_arch": list(settings.hidden),
            "log_std_init": settings.initial_log_std,
            "activation_fn": torch.nn.Tanh,
        }

    @property
    def buffer(self) -> TimedBuffer:
        return cast(TimeDiscountedBuffer, self.model.rollout_buffer)

    @property
    def optimizers(self) -> Mapping[str, Optimizer]:
        return {"adam": self.model.policy.optimizer}

    def layers(self) -> dict[str, str]:
        """The policy's hidden layers, and the one that gives the mean action."""
        hidden = {f"layers.{k}": f"mlp_extractor.policy_net.{2 * k}" for k in range(self._depth)}
        return hidden | {f"layers.{self._depth}": "action_net"}

    def weights(self) -> dict[str, NDArray[np.float32]]:
        """With the deviation of actions, which PPO has the same for all observations."""
        log_std = float_array(self.model.policy.state_dict()["log_std"])
        return super().weights() | {"log_std": log_std}
