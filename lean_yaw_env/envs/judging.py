"""What follows a walking step: reward, ends, observation and info, compiled once for each task from its own formulas.

``judge`` is a template: ``entry_point_with`` puts a task's formulas and tables in the place of the names below it in capitals.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from lean_yaw_env.envs.observation import (
    COMMON_CENTRES,
    COMMON_ODD,
    COMMON_SCALES,
    STANCE_FOOT,
    common_values,
    limited,
    mirror_sign,
    spoil,
)
from lean_yaw_env.kernel.compilation import borrowed, formula


class What(IntEnum):
    """What there is to judge."""

    STEP = 0
    """A walking step: reward, ends, observation."""
    START = 1
    """The start of an episode: what the task draws, and the observation."""
    PLACE = 2
    """Records set by hand: the observation."""
    REPORT = 3
    """Nothing: only the infos are wanted."""


_STEP, _START, _REPORT = int(What.STEP), int(What.START), int(What.REPORT)


@formula
def no_start(walker: Any, task: Any) -> None:
    """A task that draws nothing."""


@formula
def no_update(walker: Any, task: Any) -> bool:
    """A task that keeps no account and ends no episode."""
    return False


@formula
def no_refresh(walker: Any, task: Any) -> None:
    """A task without derived fields."""


@formula
def no_features(walker: Any, task: Any) -> Any:
    """A task that observes nothing of its own."""
    return ()


TASK_START: Any = no_start
TASK_REWARD: Any = None
TASK_UPDATE: Any = no_update
TASK_REFRESH: Any = no_refresh
TASK_FEATURES: Any = no_features
REPORT: Any = None
CENTRES, SCALES, ODD = COMMON_CENTRES, COMMON_SCALES, COMMON_ODD


def pay(walker, task, settings):
    """A step's reward, and whether it ends the episode: terminated, truncated. A fall pays nothing."""
    if walker.fall != 0:
        return 0.0, True, False
    reward = TASK_REWARD(walker, task)
    ends = TASK_UPDATE(walker, task)
    is_late = walker.time >= settings.horizon or walker.steps >= settings.max_episode_steps
    return reward, ends, is_late and not ends


def observe(observation, walker, task, settings):
    """Write an observation."""
    sign = mirror_sign(walker, settings)
    values = common_values(walker, settings) + TASK_FEATURES(walker, task)
    column = 0
    for k in range(len(values)):
        if k == STANCE_FOOT and settings.mirror != 0:
            continue
        value = sign * values[k] if ODD[k] else values[k]
        observation[column] = limited((value - CENTRES[k]) / SCALES[k])
        column += 1
    spoil(observation, walker, settings)


def judge(
    what, walkers, tasks, settings, observations, rewards, ends, infos, skip, first, last
):  # fmt: skip
    """Judge walkers ``first`` to ``last`` - 1, but those to skip.

    Parameters
    ----------
    what : a ``What``
    walkers, tasks, settings : records (n,), (n,) and (1,)
    observations : float32 (n, numbers), written
    rewards : (n,), written by steps
    ends : bool (2, n), written by steps: terminated, truncated
    infos : (n, numbers), written, or (0, numbers) for none
    skip : bool (n,)
    """
    walkers, tasks, settings = borrowed(walkers), borrowed(tasks), borrowed(settings)
    observations, rewards, ends = borrowed(observations), borrowed(rewards), borrowed(ends)
    infos, skip = borrowed(infos), borrowed(skip)
    common = settings[0]
    for i in range(first, last):
        if skip[i]:
            continue
        walker, task = walkers[i], tasks[i]
        if what == _STEP:
            rewards[i], ends[0, i], ends[1, i] = pay(walker, task, common)
        if what == _START:
            TASK_START(walker, task)
        if what != _REPORT:
            TASK_REFRESH(walker, task)
            observe(observations[i], walker, task, common)
        if len(infos) > 0:
            REPORT(infos[i], walker, task)
