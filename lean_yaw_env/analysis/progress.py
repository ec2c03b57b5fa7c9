"""Progress bars for long work, where tqdm is installed; silent otherwise."""

from __future__ import annotations

from types import TracebackType
from typing import Any


class Counter:
    """A context manager that counts work done, with or without a known total.

    Parameters
    ----------
    name : str
    shown : bool
        Whether to draw anything.
    total : int, optional
    """

    def __init__(self, name: str, shown: bool, total: int | None = None) -> None:
        self._bar: Any = None
        if shown:
            try:
                from tqdm.auto import tqdm
            except ImportError:
                return  # an optional dependency; the work itself does not need it
            self._bar = tqdm(desc=name, total=total)

    def advance(self, amount: int = 1) -> None:
        """Count further work done."""
        if self._bar is not None:
            self._bar.update(amount)

    def __enter__(self) -> Counter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.close()
