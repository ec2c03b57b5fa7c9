"""The command ``lean-yaw``: it parses, calls the package and prints."""

from lean_yaw_env.cli.app import app, main

__all__ = ["app", "main"]
