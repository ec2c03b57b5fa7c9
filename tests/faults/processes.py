"""Processes to kill: each begins within milliseconds, since a server that has imported everything forks it."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import runpy
import sys
import time
from collections.abc import Callable, Sequence
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
_PRELOADED = [
    "agents.command_line", "agents.evaluation.leaderboard", "agents.evaluation.videos", "agents.learning.series",
    "agents.tuning.study", "lean_yaw_env.analysis", "lean_yaw_env.cli.app", "lean_yaw_env.paper", "tests.faults.work",
]  # fmt: skip


def start(function: Callable[..., Any], *arguments: Any, log: Path | None = None) -> BaseProcess:
    """Begin a function in a process of its own, whose output goes to ``log``."""
    os.environ |= {"OMP_NUM_THREADS": "1", "SDL_VIDEODRIVER": "dummy"}
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_PRELOADED)
    process = context.Process(target=_main, args=(function, arguments, log))
    process.start()
    return process


def start_command(command: Sequence[str], log: Path) -> BaseProcess:
    """Begin a command line: "train.py", "agents" or "lean-yaw" and its arguments."""
    return start(run_command, list(command), log=log)


def run_command(command: list[str]) -> None:
    """Run a command line as a shell would."""
    program, *arguments = filter(None, command)
    sys.argv = [program, *arguments]
    if program == "train.py":
        runpy.run_path(str(ROOT / "train.py"), run_name="__main__")
    elif program == "agents":
        runpy.run_module("agents", run_name="__main__")
    else:
        runpy.run_module("lean_yaw_env.cli", run_name="__main__")


def _main(function: Callable[..., Any], arguments: Sequence[Any], log: Path | None) -> None:
    os.setsid()  # a group of its own, in which nobody may be left
    with (log or Path(os.devnull)).open("ab", buffering=0) as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    function(*arguments)


def seconds_to_end(group: int, most: float) -> float:
    """Wait until no process of a group is left; the seconds that it takes, but for those in which its threads wait for a processor that others have.

    On a quiet machine that is the time on the clock. A thread's end, and the moments since the last look, do not count.

    Raises
    ------
    TimeoutError
        If a process is left after ``most`` seconds on the clock.
    """
    seconds, began = 0.0, time.monotonic()
    now, waited = began, _waited(group)
    while not group_is_empty(group):
        if now - began > most:
            raise TimeoutError(f"a process is left after {most:g} s")
        time.sleep(0.05)
        before, now = (now, waited), time.monotonic()
        waited = _waited(group)
        if waited and before[1].keys() <= waited.keys():
            lost = sum(each - before[1].get(thread, 0.0) for thread, each in waited.items())
            seconds += max(0.0, now - before[0] - lost)
    return seconds


def _waited(group: int) -> dict[str, float]:
    """By thread of a group, the seconds that it has waited for a processor; nothing where the system does not say."""
    found: dict[str, float] = {}
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError, IndexError):
            if os.getpgid(int(process.name)) == group:
                for thread in (process / "task").iterdir():
                    found[thread.name] = 1e-9 * int((thread / "schedstat").read_text().split()[1])
    return found


def group_is_empty(group: int) -> bool:
    """Whether no process of a group runs."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(group, 0)
        return False
    return True
