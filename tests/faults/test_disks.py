"""A full disk, a folder that may not be written and a file where a folder should be: one clear line, and what was there before still is."""

from __future__ import annotations

import os
import resource
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.faults.processes import run_command, start

pytestmark = pytest.mark.skipif(os.name == "nt", reason="POSIX files")

COMMANDS = {
    "train": ["train.py", "--task", "Walk", "--steps", "16384", "--episodes", "2", "--out", "OUT"],
    "series": ["train.py", "--task", "Walk", "--steps", "16384", "--episodes", "2", "--seeds", "1", "--out", "OUT"],
    "tune": ["agents", "tune", "feedback", "Heading", "--trials", "2", "--episodes", "1", "--storage", "OUT/study.db"],
    "evaluate": ["agents", "evaluate", "--task", "Walk", "--agents", "fixed", "--episodes", "600", "--processes", "1", "--cache", "OUT"],
    "leaderboard": ["agents", "evaluate", "--task", "Walk", "--agents", "fixed", "--episodes", "4", "--processes", "1", "--out", "OUT"],
    "pictures": ["agents", "evaluate", "--task", "Walk", "--agents", "fixed", "--pictures", "OUT"],
    "film": ["agents", "film", "--task", "Walk", "--agent", "fixed", "--seconds", "0.5", "--out", "OUT"],
    "closed-loop": ["agents", "closed-loop", "--agents", "lqr", "--points", "5", "--starts", "16", "--directions", "4", "--out", "OUT"],
    "map": ["lean-yaw", "map", "slope=0.005:0.05:300", "--out", "OUT/map.nc"],
    "basin": ["lean-yaw", "basin", "ankle_angle=-0.1:0.1:30", "heading=-0.5:0.5:30", "--out", "OUT/basin.nc"],
    "reproduce": ["lean-yaw", "reproduce", "figure4", "--out", "OUT"],
}  # fmt: skip
SIZE = 16_384  # bytes of the small disk: room for names and beginnings, not for results


def limited_command(command: list[str]) -> None:
    """A command whose files may not grow beyond a few kilobytes, as on a full disk; its messages are shorter."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (4000, 4000))
    run_command(command)


def outcome(
    name: str, out: Path, log: Path, run: Callable[[list[str]], None] = run_command
) -> tuple[int | None, str]:
    """The exit status of a command that writes to ``out``, and all that it said."""
    process = start(run, [word.replace("OUT", str(out)) for word in COMMANDS[name]], log=log)
    process.join(300.0)
    return process.exitcode, log.read_text()


def is_one_clear_line(status: int | None, said: str) -> bool:
    last = said.strip().splitlines()[-1]
    programs = ("train: ", "tune: ", "evaluate: ", "film: ", "closed-loop: ", "lean-yaw: ")
    return status in (1, 2) and "Traceback" not in said and last.startswith(programs)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of a few kilobytes."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={SIZE}", "tmpfs", str(place)]
    try:
        subprocess.run(mount, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("this machine lets us mount no small disk")
    yield place
    subprocess.run(["umount", str(place)], check=True)


@pytest.mark.parametrize("name", COMMANDS)
def test_a_file_where_a_folder_should_be_is_named_and_stays(tmp_path: Path, name: str) -> None:
    out = tmp_path / "out"
    out.write_text("precious")
    status, said = outcome(name, out, tmp_path / "log")
    assert is_one_clear_line(status, said), (status, said)
    assert str(out) in said
    assert out.read_text() == "precious"


@pytest.mark.parametrize("name", COMMANDS)
def test_files_that_cannot_grow_end_a_command_with_one_line(tmp_path: Path, name: str) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "kept.txt").write_text("precious")
    status, said = outcome(name, out, tmp_path / "log", limited_command)
    assert is_one_clear_line(status, said), (status, said)
    assert (out / "kept.txt").read_text() == "precious"
    assert not list(out.rglob(".partial-*"))


@pytest.mark.parametrize("name", ["train", "tune", "evaluate", "map"])
def test_a_full_disk_ends_a_command_with_one_line_and_leaves_what_was_there(
    small_disk: Path, tmp_path: Path, name: str
) -> None:
    (small_disk / "kept.txt").write_text("precious")
    status, said = outcome(name, small_disk, tmp_path / "log")
    assert is_one_clear_line(status, said), (status, said)
    assert (small_disk / "kept.txt").read_text() == "precious"


@pytest.mark.parametrize("name", ["train", "tune", "evaluate", "map", "reproduce"])
def test_a_folder_that_may_not_be_written_is_named(
    small_disk: Path, tmp_path: Path, name: str
) -> None:
    (small_disk / "kept.txt").write_text("precious")
    subprocess.run(
        ["mount", "-o", "remount,ro", str(small_disk)], check=True
    )  # root may write any folder
    status, said = outcome(name, small_disk, tmp_path / "log")
    assert is_one_clear_line(status, said), (status, said)
    assert (small_disk / "kept.txt").read_text() == "precious"
