"""Environments: a step of one against Gymnasium's classics, and vectors of them against the batch kernel and against Gymnasium's.

Everything runs in one thread but for ``vector_two_threads_over_one``. A walker under the fixed controller keeps its masses at rest, one under random actions
moves them at every step, which the integrator has to follow: twice the work. Both are given.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import VectorEnv

from benchmarks.measure import FULL, SMALLEST, Effort, Timings, measure
from benchmarks.measurements import Measurement, command_line
from lean_yaw_env.envs.dynamics import OUTCOME_SIZE
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.kernel.batch import step_batch

HEADING = "LeanYaw/Heading-v0"
STEPS = 200  # of a single environment in a round
SIZES = (1024, 16384)
SMALLEST_SIZES = (8,)
CARTPOLES = 1024


def single_steps(env_id: str, steps: int, actions: str) -> Callable[[], None]:
    """Steps of one unwrapped environment, begun anew where an episode ends."""
    env = gym.make(env_id).unwrapped
    env.action_space.seed(0)
    drawn = [env.action_space.sample() for _ in range(steps)]
    if actions == "fixed":
        drawn = [np.zeros_like(drawn[0])] * steps
    env.reset(seed=0)

    def play() -> None:
        for action in drawn:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()

    return play


def vector_steps(env: VectorEnv[Any, Any, Any], actions: str, steps: int = 1) -> Callable[[], None]:
    """Steps of a vector environment."""
    env.reset(seed=0)
    env.action_space.seed(0)
    drawn = [env.action_space.sample() for _ in range(4)]
    if actions == "fixed":
        drawn = [np.zeros_like(drawn[0])]
    turn = 0

    def play() -> None:
        nonlocal turn
        for _ in range(steps):
            env.step(drawn[turn % len(drawn)])
            turn += 1

    return play


def walkers(n: int, **options: Any) -> WalkerVectorEnv:
    """The package's own vector environment, as ``gym.make_vec`` makes it."""
    env = gym.make_vec(HEADING, num_envs=n, **options).unwrapped
    assert isinstance(env, WalkerVectorEnv)
    return env


def kernel_alone(env: WalkerVectorEnv) -> Callable[[], None]:
    """The batch kernel on the very walkers that the environment has stepped last."""
    simulation = env.simulation
    walkers, n = simulation.walkers, simulation.n
    commands = np.column_stack(
        [walkers[name] for name in ("inter_leg_angle", "commanded_offset", "mass_offset")]
    )
    states, sides = simulation.states.copy(), walkers["side"].copy()
    outcomes = np.empty((n, OUTCOME_SIZE))
    return lambda: step_batch(simulation.bodies, commands, states, sides, outcomes, 0, n)


def _single(effort: Effort, steps: int) -> list[Measurement]:
    times = measure(
        {
            "heading": single_steps(HEADING, steps, "fixed"),
            "random": single_steps(HEADING, steps, "random"),
            "pendulum": single_steps("Pendulum-v1", steps, "random"),
            "cartpole": single_steps("CartPole-v1", steps, "random"),
        },
        effort,
        "single environments",
    )
    measured = [
        Measurement(f"step_{case}", times.median(case) / steps * 1e6, "us", note=note)
        for case, note in (
            ("heading", "fixed controller"), ("random", "random actions"),
            ("pendulum", "Pendulum-v1"), ("cartpole", "CartPole-v1"),
        )
    ]  # fmt: skip
    over_pendulum = times.ratio("heading", "pendulum")
    return [
        *measured,
        Measurement("step_over_pendulum", over_pendulum, "x", "<=", 1.0, "unwrapped"),
        Measurement("random_step_over_pendulum", times.ratio("random", "pendulum"), "x"),
        Measurement("step_over_cartpole", times.ratio("heading", "cartpole"), "x", note="aim: 1"),
    ]


def _vector(effort: Effort, n: int, actions: str) -> list[Measurement]:
    """One size of vector environment against the kernel on the same walkers."""
    env = walkers(n)
    play = vector_steps(env, actions)
    times = measure({"env": play, "kernel": kernel_alone(env)}, effort, f"{n} walkers")
    name = f"vector_{n}_{actions}"
    return [
        Measurement(f"{name}_steps_per_second", n / times.median("env"), "1/s"),
        Measurement(f"{name}_over_kernel", times.ratio("env", "kernel"), "x", "<=", 2.0),
    ]


def _against_cartpole(effort: Effort, n: int) -> list[Measurement]:
    cases: dict[str, Callable[[], object]] = {
        actions: vector_steps(walkers(n), actions) for actions in ("fixed", "random")
    }
    cases["sync"] = vector_steps(
        gym.make_vec("CartPole-v1", num_envs=n, vectorization_mode="sync"), "random"
    )
    times = measure(cases, effort, "SyncVectorEnv")
    return [
        Measurement("sync_cartpole_steps_per_second", n / times.median("sync"), "1/s"),
        Measurement(
            "vector_over_sync_cartpole", times.ratio("sync", "fixed"), "x", ">=", 20.0, "fixed controller"
        ),
        Measurement(
            "random_vector_over_sync_cartpole", times.ratio("sync", "random"), "x", ">=", 20.0,
            "random actions",
        ),
    ]  # fmt: skip


def _two_threads(effort: Effort, n: int) -> Timings:
    return measure(
        {str(t): vector_steps(walkers(n, threads=t), "fixed") for t in (1, 2)},
        effort,
        "two threads",
        threads=2,
    )


def run(smallest: bool) -> list[Measurement]:
    """All measurements of the environments."""
    effort, sizes, steps = (SMALLEST, SMALLEST_SIZES, 5) if smallest else (FULL, SIZES, STEPS)
    measured = _single(effort, steps)
    for n in sizes:
        for actions in ("fixed", "random"):
            measured += _vector(effort, n, actions)
    measured += _against_cartpole(effort, 8 if smallest else CARTPOLES)
    threads = _two_threads(effort, sizes[-1])
    return [
        *measured,
        Measurement("vector_two_threads_over_one", threads.ratio("1", "2"), "x", ">=", 1.8),
    ]


if __name__ == "__main__":
    command_line(run, __doc__)
