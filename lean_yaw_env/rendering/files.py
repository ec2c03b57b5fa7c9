"""Files that are written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path


def require_ending(path: str | os.PathLike[str], endings: tuple[str, ...]) -> Path:
    """Return ``path`` if it ends as asked and its folder exists, or raise ``ValueError``."""
    place = Path(path)
    if place.suffix.lower() not in endings:
        raise ValueError(f"path must end with one of {', '.join(endings)}, not {str(place)!r}")
    if not place.parent.is_dir():
        raise ValueError(f"path must be in a folder that exists, not {str(place)!r}")
    return place


@contextlib.contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """A temporary file beside ``path`` that takes its place when the block ends well."""
    handle, name = tempfile.mkstemp(suffix=path.suffix, prefix=f".{path.stem}-", dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)  # mkstemp's files are for their owner alone
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
