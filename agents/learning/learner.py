"""What every learning algorithm has in common: the settings that all have, and what a learner can do."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch.optim import Optimizer

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.validation import require_count, require_number

from ..seeds import MOST_WALKERS
from .recorder import Arrays, Recorder

GAIT_STEP = 0.73
"""Duration of a step in Table 1's gait, in units of sqrt(leg length / gravity)."""
_MANY = 10**12


@dataclass(frozen=True)
class LearnerSettings:
    """The settings that every algorithm has; each names its defaults.

    Attributes
    ----------
    steps : environment steps of the training, over all walkers
    walkers : walkers stepped together
    learning_rate : of Adam, at the start
    final_learning_rate : share of it that is left at the end; it falls linearly
    time_constant : simulated time in which a reward's worth falls to 1/e (see ``experience``); a step takes 0.73 at the gait
    hidden : units of each hidden layer, of policy and critics alike
    push_level : random pushes walked under in training only, in place of the environment's (``EnvOptions.push_level``)
        They show the policy states that it would not come to by itself, and leave a margin: without pushes, some trained policies keep so
        close to falling that a few episodes in a thousand end so. None leaves the environment as it is.
    """

    steps: int
    walkers: int
    learning_rate: float = 3e-3
    final_learning_rate: float = 0.05
    time_constant: float = 24.0
    hidden: tuple[int, ...] = (64, 64)
    push_level: float | None = None

    @property
    def typical_discount(self) -> float:
        """The discount over a step of the gait's duration, where only one number will do."""
        return math.exp(-GAIT_STEP / self.time_constant)

    def __post_init__(self) -> None:
        require_count("walkers", self.walkers, 1, MOST_WALKERS)
        self.require_counts("steps")
        self.require_positive("learning_rate", "time_constant")
        self.require_shares("final_learning_rate")
        if self.push_level is not None:
            require_number("push_level", self.push_level, 0.0, 10.0)
        if not self.hidden or any(units < 1 for units in self.hidden):
            raise ValueError(
                f"hidden must name one layer or more of 1 unit or more, got {self.hidden}"
            )

    def require_counts(self, *names: str, low: int = 1) -> None:
        """``ValueError`` unless these settings are whole numbers from ``low`` on."""
        for name in names:
            require_count(name, getattr(self, name), low, _MANY)

    def require_positive(self, *names: str) -> None:
        """``ValueError`` unless these settings are above 0."""
        for name in names:
            require_number(name, getattr(self, name), 0.0, math.inf, "()")

    def require_shares(self, *names: str) -> None:
        """``ValueError`` unless these settings lie in [0, 1]."""
        for name in names:
            require_number(name, getattr(self, name), 0.0, 1.0)

    def walked_under(self, options: EnvOptions) -> EnvOptions:
        """The environment's options in the training."""
        return options if self.push_level is None else replace(options, push_level=self.push_level)


class Learner(Protocol):
    """A training in progress: the walkers, networks and optimisers of one algorithm.

    Attributes
    ----------
    activation, output : of its policy's network, as in ``PolicyCard``
    steps : environment steps done, over all walkers
    """

    activation: str
    output: str

    @property
    def steps(self) -> int: ...

    def capture(self) -> Arrays:
        """All that decides how the training goes on, between two updates."""
        ...

    def restore(self, arrays: Arrays) -> None:
        """Bring a learner that was made with the same settings to a captured state, or raise ``CheckpointError``."""
        ...

    def learn(self, recorder: Recorder) -> None:
        """Train to the end; tell the recorder of every episode, and when an update is done."""
        ...

    def weights(self) -> dict[str, NDArray[np.float32]]:
        """The policy's numbers, by the names that ``Policy`` takes."""
        ...


MakeLearner = Callable[[str, Any, int, EnvOptions, int, "Path | None"], Learner]
"""Makes a learner of an environment's id, settings, seed, the environment's options, threads and a folder for TensorBoard's logs or None."""


def settings_to_plain(settings: LearnerSettings) -> dict[str, Any]:
    """Settings as JSON holds them."""
    return asdict(settings) | {"hidden": list(settings.hidden)}


def float_array(tensor: torch.Tensor) -> NDArray[np.float32]:
    """A tensor's numbers."""
    return tensor.detach().cpu().numpy().astype(np.float32)


def optimizer_arrays(optimizer: Optimizer) -> Arrays:
    """An optimiser's state, as ``<parameter>.<slot>``."""
    return {
        f"{index}.{slot}": value.detach().cpu().numpy().copy()
        for index, slots in optimizer.state_dict()["state"].items()
        for slot, value in slots.items()
    }


def restore_optimizer(optimizer: Optimizer, arrays: Arrays) -> None:
    """Bring an optimiser to the state that ``optimizer_arrays`` gave."""
    state: dict[int, dict[str, torch.Tensor]] = {}
    for name, value in arrays.items():
        index, slot = name.split(".")
        state.setdefault(int(index), {})[slot] = torch.from_numpy(value.copy())
    groups = optimizer.state_dict()["param_groups"]
    optimizer.load_state_dict({"state": state, "param_groups": groups})


@contextlib.contextmanager
def torch_threads(threads: int) -> Iterator[None]:
    """Torch's own default is a thread for every core, which small networks only lose by."""
    before = torch.get_num_threads()
    torch.set_num_threads(threads)
    try:
        yield
    finally:
        torch.set_num_threads(before)
