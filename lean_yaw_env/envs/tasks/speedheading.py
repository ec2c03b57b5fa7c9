"""SpeedHeading: walk where and as fast as you are told."""

from __future__ import annotations

from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.running import run_many, run_one, start_row
from lean_yaw_env.envs.tasks.heading import (
    COMMAND,
    EFFORT_RATE,
    ERROR_SCALE,
    HEADING_COMMAND,
    HEADING_END,
    HEADING_FEATURE,
    HEADING_METRICS,
    LARGEST_SLOPE_COMMAND,
    LONGEST_COMMAND,
    SHORTEST_COMMAND,
    TRACKING_WIDTH,
    WALKING_RATE,
    closeness,
    command_runs_out,
    follow_heading,
    heading_error,
    new_heading_command,
)
from lean_yaw_env.envs.tasks.task import Command, Feature, Metric, Task
from lean_yaw_env.envs.transition import effort, limited, mirror_sign
from lean_yaw_env.kernel.compilation import entry_point, inlined
from lean_yaw_env.kernel.random import uniform

SPEED = HEADING_END  # commanded
LAST_SPEED = HEADING_END + 1  # of the last step
SPEED_ERROR_SUM = HEADING_END + 2  # absolute speed error times duration

# On a slope of 0.01 the gait walks at 0.68 with an inter-leg angle of 0.15 and at 0.25 with one of 0.45; 0.6 rad off downhill at 0.60
# and 0.10: all these commands are within reach of the default action.
LEAST_SPEED, GREATEST_SPEED = 0.30, 0.55
SPEED_CENTRE, SPEED_SCALE = 0.42, 0.1  # of the observed command
SPEED_ERROR_SCALE = 0.1

TRACKING_RATE = 0.4  # for each of the two
SPEED_WIDTH = 0.05  # the speed error at which half of its tracking rate is left


@inlined
def new_command(memory, stream, settings, i):
    new_heading_command(memory, stream, settings, i)
    memory[i, SPEED] = uniform(stream, i, LEAST_SPEED, GREATEST_SPEED)


@inlined
def task_begin(memory, stream, settings, i):
    new_command(memory, stream, settings, i)


@inlined
def task_reward(memory, stream, settings, actions, outcomes, i, walks):
    if not walks:
        return 0.0, True
    duration = outcomes[i, c.OUTCOME_DURATION]
    memory[i, LAST_SPEED] = memory[i, c.ADVANCE] / duration
    error = follow_heading(memory, i, duration)
    speed_error = abs(memory[i, SPEED] - memory[i, LAST_SPEED])
    memory[i, SPEED_ERROR_SUM] += speed_error * duration
    rate = (
        WALKING_RATE
        + TRACKING_RATE * (closeness(error, TRACKING_WIDTH) + closeness(speed_error, SPEED_WIDTH))
        - EFFORT_RATE * effort(actions, i)
    )
    if command_runs_out(memory, i):
        new_command(memory, stream, settings, i)
    return rate * duration, False


@inlined
def task_features(memory, settings, observations, i, column):
    sign = mirror_sign(memory, settings, i)
    observations[i, column] = limited(sign * heading_error(memory, i) / ERROR_SCALE)
    observations[i, column + 1] = limited((memory[i, SPEED] - SPEED_CENTRE) / SPEED_SCALE)
    walked = memory[i, c.STEPS] > 0.0
    lacks = memory[i, SPEED] - memory[i, LAST_SPEED] if walked else 0.0
    observations[i, column + 2] = limited(lacks / SPEED_ERROR_SCALE)


@entry_point()
def step_one(
    bodies, memory, stream, settings, actions, outcomes, observations, rewards, terminated, truncated,
):  # fmt: skip
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


TASK = Task(
    name="SpeedHeading",
    step_one=step_one,
    step_many=step_many,
    start_many=start_many,
    features=(
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
        "mean_absolute_speed_error": Metric(SPEED_ERROR_SUM, c.TIME, "over time", "lower"),
        "commanded_speed": Metric(SPEED, None, "in force"),
    },
    summary=f"Walk where and as fast as you are told: a heading within {LARGEST_SLOPE_COMMAND} rad of downhill and a speed from "
    f"{LEAST_SPEED:.2f} to {GREATEST_SPEED:.2f}, commanded anew together every {SHORTEST_COMMAND} to {LONGEST_COMMAND} steps.",
    reward=f"{WALKING_RATE} + {TRACKING_RATE} / (1 + (heading error / {TRACKING_WIDTH})^2) + {TRACKING_RATE} / (1 + (speed error / "
    f"{SPEED_WIDTH})^2) - {EFFORT_RATE} effort",
    history=("0: the first.",),
    commands={
        "command": HEADING_COMMAND,
        "speed": Command((SPEED,), LEAST_SPEED, GREATEST_SPEED, "speed"),
    },
    command_column=COMMAND,
    constants=(LARGEST_SLOPE_COMMAND,),
)
