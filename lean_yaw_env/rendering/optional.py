"""Libraries that only some parts of the package need, with a word on how to install them."""

from __future__ import annotations

import importlib
from typing import Any

from gymnasium.error import DependencyNotInstalled


def require_pygame() -> Any:
    """Import pygame, or raise ``DependencyNotInstalled``."""
    return require_module("pygame", "pygame")


def require_matplotlib() -> Any:
    """Import matplotlib, or raise ``DependencyNotInstalled``."""
    return require_module("matplotlib", "matplotlib")


def require_ffmpeg() -> Any:
    """Import imageio_ffmpeg, or raise ``DependencyNotInstalled``."""
    return require_module("imageio_ffmpeg", "imageio-ffmpeg, which writes .mp4 files,")


def require_pillow() -> Any:
    """Import PIL.Image, or raise ``DependencyNotInstalled``."""
    return require_module("PIL.Image", "pillow, which writes .gif files,")


def require_tqdm() -> Any:
    """Import tqdm, or raise ``DependencyNotInstalled``."""
    return require_module("tqdm", "tqdm, which shows progress,")


def require_module(module: str, name: str, extra: str = "render") -> Any:
    """Import a module, or raise ``DependencyNotInstalled`` that says which extra of the package to install."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise DependencyNotInstalled(
            f"{name} is not installed, run `pip install 'lean-yaw-env[{extra}]'`"
        ) from error
