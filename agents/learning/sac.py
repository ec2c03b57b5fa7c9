"""SAC on the compiled batch of walkers: its settings, its model, and its policy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import SAC
from stable_baselines3.common.vec_env import VecNormalize

from lean_yaw_env.envs.options import ACTION_SIZE, EnvOptions
from lean_yaw_env.envs.sb3 import WalkerVecEnv
from lean_yaw_env.validation import require_count, require_number

from ..seeds import training_seed
from .experience import TimeDiscountedReplay
from .learner import GAIT_STEP, LearnerSettings, float_array
from .recorder import Arrays, restoring, under
from .stable_baselines import (
    Falling,
    StableBaselinesLearner,
    captured_observations,
    restored_observations,
    training_environment,
)

_REPLAY = "replay."


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

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require_counts("gradient_steps", "batch_size")
        self.require_counts("random_steps", low=0)
        require_count("buffer_size", self.buffer_size, self.walkers, 10**9)
        require_number("target_rate", self.target_rate, 0.0, 1.0, "(]")
        self.require_positive("initial_entropy_weight")
        require_number("target_entropy", self.target_entropy, -100.0, 100.0)


class EvenlyStartedSAC(SAC):
    """SB3's SAC whose first random actions come from numpy's shared generator, as all else does, so that they can be resumed."""

    def _sample_action(
        self, learning_starts: int, action_noise: Any = None, n_envs: int = 1
    ) -> tuple[NDArray[Any], NDArray[Any]]:
        if self.num_timesteps >= learning_starts:
            return super()._sample_action(learning_starts, action_noise, n_envs)
        drawn = np.random.uniform(-1.0, 1.0, (n_envs, ACTION_SIZE)).astype(np.float32)  # noqa: NPY002
        return drawn, drawn


class SACLearner(StableBaselinesLearner):
    """SAC with a discount in time; see ``learner.Learner``.

    Its checkpoint holds what is remembered of the walks too, some 90 bytes for each of ``buffer_size`` steps. Its actions are the hyperbolic
    tangent of what the policy's last layer draws about.
    """

    activation = "relu"
    output = "tanh"
    network = "MlpPolicy"
    replay: type[Any] = TimeDiscountedReplay

    def __init__(
        self,
        env_id: str,
        settings: SACSettings,
        seed: int,
        options: EnvOptions,
        threads: int,
        tensorboard: Path | None,
    ) -> None:
        first = training_seed(seed)
        env, walkers = self.environment(env_id, settings, options, threads)
        model = EvenlyStartedSAC(
            self.network,
            env,
            learning_rate=Falling.of(settings),
            buffer_size=settings.buffer_size,
            learning_starts=settings.random_steps,
            batch_size=settings.batch_size,
            tau=settings.target_rate,
            gamma=1.0,  # the buffer discounts
            train_freq=1,
            gradient_steps=settings.gradient_steps,
            ent_coef=f"auto_{settings.initial_entropy_weight}",
            target_entropy=settings.target_entropy,
            policy_kwargs=self.network_arguments(settings, options),
            replay_buffer_class=self.replay,
            replay_buffer_kwargs=self.replay_arguments(settings),
            tensorboard_log=None if tensorboard is None else str(tensorboard),
            seed=seed,
            device="cpu",
        )
        walkers.seed(first)  # in place of the policy's seed, which SB3 gives them too
        entropy = model.ent_coef_optimizer
        assert entropy is not None and model.log_ent_coef is not None  # its weight is learnt
        optimizers = {
            "adam_actor": model.actor.optimizer,
            "adam_critic": model.critic.optimizer,
            "adam_entropy": entropy,
        }
        self._replay = cast(TimeDiscountedReplay, model.replay_buffer)
        self._log_entropy_weight = model.log_ent_coef
        super().__init__(model, self._replay, optimizers, settings.steps)
        self._depth = len(settings.hidden)

    def environment(
        self, env_id: str, settings: Any, options: EnvOptions, threads: int
    ) -> tuple[VecNormalize, WalkerVecEnv]:
        """The walkers that experience comes from."""
        return training_environment(env_id, settings, options, threads)

    def network_arguments(self, settings: Any, options: EnvOptions) -> dict[str, Any]:
        """What the networks are made with."""
        return {"net_arch": list(settings.hidden), "activation_fn": torch.nn.ReLU}

    def replay_arguments(self, settings: Any) -> dict[str, Any]:
        """What the buffer is made with."""
        return {"time_constant": settings.time_constant, "typical_duration": GAIT_STEP}

    def layers(self) -> dict[str, str]:
        """The actor's hidden layers, the one that gives the mean action, and the one that gives the deviation."""
        hidden = {f"layers.{k}": f"actor.latent_pi.{2 * k}" for k in range(self._depth)}
        return hidden | {f"layers.{self._depth}": "actor.mu", "log_std": "actor.log_std"}

    def capture(self) -> Arrays:
        """With the replay buffer and the entropy's weight."""
        arrays = super().capture()
        arrays |= captured_observations("last.unnormalised", self.model._last_original_obs)
        arrays["entropy.log_weight"] = float_array(self._log_entropy_weight)
        return arrays | {_REPLAY + name: array for name, array in self._replay.captured().items()}

    def restore(self, arrays: Arrays) -> None:
        """Bring the model to a captured state; see ``Learner``."""
        super().restore(arrays)
        with restoring():
            self._replay.restore(under(_REPLAY, arrays))
            self.model._last_original_obs = restored_observations("last.unnormalised", arrays)
            with torch.no_grad():
                self._log_entropy_weight.copy_(torch.from_numpy(arrays["entropy.log_weight"]))
