"""Push: stay on your feet while you are pushed after every step."""

from __future__ import annotations

from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.running import run_many, run_one, start_row
from lean_yaw_env.envs.tasks.task import Metric, Task
from lean_yaw_env.envs.tasks.walk import EFFORT_RATE, WALKING_RATE, task_begin, task_features
from lean_yaw_env.envs.transition import ANKLE_PUSH, PITCH_PUSH, effort
from lean_yaw_env.kernel.compilation import entry_point, inlined

SURVIVED = c.TASK

TRIAL = 200  # steps
PUSH_LEVEL = 0.5
LARGEST_CHANGE = 0.1  # of the offset: what tells from a gentle one how hard a push can be met


@inlined
def task_reward(memory, stream, settings, actions, outcomes, i, walks):
    if not walks:
        return 0.0, True
    if memory[i, c.STEPS] >= TRIAL:
        memory[i, SURVIVED] = 1.0
    rate = WALKING_RATE - EFFORT_RATE * effort(actions, i)
    return rate * outcomes[i, c.OUTCOME_DURATION], False


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
    name="Push",
    step_one=step_one,
    step_many=step_many,
    start_many=start_many,
    features=(),
    metrics={
        "survived_200_steps": Metric(SURVIVED, None, f"1 from step {TRIAL} on", "higher", True),
        "time_walked": Metric(c.TIME, None, "units of time", "higher"),
    },
    summary="Stay on your feet: after every step both rates get a random impulse, which the next observation shows as part of the rates. "
    f"At push_level = 1 the standard deviations are {PITCH_PUSH} on the pitch rate and {ANKLE_PUSH} on the ankle rate.",
    reward=f"{WALKING_RATE} - {EFFORT_RATE} effort",
    history=("0: the first.",),
    horizon=300.0,
    max_offset_change=LARGEST_CHANGE,
    push_level=PUSH_LEVEL,
    headline="survived_200_steps",
)
