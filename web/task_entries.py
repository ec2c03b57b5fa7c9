"""The environments' tasks as a web page calls them: the records of one walker in memory, moved and judged by the package's own formulas.

The walking step itself is the kernel's module's: the page takes an action (``command``), walks by ``kernel_entries.walker_step``, and puts
the outcome into the record (``move``). A record's layout is in its fields, eight bytes for each number; ``build_kernel`` writes them down.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import carray, njit, types

from lean_yaw_env.envs.dynamics import OUTCOME_SIZE, outcome_of, push
from lean_yaw_env.envs.dynamics import command as command_by
from lean_yaw_env.envs.dynamics import move as move_by
from lean_yaw_env.envs.info import InfoMaker
from lean_yaw_env.envs.options import ACTION_SIZE, EnvOptions
from lean_yaw_env.envs.outputs import outputs_of
from lean_yaw_env.envs.reset import start_episodes
from lean_yaw_env.envs.state import SETTINGS, WALKER
from lean_yaw_env.envs.tasks import TASKS as ALL_TASKS
from lean_yaw_env.envs.tasks import Task
from lean_yaw_env.envs.tasks.slalom import SLALOM, path_right
from lean_yaw_env.kernel.records import Body

TASKS = [task for task in ALL_TASKS.values() if task.name != "WaypointGoal"]
"""Those that the page offers; WaypointGoal is Waypoint with observations of another form."""

BODY = len(Body._fields)
_compiled: Any = njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
_start = _compiled(start_episodes.py_func)
_SLALOM = SLALOM.record


def start(walkers, bodies, settings):
    """Put a walker, whose record holds zeros and a key, at the start of an episode."""
    _start(
        carray(walkers, 1, WALKER), carray(bodies, (1, BODY), np.float64), carray(settings, 1, SETTINGS),
        np.zeros(1, dtype=np.bool_),
    )  # fmt: skip


def command(walkers, settings, actions):
    """Put what an action of two numbers commands into the record."""
    walker, common = carray(walkers, 1, WALKER)[0], carray(settings, 1, SETTINGS)[0]
    command_by(walker, common, carray(actions, ACTION_SIZE, np.float32))


def move(walkers, settings, outcome):
    """Take a step's outcome into the record, and push."""
    walker, common = carray(walkers, 1, WALKER)[0], carray(settings, 1, SETTINGS)[0]
    move_by(walker, outcome_of(carray(outcome, OUTCOME_SIZE, np.float64)), common.horizon)
    push(walker, common)


def _outputs(task: Task) -> Any:
    """The entry that writes a task's observation after an event and, after a step, the reward and whether it ends: three doubles."""
    write = _compiled(outputs_of(task).py_func)
    record = task.record
    size = len(EnvOptions().observation_names(task))
    infos = InfoMaker(task, has_pushes=True, has_bodies=True).size

    def outputs(event, walkers, tasks, settings, observations, results):
        rewards, ends = np.zeros(1), np.zeros((2, 1), dtype=np.bool_)
        write(
            event, carray(walkers, 1, WALKER), carray(tasks, 1, record), carray(settings, 1, SETTINGS),
            carray(observations, (1, size), np.float32), rewards, ends, np.zeros((0, infos)),
            np.zeros(1, dtype=np.bool_), 0, 1,
        )  # fmt: skip
        out = carray(results, 3, np.float64)
        out[0] = rewards[0]
        out[1] = 1.0 if ends[0, 0] else 0.0
        out[2] = 1.0 if ends[1, 0] else 0.0

    outputs.__name__ = f"outputs_{task.name}"
    return outputs


def path_Slalom(tasks, downhill):
    """How far to the right the path is at a place downhill."""
    return path_right(carray(tasks, 1, _SLALOM)[0], downhill)


_place = types.voidptr
ENTRIES = {
    start: types.void(_place, _place, _place),
    command: types.void(_place, _place, _place),
    move: types.void(_place, _place, _place),
    path_Slalom: types.float64(_place, types.float64),
    **{
        _outputs(task): types.void(types.int64, _place, _place, _place, _place, _place)
        for task in TASKS
    },
}
"""What the module exports, with its signatures."""
