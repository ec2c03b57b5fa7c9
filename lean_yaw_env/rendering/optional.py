"""Libraries that only drawing needs, with a word on how to install them."""

from __future__ import annotations

import importlib
from typing import Any

from gymnasium.error import DependencyNotInstalled


def require_pygame() -> Any:
    """Import pygame, or raise ``DependencyNotInstalled``."""
    return _require("pygame", "pygame", "'lean-yaw-env[render]'")


def require_matplotlib() -> Any:
    """Import matplotlib, or raise ``DependencyNotInstalled``."""
    return _require("matplotlib", "matplotlib", "matplotlib")


def require_ffmpeg() -> Any:
    """Import imageio_ffmpeg, or raise ``DependencyNotInstalled``."""
    return _require("imageio_ffmpeg", "imageio-ffmpeg, which writes .mp4 files,", "imageio-ffmpeg")


def require_pillow() -> Any:
    """Import PIL.Image, or raise ``DependencyNotInstalled``."""
    return _require("PIL.Image", "pillow, which writes .gif files,", "pillow")


def _require(module: str, name: str, package: str) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise DependencyNotInstalled(
            f"{name} is not installed, run `pip install {package}`"
        ) from error
