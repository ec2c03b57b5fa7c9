"""The web page on which the walkers walk, as it ships with the package, its server on this machine, and the page in a notebook."""

from __future__ import annotations

from lean_yaw_env.viewer.notebook import PageDisplay
from lean_yaw_env.viewer.server import PAGE, PageServer, view, write_page

__all__ = ["PAGE", "PageDisplay", "PageServer", "view", "write_page"]
