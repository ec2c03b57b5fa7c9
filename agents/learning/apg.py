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
from pathlib import Path

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
from .differentiable import DifferentiableWalkers, Walked, Window, time_discounted_returns
from .learner import LearnerSettings, optimizer_arrays, restore_optimizer
from .recorder import Arrays, EndedEpisode, Recorder, restoring, under

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

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require_counts("window", "critic_epochs", "critic_batches")
        self.require_counts("critic_first", low=0)
        self.require_shares("critic_memory", "trace")
        self.require_positive("critic_learning_rate", "largest_gradient")
        require_number("exploration", self.exploration, 0.0, 10.0, "(]")
        samples = self.walkers * self.window
        if samples % self.critic_batches:
            raise ValueError(
                f"critic_batches must divide the {samples} samples of a window, got {self.critic_batches}"
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
        self.walkers = DifferentiableWalkers(
            task_of(env_id), settings.walked_under(options), settings.walkers, threads=threads
        )
        features = self.walkers.reset(training_seed(seed)).shape[1]
        self.policy = make_policy(features, ACTION_SIZE, settings.hidden, self.generator)
        self.critic = Critic(features, settings.hidden, self.generator)
        self.target = copy.deepcopy(self.critic).requires_grad_(False)
        self.policy_optimizer = _adam(self.policy, settings.learning_rate)
        self.critic_optimizer = _adam(self.critic, settings.critic_learning_rate)

    def learn(self, recorder: Recorder) -> None:
        """Train to the end; see ``Learner``."""
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
        """The policy's numbers. Observations come scaled already: their statistics are those that change nothing."""
        features = self.walkers.observations.shape[1]
        deviation = math.log(self.settings.exploration)
        return layer_weights(self.policy) | {
            "observation_mean": np.zeros(features, dtype=np.float32),
            "observation_variance": np.ones(features, dtype=np.float32),
            "log_std": np.full(ACTION_SIZE, deviation, dtype=np.float32),
        }

    def update(self) -> list[EndedEpisode]:
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
            arrays |= {f"{name}.{k}": v for k, v in optimizer_arrays(optimizer).items()}
        return arrays | {f"walkers.{k}": v for k, v in self.walkers.snapshot().items()}

    def restore(self, arrays: Arrays) -> None:
        """Bring a learner that was made with the same settings to a captured state, or raise ``CheckpointError``."""
        with restoring():
            for name, network in self._networks().items():
                network.load_state_dict(
                    {k: torch.from_numpy(arrays[f"{name}.{k}"]) for k in network.state_dict()}
                )
            for name, optimizer in self._optimizers().items():
                restore_optimizer(optimizer, under(f"{name}.", arrays))
            self.walkers.restore(under("walkers.", arrays))
            self.steps = int(arrays["count.steps"])
            self.generator.set_state(torch.from_numpy(arrays["random.torch"].copy()))

    def _networks(self) -> dict[str, nn.Module]:
        return {"policy": self.policy, "critic": self.critic, "target": self.target}

    def _optimizers(self) -> dict[str, Adam]:
        return {
            "policy_optimizer": self.policy_optimizer,
            "critic_optimizer": self.critic_optimizer,
        }

    def _walk(self) -> tuple[Window, list[EndedEpisode]]:
        """A window of steps by the policy, explored around."""
        self.walkers.cut()
        observations: list[Tensor] = []
        steps: list[Walked] = []
        ended: list[EndedEpisode] = []
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


def _ended(walked: Walked, steps: int) -> list[EndedEpisode]:
    """The episodes that a step ended."""
    return [
        EndedEpisode(
            steps, float(walked.returns[i]), int(walked.lengths[i]), bool(walked.truncated[i])
        )
        for i in torch.nonzero(walked.terminated | walked.truncated).flatten().tolist()
    ]


def perceptron(
    inputs: int, hidden: Sequence[int], outputs: int, last: float, generator: torch.Generator
) -> nn.Sequential:
    """A perceptron with tanh between its layers, begun orthogonally, the last layer scaled by ``last``."""
    sizes = [inputs, *hidden, outputs]
    layers: list[nn.Module] = []
    for k in range(len(sizes) - 1):
        is_last = k == len(sizes) - 2
        layer = nn.Linear(sizes[k], sizes[k + 1])
        gain = last if is_last else math.sqrt(2.0)
        nn.init.orthogonal_(layer.weight, gain, generator=generator)
        nn.init.zeros_(layer.bias)
        layers += [layer] if is_last else [layer, nn.Tanh()]
    return nn.Sequential(*layers)


def make_policy(
    features: int, actions: int, hidden: Sequence[int], generator: torch.Generator
) -> nn.Sequential:
    """A network from observations to actions, which are clipped by who takes them."""
    return perceptron(features, hidden, actions, _LAST_LAYER, generator)


class Critic(nn.Module):
    """What is still to be earned from an observation (..., features), in units of a rate of one over the time constant."""

    def __init__(self, features: int, hidden: Sequence[int], generator: torch.Generator) -> None:
        super().__init__()
        self.network = perceptron(features, hidden, 1, 1.0, generator)

    def forward(self, observations: Tensor) -> Tensor:
        return self.network(observations).squeeze(-1)


def layer_weights(policy: nn.Sequential) -> dict[str, NDArray[np.float32]]:
    """A policy's weights by the names of ``agents.policies.Policy``."""
    layers = [layer for layer in policy if isinstance(layer, nn.Linear)]
    return {
        f"layers.{k}.{name}": tensor.detach().numpy().copy()
        for k, layer in enumerate(layers)
        for name, tensor in (("weight", layer.weight), ("bias", layer.bias))
    }
