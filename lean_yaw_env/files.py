"""Files that are written whole or not at all, and JSON that every reader takes."""

from __future__ import annotations

import contextlib
import glob
import json
import math
import os
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import Any

_PREFIX = ".partial-"
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

    What an earlier process left of the same file when it was killed is removed first.
    """
    remove_partial(path)
    name = f"{_PREFIX}{os.getpid()}-{path.stem}-{secrets.token_hex(4)}{path.suffix}"
    temporary = path.parent / name
    temporary.touch(exist_ok=False)
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all; line ends are written as they are."""
    with written_whole(path) as temporary:
        temporary.write_bytes(text.encode("utf-8"))


def write_json(path: Path, value: Any) -> None:
    """Write a value as JSON that every reader of JSON takes; infinite numbers become the strings "inf" and "-inf"."""
    write_text(path, json.dumps(_plain(value), indent=2, allow_nan=False) + "\n")


def read_json(path: Path) -> Any:
    """Read JSON as ``write_json`` writes it, or raise ``ValueError`` naming the file."""
    try:
        return _unplain(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError as error:
        raise ValueError(f"there is no file {str(path)!r}") from error
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise ValueError(f"{str(path)!r} is not JSON: {error}") from error


def remove_partial(path: Path) -> None:
    """Remove what processes that no longer run left of ``path`` while they wrote it."""
    for left in path.parent.glob(f"{_PREFIX}*-{glob.escape(path.stem)}-*{path.suffix}"):
        writer = left.name.removeprefix(_PREFIX).split("-", 1)[0]
        if not (writer.isdigit() and is_running(int(writer))):
            left.unlink(missing_ok=True)


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
