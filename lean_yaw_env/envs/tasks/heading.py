"""Heading: walk where you are told. The entry-level steering task."""

from __future__ import annotations

import numpy as np

from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.running import run_many, run_one, start_row
from lean_yaw_env.envs.tasks.task import Metric, Task
from lean_yaw_env.envs.transition import effort, limited, mean_heading, mirror_sign, wrapped
from lean_yaw_env.kernel.compilation import entry_point, inlined
from lean_yaw_env.kernel.random import uniform

# Where the task keeps its numbers
COMMAND = c.TASK
STEPS_LEFT = c.TASK + 1
ERROR_SUM = c.TASK + 2  # absolute heading error times duration
SETTLED_SUM = c.TASK + 3  # time with an error below SETTLED
SETTLING_SUM = (
    c.TASK + 4
)  # time from each new command until first below SETTLED, of those that got there
SETTLED_COMMANDS = c.TASK + 5
SINCE_COMMAND = c.TASK + 6
IS_SETTLED = c.TASK + 7
COMMANDS = c.TASK + 8

LARGEST_COMMAND = 0.6  # rad, either side of downhill
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
def new_command(memory, stream, i):
    """Draw a heading and how many steps it stands."""
    memory[i, COMMAND] = uniform(stream, i, -LARGEST_COMMAND, LARGEST_COMMAND)
    memory[i, STEPS_LEFT] = np.floor(uniform(stream, i, SHORTEST_COMMAND, LONGEST_COMMAND + 1.0))
    memory[i, SINCE_COMMAND] = 0.0
    memory[i, IS_SETTLED] = 0.0
    memory[i, COMMANDS] += 1.0


@inlined
def task_begin(memory, stream, settings, i):
    new_command(memory, stream, i)


@inlined
def heading_error(memory, i):
    """The commanded heading relative to the mean of the last two footprints'."""
    return wrapped(memory[i, COMMAND] - mean_heading(memory, i))


@inlined
def task_reward(memory, stream, settings, actions, outcomes, i, walks):
    duration = outcomes[i, c.OUTCOME_DURATION]
    if not walks:
        return 0.0, True
    error = abs(heading_error(memory, i))
    memory[i, ERROR_SUM] += error * duration
    memory[i, SINCE_COMMAND] += duration
    if error < SETTLED:
        memory[i, SETTLED_SUM] += duration
        if memory[i, IS_SETTLED] == 0.0:
            memory[i, IS_SETTLED] = 1.0
            memory[i, SETTLED_COMMANDS] += 1.0
            memory[i, SETTLING_SUM] += memory[i, SINCE_COMMAND]
    ratio = error / TRACKING_WIDTH
    rate = WALKING_RATE + TRACKING_RATE / (1.0 + ratio * ratio) - EFFORT_RATE * effort(actions, i)
    memory[i, STEPS_LEFT] -= 1.0
    if memory[i, STEPS_LEFT] <= 0.0:
        new_command(memory, stream, i)
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
def start_many(memory, stream, settings, observations, rows, fresh):
    for i in rows:
        start_row(memory, stream, settings, observations, i, fresh, task_begin, task_features)


TASK = Task(
    name="Heading",
    step_one=step_one,
    step_many=step_many,
    start_many=start_many,
    features=("heading_error",),
    metrics={
        "mean_absolute_heading_error": Metric(ERROR_SUM, c.TIME),
        "settled_fraction": Metric(SETTLED_SUM, c.TIME),
        "mean_settling_time": Metric(SETTLING_SUM, SETTLED_COMMANDS),
        "commands": Metric(COMMANDS),
    },
    command_column=COMMAND,
)
