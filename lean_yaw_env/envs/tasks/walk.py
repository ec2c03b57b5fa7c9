"""Walk: keep walking, no command."""

from __future__ import annotations

from typing import Any

from lean_yaw_env.envs.tasks.task import Metric, Task
from lean_yaw_env.kernel.compilation import formula

# Reward per unit of time: for walking, and against large actions.
WALKING_RATE = 1.0
EFFORT_RATE = 0.05


@formula
def reward(walker: Any, task: Any) -> Any:
    rate = WALKING_RATE - EFFORT_RATE * walker.effort
    return rate * walker.duration


TASK = Task(
    name="Walk",
    reward=reward,
    metrics={
        "time_walked": Metric("time", None, "units of time", "higher"),
        "distance": Metric("distance", None, "leg lengths, along the headings", "higher"),
    },
    summary="Keep walking; nothing is commanded.",
    reward_text=f"{WALKING_RATE} - {EFFORT_RATE} effort",
    history=("0: the first.",),
)
