"""Where the time of PPO goes: physics, observations, policy, Stable-Baselines3's own, and the update of the networks.

The package's own vector environment is measured beside a ``DummyVecEnv`` of single ones, at the settings that ``train.py`` uses, with one thread of torch.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecEnv

from agents.learning.algorithms import settings_for
from agents.learning.ppo import PPOSettings
from benchmarks.environments import HEADING, kernel_alone
from benchmarks.measure import SMALLEST, Effort, Measurement, command_line, measure
from lean_yaw_env.envs.sb3 import WalkerVecEnv

ROLLOUTS = 5
PARTS = Effort(rounds=31, seconds=0.01)


class Clock(BaseCallback):
    """Processor seconds of each rollout and each update."""

    def __init__(self) -> None:
        super().__init__()
        self.rollouts: list[float] = []
        self.updates: list[float] = []
        self._since = 0.0

    def _lap(self) -> float:
        now = time.process_time()
        passed, self._since = now - self._since, now
        return passed

    def _on_rollout_start(self) -> None:
        passed = self._lap()
        if self.rollouts:  # before the first there is no update
            self.updates.append(passed)

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        self.rollouts.append(self._lap())

    def _on_training_end(self) -> None:
        self.updates.append(self._lap())


def learn(env: VecEnv, settings: PPOSettings, steps: int, rollouts: int) -> tuple[PPO, Clock]:
    """Train for some rollouts of ``steps`` at the task's other settings; the first rollout is left out as it warms up."""
    model = PPO(
        "MlpPolicy",
        env,
        n_steps=steps,
        batch_size=min(settings.batch_size, env.num_envs * steps),
        n_epochs=settings.epochs,
        policy_kwargs={"net_arch": list(settings.hidden)},
        device="cpu",
        seed=0,
    )
    clock = Clock()
    model.learn(env.num_envs * steps * (rollouts + 1), clock)
    del clock.rollouts[0], clock.updates[0]
    return model, clock


def _parts(model: PPO, env: WalkerVecEnv, effort: Effort) -> dict[str, float]:
    """Seconds of one step of all walkers: the kernel alone, the environment's step, the policy's forward pass."""
    observations = torch.as_tensor(env.reset())

    def forward() -> Any:
        with torch.no_grad():
            return model.policy.forward(observations)

    chosen = np.clip(forward()[0].numpy(), -1.0, 1.0)
    env.step(chosen)
    cases = {
        "physics": kernel_alone(env.walkers), "env": lambda: env.step(chosen), "policy": forward,
    }  # fmt: skip
    times = measure(cases, effort, "parts of a rollout")
    return {name: times.median(name) for name in cases}


def run(smallest: bool) -> list[Measurement]:
    """All measurements of training, in microseconds of processor time for each walking step collected."""
    settings = settings_for("ppo", "Heading")
    walkers, steps, rollouts = (4, 8, 1) if smallest else (
        settings.walkers, settings.steps_per_update, ROLLOUTS,
    )  # fmt: skip
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        native = WalkerVecEnv(walkers)
        model, clock = learn(native, settings, steps, rollouts)
        _, dummy = learn(make_vec_env(HEADING, walkers), settings, steps, rollouts)
        parts = _parts(model, native, SMALLEST if smallest else PARTS)
    finally:
        torch.set_num_threads(threads)
    per_sample = 1e6 / (walkers * steps)
    collecting = float(np.median(clock.rollouts)) * per_sample
    update = float(np.median(clock.updates)) * per_sample
    dummy_collecting = float(np.median(dummy.rollouts)) * per_sample
    each = {name: seconds * 1e6 / walkers for name, seconds in parts.items()}
    rest = collecting - each["env"] - each["policy"]
    return [
        Measurement("training_physics", each["physics"], "us", note="the batch kernel"),
        Measurement(
            "training_observation", each["env"] - each["physics"], "us",
            note="observation, reward, ends, SB3's infos",
        ),
        Measurement("training_policy", each["policy"], "us", note="forward pass"),
        Measurement("training_bookkeeping", rest, "us", note="SB3's buffer and advantages"),
        Measurement("training_collecting", collecting, "us", note="all of the above"),
        Measurement("training_update", update, "us", note=f"{settings.epochs} epochs of gradient steps"),
        Measurement("training_dummy_collecting", dummy_collecting, "us", note="DummyVecEnv"),
        Measurement("dummy_over_native_collecting", dummy_collecting / collecting, "x", ">=", 4.0),
        Measurement(
            "update_over_collecting", update / collecting, "x", ">=", 1.0, "bound by the update"
        ),
    ]  # fmt: skip


if __name__ == "__main__":
    command_line(run, __doc__)
