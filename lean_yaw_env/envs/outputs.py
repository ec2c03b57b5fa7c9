"""What an environment returns after a step or a reset: reward, ends, observation and info, compiled for each task from its own formulas.

``write_outputs`` is a template: ``compiled_for`` puts a task's formulas and tables in the place of the names above it in capitals.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from enum import IntEnum
from typing import Any

from lean_yaw_env.envs.info import info_report, infos_of
from lean_yaw_env.envs.observation import (
    COMMON_CENTRES,
    COMMON_ODD,
    COMMON_SCALES,
    STANCE_FOOT,
    common_values,
    corrupt,
    limited,
    mirror_sign,
    show_body,
)
from lean_yaw_env.envs.tasks.task import Task
from lean_yaw_env.kernel.compilation import borrowed, entry_point_with


class Event(IntEnum):
    """What has happened to the records when outputs are written."""

    STEP = 0
    """A walking step: reward, ends, observation."""
    RESET = 1
    """The start of an episode: the task draws what it asks; observation."""
    EDIT = 2
    """Records were set by hand: observation."""
    NONE = 3
    """Only the infos are wanted."""


_STEP, _RESET, _NONE = int(Event.STEP), int(Event.RESET), int(Event.NONE)

TASK_START: Any = None
TASK_REWARD: Any = None
TASK_UPDATE: Any = None
TASK_REFRESH: Any = None
TASK_FEATURES: Any = None
REPORT: Any = None
CENTRES, SCALES, ODD = COMMON_CENTRES, COMMON_SCALES, COMMON_ODD


def reward_and_ends(walker, task, settings):
    """A step's reward, and whether it ends the episode: terminated, truncated.

    The reward of a fall is zero, that of the step across the horizon the share that lies before it.
    """
    if walker.fall != 0:
        return 0.0, True, False
    reward = walker.share * TASK_REWARD(walker, task)
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
    show_body(observation, column, walker, settings)
    corrupt(observation, walker, settings)


def write_row(event, walker, task, settings, observation, rewards, ends, i):
    """Write a walker's reward, ends and observation, as ``write_outputs`` does for many."""
    if event == _STEP:
        rewards[i], ends[0, i], ends[1, i] = reward_and_ends(walker, task, settings)
    if event == _RESET:
        TASK_START(walker, task)
    if event != _NONE:
        TASK_REFRESH(walker, task)
        observe(observation, walker, task, settings)


def write_outputs(
    event, walkers, tasks, settings, observations, rewards, ends, infos, skip, first, last
):  # fmt: skip
    """Write the outputs of walkers ``first`` to ``last`` - 1, but those to skip.

    Parameters
    ----------
    event : an ``Event``
    walkers, tasks, settings : records (n,), (n,) and (1,)
    observations : float32 (n, numbers), written
    rewards : (n,), written after steps
    ends : bool (2, n), written after steps: terminated, truncated
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
        write_row(event, walker, task, common, observations[i], rewards, ends, i)
        if len(infos) > 0:
            REPORT(infos[i], walker, task)


def outputs_of(task: Task) -> Any:
    """The compiled ``write_outputs`` of a task."""
    return compiled_for(task, write_outputs, ROW_PARTS, lambda: {"REPORT": info_report(task)})


ROW_PARTS = (reward_and_ends, observe, write_row)
"""The parts that a template which calls ``write_row`` has."""


def compiled_for(
    task: Task,
    template: Callable[..., Any],
    parts: Sequence[Any],
    own_tables: Callable[[], dict[str, Any]],
    fill: Callable[..., Any] = entry_point_with,
) -> Any:
    """A template with a task's formulas and tables, made by ``fill``; tasks that have the same ones share what is compiled."""
    formulas = {
        "TASK_START": task.start,
        "TASK_REWARD": task.reward,
        "TASK_UPDATE": task.update,
        "TASK_REFRESH": task.refresh,
        "TASK_FEATURES": task.features,
    }
    tables = {
        "CENTRES": (*COMMON_CENTRES, *(feature.centre for feature in task.observed)),
        "SCALES": (*COMMON_SCALES, *(feature.scale for feature in task.observed)),
        "ODD": (*COMMON_ODD, *(feature.is_odd for feature in task.observed)),
    }
    contents = (
        [field[:5] for field in task.fields],
        tables,
        [info[:2] for info in infos_of(task)],
        task.slope_varies,
    )
    key = (template, *formulas.values(), repr(contents))
    if key not in _COMPILED:
        names = [f"{each.__module__}.{each.__qualname__}" for each in formulas.values()]
        digest = hashlib.sha256(repr((names, contents)).encode()).hexdigest()[:16]
        _COMPILED[key] = fill(template, digest, formulas, parts, **tables, **own_tables())
    return _COMPILED[key]


_COMPILED: dict[tuple[Any, ...], Any] = {}
"""Entry points by template, formulas and tables."""
