"""Libraries that only some parts of the package need: where one is missing, an error says which extra installs it."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from gymnasium.error import DependencyNotInstalled

from lean_yaw_env.validation import require_choice

DEVICES = ("cpu", "cuda")
"""Where walkers step; "cuda" needs a GPU and the extra ``gpu``."""


def is_gpu(device: str) -> bool:
    """Whether a device is the GPU; ``ValueError`` if there is no such device."""
    return require_choice("device", device, DEVICES) == "cuda"


class MissingLibraryError(DependencyNotInstalled, ImportError):
    """A library of one of the package's extras is not installed."""


@contextlib.contextmanager
def needs_extra(extra: str) -> Iterator[None]:
    """Import libraries of an extra, such as "render", or raise ``MissingLibraryError`` saying how to install them."""
    try:
        yield
    except ModuleNotFoundError as error:
        library = (error.name or "").split(".")[0]
        if library in ("", "lean_yaw_env", "agents"):
            raise
        raise MissingLibraryError(
            f"{library} is not installed, run `pip install 'lean-yaw-env[{extra}]'`"
        ) from error
