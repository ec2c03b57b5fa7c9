"""The gradient agent's two networks: a policy and a critic."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

_LAST_LAYER = 0.01
"""Scale of a policy's last layer at first: it begins near the gait's own command."""


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
