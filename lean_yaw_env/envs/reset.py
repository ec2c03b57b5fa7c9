"""How an episode starts: either foot, the gait and a random deviation; a body of its own, if bodies are random."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from lean_yaw_env.envs.state import BODY_SIZE, SLOPE
from lean_yaw_env.kernel.compilation import borrowed, entry_point, formula
from lean_yaw_env.kernel.random import uniform

# Largest deviations of a start from the gait, drawn uniformly, at start_disturbance = 1.
START_DEVIATIONS = (0.2, 0.01, 0.005, 0.03, 0.03)

# Half-widths of the box around the nominal body from which random bodies are drawn: hip width, foot radius, ankle tilt, slope. Bodies
# held out for testing lie outside it, in the box HELD_OUT_REACH times as large.
BODY_DEVIATIONS = (0.06, 0.05, 0.05, 0.002)
HELD_OUT_REACH = 1.5


class BodyDraw(IntEnum):
    """Which bodies are drawn."""

    NOMINAL = 0
    TRAINING = 1
    HELD_OUT = 2


_NOMINAL, _TRAINING = int(BodyDraw.NOMINAL), int(BodyDraw.TRAINING)


@formula
def draw_body(body: Any, walker: Any, settings: Any) -> None:
    """Draw a walker's body: from the box for training, or from around it, between that box and the larger one."""
    trains = settings.random_body == _TRAINING
    reach = 1.0 if trains else HELD_OUT_REACH
    largest = 0.0
    while largest == 0.0 or not (trains or largest > 1.0):
        largest = 0.0
        for k in range(BODY_SIZE):
            u = uniform(walker, -reach, reach)
            largest = max(largest, abs(u))
            body[k] = settings.body_centre[k] + u * settings.body_reach[k]


@formula
def deviation(walker: Any, settings: Any, k: int) -> Any:
    """A random deviation of the section state's coordinate ``k``."""
    reach = settings.start_disturbance * START_DEVIATIONS[k]
    return settings.gait[k] + uniform(walker, -reach, reach)


@formula
def start_episode(walker: Any, body: Any, settings: Any) -> None:
    """Put a walker at its start. Its record holds zeros and a key already."""
    if settings.random_body != _NOMINAL:
        draw_body(body, walker, settings)
    else:
        body[SLOPE] = settings.body_centre[SLOPE]
    walker.hip_width = body[0]
    walker.foot_radius = body[1]
    walker.ankle_tilt = body[2]
    walker.slope = body[3]
    side = 1.0 if uniform(walker, 0.0, 1.0) < 0.5 else -1.0
    walker.side = side
    walker.heading = side * deviation(walker, settings, 0)
    walker.stance_pitch = deviation(walker, settings, 1)
    walker.ankle_angle = side * deviation(walker, settings, 2)
    walker.stance_pitch_rate = deviation(walker, settings, 3)
    walker.ankle_rate = side * deviation(walker, settings, 4)
    walker.previous_heading = walker.heading
    walker.inter_leg_angle = settings.inter_leg_angle
    walker.pending_angle = settings.inter_leg_angle
    # a gait of pumping has the masses on alternate sides
    walker.mass_offset = side * settings.gait_offset
    walker.commanded_offset = walker.mass_offset
    walker.pending_offset = -walker.mass_offset


@entry_point()
def start_episodes(walkers, bodies, settings, skip):
    """Put walkers, but those to skip, at their starts."""
    walkers, bodies, settings = borrowed(walkers), borrowed(bodies), borrowed(settings)
    for i in range(len(walkers)):
        if not skip[i]:
            start_episode(walkers[i], bodies[i if len(bodies) > 1 else 0], settings[0])
