"""SAC with hindsight experience replay (Andrychowicz et al. 2017) on WaypointGoal, where only reaching the goal is paid.

The policy sees what every agent sees at this task, the goal's bearing and distance. The buffer keeps places, so that goals can be relabelled.
Observations are scaled as the environment gives them: statistics of the first random walks tell nothing of later ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from stable_baselines3.common.vec_env import VecNormalize

from lean_yaw_env.envs.hindsight import GoalFromWalker
from lean_yaw_env.envs.sb3 import WalkerVecEnv
from lean_yaw_env.registration import GOAL_ENV_ID
from lean_yaw_env.validation import require_choice

from .experience import TimeDiscountedHindsight
from .learner import LearnerSettings
from .sac import SACLearner, SACSettings


@dataclass(frozen=True)
class HERSettings(SACSettings):
    """Settings of SAC with hindsight, with those of ``SACSettings``.

    A return is at most 1. ``initial_entropy_weight`` is therefore small: with Stable-Baselines3's 1, some thousand updates go by before
    values tell of goals rather than of entropy. ``random_steps`` must let some walker end its first episode.

    Attributes
    ----------
    relabelled : samples with a goal from the rest of their episode, for each one with its own goal
    """

    steps: int = 60_000
    walkers: int = 16
    time_constant: float = 72.0
    gradient_steps: int = 8
    batch_size: int = 256
    target_entropy: float = -2.0
    initial_entropy_weight: float = 0.02
    relabelled: int = 4

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require_counts("relabelled")


class HERLearner(SACLearner):
    """SAC that learns from goals it came to by chance; see ``learner.Learner``."""

    network = "MultiInputPolicy"
    replay = TimeDiscountedHindsight

    def environment(self, env_id: str) -> str:
        """The one with dictionaries for observations."""
        return require_choice("env_id", env_id, (GOAL_ENV_ID,))

    def normalised(self, walkers: WalkerVecEnv, settings: LearnerSettings) -> VecNormalize:
        """The walkers as they are: nothing is normalised."""
        return VecNormalize(walkers, norm_obs=False, norm_reward=False)

    def network_arguments(self, settings: Any) -> dict[str, Any]:
        """With the view from the walker."""
        return super().network_arguments(settings) | {
            "features_extractor_class": GoalFromWalker,
            "features_extractor_kwargs": {"mirror": self.options.mirror},
        }

    def replay_arguments(self, settings: Any) -> dict[str, Any]:
        """With the share of relabelled goals: later places of the same episode."""
        return super().replay_arguments(settings) | {"n_sampled_goal": settings.relabelled}
