"""Heading: walk where you are told. The entry-level steering task."""

from __future__ import annotations

from math import pi

import numpy as np

from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.running import run_many, run_one, start_row
from lean_yaw_env.envs.tasks.task import Command, Feature, Metric, Task
from lean_yaw_env.envs.transition import effort, limited, mean_heading, mirror_sign, wrapped
from lean_yaw_env.kernel.compilation import entry_point, inlined
from lean_yaw_env.kernel.random import uniform

# Where the task keeps its numbers; tasks that command a heading as well use the same
COMMAND = c.TASK
STEPS_LEFT = c.TASK + 1
ERROR_SUM = c.TASK + 2  # absolute heading error times duration
SETTLED_SUM = c.TASK + 3  # time with an error below SETTLED
SETTLING_SUM = c.TASK + 4  # time from each new command until first settled, of those that got there
SETTLED_COMMANDS = c.TASK + 5
SINCE_COMMAND = c.TASK + 6
IS_SETTLED = c.TASK + 7
COMMANDS = c.TASK + 8
HEADING_END = c.TASK + 9  # the first column left to others
LARGEST_COMMAND = c.TASK_CONSTANTS  # rad, either side of downhill
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


@inlined
def new_heading_command(memory, stream, settings, i):
    """Draw a heading and how many steps it stands."""
    largest = settings[LARGEST_COMMAND]
    memory[i, COMMAND] = uniform(stream, i, -largest, largest)
    memory[i, STEPS_LEFT] = np.floor(uniform(stream, i, SHORTEST_COMMAND, LONGEST_COMMAND + 1.0))
    memory[i, SINCE_COMMAND] = 0.0
    memory[i, IS_SETTLED] = 0.0
    memory[i, COMMANDS] += 1.0


@inlined
def heading_error(memory, i):
    """The commanded heading relative to the mean of the last two footprints'."""
    return wrapped(memory[i, COMMAND] - mean_heading(memory, i))


@inlined
def follow_heading(memory, i, duration):
    """Keep the account of a step's heading error; return the error's size."""
    error = abs(heading_error(memory, i))
    memory[i, ERROR_SUM] += error * duration
    memory[i, SINCE_COMMAND] += duration
    if error < SETTLED:
        memory[i, SETTLED_SUM] += duration
        if memory[i, IS_SETTLED] == 0.0:
            memory[i, IS_SETTLED] = 1.0
            memory[i, SETTLED_COMMANDS] += 1.0
            memory[i, SETTLING_SUM] += memory[i, SINCE_COMMAND]
    return error


@inlined
def command_runs_out(memory, i):
    """Count a step; return whether it was the command's last."""
    memory[i, STEPS_LEFT] -= 1.0
    return memory[i, STEPS_LEFT] <= 0.0


@inlined
def closeness(error, width):
    """1 without error, a half at ``width``, falling to 0."""
    ratio = error / width
    return 1.0 / (1.0 + ratio * ratio)


@inlined
def task_begin(memory, stream, settings, i):
    new_heading_command(memory, stream, settings, i)


@inlined
def task_reward(memory, stream, settings, actions, outcomes, i, walks):
    if not walks:
        return 0.0, True
    duration = outcomes[i, c.OUTCOME_DURATION]
    error = follow_heading(memory, i, duration)
    rate = (
        WALKING_RATE
        + TRACKING_RATE * closeness(error, TRACKING_WIDTH)
        - EFFORT_RATE * effort(actions, i)
    )
    if command_runs_out(memory, i):
        new_heading_command(memory, stream, settings, i)
    return rate * duration, False


@inlined
def task_features(memory, settings, observations, i, column):
    sign = mirror_sign(memory, settings, i)
    observations[i, column] = limited(sign * heading_error(memory, i) / ERROR_SCALE)


@entry_point()
def step_one(
    bodies,
    memory,
    stream,
    settings,
    actions,
    outcomes,
    observations,
    rewards,
    terminated,
    truncated,
):
    return run_one(
        bodies, memory, stream, settings, actions, outcomes, observations, rewards, terminated,
        truncated, task_reward, task_features,
    )  # fmt: skip


@entry_point()
def step_many(
    bodies, memory, stream, settings, actions, outcomes, observations, rewards, terminated, truncated,
    commands, states, sides, skip, first, last,
):  # fmt: skip
    return run_many(
        bodies, memory, stream, settings, actions, outcomes, observations, rewards, terminated,
        truncated, commands, states, sides, skip, first, last, task_reward, task_features,
    )  # fmt: skip


@entry_point()
def start_many(bodies, memory, stream, settings, observations, rows, fresh):
    for i in rows:
        start_row(
            bodies, memory, stream, settings, observations, i, fresh, task_begin, task_features
        )


HEADING_FEATURE = Feature(
    "heading_error",
    ERROR_SCALE,
    "rad",
    "commanded heading less the mean of the last two footprints', within half a turn",
)
HEADING_METRICS = {
    "mean_absolute_heading_error": Metric(ERROR_SUM, c.TIME, "rad, over time", "lower"),
    "settled_fraction": Metric(
        SETTLED_SUM, c.TIME, f"of the time, with an error below {SETTLED} rad", "higher"
    ),
    "mean_settling_time": Metric(
        SETTLING_SUM, SETTLED_COMMANDS, "from a new command to settled, of commands that got there"
    ),
    "commands": Metric(COMMANDS, None, "headings commanded so far"),
}
HEADING_COMMAND = Command((COMMAND,), -pi, pi, "heading, rad")

TASK = Task(
    name="Heading",
    step_one=step_one,
    step_many=step_many,
    start_many=start_many,
    features=(HEADING_FEATURE,),
    metrics=HEADING_METRICS,
    summary=f"Walk where you are told: a heading within {LARGEST_SLOPE_COMMAND} rad of downhill, commanded anew every "
    f"{SHORTEST_COMMAND} to {LONGEST_COMMAND} steps. The entry level.",
    reward=f"{WALKING_RATE} + {TRACKING_RATE} / (1 + (heading error / {TRACKING_WIDTH})^2) - {EFFORT_RATE} effort",
    history=("0: the first.",),
    commands={"command": HEADING_COMMAND},
    command_column=COMMAND,
    constants=(LARGEST_SLOPE_COMMAND,),
)
