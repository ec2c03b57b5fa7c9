"""The short-horizon analytic policy gradient: ascend returns through walkers, policy and critic (Xu et al. 2022, arXiv:2204.07137).

As there, gradients flow through a short window of steps, and a critic that is learned beside stands for what comes after. Unlike there,
the critic stands in after every step of the window as well, with weight 1 - lambda, as in Hafner et al. 2020 (arXiv:1912.01603): a
fall is a cliff, whose height no derivative of the steps before shows, but the critic's slope towards it does.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.optim import Adam
from torch.utils.tensorboard import SummaryWriter

from lean_yaw_env.envs.options import ACTION_SIZE, EnvOptions
from lean_yaw_env.validation import require_number

from ..policies.policy_files import task_of
from ..seeds import training_seed
from .differentiable import DifferentiableWalkers, Steps, time_discounted_returns
from .learner import LearnerSettings, captured, float_array, restore
from .recorder import EndedEpisode, Recorder, State, require_like

_LAST_LAYER = 0.01
"""Scale of a policy's last layer at first: it begins near the gait's own command."""
_BETAS = (0.7, 0.95)
"""Adam's, as Xu et al. (2022) have them: exact gradients need less averaging than sampled ones."""


@dataclass(frozen=True)
class GradientSettings(LearnerSettings):
    """Settings of the short-horizon analytic policy gradient, with those of ``LearnerSettings``; layers are tanh.

    Attributes
    ----------
    window : steps that gradients flow through, between two updates of the policy
    critic_learning_rate : of the critic's Adam, at the start; it falls as the policy's does
    critic_epochs : passes over the window's samples for each update
    critic_batches : gradient steps of the critic in a pass
    critic_first : steps before the policy is first changed, in which the critic learns what walking is worth
        From a critic that knows nothing yet, a policy learns to hurry or to dawdle, and some never unlearn it.
    critic_memory : share of the target critic that stays at each update; it gives the values that returns end in
    trace : lambda of the returns: 1 looks at the critic only where a window ends, 0 after every step
    exploration : standard deviation of what is added to actions
    largest_gradient : norm that gradients are clipped to
    """

    steps: int = 100_000
    walkers: int = 64
    time_constant: float = 12.0
    window: int = 32
    critic_learning_rate: float = 3e-3
    critic_epochs: int = 4
    critic_batches: int = 8
    critic_first: int = 16_000
    critic_memory: float = 0.8
    trace: float = 0.99
    exploration: float = 0.05
    largest_gradient: float = 1.0

    @property
    def update_steps(self) -> int:
        return self.walkers * self.window

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require_counts("window", "critic_epochs", "critic_batches")
        self.require_counts("critic_first", low=0)
        self.require_shares("critic_memory", "trace")
        self.require_positive("critic_learning_rate", "largest_gradient")
        require_number("exploration", self.exploration, 0.0, 10.0, "(]")
        if self.update_steps % self.critic_batches:
            raise ValueError(
                f"critic_batches must divide the {self.update_steps} samples of a window, got {self.critic_batches}"
            )


class GradientLearner:
    """Walkers, networks and optimisers of a training; see ``learner.Learner``."""

    activation = "tanh"
    output = "clip"

    def __init__(
        self,
        env_id: str,
        settings: GradientSettings,
        seed: int,
        options: EnvOptions,
        threads: int,
        tensorboard: Path | None = None,
    ) -> None:
        self.settings = settings
        self._tensorboard = tensorboard
        self.steps = 0
        self.generator = torch.Generator().manual_seed(seed)
        walking = settings.training_options(options)
        self.walkers = DifferentiableWalkers(
            task_of(env_id), walking, settings.walkers, threads=threads
        )
        features = self.walkers.reset(training_seed(seed)).shape[1]
        self.policy = perceptron(
            features, settings.hidden, ACTION_SIZE, _LAST_LAYER, self.generator
        )
        self.critic = perceptron(features, settings.hidden, 1, 1.0, self.generator)
        """What is still to be earned from an observation, in units of a rate of one over the time constant."""
        self.target = copy.deepcopy(self.critic).requires_grad_(False)
        self.networks = {"policy": self.policy, "critic": self.critic, "target": self.target}
        self.optimizers = {
            "policy_optimizer": Adam(self.policy.parameters(), betas=_BETAS, fused=True),
            "critic_optimizer": Adam(self.critic.parameters(), betas=_BETAS, fused=True),
        }

    def learn(self, recorder: Recorder) -> None:
        """Train to the end."""
        writer = None if self._tensorboard is None else SummaryWriter(str(self._tensorboard))
        while self.steps < self.settings.steps:
            ended = self.update()
            for episode in ended:
                recorder.add(episode)
            recorder.between_updates(self.steps)
            if writer is not None and ended:
                writer.add_scalar("rollout/ep_rew_mean", recorder.recent_return(), self.steps)
        if writer is not None:
            writer.close()

    def weights(self) -> dict[str, NDArray[np.float32]]:
        """The policy's weights. Observations come scaled already: their statistics are those that change nothing."""
        features = self.walkers.observations.shape[1]
        layers = [layer for layer in self.policy if isinstance(layer, nn.Linear)]
        weights = {
            f"layers.{k}.{part}": float_array(getattr(layer, part))
            for k, layer in enumerate(layers)
            for part in ("weight", "bias")
        }
        return weights | {
            "observation_mean": np.zeros(features, dtype=np.float32),
            "observation_variance": np.ones(features, dtype=np.float32),
            "log_std": np.full(ACTION_SIZE, math.log(self.settings.exploration), dtype=np.float32),
        }

    def update(self) -> list[EndedEpisode]:
        """Walk a window, improve policy and critic by it, and return the episodes that ended in it."""
        settings, constant = self.settings, self.settings.time_constant
        share = settings.learning_rate_share(max(0.0, 1.0 - self.steps / settings.steps))
        window, ended = self._walk()
        next_values = self.target(window.observations.float()).squeeze(-1)
        returns = time_discounted_returns(
            window, constant * next_values.double(), constant, settings.trace
        )
        if self.steps > settings.critic_first:
            self._descend("policy", -returns.mean() / constant, share * settings.learning_rate)
        self._improve_critic(window, returns.detach(), share * settings.critic_learning_rate)
        return ended

    def capture(self) -> State:
        """Networks, optimisers, walkers and random numbers."""
        return {
            **captured(self.networks, self.optimizers),
            "walkers": self.walkers.snapshot(),
            "steps": self.steps,
            "torch": self.generator.get_state(),
        }

    def restore(self, state: Any) -> None:
        """Bring the learner to a captured state."""
        require_like(self.capture(), state)
        restore(self.networks, self.optimizers, state)
        self.walkers.restore(state["walkers"])
        self.steps = int(state["steps"])
        self.generator.set_state(torch.from_numpy(state["torch"]))

    def _walk(self) -> tuple[Steps, list[EndedEpisode]]:
        """A window of steps by the policy with exploration, and the episodes that ended in it."""
        self.walkers.cut()
        steps: list[Steps] = []
        ended: list[EndedEpisode] = []
        for _ in range(self.settings.window):
            means = self.policy(self.walkers.observations.float())
            noise = torch.randn(means.shape, generator=self.generator)
            step = self.walkers.step((means + self.settings.exploration * noise).double())
            self.steps += self.settings.walkers
            steps.append(step)
            for i in torch.nonzero(step.terminated | step.truncated).flatten().tolist():
                row: Any = [each[i].item() for each in (step.returns, step.lengths, step.truncated)]
                ended.append(EndedEpisode(self.steps, *row))
        return Steps(*map(torch.stack, zip(*steps, strict=True))), ended

    def _improve_critic(self, window: Steps, returns: Tensor, learning_rate: float) -> None:
        """Move the critic towards the returns, and the target towards the critic."""
        observations = window.before.detach().float().flatten(0, 1)
        wanted = (returns / self.settings.time_constant).float().flatten()
        for _ in range(self.settings.critic_epochs):
            order = torch.randperm(len(wanted), generator=self.generator)
            for rows in order.chunk(self.settings.critic_batches):
                found = self.critic(observations[rows]).squeeze(-1)
                self._descend("critic", nn.functional.mse_loss(found, wanted[rows]), learning_rate)
        with torch.no_grad():
            share = 1.0 - self.settings.critic_memory
            for kept, new in zip(self.target.parameters(), self.critic.parameters(), strict=True):
                kept.lerp_(new, share)

    def _descend(self, network: str, loss: Tensor, learning_rate: float) -> None:
        optimizer = self.optimizers[f"{network}_optimizer"]
        for group in optimizer.param_groups:
            group["lr"] = learning_rate
        optimizer.zero_grad()
        loss.backward()
        limit = self.settings.largest_gradient
        nn.utils.clip_grad_norm_(self.networks[network].parameters(), limit)
        optimizer.step()


def perceptron(
    inputs: int, hidden: Sequence[int], outputs: int, last: float, generator: torch.Generator
) -> nn.Sequential:
    """A perceptron with tanh between its layers and orthogonal initial weights, the last layer's scaled by ``last``."""
    sizes = [inputs, *hidden, outputs]
    layers: list[nn.Module] = []
    for k, (before, after) in enumerate(pairwise(sizes)):
        layer = nn.Linear(before, after)
        is_last = k == len(hidden)
        nn.init.orthogonal_(layer.weight, last if is_last else math.sqrt(2.0), generator=generator)
        nn.init.zeros_(layer.bias)
        layers += [layer] if is_last else [layer, nn.Tanh()]
    return nn.Sequential(*layers)
