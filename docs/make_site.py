"""Build the site into ``docs/build``: pages, notebooks, films of all tasks, and the report on the paper."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parent
BUILD = DOCS / "build"


def main() -> None:
    """Films and report are made while the notebooks run; what is there already is kept."""
    python = sys.executable
    films = [
        python,
        "-m",
        "agents",
        "film",
        "--task",
        "all",
        "--format",
        "mp4",
        "--fps",
        "20",
        "--out",
        f"{BUILD}/films",
    ]
    report = [python, "-m", "lean_yaw_env.cli", "reproduce", "all", "--out", f"{BUILD}/report"]
    missing = [work for work in (films, report) if not Path(work[-1]).exists()]
    running = [subprocess.Popen(work, cwd=DOCS.parent) for work in missing]
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
