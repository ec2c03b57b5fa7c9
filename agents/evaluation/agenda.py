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
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

import agents
import lean_yaw_env
from agents.evaluation.results import Episodes, Results
from agents.evaluation.scoring import Progress, run_seeds
from agents.policies.storage import CARD_FILE, WEIGHTS_FILE, options_to_plain
from agents.registry import AgentRequest, agent_entry, env_id_of, make_agent
from agents.seeds import MOST_EPISODES, evaluation_seed
from agents.versions import package_versions
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.files import written_whole
from lean_yaw_env.parameters import require_number

_SHARE = 1024  # episodes walked side by side
_COSTLY_SHARE = 20  # of an agent that plans: some tens of seconds
_WORTH_PROCESSES = 2048  # episodes; fewer are walked before another process has started
_METRIC = "metric:"
# Folders of the walker's package that no episode depends on
_ASIDE = frozenset({"cli", "multibody", "paper", "rendering", "vehicles"})


@dataclass(frozen=True)
class Entrant:
    """An agent that is to walk a task's episodes.

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
        require_number("episodes", self.episodes, 1, MOST_EPISODES)


@dataclass(frozen=True)
class Walked:
    """An entrant's results and the time they took, in seconds of one core."""

    entrant: Entrant
    results: Results
    seconds: float


@dataclass(frozen=True)
class _Share:
    """Some of the episodes of one of an entrant's policies: what one process walks at a time."""

    entrant: Entrant
    folder: Path | None
    seeds: range

    def file(self, cache: Path) -> Path:
        """Where it is kept: the name tells everything that its result depends on."""
        entrant = self.entrant
        depends = {
            "task": entrant.task,
            "agent": entrant.agent,
            "options": options_to_plain(entrant.options),
            "seeds": [self.seeds.start, self.seeds.stop],
            "policy": None if self.folder is None else _policy_digest(self.folder),
            "code": _code_digest(),
            "versions": package_versions(),
        }
        digest = hashlib.sha256(json.dumps(depends, sort_keys=True).encode()).hexdigest()
        return cache / f"{entrant.task}-{entrant.agent}-{digest[:24]}.npz"


def walk_all(
    entrants: Sequence[Entrant],
    *,
    seed: int = 0,
    cache: Path | None = None,
    processes: int = 1,
    progress: Progress | None = None,
) -> list[Walked]:
    """Let every entrant walk the episodes of an evaluation's seed; the same ones at the same task.

    Parameters
    ----------
    entrants : Entrant
    seed : int >= 0
        Another seed draws other episodes.
    cache : folder, optional
        What is found there is not walked again, and what is walked is left there: it is found as long as task, options, episodes, agent and
        code are the same.
    processes : int >= 1
    progress : called with numbers of episodes that are there, optional

    Raises
    ------
    ValueError
        If a number is out of range, or an agent cannot be made.
    """
    require_number("processes", processes, 1, 1024)
    shares = [share for entrant in entrants for share in _shares(entrant, evaluation_seed(seed))]
    if cache is not None:
        cache.mkdir(parents=True, exist_ok=True)
    found: dict[_Share, tuple[Episodes, float]] = {}
    for share, outcome in _outcomes(shares, cache, processes):
        found[share] = outcome
        if progress is not None:
            progress(len(share.seeds))
    return [_walked(entrant, evaluation_seed(seed), found) for entrant in entrants]


def _walked(entrant: Entrant, first: int, found: dict[_Share, tuple[Episodes, float]]) -> Walked:
    shares = _shares(entrant, first)
    runs = [
        Episodes.joined([found[share][0] for share in shares if share.folder == folder])
        for folder in entrant.folders
    ]
    results = Results(entrant.task, entrant.agent, tuple(runs))
    return Walked(entrant, results, sum(found[share][1] for share in shares))


def _shares(entrant: Entrant, first: int) -> list[_Share]:
    size = _COSTLY_SHARE if agent_entry(entrant.agent).kind == "planner" else _SHARE
    seeds = range(first, first + entrant.episodes)
    return [
        _Share(entrant, folder, seeds[start : start + size])
        for folder in entrant.folders
        for start in range(0, len(seeds), size)
    ]


def _outcomes(
    shares: Sequence[_Share], cache: Path | None, processes: int
) -> Iterator[tuple[_Share, tuple[Episodes, float]]]:
    """Each share's episodes and seconds, as they are there: the kept ones first."""
    waiting: list[_Share] = []
    for share in shares:
        kept = None if cache is None else _read(share.file(cache))
        if kept is None:
            waiting.append(share)
        else:
            yield share, kept
    # plans take longest: begun last, one of them would be waited for while the other processes have nothing to do
    waiting.sort(key=lambda share: agent_entry(share.entrant.agent).kind != "planner")
    costly = any(agent_entry(share.entrant.agent).kind == "planner" for share in waiting)
    if processes == 1 or not (
        costly or sum(len(share.seeds) for share in waiting) >= _WORTH_PROCESSES
    ):
        for share in waiting:
            yield share, _walk(share, cache)
        return
    with _pool(min(processes, len(waiting))) as pool:
        futures = {pool.submit(_walk, share, cache): share for share in waiting}
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


def _walk(share: _Share, cache: Path | None) -> tuple[Episodes, float]:
    """Walk a share and keep it."""
    entrant = share.entrant
    # an agent that draws draws anew for each share, so that shares may be walked in any order
    request = AgentRequest(
        env_id_of(entrant.task),
        entrant.options,
        seed=share.seeds.start,
        path=share.folder,
        runs=None,
    )
    agent = make_agent(entrant.agent, request)
    begin = time.process_time()
    episodes = run_seeds(agent, entrant.task, share.seeds, options=entrant.options)
    seconds = time.process_time() - begin
    if cache is not None:
        _write(share.file(cache), episodes, seconds)
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
    walker, own = (Path(str(package.__file__)).parent for package in (lean_yaw_env, agents))
    files = [
        path for path in walker.rglob("*.py") if path.relative_to(walker).parts[0] not in _ASIDE
    ]
    files += [*own.glob("*.py"), own / "evaluation" / "scoring.py"]
    for folder in ("controllers", "policies"):
        files += [path for ending in ("*.py", "*.json") for path in (own / folder).rglob(ending)]
    digest = hashlib.sha256()
    for path in sorted(files):
        digest.update(path.read_bytes())
    return digest.hexdigest()
