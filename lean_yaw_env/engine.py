"""Where independent tasks run: threads of this process, worker processes of this machine, or a cluster; on the last two by Dask."""

from __future__ import annotations

import contextlib
import logging
import platform
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from importlib import metadata
from typing import Any, TypeAlias
from uuid import uuid4

from lean_yaw_env.errors import ClusterError
from lean_yaw_env.extras import needs_extra
from lean_yaw_env.reporting import uninterrupted
from lean_yaw_env.threads import MOST_THREADS
from lean_yaw_env.validation import require_count, require_text

Task: TypeAlias = "tuple[Any, ...]"
Run: TypeAlias = "Callable[[Callable[..., Any], Any, Sequence[Task]], Iterator[tuple[int, Any]]]"
"""``run(function, shared, tasks)`` calls ``function(shared, *task)`` for every task and yields the tasks' places with the results, as they end."""

_PATIENCE = 5.0
"""Seconds to wait for a scheduler's answer."""
_SAME = ("lean-yaw-env", "numba", "numpy", "scipy")
"""Packages that must have the same version everywhere, as the results depend on them."""


@dataclass(frozen=True)
class Engine:
    """Where the tasks of a map, a table or a series of trainings run. Results do not depend on it, to the last bit.

    Parameters
    ----------
    threads : int >= 1
        Of this process, where neither ``workers`` nor ``scheduler`` is given. The compiled loops release the interpreter's lock.
    workers : int >= 1, optional
        Processes on this machine, started for the work and ended with it. A script that asks for them needs ``if __name__ == "__main__":``.
    scheduler : str, optional
        Address of a Dask scheduler, such as "tcp://host:8786", whose workers have the same version of this package.

    Raises
    ------
    ValueError
        If a value is outside its range, or both ``workers`` and ``scheduler`` are given.
    """

    threads: int = 1
    workers: int | None = None
    scheduler: str | None = None

    def __post_init__(self) -> None:
        require_count("threads", self.threads, 1, MOST_THREADS)
        if self.workers is not None:
            require_count("workers", self.workers, 1, MOST_THREADS)
        if self.scheduler is not None:
            if "://" not in require_text("scheduler", self.scheduler):
                raise ValueError(f"scheduler must be an address such as tcp://host:8786, got {self.scheduler!r}")  # fmt: skip
            if self.workers is not None:
                raise ValueError("give workers or scheduler, not both: a scheduler has its own")

    @property
    def is_local(self) -> bool:
        """Whether tasks run in this process and see its memory."""
        return self.workers is None and self.scheduler is None

    @contextlib.contextmanager
    def started(self, *, says_where: bool = False) -> Iterator[Run]:
        """Start what is needed for the block, and give it a ``Run``.

        The first error of a task ends the work: tasks that have not begun are dropped. ``says_where`` prints the address of Dask's dashboard.

        Raises
        ------
        ClusterError
            If the scheduler cannot be reached or is lost, or a worker runs other versions than this process, or dies of a task.
        """
        if self.is_local:
            yield self._in_threads
            return
        with needs_extra("analysis"):
            import distributed
        with contextlib.ExitStack() as stack:
            client = stack.enter_context(self._client(distributed))
            if says_where:
                print(f"dashboard: {client.dashboard_link}", file=sys.stderr)
            yield _OnCluster(client, distributed)

    def _in_threads(
        self, function: Callable[..., Any], shared: Any, tasks: Sequence[Task]
    ) -> Iterator[tuple[int, Any]]:
        if self.threads == 1 or len(tasks) == 1:
            yield from ((place, function(shared, *task)) for place, task in enumerate(tasks))
            return
        pool = ThreadPoolExecutor(self.threads)
        places = {pool.submit(function, shared, *task): k for k, task in enumerate(tasks)}
        try:
            for future in as_completed(places):
                yield places[future], future.result()
        finally:
            pool.shutdown(cancel_futures=True)

    def _client(self, distributed: Any) -> Any:
        if self.workers is not None:
            # a worker that Ctrl-C ends is gone before Dask asks how it ended: Dask would warn of this after our last line
            logging.getLogger("distributed.process").setLevel(logging.ERROR)
            with uninterrupted():  # workers, and those that take their places
                return distributed.Client(
                    n_workers=self.workers, threads_per_worker=1, memory_limit=0, dashboard_address=":0"
                )  # fmt: skip
        try:
            return distributed.Client(self.scheduler, timeout=_PATIENCE)
        except (OSError, ValueError, TypeError) as error:
            raise ClusterError(
                f"the scheduler {self.scheduler} did not answer within {_PATIENCE:g} s: start one with `dask scheduler`, "
                "or see whether its address is right and its port open"
            ) from error


ONE_THREAD = Engine()
"""What runs where nothing else is asked for."""


class _OnCluster:
    """A ``Run`` on the workers of a Dask client."""

    def __init__(self, client: Any, distributed: Any) -> None:
        self._client, self._distributed = client, distributed

    def __call__(
        self, function: Callable[..., Any], shared: Any, tasks: Sequence[Task]
    ) -> Iterator[tuple[int, Any]]:
        client, address, name = self._client, self._client.scheduler.address, f"lean-yaw-{uuid4()}"
        errors = self._distributed.client
        # computed, not scattered: Dask computes it again where the worker that held it has died. Its name has another beginning than the tasks':
        # of one beginning, Dask keeps all tasks on the worker that holds it
        held = client.submit(_same, shared, key=f"shared-by-{name}")
        futures = [
            client.submit(_call, _versions(), function, held, *task, key=f"{name}-{k}")
            for k, task in enumerate(tasks)
        ]
        places = {future.key: place for place, future in enumerate(futures)}
        try:
            for future in self._distributed.as_completed(futures):
                yield places[future.key], future.result()
        except self._distributed.KilledWorker as error:
            raise ClusterError(
                f"workers of {address} died of one task again and again, the last one {error.last_worker.address}: "
                "most often they lack memory"
            ) from error
        except (errors.FutureCancelledError, self._distributed.comm.CommClosedError) as error:
            raise ClusterError(f"the scheduler {address} was lost") from error
        finally:
            if client.status == "running":
                client.cancel(futures)


def _same(value: Any) -> Any:
    return value


def _versions() -> dict[str, str]:
    """Versions on which results depend."""
    return {"Python": platform.python_version(), **{name: metadata.version(name) for name in _SAME}}


def _call(versions: dict[str, str], function: Callable[..., Any], shared: Any, *task: Any) -> Any:
    """Run one task on a worker; its errors name the worker."""
    from distributed import get_worker

    where = f"the worker {get_worker().address}"
    for name, here in _versions().items():
        if here != versions[name]:
            raise ClusterError(f"{where} has {name} {here}, and the client {versions[name]}")
    try:
        return function(shared, *task)
    except OSError as error:
        raise ClusterError(f"{where} failed: {error}") from error
