"""The environment that Stable-Baselines3's algorithms train on: compiled walkers, normalised."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecNormalize

from agents.policies.policy import NORMALISATION_FLOOR, NORMALISED_LIMIT
from agents.policies.storage import task_of
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.sb3 import WalkerVecEnv


class WalkingSettings(Protocol):
    """What the environment of a training depends on."""

    @property
    def walkers(self) -> int: ...
    @property
    def push_level(self) -> float | None: ...
    @property
    def typical_discount(self) -> float: ...


def training_environment(
    env_id: str, settings: WalkingSettings, options: EnvOptions, threads: int
) -> tuple[VecNormalize, WalkerVecEnv]:
    """Walkers at a task under a training's options, whose observations and rewards are normalised; both wrapper and walkers."""
    if settings.push_level is not None:
        options = replace(options, push_level=settings.push_level)
    walkers = WalkerVecEnv(settings.walkers, task_of(env_id), threads=threads, **vars(options))
    normalised = VecNormalize(
        walkers,
        gamma=settings.typical_discount,
        clip_obs=NORMALISED_LIMIT,
        epsilon=NORMALISATION_FLOOR,
    )
    return normalised, walkers


def observation_weights(normaliser: VecNormalize | None) -> dict[str, NDArray[np.float32]]:
    """The statistics that a policy's file normalises observations by."""
    assert normaliser is not None
    moments = normaliser.obs_rms
    assert not isinstance(moments, dict)
    return {
        "observation_mean": np.asarray(moments.mean, dtype=np.float32),
        "observation_variance": np.asarray(moments.var, dtype=np.float32),
    }


def float_array(tensor: torch.Tensor) -> NDArray[np.float32]:
    """A tensor's numbers."""
    return tensor.detach().cpu().numpy().astype(np.float32)
