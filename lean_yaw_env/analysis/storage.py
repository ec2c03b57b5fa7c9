"""Labelled arrays on disk: written whole or not at all, in netCDF."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.extras import needs_extra
from lean_yaw_env.files import require_path, written_whole
from lean_yaw_env.parameters import Vector
from lean_yaw_env.validation import require_array, require_flag, require_instance

if TYPE_CHECKING:
    import xarray

_ENGINE = "scipy"  # netCDF 3, which needs nothing that is not installed anyway
SAVED_EVERY = 10.0
"""Seconds between two savings of work under way, so that saving takes a small share of the time however large the result is."""


def labelled() -> Any:
    """The xarray module, or ``MissingLibraryError`` saying how to install it."""
    with needs_extra("analysis"):
        import xarray
    return xarray


def save_dataset(dataset: xarray.Dataset, path: str | Path) -> Path:
    """Write a dataset to a netCDF file, replacing what was there only once it is complete."""
    target = require_path(path)
    require_instance("dataset", dataset, labelled().Dataset)
    target.parent.mkdir(parents=True, exist_ok=True)
    with written_whole(target) as temporary:
        dataset.to_netcdf(temporary, engine=_ENGINE)
    return target


def load_dataset(path: str | Path) -> xarray.Dataset:
    """Read a dataset written by ``save_dataset``.

    Raises
    ------
    ValueError
        If there is no such file, or it is not one of these.
    """
    source = require_path(path)
    if not source.is_file():
        raise ValueError(f"path must be a file, got {str(source)!r}, which is none")
    try:
        return labelled().load_dataset(source, engine=_ENGINE)
    except (OSError, TypeError, ValueError) as error:
        raise ValueError(
            f"path must be a netCDF file of labelled arrays, got {str(source)!r}: {error}"
        ) from error


def require_axis(
    name: str, values: Sequence[float] | Vector, low: float = -math.inf, high: float = math.inf
) -> Vector:
    """One or more growing numbers, each between ``low`` and ``high`` (both excluded), or ``ValueError``."""
    array = require_array(name, values, (None,), low, high)
    if not array.size or np.any(np.diff(array) <= 0.0):
        raise ValueError(f"{name} must be growing numbers, got {values!r}")
    return array


def free_memory() -> float:
    """Bytes of memory that are free; infinity where the system does not say."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            return 1024.0 * next(int(line.split()[1]) for line in file if "MemAvailable" in line)
    except (OSError, StopIteration, ValueError):
        return math.inf


def require_memory(name: str, points: int, each: float) -> None:
    """``ValueError`` unless there is memory for so many points of ``each`` bytes."""
    wanted, free = points * each, free_memory()
    if wanted > free:
        raise ValueError(
            f"{name} must have points that fit into memory, got {points:,}, which take about {wanted / 1e9:,.1f} GB of the {free / 1e9:,.1f} GB "
            "that are free; compute parts of the grid, each with a file of its own"
        )


def progress_bar(name: str, shown: bool, total: int | None = None) -> Any:
    """A bar to ``update`` and ``close``, drawn where that is wanted and tqdm, an optional dependency, is installed."""
    if shown:
        try:
            from tqdm.auto import tqdm

            return tqdm(desc=name, total=total)
        except ImportError:
            pass
    return SimpleNamespace(update=lambda amount=1: None, close=lambda: None)


class Growing:
    """Columns over the points of a grid that grow: counted, saved now and then, and when the work is left, whatever ends it.

    ``columns`` are arrays (n, ...) over all points, in row-major order of the ``axes``; ``dimensions`` names, by column, the dimension beside
    these. ``question`` identifies the columns, as plain values. Where the file exists already, what an earlier run has done is read into the
    columns, or ``ValueError`` raised if it answers another question. ``coords`` and ``attrs`` are the dataset's further ones, ``notes`` the
    attributes of its columns.
    """

    def __init__(
        self,
        name: str,
        axes: Mapping[str, Vector],
        columns: Mapping[str, NDArray[Any]],
        question: Mapping[str, Any],
        path: str | Path | None,
        progress: bool,
        *,
        dimensions: Mapping[str, str] | None = None,
        coords: Mapping[str, Any] | None = None,
        attrs: Mapping[str, str] | None = None,
        notes: Mapping[str, Mapping[str, str]] | None = None,
    ) -> None:
        self._axes, self._columns = dict(axes), columns
        self._path = None if path is None else require_path(path)
        require_flag("progress", progress)
        self._dimensions, self._coords, self._notes = dimensions or {}, coords or {}, notes or {}
        self._attrs = {"question": json.dumps(question, sort_keys=True), **(attrs or {})}
        self._saved = time.monotonic()
        self._read()
        self._bar = progress_bar(name, progress, len(next(iter(columns.values()))))

    def dataset(self) -> xarray.Dataset:
        """The columns as they stand."""
        shape = tuple(axis.size for axis in self._axes.values())
        variables = {
            name: (
                [*self._axes, *([self._dimensions[name]] if name in self._dimensions else [])],
                array.reshape(*shape, *array.shape[1:]),
                self._notes.get(name, {}),
            )
            for name, array in self._columns.items()
        }
        return labelled().Dataset(
            variables, coords={**self._axes, **self._coords}, attrs=self._attrs
        )

    def chunks(self, waiting: NDArray[np.bool_], size: int) -> Iterator[NDArray[np.intp]]:
        """The points (n,) that wait, some at a time; those of a chunk are done when the next one is asked for."""
        points = np.flatnonzero(waiting)
        self._bar.update(waiting.size - points.size)
        for first in range(0, points.size, size):
            chunk = points[first : first + size]
            yield chunk
            self._bar.update(chunk.size)
            self.save_if_due()

    def save_if_due(self) -> None:
        """Save unless that was done a short while ago."""
        if time.monotonic() - self._saved >= SAVED_EVERY:
            self._save()

    def _save(self) -> None:
        if self._path:
            save_dataset(self.dataset(), self._path)
        self._saved = time.monotonic()

    def _read(self) -> None:
        if not self._path or not self._path.exists():
            return
        stored, fresh = load_dataset(self._path), self.dataset()
        if stored.attrs != fresh.attrs or any(
            name not in stored.coords or not stored.coords[name].equals(fresh.coords[name])
            for name in fresh.coords
        ):
            raise ValueError(
                "path must be a new file or one with this question's results, "
                f"got {str(self._path)!r} with those of another question"
            )
        for name, array in self._columns.items():
            array[:] = stored[name].to_numpy().reshape(array.shape)

    def __enter__(self) -> Growing:
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.close()
        self._save()
