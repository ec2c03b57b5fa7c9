"""The loops of an environment's step, into which each task's formulas are inlined: one walker, or many."""

from __future__ import annotations

import numpy as np

from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.transition import begin, command, move, observe, push, veil
from lean_yaw_env.kernel.batch import step_batch
from lean_yaw_env.kernel.compilation import borrowed, inlined
from lean_yaw_env.kernel.records import FAILED, Command
from lean_yaw_env.kernel.step import body_of, walking_step, write_outcome

DONE, NOT_A_NUMBER, FAILURE = 0, 1, 2


@inlined
def start_row(bodies, memory, stream, settings, observations, i, fresh, task_begin, task_features):
    """Begin an episode of walker ``i`` (unless its memory was set by hand) and observe it."""
    if fresh:
        begin(bodies, memory, stream, settings, i)
        task_begin(memory, stream, settings, i)
    show(memory, stream, settings, observations, i, task_features)


@inlined
def show(memory, stream, settings, observations, i, task_features):
    """Write walker ``i``'s observation."""
    task_features(memory, settings, observations, i, observe(memory, settings, observations, i))
    veil(stream, settings, observations, i)


@inlined
def settle_row(
    memory, stream, settings, actions, outcomes, observations, rewards, terminated, truncated, i,
    task_reward, task_features,
):  # fmt: skip
    """Take a step's outcome: reward, ends, observation. A step that the solver gave up leaves all as it is; return 1 for it."""
    if outcomes[i, c.OUTCOME_STATUS] == FAILED:
        return FAILURE
    walks = move(memory, outcomes, i)
    if walks and (settings[c.PITCH_PUSH_SIZE] > 0.0 or settings[c.ANKLE_PUSH_SIZE] > 0.0):
        push(memory, stream, settings, i)
    rewards[i], ends = task_reward(memory, stream, settings, actions, outcomes, i, walks)
    terminated[i] = ends or not walks
    truncated[i] = (not terminated[i]) and memory[i, c.TIME] >= settings[c.HORIZON]
    show(memory, stream, settings, observations, i, task_features)
    return DONE


@inlined
def run_one(
    bodies, memory, stream, settings, actions, outcomes, observations, rewards, terminated, truncated,
    task_reward, task_features,
):  # fmt: skip
    """One walker's environment step, through the scalar kernel; return ``DONE``, ``NOT_A_NUMBER`` or ``FAILURE``."""
    memory, stream, settings = borrowed(memory), borrowed(stream), borrowed(settings)
    actions, outcomes, observations = borrowed(actions), borrowed(outcomes), borrowed(observations)
    rewards, terminated, truncated = borrowed(rewards), borrowed(terminated), borrowed(truncated)
    if not (np.isfinite(actions[0, 0]) and np.isfinite(actions[0, 1])):
        return NOT_A_NUMBER
    command(memory, settings, actions, 0)
    outcome = walking_step(
        body_of(bodies[0]),
        Command(memory[0, c.INTER_LEG_ANGLE], memory[0, c.COMMANDED_OFFSET], memory[0, c.OFFSET]),
        memory[0, c.HEADING], memory[0, c.PITCH], memory[0, c.ANKLE],
        memory[0, c.PITCH_RATE], memory[0, c.ANKLE_RATE], memory[0, c.SIDE],
    )  # fmt: skip
    write_outcome(outcome, outcomes[0])
    return settle_row(
        memory, stream, settings, actions, outcomes, observations, rewards, terminated, truncated, 0,
        task_reward, task_features,
    )  # fmt: skip


@inlined
def run_many(
    bodies, memory, stream, settings, actions, outcomes, observations, rewards, terminated, truncated,
    commands, states, sides, skip, first, last, task_reward, task_features,
):  # fmt: skip
    """Environment steps of walkers ``first`` to ``last`` - 1, through the batch kernel; return ``DONE`` or ``FAILURE``.

    Those to skip stay as they are: in their place in the batch the gait is stepped, and its outcome dropped.
    """
    memory, stream, settings = borrowed(memory), borrowed(stream), borrowed(settings)
    actions, outcomes, observations = borrowed(actions), borrowed(outcomes), borrowed(observations)
    rewards, terminated, truncated = borrowed(rewards), borrowed(terminated), borrowed(truncated)
    commands, states, sides = borrowed(commands), borrowed(states), borrowed(sides)
    for i in range(first, last):
        if skip[i]:
            commands[i, 0] = settings[c.BASE_ANGLE]
            commands[i, 1] = 0.0
            commands[i, 2] = 0.0
            for k in range(5):
                states[i, k] = settings[c.GAIT + k]
            sides[i] = 1.0
            continue
        command(memory, settings, actions, i)
        commands[i, 0] = memory[i, c.INTER_LEG_ANGLE]
        commands[i, 1] = memory[i, c.COMMANDED_OFFSET]
        commands[i, 2] = memory[i, c.OFFSET]
        for k in range(5):
            states[i, k] = memory[i, k]
        sides[i] = memory[i, c.SIDE]
    step_batch(bodies, commands, states, sides, outcomes, first, last)
    worst = DONE
    for i in range(first, last):
        if skip[i]:
            continue
        ended = settle_row(
            memory, stream, settings, actions, outcomes, observations, rewards, terminated, truncated, i,
            task_reward, task_features,
        )  # fmt: skip
        worst = max(worst, ended)
    return worst
