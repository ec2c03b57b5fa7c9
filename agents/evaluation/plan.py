"""Many agents' episodes at many tasks, shared out to processes and kept on disk, so that an interrupted evaluation goes on where it was."""

from __future__ import annotations

import contextlib
import hashlib
import json
import multiprocessing
import os
import signal
import time
import zipfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

import lean_yaw_env
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.files import written_whole
from lean_yaw_env.validation import require_count

from ..policies.policy import package_versions
from ..policies.policy_files import CARD_FILE, WEIGHTS_FILE, options_to_plain
from ..registry import (
    AgentRequest,
    agent_entry,
    env_id_of,
    make_agent,
    names_for,
    policy_folders,
)
from ..seeds import MOST_EPISODES, evaluation_seed
from .episodes import Episodes, Results
from .scoring import Progress, run_seeds

COSTLY_EPISODES = 40
"""Of an agent that plans at every step, at most, where nothing else is asked for."""
_CHUNK = 1024  # episodes run side by side
_COSTLY_CHUNK = 20  # of an agent that plans: some tens of seconds
_WORTH_PROCESSES = 2048  # episodes; fewer are run before another process has started
_METRIC = "metric:"
# Folders of the walker's package that no episode depends on
_ASIDE = frozenset({"agents", "cli", "multibody", "paper", "rendering", "vehicles"})


@dataclass(frozen=True)
class Candidate:
    """An agent that is to run a task's episodes.

    Attributes
    ----------
    task, agent : str
    episodes : 1 to ``MOST_EPISODES``
    options : the environment's
    folders : of its trained policies, one for each training; (None,) for an agent that is not trained
    """

    task: str
    agent: str
    episodes: int
    options: EnvOptions
    folders: tuple[Path | None, ...] = (None,)

    def __post_init__(self) -> None:
        require_count("episodes", self.episodes, 1, MOST_EPISODES)


@dataclass(frozen=True)
class CandidateResults:
    """A candidate's results and the time they took, in seconds of one core."""

    candidate: Candidate
    results: Results
    seconds: float


@dataclass(frozen=True)
class _Chunk:
    """Some of the episodes of one of a candidate's policies: what one process runs at a time."""

    candidate: Candidate
    folder: Path | None
    seeds: range

    def file(self, cache: Path) -> Path:
        """Where it is kept: the name tells everything that its result depends on."""
        candidate = self.candidate
        depends = {
            "task": candidate.task,
            "agent": candidate.agent,
            "options": options_to_plain(candidate.options),
            "seeds": [self.seeds.start, self.seeds.stop],
            "policy": None if self.folder is None else _policy_digest(self.folder),
            "code": _code_digest(),
            "versions": package_versions(),
        }
        digest = hashlib.sha256(json.dumps(depends, sort_keys=True).encode()).hexdigest()
        return cache / f"{candidate.task}-{candidate.agent}-{digest[:24]}.npz"


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

    def candidates(self, tasks: Sequence[str], names: Sequence[str]) -> list[Candidate]:
        """Agents of the registry for tasks; all that there are for a task, in the registry's order, if none is named.

        Of several tasks, an agent that is not for one is left out there; of one task that is an error.

        Raises
        ------
        ValueError
            If a name or number is bad, or a trained agent is not found.
        """
        for name in names:
            agent_entry(name)
        found: list[Candidate] = []
        for task in tasks:
            request = AgentRequest(
                env_id_of(task), self.options, seed=self.seed, path=self.path, runs=self.runs
            )
            there = names_for(request)
            chosen = [name for name in dict.fromkeys(names) if len(tasks) == 1 or name in there]
            found += [self._candidate(name, task, request) for name in (chosen if names else there)]
        return found

    def _candidate(self, name: str, task: str, request: AgentRequest) -> Candidate:
        kind = agent_entry(name).kind
        episodes = self.episodes
        if kind == "planner":
            episodes = min(episodes, self.costly_episodes)
        folders = policy_folders(name, request) if kind == "learned" else []
        return Candidate(task, name, episodes, self.options, tuple(folders) or (None,))

    def run(self, candidates: Sequence[Candidate]) -> list[CandidateResults]:
        """Run the candidates' episodes; see ``run_all``."""
        total = sum(candidate.episodes * len(candidate.folders) for candidate in candidates)
        with tqdm(total=total, desc="evaluating", unit="episode", disable=not self.progress) as bar:
            return run_all(
                candidates,
                seed=self.seed,
                cache=self.cache,
                processes=self.processes,
                progress=bar.update,
            )


def run_all(
    candidates: Sequence[Candidate],
    *,
    seed: int = 0,
    cache: Path | None = None,
    processes: int = 1,
    progress: Progress | None = None,
) -> list[CandidateResults]:
    """Let every candidate run the episodes of an evaluation's seed; the same ones at the same task.

    Parameters
    ----------
    candidates : Candidate
    seed : int >= 0
        Another seed draws other episodes.
    cache : folder, optional
        What is found there is not run again, and what is run is left there: it is found as long as task, options, episodes, agent and
        code are the same.
    processes : int >= 1
    progress : called with numbers of episodes that are there, optional

    Raises
    ------
    ValueError
        If a number is out of range, or an agent cannot be made.
    """
    require_count("processes", processes, 1, 1024)
    chunks = [
        chunk for candidate in candidates for chunk in _chunks(candidate, evaluation_seed(seed))
    ]
    if cache is not None:
        cache.mkdir(parents=True, exist_ok=True)
    found: dict[_Chunk, tuple[Episodes, float]] = {}
    for chunk, outcome in _outcomes(chunks, cache, processes):
        found[chunk] = outcome
        if progress is not None:
            progress(len(chunk.seeds))
    return [_gathered(candidate, evaluation_seed(seed), found) for candidate in candidates]


def _gathered(
    candidate: Candidate, first: int, found: dict[_Chunk, tuple[Episodes, float]]
) -> CandidateResults:
    chunks = _chunks(candidate, first)
    runs = [
        Episodes.joined([found[chunk][0] for chunk in chunks if chunk.folder == folder])
        for folder in candidate.folders
    ]
    results = Results(candidate.task, candidate.agent, tuple(runs))
    return CandidateResults(candidate, results, sum(found[chunk][1] for chunk in chunks))


def _chunks(candidate: Candidate, first: int) -> list[_Chunk]:
    size = _COSTLY_CHUNK if agent_entry(candidate.agent).kind == "planner" else _CHUNK
    seeds = range(first, first + candidate.episodes)
    return [
        _Chunk(candidate, folder, seeds[start : start + size])
        for folder in candidate.folders
        for start in range(0, len(seeds), size)
    ]


def _outcomes(
    chunks: Sequence[_Chunk], cache: Path | None, processes: int
) -> Iterator[tuple[_Chunk, tuple[Episodes, float]]]:
    """Each chunk's episodes and seconds, as they are there: the kept ones first."""
    waiting: list[_Chunk] = []
    for chunk in chunks:
        kept = None if cache is None else _read(chunk.file(cache))
        if kept is None:
            waiting.append(chunk)
        else:
            yield chunk, kept
    # plans take longest: begun last, one of them would be waited for while the other processes have nothing to do
    waiting.sort(key=lambda chunk: agent_entry(chunk.candidate.agent).kind != "planner")
    costly = any(agent_entry(chunk.candidate.agent).kind == "planner" for chunk in waiting)
    if processes == 1 or not (
        costly or sum(len(chunk.seeds) for chunk in waiting) >= _WORTH_PROCESSES
    ):
        for chunk in waiting:
            yield chunk, _run_chunk(chunk, cache)
        return
    with _pool(min(processes, len(waiting))) as pool:
        futures = {pool.submit(_run_chunk, chunk, cache): chunk for chunk in waiting}
        for future in as_completed(futures):
            yield futures[future], future.result()


@contextlib.contextmanager
def _pool(processes: int) -> Iterator[ProcessPoolExecutor]:
    """Processes of one thread each; at an interruption what has begun ends and is kept, and nothing else begins."""
    with _environment(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1"):
        pool = ProcessPoolExecutor(
            processes,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=signal.signal,
            initargs=(signal.SIGINT, signal.SIG_IGN),
        )
        try:
            yield pool
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


@contextlib.contextmanager
def _environment(**variables: str) -> Iterator[None]:
    """Variables that processes started meanwhile inherit."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _run_chunk(chunk: _Chunk, cache: Path | None) -> tuple[Episodes, float]:
    """Run a chunk and keep it."""
    candidate = chunk.candidate
    # an agent that draws draws anew for each chunk, so that chunks may be run in any order
    request = AgentRequest(
        env_id_of(candidate.task),
        candidate.options,
        seed=chunk.seeds.start,
        path=chunk.folder,
        runs=None,
    )
    agent = make_agent(candidate.agent, request)
    begin = time.process_time()
    episodes = run_seeds(agent, candidate.task, chunk.seeds, options=candidate.options)
    seconds = time.process_time() - begin
    if cache is not None:
        _write(chunk.file(cache), episodes, seconds)
    return episodes, seconds


def _write(path: Path, episodes: Episodes, seconds: float) -> None:
    arrays: dict[str, Any] = {_METRIC + name: each for name, each in episodes.metrics.items()}
    with written_whole(path) as temporary:
        np.savez(temporary, survived=episodes.survived, seconds=np.array(seconds), **arrays)


def _read(path: Path) -> tuple[Episodes, float] | None:
    """What is kept in a file; None if there is none or it is damaged."""
    try:
        with np.load(path, allow_pickle=False) as kept:
            metrics = {
                name.removeprefix(_METRIC): kept[name] for name in kept if name.startswith(_METRIC)
            }
            return Episodes(kept["survived"], metrics), float(kept["seconds"])
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        return None


@lru_cache(maxsize=256)
def _policy_digest(folder: Path) -> str:
    digest = hashlib.sha256()
    for name in (CARD_FILE, WEIGHTS_FILE):
        with contextlib.suppress(OSError):  # what is missing is told when the policy is loaded
            digest.update((folder / name).read_bytes())
    return digest.hexdigest()


@lru_cache(maxsize=1)
def _code_digest() -> str:
    """A digest of the code and settings that an episode depends on."""
    walker, own = Path(str(lean_yaw_env.__file__)).parent, Path(__file__).parents[1]
    files = [
        path for path in walker.rglob("*.py") if path.relative_to(walker).parts[0] not in _ASIDE
    ]
    files += [*own.glob("*.py"), *own.glob("*.json"), own / "evaluation" / "scoring.py"]
    for folder in ("controllers", "policies"):
        files += (own / folder).rglob("*.py")
    digest = hashlib.sha256()
    for path in sorted(files):
        digest.update(path.read_bytes())
    return digest.hexdigest()
