"""Unfinished runs trained side by side, each in a process of its own, under one bar."""

from __future__ import annotations

import multiprocessing
import signal
import sys
from collections import deque
from collections.abc import Sequence
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pathlib import Path

from tqdm import tqdm

from agents.learning.training import read_run, run


class RunError(RuntimeError):
    """A run whose process did not end well; what it wrote stays and can be gone on with."""


def run_side_by_side(folders: Sequence[Path], jobs: int, *, progress: bool = True) -> None:
    """Finish runs, ``jobs`` of them at a time; an interruption ends the processes, whose checkpoints stay.

    Raises
    ------
    RunError
        If a process fails: the others are ended too.
    """
    steps = {folder: read_run(folder).settings.steps for folder in folders}
    waiting = deque(folders)
    active: dict[Connection, tuple[Path, SpawnProcess]] = {}
    done = dict.fromkeys(folders, 0)
    bar = tqdm(total=sum(steps.values()), unit="step", unit_scale=True, disable=not progress)
    try:
        while waiting or active:
            while waiting and len(active) < jobs:
                folder = waiting.popleft()
                connection, process = _started(folder)
                active[connection] = (folder, process)
            ended = len(folders) - len(active) - len(waiting)
            bar.set_description(f"trainings done: {ended} of {len(folders)}", refresh=False)
            for ready in wait(list(active)):
                assert isinstance(ready, Connection)
                folder, process = active[ready]
                try:
                    done[folder] = ready.recv()
                except EOFError:
                    del active[ready]
                    _require_success(folder, process)
                    done[folder] = steps[folder]
            bar.update(sum(done.values()) - bar.n)
    finally:
        bar.close()
        for _, process in active.values():
            process.terminate()
        for _, process in active.values():
            process.join()


def _started(folder: Path) -> tuple[Connection, SpawnProcess]:
    # a fresh interpreter: torch and compiled threads do not survive a fork
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_run_and_tell, args=(folder, sender), daemon=True)
    process.start()
    sender.close()  # so that the end of the process is the end of the pipe
    return receiver, process


def _require_success(folder: Path, process: SpawnProcess) -> None:
    process.join()
    if process.exitcode != 0:
        raise RunError(
            f"the training in {str(folder)!r} ended with status {process.exitcode}; its own message is above, "
            "and --resume goes on with it"
        )


def _run_and_tell(folder: Path, sender: Connection) -> None:
    """The whole life of a process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent's to decide
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that half-written files are removed
    run(folder, progress=False, report=lambda steps, _: sender.send(steps))
