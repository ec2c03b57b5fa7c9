"""PPO whose policy remembers: the recurrent PPO of sb3-contrib, with a long short-term memory (LSTM) in front of the policy and of the value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sb3_contrib import RecurrentPPO
from sb3_contrib.common.recurrent.type_aliases import RNNStates
from torch import Tensor, from_numpy

from ..policies.policy import MEMORY
from .experience import TimeDiscountedSequences
from .learner import float_array
from .ppo import PPOLearner, PPOSettings
from .recorder import State


@dataclass(frozen=True)
class RecurrentSettings(PPOSettings):
    """Settings of recurrent PPO, with those of ``PPOSettings``; ``hidden`` are the layers after the memory.

    Attributes
    ----------
    memory : units of the LSTM of the policy, and of that of the value
    """

    steps: int = 1_500_000
    batch_size: int = 4096
    hidden: tuple[int, ...] = (64,)
    memory: int = 64

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require_counts("memory")


class RecurrentLearner(PPOLearner):
    """Recurrent PPO with a discount in time; see ``learner.Learner``."""

    model: Any

    def make_model(self, settings: RecurrentSettings, **common: Any) -> RecurrentPPO:
        arguments = self.network_arguments(settings) | {"lstm_hidden_size": settings.memory}
        model = RecurrentPPO(
            "MlpLstmPolicy", policy_kwargs=arguments, **self.model_arguments(settings), **common
        )
        shape = (settings.steps_per_update, 1, settings.walkers, settings.memory)
        model.rollout_buffer = TimeDiscountedSequences(
            settings.steps_per_update,
            model.observation_space,
            model.action_space,
            shape,
            "cpu",
            gae_lambda=settings.gae_lambda,
            n_envs=settings.walkers,
            time_constant=settings.time_constant,
        )
        return model

    def weights(self) -> dict[str, NDArray[np.float32]]:
        """With the memory's."""
        tensors = self.model.policy.lstm_actor.state_dict()
        bias = tensors["bias_ih_l0"] + tensors["bias_hh_l0"]
        return super().weights() | {
            f"{MEMORY}.input": float_array(tensors["weight_ih_l0"]),
            f"{MEMORY}.state": float_array(tensors["weight_hh_l0"]),
            f"{MEMORY}.bias": float_array(bias),
        }

    def capture(self) -> State:
        """With what the networks remember."""
        states = self.model._last_lstm_states
        memories = {
            f"{name}_{part}": each
            for name, pair in states._asdict().items()
            for part, each in zip(("hidden", "cell"), pair, strict=True)
        }
        return {**super().capture(), "memories": memories}

    def restore(self, state: Any) -> None:
        """Bring the model to a captured state."""
        super().restore(state)

        def pair(name: str) -> tuple[Tensor, Tensor]:
            hidden, cell = (state["memories"][f"{name}_{part}"] for part in ("hidden", "cell"))
            return from_numpy(hidden), from_numpy(cell)

        self.model._last_lstm_states = RNNStates(pair("pi"), pair("vf"))
