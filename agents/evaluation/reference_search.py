"""The search for references: planning that sees the pushes, commands and goals that are going to come, around the best agent there is.

No agent can do that, so that a reference is a score to come near to rather than one to pass. It is no bound either: the search ends where its time does.
"""

from __future__ import annotations

import contextlib
import time
from dataclasses import asdict
from pathlib import Path

import numpy as np

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.files import write_json
from lean_yaw_env.parameters import Vector

from ..agent import Agent
from ..controllers.mpc import MpcController, MpcSettings
from ..controllers.simple import FixedController
from ..policies.policy_files import load
from ..references import Reference, read_references
from ..registry import AgentRequest, agent_entry, env_id_of, make_agent, names_for, policy_folders
from ..seeds import first_seed
from .episodes import FELL, TIME, TIME_PER_FALL, direction
from .scoring import run_seeds

SEARCHES = (
    MpcSettings(steps=6, samples=32, iterations=3, trust=0.0, scenarios=0),
    MpcSettings(steps=12, window=30.0, samples=32, iterations=3, trust=0.0, scenarios=0),
)
"""Short plans and long ones: which are better depends on the task and on the episode."""
EPISODES, MEAN_EPISODES = 16, 512
"""Episodes of the search, and of agents that take no time."""
SEED = 1
"""Of the validation episodes."""
HORIZONS = {"Metastable": 400.0}
"""Of tasks whose episodes are too long to plan all of their steps."""


def find_reference(task: str, episodes: int = EPISODES, command: str = "") -> Reference:
    """Search for a task's reference, around the agent with the best mean."""
    begin = time.process_time()
    search = _Search(task)
    fixed = search.values(FixedController(), MEAN_EPISODES)
    agents = _bases(task, search.options)
    walked = {name: search.values(agent, MEAN_EPISODES) for name, agent in agents.items()}
    name = max(walked, key=lambda each: search.sign * search.mean(walked[each]))
    base = walked[name]
    planned = [
        search.values(MpcController(task, search.options, agents[name], settings, seed), episodes)
        for seed, settings in enumerate(SEARCHES)
    ]
    # what is going to come is known: each episode's best search counts
    best = search.best([base[:episodes], *planned])
    value, error = search.mean(best), search.error(best)
    if search.metric != TIME_PER_FALL:
        # the mean over many episodes, and over few the gain
        gain = best - base[:episodes]
        value = search.mean(base) + search.mean(gain)
        error = float(np.hypot(search.error(gain), search.error(base)))
    return Reference(
        metric=search.metric,
        fixed=search.mean(fixed),
        value=value,
        standard_error=error,
        found_by="search that sees the future",
        base=name,
        base_value=search.mean(base),
        episodes=episodes,
        first_seed=search.first,
        mean_episodes=MEAN_EPISODES,
        horizon=search.options.horizon,
        searches=tuple(asdict(each) for each in SEARCHES),
        seconds=round(time.process_time() - begin, 1),
        command=command,
    )


class _Search:
    """The episodes of a search, and what they come to."""

    def __init__(self, task: str) -> None:
        self.task, self.metric = task, task_named(task).headline
        self.options = EnvOptions(horizon=HORIZONS.get(task))
        self.sign = direction(task, self.metric) or 1
        self.first = first_seed("validation", SEED)

    def values(self, agent: Agent, count: int) -> Vector:
        """The headline of each episode; of a time per fall, times and falls, shape (count, 2)."""
        seeds = range(self.first, self.first + count)
        found = run_seeds(agent, self.task, seeds, options=self.options).metrics
        if self.metric == TIME_PER_FALL:
            return np.column_stack([found[TIME], found[FELL]])
        return found[self.metric]

    def mean(self, values: Vector) -> float:
        """The headline over all episodes; a time per fall counts one fall at least."""
        if self.metric == TIME_PER_FALL:
            times, falls = values.sum(axis=0)
            return float(np.log10(times / max(falls, 1.0)))
        return float(values.mean())

    def error(self, values: Vector) -> float:
        """The standard error of that."""
        if self.metric == TIME_PER_FALL:
            return float(1.0 / (np.log(10.0) * np.sqrt(max(values[:, 1].sum(), 1.0))))
        return float(values.std() / np.sqrt(len(values)))

    def best(self, found: list[Vector]) -> Vector:
        """Each episode's best values."""
        table = np.stack(found)
        worth = table[..., 0] if self.metric == TIME_PER_FALL else self.sign * table
        return table[worth.argmax(axis=0), np.arange(table.shape[1])]


def _bases(task: str, options: EnvOptions) -> dict[str, Agent]:
    """Agents that plans may deviate from, by name: the package's feedback controllers and trained policies, but for those that remember or see more."""
    request = AgentRequest(env_id_of(task), options, runs=None)
    observation = np.zeros((1, len(options.observation_names(task_named(task)))), np.float32)
    found: dict[str, Agent] = {}
    for name in names_for(request, ("feedback", "learned")):
        entry = agent_entry(name)
        if entry.kind == "feedback":
            with contextlib.suppress(NoGaitError):
                found[name] = make_agent(name, request)
            continue
        for folder in () if entry.options else policy_folders(name, request):
            policy = load(folder)
            if policy.predict(observation)[1] is None:
                found[f"{name} {folder.name}"] = policy
    return found


def write_reference(file: Path, task: str, reference: Reference) -> None:
    """Put a reference in the place of the task's in a file."""
    found = read_references(file) | {task: reference}
    write_json(file, {name: asdict(each) for name, each in sorted(found.items())})
