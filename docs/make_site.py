"""Build the site into ``docs/build``: pages, notebooks, films of all tasks, and the report on the paper."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
BUILD = DOCS / "build"


FILM = [sys.executable, "-m", "agents", "film", "--format", "mp4", "--fps", "20", "--out"]
"""For a folder, and then a task and an agent."""


def main() -> None:
    """Films and report are made while the notebooks run; those that are there already are kept."""
    python, films = sys.executable, str(BUILD / "films")
    work = {
        BUILD / "films" / "heading.mp4": [*FILM, films, "--task", "all", "--agent", "ppo"],
        BUILD / "films" / "waypointgoal.mp4": [*FILM, films, "--task", "WaypointGoal", "--agent", "her"],
        BUILD / "report": [python, "-m", "lean_yaw_env.cli", "reproduce", "all", "--out", f"{BUILD}/report"],
    }  # fmt: skip
    running = [
        subprocess.Popen(command, cwd=ROOT) for made, command in work.items() if not made.exists()
    ]
    sphinx = [
        python,
        "-m",
        "sphinx",
        "-W",
        "--keep-going",
        "-d",
        f"{DOCS}/_cache/doctrees",
        str(DOCS),
        str(BUILD),
    ]
    results = [subprocess.call(sphinx), *(process.wait() for process in running)]
    sys.exit(max(results))


if __name__ == "__main__":
    main()
