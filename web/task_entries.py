"""The environments' tasks as a web page calls them: the records of one walker in memory, stepped and judged by the tasks' own formulas.

A record's layout is in the fields that its task declares, eight bytes for each number; ``build_kernel`` writes them down for the page.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np
from numba import carray, types

from lean_yaw_env.envs.dynamics import walk_one
from lean_yaw_env.envs.info import info_size
from lean_yaw_env.envs.judging import What
from lean_yaw_env.envs.options import ACTION_SIZE, EnvOptions
from lean_yaw_env.envs.reset import start_episodes
from lean_yaw_env.envs.state import SETTINGS, WALKER
from lean_yaw_env.envs.tasks import Task, task_named
from lean_yaw_env.kernel.records import Body

TASKS = ("Heading", "SpeedHeading", "Waypoint", "Slalom", "Push", "UTurn", "Level", "Walk")
"""Those that the page offers; ``WaypointGoal`` is Waypoint with other observations."""

BODY = len(Body._fields)
_STEP, _START = int(What.STEP), int(What.START)
_Entry = Callable[..., Any]


def _entries_of(task: Task) -> dict[_Entry, Any]:
    """The start and the step of a task's episode.

    Both take records of the walker, the task and the settings, and the body; the step takes an action, and both write the observation; the
    step writes reward, terminated and truncated, as three doubles.
    """
    judge, record = task.judge, task.record
    size, infos = len(EnvOptions().observation_names(task)), info_size(task)

    def start(walkers, tasks, settings, bodies, observations):
        w, t = carray(walkers, 1, WALKER), carray(tasks, 1, record)
        s, b = carray(settings, 1, SETTINGS), carray(bodies, (1, BODY), np.float64)
        seen = carray(observations, (1, size), np.float32)
        nobody = np.zeros(1, dtype=np.bool_)
        start_episodes(w, b, s, nobody)
        judge(
            _START, w, t, s, seen, np.zeros(1), np.zeros((2, 1), dtype=np.bool_),
            np.zeros((0, infos)), nobody, 0, 1,
        )  # fmt: skip

    def step(walkers, tasks, settings, bodies, actions, observations, results):
        w, t = carray(walkers, 1, WALKER), carray(tasks, 1, record)
        s, b = carray(settings, 1, SETTINGS), carray(bodies, (1, BODY), np.float64)
        seen = carray(observations, (1, size), np.float32)
        rewards, ends = np.zeros(1), np.zeros((2, 1), dtype=np.bool_)
        walk_one(w, b, s, carray(actions, (1, ACTION_SIZE), np.float32))
        judge(
            _STEP, w, t, s, seen, rewards, ends, np.zeros((0, infos)),
            np.zeros(1, dtype=np.bool_), 0, 1,
        )  # fmt: skip
        out = carray(results, 3, np.float64)
        out[0] = rewards[0]
        out[1] = 1.0 if ends[0, 0] else 0.0
        out[2] = 1.0 if ends[1, 0] else 0.0

    start.__name__, step.__name__ = f"start_{task.name}", f"step_{task.name}"
    place = types.voidptr
    found: dict[_Entry, Any] = {
        start: types.void(place, place, place, place, place),
        step: types.void(place, place, place, place, place, place, place),
    }
    return found | _path_of(task)


def _path_of(task: Task) -> dict[_Entry, Any]:
    """The path to be followed, if there is one: how far to the right it is at a place downhill."""
    path_right = getattr(import_module(task.features.__module__), "path_right", None)
    if path_right is None:
        return {}
    record = task.record

    def path(tasks, downhill):
        return path_right(carray(tasks, 1, record)[0], downhill)

    path.__name__ = f"path_{task.name}"
    return {path: types.float64(types.voidptr, types.float64)}


def entries() -> dict[_Entry, Any]:
    """What the module exports, with its signatures."""
    return {
        function: signature
        for name in TASKS
        for function, signature in _entries_of(task_named(name)).items()
    }
