"""PPO on the compiled batch of walkers: make it, train it, resume it, and take its policy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import cast

import torch
from stable_baselines3 import PPO
from torch.optim import Optimizer

from agents.learning.checkpoint import capture, restore
from agents.learning.environment import float_array, observation_weights, training_environment
from agents.learning.keeper import Keeping, learn, torch_threads
from agents.learning.ppo_settings import PPOSettings
from agents.learning.results import Report, Trained, TrainingLog
from agents.learning.rollouts import TimeDiscountedBuffer
from agents.learning.schedules import Falling
from agents.observations import ObservationLayout
from agents.policies.policy import Policy, PolicyCard
from agents.policies.storage import task_of
from agents.seeds import training_seed
from agents.versions import package_versions
from lean_yaw_env.envs.options import EnvOptions


def train_ppo(
    env_id: str,
    settings: PPOSettings,
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
    """Train a policy, going on from the checkpoint if its file is there.

    Interrupted and gone on with the same arguments, a training gives what it would have given uninterrupted, bit for bit.

    Parameters
    ----------
    env_id, settings, seed, options : what to train
    checkpoint : file for the training's state, written whole; none without
    checkpoint_seconds : least time between two of them
    threads : of torch and of the walkers
    progress : show a bar
    report : told of the steps done and the latest returns, between updates
    tensorboard : folder for TensorBoard's logs; none without

    Raises
    ------
    ValueError
        If a number is out of its range.
    CheckpointError
        If the checkpoint is damaged or another training's.
    """
    chosen = EnvOptions() if options is None else options
    with torch_threads(threads):
        model = _make_model(env_id, settings, seed, chosen, threads, tensorboard)
        keeping = Keeping(
            settings.steps,
            lambda: capture(model, _optimizers(model)),
            checkpoint,
            checkpoint_seconds,
            progress,
            label=f"training, seed {seed}",
            report=report,
        )
        buffer = cast(TimeDiscountedBuffer, model.rollout_buffer)
        log = learn(
            model, keeping, buffer, lambda arrays: restore(model, arrays, _optimizers(model))
        )
        policy = policy_of(model, env_id, settings, seed, chosen, log)
    return Trained(policy, log)


def policy_of(
    model: PPO,
    env_id: str,
    settings: PPOSettings,
    seed: int,
    options: EnvOptions,
    log: TrainingLog,
) -> Policy:
    """The model's policy for inference, with the statistics that normalise its observations."""
    tensors: Mapping[str, torch.Tensor] = model.policy.state_dict()
    weights = observation_weights(model.get_vec_normalize_env())
    weights["log_std"] = float_array(tensors["log_std"])
    names = [f"mlp_extractor.policy_net.{2 * k}" for k in range(len(settings.hidden))]
    for k, name in enumerate([*names, "action_net"]):
        for part in ("weight", "bias"):
            weights[f"layers.{k}.{part}"] = float_array(tensors[f"{name}.{part}"])
    card = PolicyCard(
        env_id=env_id,
        options=options,
        layout=ObservationLayout.of(task_of(env_id), options),
        algorithm="ppo",
        activation="tanh",
        output="clip",
        seed=seed,
        settings={**asdict(settings), "hidden": list(settings.hidden)},
        training={"steps": int(model.num_timesteps), "seconds": round(log.seconds, 1)},
        versions=package_versions(),
    )
    return Policy(card, weights)


def _make_model(
    env_id: str,
    settings: PPOSettings,
    seed: int,
    options: EnvOptions,
    threads: int,
    tensorboard: Path | None,
) -> PPO:
    first = training_seed(seed)
    env, walkers = training_environment(env_id, settings, options, threads)
    model = PPO(
        "MlpPolicy",
        env,
        n_steps=settings.steps_per_update,
        batch_size=settings.batch_size,
        n_epochs=settings.epochs,
        learning_rate=Falling(settings.learning_rate, settings.final_learning_rate),
        gamma=settings.typical_discount,
        gae_lambda=settings.gae_lambda,
        clip_range=settings.clip_range,
        ent_coef=settings.entropy,
        vf_coef=settings.value_weight,
        max_grad_norm=settings.largest_gradient,
        policy_kwargs={
            "net_arch": list(settings.hidden),
            "log_std_init": settings.initial_log_std,
            "activation_fn": torch.nn.Tanh,
        },
        rollout_buffer_class=TimeDiscountedBuffer,
        rollout_buffer_kwargs={"time_constant": settings.time_constant},
        tensorboard_log=None if tensorboard is None else str(tensorboard),
        seed=seed,
        device="cpu",
    )
    walkers.seed(first)  # in place of the policy's seed, which SB3 gives them too
    return model


def _optimizers(model: PPO) -> dict[str, Optimizer]:
    return {"adam": model.policy.optimizer}
