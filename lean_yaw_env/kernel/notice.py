"""One line on the terminal when compiling takes long, so that nobody takes a first step for a hang."""

from __future__ import annotations

import sys
import threading
from typing import Any

from numba.core import event

PATIENCE = 1.5
"""Seconds of compiling after which the line is written."""
MESSAGE = (
    "lean_yaw_env: compiling the walker for this machine, some seconds, once; "
    "`python -m lean_yaw_env.compile` does it beforehand"
)


class CompileNotice(event.Listener):
    """Listens to Numba's compiler while it compiles one of the functions that are watched, and writes ``MESSAGE`` once a process.

    It is written where someone looks: to a terminal, or in a notebook.

    Attributes
    ----------
    watched : the functions
    """

    def __init__(self) -> None:
        self.watched: set[Any] = set()
        self._depth = 0
        self._told = False
        self._timer: threading.Timer | None = None

    def watch(self, dispatcher: Any) -> None:
        """Watch a function from now on."""
        if not self.watched:
            event.register("numba:compile", self)
        self.watched.add(dispatcher)

    def on_start(self, event: Any) -> None:
        """A function begins to be compiled; one that it calls may be inside."""
        if self._told or event.data["dispatcher"] not in self.watched:
            return
        self._depth += 1
        if self._depth == 1:
            self._timer = threading.Timer(PATIENCE, self._tell)
            self._timer.daemon = True
            self._timer.start()

    def on_end(self, event: Any) -> None:
        """A function has been compiled."""
        if self._timer is None or event.data["dispatcher"] not in self.watched:
            return
        self._depth -= 1
        if self._depth <= 0:
            self._timer.cancel()
            self._timer, self._depth = None, 0

    def _tell(self) -> None:
        self._told = True
        if sys.stderr.isatty() or "ipykernel" in sys.modules:
            print(MESSAGE, file=sys.stderr)


NOTICE = CompileNotice()
