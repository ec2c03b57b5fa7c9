"""WaypointGoal: walk to one place, paid for reaching it alone. ``goal_env`` shows it to goal-conditioned learners."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from lean_yaw_env.envs.formulas import mean_heading, place
from lean_yaw_env.envs.state import Field
from lean_yaw_env.envs.tasks.task import Metric
from lean_yaw_env.envs.tasks.waypoint import RADIUS, goal_distance
from lean_yaw_env.envs.tasks.waypoint import TASK as WAYPOINT
from lean_yaw_env.kernel.compilation import formula


@formula
def reward(walker: Any, task: Any) -> Any:
    return 1.0 if goal_distance(walker, task).real <= RADIUS else 0.0


@formula
def update(walker: Any, task: Any) -> bool:
    if goal_distance(walker, task) <= RADIUS:
        task.reached = 1
    return task.reached != 0


@formula
def refresh(walker: Any, task: Any) -> None:
    heading = mean_heading(walker)
    task.own_x, task.own_z = place(walker)
    task.heading_cosine, task.heading_sine = np.cos(heading), np.sin(heading)


TASK = replace(
    WAYPOINT,
    name="WaypointGoal",
    fields=(
        Field("goal_x", "leg lengths", "downhill"),
        Field("goal_z", "leg lengths", "to the right", is_odd=True),
        Field("own_x", "leg lengths", "where the walker is, downhill"),
        Field("own_z", "leg lengths", "the same to the right", is_odd=True),
        Field("heading_cosine", "", "of the mean heading of the last two footprints"),
        Field("heading_sine", "", "of the same", is_odd=True),
        Field("reached", "", "whether the goal is reached", "i8"),
    ),
    reward=reward,
    update=update,
    refresh=refresh,
    metrics={
        "is_success": Metric("reached", None, "1 once the goal is reached", "higher", True),
        "time": Metric("time", None, "when the episode ended"),
    },
    summary="Walk to one place, as far and at any bearing as in Waypoint.",
    reward_text=f"none, but 1 for the step that comes within {RADIUS} of the goal",
    ends="the goal reached",
    horizon=150.0,
    headline="is_success",
)
"""The horizon is enough for a half circle and the farthest goal, at the gait's speed, twice over."""
