"""PPO on the compiled batch of walkers: make it, train it, resume it, and take its policy."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecNormalize
from tqdm import tqdm

from agents.learning.checkpoint import (
    CheckpointError,
    capture,
    read_checkpoint,
    restore,
    write_checkpoint,
)
from agents.learning.ppo_settings import PPOSettings
from agents.learning.rollouts import TimeDiscountedBuffer
from agents.observations import ObservationLayout
from agents.policies.policy import NORMALISATION_FLOOR, NORMALISED_LIMIT, Policy, PolicyCard
from agents.policies.storage import task_of
from agents.seeds import training_seed
from agents.versions import package_versions
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.sb3 import WalkerVecEnv

_LOG = "log."


@dataclass(frozen=True)
class TrainingLog:
    """Every episode of a training, in the order in which they ended.

    Attributes
    ----------
    steps : shape (episodes,)
        Environment steps of the training when the episode ended.
    returns, lengths : shape (episodes,)
        The episode's return and its steps.
    survived : bool, shape (episodes,)
    seconds : wall-clock time of training, over all its sittings
    """

    steps: NDArray[np.int64]
    returns: NDArray[np.float64]
    lengths: NDArray[np.int64]
    survived: NDArray[np.bool_]
    seconds: float


@dataclass(frozen=True)
class TrainedPPO:
    """What a training gives."""

    policy: Policy
    log: TrainingLog


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
    tensorboard: Path | None = None,
) -> TrainedPPO:
    """Train a policy, going on from the checkpoint if its file is there.

    Interrupted and gone on with the same arguments, a training gives what it would have given uninterrupted, bit for bit.

    Parameters
    ----------
    env_id, settings, seed, options : what to train
    checkpoint : file for the training's state, written whole; none without
    checkpoint_seconds : least time between two of them
    threads : of torch and of the walkers
    progress : show a bar
    tensorboard : folder for TensorBoard's logs; none without

    Raises
    ------
    ValueError
        If a number is out of its range.
    CheckpointError
        If the checkpoint is damaged or another training's.
    """
    chosen = EnvOptions() if options is None else options
    with _torch_threads(threads):
        model = _make_model(env_id, settings, seed, chosen, threads, tensorboard)
        keeper = _Keeper(settings.steps, checkpoint, checkpoint_seconds, progress)
        if checkpoint is not None and checkpoint.exists():
            arrays = read_checkpoint(checkpoint)
            restore(model, arrays)
            keeper.restore(arrays)
        left = settings.steps - model.num_timesteps
        if left > 0:
            # SB3 counts what is left from where the model is, and so keeps the schedule's end
            model.learn(left, keeper, reset_num_timesteps=model.num_timesteps == 0)
        log = keeper.log()
        policy = policy_of(model, env_id, settings, seed, chosen, log)
        assert model.env is not None
        model.env.close()
    return TrainedPPO(policy, log)


def policy_of(
    model: PPO,
    env_id: str,
    settings: PPOSettings,
    seed: int,
    options: EnvOptions,
    log: TrainingLog,
) -> Policy:
    """The model's policy for inference, with the statistics that normalise its observations."""
    normaliser = model.get_vec_normalize_env()
    assert normaliser is not None
    tensors: Mapping[str, torch.Tensor] = model.policy.state_dict()
    moments: Any = normaliser.obs_rms
    weights = {
        "observation_mean": np.asarray(moments.mean, dtype=np.float32),
        "observation_variance": np.asarray(moments.var, dtype=np.float32),
        "log_std": _array(tensors["log_std"]),
    }
    names = [f"mlp_extractor.policy_net.{2 * k}" for k in range(len(settings.hidden))]
    for k, name in enumerate([*names, "action_net"]):
        for part in ("weight", "bias"):
            weights[f"layers.{k}.{part}"] = _array(tensors[f"{name}.{part}"])
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
    if settings.push_level is not None:
        options = replace(options, push_level=settings.push_level)
    walkers = WalkerVecEnv(settings.walkers, task_of(env_id), threads=threads, **vars(options))
    env = VecNormalize(
        walkers,
        gamma=settings.typical_discount,
        clip_obs=NORMALISED_LIMIT,
        epsilon=NORMALISATION_FLOOR,
    )
    model = PPO(
        "MlpPolicy",
        env,
        n_steps=settings.steps_per_update,
        batch_size=settings.batch_size,
        n_epochs=settings.epochs,
        learning_rate=_Falling(settings.learning_rate, settings.final_learning_rate),
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


@dataclass(frozen=True)
class _Falling:
    """A learning rate that falls linearly to a share of itself."""

    first: float
    last_share: float

    def __call__(self, progress_left: float) -> float:
        return self.first * (self.last_share + (1.0 - self.last_share) * progress_left)


class _Keeper(BaseCallback):
    """Keeps the log, shows the progress and writes checkpoints, all between updates."""

    def __init__(self, total: int, path: Path | None, seconds: float, progress: bool) -> None:
        super().__init__()
        self._total = total
        self._path = path
        self._pause = seconds
        self._shows = progress
        self._episodes: list[tuple[int, float, int, bool]] = []
        self._earlier = 0.0
        self._began = time.monotonic()
        self._written = self._began
        self._bar: Any = None

    @property
    def _buffer(self) -> TimeDiscountedBuffer:
        return cast(PPO, self.model).rollout_buffer  # pyright: ignore[reportReturnType]

    @property
    def _walkers(self) -> WalkerVecEnv:
        return self.training_env.unwrapped  # pyright: ignore[reportReturnType]

    def log(self) -> TrainingLog:
        steps, returns, lengths, survived = (
            zip(*self._episodes, strict=True) if self._episodes else ((),) * 4
        )
        return TrainingLog(
            steps=np.array(steps, dtype=np.int64),
            returns=np.array(returns, dtype=np.float64),
            lengths=np.array(lengths, dtype=np.int64),
            survived=np.array(survived, dtype=np.bool_),
            seconds=self._earlier + time.monotonic() - self._began,
        )

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Go on with the log of a checkpoint."""
        try:
            columns = [arrays[_LOG + name].tolist() for name in _LOG_COLUMNS]
            self._earlier = float(arrays[_LOG + "seconds"])
        except KeyError as error:
            raise CheckpointError(f"the checkpoint holds no log: {error}") from error
        self._episodes = list(zip(*columns, strict=True))

    def _on_training_start(self) -> None:
        self._began = self._written = time.monotonic()
        self._bar = tqdm(
            total=self._total,
            initial=min(self.num_timesteps, self._total),
            desc="training",
            unit="step",
            unit_scale=True,
            disable=not self._shows,
        )

    def _on_rollout_start(self) -> None:
        """Called between two updates: the one moment at which a state is complete."""
        if self._bar is not None:
            self._bar.update(min(self.num_timesteps, self._total) - self._bar.n)
            if self._episodes:
                recent = self._episodes[-_RECENT:]
                mean = sum(episode[1] for episode in recent) / len(recent)
                self._bar.set_postfix({"return": f"{mean:.1f}"}, refresh=False)
        if time.monotonic() - self._written >= self._pause:
            self._write()

    def _on_step(self) -> bool:
        """Called after each step of the walkers, before the buffer takes it."""
        buffer, walkers = self._buffer, self._walkers
        buffer.durations[buffer.pos] = walkers.step_durations()
        for i in np.flatnonzero(self.locals["dones"]):
            info = self.locals["infos"][i]
            episode = info["episode"]
            self._episodes.append(
                (self.num_timesteps, episode["r"], episode["l"], info["TimeLimit.truncated"])
            )
        return True

    def _on_training_end(self) -> None:
        self._write()
        if self._bar is not None:
            self._bar.update(self._total - self._bar.n)
            self._bar.close()

    def _write(self) -> None:
        if self._path is None:
            return
        log = self.log()
        arrays = capture(cast(PPO, self.model))
        for name in (*_LOG_COLUMNS, "seconds"):
            arrays[_LOG + name] = np.asarray(getattr(log, name))
        write_checkpoint(self._path, arrays)
        self._written = time.monotonic()


_LOG_COLUMNS = ("steps", "returns", "lengths", "survived")
_RECENT = 128  # episodes that the progress bar's mean is of


def _array(tensor: torch.Tensor) -> NDArray[np.float32]:
    return tensor.detach().cpu().numpy().astype(np.float32)


@contextlib.contextmanager
def _torch_threads(threads: int) -> Iterator[None]:
    """Torch's own default is a thread for every core, which small networks only lose by."""
    before = torch.get_num_threads()
    torch.set_num_threads(threads)
    try:
        yield
    finally:
        torch.set_num_threads(before)
