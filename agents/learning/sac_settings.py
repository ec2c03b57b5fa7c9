"""What SAC is trained with: one record of settings for each environment."""

from __future__ import annotations

import math
from dataclasses import dataclass

from agents.learning.ppo_settings import GAIT_STEP
from agents.seeds import MOST_WALKERS
from lean_yaw_env.parameters import require_number
from lean_yaw_env.registration import ENV_IDS


@dataclass(frozen=True)
class SACSettings:
    """Settings of Stable-Baselines3's SAC.

    Attributes
    ----------
    steps : environment steps of the training, over all walkers
    walkers : walkers stepped together
    gradient_steps : updates after each step of all walkers
    batch_size : samples of one update
    buffer_size : steps that are remembered, over all walkers
    random_steps : steps of actions drawn evenly, before the first update
    learning_rate : of Adam, at the start
    final_learning_rate : share of it that is left at the end; it falls linearly
    time_constant : simulated time in which a reward's worth falls to 1/e (see ``rollouts``); a step takes 0.73 at the gait
    target_rate : share of the critics that their slow copies take at each update
    target_entropy : of the actions before they are bounded, in nats; the entropy's weight is what keeps it there
    initial_entropy_weight : that weight at the start
    hidden : units of each hidden layer, rectified, of policy and critics alike
    push_level : random pushes walked under in training only, as in ``PPOSettings``
    """

    steps: int = 300_000
    walkers: int = 64
    gradient_steps: int = 8
    batch_size: int = 512
    buffer_size: int = 200_000
    random_steps: int = 4_096
    learning_rate: float = 1e-3
    final_learning_rate: float = 0.1
    time_constant: float = 24.0
    target_rate: float = 0.01
    target_entropy: float = -4.0
    initial_entropy_weight: float = 0.1
    hidden: tuple[int, ...] = (64, 64)
    push_level: float | None = None

    @property
    def typical_discount(self) -> float:
        """The discount over a step of the gait's duration, where only one number will do."""
        return math.exp(-GAIT_STEP / self.time_constant)

    def __post_init__(self) -> None:
        require_number("walkers", self.walkers, 1, MOST_WALKERS)
        for name in ("steps", "gradient_steps", "batch_size"):
            require_number(name, getattr(self, name), 1, 10**12)
        require_number("buffer_size", self.buffer_size, self.walkers, 10**9)
        require_number("random_steps", self.random_steps, 0, 10**12)
        require_number("final_learning_rate", self.final_learning_rate, 0.0, 1.0)
        require_number("target_rate", self.target_rate, 0.0, 1.0, "(]")
        for name in ("learning_rate", "time_constant", "initial_entropy_weight"):
            require_number(name, getattr(self, name), 0.0, math.inf, "(]")
        require_number("target_entropy", self.target_entropy, -100.0, 100.0)
        if self.push_level is not None:
            require_number("push_level", self.push_level, 0.0, 10.0)
        if not self.hidden or any(units < 1 for units in self.hidden):
            raise ValueError(
                f"hidden must name one layer or more of 1 unit or more, not {self.hidden}"
            )


SETTINGS: dict[str, SACSettings] = {
    # falls under harder pushes are what it learns from, as PPO's settings say
    "LeanYaw/Push-v0": SACSettings(steps=120_000, push_level=0.8),
}
"""Settings that were tuned for an environment."""


def settings_for(env_id: str) -> SACSettings:
    """An environment's settings; the default ones where none were tuned. ``ValueError`` for an id there is not."""
    if env_id not in ENV_IDS:
        raise ValueError(f"env_id must be one of {', '.join(ENV_IDS)}, not {env_id!r}")
    return SETTINGS.get(env_id, SACSettings())
