"""Slalom: follow a smooth random path downhill, under pushes."""

from __future__ import annotations

from math import log, pi

import numpy as np

from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.running import run_many, run_one, start_row
from lean_yaw_env.envs.tasks.task import Feature, Metric, Task
from lean_yaw_env.envs.transition import (
    effort,
    limited,
    mean_heading,
    middle_place,
    mirror_sign,
    wrapped,
)
from lean_yaw_env.kernel.compilation import entry_point, inlined
from lean_yaw_env.kernel.random import uniform
from lean_yaw_env.parameters import Vector

# The path: the sum of height (1 - cos(wave number x)) to the right, x downhill. It starts where the walker does, straight downhill.
WAVES = 3
WAVE = c.TASK  # wave number and height of each
CROSS_TRACK = c.TASK + 2 * WAVES  # how far the walker is to the right of the path
SQUARE_SUM = CROSS_TRACK + 1  # times duration
ROOT_MEAN_SQUARE = CROSS_TRACK + 2

SHORTEST_WAVE, LONGEST_WAVE = 12.0, 80.0  # leg lengths
LEAST_SLOPE, GREATEST_SLOPE = 0.2, 0.8  # of all waves together, where all are steepest
GREATEST_CURVATURE = (
    0.08  # of all waves together; the walker turns by 0.12 with the largest offset held
)
_LOG_SHORTEST, _LOG_LONGEST = log(SHORTEST_WAVE), log(LONGEST_WAVE)
LARGEST_ERROR = 3.0  # leg lengths; beyond it the episode ends

PREVIEWS = (2.0, 4.0, 8.0)  # leg lengths downhill of the walker
ERROR_SCALE = 1.0
TANGENT_SCALE = 0.6  # rad

WALKING_RATE = 0.2
TRACKING_RATE = 0.8
TRACKING_WIDTH = 0.5  # leg lengths; the error at which half of the tracking rate is left
EFFORT_RATE = 0.05


@inlined
def path_right(memory, i, x):
    """How far to the right the path is at ``x`` downhill, and its slope there."""
    right = 0.0
    slope = 0.0
    for k in range(WAVES):
        number = memory[i, WAVE + 2 * k]
        height = memory[i, WAVE + 2 * k + 1]
        right += height * (1.0 - np.cos(number * x))
        slope += height * number * np.sin(number * x)
    return right, slope


@inlined
def task_begin(memory, stream, settings, i):
    """Draw a path: each wave's length, its share of the slope, and its side; gentler if it would curve too much."""
    steepness = uniform(stream, i, LEAST_SLOPE, GREATEST_SLOPE)
    shares = 0.0
    for k in range(WAVES):
        length = np.exp(uniform(stream, i, _LOG_SHORTEST, _LOG_LONGEST))
        share = uniform(stream, i, -1.0, 1.0)
        shares += abs(share)
        memory[i, WAVE + 2 * k] = 2.0 * pi / length
        memory[i, WAVE + 2 * k + 1] = share
    curvature = 0.0
    for k in range(WAVES):
        curvature += abs(memory[i, WAVE + 2 * k + 1]) * memory[i, WAVE + 2 * k]
    scale = min(steepness / shares, GREATEST_CURVATURE / curvature)
    for k in range(WAVES):
        memory[i, WAVE + 2 * k + 1] *= scale / memory[i, WAVE + 2 * k]


@inlined
def place_on_path(memory, i):
    """Distance to the right of the path, and its heading less the walker's."""
    x, z = middle_place(memory, i)
    right, slope = path_right(memory, i, x)
    error = (z - right) / np.sqrt(1.0 + slope * slope)
    return error, wrapped(-np.arctan(slope) - mean_heading(memory, i))


@inlined
def task_reward(memory, stream, settings, actions, outcomes, i, walks):
    if not walks:
        return 0.0, True
    duration = outcomes[i, c.OUTCOME_DURATION]
    error, _ = place_on_path(memory, i)
    memory[i, CROSS_TRACK] = error
    memory[i, SQUARE_SUM] += error * error * duration
    memory[i, ROOT_MEAN_SQUARE] = np.sqrt(memory[i, SQUARE_SUM] / memory[i, c.TIME])
    if abs(error) > LARGEST_ERROR:
        return 0.0, True
    ratio = error / TRACKING_WIDTH
    rate = WALKING_RATE + TRACKING_RATE / (1.0 + ratio * ratio) - EFFORT_RATE * effort(actions, i)
    return rate * duration, False


@inlined
def task_features(memory, settings, observations, i, column):
    sign = mirror_sign(memory, settings, i)
    error, tangent = place_on_path(memory, i)
    observations[i, column] = limited(sign * error / ERROR_SCALE)
    observations[i, column + 1] = limited(sign * tangent / TANGENT_SCALE)
    x, z = middle_place(memory, i)
    heading = mean_heading(memory, i)
    cosine, sine = np.cos(heading), np.sin(heading)
    for k in range(len(PREVIEWS)):
        right, _ = path_right(memory, i, x + PREVIEWS[k])
        left = -PREVIEWS[k] * sine - (right - z) * cosine
        observations[i, column + 2 + k] = limited(sign * left / PREVIEWS[k])


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


def reference_path(memory: Vector) -> Vector:
    """The path from its start to well before the walker, as points (k, 2): downhill, right."""
    downhill = np.arange(0.0, max(memory[c.PLACE_X], 0.0) + 20.0, 0.25)
    waves = memory[WAVE : WAVE + 2 * WAVES].reshape(WAVES, 2)
    right = sum(height * (1.0 - np.cos(number * downhill)) for number, height in waves)
    return np.column_stack([downhill, right])


TASK = Task(
    name="Slalom",
    step_one=step_one,
    step_many=step_many,
    start_many=start_many,
    features=(
        Feature(
            "cross_track_error", ERROR_SCALE, "leg lengths", "how far to the right of the path"
        ),
        Feature(
            "path_heading_error",
            TANGENT_SCALE,
            "rad",
            "heading of the path beside the walker less the mean of the last two footprints'",
        ),
        *(
            Feature(
                f"preview_{ahead:g}",
                ahead,
                "leg lengths",
                f"how far to the left of straight ahead the path is, {ahead:g} further downhill",
            )
            for ahead in PREVIEWS
        ),
    ),
    metrics={
        "rms_cross_track_error": Metric(ROOT_MEAN_SQUARE, None, "leg lengths, over time", "lower"),
        "cross_track_error": Metric(CROSS_TRACK, None, "leg lengths, to the right, at this step"),
        "downhill": Metric(c.PLACE_X, None, "leg lengths, progress downhill"),
    },
    summary=f"Follow a path downhill, the sum of {WAVES} waves of random length ({SHORTEST_WAVE:g} to {LONGEST_WAVE:g} leg lengths), with "
    f"slopes to {GREATEST_SLOPE} and curvature to {GREATEST_CURVATURE}, under pushes.",
    reward=f"{WALKING_RATE} + {TRACKING_RATE} / (1 + (cross-track error / {TRACKING_WIDTH})^2) - {EFFORT_RATE} effort",
    ends=f"a cross-track error beyond {LARGEST_ERROR:g}, as a termination without reward",
    history=("0: the first.",),
    reference_path=reference_path,
    push_level=0.2,
)
