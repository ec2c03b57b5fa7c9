"""Learners of Stable-Baselines3 on compiled walkers: the environment, the callback, and a state that can be resumed from bit for bit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize
from torch.optim import Optimizer

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.sb3 import WalkerVecEnv

from ..policies.policy import NORMALISATION_FLOOR, NORMALISED_LIMIT
from ..policies.policy_files import task_of
from .experience import named_arrays
from .learner import LearnerSettings, float_array, optimizer_arrays, restore_optimizer
from .recorder import Arrays, EndedEpisode, Recorder, restoring, under


@dataclass(frozen=True)
class Falling:
    """A learning rate that falls linearly to a share of itself, called with the share of the training that is left."""

    first: float
    last_share: float

    @classmethod
    def of(cls, settings: LearnerSettings) -> Falling:
        return cls(settings.learning_rate, settings.final_learning_rate)

    def __call__(self, progress_left: float) -> float:
        return self.first * (self.last_share + (1.0 - self.last_share) * progress_left)


def training_environment(
    env_id: str, settings: LearnerSettings, options: EnvOptions, threads: int
) -> tuple[VecNormalize, WalkerVecEnv]:
    """Walkers at a task under a training's options, whose observations and rewards are normalised; both wrapper and walkers."""
    walkers = WalkerVecEnv(
        settings.walkers, task_of(env_id), threads=threads, **vars(settings.walked_under(options))
    )
    normalised = VecNormalize(
        walkers,
        gamma=settings.typical_discount,
        clip_obs=NORMALISED_LIMIT,
        epsilon=NORMALISATION_FLOOR,
    )
    return normalised, walkers


class TimedBuffer(Protocol):
    """Experience that knows how long each step took."""

    pos: int
    durations: NDArray[np.float64]


class _Callback(BaseCallback):
    """Tells the recorder of episodes and updates, and the buffer of the steps' durations."""

    def __init__(self, recorder: Recorder, buffer: TimedBuffer) -> None:
        super().__init__()
        self._recorder = recorder
        self._buffer = buffer

    def _on_rollout_start(self) -> None:
        """Called between two updates: the one moment at which a state is complete."""
        self._recorder.between_updates(self.num_timesteps)

    def _on_step(self) -> bool:
        """Called after each step of the walkers, before the buffer takes it."""
        walkers: Any = self.training_env.unwrapped
        self._buffer.durations[self._buffer.pos] = walkers.step_durations()
        for i in np.flatnonzero(self.locals["dones"]):
            info = self.locals["infos"][i]
            episode = info["episode"]
            survived = info["TimeLimit.truncated"] or bool(info.get("is_success", False))
            self._recorder.add(
                EndedEpisode(self.num_timesteps, episode["r"], episode["l"], survived)
            )
        return True


class StableBaselinesLearner:
    """A learner around a model of Stable-Baselines3 that trains on a ``WalkerVecEnv`` within a ``VecNormalize``.

    An algorithm says what its ``layers`` are called, and captures what it has beside networks, optimisers and walkers.

    Parameters
    ----------
    model : BaseAlgorithm
    buffer : TimedBuffer
        Of the model.
    optimizers : the model's, by the names that they are kept under
    total : environment steps of the training
    """

    activation: str
    output: str

    def __init__(
        self,
        model: BaseAlgorithm,
        buffer: TimedBuffer,
        optimizers: Mapping[str, Optimizer],
        total: int,
    ) -> None:
        self.model = model
        self._buffer = buffer
        self._optimizers = optimizers
        self._total = total
        normaliser = model.get_vec_normalize_env()
        assert normaliser is not None and isinstance(normaliser.unwrapped, WalkerVecEnv)
        self._normaliser, self._walkers = normaliser, normaliser.unwrapped

    @property
    def steps(self) -> int:
        return self.model.num_timesteps

    def learn(self, recorder: Recorder) -> None:
        """Train to the end and close the environment; see ``Learner``."""
        callback, left = _Callback(recorder, self._buffer), self._total - self.steps
        try:
            if left > 0:
                # SB3 counts what is left from where the model is, and so keeps the schedule's end
                self.model.learn(left, callback, reset_num_timesteps=self.steps == 0)
        finally:
            self._normaliser.close()

    def layers(self) -> dict[str, str]:
        """SB3's names of the policy's layers, by the names that ``Policy`` takes."""
        raise NotImplementedError

    def weights(self) -> dict[str, NDArray[np.float32]]:
        """The policy's numbers, with the statistics that normalise its observations; see ``Learner``."""
        tensors = self.model.policy.state_dict()
        features = tensors[f"{self.layers()['layers.0']}.weight"].shape[1]
        moments = self._moments().get("observations", RunningMeanStd(shape=(features,)))
        weights = {
            "observation_mean": np.asarray(moments.mean, dtype=np.float32),
            "observation_variance": np.asarray(moments.var, dtype=np.float32),
        }
        for name, theirs in self.layers().items():
            for part in ("weight", "bias"):
                weights[f"{name}.{part}"] = float_array(tensors[f"{theirs}.{part}"])
        return weights

    def capture(self) -> Arrays:
        """Networks, optimisers, statistics, walkers and random numbers; see ``Learner``."""
        model, normaliser = self.model, self._normaliser
        arrays: Arrays = {
            "count.steps": np.array(model.num_timesteps),
            "count.updates": np.array(model._n_updates),
            "last.starts": np.array(model._last_episode_starts),
            "normaliser.returns": normaliser.returns,
            "random.torch": torch.get_rng_state().numpy(),
        }
        arrays |= captured_observations("last.observations", model._last_obs)
        arrays |= {
            f"policy.{k}": v.detach().cpu().numpy() for k, v in model.policy.state_dict().items()
        }
        for name, optimizer in self._optimizers.items():
            arrays |= {f"{name}.{k}": v for k, v in optimizer_arrays(optimizer).items()}
        for name, moments in self._moments().items():
            arrays |= {
                f"{name}.{k}": np.asarray(getattr(moments, k)) for k in ("mean", "var", "count")
            }
        arrays |= {f"walkers.{k}": v for k, v in self._walkers.snapshot().items()}
        return arrays | _numpy_random()

    def restore(self, arrays: Arrays) -> None:
        """Bring the model to a captured state; see ``Learner``."""
        model = self.model
        with restoring():
            names = model.policy.state_dict()
            policy = {k: torch.from_numpy(arrays[f"policy.{k}"].copy()) for k in names}
            model.policy.load_state_dict(policy)
            for name, optimizer in self._optimizers.items():
                restore_optimizer(optimizer, under(f"{name}.", arrays))
            for name, moments in self._moments().items():
                moments.mean = arrays[f"{name}.mean"].copy()
                moments.var = arrays[f"{name}.var"].copy()
                moments.count = float(arrays[f"{name}.count"])
            self._normaliser.returns = arrays["normaliser.returns"].copy()
            self._walkers.restore(under("walkers.", arrays))
            model.num_timesteps = int(arrays["count.steps"])
            model._n_updates = int(arrays["count.updates"])
            model._last_obs = restored_observations("last.observations", arrays)
            model._last_episode_starts = arrays["last.starts"].copy()
            torch.set_rng_state(torch.from_numpy(arrays["random.torch"].copy()))
            _restore_numpy_random(arrays)

    def _moments(self) -> dict[str, Any]:
        returns = {"returns": self._normaliser.ret_rms}
        return (
            {"observations": self._normaliser.obs_rms} | returns
            if self._normaliser.norm_obs
            else returns
        )


def captured_observations(name: str, observations: Any) -> Arrays:
    """Copies of observations, each array of a dictionary under a name of its own."""
    return {key: np.array(each) for key, each in named_arrays(name, observations).items()}


def restored_observations(name: str, arrays: Arrays) -> Any:
    """What ``captured_observations`` was given."""
    if name in arrays:
        return arrays[name].copy()
    return {key: each.copy() for key, each in under(f"{name}.", arrays).items()}


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
