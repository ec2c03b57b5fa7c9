"""A training's whole state as one file of arrays: written at once, and resumed from bit for bit."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import safetensors.numpy
import torch
from numpy.typing import NDArray
from safetensors import SafetensorError
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecNormalize
from torch.optim import Optimizer

from lean_yaw_env.envs.sb3 import WalkerVecEnv
from lean_yaw_env.files import written_whole

Arrays = dict[str, NDArray[Any]]


class CheckpointError(ValueError):
    """A checkpoint that is not this training's; the message says what is wrong."""


def write_checkpoint(path: Path, arrays: Arrays) -> None:
    """Write arrays to a file, whole or not at all."""
    data = safetensors.numpy.save({k: np.asarray(v, order="C") for k, v in arrays.items()})
    with written_whole(path) as temporary:
        temporary.write_bytes(data)


def read_checkpoint(path: Path) -> Arrays:
    """Read what ``write_checkpoint`` wrote, or raise ``CheckpointError``."""
    try:
        return safetensors.numpy.load(path.read_bytes())
    except (OSError, SafetensorError) as error:
        raise CheckpointError(f"no checkpoint can be read from {str(path)!r}: {error}") from error


def capture(model: BaseAlgorithm, optimizers: Mapping[str, Optimizer]) -> Arrays:
    """All that decides how a training goes on, between two updates: networks, optimisers, statistics, walkers, random numbers.

    Parameters
    ----------
    model : trains on a ``WalkerVecEnv`` within a ``VecNormalize``
    optimizers : of the model, by the names that they are kept under
    """
    normaliser, walkers = _environment(model)
    arrays: Arrays = {
        "count.steps": np.array(model.num_timesteps),
        "count.updates": np.array(model._n_updates),
        "last.observations": np.array(model._last_obs),
        "last.starts": np.array(model._last_episode_starts),
        "normaliser.returns": normaliser.returns,
        "random.torch": torch.get_rng_state().numpy(),
    }
    arrays |= {f"policy.{k}": v.detach().cpu().numpy() for k, v in _tensors(model).items()}
    for name, optimizer in optimizers.items():
        for index, slots in optimizer.state_dict()["state"].items():
            arrays |= {f"{name}.{index}.{k}": v.detach().cpu().numpy() for k, v in slots.items()}
    for name, moments in _moments(normaliser).items():
        arrays |= {
            f"{name}.mean": np.asarray(moments.mean),
            f"{name}.var": np.asarray(moments.var),
            f"{name}.count": np.asarray(moments.count),
        }
    arrays |= {f"walkers.{k}": v for k, v in walkers.snapshot().items()}
    return arrays | _numpy_random()


def restore(model: BaseAlgorithm, arrays: Arrays, optimizers: Mapping[str, Optimizer]) -> None:
    """Bring a model that was made with the same settings to a captured state.

    Raises
    ------
    CheckpointError
        If the arrays are another model's.
    """
    normaliser, walkers = _environment(model)
    with refused_as_another_s():
        policy = {k: torch.from_numpy(arrays[f"policy.{k}"].copy()) for k in _tensors(model)}
        model.policy.load_state_dict(policy)
        for name, optimizer in optimizers.items():
            _restore_optimizer(name, optimizer, arrays)
        for name, moments in _moments(normaliser).items():
            moments.mean = arrays[f"{name}.mean"].copy()
            moments.var = arrays[f"{name}.var"].copy()
            moments.count = float(arrays[f"{name}.count"])
        normaliser.returns = arrays["normaliser.returns"].copy()
        prefix = "walkers."
        walkers.restore(
            {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}
        )
        model.num_timesteps = int(arrays["count.steps"])
        model._n_updates = int(arrays["count.updates"])
        model._last_obs = arrays["last.observations"].copy()
        model._last_episode_starts = arrays["last.starts"].copy()
        torch.set_rng_state(torch.from_numpy(arrays["random.torch"].copy()))
        _restore_numpy_random(arrays)


@contextlib.contextmanager
def refused_as_another_s() -> Iterator[None]:
    """What goes wrong within is a checkpoint of a training with other settings."""
    try:
        yield
    except (KeyError, RuntimeError, ValueError) as error:
        raise CheckpointError(
            f"the checkpoint is not of a training with these settings: {error}"
        ) from error


def _environment(model: BaseAlgorithm) -> tuple[VecNormalize, WalkerVecEnv]:
    normaliser = model.get_vec_normalize_env()
    if normaliser is None or not isinstance(normaliser.unwrapped, WalkerVecEnv):
        raise TypeError("the model must train on a WalkerVecEnv within a VecNormalize")
    return normaliser, normaliser.unwrapped


def _tensors(model: BaseAlgorithm) -> dict[str, torch.Tensor]:
    return model.policy.state_dict()


def _moments(normaliser: VecNormalize) -> dict[str, Any]:
    return {"observations": normaliser.obs_rms, "returns": normaliser.ret_rms}


def _restore_optimizer(prefix: str, optimizer: Optimizer, arrays: Arrays) -> None:
    state: dict[int, dict[str, torch.Tensor]] = {}
    for name, value in arrays.items():
        if name.startswith(f"{prefix}."):
            _, index, slot = name.split(".")
            state.setdefault(int(index), {})[slot] = torch.from_numpy(value.copy())
    groups = optimizer.state_dict()["param_groups"]
    optimizer.load_state_dict({"state": state, "param_groups": groups})


def _numpy_random() -> Arrays:
    """The state of numpy's shared generator, which SB3 shuffles samples by."""
    _, keys, position, has_gauss, gauss = np.random.get_state(legacy=True)  # noqa: NPY002
    return {
        "random.numpy": np.asarray(keys),
        "random.numpy_position": np.array([position, has_gauss]),
        "random.numpy_gauss": np.array(gauss),
    }


def _restore_numpy_random(arrays: Arrays) -> None:
    position, has_gauss = (int(v) for v in arrays["random.numpy_position"])
    gauss = float(arrays["random.numpy_gauss"])
    np.random.set_state(("MT19937", arrays["random.numpy"], position, has_gauss, gauss))  # noqa: NPY002
