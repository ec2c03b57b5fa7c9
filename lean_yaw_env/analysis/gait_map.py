"""Maps of a walker's gait and its stability over one to three parameters, as labelled arrays."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import singledispatch
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.analysis.active_map import ActiveMap, planar_rate
from lean_yaw_env.analysis.fixed_point import solve_fixed_point
from lean_yaw_env.analysis.gait_grid import GridGaits, WalkerGrid, follow_grid, solve_grid
from lean_yaw_env.analysis.limit_cycle import cycle_at, sorted_eigenvalues
from lean_yaw_env.analysis.passive_map import PassiveMap
from lean_yaw_env.analysis.path import distance_walked
from lean_yaw_env.analysis.progress import Counter
from lean_yaw_env.analysis.section_map import BODY_PARAMETERS, SectionMap, section_map_of
from lean_yaw_env.analysis.storage import (
    Progressing,
    labelled,
    load_dataset,
    require_axis,
    save_dataset,
)
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.kernel.records import Body, Outcome
from lean_yaw_env.parameters import INTER_LEG_ANGLE, Vector
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.validation import require_count
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
"""One value at each point: the largest multiplier's magnitude, and properties of ``LimitCycle``."""

Columns = dict[str, NDArray[Any]]
"""A map's variables, one row for each point."""

Map = TypeVar("Map", bound=SectionMap)

_CHUNK = 2048
"""Points at a time: what is needed beside the result does not grow with their number."""
_NEAR = 0.1
"""A gait found from a neighbour's is its continuation if no coordinate differs by more."""


def stability_map(
    walker: Walker | PassiveWalker | SectionMap,
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
    walker : Walker, PassiveWalker or SectionMap
        Holds the parameters that are not on an axis.
    axes : one to three names of parameters, each with its values
        Names of the map's ``parameters``: ``BODY_PARAMETERS``, and for the active walker ``COMMAND_PARAMETERS``.
    inter_leg_angle, mass_offset : see ``find_limit_cycle``
    path : file name, optional
        Where to keep what is done, whole or not at all. Called again with the same file, an interrupted map goes on where it was.
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
    require_count("threads", threads, 1, 1024)
    grid = _Grid(
        section_map_of(walker, inter_leg_angle=inter_leg_angle, mass_offset=mass_offset), axes
    )
    values = _empty(grid.section_map, grid.n)

    def dataset() -> xarray.Dataset:
        return _dataset(grid, values)

    saved = Progressing(path, dataset)
    saved.resume(values)
    with saved, Counter("stability map", progress, grid.n) as counter:
        waiting = np.flatnonzero(values["status"] == NOT_YET)
        counter.advance(grid.n - waiting.size)
        for first in range(0, waiting.size, _CHUNK):
            chunk = waiting[first : first + _CHUNK]
            for name, rows in gaits_at(grid.section_map, grid.points(chunk), None, threads).items():
                values[name][chunk] = rows
            counter.advance(chunk.size)
            saved.save_if_due()
        fresh = np.flatnonzero(values["status"] == FOUND)
        while fresh.size:
            fresh = _spread(grid, values, fresh, threads)
            saved.save_if_due()
    return dataset()


def save_map(dataset: xarray.Dataset, path: str | Path) -> Path:
    """Write a map to a netCDF file, whole or not at all."""
    return save_dataset(dataset, path)


def load_map(path: str | Path) -> xarray.Dataset:
    """Read a map from a file; ``ValueError`` if it holds none."""
    return load_dataset(path)


class _Grid:
    """The points of a map, in row-major order; checks every value of the axes."""

    def __init__(
        self, section_map: SectionMap, axes: Mapping[str, Sequence[float] | Vector]
    ) -> None:
        if not 1 <= len(axes) <= 3:
            raise ValueError(f"axes must name one to three parameters, got {list(axes)}")
        for name in axes:
            section_map = section_map.along(name)
        self.section_map = section_map
        self.axes: dict[str, Vector] = {}
        for name, values in axes.items():
            section_map.value(name)
            self.axes[name] = require_axis(f"axis {name}", values)
            # each parameter has a range of its own, so that the ends speak for the values between
            for end in self.axes[name][[0, -1]].tolist():
                section_map.moved(name, end)
        self.shape = tuple(axis.size for axis in self.axes.values())
        self.n = int(np.prod(self.shape))

    def points(self, index: NDArray[np.intp]) -> dict[str, Vector]:
        """The parameters of some points."""
        places = np.unravel_index(index, self.shape)
        return {name: axis[k] for (name, axis), k in zip(self.axes.items(), places, strict=True)}


def _empty(section_map: SectionMap, n: int) -> Columns:
    values: Columns = {name: np.full(n, np.nan) for name in NUMBERS}
    values["status"] = np.full(n, NOT_YET, dtype=np.int8)
    values["state"] = np.full((n, len(section_map.names)), np.nan)
    modes = len(section_map.names) if len(section_map.free) > 3 else len(section_map.free)
    values["eigenvalue_real"] = np.full((n, modes), np.nan)
    values["eigenvalue_imag"] = np.full((n, modes), np.nan)
    return values


def _dataset(grid: _Grid, values: Columns) -> xarray.Dataset:
    names = list(grid.axes)
    last = {"state": ["coordinate"], "eigenvalue_real": ["mode"], "eigenvalue_imag": ["mode"]}
    question = grid.section_map.question()
    question["parameters"] = {k: v for k, v in question["parameters"].items() if k not in names}
    return labelled().Dataset(
        {
            name: ([*names, *last.get(name, [])], array.reshape(*grid.shape, *array.shape[1:]))
            for name, array in values.items()
        },
        coords={**grid.axes, "coordinate": list(grid.section_map.names)},
        attrs={"question": json.dumps(question, sort_keys=True)},
    )


@singledispatch
def gaits_at(
    section_map: SectionMap, points: Mapping[str, Vector], guesses: Vector | None, threads: int
) -> Columns:
    """Gaits of a map that is moved to n points.

    Parameters
    ----------
    section_map : SectionMap
    points : by parameter, its values (n,)
    guesses : shape (n, k), or None to look for the gaits anew
        A gait is only found from a guess that is near it.
    threads : int

    Returns
    -------
    The map's variables, n rows each.
    """
    return _one_by_one(section_map, points, guesses, lambda moved: next(moved.search()))


@gaits_at.register
def _(
    section_map: PassiveMap, points: Mapping[str, Vector], guesses: Vector | None, threads: int
) -> Columns:
    return _one_by_one(section_map, points, guesses, PassiveMap.long_gait)


@gaits_at.register
def _(
    section_map: ActiveMap, points: Mapping[str, Vector], guesses: Vector | None, threads: int
) -> Columns:
    grid = _walker_grid(section_map, points, threads)
    if guesses is not None:
        gaits = solve_grid(grid, guesses)
        near = np.abs(np.nan_to_num(gaits.states - guesses)).max(axis=1) <= _NEAR
        return _columns(section_map, grid, gaits, gaits.found & near)
    radius, slope = (grid.bodies[:, Body._fields.index(k)] for k in ("foot_radius", "slope"))
    starts = np.zeros((grid.n, 5))
    starts[:, 1] = 0.5 * grid.inter_leg_angles
    starts[:, 3] = [
        planar_rate(*each, 0.0)
        for each in zip(
            radius.tolist(), slope.tolist(), grid.inter_leg_angles.tolist(), strict=True
        )
    ]
    gaits = follow_grid(grid, starts)
    values = _columns(section_map, grid, gaits, gaits.found)
    # where only pumping drives the walker: one gait, from which neighbours are found
    pumped = np.flatnonzero(np.isnan(starts[:, 3]) & (grid.offsets[:, 0] != grid.offsets[:, 1]))
    for i in pumped[:1]:
        here = {name: array[i : i + 1] for name, array in points.items()}
        seed = _one_by_one(section_map, here, None, lambda moved: next(moved.search()))
        for name in values:
            values[name][i] = seed[name][0]
    return values


def _one_by_one(
    section_map: Map,
    points: Mapping[str, Vector],
    guesses: Vector | None,
    search: Callable[[Map], Vector],
) -> Columns:
    n = len(next(iter(points.values())))
    values = _empty(section_map, n)
    values["status"][:] = NONE_FOUND
    for i in range(n):
        moved = section_map
        for name, array in points.items():
            moved = moved.moved(name, float(array[i]))
        try:
            if guesses is None:
                state = search(moved)
            else:
                state = solve_fixed_point(moved, guesses[i])
                if np.abs(state - guesses[i]).max() > _NEAR:
                    continue
            cycle = cycle_at(moved, state)
        except NoGaitError:
            continue
        values["status"][i] = FOUND
        values["state"][i] = cycle.state
        for name in NUMBERS:
            values[name][i] = getattr(cycle, name)
        count = cycle.eigenvalues.size
        values["eigenvalue_real"][i, :count] = np.real(cycle.eigenvalues)
        values["eigenvalue_imag"][i, :count] = np.imag(cycle.eigenvalues)
    return values


def _walker_grid(section_map: ActiveMap, points: Mapping[str, Vector], threads: int) -> WalkerGrid:
    """The walkers at some points, as arrays."""
    n = len(next(iter(points.values())))
    bodies = np.tile(np.array(section_map.walker.parameters.body()), (n, 1))
    commands = {
        name: points.get(name, np.full(n, section_map.value(name)))
        for name in ("inter_leg_angle", "mass_offset", "alternating_offset")
    }
    for name in set(points) & set(BODY_PARAMETERS):
        bodies[:, Body._fields.index(name)] = points[name]
    mean, apart = commands["mass_offset"], commands["alternating_offset"]
    offsets = np.column_stack([mean + apart, mean - apart])
    symmetric = np.full(n, section_map.n_steps % 2 == 1)
    return WalkerGrid(bodies, commands["inter_leg_angle"], offsets, symmetric, threads)


def _columns(
    section_map: ActiveMap, grid: WalkerGrid, gaits: GridGaits, found: NDArray[np.bool_]
) -> Columns:
    """The map's variables at the walkers of a grid."""
    values = _empty(section_map, grid.n)
    values["status"][:] = np.where(found, FOUND, NONE_FOUND)
    values["state"][found] = gaits.states[found]
    outcomes = gaits.outcomes[found]
    field = {name: outcomes[:, :, k] for k, name in enumerate(Outcome._fields)}
    steps = np.stack([field["displacement_x"], field["displacement_z"]], axis=-1)
    has_downhill = grid.has_downhill[found]
    turn = np.where(has_downhill, 0.0, field["heading"][:, 1] - gaits.states[found, 0])
    distance, duration = distance_walked(steps, turn), field["duration"].sum(axis=1)
    values["speed"][found] = distance / duration
    values["step_length"][found] = 0.5 * distance
    values["stride_period"][found] = duration
    values["least_normal_force"][found] = field["least_normal_force"].min(axis=1)
    values["greatest_friction"][found] = field["greatest_friction"].max(axis=1)
    values["gravity_work"][found] = field["gravity_work"].sum(axis=1) / distance
    values["shift_work"][found] = field["shift_work"].sum(axis=1) / distance
    index = np.flatnonzero(found)
    for all_free, first in ((True, 0), (False, 1)):
        some = index[has_downhill == all_free]
        eigenvalues = sorted_eigenvalues(gaits.strides[some, first:, first:])
        count = eigenvalues.shape[1]
        values["eigenvalue_real"][some, :count] = np.real(eigenvalues)
        values["eigenvalue_imag"][some, :count] = np.imag(eigenvalues)
        values["spectral_radius"][some] = np.abs(eigenvalues[:, 0])
    return values


def _spread(
    grid: _Grid, values: Columns, fresh: NDArray[np.intp], threads: int
) -> NDArray[np.intp]:
    """Try the neighbours, where none was found, of points that have just got a gait; those found."""
    places = np.array(np.unravel_index(fresh, grid.shape))
    tried, guess_from = [], []
    for axis, size in enumerate(grid.shape):
        for step in (-1, 1):
            there = places.copy()
            there[axis] += step
            inside = (there[axis] >= 0) & (there[axis] < size)
            tried.append(np.ravel_multi_index(tuple(there[:, inside]), grid.shape))
            guess_from.append(fresh[inside])
    points, first = np.unique(np.concatenate(tried), return_index=True)
    sources = np.concatenate(guess_from)[first]
    waits = values["status"][points] == NONE_FOUND
    points, sources = points[waits], sources[waits]
    found = np.zeros(points.size, dtype=bool)
    for start in range(0, points.size, _CHUNK):
        part = slice(start, start + _CHUNK)
        here, guesses = points[part], values["state"][sources[part]]
        rows = gaits_at(grid.section_map, grid.points(here), guesses, threads)
        found[part] = good = rows["status"] == FOUND
        for name, column in rows.items():
            values[name][here[good]] = column[good]
    return points[found]
