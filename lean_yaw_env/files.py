"""Files that are written whole or not at all, JSON that every reader takes, and folders that one process works in at a time."""

from __future__ import annotations

import contextlib
import json
import math
import os
import platform
import secrets
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from lean_yaw_env.errors import LeanYawError

if os.name == "nt":
    import msvcrt
else:
    import fcntl

_PREFIX = ".partial-"
_LOCK = ".lock"
_LOCKED_BYTE = 2**30  # beyond the holder's id, which other processes read
_LONGEST_WRITE = 86_400.0  # seconds; after that a partial file of another machine is a leftover
_MOST_JSON = 2**26  # bytes
_INFINITIES = {"inf": math.inf, "-inf": -math.inf}


def require_path(path: Any, name: str = "path") -> Path:
    """Return the path of a file or folder, which need not exist, or raise ``ValueError``."""
    if not isinstance(path, (str, os.PathLike)) or not os.fspath(path):
        raise ValueError(f"{name} must be the path of a file or folder, got {path!r}")
    return Path(path)


def require_ending(path: str | os.PathLike[str], endings: tuple[str, ...]) -> Path:
    """Return ``path`` if it ends as asked and its folder exists, or raise ``ValueError``."""
    place = require_path(path)
    if place.suffix.lower() not in endings:
        raise ValueError(f"path must end with one of {', '.join(endings)}, got {str(place)!r}")
    if not place.parent.is_dir():
        raise ValueError(f"path must be in a folder that exists, got {str(place)!r}")
    return place


@contextlib.contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """A temporary file beside ``path`` that takes its place when the block ends well; its mode follows the process's umask.

    What processes that were killed left in that folder while they wrote such files is removed first.
    """
    temporary = _temporary(path.parent, path.suffix)
    temporary.touch(exist_ok=False)
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def scratch(folder: Path) -> Iterator[Path]:
    """A temporary folder in ``folder``, for what is to be moved when it is complete; removed at the end of the block, or by the next process if this one is killed."""
    require_writable(folder)
    temporary = _temporary(folder)
    temporary.mkdir()
    try:
        yield temporary
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def require_writable(folder: Path) -> None:
    """Make a folder if there is none, and raise ``OSError`` unless files can be written there: to be called before long work, not after it."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass


def _temporary(folder: Path, ending: str = "") -> Path:
    """A new name in a folder, from which leftovers of processes that no longer run are removed."""
    _remove_leftovers(folder)
    return folder / f"{_PREFIX}{os.getpid()}-{secrets.token_hex(4)}-{platform.node()}{ending}"


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all; line ends are written as they are."""
    with written_whole(path) as temporary:
        temporary.write_bytes(text.encode("utf-8"))


def write_json(path: Path, value: Any, *, indent: int | None = 2) -> None:
    """Write a value as ``json_text`` has it."""
    write_text(path, json_text(value, indent=indent))


def json_text(value: Any, *, indent: int | None = 2) -> str:
    """A value as JSON that every reader of JSON takes, in one line without ``indent``; infinite numbers become the strings "inf" and "-inf"."""
    return json.dumps(_plain(value), indent=indent, allow_nan=False) + "\n"


def read_json(path: Path) -> Any:
    """Read JSON as ``write_json`` writes it, or raise ``ValueError`` naming the file."""
    try:
        return _unplain(json.loads(read_regular(path, _MOST_JSON).decode("utf-8")))
    except FileNotFoundError as error:
        raise ValueError(f"there is no file {str(path)!r}") from error
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise ValueError(f"{str(path)!r} is not JSON: {error}") from error


def read_regular(path: Path, most: int) -> bytes:
    """Read a regular file of at most ``most`` bytes.

    Raises
    ------
    OSError
        If the file cannot be read, or is larger, or is a folder, a pipe or a device: opening one of these can wait for ever.
    """
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        raise OSError(f"{str(path)!r} is not a regular file")
    if status.st_size > most:
        raise OSError(f"{str(path)!r} has {status.st_size:,} bytes, and at most {most:,} are read")
    with path.open("rb") as file:
        return file.read(most)


class BusyError(LeanYawError):
    """A folder or file that another process works in; the message names the process."""


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep other processes out of a folder that exists while the block runs; the lock ends with its process, however that ends.

    Raises
    ------
    BusyError
        If another process is in it.
    """
    place = folder / _LOCK
    while True:
        file = place.open("a+")
        if not _try_lock(file.fileno()):
            with file:
                file.seek(0)
                holder = file.read(20) or "unknown"
            raise BusyError(
                f"process {holder} is at work in {str(folder)!r}; wait for it or end it"
            )
        # a holder removes the file when it has finished: then this lock is on a file that is gone
        with contextlib.suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(file.fileno()), place.stat()):
                break
        file.close()
    with file:
        file.truncate(0)
        file.write(str(os.getpid()))
        file.flush()
        try:
            yield
        finally:
            with contextlib.suppress(OSError):  # Windows removes no open file
                place.unlink()


def _try_lock(descriptor: int) -> bool:
    """Lock an open file if no other process has; the lock ends when the file is closed."""
    try:
        if os.name == "nt":
            os.lseek(descriptor, _LOCKED_BYTE, os.SEEK_SET)
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    return True


def _remove_leftovers(folder: Path) -> None:
    """Remove partial files whose writers no longer run; those of other machines when they are older than any write takes."""
    for left in folder.glob(f"{_PREFIX}*"):
        writer, _, rest = left.name.removeprefix(_PREFIX).partition("-")
        is_own = platform.node() in rest
        with contextlib.suppress(OSError):
            is_old = time.time() - left.stat().st_mtime > _LONGEST_WRITE
            is_written = writer.isdigit() and is_running(int(writer)) if is_own else not is_old
            if not is_written:
                shutil.rmtree(left) if left.is_dir() else left.unlink()


def is_running(process: int) -> bool:
    """Whether a process of this machine runs, by its id."""
    if os.name == "nt":  # where signal 0 is no question but Ctrl-C
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # another user's
        return True
    return True


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float) and math.isinf(value):
        return "inf" if value > 0.0 else "-inf"
    return value


def _unplain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _unplain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_unplain(item) for item in value]
    return _INFINITIES.get(value, value) if isinstance(value, str) else value
