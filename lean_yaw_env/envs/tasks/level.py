"""Level: walk without a slope, or up one, by moving the masses from side to side, and steer."""

from __future__ import annotations

from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.running import run_many, run_one, start_row
from lean_yaw_env.envs.tasks.heading import (
    COMMAND,
    HEADING_COMMAND,
    HEADING_END,
    HEADING_FEATURE,
    HEADING_METRICS,
    LARGEST_SLOPE_COMMAND,
    LONGEST_COMMAND,
    SHORTEST_COMMAND,
    TRACKING_WIDTH,
    closeness,
    command_runs_out,
    follow_heading,
    new_heading_command,
    task_features,
)
from lean_yaw_env.envs.tasks.task import Metric, Task
from lean_yaw_env.kernel.compilation import entry_point, inlined
from lean_yaw_env.kernel.records import Outcome
from lean_yaw_env.parameters import WalkerParameters

SHIFT_WORK = Outcome._fields.index("shift_work")
WORK_SUM = HEADING_END

PUMPING = 0.03  # mass offset of the gait in which episodes start, away from the stance foot

# Reward per unit of time for walking at all and for tracking; per leg length walked; against work, in weight times leg length.
WALKING_RATE = 0.2
TRACKING_RATE = 0.5
PROGRESS = 0.5
WORK_PRICE = 5.0


@inlined
def task_begin(memory, stream, settings, i):
    new_heading_command(memory, stream, settings, i)


@inlined
def task_reward(memory, stream, settings, actions, outcomes, i, walks):
    work = max(outcomes[i, SHIFT_WORK], 0.0)
    memory[i, WORK_SUM] += work
    if not walks:
        return 0.0, True
    duration = outcomes[i, c.OUTCOME_DURATION]
    error = follow_heading(memory, i, duration)
    rate = WALKING_RATE + TRACKING_RATE * closeness(error, TRACKING_WIDTH)
    if command_runs_out(memory, i):
        new_heading_command(memory, stream, settings, i)
    return rate * duration + PROGRESS * memory[i, c.ADVANCE] - WORK_PRICE * work, False


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
    name="Level",
    step_one=step_one,
    step_many=step_many,
    start_many=start_many,
    features=(HEADING_FEATURE,),
    metrics={
        **HEADING_METRICS,
        "mean_speed": Metric(c.DISTANCE, c.TIME, "distance along the headings over time", "higher"),
        "cost_of_transport": Metric(
            WORK_SUM,
            c.DISTANCE,
            "work per weight and distance; of a step's work, what is positive",
            "lower",
        ),
    },
    summary="Walk on a level floor, or up a gentle slope (`slope=-0.005`), powered by nothing but moving the masses from side to side, and "
    f"steer: a heading within {LARGEST_SLOPE_COMMAND} rad, commanded anew every {SHORTEST_COMMAND} to {LONGEST_COMMAND} steps. Episodes "
    f"start near the gait of offsets of {PUMPING} away from the stance foot.",
    reward=f"{WALKING_RATE} + {TRACKING_RATE} / (1 + (heading error / {TRACKING_WIDTH})^2) + {PROGRESS} speed - {WORK_PRICE:g} (power put "
    "into moving the masses)",
    history=("0: the first.",),
    commands={"command": HEADING_COMMAND},
    command_column=COMMAND,
    constants=(LARGEST_SLOPE_COMMAND,),
    parameters=WalkerParameters(slope=0.0),
    max_offset_change=0.1,
    pumping=PUMPING,
)
