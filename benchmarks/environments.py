"""Environments: a step of one against Gymnasium's classics, and vectors of them against the batch kernel and against Gymnasium's.

Everything runs in one thread but for ``vector_two_threads_over_one``. A walker under the fixed controller keeps its masses at rest, one under random actions
moves them at every step, which the integrator has to follow: twice the work. Both are given.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import VectorEnv

from benchmarks.measure import FULL, SMALLEST, Effort, Measurement, command_line, measure
from lean_yaw_env.envs.dynamics import OUTCOME_SIZE
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.kernel.batch import step_batch

HEADING = "LeanYaw/Heading-v1"
STEPS = 200  # of a single environment in a round
SIZES = (1024, 16384)
SMALLEST_SIZES = (8,)
CARTPOLES = 1024


def _drawn(env: Any, actions: str, n: int) -> list[Any]:
    """Random actions, or those of the fixed controller."""
    env.action_space.seed(0)
    env.reset(seed=0)
    drawn = [env.action_space.sample() for _ in range(n)]
    return [np.zeros_like(drawn[0])] * n if actions == "fixed" else drawn


def single_steps(env_id: str, steps: int, actions: str) -> Callable[[], None]:
    """Steps of one unwrapped environment, begun anew where an episode ends."""
    env = gym.make(env_id).unwrapped
    drawn = _drawn(env, actions, steps)

    def play() -> None:
        for action in drawn:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()

    return play


def vector_steps(env: VectorEnv[Any, Any, Any], actions: str) -> Callable[[], object]:
    """A step of a vector environment."""
    drawn = itertools.cycle(_drawn(env, actions, 4))
    return lambda: env.step(next(drawn))


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
    cases = {
        "heading": (HEADING, "fixed", "fixed controller"),
        "random": (HEADING, "random", "random actions"),
        "pendulum": ("Pendulum-v1", "random", "Pendulum-v1"),
        "cartpole": ("CartPole-v1", "random", "CartPole-v1"),
    }
    plays = {
        name: single_steps(env_id, steps, actions) for name, (env_id, actions, _) in cases.items()
    }
    times = measure(plays, effort, "single environments")
    return [
        *(Measurement(f"step_{name}", times.median(name) / steps * 1e6, "us", note=note)
          for name, (_, _, note) in cases.items()),
        Measurement("step_over_pendulum", times.ratio("heading", "pendulum"), "x", "<=", 1.0, "unwrapped"),
        Measurement("random_step_over_pendulum", times.ratio("random", "pendulum"), "x"),
        Measurement("step_over_cartpole", times.ratio("heading", "cartpole"), "x", note="aim: 1"),
    ]  # fmt: skip


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


def _against_others(effort: Effort, n: int, largest: int) -> list[Measurement]:
    """Against Gymnasium's vector of CartPoles, and two threads against one."""
    sync = gym.make_vec("CartPole-v1", num_envs=n, vectorization_mode="sync")
    times = measure(
        {actions: vector_steps(walkers(n), actions) for actions in ("fixed", "random")}
        | {"sync": vector_steps(sync, "random")},
        effort,
        "SyncVectorEnv",
    )
    threads = measure(
        {str(t): vector_steps(walkers(largest, threads=t), "fixed") for t in (1, 2)},
        effort,
        "two threads",
        threads=2,
    )
    return [
        Measurement("sync_cartpole_steps_per_second", n / times.median("sync"), "1/s"),
        Measurement("vector_over_sync_cartpole", times.ratio("sync", "fixed"), "x", ">=", 20.0, "fixed controller"),
        Measurement("random_vector_over_sync_cartpole", times.ratio("sync", "random"), "x", ">=", 20.0, "random actions"),
        Measurement("vector_two_threads_over_one", threads.ratio("1", "2"), "x", ">=", 1.8),
    ]  # fmt: skip


def run(smallest: bool) -> list[Measurement]:
    """All measurements of the environments."""
    effort, sizes, steps = (SMALLEST, SMALLEST_SIZES, 5) if smallest else (FULL, SIZES, STEPS)
    vectors = [_vector(effort, n, actions) for n in sizes for actions in ("fixed", "random")]
    others = _against_others(effort, 8 if smallest else CARTPOLES, sizes[-1])
    return [*_single(effort, steps), *itertools.chain(*vectors), *others]


if __name__ == "__main__":
    command_line(run, __doc__)
