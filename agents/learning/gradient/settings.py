"""What the gradient agent is trained with: one record of settings for each environment."""

from __future__ import annotations

import math
from dataclasses import dataclass

from agents.learning.gradient.tasks import formulas_of
from agents.policies.storage import task_of
from agents.seeds import MOST_WALKERS
from lean_yaw_env.parameters import require_number
from lean_yaw_env.registration import ENV_IDS


@dataclass(frozen=True)
class GradientSettings:
    """Settings of the short-horizon analytic policy gradient.

    Attributes
    ----------
    steps : environment steps of the training, over all walkers
    walkers : walkers stepped together
    window : steps that gradients flow through, between two updates of the policy
    learning_rate : of the policy's Adam, at the start
    critic_learning_rate : of the critic's
    final_learning_rate : share of both that is left at the end; they fall linearly
    critic_epochs : passes over the window's samples for each update
    critic_batches : gradient steps of the critic in a pass
    critic_first : steps before the policy is first changed, in which the critic learns what walking is worth
        From a critic that knows nothing yet, a policy learns to hurry or to dawdle, and some never unlearn it.
    critic_memory : share of the target critic that stays at each update; it gives the values that returns end in
    time_constant : simulated time in which a reward's worth falls to 1/e; a step takes 0.73 at the gait
    trace : lambda of the returns: 1 looks at the critic only where a window ends, 0 after every step
    exploration : standard deviation of what is added to actions
    largest_gradient : norm that gradients are clipped to
    hidden : units of each hidden layer, tanh, of policy and critic alike
    push_level : random pushes walked under in training only, in place of the environment's (``EnvOptions.push_level``)
        They show the policy states that it would not come to by itself. None leaves the environment as it is.
    """

    steps: int = 100_000
    walkers: int = 64
    window: int = 32
    learning_rate: float = 3e-3
    critic_learning_rate: float = 3e-3
    final_learning_rate: float = 0.05
    critic_epochs: int = 4
    critic_batches: int = 8
    critic_first: int = 16_000
    critic_memory: float = 0.8
    time_constant: float = 12.0
    trace: float = 0.99
    exploration: float = 0.05
    largest_gradient: float = 1.0
    hidden: tuple[int, ...] = (64, 64)
    push_level: float | None = None

    def __post_init__(self) -> None:
        require_number("walkers", self.walkers, 1, MOST_WALKERS)
        for name in ("steps", "window", "critic_epochs", "critic_batches"):
            require_number(name, getattr(self, name), 1, 10**12)
        require_number("critic_first", self.critic_first, 0, 10**12)
        for name in ("final_learning_rate", "critic_memory", "trace"):
            require_number(name, getattr(self, name), 0.0, 1.0)
        for name in ("learning_rate", "critic_learning_rate", "time_constant", "largest_gradient"):
            require_number(name, getattr(self, name), 0.0, math.inf, "(]")
        require_number("exploration", self.exploration, 0.0, 10.0, "(]")
        if self.push_level is not None:
            require_number("push_level", self.push_level, 0.0, 10.0)
        if not self.hidden or any(units < 1 for units in self.hidden):
            raise ValueError(
                f"hidden must name one layer or more of 1 unit or more, not {self.hidden}"
            )
        if (self.walkers * self.window) % self.critic_batches:
            raise ValueError(
                f"critic_batches must divide the {self.walkers * self.window} samples of a window, not {self.critic_batches}"
            )


SETTINGS: dict[str, GradientSettings] = {
    "LeanYaw/SpeedHeading-v0": GradientSettings(steps=600_000),
    # under the task's own pushes falls end most windows, and half the policies fell
    "LeanYaw/Slalom-v0": GradientSettings(steps=400_000, window=48, push_level=0.05),
}
"""Settings that were tuned for an environment."""


def settings_for(env_id: str) -> GradientSettings:
    """An environment's settings; the default ones where none were tuned.

    Raises
    ------
    ValueError
        For an id there is not, or a task without differentiable formulas.
    """
    if env_id not in ENV_IDS:
        raise ValueError(f"env_id must be one of {', '.join(ENV_IDS)}, not {env_id!r}")
    formulas_of(task_of(env_id))
    return SETTINGS.get(env_id, GradientSettings())
