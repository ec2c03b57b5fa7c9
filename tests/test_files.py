"""Files written whole or not at all."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from lean_yaw_env.files import (
    BusyError,
    locked,
    read_json,
    read_regular,
    require_ending,
    require_writable,
    scratch,
    write_text,
    written_whole,
)


@pytest.mark.skipif(os.name == "nt", reason="POSIX modes")
@pytest.mark.parametrize(("mask", "mode"), [(0o022, 0o644), (0o077, 0o600), (0o002, 0o664)])
def test_a_new_file_has_the_mode_that_the_umask_gives(tmp_path: Path, mask: int, mode: int) -> None:
    before = os.umask(mask)
    try:
        write_text(tmp_path / "new.txt", "words")
    finally:
        os.umask(before)
    assert (tmp_path / "new.txt").stat().st_mode & 0o777 == mode


def test_text_is_written_as_it_is(tmp_path: Path) -> None:
    write_text(tmp_path / "new.txt", "é\r\nn\n")
    assert (tmp_path / "new.txt").read_bytes() == b"\xc3\xa9\r\nn\n"
    assert [file.name for file in tmp_path.iterdir()] == ["new.txt"]


def test_an_error_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "kept.txt"
    write_text(path, "old")

    def fail_half_way() -> None:
        with written_whole(path) as temporary:
            temporary.write_text("new")
            raise RuntimeError("half way")

    with pytest.raises(RuntimeError, match="half way"):
        fail_half_way()
    assert path.read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["kept.txt"]


def test_the_file_is_unchanged_until_the_block_ends(tmp_path: Path) -> None:
    path = tmp_path / "kept.txt"
    write_text(path, "old")
    with written_whole(path) as temporary:
        temporary.write_text("new")
        assert path.read_text() == "old"
        assert temporary.suffix == ".txt"  # by which writers of pictures know the format
    assert path.read_text() == "new"


def test_what_a_killed_process_left_is_removed_by_the_next_write(tmp_path: Path) -> None:
    path, other = tmp_path / "kept.txt", tmp_path / "other.txt"
    killed = (
        "import os, signal, sys\n"
        "from pathlib import Path\n"
        "from lean_yaw_env.files import written_whole\n"
        "with written_whole(Path(sys.argv[1])) as temporary:\n"
        "    temporary.write_text('half')\n"
        "    os._exit(1)\n"
    )
    subprocess.run([sys.executable, "-c", killed, str(other)], check=False)
    assert len(list(tmp_path.iterdir())) == 1
    write_text(path, "whole")  # removes what is left of the other file too
    assert [file.name for file in tmp_path.iterdir()] == ["kept.txt"]


def test_a_partial_file_of_another_machine_is_removed_after_a_day_only(tmp_path: Path) -> None:
    left = tmp_path / ".partial-1-00000000-another.txt"
    left.write_text("half")
    write_text(tmp_path / "new.txt", "")
    assert left.exists()
    os.utime(left, (0.0, 0.0))
    write_text(tmp_path / "new.txt", "")
    assert not left.exists()


HOLD = """
import sys, time
from pathlib import Path
from lean_yaw_env.files import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60.0)
"""


def test_a_second_process_is_refused_by_the_first_one_s_id_until_the_first_is_killed(
    tmp_path: Path,
) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE
    ) as holder:
        assert holder.stdout is not None and holder.stdout.readline()
        with (
            pytest.raises(BusyError, match=f"process {holder.pid} is at work in"),
            locked(tmp_path),
        ):
            pass
        holder.kill()
    with locked(tmp_path):
        pass
    with locked(tmp_path):
        pass
    assert not list(tmp_path.iterdir())


def test_only_regular_files_of_moderate_size_are_read(tmp_path: Path) -> None:
    path = tmp_path / "file.json"
    path.write_text("[1]")
    assert read_json(path) == [1]
    with pytest.raises(OSError, match="has 3 bytes, and at most 2 are read"):
        read_regular(path, 2)
    for other in (tmp_path, Path("/dev/zero"), make_pipe(tmp_path / "pipe")):
        if other.exists():
            with pytest.raises(ValueError, match="is not a regular file"):
                read_json(other)


def make_pipe(path: Path) -> Path:
    if hasattr(os, "mkfifo"):
        os.mkfifo(path)
    return path


def test_a_write_leaves_the_unfinished_one_of_a_running_process_alone(tmp_path: Path) -> None:
    path = tmp_path / "kept.txt"
    with written_whole(path) as first:
        first.write_text("first")
        write_text(path, "second")
        assert first.read_text() == "first"
    assert path.read_text() == "first"


@pytest.mark.parametrize("name", ["folder/picture.txt", "picture", "missing/picture.png"])
def test_a_path_that_cannot_be_written_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(ValueError, match="path must"):
        require_ending(tmp_path / name, (".png",))
    assert require_ending(tmp_path / "picture.PNG", (".png",)).name == "picture.PNG"


def test_a_scratch_folder_is_removed_at_the_end_and_by_the_next_process_if_its_own_is_killed(
    tmp_path: Path,
) -> None:
    with scratch(tmp_path / "new") as folder:
        (folder / "part").write_text("half")
        (folder / "whole").mkdir()
        (folder / "whole").rename(tmp_path / "new" / "whole")
    assert [each.name for each in (tmp_path / "new").iterdir()] == ["whole"]
    code = (
        "import os; from pathlib import Path; from lean_yaw_env.files import scratch\n"
        f"with scratch(Path({str(tmp_path)!r})) as folder:\n"
        "    (folder / 'part').write_text('half')\n"
        "    os._exit(9)\n"
    )
    assert subprocess.run([sys.executable, "-c", code]).returncode == 9
    assert len(list(tmp_path.glob(".partial-*"))) == 1
    with scratch(tmp_path) as folder:
        assert list(tmp_path.glob(".partial-*")) == [folder]
    assert not list(tmp_path.glob(".partial-*"))


def test_a_place_where_nothing_can_be_written_is_named_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for place in (tmp_path / "file", tmp_path / "file" / "folder"):
        with pytest.raises(OSError, match="file"):
            require_writable(place)
    require_writable(tmp_path / "new" / "folder")
    assert not list((tmp_path / "new" / "folder").iterdir())
