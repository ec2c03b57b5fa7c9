"""Labelled arrays on disk: written whole or not at all, in netCDF."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.files import written_whole
from lean_yaw_env.parameters import Vector
from lean_yaw_env.validation import require_array

if TYPE_CHECKING:
    import xarray

_ENGINE = "scipy"  # netCDF 3, which needs nothing that is not installed anyway
SAVED_EVERY = 10.0
"""Seconds between two savings of work under way, so that saving takes a small share of the time however large the result is."""


def labelled() -> Any:
    """The xarray module, or ``ImportError`` saying how to install it."""
    try:
        import xarray
    except ImportError as error:
        raise ImportError(
            "maps and basins are labelled arrays: run `pip install 'lean-yaw-env[analysis]'`"
        ) from error
    return xarray


def save_dataset(dataset: xarray.Dataset, path: str | Path) -> Path:
    """Write a dataset to a netCDF file, replacing what was there only once it is complete."""
    target = Path(path)
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
    source = Path(path)
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
    array = require_array(name, np.asarray(values), (None,), low, high)
    if not array.size or np.any(np.diff(array) <= 0.0):
        raise ValueError(f"{name} must be growing numbers, got {values!r}")
    return array


class Progressing:
    """A result that grows: saved now and then, and when the work is left, whatever ends it; read back when it goes on.

    Parameters
    ----------
    path : file name, or None to keep nothing
    dataset : gives the result as it stands
    """

    def __init__(self, path: str | Path | None, dataset: Callable[[], xarray.Dataset]) -> None:
        self._path = None if path is None else Path(path)
        self._dataset = dataset
        self._saved = time.monotonic()

    def resume(self, result: Mapping[str, NDArray[Any]]) -> None:
        """Read what an earlier run has done into the result's arrays, whose first axis goes over all points.

        Raises
        ------
        ValueError
            If the file holds the results of another question.
        """
        if self._path is None or not self._path.exists():
            return
        stored, fresh = load_dataset(self._path), self._dataset()
        if stored.attrs != fresh.attrs or any(
            name not in stored.coords or not stored.coords[name].equals(fresh.coords[name])
            for name in fresh.coords
        ):
            raise ValueError(
                "path must be a new file or one with this question's results, "
                f"got {str(self._path)!r} with those of another question"
            )
        for name, array in result.items():
            array[:] = stored[name].to_numpy().reshape(array.shape)

    def save_if_due(self) -> None:
        """Save unless that was done a short while ago."""
        if time.monotonic() - self._saved >= SAVED_EVERY:
            self._save()

    def _save(self) -> None:
        if self._path is not None:
            save_dataset(self._dataset(), self._path)
        self._saved = time.monotonic()

    def __enter__(self) -> Progressing:
        return self

    def __exit__(self, *error: object) -> None:
        self._save()
