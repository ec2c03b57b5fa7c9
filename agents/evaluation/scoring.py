"""One evaluator for every agent: many seeded episodes on the compiled batch, the same ones for each agent, and means with intervals."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.envs.info import FallCode
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.parameters import Vector
from lean_yaw_env.validation import require_count

from ..agent import Agent, State, attach
from ..seeds import MOST_EPISODES, EpisodeSet, first_seed
from .episodes import FELL, RETURN, SPEED, TIME, Episodes, Results, Row, metric_names, summary

_CHUNK = 1024  # walkers stepped together

Progress = Callable[[int], object]


def run_episodes(
    agent: Agent,
    task: str,
    *,
    episodes: int,
    seed: int = 0,
    episode_set: EpisodeSet = "validation",
    options: EnvOptions | None = None,
    progress: Progress | None = None,
) -> Episodes:
    """Run an agent through episodes; which, depends on ``episode_set`` and ``seed`` alone.

    Parameters
    ----------
    agent, task, options : who walks, at which task, under which options
    episodes : 1 to ``MOST_EPISODES``, or ``ValueError``
    seed : int >= 0, or ``ValueError``
    progress : called with the number of episodes that have just ended
    """
    total = require_count("episodes", episodes, 1, MOST_EPISODES)
    first = first_seed(episode_set, seed)
    return run_seeds(agent, task, range(first, first + total), options=options, progress=progress)


def run_seeds(
    agent: Agent,
    task: str,
    seeds: Sequence[int],
    *,
    options: EnvOptions | None = None,
    progress: Progress | None = None,
) -> Episodes:
    """Run an agent through one episode for each environment seed; for those of an evaluation, see ``run_episodes``."""
    parts = [
        _run_chunk(agent, task, seeds[start : start + _CHUNK], options, progress)
        for start in range(0, len(seeds), _CHUNK)
    ]
    return Episodes.joined(parts)


def evaluate(
    task: str,
    agents: Mapping[str, Agent],
    *,
    episodes: int,
    seed: int = 0,
    options: EnvOptions | None = None,
    progress: Progress | None = None,
) -> list[Row]:
    """Run every agent through the same validation episodes; one row for each metric of each agent, ``survival`` last.

    Raises
    ------
    ValueError
        If there are no agents, or as ``run_episodes``.
    """
    if not agents:
        raise ValueError("agents must hold one agent or more, got none")
    rows: list[Row] = []
    for name, agent in agents.items():
        walked = run_episodes(
            agent, task, episodes=episodes, seed=seed, options=options, progress=progress
        )
        rows += summary(Results(task, name, (walked,)))
    return rows


def _run_chunk(
    agent: Agent,
    task_name: str,
    seeds: Sequence[int],
    options: EnvOptions | None,
    progress: Progress | None,
) -> Episodes:
    """One episode for each seed, walked side by side; those that have ended walk on unseen."""
    chosen = EnvOptions() if options is None else options
    n = len(seeds)
    env = WalkerVectorEnv(n, task_name, step_info=False, copy=False, **vars(chosen))
    observations, _ = env.reset(seed=list(seeds))
    attach(agent, env)
    ended = np.zeros(n, dtype=np.bool_)
    survived = np.zeros(n, dtype=np.bool_)
    returns = np.zeros(n)
    metrics = {name: np.full(n, np.nan) for name in metric_names(task_name)}
    state: State = None
    starts = np.ones(n, dtype=np.bool_)
    while not ended.all():
        actions, state = agent.predict(observations, state, starts, True)
        observations, rewards, terminated, truncated, _ = env.step(actions)
        returns += np.where(ended, 0.0, rewards)
        starts = terminated | truncated
        now = starts & ~ended
        if now.any():
            # the default autoreset mode keeps an ended episode's memory until the next step
            found = _metrics(env.simulation, now)
            for name, values in found.items():
                metrics[name][now] = values
            # a success may end an episode too
            survived[now] = truncated[now] | (found.get("is_success", np.zeros(1)) > 0.0)
            ended |= now
            if progress is not None:
                progress(int(now.sum()))
    env.close()
    metrics[RETURN] = returns
    return Episodes(survived, metrics)


def _metrics(simulation: Simulation, ended: NDArray[np.bool_]) -> dict[str, Vector]:
    """All but the return of ended episodes, from their records; NaN where there was nothing to measure."""
    walkers, tasks = simulation.walkers[ended], simulation.tasks[ended]
    found = simulation.task.measure(walkers, tasks, undefined=np.nan)
    time, falls = walkers["time"].copy(), walkers["fall"]
    speed = np.divide(walkers["distance"], time, out=np.full(len(time), np.nan), where=time > 0.0)
    fell = (falls != FallCode.NONE) & (falls != FallCode.SOLVER)
    return found | {SPEED: speed, TIME: time, FELL: fell.astype(float)}
