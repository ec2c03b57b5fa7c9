"""Slalom: follow a smooth random path downhill, under pushes."""

from __future__ import annotations

from math import log, pi
from typing import Any

import numpy as np

from lean_yaw_env.envs.formulas import counted_time, mean_heading, place, wrapped
from lean_yaw_env.envs.state import Field
from lean_yaw_env.envs.tasks.task import (
    FIRST,
    FRICTION_LIMIT,
    SINCE_VERSION_1,
    Feature,
    Metric,
    Task,
)
from lean_yaw_env.kernel.compilation import formula
from lean_yaw_env.kernel.random import uniform
from lean_yaw_env.parameters import Vector, WalkerParameters

# The path: the sum of height (1 - cos(wave number x)) to the right, x downhill. It starts where the walker does, straight downhill.
WAVES = 3
SHORTEST_WAVE, LONGEST_WAVE = 12.0, 80.0  # leg lengths
LEAST_SLOPE, GREATEST_SLOPE = 0.2, 0.8  # of all waves together, where all are steepest
# Of all waves together; the walker turns by 0.12 with the largest offset held.
GREATEST_CURVATURE = 0.08
_LOG_SHORTEST, _LOG_LONGEST = log(SHORTEST_WAVE), log(LONGEST_WAVE)
LARGEST_ERROR = 3.0  # leg lengths; beyond it the episode ends

PREVIEWS = (2.0, 4.0, 8.0)  # leg lengths downhill of the walker
ERROR_SCALE = 1.0
TANGENT_SCALE = 0.6  # rad

WALKING_RATE = 0.2
TRACKING_RATE = 0.8
TRACKING_WIDTH = 0.5  # leg lengths; the error at which half of the tracking rate is left
EFFORT_RATE = 0.05


@formula
def path_right(task: Any, x: Any) -> Any:
    """How far to the right the path is at ``x`` downhill."""
    right = 0.0 * x
    for k in range(WAVES):
        right = right + task.heights[k] * (1.0 - np.cos(task.wave_numbers[k] * x))
    return right


@formula
def path_slope(task: Any, x: Any) -> Any:
    """The path's slope to the right at ``x`` downhill."""
    slope = 0.0 * x
    for k in range(WAVES):
        number = task.wave_numbers[k]
        slope = slope + task.heights[k] * number * np.sin(number * x)
    return slope


@formula
def start(walker: Any, task: Any) -> None:
    """Draw a path: each wave's length, its share of the slope, and its side; gentler if it would curve too much."""
    steepness = uniform(walker, LEAST_SLOPE, GREATEST_SLOPE)
    shares = 0.0
    for k in range(WAVES):
        length = np.exp(uniform(walker, _LOG_SHORTEST, _LOG_LONGEST))
        share = uniform(walker, -1.0, 1.0)
        shares += abs(share)
        task.wave_numbers[k] = 2.0 * pi / length
        task.heights[k] = share
    curvature = 0.0
    for k in range(WAVES):
        curvature += abs(task.heights[k]) * task.wave_numbers[k]
    scale = min(steepness / shares, GREATEST_CURVATURE / curvature)
    for k in range(WAVES):
        task.heights[k] *= scale / task.wave_numbers[k]


@formula
def cross_track_error(walker: Any, task: Any) -> Any:
    """How far the walker is to the right of the path, leg lengths."""
    x, z = place(walker)
    slope = path_slope(task, x)
    return (z - path_right(task, x)) / np.sqrt(1.0 + slope * slope)


@formula
def preview(walker: Any, task: Any, ahead: float) -> Any:
    """How far to the left of straight ahead the path is, so far further downhill, leg lengths."""
    x, z = place(walker)
    heading = mean_heading(walker)
    return -ahead * np.sin(heading) - (path_right(task, x + ahead) - z) * np.cos(heading)


@formula
def reward(walker: Any, task: Any) -> Any:
    error = cross_track_error(walker, task)
    ratio = error / TRACKING_WIDTH
    rate = WALKING_RATE + TRACKING_RATE / (1.0 + ratio * ratio) - EFFORT_RATE * walker.effort
    earned = rate * walker.duration
    return 0.0 * earned if abs(error.real) > LARGEST_ERROR else earned


@formula
def update(walker: Any, task: Any) -> bool:
    error = cross_track_error(walker, task)
    task.cross_track_error = error
    task.square_sum += error * error * counted_time(walker)
    if walker.time > 0.0:
        task.root_mean_square = np.sqrt(task.square_sum / walker.time)
    return abs(error) > LARGEST_ERROR


@formula
def features(walker: Any, task: Any) -> Any:
    path_heading = -np.arctan(path_slope(task, place(walker)[0]))
    return (
        cross_track_error(walker, task),
        wrapped(path_heading - mean_heading(walker)),
        preview(walker, task, PREVIEWS[0]),
        preview(walker, task, PREVIEWS[1]),
        preview(walker, task, PREVIEWS[2]),
    )


def reference_path(walker: Any, task: Any) -> Vector:
    """The path from its start to well before the walker, as points (k, 2): downhill, right."""
    downhill = np.arange(0.0, max(walker.place_x, 0.0) + 20.0, 0.25)
    return np.column_stack([downhill, path_right(task, downhill)])


SLALOM = Task(
    name="Slalom",
    fields=(
        Field("wave_numbers", "rad / leg length", "of the path's waves", size=WAVES),
        Field("heights", "leg lengths", "of the same, to the right", size=WAVES, is_odd=True),
        Field("cross_track_error", "leg lengths", "how far to the right of the path", is_odd=True),
        Field("square_sum", "", "its square times duration"),
        Field("root_mean_square", "leg lengths", "of it, over time"),
    ),
    start=start,
    reward=reward,
    update=update,
    features=features,
    observed=(
        Feature(
            "cross_track_error",
            ERROR_SCALE,
            "leg lengths",
            "how far to the right of the path",
            is_odd=True,
        ),
        Feature(
            "path_heading_error",
            TANGENT_SCALE,
            "rad",
            "heading of the path beside the walker less the mean of the last two footprints'",
            is_odd=True,
        ),
        *(
            Feature(
                f"preview_{ahead:g}",
                ahead,
                "leg lengths",
                f"how far to the left of straight ahead the path is, {ahead:g} further downhill",
                is_odd=True,
            )
            for ahead in PREVIEWS
        ),
    ),
    metrics={
        "rms_cross_track_error": Metric(
            "root_mean_square", None, "leg lengths, over time", "lower"
        ),
        "cross_track_error": Metric(
            "cross_track_error", None, "leg lengths, to the right, at this step"
        ),
        "downhill": Metric("place_x", None, "leg lengths, progress downhill"),
    },
    summary=f"Follow a path downhill, the sum of {WAVES} waves of random length ({SHORTEST_WAVE:g} to {LONGEST_WAVE:g} leg lengths), with "
    f"slopes to {GREATEST_SLOPE} and curvature to {GREATEST_CURVATURE}, under pushes.",
    reward_text=f"{WALKING_RATE} + {TRACKING_RATE} / (1 + (cross-track error / {TRACKING_WIDTH})^2) - {EFFORT_RATE} effort",
    history=(FIRST, f"1: the push level is 0.4 in place of 0.2; {SINCE_VERSION_1}."),
    parameters=WalkerParameters(friction_limit=FRICTION_LIMIT),
    ends=f"a cross-track error beyond {LARGEST_ERROR:g}, as a termination without reward",
    reference_path=reference_path,
    push_level=0.4,
)
