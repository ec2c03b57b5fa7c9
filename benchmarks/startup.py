"""Start-up: import, make, reset and one step in a new process, with the compiled code on disk, without it, and with no place for it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import lean_yaw_env
from benchmarks.measure import Measurement, command_line

PROGRAM = """
import time
import warnings
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    import gymnasium as gym
    import lean_yaw_env
    env = gym.make("LeanYaw/Heading-v1")
    env.reset(seed=0)
    env.step(env.action_space.sample())
print(time.process_time(), sum("compiled" in str(each.message) for each in caught))
"""
WARM_RUNS = 5


def start(package: Path, environment: dict[str, str]) -> tuple[float, int]:
    """Processor seconds that a new process takes for the first step, and how often it warned."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        cwd=package.parent,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    seconds, warned = done.stdout.split()
    return float(seconds), int(warned)


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
    """All measurements of the start: processor seconds, which a busy machine does not stretch."""
    package = Path(lean_yaw_env.__file__).parent
    if smallest:  # as it is, whatever is compiled already
        return [Measurement("start", start(package, {})[0], "s")]
    with tempfile.TemporaryDirectory() as name:
        cache = {"NUMBA_CACHE_DIR": str(Path(name) / "cache")}
        cold, _ = start(package, cache)
        warm = sorted(start(package, cache)[0] for _ in range(WARM_RUNS))
        uncached, warned = start(*without_cache(Path(name) / "copy"))
    return [
        Measurement("cold_start", cold, "s", "<=", 15.0, "nothing compiled yet"),
        Measurement("warm_start", warm[WARM_RUNS // 2], "s", "<=", 1.5, "compiled code on disk"),
        Measurement("uncached_start", uncached, "s", note="no folder for compiled code"),
        Measurement("uncached_warnings", warned, "", "<=", 1.0, "no folder for compiled code"),
    ]


if __name__ == "__main__":
    command_line(run, __doc__)
