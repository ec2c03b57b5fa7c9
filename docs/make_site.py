"""Build the site into ``docs/build``: pages, notebooks, films of all tasks, and the report on the paper.

What is finished is kept: after an interruption the same command continues. Delete ``docs/build`` to build everything anew.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from lean_yaw_env.registration import GOAL_TASK, TASK_VERSIONS

DOCS = Path(__file__).resolve().parent
BUILD = DOCS / "build"
FILMED = {"ppo": tuple(TASK_VERSIONS), "her": (GOAL_TASK,)}
"""Agents, and the tasks at which each is filmed."""


def missing() -> list[list[str]]:
    """The commands that make the films and the report, as far as the build lacks them."""
    films = BUILD / "films"
    commands = []
    for agent, tasks in FILMED.items():
        lacking = [each for each in tasks if not (films / f"{each.lower()}.mp4").exists()]
        if lacking:
            film = ["agents", "film", "--format", "mp4", "--fps", "20", "--out", str(films)]
            commands.append([*film, "--agent", agent, "--task", ",".join(lacking)])
    if not (BUILD / "report" / "report.html").exists():
        reproduce = ["lean_yaw_env.cli", "reproduce", "all", "--out", f"{BUILD}/report"]
        commands.append(reproduce)
    return commands


def main() -> None:
    """Make films and report while the notebooks run."""
    python = [sys.executable, "-m"]
    running = [subprocess.Popen([*python, *command], cwd=DOCS.parent) for command in missing()]
    options = ["-W", "--keep-going", "-d", f"{DOCS}/_cache/doctrees"]
    results = [subprocess.call([*python, "sphinx", *options, str(DOCS), str(BUILD)])]
    results += [process.wait() for process in running]
    sys.exit(max(map(abs, results)))


if __name__ == "__main__":
    main()
