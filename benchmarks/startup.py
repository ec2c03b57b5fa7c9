"""Start-up: import, make, reset and one step in a new process, then of another task and of a vector environment; with the compiled code on disk, without it, and
with no place for it. All times are processor seconds, which a busy machine does not stretch."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import lean_yaw_env
from benchmarks.measure import Measurement, command_line

PROGRAM = """
import time
import warnings
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    import gymnasium as gym
    import lean_yaw_env
    for env in (
        lambda: gym.make("LeanYaw/Heading-v1"),
        lambda: gym.make("LeanYaw/Slalom-v1"),
        lambda: gym.make_vec("LeanYaw/Heading-v1", num_envs=4),
    ):
        env = env()
        env.reset(seed=0)
        env.step(env.action_space.sample())
        print(time.process_time())
print(sum("compiled" in str(each.message) for each in caught))
"""
COMPILE = """
import time
from lean_yaw_env.compile import compile_all
compile_all(report=lambda line: None)
print(time.process_time())
"""
WARM_RUNS = 5


class Start(NamedTuple):
    """Seconds to the first step, from there to that of another task, and to that of a vector environment; and the number of warnings."""

    first: float
    other_task: float
    vector: float
    warnings: int


def run_program(program: str, package: Path, environment: dict[str, str]) -> list[float]:
    """The numbers that a program prints, run by a new process beside the package."""
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=package.parent,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return [float(word) for word in done.stdout.split()]


def start(package: Path, environment: dict[str, str]) -> Start:
    """What a new process takes."""
    first, second, third, warned = run_program(PROGRAM, package, environment)
    return Start(first, second - first, third - second, int(warned))


def without_cache(folder: Path) -> tuple[Path, dict[str, str]]:
    """A copy of the package in which no folder for compiled code can be made, for any user: files lie where it would be."""
    package = folder / "lean_yaw_env"
    shutil.copytree(
        Path(lean_yaw_env.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__")
    )
    for directory in [package, *(path for path in package.rglob("*") if path.is_dir())]:
        (directory / "__pycache__").touch()
    nowhere = str(package / "__pycache__" / "nowhere")
    return package, {"HOME": nowhere, "XDG_CACHE_HOME": nowhere, "NUMBA_CACHE_DIR": nowhere}


def run(smallest: bool) -> list[Measurement]:
    """All measurements of the start."""
    package = Path(lean_yaw_env.__file__).parent
    if smallest:  # as it is, whatever is compiled already
        return [Measurement("start", start(package, {}).first, "s")]
    with tempfile.TemporaryDirectory() as name:
        cache = {"NUMBA_CACHE_DIR": str(Path(name) / "cache")}
        cold = start(package, cache)
        warm = sorted(start(package, cache).first for _ in range(WARM_RUNS))
        (everything,) = run_program(COMPILE, package, {"NUMBA_CACHE_DIR": str(Path(name) / "all")})
        uncached = start(*without_cache(Path(name) / "copy"))
    return [
        Measurement("cold_start", cold.first, "s", "<=", 15.0, "nothing compiled yet"),
        Measurement("another_task", cold.other_task, "s", "<=", 2.0, "then"),
        Measurement("first_vector", cold.vector, "s", note="then"),
        Measurement("warm_start", warm[WARM_RUNS // 2], "s", "<=", 1.5, "compiled code on disk"),
        Measurement("compile_everything", everything, "s", note="python -m lean_yaw_env.compile"),
        Measurement("uncached_start", uncached.first, "s", note="no folder for compiled code"),
        Measurement("uncached_warnings", uncached.warnings, "", "<=", 1.0, "no folder for compiled code"),
    ]  # fmt: skip


if __name__ == "__main__":
    command_line(run, __doc__)
