"""Energy: walk straight on the level at a commanded speed, for as little work as possible."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from lean_yaw_env.envs.formulas import closeness, counted_time, positive
from lean_yaw_env.envs.state import Field
from lean_yaw_env.envs.tasks.headings import (
    EACH_TRACKING_RATE,
    HEADING,
    LEVEL,
    LONGEST_COMMAND,
    PUMPING,
    SHORTEST_COMMAND,
    SPEED_ERROR_SCALE,
    SPEED_HEADING,
    SPEED_WIDTH,
    TRACKING_WIDTH,
    WALKING_RATE,
    follow_heading,
    heading_error,
    heading_fields,
    new_heading,
    speed_error,
    speed_features,
)
from lean_yaw_env.envs.tasks.task import FRICTION_LIMIT, NEW, Command, Feature, Metric
from lean_yaw_env.kernel.compilation import formula
from lean_yaw_env.kernel.random import uniform
from lean_yaw_env.parameters import WalkerParameters

# Within a friction limit of 0.6, gaits of constant angle and offset walk from 0.18 to 0.87.
LEAST_SPEED, GREATEST_SPEED = 0.30, 0.80
SPEED_CENTRE, SPEED_SCALE = 0.55, 0.2  # of the observed command
COST_PRICE = 20.0  # per cost of transport


@formula
def energy_start(walker: Any, task: Any) -> None:
    new_heading(walker, task)
    task.commanded_speed = uniform(walker, LEAST_SPEED, GREATEST_SPEED)


@formula
def energy_reward(walker: Any, task: Any) -> Any:
    close = closeness(heading_error(walker, task), TRACKING_WIDTH) + closeness(
        speed_error(walker, task), SPEED_WIDTH
    )
    rate = WALKING_RATE + EACH_TRACKING_RATE * close
    work = positive(walker.shift_work)
    return rate * walker.duration - COST_PRICE * work / task.commanded_speed


@formula
def energy_update(walker: Any, task: Any) -> bool:
    runs_out = follow_heading(walker, task)
    task.speed_error_sum += abs(speed_error(walker, task)) * counted_time(walker)
    if runs_out:
        energy_start(walker, task)
    return False


ENERGY = replace(
    SPEED_HEADING,
    name="Energy",
    fields=(
        *heading_fields(0.0),
        Field("commanded_speed", "", "commanded speed"),
        Field("speed_error_sum", "time units", "absolute speed error times duration"),
    ),
    start=energy_start,
    reward=energy_reward,
    update=energy_update,
    features=speed_features,
    observed=(
        *HEADING.observed,
        Feature("commanded_speed", SPEED_SCALE, "", "commanded speed", SPEED_CENTRE),
        Feature(
            "speed_error",
            SPEED_ERROR_SCALE,
            "",
            "commanded speed less the last step's; zero before the first step",
        ),
    ),
    metrics={
        "cost_of_transport": LEVEL.metrics["cost_of_transport"],
        "mean_absolute_speed_error": Metric("speed_error_sum", "time", "over time", "lower"),
        "mean_absolute_heading_error": HEADING.metrics["mean_absolute_heading_error"],
        "mean_speed": Metric("distance", "time", "distance along the headings over time"),
        "commanded_speed": Metric("commanded_speed", None, "in force"),
    },
    summary="Walk straight on a level floor, as fast as you are told and for as little work as possible, powered by nothing but moving the "
    f"masses from side to side: a speed from {LEAST_SPEED:.2f} to {GREATEST_SPEED:.2f}, commanded anew every {SHORTEST_COMMAND} to "
    f"{LONGEST_COMMAND} units of time. Episodes start near the gait of offsets of {PUMPING} away from the stance foot.",
    reward_text=f"{WALKING_RATE} + {EACH_TRACKING_RATE} / (1 + (heading error / {TRACKING_WIDTH})^2) + {EACH_TRACKING_RATE} / (1 + (speed "
    f"error / {SPEED_WIDTH})^2) - {COST_PRICE:g} (power put into moving the masses) / (commanded speed)",
    history=NEW,
    commands={
        **HEADING.commands,
        "speed": Command(("commanded_speed",), LEAST_SPEED, GREATEST_SPEED, "speed"),
    },
    parameters=WalkerParameters(slope=0.0, friction_limit=FRICTION_LIMIT),
    max_offset_change=0.1,
    pumping=PUMPING,
)
