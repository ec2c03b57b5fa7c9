"""Episodes of many agents at many tasks, run in several processes. Finished ones are kept on disk, so that an interrupted evaluation can continue."""

from __future__ import annotations

import contextlib
import hashlib
import json
import multiprocessing
import os
import signal
import time
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

import lean_yaw_env
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.files import written_whole
from lean_yaw_env.reporting import uninterrupted
from lean_yaw_env.validation import require_count

from ..agent import Agent
from ..policies.policy import package_versions
from ..policies.policy_files import CARD_FILE, WEIGHTS_FILE, load, options_to_plain
from ..registry import AgentRequest, agent_entry, env_id_of, make_agent, names_for, policy_folders
from ..seeds import MOST_EPISODES, EpisodeSet, first_seed
from .comparison import kind_of
from .entries import is_entry, load_entry, read_entry
from .episodes import TIME_PER_FALL, Episodes, Results
from .scoring import run_seeds

_CHUNK = 1024  # episodes run side by side
_COSTLY_CHUNK = 5  # of an agent that plans: some seconds
LONG_EPISODES, LONG_COSTLY_EPISODES, LONG_HORIZON = 400, 20, 4000.0
"""Of tasks that measure the time to a fall: episodes of each training at most, those of an agent that plans, and the time after which walks are cut."""
_WORTH_PROCESSES = 2048  # episodes; fewer are run before another process has started
_METRIC = "metric:"
_Outcome = tuple[Episodes, float]
"""Episodes and the seconds that they took."""
# Folders of the walker's package that no episode depends on
_ASIDE = frozenset({"agents", "cli", "multibody", "paper", "rendering", "vehicles"})


@dataclass(frozen=True)
class Candidate:
    """An agent that is to run a task's episodes, 1 to ``MOST_EPISODES`` of them."""

    task: str
    agent: str
    episodes: int
    options: EnvOptions
    folders: tuple[Path | None, ...] = (None,)
    """Of its trained policies, one for each training; (None,) for an agent that is not trained."""
    entry: Path | None = None
    """Folder of an agent from outside the package."""
    made_for: EnvOptions | None = None
    """Options that the agent is made for, where they are other ones than the environment's."""

    def __post_init__(self) -> None:
        require_count("episodes", self.episodes, 1, MOST_EPISODES)


@dataclass(frozen=True)
class _Chunk:
    """Some of the episodes of one of a candidate's policies: what one process runs at a time."""

    candidate: Candidate
    folder: Path | None
    seeds: range

    def file(self, cache: Path) -> Path:
        """The file that keeps it. The file's name contains a digest of everything that the result depends on."""
        candidate = self.candidate
        depends = {
            "task": candidate.task,
            "agent": candidate.agent,
            "options": options_to_plain(candidate.options),
            "made_for": candidate.made_for and options_to_plain(candidate.made_for),
            "seeds": [self.seeds.start, self.seeds.stop],
            "policy": _policy_digest(candidate.entry, self.folder),
            "code": _code_digest(),
            "versions": _versions(),
        }
        digest = hashlib.sha256(json.dumps(depends, sort_keys=True).encode()).hexdigest()
        return cache / f"{candidate.task}-{candidate.agent}-{digest[:24]}.npz"


@dataclass(frozen=True)
class Evaluation:
    """What is to be evaluated, and how."""

    episodes: int = 1000
    """Of each agent, for each of its trainings."""
    costly_episodes: int = 40
    """Of an agent that plans, at most: the first of the others'."""
    episode_set: EpisodeSet = "validation"
    seed: int = 0
    """Another draws other episodes."""
    options: EnvOptions = field(default_factory=EnvOptions)
    path: Path | None = None
    """Folder of the one trained agent that is wanted."""
    runs: Path | None = Path("runs")
    """Where trainings left their folders; None for the trained agents that come with the package, all of their trainings."""
    cache: Path | None = None
    """Where finished episodes are kept. They are not run again as long as task, options, episodes, agent and code are the same."""
    processes: int = 1
    progress: bool = True
    """Show a bar."""

    def __post_init__(self) -> None:
        require_count("processes", self.processes, 1, 1024)
        require_count("costly_episodes", self.costly_episodes, 1, MOST_EPISODES)

    def candidates(self, tasks: Sequence[str], names: Sequence[str]) -> list[Candidate]:
        """Agents of the registry for tasks; all that there are for a task, in the registry's order, if none is named.

        Of several tasks, an agent that is not for one is left out there; of one task that is an error. ``path`` may be a policy's folder, which
        then stands for its algorithm's agent, or an entry's, which is added. Agents that plan walk until a fall only if they are named: an episode
        takes them minutes.

        Raises
        ------
        ValueError
            If a name or number is bad, or a trained agent is not found.
        """
        for name in names:
            agent_entry(name)
        entry = read_entry(self.path) if self.path is not None and is_entry(self.path) else None
        path = self.path if entry is None else None
        own = None if path is None or names else load(path).card
        found: list[Candidate] = []
        for task in tasks:
            env_id = env_id_of(task)
            request = AgentRequest(env_id, self.options, seed=self.seed, runs=self.runs)
            of_folder = replace(request, path=path)
            there = names_for(of_folder if names else request)
            if task_named(task).headline == TIME_PER_FALL:
                there = tuple(name for name in there if name in names or not _plans(name))
            if own is not None and own.env_id == env_id:
                there = tuple(dict.fromkeys((*there, own.algorithm)))
            chosen = [name for name in dict.fromkeys(names) if len(tasks) == 1 or name in there]
            for name in chosen if names else there:
                is_own = own is not None and (name, env_id) == (own.algorithm, own.env_id)
                found.append(
                    self._of_registry(name, task, of_folder if names or is_own else request)
                )
            if entry is not None and task in entry.tasks:
                found.append(self._candidate(entry.name, task, entry.trainings, entry.folder))
        return found

    def _of_registry(self, name: str, task: str, request: AgentRequest) -> Candidate:
        entry = agent_entry(name)
        folders = policy_folders(name, request) if entry.kind == "learned" else []
        found = self._candidate(name, task, tuple(folders) or (None,))
        return replace(found, options=entry.needed_options(found.options))

    def _candidate(
        self, name: str, task: str, folders: tuple[Path | None, ...], entry: Path | None = None
    ) -> Candidate:
        most = [self.episodes, self.costly_episodes if _plans(name) else MOST_EPISODES]
        if task_named(task).headline == TIME_PER_FALL:
            most.append(LONG_COSTLY_EPISODES if _plans(name) else LONG_EPISODES)
        options = evaluated_options(task, self.options)
        return Candidate(task, name, min(most), options, folders, entry)

    def run(self, candidates: Sequence[Candidate]) -> list[Results]:
        """Let every candidate run the episodes of the seed; the same ones at the same task.

        Raises
        ------
        ValueError
            If a number is out of range, or an agent cannot be made.
        """
        chunks = {candidate: self._chunks(candidate) for candidate in candidates}
        everything = [chunk for of_one in chunks.values() for chunk in of_one]
        if self.cache is not None:
            self.cache.mkdir(parents=True, exist_ok=True)
        total = sum(len(chunk.seeds) for chunk in everything)
        found: dict[_Chunk, _Outcome] = {}
        with tqdm(total=total, desc="evaluating", unit="episode", disable=not self.progress) as bar:
            for chunk, outcome in _outcomes(everything, self.cache, self.processes):
                found[chunk] = outcome
                bar.update(len(chunk.seeds))
        return [_gathered(candidate, chunks[candidate], found) for candidate in candidates]

    def _chunks(self, candidate: Candidate) -> list[_Chunk]:
        size = _COSTLY_CHUNK if _plans(candidate.agent) else _CHUNK
        first = first_seed(self.episode_set, self.seed)
        seeds = range(first, first + candidate.episodes)
        return [
            _Chunk(candidate, folder, seeds[start : start + size])
            for folder in candidate.folders
            for start in range(0, len(seeds), size)
        ]


def evaluated_options(task: str, options: EnvOptions) -> EnvOptions:
    """The options under which all agents of a task are evaluated: walks until a fall are cut sooner than the task cuts them, unless a horizon is given."""
    is_long = task_named(task).headline == TIME_PER_FALL and options.horizon is None
    return replace(options, horizon=LONG_HORIZON) if is_long else options


def _plans(agent: str) -> bool:
    return kind_of(agent) == "planner"


def _gathered(
    candidate: Candidate, chunks: Sequence[_Chunk], found: Mapping[_Chunk, _Outcome]
) -> Results:
    runs = tuple(
        Episodes.joined([found[chunk][0] for chunk in chunks if chunk.folder == folder])
        for folder in candidate.folders
    )
    seconds = sum(found[chunk][1] for chunk in chunks)
    return Results(candidate.task, candidate.agent, runs, candidate.options, seconds)


def _outcomes(
    chunks: Sequence[_Chunk], cache: Path | None, processes: int
) -> Iterator[tuple[_Chunk, _Outcome]]:
    """Each chunk's episodes and seconds, as they are there: the kept ones first."""
    waiting: list[_Chunk] = []
    for chunk in chunks:
        kept = None if cache is None else _read(chunk.file(cache))
        if kept is None:
            waiting.append(chunk)
        else:
            yield chunk, kept
    # plans take longest: begun last, one of them would be waited for while the other processes have nothing to do
    waiting.sort(key=lambda chunk: not _plans(chunk.candidate.agent))
    is_long = sum(len(chunk.seeds) for chunk in waiting) >= _WORTH_PROCESSES
    if processes == 1 or not (is_long or (waiting and _plans(waiting[0].candidate.agent))):
        for chunk in waiting:
            yield chunk, _run_chunk(chunk, cache)
        return
    with worker_pool(min(processes, len(waiting))) as pool:
        with uninterrupted():
            futures = {pool.submit(_run_chunk, chunk, cache): chunk for chunk in waiting}
        for future in as_completed(futures):
            yield futures[future], future.result()


@contextlib.contextmanager
def worker_pool(processes: int) -> Iterator[ProcessPoolExecutor]:
    """Processes of one thread each; at an interruption what has begun ends and is kept, and nothing else begins."""
    before = dict(os.environ)
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    pool = ProcessPoolExecutor(
        processes,
        mp_context=multiprocessing.get_context("spawn"),
        initializer=signal.signal,
        initargs=(signal.SIGINT, signal.SIG_IGN),
    )
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)
        os.environ.clear()
        os.environ.update(before)


def make_candidate(candidate: Candidate, folder: Path | None, seed: int = 0) -> Agent:
    """The agent of one of a candidate's trainings; ``seed`` is for an agent that draws."""
    if candidate.entry is not None and folder is not None:
        return load_entry(candidate.entry, folder)
    options = candidate.options if candidate.made_for is None else candidate.made_for
    request = AgentRequest(env_id_of(candidate.task), options, seed, folder, runs=None)
    return make_agent(candidate.agent, request)


def _run_chunk(chunk: _Chunk, cache: Path | None) -> _Outcome:
    """Run a chunk and keep it."""
    candidate = chunk.candidate
    # an agent that draws draws anew for each chunk, so that chunks may be run in any order
    agent = make_candidate(candidate, chunk.folder, chunk.seeds.start)
    begin = time.process_time()
    episodes = run_seeds(agent, candidate.task, chunk.seeds, options=candidate.options)
    seconds = time.process_time() - begin
    if cache is not None:
        arrays: dict[str, Any] = {_METRIC + name: each for name, each in episodes.metrics.items()}
        with written_whole(chunk.file(cache)) as temporary:
            np.savez(temporary, survived=episodes.survived, seconds=np.array(seconds), **arrays)
    return episodes, seconds


def _read(path: Path) -> _Outcome | None:
    """What is kept in a file; None if there is none or it is damaged."""
    try:
        with np.load(path, allow_pickle=False) as kept:
            metrics = {
                name.removeprefix(_METRIC): kept[name] for name in kept if name.startswith(_METRIC)
            }
            return Episodes(kept["survived"], metrics), float(kept["seconds"])
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        return None


_versions = lru_cache(maxsize=1)(package_versions)
"""They are read from the disk, which takes longer than all else in a chunk's name."""


@lru_cache(maxsize=1)
def _code_digest() -> str:
    """A digest of the code and settings that an episode depends on."""
    walker, own = Path(str(lean_yaw_env.__file__)).parent, Path(__file__).parents[1]
    files = [
        path for path in walker.rglob("*.py") if path.relative_to(walker).parts[0] not in _ASIDE
    ]
    files += [*own.glob("*.py"), *own.glob("*.json"), own / "evaluation" / "scoring.py"]
    files += [*(own / "controllers").rglob("*.py"), *(own / "policies").rglob("*.py")]
    return _digest(*sorted(files))


def _policy_digest(entry: Path | None, folder: Path | None) -> str | None:
    """A digest of a trained policy's files, or of an entry's; None for an agent that is not trained."""
    if entry is not None:
        files = sorted(each for each in entry.rglob("*") if each.is_file())
        return _digest(*(each for each in files if "__pycache__" not in each.parts)) + str(folder)
    return None if folder is None else _digest(folder / CARD_FILE, folder / WEIGHTS_FILE)


@lru_cache(maxsize=256)
def _digest(*files: Path) -> str:
    digest = hashlib.sha256()
    for path in files:
        with contextlib.suppress(OSError):  # loading a policy reports its missing file
            digest.update(path.read_bytes())
    return digest.hexdigest()
