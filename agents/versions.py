"""Versions of the packages that a result depends on."""

from __future__ import annotations

import importlib.metadata
import platform

import lean_yaw_env

_PACKAGES = ("numpy", "scipy", "numba", "gymnasium", "torch", "stable-baselines3")


def package_versions() -> dict[str, str]:
    """Package names and their versions; those that are not installed are left out."""
    found = {"python": platform.python_version(), "lean-yaw-env": lean_yaw_env.__version__}
    for name in _PACKAGES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found
