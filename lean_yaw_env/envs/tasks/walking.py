"""Walk and Metastable: keep walking; and keep walking as long as you can while you are pushed after every step."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from lean_yaw_env.envs.dynamics import ANKLE_PUSH, PITCH_PUSH
from lean_yaw_env.envs.tasks.task import FIRST, FRICTION_LIMIT, SINCE_VERSION_1, Metric, Task
from lean_yaw_env.kernel.compilation import formula
from lean_yaw_env.parameters import WalkerParameters

# Reward per unit of time: for walking, and against large actions.
WALKING_RATE = 1.0
EFFORT_RATE = 0.05


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
    history=(FIRST, f"1: {SINCE_VERSION_1}."),
    parameters=WalkerParameters(friction_limit=FRICTION_LIMIT),
    is_ranked=False,
)


METASTABLE = replace(
    WALK,
    name="Metastable",
    metrics={"time_walked": WALK.metrics["time_walked"]},
    summary="Stay on your feet under pushes that never stop: after every step both rates get a random impulse, which the next observation shows "
    f"as part of the rates. At push_level = 1 the standard deviations are {PITCH_PUSH} on the pitch rate and {ANKLE_PUSH} on the ankle rate. "
    "Every walker falls in the end: its score is the mean time to a fall, all simulated time over the number of falls.",
    history=("1: in place of Push, which asked for 200 steps under weaker pushes.",),
    parameters=WalkerParameters(friction_limit=FRICTION_LIMIT),
    horizon=20_000.0,
    max_offset_change=0.1,  # a small one would limit how hard a push can be met
    push_level=0.8,
    headline="time_per_fall",
    is_ranked=True,
)
