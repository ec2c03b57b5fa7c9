"""Labelled arrays on disk: written whole or not at all, in netCDF."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray

_ENGINE = "scipy"  # netCDF 3, which needs nothing that is not installed anyway


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
    handle, name = tempfile.mkstemp(prefix=target.name, suffix=".part", dir=target.parent)
    os.close(handle)
    try:
        dataset.to_netcdf(name, engine=_ENGINE)
        os.replace(name, target)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
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
        raise ValueError(f"no file {source}")
    try:
        return labelled().load_dataset(source, engine=_ENGINE)
    except (OSError, TypeError, ValueError) as error:
        raise ValueError(f"{source} is not a netCDF file of labelled arrays: {error}") from error


def require_same(stored: xarray.Dataset, fresh: xarray.Dataset, path: str | Path) -> None:
    """Raise ``ValueError`` unless a stored result is of the same question as a fresh one."""
    if stored.attrs != fresh.attrs or any(
        name not in stored.coords or not stored.coords[name].equals(fresh.coords[name])
        for name in fresh.coords
    ):
        raise ValueError(
            f"{path} holds another question's results; give another file name or remove it"
        )
