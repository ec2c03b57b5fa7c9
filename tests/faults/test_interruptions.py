"""Ctrl-C and SIGTERM end every command soon, with one line, the exit status of a shell and no process left behind."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.faults.processes import group_is_empty, start_command

pytestmark = pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
PATIENCE = 60.0  # seconds until a command that does not begin or end counts as hanging

Begun = Callable[[Path, Path], bool]


def says(words: str) -> Begun:
    return lambda log, folder: words in log.read_text()


def has(pattern: str, number: int = 1) -> Begun:
    return lambda log, folder: len(list(folder.glob(pattern))) >= number


COMMANDS: dict[str, tuple[list[str], Begun, str]] = {
    "train": (
        ["train", "--task", "Walk", "--steps", "9000000", "--out", "OUT"],
        has("OUT/*/checkpoint.safetensors"), "continue with: python -m agents train --resume",
    ),
    "series": (
        ["train", "--task", "Walk", "--steps", "9000000", "--seeds", "2", "--jobs", "2", "--out", "OUT"],
        has("OUT/*/seed*/.lock", 2), "continue with: python -m agents train --resume",
    ),
    "tune": (
        ["agents", "tune", "lqr", "Metastable", "--trials", "1000", "--storage", "OUT/study.db"],
        says("1 of 1000"), "run the same command again to continue",
    ),
    "evaluate": (
        ["agents", "evaluate", "--task", "Metastable", "--agents", "mpc", "--episodes", "400", "--costly-episodes", "400",
         "--processes", "2", "--cache", "OUT"],
        says("evaluating"), "run the same command again to continue",
    ),
    "evaluate alone": (
        ["agents", "evaluate", "--task", "Metastable", "--agents", "mpc", "--episodes", "400", "--costly-episodes", "400",
         "--processes", "1", "--cache", "OUT"],
        says("evaluating"), "run the same command again to continue",
    ),
    "closed-loop": (["agents", "closed-loop", "--task", "all"], lambda log, folder: True, "interrupted"),
    "map": (
        ["lean-yaw", "map", "hip_width=0.1:0.5:400", "slope=0.005:0.05:400", "--out", "OUT/map.nc"],
        says("160,000 points"), "run the same command again to continue",
    ),
    "reproduce": (
        ["lean-yaw", "reproduce", "all", "--out", "OUT/report"],
        has("OUT/report/.lock"), "run the same command again to continue",
    ),
    "view": (["lean-yaw", "view", "--no-browser"], says("the page is at"), "interrupted"),
}  # fmt: skip


def wait_until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "the command hangs"
        time.sleep(0.05)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["ctrl-c", "sigterm"])
@pytest.mark.parametrize("name", COMMANDS)
def test_a_signal_ends_a_command_with_one_line_and_no_process_left(
    tmp_path: Path, name: str, number: signal.Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    command, begun, promise = COMMANDS[name]
    (tmp_path / "OUT").mkdir()
    log = tmp_path / "log"
    log.touch()
    arguments = [word.replace("OUT", str(tmp_path / "OUT")) for word in command]
    process = start_command(arguments, log)
    assert process.pid is not None
    wait_until(lambda: begun(log, tmp_path) or not process.is_alive())
    time.sleep(0.5)  # into the work
    assert process.is_alive(), log.read_text()
    if number == signal.SIGINT:
        os.killpg(process.pid, number)  # as a terminal does
    else:
        os.kill(process.pid, number)
    process.join(PATIENCE)
    said = log.read_text()
    assert process.exitcode == 128 + number, said
    assert "Traceback" not in said and "leaked" not in said
    last = said.strip().splitlines()[-1]
    assert ": interrupted" in last and promise in last
    wait_until(lambda: group_is_empty(process.pid or 0))


def test_an_interrupted_training_is_continued_by_the_command_that_its_line_names(
    tmp_path: Path,
) -> None:
    log = tmp_path / "log"
    log.touch()
    process = start_command(["train", "--task", "Walk", "--steps", "65536", "--episodes", "2", "--out", str(tmp_path / "runs")], log)  # fmt: skip
    wait_until(lambda: "training in" in log.read_text())
    os.kill(process.pid or 0, signal.SIGTERM)
    process.join(PATIENCE)
    assert process.exitcode == 143, log.read_text()
    words = log.read_text().strip().splitlines()[-1].split("continue with: python -m ")[1].split()
    again = start_command(words, log)
    again.join(5 * PATIENCE)
    assert again.exitcode == 0, log.read_text()
    assert "agent, settings, learning curve and evaluation are in" in log.read_text()
