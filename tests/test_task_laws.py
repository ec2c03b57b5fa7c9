"""Laws of every task of the package: what counts is time, and walkers do not change one another."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from lean_yaw_env.envs.formulas import mean_heading, place
from lean_yaw_env.envs.info import FallCode
from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.envs.state import as_records
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.registration import TASK_VERSIONS

TASKS = tuple(TASK_VERSIONS)
ANGLES = (-0.6, -0.3, 0.0, 0.3)
"""First number of actions: inter-leg angles from 0.21 to 0.345."""

Rate = Callable[[float, float, float], float]


def _level(speed: float, work: float, effort: float) -> float:
    return 0.7 + 0.5 * speed - 5.0 * work


def _heading(speed: float, work: float, effort: float) -> float:
    return 1.0 - 0.05 * effort


STATED_RATES: dict[str, Rate] = {
    "Heading": _heading,
    "Walk": _heading,
    "SpeedHeading": _heading,
    "Waypoint": lambda speed, work, effort: 0.5 + speed - 0.05 * effort,
    "Slalom": _heading,
    "Push": _heading,
    "UTurn": _heading,
    "Level": _level,
    "LevelUphill": _level,
}
"""What each task states that it pays per unit of time for a straight walk with no error, from speed, power and effort: what a speed is
worth is in the statement, what a step's length is worth is in none."""


def aim_ahead(simulation: Simulation) -> None:
    """Ask every walker for what it does: its heading, its speed, a goal or a path straight ahead."""
    walkers, tasks = simulation.walkers, simulation.tasks
    heading = mean_heading(as_records(walkers))
    x, z = place(as_records(walkers))
    names = tasks.dtype.names or ()
    asked: dict[str, Any] = {
        "command": heading,
        "command_left": math.inf,
        "commanded_speed": walkers["speed"],
        "goal_x": x + 1000.0 * np.cos(heading),
        "goal_z": z - 1000.0 * np.sin(heading),
        "heights": 0.0,
    }
    if "heights" in names:
        walkers["place_z"] -= z  # onto the path
    for name in asked.keys() & set(names):
        tasks[name] = asked[name]
    simulation.observe()


@pytest.mark.parametrize("task", TASKS)
def test_short_and_long_steps_earn_what_the_task_states_and_no_more(task: str) -> None:
    pumping = 0.5 if task_named(task).pumping else 0.0
    for angle in ANGLES:
        env = WalkerVectorEnv(2, task, push_level=0.0, start_disturbance=0.0, horizon=math.inf)
        env.reset(seed=0)
        action = np.tile(np.float32([angle, pumping]), (2, 1))
        simulation = env.simulation
        earned = np.zeros(2)
        for step in range(200):
            if step == 180:  # it has come to the gait of this angle
                before, earned = simulation.walkers.copy(), np.zeros(2)
            aim_ahead(simulation)
            _, rewards, terminated, _, _ = env.step(action)
            assert not terminated.any()
            earned += rewards
        time, distance, work = (
            simulation.walkers[name] - before[name] for name in ("time", "distance", "work")
        )
        effort = 0.5 * (angle**2 + pumping**2)
        stated = [STATED_RATES[task](d / t, w / t, effort) for d, w, t in zip(distance, work, time, strict=True)]  # fmt: skip
        # a gait's heading and path alternate about the straight line; errors count by their squares
        np.testing.assert_allclose(earned / time, stated, rtol=0.0, atol=2e-3)


@pytest.mark.parametrize("task", TASKS)
def test_a_step_that_the_solver_cannot_finish_leaves_the_others_bits(task: str) -> None:
    n, failed = 6, 2
    envs = [
        WalkerVectorEnv(n, task, autoreset_mode=AutoresetMode.DISABLED, threads=threads)
        for threads in (1, 2)
    ]
    for env in envs:
        env.reset(seed=1)
    envs[1].simulation.walkers["stance_pitch_rate"][failed] = math.nan
    others = np.arange(n) != failed
    actions = np.random.default_rng(0).uniform(-0.3, 0.3, (n, 2)).astype(np.float32)
    whole, some = (env.step(actions) for env in envs)
    assert some[4]["fall"][failed] == FallCode.SOLVER
    assert some[2][failed] and some[1][failed] == 0.0
    for a, b in zip(whole[:4], some[:4], strict=True):
        assert np.array_equal(a[others], b[others])
    ours, theirs = ((env.simulation.walkers, env.simulation.tasks) for env in envs)
    for a, b in zip(ours, theirs, strict=True):
        assert np.array_equal(a[others], b[others])
