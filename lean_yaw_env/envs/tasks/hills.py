"""Hills: follow a commanded heading where the slope varies along the way, and is seen some steps ahead."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from typing import Any

import numpy as np

from lean_yaw_env.envs.formulas import place
from lean_yaw_env.envs.state import Field
from lean_yaw_env.envs.tasks.headings import (
    HEADING,
    LARGEST_SLOPE_COMMAND,
    heading_features,
    new_heading,
)
from lean_yaw_env.envs.tasks.task import FRICTION_LIMIT, NEW, Feature
from lean_yaw_env.kernel.compilation import formula
from lean_yaw_env.kernel.random import uniform
from lean_yaw_env.parameters import WalkerParameters

# The slope: its mean plus the sum of height sin(wave number x + phase), x downhill.
WAVES = 3
SHORTEST_WAVE, LONGEST_WAVE = 8.0, 30.0  # leg lengths
LEAST_HEIGHT, GREATEST_HEIGHT = 0.008, 0.016  # rad, of all waves together
PREVIEWS = (1.0, 2.0, 4.0)  # leg lengths downhill of the walker
SLOPE_CENTRE, SLOPE_SCALE = 0.01, 0.01  # rad, of the observed slopes


@formula
def slope_at(task: Any, x: Any) -> Any:
    """The slope at ``x`` downhill, rad."""
    slope = task.mean_slope + 0.0 * x
    for k in range(WAVES):
        slope = slope + task.heights[k] * np.sin(task.wave_numbers[k] * x + task.phases[k])
    return slope


@formula
def hills_start(walker: Any, task: Any) -> None:
    """Draw the waves around the body's slope, and a heading."""
    task.mean_slope = walker.slope
    height = uniform(walker, LEAST_HEIGHT, GREATEST_HEIGHT)
    shares = 0.0
    for k in range(WAVES):
        task.wave_numbers[k] = 2.0 * pi / uniform(walker, SHORTEST_WAVE, LONGEST_WAVE)
        task.phases[k] = uniform(walker, -pi, pi)
        task.heights[k] = uniform(walker, 0.0, 1.0)
        shares += task.heights[k]
    for k in range(WAVES):
        task.heights[k] *= height / shares
    new_heading(walker, task)


@formula
def hills_refresh(walker: Any, task: Any) -> None:
    walker.slope = slope_at(task, place(walker)[0])


@formula
def hills_features(walker: Any, task: Any) -> Any:
    x = place(walker)[0]
    return (
        *heading_features(walker, task),
        walker.slope,
        slope_at(task, x + PREVIEWS[0]),
        slope_at(task, x + PREVIEWS[1]),
        slope_at(task, x + PREVIEWS[2]),
    )


HILLS = replace(
    HEADING,
    name="Hills",
    fields=(
        *HEADING.fields,
        Field("mean_slope", "rad", "around which the slope varies"),
        Field("wave_numbers", "rad / leg length", "of the slope's waves", size=WAVES),
        Field("phases", "rad", "of the same, where the walk starts", size=WAVES),
        Field("heights", "rad", "of the same", size=WAVES),
    ),
    start=hills_start,
    refresh=hills_refresh,
    features=hills_features,
    observed=(
        *HEADING.observed,
        *(
            Feature(
                f"slope_{ahead:g}",
                SLOPE_SCALE,
                "rad",
                f"slope of the floor {ahead:g} leg lengths further downhill",
                SLOPE_CENTRE,
            )
            for ahead in (0.0, *PREVIEWS)
        ),
    ),
    summary=f"Walk where you are told, over hills: a heading within {LARGEST_SLOPE_COMMAND} rad of downhill, where the slope varies along the "
    f"way by the sum of {WAVES} waves of random length ({SHORTEST_WAVE:g} to {LONGEST_WAVE:g} leg lengths) and {LEAST_HEIGHT} to "
    f"{GREATEST_HEIGHT} rad together. The masses may be moved as fast as in Level, to pump.",
    history=NEW,
    parameters=WalkerParameters(friction_limit=FRICTION_LIMIT),
    max_offset_change=0.1,
    slope_varies=True,
)
