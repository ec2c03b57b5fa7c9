"""Ctrl-C and SIGTERM end every command within two seconds, with one line, the exit status of a shell and no process left behind."""

from __future__ import annotations

import importlib.util
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from lean_yaw_env import reporting
from tests.faults.processes import seconds_to_end, start_command
from tests.test_bad_commands import commands

pytestmark = pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
PATIENCE = 600.0  # seconds until a command that does not begin or end counts as hanging
PROMISED = 2.0  # seconds from a signal to the end

Begun = Callable[[int, Path, Path], bool]
"""Whether a process, by its id, log and folder, is at what it is to be interrupted in."""


def is_watched(process: int, log: Path, folder: Path) -> bool:
    """Whether SIGTERM has a handler, from which on the line is promised."""
    status = Path(f"/proc/{process}/status").read_text()
    caught = int(status.split("SigCgt:")[1].split()[0], 16)
    return bool(caught >> (signal.SIGTERM - 1) & 1)


def says(words: str) -> Begun:
    return lambda process, log, folder: words in log.read_text()


def has(pattern: str, number: int = 1) -> Begun:
    return lambda process, log, folder: len(list(folder.glob(pattern))) >= number


def has_children(number: int) -> Begun:
    return lambda process, log, folder: (
        len([each for file in Path(f"/proc/{process}/task").glob("*/children") for each in file.read_text().split()]) >= number
    )  # fmt: skip


def works(process: int, log: Path, folder: Path) -> bool:
    """Whether it has had two seconds of a processor: it is in the midst of what it computes."""
    ticks = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[11:13]
    return sum(map(int, ticks)) > 2 * os.sysconf("SC_CLK_TCK")


AGAIN = "run the same command again to continue"
NOTHING = "interrupted; nothing is kept"
MANY = ["--episodes", "400", "--costly-episodes", "400"]
COMMANDS: dict[str, tuple[list[str], Begun, str]] = {
    "train": (
        ["train.py", "", "--task", "Walk", "--steps", "9000000", "--out", "OUT"],
        has("OUT/*/checkpoint.safetensors"), "continue with: python -m agents train --resume",
    ),
    "series": (
        ["agents", "train", "--task", "Walk", "--steps", "9000000", "--seeds", "2", "--jobs", "2", "--out", "OUT"],
        has("OUT/*/seed*/.lock", 2), "continue with: python -m agents train --resume",
    ),
    "retrain": (
        ["agents", "retrain", "--task", "Walk", "--algorithm", "ppo", "--steps", "9000000", "--jobs", "2", "--out", "OUT"],
        has("OUT/*/seed*/.lock", 2), AGAIN,
    ),
    "tune": (
        ["agents", "tune", "lqr", "Metastable", "--trials", "1000", "--storage", "OUT/study.db"], says("1 of 1000"), AGAIN,
    ),
    "tune linear": (
        ["agents", "tune", "linear", "Heading", "--trials", "1000", "--out", "OUT/linear.json"], says("start:"), AGAIN,
    ),
    "reference": (
        ["agents", "reference", "--task", "Heading,Slalom", "--processes", "2", "--episodes", "400", "--out", "OUT/references.json"],
        has_children(2), AGAIN,
    ),
    "evaluate": (
        ["agents", "evaluate", "--task", "Metastable", "--agents", "mpc", *MANY, "--processes", "2", "--cache", "OUT"],
        says("evaluating"), AGAIN,
    ),
    "evaluate alone": (
        ["agents", "evaluate", "--task", "Metastable", "--agents", "mpc", *MANY, "--processes", "1", "--cache", "OUT"],
        says("evaluating"), AGAIN,
    ),
    "robustness": (
        ["agents", "robustness", "--task", "Slalom", "--agents", "mpc", *MANY, "--processes", "2", "--runs", "OUT", "--out", "OUT"],
        has_children(2), AGAIN,
    ),
    "dataset": (["agents", "dataset", "--kind", "expert", "--episodes", "4000", "--out", "OUT"], says("episode"), AGAIN),
    "closed-loop": (["agents", "closed-loop", "--task", "all"], works, NOTHING),
    "capture": (["agents", "capture", "--starts", "100000", "--points", "1000"], works, NOTHING),
    "film": (
        ["agents", "film", "--task", "Heading,Slalom", "--agent", "fixed", "--seconds", "500", "--out", "OUT"],
        works, "finished films are in",
    ),
    "gait": (["lean-yaw", "gait", "--ankle-damping", "0.1"], is_watched, NOTHING),
    "map": (
        ["lean-yaw", "map", "hip_width=0.1:0.5:400", "slope=0.005:0.05:400", "--out", "OUT/map.nc"], says("160,000 points"), AGAIN,
    ),
    "map to zarr": (
        ["lean-yaw", "map", "hip_width=0.1:0.5:400", "slope=0.005:0.05:400", "--out", "OUT/map.zarr"],
        has("OUT/map.zarr/record/regions/zarr.json"), AGAIN,
    ),
    "map by workers": (
        ["lean-yaw", "map", "hip_width=0.1:0.5:400", "slope=0.005:0.05:400", "--out", "OUT/map.zarr", "--workers", "2"],
        has_children(2), AGAIN,
    ),
    "basin": (
        ["lean-yaw", "basin", "ankle_angle=-0.1:0.1:1000", "heading=-0.5:0.5:1000", "--steps", "1000", "--out", "OUT/basin.nc"],
        works, AGAIN,
    ),
    "atlas": (["lean-yaw", "atlas", "--out", "OUT"], has("OUT/gaits.zarr/record/regions/zarr.json"), AGAIN),
    "reproduce": (["lean-yaw", "reproduce", "all", "--out", "OUT/report"], has("OUT/report/.lock"), AGAIN),
    "findings": (["lean-yaw", "findings", "--out", "OUT/page"], has("OUT/page/images"), NOTHING),
    "bicycle": (["lean-yaw", "bicycle", "--speeds", "0:10:100000"], is_watched, NOTHING),
    "skateboard": (["lean-yaw", "skateboard", "--speeds", "0:10:100000"], is_watched, NOTHING),
    "play": (["lean-yaw", "play", "LeanYaw/Heading-v1"], is_watched, NOTHING),
    "view": (["lean-yaw", "view", "--no-browser"], says("the page is at"), NOTHING),
}  # fmt: skip
AT_ONCE = {("agents", "ship")}
"""Commands that end before a signal could reach them."""
NEEDS = {"dataset": "minari", "map to zarr": "zarr", "map by workers": "dask", "atlas": "zarr"}


def test_every_command_is_interrupted() -> None:
    assert {(words[0], words[1]) for words, _, _ in COMMANDS.values()} | AT_ONCE == {
        key for key, _ in commands()
    }


def wait_until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "the command hangs"
        time.sleep(0.01)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["ctrl-c", "sigterm"])
@pytest.mark.parametrize("name", COMMANDS)
def test_a_signal_ends_a_command_within_two_seconds_with_one_line_and_no_process_left(
    tmp_path: Path, name: str, number: signal.Signals, request: pytest.FixtureRequest
) -> None:
    if name in ("series", "retrain"):
        request.applymarker(pytest.mark.xfail(reason="a training's process that is still importing can print a traceback", strict=False))  # fmt: skip
    if name in NEEDS and importlib.util.find_spec(NEEDS[name]) is None:
        pytest.skip(f"{NEEDS[name]} is not installed")
    command, begun, promise = COMMANDS[name]
    (tmp_path / "OUT").mkdir()
    log = tmp_path / "log"
    log.touch()
    process = start_command([word.replace("OUT", str(tmp_path / "OUT")) for word in command], log)
    group = process.pid
    assert group is not None
    wait_until(lambda: not process.is_alive() or begun(group, log, tmp_path))
    if begun is not is_watched:
        time.sleep(0.5)  # into the work
    assert process.is_alive(), log.read_text()
    if number == signal.SIGINT:
        os.killpg(group, number)  # as a terminal does
    else:
        os.kill(group, number)
    seconds = seconds_to_end(group, PATIENCE)
    process.join(PATIENCE)
    said = log.read_text()
    assert process.exitcode == 128 + number, said
    assert "Traceback" not in said and "leaked" not in said
    last = said.strip().splitlines()[-1]
    assert ": interrupted" in last and promise in last
    assert seconds < PROMISED


def test_a_process_that_does_not_end_is_ended_within_two_seconds(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    slept, ends = [], []
    monkeypatch.setattr(reporting.time, "sleep", slept.append)
    monkeypatch.setattr(reporting.os, "_exit", ends.append)
    monkeypatch.setattr(reporting._State, "is_said", False)
    reader, writer = socket.socketpair()
    with writer:
        writer.send(bytes([signal.SIGTERM]))
        reporting._end_after_signal(reader, "agents")
    assert ends == [143]
    assert sum(slept) < PROMISED
    assert "agents: interrupted" in capsys.readouterr().err


def test_the_exit_status_is_a_shells_though_the_signal_came_while_text_was_executed() -> None:
    code = (
        "import os, signal\n"
        "from lean_yaw_env.reporting import reporting\n"
        "with reporting('agents'):\n"
        "    exec('os.kill(os.getpid(), signal.SIGINT)')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 130
    assert done.stderr == "agents: interrupted; nothing is kept\n"


def test_a_command_imports_nothing_that_takes_long_before_it_watches_for_signals() -> None:
    slow = "{'numba', 'scipy', 'torch', 'typer', 'xarray', 'stable_baselines3'}"
    code = f"import sys, agents, lean_yaw_env.cli, lean_yaw_env.reporting; print({slow} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_an_interrupted_training_is_continued_by_the_command_that_its_line_names(
    tmp_path: Path,
) -> None:
    log = tmp_path / "log"
    log.touch()
    process = start_command(["train.py", "--task", "Walk", "--steps", "65536", "--episodes", "2", "--out", str(tmp_path / "runs")], log)  # fmt: skip
    wait_until(lambda: "training in" in log.read_text())
    os.kill(process.pid or 0, signal.SIGTERM)
    process.join(PATIENCE)
    assert process.exitcode == 143, log.read_text()
    words = log.read_text().strip().splitlines()[-1].split("continue with: python -m ")[1].split()
    again = start_command(words, log)
    again.join(3 * PATIENCE)
    assert again.exitcode == 0, log.read_text()
    assert "agent, settings, learning curve and evaluation are in" in log.read_text()
