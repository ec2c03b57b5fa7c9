"""Walk: keep walking, no command."""

from __future__ import annotations

from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.running import run_many, run_one, start_row
from lean_yaw_env.envs.tasks.task import Metric, Task
from lean_yaw_env.envs.transition import effort
from lean_yaw_env.kernel.compilation import entry_point, inlined

# Reward per unit of time: for walking, and against large actions.
WALKING_RATE = 1.0
EFFORT_RATE = 0.05


@inlined
def task_begin(memory, stream, settings, i):
    pass


@inlined
def task_reward(memory, stream, settings, actions, outcomes, i, walks):
    if not walks:
        return 0.0, True
    rate = WALKING_RATE - EFFORT_RATE * effort(actions, i)
    return rate * outcomes[i, c.OUTCOME_DURATION], False


@inlined
def task_features(memory, settings, observations, i, column):
    pass


@entry_point()
def step_one(
    bodies,
    memory,
    stream,
    settings,
    actions,
    outcomes,
    observations,
    rewards,
    terminated,
    truncated,
):
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
    name="Walk",
    step_one=step_one,
    step_many=step_many,
    start_many=start_many,
    features=(),
    metrics={
        "time_walked": Metric(c.TIME, None, "units of time", "higher"),
        "distance": Metric(c.DISTANCE, None, "leg lengths, along the headings", "higher"),
    },
    summary="Keep walking; nothing is commanded.",
    reward=f"{WALKING_RATE} - {EFFORT_RATE} effort",
    history=("0: the first.",),
)
