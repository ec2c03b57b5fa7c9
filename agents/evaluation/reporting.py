"""Evaluations of agents by their names, shown as tables or as JSON."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from tqdm import tqdm

from agents.evaluation.agenda import Entrant, Walked, walk_all
from agents.evaluation.claims import Sample, judged_rows, samples_of
from agents.evaluation.results import Row
from agents.evaluation.tables import results_tables, rows_to_json
from agents.policies.storage import task_of
from agents.registry import (
    AgentRequest,
    agent_entry,
    env_id_of,
    names_for,
    policy_folders,
)
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.registration import TASK_VERSIONS

ALL = "all"
COSTLY_EPISODES = 40
CACHE = "evaluations"
"""Folder, below that of the trainings, where finished episodes are kept."""


@dataclass(frozen=True)
class Evaluation:
    """What is to be evaluated, and how.

    Attributes
    ----------
    episodes : of each agent, for each of its trainings
    costly_episodes : of an agent that plans, at most: the first of the others'
    seed : int >= 0
        Another draws other episodes.
    options : the environment's
    path : folder of the one trained agent that is wanted, optional
    runs : where trainings left their folders; None for the trained agents that come with the package, all of their trainings
    cache : where finished episodes are kept, optional
    processes : int >= 1
    progress : show a bar
    """

    episodes: int = 1000
    costly_episodes: int = COSTLY_EPISODES
    seed: int = 0
    options: EnvOptions = field(default_factory=EnvOptions)
    path: Path | None = None
    runs: Path | None = Path("runs")
    cache: Path | None = None
    processes: int = 1
    progress: bool = True

    def entrants(self, tasks: Sequence[str], names: Sequence[str]) -> list[Entrant]:
        """Agents of the registry for tasks; all that there are for a task, in the registry's order, if none is named.

        Of several tasks, an agent that is not for one is left out there; of one task that is an error.

        Raises
        ------
        ValueError
            If a name or number is bad, or a trained agent is not found.
        """
        for name in names:
            agent_entry(name)
        found: list[Entrant] = []
        for task in tasks:
            request = AgentRequest(
                env_id_of(task), self.options, seed=self.seed, path=self.path, runs=self.runs
            )
            there = names_for(request)
            chosen = [name for name in dict.fromkeys(names) if len(tasks) == 1 or name in there]
            found += [self._entrant(name, task, request) for name in (chosen if names else there)]
        return found

    def _entrant(self, name: str, task: str, request: AgentRequest) -> Entrant:
        kind = agent_entry(name).kind
        episodes = self.episodes
        if kind == "planner":
            episodes = min(episodes, self.costly_episodes)
        folders = policy_folders(name, request) if kind == "learned" else []
        return Entrant(task, name, episodes, self.options, tuple(folders) or (None,))

    def walk(self, entrants: Sequence[Entrant]) -> list[Walked]:
        """Let them walk; see ``agenda.walk_all``."""
        total = sum(entrant.episodes * len(entrant.folders) for entrant in entrants)
        with progress_bar(total, self.progress) as bar:
            return walk_all(
                entrants,
                seed=self.seed,
                cache=self.cache,
                processes=self.processes,
                progress=bar.update,
            )


def by_task(walked: Sequence[Walked]) -> dict[str, dict[str, Sample]]:
    """Results by task and agent, ready to be compared."""
    tasks = dict.fromkeys(each.results.task for each in walked)
    return {
        task: samples_of([each.results for each in walked if each.results.task == task])
        for task in tasks
    }


def task_rows(samples: Mapping[str, Mapping[str, Sample]], threads: int = 1) -> list[Row]:
    """Rows of every task, its agents compared with one another; numpy's loops let threads share the tasks."""
    with ThreadPoolExecutor(threads) as pool:
        return [row for rows in pool.map(judged_rows, samples.values()) for row in rows]


def evaluate_named(tasks: Sequence[str], names: Sequence[str], evaluation: Evaluation) -> list[Row]:
    """Evaluate agents of the registry; all that there are for a task if none is named.

    Raises
    ------
    ValueError
        If a name or number is bad, or a trained agent is not found.
    """
    walked = evaluation.walk(evaluation.entrants(tasks, names))
    return task_rows(by_task(walked), evaluation.processes)


def names_in(given: Iterable[str]) -> list[str]:
    """Names given one after another or separated by commas."""
    return [name for part in given for name in part.replace(",", " ").split()]


def tasks_in(given: Iterable[str]) -> list[str]:
    """Names of tasks, or ``ValueError``; ``all`` stands for every one."""
    names = names_in(given)
    if ALL in names:
        return list(TASK_VERSIONS)
    return [task_of(env_id_of(name)) for name in dict.fromkeys(names)]


def agents_in(given: Iterable[str]) -> list[str]:
    """Names of agents; ``all`` stands for all there are for a task, which is none named."""
    names = names_in(given)
    return [] if ALL in names else list(dict.fromkeys(names))


def progress_bar(episodes: int, shown: bool) -> tqdm:
    """The bar of an evaluation."""
    return tqdm(total=episodes, desc="evaluating", unit="episode", disable=not shown)


def show(rows: Sequence[Row], console: Console, *, as_json: bool = False) -> None:
    """Print rows."""
    if as_json:
        console.print(rows_to_json(rows), soft_wrap=True, highlight=False, markup=False)
        return
    for table in results_tables(rows):
        console.print(table)
