"""Walk and Push: keep walking; and keep walking while you are pushed after every step."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from lean_yaw_env.envs.dynamics import ANKLE_PUSH, PITCH_PUSH
from lean_yaw_env.envs.state import Field
from lean_yaw_env.envs.tasks.task import FIRST, TO_THE_HORIZON, Metric, Task
from lean_yaw_env.kernel.compilation import formula

# Reward per unit of time: for walking, and against large actions.
WALKING_RATE = 1.0
EFFORT_RATE = 0.05
TRIAL = 200  # steps


@formula
def reward(walker: Any, task: Any) -> Any:
    rate = WALKING_RATE - EFFORT_RATE * walker.effort
    return rate * walker.duration


WALK = Task(
    name="Walk",
    reward=reward,
    metrics={
        "time_walked": Metric("time", None, "units of time", "higher"),
        "distance": Metric("distance", None, "leg lengths, along the headings", "higher"),
    },
    summary="Keep walking; nothing is commanded. A smoke test, which ranks nobody.",
    reward_text=f"{WALKING_RATE} - {EFFORT_RATE} effort",
    history=(FIRST, f"1: {TO_THE_HORIZON}."),
    is_ranked=False,
)


@formula
def note_survival(walker: Any, task: Any) -> bool:
    if walker.steps >= TRIAL:
        task.survived = 1
    return False


PUSH = replace(
    WALK,
    name="Push",
    fields=(Field("survived", "", f"whether the walker has made {TRIAL} steps", "i8"),),
    update=note_survival,
    metrics={
        "survived_200_steps": Metric("survived", None, f"1 from step {TRIAL} on", "higher", True),
        "time_walked": WALK.metrics["time_walked"],
    },
    summary="Stay on your feet: after every step both rates get a random impulse, which the next observation shows as part of the rates. "
    f"At push_level = 1 the standard deviations are {PITCH_PUSH} on the pitch rate and {ANKLE_PUSH} on the ankle rate.",
    horizon=300.0,
    max_offset_change=0.1,  # a small one would limit how hard a push can be met
    push_level=0.5,
    headline="survived_200_steps",
    is_ranked=True,
)
