"""The web page on which the walkers walk, as it ships with the package, and its server on this machine."""

from __future__ import annotations

from lean_yaw_env.viewer.server import PAGE, PageServer, view

__all__ = ["PAGE", "PageServer", "view"]
