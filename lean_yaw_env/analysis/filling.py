"""Columns over the points of a grid, filled region by region wherever an ``Engine`` runs, and kept so that an interruption loses little.

A region is a box of the grid and, in row-major order, one run of its points. In a Zarr store it is exactly one shard of every column, so that
no two tasks write the same object. The store's metadata is written first. Then each region is filled by one task, which sets the region's own
record last. So what a task leaves when it dies counts as not done, and is filled again.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Iterator, Mapping, MutableMapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.analysis.storage import (
    labelled,
    load_dataset,
    progress_bar,
    require_memory,
    save_dataset,
)
from lean_yaw_env.engine import Engine
from lean_yaw_env.extras import needs_extra
from lean_yaw_env.files import require_path
from lean_yaw_env.parameters import Vector
from lean_yaw_env.validation import require_flag, require_instance

if TYPE_CHECKING:
    import xarray

Box: TypeAlias = "tuple[slice, ...]"
Columns: TypeAlias = "dict[str, NDArray[Any]]"
"""Columns by their names, one row for each point."""
Arrays: TypeAlias = "MutableMapping[str, Any]"
"""Columns by their names, shaped like the grid: numpy's or Zarr's arrays."""

PASSES, DONE = _RECORD = ("record/passes", "record/regions")
"""Arrays beside the columns: at each point the pass that found something there, or -1; of each region how many passes are done, and what the last one found."""

_FEWEST = 2048
"""Points of a region where the grid has no more than a few: what takes some tenths of a second."""
_SHARE = 16
"""Regions of a grid that is not large: enough to keep several cores busy."""
_CHUNKS, _LEAST_CHUNK = 16, 4096
"""Chunks of a shard, each of which is read at once, and the fewest points of one."""
SAVED_EVERY = 10.0
"""Seconds between two savings of a netCDF file under way."""
_COPIES = 3.0
"""A point's memory is its columns, and copies of them while they are written."""


@dataclass(frozen=True)
class Layout:
    """What is filled: ``columns`` hold one row, of a point at which nothing is done yet; ``question`` identifies the result, as plain values.

    ``dimensions`` names, by column, the dimension beside the ``axes``; ``coords`` and ``attrs`` are the dataset's further ones, ``notes`` the
    attributes of its columns. A region has ``most`` points or fewer. Only what ``is_threadsafe`` may run in several threads.
    """

    name: str
    axes: Mapping[str, Vector]
    columns: Columns
    question: Mapping[str, Any]
    most: int = 2**17
    dimensions: Mapping[str, str] = field(default_factory=dict)
    coords: Mapping[str, Any] = field(default_factory=dict)
    attrs: Mapping[str, str] = field(default_factory=dict)
    notes: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    is_threadsafe: bool = True

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(len(axis) for axis in self.axes.values())

    @property
    def n(self) -> int:
        return prod(self.shape)

    @property
    def region_shape(self) -> tuple[int, ...]:
        """Of all regions but those at an end. It depends on the grid alone, so that results do too."""
        wanted = min(self.most, max(self.n // _SHARE, _FEWEST))
        shape: list[int] = []
        for size in reversed(self.shape):
            step = max(1, min(size, wanted))
            part = self._part(step, wanted)
            shape.append(step if step == size else part * (step // part))
            wanted = wanted // size
        return tuple(reversed(shape))

    @property
    def shard_and_chunk(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """A region's shape, and that of the parts of it that are read at once: some of its first axis that has more than one point."""
        shard = self.region_shape
        first = next((k for k, step in enumerate(shard) if step > 1), 0)
        part = self._part(shard[first], prod(shard))
        whole = part * -(-shard[first] // part)
        return tuple((*shard[:first], size, *shard[first + 1 :]) for size in (whole, part))  # type: ignore[return-value]

    @staticmethod
    def _part(step: int, points: int) -> int:
        """How much of an axis is read at once, of a region with so many steps along it."""
        return -(-step // max(1, min(_CHUNKS, points // _LEAST_CHUNK)))

    @property
    def regions(self) -> list[Box]:
        """In row-major order."""
        steps = self.region_shape
        counts = [-(-size // step) for size, step in zip(self.shape, steps, strict=True)]
        return [
            tuple(
                slice(k * step, min((k + 1) * step, size))
                for k, step, size in zip(place, steps, self.shape, strict=True)
            )
            for place in np.ndindex(*counts)
        ]

    @property
    def all_attrs(self) -> dict[str, str]:
        return {"question": json.dumps(self.question, sort_keys=True), **self.attrs}

    def dims(self, name: str) -> list[str]:
        """Of a column."""
        return [*self.axes, *([self.dimensions[name]] if name in self.dimensions else [])]

    def arrays(self) -> Columns:
        """The columns and their record in memory."""
        arrays = {
            name: np.broadcast_to(row[0], (*self.shape, *row.shape[1:])).copy()
            for name, row in self.columns.items()
        }
        arrays[PASSES] = np.full(self.shape, -1, dtype=np.int16)
        arrays[DONE] = np.zeros((len(self.regions), 2), dtype=np.int64)
        return arrays

    def dataset(self, arrays: Mapping[str, Any]) -> xarray.Dataset:
        """Columns in memory as they stand."""
        variables = {
            name: (self.dims(name), arrays[name], self.notes.get(name, {})) for name in self.columns
        }
        coords = {**self.axes, **self.coords}
        return labelled().Dataset(variables, coords=coords, attrs=self.all_attrs)

    def require_same(self, stored: xarray.Dataset, path: str) -> None:
        """``ValueError`` unless a stored result is of this question."""
        coords = labelled().Dataset(coords={**self.axes, **self.coords}).coords
        if stored.attrs != self.all_attrs or any(
            name not in stored.coords or not stored.coords[name].equals(coords[name])
            for name in coords
        ):
            raise ValueError(
                "path must be a new store or one with this question's results, "
                f"got {path!r} with those of another question"
            )


class Work(Protocol):
    """Fills a region in a pass, from 0, and says at how many points it found anything; the next pass comes once all regions have had this one.

    Passes follow each other until one finds nothing. Work may be sent to another process.
    """

    def __call__(self, arrays: Arrays, region: Box, number: int) -> int: ...


def points_of(region: Box, shape: tuple[int, ...]) -> NDArray[np.intp]:
    """Of a box of a grid, in row-major order."""
    places = np.meshgrid(*(np.arange(s.start, s.stop) for s in region), indexing="ij")
    return np.ravel_multi_index([place.ravel() for place in places], shape)


def values_in(axes: Mapping[str, Vector], region: Box) -> dict[str, Vector]:
    """The values of all axes at each point of a box of a grid, in row-major order."""
    parts = [axis[s] for axis, s in zip(axes.values(), region, strict=True)]
    columns = np.meshgrid(*parts, indexing="ij")
    return {name: column.ravel() for name, column in zip(axes, columns, strict=True)}


def read_box(arrays: Arrays, name: str, box: Box) -> NDArray[Any]:
    """A copy of a column's rows in a box."""
    rows = np.array(arrays[name][box])
    return rows.reshape(-1, *rows.shape[len(box) :])


def write_box(arrays: Arrays, box: Box, columns: Columns) -> None:
    """Write rows in a box."""
    sizes = [s.stop - s.start for s in box]
    for name, rows in columns.items():
        array = arrays[name]
        array[box] = rows.reshape(*sizes, *rows.shape[1:]).astype(array.dtype)


class _InMemory:
    """Columns in this process and, with a path, in a netCDF file that is replaced now and then, and at the end whatever ends the work."""

    def __init__(self, layout: Layout, path: Path | None) -> None:
        each = sum(row.nbytes for row in layout.columns.values()) + 2.0
        require_memory("axes", layout.n, _COPIES * each)
        self.layout, self._path, self._saved = layout, path, time.monotonic()
        self.is_whole = False
        self.arrays = layout.arrays()
        if path is not None and path.exists():
            self._read(load_dataset(path), str(path))

    def _read(self, stored: xarray.Dataset, path: str) -> None:
        self.layout.require_same(stored, path)
        for name in (*self.layout.columns, *_RECORD):
            if _flat(name) in stored:
                self.arrays[name][...] = stored[_flat(name)].to_numpy()
        if _flat(DONE) not in stored:  # a finished result
            self.arrays[DONE][:] = 1, 0

    def opened(self) -> Arrays:
        return self.arrays

    def save(self, *, always: bool = False) -> None:
        if self._path and (always or time.monotonic() - self._saved >= SAVED_EVERY):
            record = (
                {} if self.is_whole else {_flat(name): self._recorded(name) for name in _RECORD}
            )
            save_dataset(self.dataset().assign(record), self._path)
            self._saved = time.monotonic()

    def _recorded(self, name: str) -> Any:
        dims = list(self.layout.axes) if name == PASSES else ["region", "of_region"]
        return dims, self.arrays[name]

    def dataset(self) -> xarray.Dataset:
        return self.layout.dataset(self.arrays)


def _flat(name: str) -> str:
    """As netCDF takes it."""
    return name.replace("/", "_")


class _InZarr:
    """Columns in a Zarr store, a folder's name or fsspec's URL; read and written from any process."""

    def __init__(self, layout: Layout, path: str) -> None:
        self.layout, self.path, self.is_whole = layout, path, False
        zarr = _zarr()
        try:
            group = zarr.open_group(path, mode="r")
        except FileNotFoundError as error:
            place = Path(path)
            if place.is_file() or (place.is_dir() and any(place.iterdir())):
                raise ValueError(
                    f"path must be a file ending with .nc, a Zarr store or a new folder, got {path!r}"
                ) from error
            group = None
        if group is not None and "question" not in group.attrs:
            raise ValueError(
                f"path must be a new store, got {path!r} with another question or none"
            )
        if group is not None and DONE in group:
            layout.require_same(self.dataset(), path)
        else:
            self._create(zarr)

    def _create(self, zarr: Any) -> None:
        """Write the metadata, the record last: a store without it is none."""
        layout = self.layout
        # of objects, as Zarr 3 specifies no strings of a fixed length
        coords = {name: np.array(values, dtype=object) for name, values in layout.coords.items()}
        labels = labelled().Dataset(coords={**layout.axes, **coords}, attrs=layout.all_attrs)
        labels.to_zarr(self.path, mode="a", zarr_format=3, consolidated=False)
        group = zarr.open_group(self.path, mode="r+")
        shard, chunk = layout.shard_and_chunk
        for name, row in {**layout.columns, PASSES: np.array([-1], dtype=np.int16)}.items():
            tail = row.shape[1:]
            group.create_array(
                name, shape=(*layout.shape, *tail), shards=(*shard, *tail), chunks=(*chunk, *tail), dtype=row.dtype, fill_value=row.flat[0],
                dimension_names=layout.dims(name), attributes=dict(layout.notes.get(name, {})), overwrite=True,
            )  # fmt: skip
        group.create_array(DONE, shape=(len(layout.regions), 2), chunks=(1, 2), dtype=np.int64, fill_value=0, overwrite=True)  # fmt: skip

    def opened(self) -> Arrays:
        return _zarr().open_group(self.path, mode="r+")

    def save(self, *, always: bool = False) -> None:
        pass

    def dataset(self) -> xarray.Dataset:
        return labelled().open_zarr(self.path, chunks=None, consolidated=False)


def _zarr() -> Any:
    with needs_extra("analysis"):
        import zarr
    return zarr


@contextmanager
def _store(
    layout: Layout, path: str | Path | None, engine: Engine
) -> Iterator[_InMemory | _InZarr]:
    """Where the columns are kept. Worker processes always fill a Zarr store, which is a temporary one if none is asked for."""
    text = "" if path is None else str(path) if "://" in str(path) else str(require_path(path))
    if engine.is_local and (path is None or text.endswith(".nc")):
        yield _InMemory(layout, Path(text) if text else None)
    elif text and not text.endswith(".nc"):
        yield _InZarr(layout, text)
    elif text or engine.scheduler is not None:
        raise ValueError(
            "path must be a Zarr store that all workers reach, by a shared folder or a URL such as s3://bucket/map.zarr, "
            f"where there are any, got {path!r}"
        )
    else:
        with tempfile.TemporaryDirectory() as folder:
            yield _InZarr(layout, f"{folder}/{layout.name}.zarr")


def fill_grid(
    layout: Layout, work: Work, path: str | Path | None, engine: Engine, progress: bool
) -> xarray.Dataset:
    """Do work on all regions of a grid, but for those that the store holds already, and return its columns.

    Parameters
    ----------
    path : file name or URL, optional
        A netCDF file, if it ends with .nc, or a Zarr store; the columns of the latter are read when they are needed, and memory does not
        grow with the number of points.
    progress : bool
        Show a bar with points per second and the time left.

    Raises
    ------
    ValueError
        If the store holds another question's result, or workers cannot reach it.
    ClusterError
        See ``Engine.started``.
    """
    require_flag("progress", progress)
    require_instance("engine", engine, Engine)
    if not layout.is_threadsafe:
        engine = replace(engine, threads=1)
    regions = layout.regions
    with ExitStack() as stack:
        store = stack.enter_context(_store(layout, path, engine))
        bar = progress_bar(layout.name, progress, layout.n)
        stack.callback(bar.close)
        stack.callback(lambda: store.save(always=True))
        run, number = None, 0
        while True:
            done, found = np.asarray(store.opened()[DONE]).T
            if number and not ((done > number) | ((done == number) & (found > 0))).any():
                store.is_whole = True
                break
            waiting = np.flatnonzero(done <= number)
            sizes = [prod(s.stop - s.start for s in region) for region in regions]
            if not number:
                bar.update(layout.n - sum(sizes[k] for k in waiting))
            if waiting.size and run is None:
                run = stack.enter_context(engine.started(says_where=progress))
            tasks = [(int(k), regions[k], number) for k in waiting]
            for place, _ in run(_fill, (store, work), tasks) if run and tasks else ():
                bar.update(0 if number else sizes[tasks[place][0]])
                store.save()
            number += 1
        data = store.dataset()
        return data.load() if path is None else data


def _fill(shared: tuple[_InMemory | _InZarr, Work], k: int, region: Box, number: int) -> None:
    """Fill one region, and then record it."""
    store, work = shared
    arrays = store.opened()
    found = work(arrays, region, number)
    arrays[DONE][k] = number + 1, found
