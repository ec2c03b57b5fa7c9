"""Waypoint and WaypointGoal: walk to one place after another, or to one and be paid for reaching it alone, on a slope that turns with the walker."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from typing import Any

import numpy as np

from lean_yaw_env.envs.formulas import direction, ends_in_time, mean_heading, place
from lean_yaw_env.envs.state import Field
from lean_yaw_env.envs.tasks.task import (
    FIRST,
    FRICTION_LIMIT,
    SINCE_VERSION_1,
    Command,
    Feature,
    Metric,
    Task,
)
from lean_yaw_env.kernel.compilation import formula
from lean_yaw_env.kernel.random import uniform
from lean_yaw_env.parameters import WalkerParameters

# Leg lengths from where the last goal was reached. Waypoint's are near enough to need tight turns, WaypointGoal's one far enough for wide ones.
NEAREST, FARTHEST = 4.0, 8.0
GOAL_NEAREST, GOAL_FARTHEST = 8.0, 16.0
RADIUS = 0.5
BEARING_SCALE = 0.6  # rad
DISTANCE_SCALE = 8.0
FARTHEST_COMMAND = 1000.0

# Reward: per unit of time for walking at all and against large actions, and per leg length that the goal has come nearer. The fastest way
# straight away from the goal is still worth more than a fall.
WALKING_RATE = 0.5
APPROACH = 1.0
EFFORT_RATE = 0.05


@formula
def to_goal(walker: Any, task: Any) -> Any:
    """From the walker to the goal, downhill and to the right."""
    x, z = place(walker)
    return task.goal_x - x, task.goal_z - z


@formula
def goal_distance(walker: Any, task: Any) -> Any:
    """How far the goal is."""
    x, z = to_goal(walker, task)
    return np.sqrt(x * x + z * z)


@formula
def is_reached(walker: Any, task: Any) -> bool:
    """Whether the last step came to the goal, before the horizon."""
    return ends_in_time(walker) and goal_distance(walker, task).real <= RADIUS


@formula
def goal_bearing(walker: Any, task: Any) -> Any:
    """How far the goal is to the left of straight ahead, rad."""
    x, z = to_goal(walker, task)
    heading = mean_heading(walker)
    cosine, sine = np.cos(heading), np.sin(heading)
    ahead = x * cosine - z * sine
    left = -x * sine - z * cosine
    return direction(left, ahead)


@formula
def start(walker: Any, task: Any) -> None:
    """Draw a place around the walker."""
    distance = uniform(walker, task.nearest, task.farthest)
    bearing = uniform(walker, -pi, pi)
    x, z = place(walker)
    task.goal_x = x + distance * np.cos(bearing)
    task.goal_z = z - distance * np.sin(bearing)


@formula
def reward(walker: Any, task: Any) -> Any:
    nearer = task.goal_distance - goal_distance(walker, task)
    rate = WALKING_RATE - EFFORT_RATE * walker.effort
    return rate * walker.duration + APPROACH * nearer


@formula
def update(walker: Any, task: Any) -> bool:
    if is_reached(walker, task):
        task.goals += 1
        start(walker, task)
    return False


@formula
def refresh(walker: Any, task: Any) -> None:
    task.goal_distance = goal_distance(walker, task)


@formula
def features(walker: Any, task: Any) -> Any:
    return goal_bearing(walker, task), goal_distance(walker, task)


def goal_fields(nearest: float, farthest: float) -> tuple[Field, ...]:
    """The fields of a goal and of how far goals are set."""
    return (
        Field("goal_x", "leg lengths", "downhill"),
        Field("goal_z", "leg lengths", "to the right", is_odd=True),
        Field("nearest", "leg lengths", "that a goal is set", initial=nearest),
        Field("farthest", "leg lengths", "that a goal is set", initial=farthest),
    )


WAYPOINT = Task(
    name="Waypoint",
    fields=(
        *goal_fields(NEAREST, FARTHEST),
        Field("goal_distance", "leg lengths", "to the goal in force", is_followed=True),
        Field("goals", "", "reached so far", "i8"),
    ),
    start=start,
    reward=reward,
    update=update,
    refresh=refresh,
    features=features,
    observed=(
        Feature(
            "goal_bearing",
            BEARING_SCALE,
            "rad",
            "direction of the goal, to the left of the mean of the last two footprints' heading",
            is_odd=True,
        ),
        Feature("goal_distance", DISTANCE_SCALE, "leg lengths", "distance of the goal"),
    ),
    metrics={
        "goals": Metric("goals", None, "reached so far", "higher"),
        "goal_distance": Metric("goal_distance", None, "leg lengths, to the goal in force"),
    },
    summary=f"Walk to one place after another: each {NEAREST:g} to {FARTHEST:g} leg lengths from where the walker is when it is set, at any "
    f"bearing, reached within {RADIUS}. The slope turns with the walker, so that every heading is like any other. With the largest offset "
    "held, 0.05, the walker turns on a radius of 8.2 at the inter-leg angle of 0.3, of 38 at 0.15, 4.1 at 0.36 and 2.3 at 0.39; at 0.42 it "
    "trips.",
    reward_text=f"{WALKING_RATE} + {APPROACH:g} (speed of approach to the goal) - {EFFORT_RATE} effort",
    history=(
        FIRST,
        f"1: goals are {NEAREST:g} to {FARTHEST:g} apart in place of {GOAL_NEAREST:g} to {GOAL_FARTHEST:g}; one reached after the horizon does "
        f"not count; {SINCE_VERSION_1}.",
    ),
    commands={
        "goal": Command(
            ("goal_x", "goal_z"), -FARTHEST_COMMAND, FARTHEST_COMMAND, "place of the first goal"
        )
    },
    goal_fields=("goal_x", "goal_z"),
    goal_radius=RADIUS,
    parameters=WalkerParameters(slope_turns=True, friction_limit=FRICTION_LIMIT),
    horizon=300.0,
    headline="goals",
)


@formula
def goal_reward(walker: Any, task: Any) -> Any:
    return 1.0 if is_reached(walker, task) else 0.0


@formula
def goal_update(walker: Any, task: Any) -> bool:
    if is_reached(walker, task):
        task.reached = 1
    return task.reached != 0


@formula
def goal_refresh(walker: Any, task: Any) -> None:
    heading = mean_heading(walker)
    task.own_x, task.own_z = place(walker)
    task.heading_cosine, task.heading_sine = np.cos(heading), np.sin(heading)


WAYPOINT_GOAL = replace(
    WAYPOINT,
    name="WaypointGoal",
    fields=(
        *goal_fields(GOAL_NEAREST, GOAL_FARTHEST),
        Field("own_x", "leg lengths", "where the walker is, downhill"),
        Field("own_z", "leg lengths", "the same to the right", is_odd=True),
        Field("heading_cosine", "", "of the mean heading of the last two footprints"),
        Field("heading_sine", "", "of the same", is_odd=True),
        Field("reached", "", "whether the goal is reached", "i8"),
    ),
    reward=goal_reward,
    update=goal_update,
    refresh=goal_refresh,
    metrics={
        "is_success": Metric("reached", None, "1 once the goal is reached", "higher", True),
        "time": Metric("time", None, "when the episode ended"),
    },
    summary=f"Walk to one place, {GOAL_NEAREST:g} to {GOAL_FARTHEST:g} leg lengths away at any bearing.",
    reward_text=f"none, but 1 for the step that comes within {RADIUS} of the goal",
    ends="the goal reached",
    horizon=150.0,  # enough for a half circle and the farthest goal, at the gait's speed, twice over
    headline="is_success",
)
