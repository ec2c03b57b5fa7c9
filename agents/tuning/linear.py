"""Linear laws by direct search: CMA-ES (Hansen 2016) over all weights, a whole generation walked as one batch.

Every generation walks training episodes of its own, the same for all of its laws, so that no law is chosen for the episodes that it walked. What the search
comes to is compared on validation episodes with the law that it began with, which imitates another agent.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from cmaes import CMA

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.files import write_json
from lean_yaw_env.parameters import Vector
from lean_yaw_env.validation import require_count

from ..agent import Agent
from ..controllers.linear import LinearLaw, LinearSettings
from ..evaluation.scoring import run_episodes, run_seeds
from ..registry import AgentRequest, env_id_of, make_all
from ..seeds import training_seed

POPULATION, EPISODES = 16, 48
"""Laws of a generation, and the episodes that each walks."""
GENERATIONS = 100
_VALIDATION_EPISODES = 512
_SEED = 1000  # of the first generation's training episodes
_TEACHERS = ("feedback", "lqr", "ppo")  # imitated to begin with
_SIGMA = 0.1  # first standard deviation of a weight
_DIGITS = 4  # that are kept of each
_LONGEST = 300.0  # time units of an episode
_CHECKS = 5  # times that the law is compared


def search_linear(
    task: str, generations: int = GENERATIONS, *, shown: Callable[[str], object] = print
) -> tuple[LinearSettings, float]:
    """The best law found and its mean return on validation episodes, at least that of the package's law and of laws that imitate other agents.

    Parameters
    ----------
    generations : 1 to 100,000
    shown : takes a line at each comparison
    """
    require_count("generations", generations, 1, 100_000)
    law = LinearLaw(task)
    shape = law.matrix.shape
    options = EnvOptions(horizon=_horizon(task))
    starts = {"the package's law": law.matrix.ravel()} | _imitations(task, options)
    scores = {name: _mean_return(task, options, _law(task, each)) for name, each in starts.items()}
    best = max(scores.values())
    found = starts[max(scores, key=lambda name: scores[name])]
    shown("start: " + ", ".join(f"{name} {score:.2f}" for name, score in scores.items()))
    search = CMA(mean=found, sigma=_SIGMA, population_size=POPULATION, seed=0)
    for generation in range(generations):
        tried = np.stack([search.ask() for _ in range(POPULATION)])
        law.matrix = np.repeat(tried.reshape(POPULATION, *shape), EPISODES, axis=0)
        first = training_seed(_SEED + generation)
        seeds = [*range(first, first + EPISODES)] * POPULATION
        returns = run_seeds(law, task, seeds, options=options).metrics["return"]
        worth = returns.reshape(POPULATION, EPISODES).mean(axis=1)
        search.tell([(each, -float(w)) for each, w in zip(tried, worth, strict=True)])
        if (generation + 1) % max(1, generations // _CHECKS) == 0:
            score = _mean_return(task, options, _law(task, search.mean))
            shown(f"generation {generation + 1}: training {worth.mean():.2f}, validation {score:.2f}")  # fmt: skip
            if score > best:
                best, found = score, search.mean.copy()
    return _settings(found), best


def tune_linear(
    task: str, generations: int, file: Path, *, shown: Callable[[str], object] = print
) -> float:
    """Search for a law, write it as ``shipping.ship`` takes it, and return its mean return."""
    found, score = search_linear(task, generations, shown=shown)
    file.parent.mkdir(parents=True, exist_ok=True)
    values = {"weights": list(found.weights)}
    write_json(file, {"agent": "linear", "task": task, "score": score, "values": values})
    return score


def _horizon(task: str) -> float:
    return min(EnvOptions().for_task(task_named(task)).horizon, _LONGEST)


def _settings(weights: Vector) -> LinearSettings:
    return LinearSettings(tuple(float(f"{each:.{_DIGITS}g}") for each in weights))


def _law(task: str, weights: Vector) -> LinearLaw:
    return LinearLaw(task, settings=_settings(weights))


def _mean_return(task: str, options: EnvOptions, agent: Agent) -> float:
    walked = run_episodes(agent, task, episodes=_VALIDATION_EPISODES, options=options)
    return float(walked.metrics["return"].mean())


def _imitations(task: str, options: EnvOptions) -> dict[str, Vector]:
    """The weights that come nearest to the actions of other agents in episodes that these walk."""
    request = AgentRequest(env_id_of(task), options, runs=None)
    found: dict[str, Vector] = {}
    for name, agent in make_all(request, ("feedback", "learned")).items():
        if name not in _TEACHERS:
            continue
        env = WalkerVectorEnv(256, task, step_info=False, **vars(options))
        seen, _ = env.reset(seed=training_seed(_SEED - 1))
        observed, chosen = [], []
        for _ in range(200):
            actions = agent.predict(seen)[0]
            observed.append(np.column_stack([seen, np.ones(len(seen))]))
            chosen.append(actions)
            seen = env.step(actions)[0]
        matrix = np.linalg.lstsq(np.concatenate(observed), np.concatenate(chosen), rcond=None)[0].T
        found[f"an imitation of {name}"] = matrix.ravel()
    return found
