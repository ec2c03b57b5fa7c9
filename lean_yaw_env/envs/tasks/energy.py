"""Energy: walk straight on the level at a commanded speed, for as little work as possible."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from lean_yaw_env.envs.formulas import positive
from lean_yaw_env.envs.tasks.headings import (
    HEADING,
    LEVEL,
    LONGEST_COMMAND,
    PUMPING,
    SHORTEST_COMMAND,
    SPEED_HEADING,
    TRACKING_TEXT,
    heading_fields,
    speed_command,
    speed_fields,
    speed_observed,
    tracking_rate,
)
from lean_yaw_env.envs.tasks.task import FRICTION_LIMIT, NEW, Metric
from lean_yaw_env.kernel.compilation import formula
from lean_yaw_env.parameters import WalkerParameters

# Within a friction limit of 0.6, gaits of constant angle and offset walk from 0.18 to 0.87.
LEAST_SPEED, GREATEST_SPEED = 0.30, 0.80
SPEED_CENTRE, SPEED_SCALE = 0.55, 0.2  # of the observed command
COST_PRICE = 20.0  # per cost of transport


@formula
def energy_reward(walker: Any, task: Any) -> Any:
    work = positive(walker.shift_work)
    rate = tracking_rate(walker, task)
    return rate * walker.duration - COST_PRICE * work / task.commanded_speed


ENERGY = replace(
    SPEED_HEADING,
    name="Energy",
    fields=(*heading_fields(0.0), *speed_fields(LEAST_SPEED, GREATEST_SPEED)),
    reward=energy_reward,
    observed=speed_observed(SPEED_CENTRE, SPEED_SCALE),
    metrics={
        "cost_of_transport": LEVEL.metrics["cost_of_transport"],
        "mean_absolute_speed_error": SPEED_HEADING.metrics["mean_absolute_speed_error"],
        "mean_absolute_heading_error": HEADING.metrics["mean_absolute_heading_error"],
        "mean_speed": Metric("distance", "time", "distance along the headings over time"),
        "commanded_speed": SPEED_HEADING.metrics["commanded_speed"],
    },
    summary="Walk straight on a level floor, as fast as you are told and for as little work as possible, powered by nothing but moving the "
    f"masses from side to side: a speed from {LEAST_SPEED:.2f} to {GREATEST_SPEED:.2f}, commanded anew every {SHORTEST_COMMAND} to "
    f"{LONGEST_COMMAND} units of time. Episodes start near the gait of offsets of {PUMPING} away from the stance foot.",
    reward_text=f"{TRACKING_TEXT} - {COST_PRICE:g} (power put into moving the masses) / (commanded speed)",
    history=NEW,
    commands=speed_command(LEAST_SPEED, GREATEST_SPEED),
    parameters=WalkerParameters(slope=0.0, friction_limit=FRICTION_LIMIT),
    max_offset_change=0.1,
    pumping=PUMPING,
)
