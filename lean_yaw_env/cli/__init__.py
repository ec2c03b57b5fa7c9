"""The command ``lean-yaw``: it parses, calls the package and prints."""

from __future__ import annotations

from lean_yaw_env.extras import needs_extra
from lean_yaw_env.reporting import reporting

__all__ = ["main"]


def main() -> None:
    """Entry point of ``lean-yaw``; needs the libraries of ``lean-yaw-env[analysis]``."""
    with reporting("lean-yaw"):
        with needs_extra("analysis"):
            from lean_yaw_env.cli.app import app
        app()
