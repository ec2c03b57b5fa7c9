"""Share a batch out to threads: compiled loops release the interpreter's lock, so that threads use several cores."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from itertools import pairwise
from typing import TypeVar

Result = TypeVar("Result")

MOST_THREADS = 1024
# Below this many walkers a thread costs more than it takes over.
SMALLEST_SHARE = 256
# How many walkers are stepped while a helper wakes up and reports back, some 50 us: the caller's share is larger by so many.
_HEAD_START = 128


@lru_cache(maxsize=16)
def _pool(helpers: int, process: int) -> ThreadPoolExecutor:
    """The helpers of a process: kept, as starting threads takes as long as stepping hundreds of walkers; a fork has none of its parent's."""
    return ThreadPoolExecutor(helpers, thread_name_prefix=f"lean_yaw_env-{process}")


def share_out(work: Callable[[int, int], Result], n: int, threads: int) -> list[Result]:
    """Call ``work(first, last)`` on contiguous shares of ``range(n)``, at most ``threads`` of them at a time, and return its results.

    The calling thread takes a share too, so that one thread means a plain call. No share is smaller than ``SMALLEST_SHARE``, unless all is.
    """
    shares = min(threads, max(1, (n - _HEAD_START) // SMALLEST_SHARE))
    if shares == 1:
        return [work(0, n)]
    each = (n - _HEAD_START) // shares
    bounds = [0, *(n - each * helper for helper in range(shares - 1, -1, -1))]
    pool = _pool(threads - 1, os.getpid())
    others = [pool.submit(work, *ends) for ends in pairwise(bounds[1:])]
    try:
        own = work(0, bounds[1])
    finally:
        for other in others:
            other.exception()  # waits: no share may run on when the arrays are handed back
    return [own, *(other.result() for other in others)]
