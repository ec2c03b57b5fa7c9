"""What is observed: (value - centre) / scale, kept within +-``OBSERVATION_LIMIT``, with the noise and the hidden numbers that the options ask for."""

from __future__ import annotations

from typing import Any

import numpy as np

from lean_yaw_env.envs.formulas import wrapped
from lean_yaw_env.envs.state import BODY_SIZE
from lean_yaw_env.kernel.compilation import formula
from lean_yaw_env.kernel.random import normal
from lean_yaw_env.parameters import STATE_FIELDS

# Centres and scales of the section state are near Table 2's gait and how far a walker that does not fall strays from it.
STATE_CENTRES = (0.0, 0.155, 0.0, -0.42, 0.0)
STATE_SCALES = (0.6, 0.03, 0.05, 0.1, 0.1)
OFFSET_SCALE = 0.05
OBSERVATION_LIMIT = 10.0

# The numbers that every task observes, in order; a task's features follow.
COMMON_NAMES = (*(field.name for field in STATE_FIELDS), "mass_offset", "stance_foot")
COMMON_CENTRES = (*STATE_CENTRES, 0.0, 0.0)
COMMON_SCALES = (*STATE_SCALES, OFFSET_SCALE, 1.0)
COMMON_ODD = (True, False, True, False, True, True, False)
HEADING, PITCH_RATE, ANKLE_RATE, STANCE_FOOT = 0, 3, 4, 6


@formula
def common_values(walker: Any, settings: Any) -> Any:
    """What every task observes, before it is mirrored and scaled; the heading is zero on a slope that turns with the walker."""
    heading = wrapped(walker.heading)
    return (
        0.0 * heading if settings.hidden_heading != 0 else heading,
        walker.stance_pitch,
        walker.ankle_angle,
        walker.stance_pitch_rate,
        walker.ankle_rate,
        walker.mass_offset,
        walker.side,
    )


@formula
def mirror_sign(walker: Any, settings: Any) -> Any:
    """-1 if the walker is shown as its mirror image, which always stands on its left foot."""
    return walker.side if settings.mirror != 0 else 1.0


@formula
def limited(value: Any) -> Any:
    """A number of an observation, within its limits, in single precision."""
    return np.float32(min(max(value, -OBSERVATION_LIMIT), OBSERVATION_LIMIT))


@formula
def show_body(observation: Any, column: int, walker: Any, settings: Any) -> None:
    """Append the walker's body to an observation from ``column`` on, if the options say so."""
    if settings.show_body != 0:
        body = (walker.hip_width, walker.foot_radius, walker.ankle_tilt, walker.slope)
        for k in range(BODY_SIZE):
            shown = (body[k] - settings.body_centre[k]) / settings.body_reach[k]
            observation[column + k] = limited(shown)


@formula
def corrupt(observation: Any, walker: Any, settings: Any) -> None:
    """Add noise to all of an observation but the stance foot, and hide the rates, as the options say."""
    foot = STANCE_FOOT if settings.mirror == 0 else -1
    if settings.sensor_noise > 0.0:
        for k in range(len(observation)):
            if k != foot and not (k == HEADING and settings.hidden_heading != 0):
                noisy = float(observation[k]) + settings.sensor_noise * normal(walker)
                observation[k] = limited(noisy)
    if settings.hidden_rates != 0:
        observation[PITCH_RATE] = 0.0
        observation[ANKLE_RATE] = 0.0
