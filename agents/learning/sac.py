"""SAC on the compiled batch of walkers: make it, train it, resume it, and take its policy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import SAC
from torch.optim import Optimizer

from agents.learning.checkpoint import Arrays, capture, refused_as_another_s, restore
from agents.learning.environment import float_array, observation_weights, training_environment
from agents.learning.keeper import Keeping, learn, torch_threads
from agents.learning.ppo_settings import GAIT_STEP
from agents.learning.replay import TimeDiscountedReplay
from agents.learning.results import Report, Trained, TrainingLog
from agents.learning.sac_settings import SACSettings
from agents.learning.schedules import Falling
from agents.observations import ObservationLayout
from agents.policies.policy import Policy, PolicyCard
from agents.policies.storage import task_of
from agents.seeds import training_seed
from agents.versions import package_versions
from lean_yaw_env.envs.options import ACTION_SIZE, EnvOptions

_REPLAY = "replay."


class EvenlyStartedSAC(SAC):
    """SB3's SAC whose first random actions come from numpy's shared generator, as all else does, so that they can be resumed."""

    def _sample_action(
        self, learning_starts: int, action_noise: Any = None, n_envs: int = 1
    ) -> tuple[NDArray[Any], NDArray[Any]]:
        if self.num_timesteps >= learning_starts:
            return super()._sample_action(learning_starts, action_noise, n_envs)
        drawn = np.random.uniform(-1.0, 1.0, (n_envs, ACTION_SIZE)).astype(np.float32)  # noqa: NPY002
        return drawn, drawn


def train_sac(
    env_id: str,
    settings: SACSettings,
    *,
    seed: int = 0,
    options: EnvOptions | None = None,
    checkpoint: Path | None = None,
    checkpoint_seconds: float = 5.0,
    threads: int = 1,
    progress: bool = True,
    report: Report | None = None,
    tensorboard: Path | None = None,
) -> Trained:
    """Train a policy, going on from the checkpoint if its file is there; arguments and errors as ``train_ppo``'s.

    Interrupted and gone on with, it gives bit for bit what it would have given uninterrupted, as PPO's does: the checkpoint holds what is
    remembered of the walks too, some 90 bytes for each of ``buffer_size`` steps.
    """
    chosen = EnvOptions() if options is None else options
    with torch_threads(threads):
        model = _make_model(env_id, settings, seed, chosen, threads, tensorboard)
        keeping = Keeping(
            settings.steps,
            lambda: _capture(model),
            checkpoint,
            checkpoint_seconds,
            progress,
            label=f"training, seed {seed}",
            report=report,
        )
        log = learn(model, keeping, _replay(model), lambda arrays: _restore(model, arrays))
        policy = _policy_of(model, env_id, settings, seed, chosen, log)
    return Trained(policy, log)


def _make_model(
    env_id: str,
    settings: SACSettings,
    seed: int,
    options: EnvOptions,
    threads: int,
    tensorboard: Path | None,
) -> SAC:
    first = training_seed(seed)
    env, walkers = training_environment(env_id, settings, options, threads)
    model = EvenlyStartedSAC(
        "MlpPolicy",
        env,
        learning_rate=Falling(settings.learning_rate, settings.final_learning_rate),
        buffer_size=settings.buffer_size,
        learning_starts=settings.random_steps,
        batch_size=settings.batch_size,
        tau=settings.target_rate,
        gamma=1.0,  # the buffer discounts
        train_freq=1,
        gradient_steps=settings.gradient_steps,
        ent_coef=f"auto_{settings.initial_entropy_weight}",
        target_entropy=settings.target_entropy,
        policy_kwargs={"net_arch": list(settings.hidden), "activation_fn": torch.nn.ReLU},
        replay_buffer_class=TimeDiscountedReplay,
        replay_buffer_kwargs={
            "time_constant": settings.time_constant,
            "typical_duration": GAIT_STEP,
        },
        tensorboard_log=None if tensorboard is None else str(tensorboard),
        seed=seed,
        device="cpu",
    )
    walkers.seed(first)  # in place of the policy's seed, which SB3 gives them too
    return model


def _policy_of(
    model: SAC,
    env_id: str,
    settings: SACSettings,
    seed: int,
    options: EnvOptions,
    log: TrainingLog,
) -> Policy:
    """The model's policy for inference; its actions are the hyperbolic tangent of what its last layer draws about."""
    tensors: Mapping[str, torch.Tensor] = model.policy.state_dict()
    weights = observation_weights(model.get_vec_normalize_env())
    names = {f"layers.{k}": f"actor.latent_pi.{2 * k}" for k in range(len(settings.hidden))}
    names |= {f"layers.{len(settings.hidden)}": "actor.mu", "log_std": "actor.log_std"}
    for name, theirs in names.items():
        for part in ("weight", "bias"):
            weights[f"{name}.{part}"] = float_array(tensors[f"{theirs}.{part}"])
    card = PolicyCard(
        env_id=env_id,
        options=options,
        layout=ObservationLayout.of(task_of(env_id), options),
        algorithm="sac",
        activation="relu",
        output="tanh",
        seed=seed,
        settings={**asdict(settings), "hidden": list(settings.hidden)},
        training={"steps": int(model.num_timesteps), "seconds": round(log.seconds, 1)},
        versions=package_versions(),
    )
    return Policy(card, weights)


def _capture(model: SAC) -> Arrays:
    """All that decides how the training goes on."""
    arrays = capture(model, _optimizers(model))
    arrays["last.unnormalised"] = np.array(model._last_original_obs)
    arrays["entropy.log_weight"] = float_array(_log_entropy_weight(model))
    return arrays | {_REPLAY + name: array for name, array in _replay(model).captured().items()}


def _restore(model: SAC, arrays: Arrays) -> None:
    restore(model, arrays, _optimizers(model))
    with refused_as_another_s():
        replay = {k.removeprefix(_REPLAY): v for k, v in arrays.items() if k.startswith(_REPLAY)}
        _replay(model).restore(replay)
        model._last_original_obs = arrays["last.unnormalised"].copy()
        with torch.no_grad():
            _log_entropy_weight(model).copy_(torch.from_numpy(arrays["entropy.log_weight"]))


def _optimizers(model: SAC) -> dict[str, Optimizer]:
    entropy = model.ent_coef_optimizer
    assert entropy is not None  # its weight is learnt
    return {"adam_actor": model.actor.optimizer, "adam_critic": model.critic.optimizer, "adam_entropy": entropy}  # fmt: skip


def _log_entropy_weight(model: SAC) -> torch.Tensor:
    assert model.log_ent_coef is not None
    return model.log_ent_coef


def _replay(model: SAC) -> TimeDiscountedReplay:
    return cast(TimeDiscountedReplay, model.replay_buffer)
