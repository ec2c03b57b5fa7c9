"""Learners of Stable-Baselines3 on compiled walkers: the environment, the callback, and a state from which a training resumes bit for bit."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecEnv, VecFrameStack, VecNormalize
from torch.optim import Optimizer

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.sb3 import WalkerVecEnv

from ..policies.policy import NORMALISATION_FLOOR, NORMALISED_LIMIT
from ..policies.policy_files import task_of
from ..seeds import training_seed
from .learner import LearnerSettings, captured, float_array, restore
from .recorder import EndedEpisode, Recorder, State, require_like

_GENERATOR_WORDS = 624  # of the Mersenne Twister


class TimedBuffer(Protocol):
    """Experience that knows how long each step took."""

    pos: int
    durations: NDArray[np.float64]


class _Callback(BaseCallback):
    """Passes episodes and updates to the recorder, and the steps' durations to the buffer."""

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
    """A learner around a model of Stable-Baselines3 that trains on a ``WalkerVecEnv`` within a ``VecNormalize``; see ``learner.Learner``.

    An algorithm makes its model and names its parts; it captures what it has beside networks, optimisers and walkers.
    """

    activation: str
    output: str

    def __init__(
        self,
        env_id: str,
        settings: LearnerSettings,
        seed: int,
        options: EnvOptions,
        threads: int,
        tensorboard: Path | None,
    ) -> None:
        first = training_seed(seed)
        self.options = options
        self._total, self._depth = settings.steps, len(settings.hidden)
        walking = vars(settings.training_options(options))
        self._walkers = WalkerVecEnv(
            settings.walkers, self.environment(env_id), threads=threads, **walking
        )
        frames = getattr(settings, "frames", 1)
        self._frames = VecFrameStack(self._walkers, frames) if frames > 1 else None
        self._normaliser = self.normalised(self._frames or self._walkers, settings)
        self.model = self.make_model(
            settings,
            env=self._normaliser,
            learning_rate=lambda left: settings.learning_rate * settings.learning_rate_share(left),
            tensorboard_log=None if tensorboard is None else str(tensorboard),
            seed=seed,
            device="cpu",
        )
        if tensorboard is None:  # SB3's own logger makes a folder among the temporary files
            self.model.set_logger(Logger(folder=None, output_formats=[]))
        self._walkers.seed(first)  # in place of the policy's seed, which SB3 gives them too
        # what SB3 has from the first step on, so that a state has the same parts before it
        self.model._last_obs = self.model._last_original_obs = self._no_observations()
        self.model._last_episode_starts = np.ones(settings.walkers, dtype=np.bool_)

    def environment(self, env_id: str) -> str:
        """The task or the environment's id that the walkers train at."""
        return task_of(env_id)

    def normalised(self, walkers: VecEnv, settings: LearnerSettings) -> VecNormalize:
        """The walkers with normalised observations and rewards."""
        return VecNormalize(
            walkers,
            gamma=settings.typical_discount,
            clip_obs=NORMALISED_LIMIT,
            epsilon=NORMALISATION_FLOOR,
        )

    def make_model(self, settings: Any, **common: Any) -> BaseAlgorithm:
        """The model of these settings; ``common`` are arguments that all models take."""
        raise NotImplementedError

    @property
    def buffer(self) -> TimedBuffer:
        """The model's experience."""
        raise NotImplementedError

    @property
    def optimizers(self) -> Mapping[str, Optimizer]:
        """The model's optimisers by name."""
        raise NotImplementedError

    def layers(self) -> dict[str, str]:
        """SB3's names of the policy's layers, by the names that ``Policy`` takes."""
        raise NotImplementedError

    @property
    def steps(self) -> int:
        return self.model.num_timesteps

    def learn(self, recorder: Recorder) -> None:
        """Train to the end and close the environment."""
        callback, left = _Callback(recorder, self.buffer), self._total - self.steps
        try:
            if left > 0:
                # SB3 counts what is left from where the model is, and so keeps the schedule's end
                self.model.learn(left, callback, reset_num_timesteps=self.steps == 0)
        finally:
            self._normaliser.close()

    def weights(self) -> dict[str, NDArray[np.float32]]:
        """The policy's weights, with the statistics that normalise its observations."""
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

    def capture(self) -> State:
        """Networks, optimisers, statistics, walkers and random numbers."""
        model, random = self.model, np.random.get_state(legacy=False)  # noqa: NPY002 - SB3 draws from it
        return {
            **captured({"policy": model.policy}, self.optimizers),
            **{name: vars(moments) for name, moments in self._moments().items()},
            "steps": model.num_timesteps,
            "updates": model._n_updates,
            "last": {"observations": model._last_obs, "starts": model._last_episode_starts},
            "normaliser": {"returns": self._normaliser.returns},
            "walkers": self._walkers.snapshot(),
            **({"frames": self._frames.stacked_obs.stacked_obs} if self._frames else {}),
            "torch": torch.get_rng_state(),
            "numpy": {key: random[key] for key in ("state", "has_gauss", "gauss")},
        }

    def restore(self, state: Any) -> None:
        """Bring the model to a captured state."""
        model = self.model
        self._walkers.reset()
        require_like(self.capture(), state)
        restore({"policy": model.policy}, self.optimizers, state)
        for name, moments in self._moments().items():
            moments.mean, moments.var = state[name]["mean"], state[name]["var"]
            moments.count = float(state[name]["count"])
            if moments.count < 0.0 or np.any(np.less(moments.var, 0.0)):
                raise ValueError(f"{name} must have a variance of 0 or more")
        self._normaliser.returns = state["normaliser"]["returns"]
        self._walkers.restore(state["walkers"])
        if self._frames is not None:
            self._frames.stacked_obs.stacked_obs = state["frames"]
        model.num_timesteps, model._n_updates = int(state["steps"]), int(state["updates"])
        model._last_obs, model._last_episode_starts = (
            state["last"][k] for k in ("observations", "starts")
        )
        if not 0 <= int(state["numpy"]["state"]["pos"]) <= _GENERATOR_WORDS:
            raise ValueError("numpy/state/pos must be a place in the generator's state")
        torch.set_rng_state(torch.from_numpy(state["torch"]))
        np.random.set_state({"bit_generator": "MT19937", **state["numpy"]})  # noqa: NPY002

    def _no_observations(self) -> Any:
        space, n = self._normaliser.observation_space, self._walkers.num_envs
        if isinstance(space, spaces.Dict):
            return {
                key: np.zeros((n, *(each.shape or ())), each.dtype) for key, each in space.items()
            }
        return np.zeros((n, *(space.shape or ())), space.dtype)

    def _moments(self) -> dict[str, Any]:
        found: dict[str, Any] = {"returns": self._normaliser.ret_rms}
        if self._normaliser.norm_obs:
            found["observations"] = self._normaliser.obs_rms
        return found
