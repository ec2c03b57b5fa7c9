"""Processes to kill: each begins within milliseconds, since a server that has imported everything forks it."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import runpy
import sys
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
    os.environ["OMP_NUM_THREADS"] = "1"
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_PRELOADED)
    process = context.Process(target=_main, args=(function, arguments, log))
    process.start()
    return process


def start_command(command: Sequence[str], log: Path) -> BaseProcess:
    """Begin a command line: "train", "agents" or "lean-yaw" and its arguments."""
    return start(run_command, list(command), log=log)


def run_command(command: list[str]) -> None:
    """Run a command line as a shell would."""
    program, *arguments = command
    sys.argv = [program, *arguments]
    if program == "train":
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


def group_is_empty(group: int) -> bool:
    """Whether no process of a group runs."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(group, 0)
        return False
    return True
