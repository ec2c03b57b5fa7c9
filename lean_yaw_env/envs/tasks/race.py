"""Race: through one gate after another, downhill, as far as possible before the horizon."""

from __future__ import annotations

from math import tan
from typing import Any

from lean_yaw_env.envs.formulas import ends_in_time, place
from lean_yaw_env.envs.state import Field
from lean_yaw_env.envs.tasks.task import FRICTION_LIMIT, NEW, Feature, Metric, Task
from lean_yaw_env.envs.tasks.waypoints import (
    BEARING_SCALE,
    DISTANCE_SCALE,
    goal_bearing,
    goal_distance,
)
from lean_yaw_env.kernel.compilation import formula
from lean_yaw_env.kernel.random import uniform
from lean_yaw_env.parameters import WalkerParameters

NEAREST, FARTHEST = 6.0, 12.0  # leg lengths downhill from gate to gate
GREATEST_BEARING = 0.5  # rad off downhill, from gate to gate
_GREATEST_SHIFT = tan(GREATEST_BEARING)  # to the side per leg length downhill
HALF_WIDTH = 0.5  # leg lengths, of a gate
SHIFT_SCALE = 4.0

# Reward: per leg length downhill, and for a gate that was missed. Gates are farther apart than a missed one costs, so that walking on is
# always worth more than a fall.
PROGRESS = 1.0
MISS_PRICE = 5.0


@formula
def next_gate(walker: Any, task: Any) -> None:
    """Make the gate after the next the next one, and draw another behind it."""
    task.goal_x, task.goal_z = task.later_x, task.later_z
    apart = uniform(walker, NEAREST, FARTHEST)
    task.later_x += apart
    task.later_z += apart * uniform(walker, -_GREATEST_SHIFT, _GREATEST_SHIFT)


@formula
def race_start(walker: Any, task: Any) -> None:
    task.later_x, task.later_z = place(walker)
    next_gate(walker, task)
    next_gate(walker, task)


@formula
def is_beyond(walker: Any, task: Any) -> bool:
    """Whether the walker has come to the next gate's line, before the horizon."""
    return ends_in_time(walker) and place(walker)[0].real >= task.goal_x.real


@formula
def is_missed(walker: Any, task: Any) -> bool:
    """Whether the walker has just gone beyond the gate's line, but beside the gate."""
    aside = place(walker)[1] - task.goal_z
    return is_beyond(walker, task) and abs(aside.real) > HALF_WIDTH


@formula
def race_reward(walker: Any, task: Any) -> Any:
    earned = PROGRESS * (place(walker)[0] - task.downhill)
    return earned - MISS_PRICE if is_missed(walker, task) else earned


@formula
def race_update(walker: Any, task: Any) -> bool:
    if is_beyond(walker, task):
        if is_missed(walker, task):
            task.missed += 1
        else:
            task.passed += 1
        next_gate(walker, task)
    return False


@formula
def race_refresh(walker: Any, task: Any) -> None:
    task.downhill = place(walker)[0]


@formula
def race_features(walker: Any, task: Any) -> Any:
    return (
        goal_bearing(walker, task),
        goal_distance(walker, task),
        task.later_x - task.goal_x,
        task.goal_z - task.later_z,
    )


RACE = Task(
    name="Race",
    fields=(
        Field("goal_x", "leg lengths", "of the next gate, downhill"),
        Field("goal_z", "leg lengths", "the same to the right", is_odd=True),
        Field("later_x", "leg lengths", "of the gate after it, downhill"),
        Field("later_z", "leg lengths", "the same to the right", is_odd=True),
        Field("downhill", "leg lengths", "how far the walker is", is_followed=True),
        Field("passed", "", "gates so far", "i8"),
        Field("missed", "", "gates so far", "i8"),
    ),
    start=race_start,
    reward=race_reward,
    update=race_update,
    refresh=race_refresh,
    features=race_features,
    observed=(
        Feature(
            "goal_bearing",
            BEARING_SCALE,
            "rad",
            "direction of the next gate, to the left of the mean of the last two footprints' heading",
            is_odd=True,
        ),
        Feature("goal_distance", DISTANCE_SCALE, "leg lengths", "distance of the next gate"),
        Feature(
            "gate_spacing",
            DISTANCE_SCALE,
            "leg lengths",
            "how far downhill of the next gate the one after it is",
        ),
        Feature(
            "gate_shift",
            SHIFT_SCALE,
            "leg lengths",
            "how far to the left of the next gate the one after it is",
            is_odd=True,
        ),
    ),
    metrics={
        "downhill": Metric("downhill", None, "leg lengths, progress downhill", "higher"),
        "gates_passed": Metric("passed", None, "gates passed so far", "higher"),
        "gates_missed": Metric("missed", None, "gates missed so far", "lower"),
    },
    summary=f"Race downhill through gates: each {NEAREST:g} to {FARTHEST:g} leg lengths downhill of the one before, up to {GREATEST_BEARING} "
    f"rad to either side of it, and {2 * HALF_WIDTH:g} wide. The way downhill until the horizon counts, and a gate that is missed costs "
    f"{MISS_PRICE:g} leg lengths of it. The masses may be moved as fast as in Level, to pump. The next two gates are seen.",
    reward_text=f"{PROGRESS:g} (speed downhill); {MISS_PRICE:g} less for the step that misses a gate",
    history=NEW,
    goal_fields=("goal_x", "goal_z"),
    goal_radius=HALF_WIDTH,
    parameters=WalkerParameters(friction_limit=FRICTION_LIMIT),
    max_offset_change=0.1,
)
