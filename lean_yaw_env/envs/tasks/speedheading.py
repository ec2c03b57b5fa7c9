"""SpeedHeading: walk where and as fast as you are told."""

from __future__ import annotations

from typing import Any

from lean_yaw_env.envs.formulas import closeness
from lean_yaw_env.envs.state import Field
from lean_yaw_env.envs.tasks.heading import (
    EFFORT_RATE,
    HEADING_COMMAND,
    HEADING_FEATURE,
    HEADING_METRICS,
    LARGEST_SLOPE_COMMAND,
    LONGEST_COMMAND,
    SHORTEST_COMMAND,
    TRACKING_WIDTH,
    WALKING_RATE,
    follow_heading,
    heading_error,
    heading_fields,
    new_heading,
)
from lean_yaw_env.envs.tasks.task import Command, Feature, Metric, Task
from lean_yaw_env.kernel.compilation import formula
from lean_yaw_env.kernel.random import uniform

# On a slope of 0.01 the gait walks at 0.68 with an inter-leg angle of 0.15 and at 0.25 with one of 0.45; 0.6 rad off downhill at 0.60
# and 0.10: all these commands are within reach of the default action.
LEAST_SPEED, GREATEST_SPEED = 0.30, 0.55
SPEED_CENTRE, SPEED_SCALE = 0.42, 0.1  # of the observed command
SPEED_ERROR_SCALE = 0.1

TRACKING_RATE = 0.4  # for each of the two
SPEED_WIDTH = 0.05  # the speed error at which half of its tracking rate is left


@formula
def start(walker: Any, task: Any) -> None:
    new_heading(walker, task)
    task.commanded_speed = uniform(walker, LEAST_SPEED, GREATEST_SPEED)


@formula
def speed_error(walker: Any, task: Any) -> Any:
    """The commanded speed relative to the last step's."""
    return task.commanded_speed - walker.speed


@formula
def reward(walker: Any, task: Any) -> Any:
    close = closeness(heading_error(walker, task), TRACKING_WIDTH) + closeness(
        speed_error(walker, task), SPEED_WIDTH
    )
    rate = WALKING_RATE + TRACKING_RATE * close - EFFORT_RATE * walker.effort
    return rate * walker.duration


@formula
def update(walker: Any, task: Any) -> bool:
    runs_out = follow_heading(walker, task)
    task.speed_error_sum += abs(speed_error(walker, task)) * walker.duration
    if runs_out:
        start(walker, task)
    return False


@formula
def features(walker: Any, task: Any) -> Any:
    error = speed_error(walker, task)
    return (
        heading_error(walker, task),
        task.commanded_speed,
        error if walker.steps > 0 else 0.0 * error,
    )


TASK = Task(
    name="SpeedHeading",
    fields=(
        *heading_fields(LARGEST_SLOPE_COMMAND),
        Field("commanded_speed", "", "commanded speed"),
        Field("speed_error_sum", "time units", "absolute speed error times duration"),
    ),
    start=start,
    reward=reward,
    update=update,
    features=features,
    observed=(
        HEADING_FEATURE,
        Feature("commanded_speed", SPEED_SCALE, "", "commanded speed", SPEED_CENTRE),
        Feature(
            "speed_error",
            SPEED_ERROR_SCALE,
            "",
            "commanded speed less the last step's; zero before the first step",
        ),
    ),
    metrics={
        **HEADING_METRICS,
        "mean_absolute_speed_error": Metric("speed_error_sum", "time", "over time", "lower"),
        "commanded_speed": Metric("commanded_speed", None, "in force"),
    },
    summary=f"Walk where and as fast as you are told: a heading within {LARGEST_SLOPE_COMMAND} rad of downhill and a speed from "
    f"{LEAST_SPEED:.2f} to {GREATEST_SPEED:.2f}, commanded anew together every {SHORTEST_COMMAND} to {LONGEST_COMMAND} steps.",
    reward_text=f"{WALKING_RATE} + {TRACKING_RATE} / (1 + (heading error / {TRACKING_WIDTH})^2) + {TRACKING_RATE} / (1 + (speed error / "
    f"{SPEED_WIDTH})^2) - {EFFORT_RATE} effort",
    history=("0: the first.",),
    commands={
        "command": HEADING_COMMAND,
        "speed": Command(("commanded_speed",), LEAST_SPEED, GREATEST_SPEED, "speed"),
    },
    heading_field="command",
)
