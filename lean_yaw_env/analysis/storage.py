"""Labelled arrays on disk: written whole or not at all, in netCDF."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from lean_yaw_env.extras import needs_extra
from lean_yaw_env.files import require_path, written_whole
from lean_yaw_env.parameters import Vector
from lean_yaw_env.validation import require_array, require_instance

if TYPE_CHECKING:
    import xarray

_ENGINE = "scipy"  # netCDF 3, which needs nothing that is not installed anyway


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
            "that are free; keep them in a Zarr store by a path that ends with .zarr"
        )


def progress_bar(name: str, shown: bool, total: int | None = None) -> Any:
    """A bar to ``update`` and ``close``, drawn where that is wanted and tqdm, an optional dependency, is installed."""
    if shown:
        try:
            from tqdm.auto import tqdm

            return tqdm(desc=name, total=total, unit=" points", unit_scale=True)
        except ImportError:
            pass
    return SimpleNamespace(update=lambda amount=1: None, close=lambda: None)
