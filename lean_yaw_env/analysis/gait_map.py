"""Maps of a walker's gait and its stability over one to three parameters, as labelled arrays."""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.analysis.fixed_point import follow_fixed_point, solve_fixed_point
from lean_yaw_env.analysis.gait_grid import GridGaits, WalkerGrid, follow_grid, solve_grid
from lean_yaw_env.analysis.limit_cycle import cycle_at, find_limit_cycle, planar_gait_rate
from lean_yaw_env.analysis.passive_search import search_passive
from lean_yaw_env.analysis.progress import Counter
from lean_yaw_env.analysis.section_map import ActiveMap, PassiveMap, section_map_of
from lean_yaw_env.analysis.storage import (
    labelled,
    load_dataset,
    require_same,
    save_dataset,
)
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.kernel.records import Outcome
from lean_yaw_env.parameters import INTER_LEG_ANGLE, Vector, require_number
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.walker import Walker

if TYPE_CHECKING:
    import xarray

NOT_YET, FOUND, NONE_FOUND = 0, 1, 2
"""What ``status`` holds at a point of a map."""

NUMBERS = (
    "spectral_radius",
    "speed",
    "step_length",
    "stride_period",
    "least_normal_force",
    "greatest_friction",
    "gravity_work",
    "shift_work",
)
"""One value at each point: the largest multiplier's magnitude, and fields of ``LimitCycle``."""

Columns = dict[str, NDArray[Any]]
"""A map's variables while it is made, one row for each point."""

_CHUNK = 256
_NEAR = 0.1
"""A gait found from a neighbour's is its continuation if no coordinate differs by more."""


def stability_map(
    walker: Walker | PassiveWalker,
    axes: Mapping[str, Sequence[float] | Vector],
    *,
    inter_leg_angle: float = INTER_LEG_ANGLE,
    mass_offset: float | tuple[float, float] = 0.0,
    path: str | Path | None = None,
    threads: int = 1,
    progress: bool = False,
) -> xarray.Dataset:
    """Find the gait and its multipliers at every point of a grid of parameters.

    Each gait is followed from that without hip width and offset; points that are not reached so
    are then tried from their neighbours' gaits, again and again while that finds any. Of passive
    walkers it is the gait of the long period.

    Parameters
    ----------
    walker : Walker or PassiveWalker
        Holds the parameters that are not on an axis.
    axes : one to three names of parameters, each with its values
        Names of ``BODY_PARAMETERS``, and for the active walker of ``COMMAND_PARAMETERS``.
    inter_leg_angle, mass_offset : see ``find_limit_cycle``
    path : file name, optional
        Where to keep what is done: written after every chunk, whole or not at all. Called again
        with the same file, an interrupted map goes on where it was.
    threads : int >= 1
    progress : bool
        Show a progress bar.

    Returns
    -------
    xarray.Dataset
        Over the axes: ``status`` (1 found, 2 none found), ``NUMBERS``, ``state`` (by coordinate),
        ``eigenvalue_real`` and ``eigenvalue_imag`` (by mode, by falling magnitude); nan where no
        gait was found.

    Raises
    ------
    ValueError
        If an argument is outside its range, or the file holds another map.
    """
    require_number("threads", threads, 1, 1024)
    section_map = section_map_of(walker, inter_leg_angle=inter_leg_angle, mass_offset=mass_offset)
    maps = _grid_maps(section_map, axes)
    values = _empty(section_map, axes, len(maps))
    fresh = _dataset(section_map, axes, values)
    if path is not None and Path(path).exists():
        stored = load_dataset(path)
        require_same(stored, fresh, path)
        values = {name: _flat(stored[name], len(axes)) for name in values}
    search = _PassiveSearch(maps) if isinstance(section_map, PassiveMap) else _ActiveSearch(
        [m for m in maps if isinstance(m, ActiveMap)], int(threads)
    )  # fmt: skip
    shape = tuple(len(list(axis)) for axis in axes.values())
    with Counter("stability map", progress, len(maps)) as counter:
        counter.advance(int((values["status"] != NOT_YET).sum()))
        waiting = np.flatnonzero(values["status"] == NOT_YET)
        for first in range(0, waiting.size, _CHUNK):
            chunk = waiting[first : first + _CHUNK]
            search.begin(chunk, values)
            counter.advance(chunk.size)
            if path is not None:
                save_dataset(_dataset(section_map, axes, values), path)
    while _spread(search, values, shape):
        if path is not None:
            save_dataset(_dataset(section_map, axes, values), path)
    result = _dataset(section_map, axes, values)
    if path is not None:
        save_dataset(result, path)
    return result


def save_map(dataset: xarray.Dataset, path: str | Path) -> Path:
    """Write a map to a netCDF file, whole or not at all."""
    return save_dataset(dataset, path)


def load_map(path: str | Path) -> xarray.Dataset:
    """Read a map from a file; ``ValueError`` if it holds none."""
    return load_dataset(path)


def _grid_maps(
    section_map: ActiveMap | PassiveMap, axes: Mapping[str, Sequence[float] | Vector]
) -> list[ActiveMap | PassiveMap]:
    """The map at every point of the grid, in row-major order; checks every value."""
    if not 1 <= len(axes) <= 3:
        raise ValueError(f"axes must name one to three parameters, not {list(axes)}")
    for name, values in axes.items():
        section_map.value(name)
        array = np.asarray(values, dtype=float)
        if array.ndim != 1 or array.size == 0 or np.any(np.diff(array) <= 0.0):
            raise ValueError(f"axis {name} must hold growing numbers, not {values!r}")
    maps: list[ActiveMap | PassiveMap] = []
    # a constant offset is not its own mirror image
    base = section_map.over(2) if "mass_offset" in axes else section_map
    for point in itertools.product(*axes.values()):
        moved = base
        for name, value in zip(axes, point, strict=True):
            moved = moved.moved(name, float(value))
        maps.append(moved)
    return maps


def _empty(section_map: ActiveMap | PassiveMap, axes: Mapping[str, Any], n: int) -> Columns:
    modes = 3 if _is_planar(section_map) else len(section_map.names)
    values: Columns = {name: np.full(n, np.nan) for name in NUMBERS}
    values["status"] = np.full(n, NOT_YET, dtype=np.int8)
    values["state"] = np.full((n, len(section_map.names)), np.nan)
    values["eigenvalue_real"] = np.full((n, modes), np.nan)
    values["eigenvalue_imag"] = np.full((n, modes), np.nan)
    return values


def _is_planar(section_map: ActiveMap | PassiveMap) -> bool:
    return isinstance(section_map, PassiveMap) and section_map.walker.planar


def _flat(variable: xarray.DataArray, n_axes: int) -> Vector:
    array = variable.to_numpy()
    return array.reshape(-1, *array.shape[n_axes:]).copy()


def _dataset(
    section_map: ActiveMap | PassiveMap,
    axes: Mapping[str, Sequence[float] | Vector],
    values: Columns,
) -> xarray.Dataset:
    names = list(axes)
    coordinates = {name: np.asarray(axis, dtype=float) for name, axis in axes.items()}
    shape = tuple(axis.size for axis in coordinates.values())
    last = {"state": ["coordinate"], "eigenvalue_real": ["mode"], "eigenvalue_imag": ["mode"]}
    question: dict[str, Any] = {
        "walker": type(section_map.walker).__name__,
        "parameters": {
            name: value
            for name, value in asdict(section_map.walker.parameters).items()
            if name not in names
        },
    }
    if isinstance(section_map, ActiveMap):
        question["inter_leg_angle"] = section_map.inter_leg_angle
        question["mass_offset"] = list(section_map.mass_offset)
    else:
        question["planar"] = section_map.walker.planar
    return labelled().Dataset(
        {
            name: ([*names, *last.get(name, [])], array.reshape(*shape, *array.shape[1:]))
            for name, array in values.items()
        },
        coords={**coordinates, "coordinate": list(section_map.names)},
        attrs={"question": json.dumps(question, sort_keys=True)},
    )


class _ActiveSearch:
    """Gaits of active walkers, a chunk in a few compiled calls."""

    def __init__(self, maps: list[ActiveMap], threads: int) -> None:
        self._threads = threads
        self._grid = WalkerGrid(
            np.array([m.walker.parameters.body() for m in maps]),
            np.array([m.inter_leg_angle for m in maps]),
            np.array([m.mass_offset for m in maps]),
        )
        self._maps = maps

    def begin(self, index: NDArray[np.intp], values: Columns) -> None:
        """Follow the gaits of some points from no hip width and no offset."""
        rates = [
            planar_gait_rate(self._maps[i].walker, self._maps[i].inter_leg_angle) for i in index
        ]
        starts = np.zeros((index.size, 5))
        starts[:, 1] = 0.5 * self._grid.inter_leg_angles[index]
        starts[:, 3] = rates
        has_start = np.isfinite(starts[:, 3])
        values["status"][index] = NONE_FOUND
        some = index[has_start]
        if some.size:
            gaits = follow_grid(self._grid.at(some), starts[has_start], threads=self._threads)
            self._write(some, gaits, values)
        pumped = index[~has_start & (self._grid.offsets[index, 0] != self._grid.offsets[index, 1])]
        for i in pumped[: 1 if pumped.size else 0]:
            self._seed(int(i), values)

    def spread(self, index: NDArray[np.intp], guesses: Vector, values: Columns) -> int:
        """Try some points from guesses; how many were found."""
        gaits = solve_grid(self._grid.at(index), guesses, threads=self._threads)
        near = gaits.found & (np.abs(np.nan_to_num(gaits.states - guesses)).max(axis=1) < _NEAR)
        gaits = replace(gaits, found=near)
        self._write(index, gaits, values)
        return int(near.sum())

    def _seed(self, i: int, values: Columns) -> None:
        """Where pumping alone drives the walker: one gait, from which neighbours are found."""
        try:
            cycle = find_limit_cycle(
                self._maps[i].walker,
                inter_leg_angle=self._maps[i].inter_leg_angle,
                mass_offset=self._maps[i].mass_offset,
            )
        except NoGaitError:
            return
        self.spread(np.array([i]), cycle.state[None], values)

    def _write(self, index: NDArray[np.intp], gaits: GridGaits, values: Columns) -> None:
        some = index[gaits.found]
        if not some.size:
            return
        values["status"][some] = FOUND
        values["state"][some] = gaits.states[gaits.found]
        field = {
            name: gaits.outcomes[gaits.found][:, :, k] for k, name in enumerate(Outcome._fields)
        }
        duration = field["duration"].sum(axis=1)
        chord = np.hypot(field["displacement_x"].sum(axis=1), field["displacement_z"].sum(axis=1))
        values["speed"][some] = chord / duration
        values["step_length"][some] = 0.5 * chord
        values["stride_period"][some] = duration
        values["least_normal_force"][some] = field["least_normal_force"].min(axis=1)
        values["greatest_friction"][some] = field["greatest_friction"].max(axis=1)
        values["gravity_work"][some] = field["gravity_work"].sum(axis=1) / chord
        values["shift_work"][some] = field["shift_work"].sum(axis=1) / chord
        matrices = gaits.strides[gaits.found]
        free = self._grid.at(some).has_downhill
        for i, matrix, all_free in zip(some, matrices, free, strict=True):
            own = matrix if all_free else matrix[1:, 1:]
            _write_eigenvalues(int(i), np.linalg.eigvals(own), values)


class _PassiveSearch:
    """Gaits of passive walkers, one by one."""

    def __init__(self, maps: Sequence[ActiveMap | PassiveMap]) -> None:
        self._maps = [m for m in maps if isinstance(m, PassiveMap)]
        self._flat: dict[tuple[float, float], Vector | None] = {}

    def begin(self, index: NDArray[np.intp], values: Columns) -> None:
        """Start each point from the planar gait of the long period."""
        for i in index:
            values["status"][i] = NONE_FOUND
            start = self._planar(self._maps[i].walker)
            if start is not None and not self._try(int(i), start, values):
                self._follow(int(i), start, values)

    def spread(self, index: NDArray[np.intp], guesses: Vector, values: Columns) -> int:
        """Try some points from guesses; how many were found."""
        return sum(
            self._try(int(i), guess, values) for i, guess in zip(index, guesses, strict=True)
        )

    def _planar(self, walker: PassiveWalker) -> Vector | None:
        key = (walker.parameters.slope, walker.parameters.foot_radius)
        if key not in self._flat:
            try:
                states = search_passive(replace(walker, planar=True))
                self._flat[key] = max(states, key=lambda state: state[1])
            except NoGaitError:
                self._flat[key] = None
        return self._flat[key]

    def _follow(self, i: int, start: Vector, values: Columns) -> None:
        """From no hip width: lean grows fast with it, and Newton's method loses its way."""
        width = self._maps[i].value("hip_width")
        if width == 0.0:
            return

        def path(share: float) -> PassiveMap:
            return self._maps[i].moved("hip_width", share * width)

        try:
            _, state = follow_fixed_point(path, start)
        except NoGaitError:
            return
        self._try(i, state, values)

    def _try(self, i: int, guess: Vector, values: Columns) -> bool:
        try:
            state = solve_fixed_point(self._maps[i], guess)
        except NoGaitError:
            return False
        if np.abs(state - guess).max() > _NEAR:
            return False
        cycle = cycle_at(self._maps[i], state)
        values["status"][i] = FOUND
        values["state"][i] = cycle.state
        for name in NUMBERS[1:]:
            values[name][i] = getattr(cycle, name)
        _write_eigenvalues(i, cycle.eigenvalues, values)
        return True


def _write_eigenvalues(i: int, eigenvalues: NDArray[Any], values: Columns) -> None:
    order = np.lexsort((-np.imag(eigenvalues), -np.abs(eigenvalues)))
    n = eigenvalues.size
    values["eigenvalue_real"][i, :n] = np.real(eigenvalues)[order]
    values["eigenvalue_imag"][i, :n] = np.imag(eigenvalues)[order]
    values["spectral_radius"][i] = np.abs(eigenvalues).max()


def _spread(
    search: _ActiveSearch | _PassiveSearch, values: Columns, shape: tuple[int, ...]
) -> bool:
    """Try points without a gait from neighbours that have just got one; whether any was found."""
    status = values["status"].reshape(shape)
    number = np.arange(status.size).reshape(shape)
    index, guess_from = [], []
    for axis in range(len(shape)):
        for ahead in (1, -1):
            here = np.take(number, range(shape[axis] - 1), axis=axis).ravel()
            there = np.take(number, range(1, shape[axis]), axis=axis).ravel()
            here, there = (here, there) if ahead > 0 else (there, here)
            tries = (values["status"][here] == NONE_FOUND) & (values["status"][there] == FOUND)
            index.append(here[tries])
            guess_from.append(there[tries])
    points, first = np.unique(np.concatenate(index), return_index=True)
    sources = np.concatenate(guess_from)[first]
    return bool(points.size) and search.spread(points, values["state"][sources], values) > 0
