"""Every command in README and docs runs: here in a short form, or in a test named here."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from agents.command_line import app as agents_app
from lean_yaw_env.cli.app import app as walker_app

from .test_documents import COMMAND, DOCS, FENCED, PAGES, ROOT

APPS: dict[str, typer.Typer] = {
    "lean-yaw": walker_app,
    "python -m agents": agents_app,
}

SHORT = {
    "python -m agents robustness": "--agents fixed --episodes 1 --processes 1",
    "python -m agents capture": "--agents fixed --starts 8 --points 3",
    "python -m agents film": "--seconds 0.5",
}
"""Options that make a command short: in place of the values that it gives, or beside them."""

ELSEWHERE = {
    r"python train\.py .*--seeds": "test_agents_series.py: --seeds",
    r"python train\.py .*--algorithm her": 'test_agents_her.py: algorithm="her"',
    r"python train\.py .*--algorithm sac": 'test_agents_sac.py: algorithm="sac"',
    r"python train\.py .*--algorithm apg": 'test_agents_gradient.py: train("apg"',
    r"python train\.py": "test_agents_training.py: --resume",
    r"python -m agents evaluate .*--out": "test_agents_entries.py: --results",
    r"python -m agents evaluate": "test_agents_training.py: --agent-path",
    r"python -m agents dataset": 'compat/test_datasets.py: ["dataset"',
    r"python -m agents (ship|retrain)": "test_agents_series.py: shipped",
    r"python -m agents closed-loop": 'test_agents_closed_loop.py: ["closed-loop"',
    r"python -m agents reference": "test_agents_references.py: reference",
    r"python -m agents tune linear": "test_agents_linear.py: tune_linear",
    r"python -m agents tune": "test_agents_tuning.py: trials",
    r"lean-yaw view": "test_web_server.py: walk",
    r"lean-yaw play": "test_cli.py: play",
    r"lean-yaw findings": "test_findings.py: write_findings",
    r"lean-yaw reproduce": "test_cli.py: reproduce",
    r"lean-yaw atlas": "test_documents.py: atlas",
    r"lean-yaw map .*--scheduler": "test_engine.py: --scheduler",
    r"python -m lean_yaw_env.compile": "test_compile.py: compile_all",
    r"python -m benchmarks\.gradient": "test_gradient_benchmark.py: gradient",
    r"python -m benchmarks": "test_benchmarks.py: run",
}
"""Commands that other tests run, or whose functions they call with less work: the file, and words in it."""


def _commands() -> list[str]:
    """Commands of the pages: all those of code blocks, and those of sentences that give an option a value."""
    found: list[str] = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for block in FENCED.findall(text):
            found += [line for line in block.split("\n") if COMMAND.match(line)]
        found += [
            command
            for command in COMMAND.findall(FENCED.sub("", text))
            if re.search(r" --[a-z-]+ (?!\.\.\.)[^-A-Z ]", command) and " ... " not in command
        ]
    return list(dict.fromkeys(shlex.join(shlex.split(each, comments=True)) for each in found))


def _short(command: str) -> list[str]:
    """The words of a command with options that make it short, and with its first task only."""
    words = shlex.split(command)
    if "--task" in words:
        k = words.index("--task") + 1
        words[k] = words[k].split(",")[0].replace("all", "Walk")
    prefix = max((each for each in SHORT if command.startswith(each)), key=len, default="")
    given = shlex.split(SHORT.get(prefix, ""))
    for option, value in zip(given[::2], given[1::2], strict=True):
        if option in words:
            words[words.index(option) + 1] = value
        else:
            words += [option, value]
    return words


def _prepare(folder: Path, words: list[str]) -> list[str]:
    """Files that commands read, and the words of the command with the name of a run in place of dots."""
    text = (DOCS / "command_line.md").read_text(encoding="utf-8")
    block = re.search(r"^```json\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    assert block is not None
    (folder / "bicycle.json").write_text(block[1], encoding="utf-8")
    for k, word in enumerate(words):
        run = re.fullmatch(r"runs/(\w+)-\.\.\.", word)
        if run is not None:
            words[k] = f"runs/{run[1]}-ppo"
            trained = ROOT / "agents" / "trained" / f"{run[1]}-v1" / "ppo" / "seed0"
            shutil.copytree(trained, folder / words[k])
    return words


@pytest.mark.parametrize("command", _commands())
def test_a_command_of_a_page_runs(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for pattern, test in ELSEWHERE.items():
        if re.match(pattern, command):
            file, words = test.split(": ")
            assert words in (ROOT / "tests" / file).read_text(encoding="utf-8")
            return
    words = _prepare(tmp_path, _short(command))
    program = next(each for each in APPS if command.startswith(each))
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(APPS[program], words[len(shlex.split(program)) :])
    assert result.exit_code == 0, result.output
