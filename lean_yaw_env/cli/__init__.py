"""The command ``lean-yaw``: it parses, calls the package and prints."""

from __future__ import annotations

import sys

from lean_yaw_env.extras import MissingLibraryError, needs_extra

__all__ = ["main"]


def main() -> None:
    """Entry point of ``lean-yaw``; needs the libraries of ``lean-yaw-env[analysis]``."""
    try:
        with needs_extra("analysis"):
            from lean_yaw_env.cli.app import app
    except MissingLibraryError as error:
        sys.exit(f"lean-yaw: {error}")
    app()
