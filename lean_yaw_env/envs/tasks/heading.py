"""Heading: walk where you are told. The entry-level steering task."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np

from lean_yaw_env.envs.formulas import closeness, mean_heading, wrapped
from lean_yaw_env.envs.state import Field
from lean_yaw_env.envs.tasks.task import Command, Feature, Metric, Task
from lean_yaw_env.kernel.compilation import formula
from lean_yaw_env.kernel.random import uniform

LARGEST_SLOPE_COMMAND = 0.6  # rad: what the slope gives energy enough for, at a gentle pace
SHORTEST_COMMAND, LONGEST_COMMAND = 40, 79  # steps until the next command
SETTLED = 0.1  # rad
ERROR_SCALE = 0.6  # rad, of the observed error

# Reward per unit of time: for walking at all, for tracking, and against large actions. All but the last keep it positive, so that no walker
# gains by falling.
WALKING_RATE = 0.2
TRACKING_RATE = 0.8
TRACKING_WIDTH = 0.2  # rad; the error at which half of the tracking rate is left
EFFORT_RATE = 0.05


def heading_fields(largest_command: float) -> tuple[Field, ...]:
    """The record of a task that commands headings up to so many rad either side of downhill."""
    return (
        Field("command", "rad", "commanded heading", is_odd=True),
        Field("steps_left", "", "steps that the command still stands", "i8"),
        Field("error_sum", "rad * time units", "absolute heading error times duration"),
        Field("settled_sum", "time units", f"time with an error below {SETTLED}"),
        Field("settling_sum", "time units", "from each new command until first settled"),
        Field("settled_commands", "", "commands that got there", "i8"),
        Field("since_command", "time units", "since the command was given"),
        Field("is_settled", "", "whether this command got there", "i8"),
        Field("commands", "", "commanded so far", "i8"),
        Field("largest_command", "rad", "either side of downhill", initial=largest_command),
    )


@formula
def heading_error(walker: Any, task: Any) -> Any:
    """The commanded heading relative to the mean of the last two footprints'."""
    return wrapped(task.command - mean_heading(walker))


@formula
def new_heading(walker: Any, task: Any) -> None:
    """Draw a heading and how many steps it stands."""
    task.command = uniform(walker, -task.largest_command, task.largest_command)
    task.steps_left = int(np.floor(uniform(walker, SHORTEST_COMMAND, LONGEST_COMMAND + 1.0)))
    task.since_command = 0.0
    task.is_settled = 0
    task.commands += 1


@formula
def follow_heading(walker: Any, task: Any) -> bool:
    """Keep the account of a step's heading error; return whether the step was the command's last."""
    error = abs(heading_error(walker, task))
    task.error_sum += error * walker.duration
    task.since_command += walker.duration
    if error < SETTLED:
        task.settled_sum += walker.duration
        if task.is_settled == 0:
            task.is_settled = 1
            task.settled_commands += 1
            task.settling_sum += task.since_command
    task.steps_left -= 1
    return task.steps_left <= 0


@formula
def reward(walker: Any, task: Any) -> Any:
    rate = (
        WALKING_RATE
        + TRACKING_RATE * closeness(heading_error(walker, task), TRACKING_WIDTH)
        - EFFORT_RATE * walker.effort
    )
    return rate * walker.duration


@formula
def update(walker: Any, task: Any) -> bool:
    if follow_heading(walker, task):
        new_heading(walker, task)
    return False


@formula
def features(walker: Any, task: Any) -> Any:
    return (heading_error(walker, task),)


HEADING_FEATURE = Feature(
    "heading_error",
    ERROR_SCALE,
    "rad",
    "commanded heading less the mean of the last two footprints', within half a turn",
    is_odd=True,
)
HEADING_METRICS = {
    "mean_absolute_heading_error": Metric("error_sum", "time", "rad, over time", "lower"),
    "settled_fraction": Metric(
        "settled_sum", "time", f"of the time, with an error below {SETTLED} rad", "higher"
    ),
    "mean_settling_time": Metric(
        "settling_sum",
        "settled_commands",
        "from a new command to settled, of commands that got there",
    ),
    "commands": Metric("commands", None, "headings commanded so far"),
}
HEADING_COMMAND = Command(("command",), -pi, pi, "heading, rad")

TASK = Task(
    name="Heading",
    fields=heading_fields(LARGEST_SLOPE_COMMAND),
    start=new_heading,
    reward=reward,
    update=update,
    features=features,
    observed=(HEADING_FEATURE,),
    metrics=HEADING_METRICS,
    summary=f"Walk where you are told: a heading within {LARGEST_SLOPE_COMMAND} rad of downhill, commanded anew every "
    f"{SHORTEST_COMMAND} to {LONGEST_COMMAND} steps. The entry level.",
    reward_text=f"{WALKING_RATE} + {TRACKING_RATE} / (1 + (heading error / {TRACKING_WIDTH})^2) - {EFFORT_RATE} effort",
    history=("0: the first.",),
    commands={"command": HEADING_COMMAND},
    heading_field="command",
)
