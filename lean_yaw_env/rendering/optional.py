"""Libraries that only drawing needs, with a word on how to install them."""

from __future__ import annotations

import importlib
from typing import Any

from gymnasium.error import DependencyNotInstalled


def require_pygame() -> Any:
    """Import pygame, or raise ``DependencyNotInstalled``."""
    return _require("pygame", "pygame")


def require_matplotlib() -> Any:
    """Import matplotlib, or raise ``DependencyNotInstalled``."""
    return _require("matplotlib", "matplotlib")


def require_ffmpeg() -> Any:
    """Import imageio_ffmpeg, or raise ``DependencyNotInstalled``."""
    return _require("imageio_ffmpeg", "imageio-ffmpeg, which writes .mp4 files,")


def require_pillow() -> Any:
    """Import PIL.Image, or raise ``DependencyNotInstalled``."""
    return _require("PIL.Image", "pillow, which writes .gif files,")


def require_tqdm() -> Any:
    """Import tqdm, or raise ``DependencyNotInstalled``."""
    return _require("tqdm", "tqdm, which shows progress,")


def _require(module: str, name: str) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise DependencyNotInstalled(
            f"{name} is not installed, run `pip install 'lean-yaw-env[render]'`"
        ) from error
