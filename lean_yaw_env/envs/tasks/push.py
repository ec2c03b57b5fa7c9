"""Push: stay on your feet while you are pushed after every step."""

from __future__ import annotations

from typing import Any

from lean_yaw_env.envs.dynamics import ANKLE_PUSH, PITCH_PUSH
from lean_yaw_env.envs.state import Field
from lean_yaw_env.envs.tasks.task import Metric, Task
from lean_yaw_env.envs.tasks.walk import EFFORT_RATE, WALKING_RATE, reward
from lean_yaw_env.kernel.compilation import formula

TRIAL = 200  # steps
PUSH_LEVEL = 0.5
LARGEST_CHANGE = 0.1  # of the offset: what tells from a gentle one how hard a push can be met


@formula
def update(walker: Any, task: Any) -> bool:
    if walker.steps >= TRIAL:
        task.survived = 1
    return False


TASK = Task(
    name="Push",
    fields=(Field("survived", "", f"whether the walker has made {TRIAL} steps", "i8"),),
    reward=reward,
    update=update,
    metrics={
        "survived_200_steps": Metric("survived", None, f"1 from step {TRIAL} on", "higher", True),
        "time_walked": Metric("time", None, "units of time", "higher"),
    },
    summary="Stay on your feet: after every step both rates get a random impulse, which the next observation shows as part of the rates. "
    f"At push_level = 1 the standard deviations are {PITCH_PUSH} on the pitch rate and {ANKLE_PUSH} on the ankle rate.",
    reward_text=f"{WALKING_RATE} - {EFFORT_RATE} effort",
    history=("0: the first.",),
    horizon=300.0,
    max_offset_change=LARGEST_CHANGE,
    push_level=PUSH_LEVEL,
    headline="survived_200_steps",
)
