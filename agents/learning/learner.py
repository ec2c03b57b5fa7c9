"""What every learning algorithm has in common: the settings that all of them have, and what a learner can do."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn
from torch.optim import Optimizer

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.validation import require_count, require_number

from ..seeds import MOST_WALKERS
from .recorder import Recorder, State

GAIT_STEP = 0.73
"""Duration of a step in Table 1's gait, in units of sqrt(leg length / gravity)."""


@dataclass(frozen=True)
class LearnerSettings:
    """The settings that every algorithm has; each algorithm has defaults of its own.

    Attributes
    ----------
    steps : environment steps of the training, over all walkers
    walkers : walkers stepped together
    learning_rate : of Adam, at the start
    final_learning_rate : share of it at the end; it falls linearly
    time_constant : simulated time over which rewards are discounted to 1/e (see ``experience``); a step takes 0.73 at the gait
    hidden : units of each hidden layer, of policy and critics alike
    push_level : random pushes in training only, in place of the environment's (``EnvOptions.push_level``); None for the environment's own
        Pushes show the policy states that it would not reach by itself, and leave a margin: without pushes, some trained policies walk so
        close to falling that a few episodes in a thousand end in a fall.
    horizon : of the episodes in training only, in place of the environment's (``EnvOptions.horizon``); None for the environment's own
    """

    steps: int
    walkers: int
    learning_rate: float = 3e-3
    final_learning_rate: float = 0.05
    time_constant: float = 24.0
    hidden: tuple[int, ...] = (64, 64)
    push_level: float | None = None
    horizon: float | None = None

    @property
    def typical_discount(self) -> float:
        """The discount over a step of the gait's duration, where only one number is possible."""
        return math.exp(-GAIT_STEP / self.time_constant)

    @property
    def update_steps(self) -> int:
        """Steps of all walkers between two updates at most: a training may end so many after ``steps``."""
        return self.steps

    def learning_rate_share(self, left: float) -> float:
        """Share of the first learning rate when the share ``left`` of the training is left."""
        return self.final_learning_rate + (1.0 - self.final_learning_rate) * left

    def __post_init__(self) -> None:
        require_count("walkers", self.walkers, 1, MOST_WALKERS)
        self.require_counts("steps")
        self.require_positive("learning_rate", "time_constant")
        self.require_shares("final_learning_rate")
        if self.push_level is not None:
            require_number("push_level", self.push_level, 0.0, 10.0)
        if self.horizon is not None:
            require_number("horizon", self.horizon, 0.0, math.inf, "()")
        if not isinstance(self.hidden, tuple) or not self.hidden:
            raise ValueError(f"hidden must name one layer or more, got {self.hidden!r}")
        for units in self.hidden:
            require_count("units of each layer in hidden", units, 1, 2**16)

    def require_counts(self, *names: str, low: int = 1) -> None:
        """``ValueError`` unless these settings are whole numbers from ``low`` on."""
        for name in names:
            require_count(name, getattr(self, name), low, 10**12)

    def require_positive(self, *names: str) -> None:
        """``ValueError`` unless these settings are above 0."""
        for name in names:
            require_number(name, getattr(self, name), 0.0, math.inf, "()")

    def require_shares(self, *names: str) -> None:
        """``ValueError`` unless these settings lie in [0, 1]."""
        for name in names:
            require_number(name, getattr(self, name), 0.0, 1.0)

    def training_options(self, options: EnvOptions) -> EnvOptions:
        """The environment's options in the training."""
        own = {"push_level": self.push_level, "horizon": self.horizon}
        return replace(options, **{name: each for name, each in own.items() if each is not None})


class Learner(Protocol):
    """A training in progress: the walkers, networks and optimisers of one algorithm.

    It is made of an environment's id, settings, seed, the environment's options, threads, and a folder for TensorBoard's logs or None.

    Attributes
    ----------
    activation, output : of its policy's network, as in ``PolicyCard``
    steps : environment steps done, over all walkers
    """

    activation: str
    output: str

    @property
    def steps(self) -> int: ...

    def capture(self) -> State:
        """Everything that decides how the training continues, between two updates."""
        ...

    def restore(self, state: Any) -> None:
        """Bring a learner that was made with the same settings to a captured state; any ``ValueError`` or ``KeyError`` means that it does not fit."""
        ...

    def learn(self, recorder: Recorder) -> None:
        """Train to the end; pass every episode to the recorder, and call its ``between_updates`` after each update."""
        ...

    def weights(self) -> dict[str, NDArray[np.float32]]:
        """The policy's weights, by the names that ``Policy`` takes."""
        ...


def settings_to_plain(settings: LearnerSettings) -> dict[str, Any]:
    """Settings as JSON holds them."""
    return asdict(settings) | {"hidden": list(settings.hidden)}


def float_array(tensor: torch.Tensor) -> NDArray[np.float32]:
    """A tensor's numbers."""
    return tensor.detach().cpu().numpy().astype(np.float32)


def captured(networks: Mapping[str, nn.Module], optimizers: Mapping[str, Optimizer]) -> State:
    """The states of networks and optimisers, which ``restore`` takes."""
    states = {name: network.state_dict() for name, network in networks.items()}
    return states | {name: each.state_dict()["state"] for name, each in optimizers.items()}


def restore(
    networks: Mapping[str, nn.Module], optimizers: Mapping[str, Optimizer], state: State
) -> None:
    """Bring networks and optimisers to the states that ``captured`` returned."""
    for name, network in networks.items():
        network.load_state_dict({k: torch.from_numpy(v) for k, v in state[name].items()})
    for name, optimizer in optimizers.items():
        parameters = [each for group in optimizer.param_groups for each in group["params"]]
        for index, slots_of_one in state.get(name, {}).items():
            for slot, value in slots_of_one.items():
                if value.shape not in ((), parameters[int(index)].shape):
                    raise ValueError(f"{name}/{index}/{slot} has the shape {value.shape}")
        slots = {
            int(index): {slot: torch.from_numpy(value) for slot, value in each.items()}
            for index, each in state.get(name, {}).items()  # nothing before the first update
        }
        groups = optimizer.state_dict()["param_groups"]
        optimizer.load_state_dict({"state": slots, "param_groups": groups})
