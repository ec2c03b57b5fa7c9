"""One evaluator for every agent: many seeded episodes on the compiled batch, the same ones for each agent, and means with intervals."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest, bootstrap

from agents.agent import Agent, State
from agents.seeds import MOST_EPISODES, evaluation_seed
from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.tasks import Task, task_named
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.parameters import Vector, require_number

CONFIDENCE = 0.95
RESAMPLES = 2000
_CHUNK = 1024  # walkers stepped together

Progress = Callable[[int], object]


@dataclass(frozen=True)
class Episodes:
    """What came of an agent's episodes.

    Attributes
    ----------
    survived : bool, shape (episodes,)
        Whether the time limit and nothing else ended it.
    metrics : by name, each of shape (episodes,)
        ``return``, the task's metrics and ``speed`` (distance over time); NaN where an episode leaves one undefined.
    """

    survived: NDArray[np.bool_]
    metrics: dict[str, Vector]


@dataclass(frozen=True)
class Row:
    """The mean of a metric over episodes with its 95 % interval, and beside it the share of episodes survived.

    An error's mean is over the time walked, so that it says little of an agent that falls: read ``survival`` with it.
    """

    task: str
    agent: str
    metric: str
    mean: float
    low: float
    high: float
    survival: float
    episodes: int


def run_episodes(
    agent: Agent,
    task: str,
    *,
    episodes: int,
    seed: int = 0,
    options: EnvOptions | None = None,
    progress: Progress | None = None,
) -> Episodes:
    """Run an agent through episodes; which, depends on ``seed`` alone.

    Parameters
    ----------
    agent : Agent
    task : str
    episodes : 1 to ``MOST_EPISODES``
    seed : int >= 0
        Another seed draws other episodes.
    options : EnvOptions
        The environment's.
    progress : called with the number of episodes that have just ended, optional

    Raises
    ------
    ValueError
        If a number is out of its range.
    """
    total = int(require_number("episodes", episodes, 1, MOST_EPISODES))
    first = evaluation_seed(seed)
    return run_seeds(agent, task, range(first, first + total), options=options, progress=progress)


def run_seeds(
    agent: Agent,
    task: str,
    seeds: range,
    *,
    options: EnvOptions | None = None,
    progress: Progress | None = None,
) -> Episodes:
    """Run an agent through one episode for each environment seed; for episodes to judge it by, see ``run_episodes``."""
    parts = [
        _run_chunk(agent, task, seeds[start : start + _CHUNK], options, progress)
        for start in range(0, len(seeds), _CHUNK)
    ]
    return Episodes(
        survived=np.concatenate([part.survived for part in parts]),
        metrics={
            name: np.concatenate([part.metrics[name] for part in parts])
            for name in parts[0].metrics
        },
    )


def evaluate(
    task: str,
    agents: Mapping[str, Agent],
    *,
    episodes: int,
    seed: int = 0,
    options: EnvOptions | None = None,
    progress: Progress | None = None,
) -> list[Row]:
    """Run every agent through the same episodes; one row for each metric of each agent, ``survival`` last.

    Raises
    ------
    ValueError
        If there are no agents, or as ``run_episodes``.
    """
    if not agents:
        raise ValueError("agents must hold one agent or more, not none")
    rows: list[Row] = []
    for name, agent in agents.items():
        results = run_episodes(
            agent, task, episodes=episodes, seed=seed, options=options, progress=progress
        )
        rows += summary(task, name, results)
    return rows


def summary(task: str, agent: str, results: Episodes) -> list[Row]:
    """Means and intervals of episodes."""
    survival = float(results.survived.mean())
    episodes = len(results.survived)
    rows = [
        Row(task, agent, name, *mean_interval(values), survival, episodes)
        for name, values in results.metrics.items()
    ]
    low, high = survival_interval(results.survived)
    rows.append(Row(task, agent, "survival", survival, low, high, survival, episodes))
    return rows


def mean_interval(values: Vector) -> tuple[float, float, float]:
    """The mean of the defined values with its 95 % interval by the percentile bootstrap; NaN where there are none.

    The resampling is seeded: the same values give the same interval.
    """
    defined = values[np.isfinite(values)]
    if len(defined) == 0:
        return float("nan"), float("nan"), float("nan")
    mean = float(defined.mean())
    if defined.min() == defined.max():  # resampling has nothing to draw
        return mean, mean, mean
    interval = bootstrap(
        (defined,), np.mean, n_resamples=RESAMPLES, confidence_level=CONFIDENCE,
        method="percentile", batch=100, rng=np.random.default_rng(0),
    ).confidence_interval  # fmt: skip
    return mean, float(interval.low), float(interval.high)


def survival_interval(survived: NDArray[np.bool_]) -> tuple[float, float]:
    """Wilson's 95 % interval of a share: unlike a bootstrap's it has a width where every episode was survived."""
    interval = binomtest(int(survived.sum()), len(survived)).proportion_ci(CONFIDENCE, "wilson")
    return float(interval.low), float(interval.high)


def _run_chunk(
    agent: Agent,
    task_name: str,
    seeds: range,
    options: EnvOptions | None,
    progress: Progress | None,
) -> Episodes:
    """One episode for each seed, walked side by side; those that have ended walk on unseen."""
    chosen = EnvOptions() if options is None else options
    task = task_named(task_name)
    n = len(seeds)
    env = WalkerVectorEnv(n, task_name, step_info=False, copy=False, **_arguments(chosen))
    observations, _ = env.reset(seed=list(seeds))
    ended = np.zeros(n, dtype=np.bool_)
    survived = np.zeros(n, dtype=np.bool_)
    returns = np.zeros(n)
    metrics = {name: np.full(n, np.nan) for name in _metric_names(task)}
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
            for name, values in _metrics(task, env.rows.memory[now]).items():
                metrics[name][now] = values
            survived[now] = truncated[now]
            ended |= now
            if progress is not None:
                progress(int(now.sum()))
    env.close()
    metrics["return"] = returns
    return Episodes(survived, metrics)


def _metric_names(task: Task) -> tuple[str, ...]:
    return ("return", *task.metrics, "speed")


def _metrics(task: Task, memory: Vector) -> dict[str, Vector]:
    """The task's metrics of ended episodes, from their rows of memory."""
    found: dict[str, Vector] = {}
    for name, metric in task.metrics.items():
        values = memory[:, metric.column].copy()
        if metric.divisor is not None:
            values = _quotient(values, memory[:, metric.divisor])
        found[name] = values
    found["speed"] = _quotient(memory[:, c.DISTANCE], memory[:, c.TIME])
    return found


def _quotient(numerator: Vector, denominator: Vector) -> Vector:
    return np.divide(
        numerator, denominator, out=np.full(len(numerator), np.nan), where=denominator > 0.0
    )


def _arguments(options: EnvOptions) -> dict[str, Any]:
    """Options as an environment's keyword arguments."""
    return dict(vars(options))
