"""Compile the package's machine code beforehand: ``python -m lean_yaw_env.compile [TASK ...]``.

Each function is compiled when it is first used, and its machine code is kept on disk. An image of a container or a continuous integration
does it once with this command: for all tasks, or for the named ones. ``NUMBA_CACHE_DIR`` says where the machine code is kept; otherwise it is
next to the package, or in the user's cache folder if that cannot be written.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from lean_yaw_env.analysis import section_map_of
from lean_yaw_env.batch import step_batch
from lean_yaw_env.envs.derivatives import LinearisedSteps
from lean_yaw_env.envs.goal_env import WaypointGoalEnv
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.kernel.compilation import for_types_of
from lean_yaw_env.kernel.jacobian import careful_derivatives
from lean_yaw_env.kernel.step import careful_step
from lean_yaw_env.parameters import WalkerParameters
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.registration import TASK_VERSIONS
from lean_yaw_env.reporting import keep, reporting
from lean_yaw_env.validation import require_choice
from lean_yaw_env.walker import Walker

Work = tuple[str, Callable[[], object]]
_STATE = np.array([0.0, 0.155, 0.0, -0.42, 0.0])
_PASSIVE = np.array([0.0, 0.2, 0.0, -0.2, 0.0, -0.005])


def all_work(tasks: Sequence[str] = tuple(TASK_VERSIONS)) -> Iterator[Work]:
    """What compiles everything, one after the other: a name, and a function that uses it."""
    walker = Walker()
    closed = section_map_of(walker)
    passive = PassiveWalker(WalkerParameters(slope=0.009, hip_width=0.05, ankle_tilt=0.3))
    yield "one step", lambda: walker.step(_STATE)
    yield (
        "careful steps",
        lambda: (
            for_types_of(careful_step, np.empty(0), 0),
            for_types_of(careful_derivatives, np.empty(0), 0),
        ),
    )
    yield "motion within a step", lambda: walker.walk(1, state=_STATE, samples_per_step=2)
    yield "steps of a batch", lambda: step_batch(walker.parameters, _STATE[None], [1.0])
    yield "derivatives of a step", lambda: closed.linear_step(_STATE, 0, None)
    yield "derivatives by the body", lambda: closed.linear_step(_STATE, 0, "slope")
    yield "passive step", lambda: passive.step(_PASSIVE)
    yield "passive motion", lambda: passive.motion(_PASSIVE, duration=0.1)
    yield "passive derivatives", lambda: section_map_of(passive).linear_step(_PASSIVE, 0, None)
    yield "goals", lambda: WaypointGoalEnv().reset(seed=0)
    for task in tasks:
        yield f"task {task}", partial(_use, task)


def _use(task: str) -> None:
    """Step one walker and many at a task, and differentiate."""
    env = WalkerVectorEnv(1, task)
    env.reset(seed=0)
    simulation = env.simulation
    simulation.command()
    simulation.step_one(simulation.new_infos())
    linearised = LinearisedSteps(simulation)
    linearised.prepare()
    env.step(np.zeros((1, 2), dtype=np.float32))
    linearised.jacobians()


def compile_all(
    tasks: Sequence[str] = tuple(TASK_VERSIONS), report: Callable[[str], object] = print
) -> None:
    """Compile everything, or what these tasks need, and report how long each part takes.

    Raises
    ------
    ValueError
        If there is no such task.
    """
    for task in tasks:
        require_choice("task", task, TASK_VERSIONS)
    begin = time.perf_counter()
    for name, work in all_work(tasks):
        start = time.perf_counter()
        work()
        report(f"{name:<25}{time.perf_counter() - start:6.1f} s")
    report(f"{'all':<25}{time.perf_counter() - begin:6.1f} s")


def main(arguments: Sequence[str] | None = None) -> None:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m lean_yaw_env.compile", description=__doc__)
    parser.add_argument("tasks", nargs="*", metavar="TASK", help="tasks' names; all by default")
    given = parser.parse_args(arguments)
    with reporting("compile"):
        keep("what is compiled is kept; run the same command again to compile the rest")
        compile_all(given.tasks or tuple(TASK_VERSIONS), lambda line: print(line, flush=True))


if __name__ == "__main__":
    main()
