"""Linear laws by direct search: CMA-ES (Hansen 2016) over all weights, a whole generation walked as one batch.

Every generation walks training episodes of its own, the same for all of its laws, so that no law is chosen for the episodes that it walked. What the search
comes to is compared on validation episodes with the law that it began with, which imitates another agent.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from cmaes import CMA

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.files import read_json, require_writable, write_json
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


class _Kept:
    """Results of a search by their names, in a file: a search that begins again reads them up to where it ended, and comes to what it would have come to."""

    def __init__(self, file: Path | None, question: Any) -> None:
        self._file, self._found = file, {"question": question}
        if file is not None and file.exists():
            self._found = read_json(file)
            if not isinstance(self._found, dict) or self._found.get("question") != question:
                raise ValueError(f"{str(file)!r} holds no search, or another one; remove it or name another file")  # fmt: skip

    def __call__(self, name: str, compute: Callable[[], Any]) -> Any:
        if name not in self._found:
            self._found[name] = compute()
            if self._file is not None:
                write_json(self._file, self._found, indent=None)
        return self._found[name]


def search_linear(
    task: str,
    generations: int = GENERATIONS,
    *,
    file: Path | None = None,
    shown: Callable[[str], object] = print,
) -> tuple[LinearSettings, float]:
    """The best law found and its mean return on validation episodes, at least that of the package's law and of laws that imitate other agents.

    Parameters
    ----------
    generations : 1 to 100,000
    file : keeps what each generation comes to; a search that was ended goes on with it
    shown : takes a line at each comparison

    Raises
    ------
    ValueError
        If an argument is bad, or the file holds something else.
    """
    require_count("generations", generations, 1, 100_000)
    law = LinearLaw(task)
    shape = law.matrix.shape
    options = EnvOptions(horizon=_horizon(task))
    starts = {"the package's law": law.matrix.ravel()} | _imitations(task, options)
    question = {"task": task, "episodes": EPISODES, "starts": {name: each.tolist() for name, each in starts.items()}}  # fmt: skip
    kept = _Kept(file, question)

    def score_of(name: str, weights: Vector) -> float:
        return kept(f"score {name}", lambda: _mean_return(task, options, _law(task, weights)))

    scores = {name: score_of(name, each) for name, each in starts.items()}
    best = max(scores.values())
    found = starts[max(scores, key=lambda name: scores[name])]
    shown("start: " + ", ".join(f"{name} {score:.2f}" for name, score in scores.items()))
    search = CMA(mean=found, sigma=_SIGMA, population_size=POPULATION, seed=0)
    for generation in range(generations):
        tried = np.stack([search.ask() for _ in range(POPULATION)])
        law.matrix = np.repeat(tried.reshape(POPULATION, *shape), EPISODES, axis=0)
        first = training_seed(_SEED + generation)
        worth = kept(f"generation {generation}", partial(_worth, law, task, first, options))
        search.tell([(each, -w) for each, w in zip(tried, worth, strict=True)])
        if (generation + 1) % max(1, generations // _CHECKS) == 0:
            score = score_of(f"after generation {generation}", search.mean)
            shown(f"generation {generation + 1}: training {np.mean(worth):.2f}, validation {score:.2f}")  # fmt: skip
            if score > best:
                best, found = score, search.mean.copy()
    return _settings(found), best


def tune_linear(
    task: str, generations: int, file: Path, *, shown: Callable[[str], object] = print
) -> float:
    """Search for a law, write it as ``shipping.ship`` takes it, and return its mean return. What the search comes to is kept beside it, in ``.search.json``."""
    require_writable(file.parent)
    kept = file.with_suffix(".search.json")
    found, score = search_linear(task, generations, file=kept, shown=shown)
    values = {"weights": list(found.weights)}
    write_json(file, {"agent": "linear", "task": task, "score": score, "values": values})
    return score


def _worth(law: Agent, task: str, first: int, options: EnvOptions) -> list[float]:
    """Mean return of each law of a generation, over episodes from a seed on."""
    seeds = [*range(first, first + EPISODES)] * POPULATION
    returns = run_seeds(law, task, seeds, options=options).metrics["return"]
    return returns.reshape(POPULATION, EPISODES).mean(axis=1).tolist()


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
