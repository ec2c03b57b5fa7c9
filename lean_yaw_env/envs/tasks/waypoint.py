"""Waypoint: walk to one place after another, on a slope that turns with the walker."""

from __future__ import annotations

from math import pi

import numpy as np

from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.running import run_many, run_one, start_row
from lean_yaw_env.envs.tasks.task import Command, Feature, Metric, Task
from lean_yaw_env.envs.transition import effort, limited, mean_heading, middle_place, mirror_sign
from lean_yaw_env.kernel.compilation import entry_point, inlined
from lean_yaw_env.kernel.random import uniform
from lean_yaw_env.parameters import WalkerParameters

GOAL_X = c.TASK  # downhill
GOAL_Z = c.TASK + 1  # to the right
GOAL_DISTANCE = c.TASK + 2  # when last observed
GOALS = c.TASK + 3  # reached

NEAREST, FARTHEST = 8.0, 16.0  # leg lengths, from where the last goal was reached
RADIUS = 0.5
BEARING_SCALE = 0.6  # rad
DISTANCE_SCALE = 8.0
FARTHEST_COMMAND = 1000.0

# Reward: per unit of time for walking at all and against large actions, and per leg length that the goal has come nearer. The fastest way
# straight away from the goal is still worth more than a fall.
WALKING_RATE = 0.5
APPROACH = 1.0
EFFORT_RATE = 0.05


@inlined
def new_goal(memory, stream, i):
    """Draw a place around the walker."""
    distance = uniform(stream, i, NEAREST, FARTHEST)
    bearing = uniform(stream, i, -pi, pi)
    x, z = middle_place(memory, i)
    memory[i, GOAL_X] = x + distance * np.cos(bearing)
    memory[i, GOAL_Z] = z - distance * np.sin(bearing)


@inlined
def goal_seen(memory, i):
    """How far the goal is, and how far to the left of straight ahead."""
    x, z = middle_place(memory, i)
    x = memory[i, GOAL_X] - x
    z = memory[i, GOAL_Z] - z
    heading = mean_heading(memory, i)
    cosine, sine = np.cos(heading), np.sin(heading)
    ahead = x * cosine - z * sine
    left = -x * sine - z * cosine
    return np.sqrt(x * x + z * z), np.arctan2(left, ahead)


@inlined
def task_begin(memory, stream, settings, i):
    new_goal(memory, stream, i)


@inlined
def task_reward(memory, stream, settings, actions, outcomes, i, walks):
    if not walks:
        return 0.0, True
    duration = outcomes[i, c.OUTCOME_DURATION]
    distance, _ = goal_seen(memory, i)
    nearer = memory[i, GOAL_DISTANCE] - distance
    if distance <= RADIUS:
        memory[i, GOALS] += 1.0
        new_goal(memory, stream, i)
    rate = WALKING_RATE - EFFORT_RATE * effort(actions, i)
    return rate * duration + APPROACH * nearer, False


@inlined
def task_features(memory, settings, observations, i, column):
    sign = mirror_sign(memory, settings, i)
    distance, bearing = goal_seen(memory, i)
    memory[i, GOAL_DISTANCE] = distance
    observations[i, column] = limited(sign * bearing / BEARING_SCALE)
    observations[i, column + 1] = limited(distance / DISTANCE_SCALE)


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
    name="Waypoint",
    step_one=step_one,
    step_many=step_many,
    start_many=start_many,
    features=(
        Feature(
            "goal_bearing",
            BEARING_SCALE,
            "rad",
            "direction of the goal, to the left of the mean of the last two footprints' heading",
        ),
        Feature("goal_distance", DISTANCE_SCALE, "leg lengths", "distance of the goal"),
    ),
    metrics={
        "goals": Metric(GOALS, None, "reached so far", "higher"),
        "goal_distance": Metric(GOAL_DISTANCE, None, "leg lengths, to the goal in force"),
    },
    summary=f"Walk to one place after another: each {NEAREST:g} to {FARTHEST:g} leg lengths from where the walker is when it is set, at any "
    f"bearing, reached within {RADIUS}. The slope turns with the walker, so that every heading is like any other. With the largest offset "
    "held, 0.05, the walker turns on a radius of 8.3 at the inter-leg angle of 0.3, of 39 at 0.15, 4.3 at 0.36 and 2.5 at 0.39; at 0.42 it "
    "trips.",
    reward=f"{WALKING_RATE} + {APPROACH:g} (speed of approach to the goal) - {EFFORT_RATE} effort",
    history=("0: the first.",),
    commands={
        "goal": Command(
            (GOAL_X, GOAL_Z), -FARTHEST_COMMAND, FARTHEST_COMMAND, "place of the first goal"
        )
    },
    goal_columns=(GOAL_X, GOAL_Z),
    goal_radius=RADIUS,
    parameters=WalkerParameters(slope_turns=True),
    horizon=300.0,
    headline="goals",
)
