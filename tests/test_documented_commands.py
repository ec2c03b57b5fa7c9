"""The commands in README and docs exist, with the options that the pages give them."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
COMMAND = re.compile(
    r"(?:python -m (?:agents|benchmarks|lean_yaw_env)|python train\.py|lean-yaw )[^`\n]*"
)


def _options_by_program() -> dict[str, set[str]]:
    """Each program with its subcommand and other words, and the options that pages give it."""
    found: dict[str, set[str]] = {}
    for page in PAGES:
        for command in COMMAND.findall(page.read_text(encoding="utf-8")):
            words = shlex.split(command.split(" && ")[0], comments=True)
            options = [k for k, word in enumerate(words) if word.startswith("--")]
            program = shlex.join(words[: options[0]] if options else words)
            found.setdefault(program, set()).update(words[k].split("=")[0] for k in options)
    return found


@pytest.mark.parametrize(("program", "options"), _options_by_program().items())
def test_a_documented_command_knows_its_options(program: str, options: set[str]) -> None:
    words = shlex.split(program)
    own = ["-m", "lean_yaw_env.cli"] if words[0] == "lean-yaw" else []
    plain = {**os.environ, "COLUMNS": "300", "TERM": "dumb", "NO_COLOR": "1"}
    done = subprocess.run(
        [sys.executable, *own, *words[1:], "--help"],
        cwd=ROOT,
        env=plain,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    unknown = {option for option in options if not re.search(rf"{option}\b", done.stdout)}
    assert not unknown
