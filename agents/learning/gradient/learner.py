"""The short-horizon analytic policy gradient: ascend returns through walkers, policy and critic (Xu et al. 2022, arXiv:2204.07137).

As there, gradients flow through a short window of steps, and a critic that is learned beside stands for what comes after. Unlike there,
the critic stands in after every step of the window as well, with weight 1 - lambda, as in Hafner et al. 2020 (arXiv:1912.01603): a
fall is a cliff, whose height no derivative of the steps before shows, but the critic's slope towards it does.
"""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn
from torch.optim import Adam

from agents.learning.checkpoint import Arrays, refused_as_another_s
from agents.learning.gradient.networks import Critic, make_policy
from agents.learning.gradient.returns import Window, time_discounted_returns
from agents.learning.gradient.settings import GradientSettings
from agents.learning.gradient.walkers import DifferentiableWalkers, Walked
from agents.policies.storage import task_of
from agents.seeds import training_seed
from lean_yaw_env.envs.options import ACTION_SIZE, EnvOptions

_BETAS = (0.7, 0.95)
"""Adam's, as Xu et al. (2022) have them: exact gradients need less averaging than sampled ones."""


class Ended(NamedTuple):
    """An episode that has ended."""

    steps: int
    value: float
    length: int
    survived: bool


class Learner:
    """Walkers, networks and optimisers of a training.

    Parameters
    ----------
    env_id, settings, seed, options, threads : as ``train_gradient``

    Attributes
    ----------
    steps : environment steps done, over all walkers
    """

    def __init__(
        self, env_id: str, settings: GradientSettings, seed: int, options: EnvOptions, threads: int
    ) -> None:
        if settings.push_level is not None:
            options = replace(options, push_level=settings.push_level)
        self.settings = settings
        self.steps = 0
        self.generator = torch.Generator().manual_seed(seed)
        self.walkers = DifferentiableWalkers(
            task_of(env_id), options, settings.walkers, threads=threads
        )
        features = self.walkers.reset(training_seed(seed)).shape[1]
        self.policy = make_policy(features, ACTION_SIZE, settings.hidden, self.generator)
        self.critic = Critic(features, settings.hidden, self.generator)
        self.target = copy.deepcopy(self.critic).requires_grad_(False)
        self.policy_optimizer = _adam(self.policy, settings.learning_rate)
        self.critic_optimizer = _adam(self.critic, settings.critic_learning_rate)

    def update(self) -> list[Ended]:
        """Walk a window, improve policy and critic by it, and return the episodes that ended in it."""
        self._set_learning_rates()
        window, ended = self._walk()
        next_values = self.target(window.next_observations.float())
        constant = self.settings.time_constant
        returns = time_discounted_returns(
            window, constant * next_values.double(), constant, self.settings.trace
        )
        if self.steps > self.settings.critic_first:
            self._descend(self.policy_optimizer, self.policy, -returns.mean() / constant)
        self._improve_critic(window, returns.detach())
        return ended

    def capture(self) -> Arrays:
        """All that decides how the training goes on, between two updates."""
        arrays: Arrays = {
            "count.steps": np.array(self.steps),
            "random.torch": self.generator.get_state().numpy(),
        }
        for name, network in self._networks().items():
            arrays |= {f"{name}.{k}": v.numpy().copy() for k, v in network.state_dict().items()}
        for name, optimizer in self._optimizers().items():
            for index, slots in optimizer.state_dict()["state"].items():
                arrays |= {f"{name}.{index}.{k}": v.numpy().copy() for k, v in slots.items()}
        return arrays | {f"walkers.{k}": v for k, v in self.walkers.snapshot().items()}

    def restore(self, arrays: Arrays) -> None:
        """Bring a learner that was made with the same settings to a captured state, or raise ``CheckpointError``."""
        with refused_as_another_s():
            for name, network in self._networks().items():
                network.load_state_dict(
                    {k: torch.from_numpy(arrays[f"{name}.{k}"]) for k in network.state_dict()}
                )
            for name, optimizer in self._optimizers().items():
                _restore_optimizer(optimizer, _under(name, arrays))
            self.walkers.restore(_under("walkers", arrays))
            self.steps = int(arrays["count.steps"])
            self.generator.set_state(torch.from_numpy(arrays["random.torch"].copy()))

    def _networks(self) -> dict[str, nn.Module]:
        return {"policy": self.policy, "critic": self.critic, "target": self.target}

    def _optimizers(self) -> dict[str, Adam]:
        return {
            "policy_optimizer": self.policy_optimizer,
            "critic_optimizer": self.critic_optimizer,
        }

    def _walk(self) -> tuple[Window, list[Ended]]:
        """A window of steps by the policy, explored around."""
        self.walkers.cut()
        observations: list[Tensor] = []
        steps: list[Walked] = []
        ended: list[Ended] = []
        for _ in range(self.settings.window):
            observed = self.walkers.observations
            walked = self.walkers.step(self._act(observed))
            self.steps += self.settings.walkers
            observations.append(observed)
            steps.append(walked)
            ended += _ended(walked, self.steps)
        return Window.of(observations, steps), ended

    def _act(self, observed: Tensor) -> Tensor:
        """The policy's actions (n, 2), and what is added to them to explore."""
        means = self.policy(observed.float())
        noise = torch.randn(means.shape, generator=self.generator)
        return (means + self.settings.exploration * noise).double()

    def _improve_critic(self, window: Window, returns: Tensor) -> None:
        """Bring the critic nearer to the returns, and the target nearer to the critic."""
        observations = window.observations.detach().float().flatten(0, 1)
        wanted = (returns / self.settings.time_constant).float().flatten()
        for _ in range(self.settings.critic_epochs):
            order = torch.randperm(len(wanted), generator=self.generator)
            for rows in order.chunk(self.settings.critic_batches):
                loss = nn.functional.mse_loss(self.critic(observations[rows]), wanted[rows])
                self._descend(self.critic_optimizer, self.critic, loss)
        with torch.no_grad():
            share = 1.0 - self.settings.critic_memory
            for kept, new in zip(self.target.parameters(), self.critic.parameters(), strict=True):
                kept.lerp_(new, share)

    def _descend(self, optimizer: Adam, network: nn.Module, loss: Tensor) -> None:
        optimizer.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), self.settings.largest_gradient)
        optimizer.step()

    def _set_learning_rates(self) -> None:
        """Both learning rates fall linearly to a share of themselves."""
        last, settings = self.settings.final_learning_rate, self.settings
        share = last + (1.0 - last) * max(0.0, 1.0 - self.steps / settings.steps)
        for optimizer, first in (
            (self.policy_optimizer, settings.learning_rate),
            (self.critic_optimizer, settings.critic_learning_rate),
        ):
            for group in optimizer.param_groups:
                group["lr"] = share * first


def _adam(network: nn.Module, learning_rate: float) -> Adam:
    return Adam(network.parameters(), learning_rate, _BETAS, fused=True)


def _under(name: str, arrays: Arrays) -> Arrays:
    """The arrays whose names begin so, without that beginning."""
    prefix = f"{name}."
    return {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}


def _restore_optimizer(optimizer: Adam, arrays: Arrays) -> None:
    state: dict[int, dict[str, Tensor]] = {}
    for name, value in arrays.items():
        index, slot = name.split(".")
        state.setdefault(int(index), {})[slot] = torch.from_numpy(value.copy())
    groups = optimizer.state_dict()["param_groups"]
    optimizer.load_state_dict({"state": state, "param_groups": groups})


def _ended(walked: Walked, steps: int) -> list[Ended]:
    """The episodes that a step ended."""
    return [
        Ended(steps, float(walked.returns[i]), int(walked.lengths[i]), bool(walked.truncated[i]))
        for i in torch.nonzero(walked.terminated | walked.truncated).flatten().tolist()
    ]
