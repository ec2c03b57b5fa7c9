"""Level: walk without a slope, or up one, by moving the masses from side to side, and steer."""

from __future__ import annotations

from typing import Any

from lean_yaw_env.envs.formulas import closeness, positive
from lean_yaw_env.envs.tasks.heading import (
    HEADING_COMMAND,
    HEADING_FEATURE,
    HEADING_METRICS,
    LARGEST_SLOPE_COMMAND,
    LONGEST_COMMAND,
    SHORTEST_COMMAND,
    TRACKING_WIDTH,
    features,
    heading_error,
    heading_fields,
    new_heading,
    update,
)
from lean_yaw_env.envs.tasks.task import Metric, Task
from lean_yaw_env.kernel.compilation import formula
from lean_yaw_env.parameters import WalkerParameters

PUMPING = 0.03  # mass offset of the gait in which episodes start, away from the stance foot

# Reward per unit of time for walking at all and for tracking; per leg length walked; against work, in weight times leg length.
WALKING_RATE = 0.2
TRACKING_RATE = 0.5
PROGRESS = 0.5
WORK_PRICE = 5.0


@formula
def reward(walker: Any, task: Any) -> Any:
    rate = WALKING_RATE + TRACKING_RATE * closeness(heading_error(walker, task), TRACKING_WIDTH)
    work = positive(walker.shift_work)
    return rate * walker.duration + PROGRESS * walker.advance - WORK_PRICE * work


TASK = Task(
    name="Level",
    fields=heading_fields(LARGEST_SLOPE_COMMAND),
    start=new_heading,
    reward=reward,
    update=update,
    features=features,
    observed=(HEADING_FEATURE,),
    metrics={
        **HEADING_METRICS,
        "mean_speed": Metric("distance", "time", "distance along the headings over time", "higher"),
        "cost_of_transport": Metric(
            "work",
            "distance",
            "work per weight and distance; of a step's work, what is positive",
            "lower",
        ),
    },
    summary="Walk on a level floor, or up a gentle slope (`slope=-0.005`), powered by nothing but moving the masses from side to side, and "
    f"steer: a heading within {LARGEST_SLOPE_COMMAND} rad, commanded anew every {SHORTEST_COMMAND} to {LONGEST_COMMAND} steps. Episodes "
    f"start near the gait of offsets of {PUMPING} away from the stance foot.",
    reward_text=f"{WALKING_RATE} + {TRACKING_RATE} / (1 + (heading error / {TRACKING_WIDTH})^2) + {PROGRESS} speed - {WORK_PRICE:g} (power put "
    "into moving the masses)",
    history=("0: the first.",),
    commands={"command": HEADING_COMMAND},
    heading_field="command",
    parameters=WalkerParameters(slope=0.0),
    max_offset_change=0.1,
    pumping=PUMPING,
)
