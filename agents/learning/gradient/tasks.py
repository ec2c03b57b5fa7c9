"""The tasks' rewards and features as differentiable formulas; the environment's compiled ones are the truth, and tests hold these to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor

from agents.learning.gradient.columns import Columns, mean_heading, middle_place, wrapped
from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.tasks import heading, level, slalom, speedheading, walk, waypoint


class StepTaken(NamedTuple):
    """What a reward reads beside memory, each of shape (n,).

    Attributes
    ----------
    duration, shift_work : of the step
    effort : mean square of the action's two numbers
    """

    duration: Tensor
    shift_work: Tensor
    effort: Tensor


Reward = Callable[[Columns, StepTaken], Tensor]
Features = Callable[[Columns, Tensor], list[Tensor]]
Kept = Callable[[Columns, Tensor], dict[int, Tensor]]


def _no_features(memory: Columns, sign: Tensor) -> list[Tensor]:
    return []


def _nothing_kept(memory: Columns, duration: Tensor) -> dict[int, Tensor]:
    return {}


@dataclass(frozen=True)
class TaskFormulas:
    """A task's formulas with gradients.

    Attributes
    ----------
    reward : of a step that did not end the episode, shape (n,)
        From memory after the step, in which the task's own columns are still those before it.
    features : what the task appends to the observation, scaled, before limits; from memory and the sign of the mirror image
    kept : columns that the task's next reward or features read, from memory after the step and the step's duration
    """

    reward: Reward
    features: Features = _no_features
    kept: Kept = _nothing_kept


def closeness(error: Tensor, width: float) -> Tensor:
    """1 without error, a half at ``width``, falling to 0."""
    ratio = error / width
    return 1.0 / (1.0 + ratio * ratio)


def _heading_error(memory: Columns) -> Tensor:
    return wrapped(memory[heading.COMMAND] - mean_heading(memory))


def _heading_features(memory: Columns, sign: Tensor) -> list[Tensor]:
    return [sign * _heading_error(memory) / heading.ERROR_SCALE]


def _walk_reward(memory: Columns, step: StepTaken) -> Tensor:
    return (walk.WALKING_RATE - walk.EFFORT_RATE * step.effort) * step.duration


def _heading_reward(memory: Columns, step: StepTaken) -> Tensor:
    rate = (
        heading.WALKING_RATE
        + heading.TRACKING_RATE * closeness(_heading_error(memory), heading.TRACKING_WIDTH)
        - heading.EFFORT_RATE * step.effort
    )
    return rate * step.duration


def _speed_reward(memory: Columns, step: StepTaken) -> Tensor:
    lacks = memory[speedheading.SPEED] - memory[c.ADVANCE] / step.duration
    close = closeness(_heading_error(memory), speedheading.TRACKING_WIDTH) + closeness(
        lacks, speedheading.SPEED_WIDTH
    )
    rate = (
        speedheading.WALKING_RATE
        + speedheading.TRACKING_RATE * close
        - speedheading.EFFORT_RATE * step.effort
    )
    return rate * step.duration


def _speed_features(memory: Columns, sign: Tensor) -> list[Tensor]:
    command = memory[speedheading.SPEED]
    lacks = torch.where(memory[c.STEPS] > 0.0, command - memory[speedheading.LAST_SPEED], 0.0)
    return [
        *_heading_features(memory, sign),
        (command - speedheading.SPEED_CENTRE) / speedheading.SPEED_SCALE,
        lacks / speedheading.SPEED_ERROR_SCALE,
    ]


def _last_speed(memory: Columns, duration: Tensor) -> dict[int, Tensor]:
    return {speedheading.LAST_SPEED: memory[c.ADVANCE] / duration}


def _level_reward(memory: Columns, step: StepTaken) -> Tensor:
    close = closeness(_heading_error(memory), level.TRACKING_WIDTH)
    rate = level.WALKING_RATE + level.TRACKING_RATE * close
    price = level.WORK_PRICE * step.shift_work.clamp(min=0.0)
    return rate * step.duration + level.PROGRESS * memory[c.ADVANCE] - price


def _goal_seen(memory: Columns) -> tuple[Tensor, Tensor]:
    """How far the goal is, and how far to the left of straight ahead."""
    x, z = middle_place(memory)
    x, z = memory[waypoint.GOAL_X] - x, memory[waypoint.GOAL_Z] - z
    cosine, sine = torch.cos(mean_heading(memory)), torch.sin(mean_heading(memory))
    return torch.sqrt(x * x + z * z), torch.atan2(-x * sine - z * cosine, x * cosine - z * sine)


def _waypoint_reward(memory: Columns, step: StepTaken) -> Tensor:
    nearer = memory[waypoint.GOAL_DISTANCE] - _goal_seen(memory)[0]
    rate = waypoint.WALKING_RATE - waypoint.EFFORT_RATE * step.effort
    return rate * step.duration + waypoint.APPROACH * nearer


def _waypoint_features(memory: Columns, sign: Tensor) -> list[Tensor]:
    distance, bearing = _goal_seen(memory)
    return [sign * bearing / waypoint.BEARING_SCALE, distance / waypoint.DISTANCE_SCALE]


def _goal_distance(memory: Columns, duration: Tensor) -> dict[int, Tensor]:
    return {waypoint.GOAL_DISTANCE: _goal_seen(memory)[0]}


def _path_right(memory: Columns, x: Tensor) -> tuple[Tensor, Tensor]:
    """How far to the right the path is at ``x`` downhill, and its slope there."""
    right = slope = torch.zeros_like(x)
    for k in range(slalom.WAVES):
        number, height = memory[slalom.WAVE + 2 * k], memory[slalom.WAVE + 2 * k + 1]
        right = right + height * (1.0 - torch.cos(number * x))
        slope = slope + height * number * torch.sin(number * x)
    return right, slope


def _place_on_path(memory: Columns) -> tuple[Tensor, Tensor]:
    """Distance to the right of the path, and its heading less the walker's."""
    x, z = middle_place(memory)
    right, slope = _path_right(memory, x)
    error = (z - right) / torch.sqrt(1.0 + slope * slope)
    return error, wrapped(-torch.arctan(slope) - mean_heading(memory))


def _slalom_reward(memory: Columns, step: StepTaken) -> Tensor:
    close = closeness(_place_on_path(memory)[0], slalom.TRACKING_WIDTH)
    rate = slalom.WALKING_RATE + slalom.TRACKING_RATE * close - slalom.EFFORT_RATE * step.effort
    return rate * step.duration


def _slalom_features(memory: Columns, sign: Tensor) -> list[Tensor]:
    error, tangent = _place_on_path(memory)
    x, z = middle_place(memory)
    cosine, sine = torch.cos(mean_heading(memory)), torch.sin(mean_heading(memory))
    features = [sign * error / slalom.ERROR_SCALE, sign * tangent / slalom.TANGENT_SCALE]
    for ahead in slalom.PREVIEWS:
        right, _ = _path_right(memory, x + ahead)
        features.append(sign * (-ahead * sine - (right - z) * cosine) / ahead)
    return features


FORMULAS: dict[str, TaskFormulas] = {
    "Walk": TaskFormulas(_walk_reward),
    "Push": TaskFormulas(_walk_reward),
    "Heading": TaskFormulas(_heading_reward, _heading_features),
    "UTurn": TaskFormulas(_heading_reward, _heading_features),
    "SpeedHeading": TaskFormulas(_speed_reward, _speed_features, _last_speed),
    "Level": TaskFormulas(_level_reward, _heading_features),
    "Waypoint": TaskFormulas(_waypoint_reward, _waypoint_features, _goal_distance),
    "Slalom": TaskFormulas(_slalom_reward, _slalom_features),
}
"""By task's name."""


def formulas_of(task: str) -> TaskFormulas:
    """A task's differentiable formulas, or ``ValueError`` if it has none."""
    if task not in FORMULAS:
        raise ValueError(f"task must be one of {', '.join(FORMULAS)}, not {task!r}")
    return FORMULAS[task]
