"""Maps of a walker's gait and its stability over one to six parameters, as labelled arrays."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.analysis.active_map import COMMAND_PARAMETERS, ActiveMap, planar_rate
from lean_yaw_env.analysis.filling import (
    PASSES,
    Arrays,
    Box,
    Columns,
    Layout,
    fill_grid,
    points_of,
    read_box,
    write_box,
)
from lean_yaw_env.analysis.fixed_point import solve_fixed_point
from lean_yaw_env.analysis.gait_grid import GridGaits, WalkerGrid, follow_grid, solve_grid
from lean_yaw_env.analysis.limit_cycle import (
    OF_STEPS,
    cycle_at,
    numbers_of_cycles,
    sorted_eigenvalues,
)
from lean_yaw_env.analysis.section_map import (
    BODY_PARAMETERS,
    CommandArguments,
    SectionMap,
    WalkerOrMap,
    section_map_of,
)
from lean_yaw_env.analysis.storage import require_axis
from lean_yaw_env.engine import ONE_THREAD, Engine
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.kernel.records import Body, Outcome
from lean_yaw_env.parameters import STATE_SIZE, Vector
from lean_yaw_env.validation import require_mapping

if TYPE_CHECKING:
    import xarray
    from typing_extensions import Unpack

NOT_YET, FOUND, NONE_FOUND = 0, 1, 2
"""What ``status`` holds at a point of a map."""

NUMBERS = (
    "spectral_radius", "speed", "step_length", "stride_period", "least_normal_force", "greatest_friction", "gravity_work", "shift_work"
)  # fmt: skip
"""One value at each point: the largest multiplier's magnitude, and properties of ``LimitCycle``."""

_CHUNK = 2048
"""Rows of points at a time: what is needed beside a region's result does not grow with their number."""
_STARTS = 8
"""Walkers that only pumping drives, among those of a chunk, for which a gait is looked for anew until one is found."""
_NEAR = 0.1
"""A gait found from a neighbour's is its continuation if no coordinate differs by more."""


def stability_map(
    walker: WalkerOrMap,
    axes: Mapping[str, Sequence[float] | Vector],
    *,
    path: str | Path | None = None,
    engine: Engine = ONE_THREAD,
    progress: bool = False,
    **command: Unpack[CommandArguments],
) -> xarray.Dataset:
    """Find the gait and its multipliers at every point of a grid of parameters.

    Each gait is followed from that without hip width and offset; points that are not reached so are then tried from their neighbours' gaits,
    again and again while that finds any. Of passive walkers it is the gait of the long period.

    Parameters
    ----------
    walker : Walker, PassiveWalker or SectionMap
        Holds the parameters that are not on an axis.
    axes : one to six names of parameters, each with its values
        Names of the map's ``parameters``: ``BODY_PARAMETERS``, and for the active walker ``COMMAND_PARAMETERS``.
    path, engine, progress : see ``fill_grid``
        Called again with the same path, an interrupted map goes on where it was.
    inter_leg_angle, mass_offset : see ``find_limit_cycle``

    Returns
    -------
    xarray.Dataset
        Over the axes: ``status`` (1 found, 2 none found), ``NUMBERS``, ``state`` (by coordinate), ``eigenvalue_real`` and ``eigenvalue_imag``
        (by mode, by falling magnitude); nan where no gait was found.

    Raises
    ------
    ValueError
        If an argument is outside its range, or the store holds another map.
    ClusterError
        If workers cannot do their part.
    """
    grid = _Grid(section_map_of(walker, **command), axes)
    columns = _empty(grid.section_map, 1)
    columns = {
        "status": np.full(1, NOT_YET, np.int8),
        **{name: columns[name] for name in columns if name != "status"},
    }
    question = grid.section_map.question()
    question["parameters"] = {k: v for k, v in question["parameters"].items() if k not in grid.axes}
    layout = Layout(
        "stability map", grid.axes, columns, question,
        dimensions={"state": "coordinate", "eigenvalue_real": "mode", "eigenvalue_imag": "mode"},
        coords={"coordinate": list(grid.section_map.names)}, is_threadsafe=grid.section_map.is_threadsafe,
    )  # fmt: skip
    return fill_grid(layout, _Gaits(grid), path, engine, progress)


@dataclass(frozen=True)
class _Gaits:
    """Finds the gaits of a region: in the first pass anew and from neighbours within, in later ones from those that neighbouring regions have found just before."""

    grid: _Grid

    def __call__(self, arrays: Arrays, region: Box, number: int) -> int:
        box = region if number == 0 else _grown(region, self.grid.shape)
        grid = self.grid.box(box)
        inner = tuple(slice(s.start - b.start, s.stop - b.start) for s, b in zip(region, box, strict=True))  # fmt: skip
        mine = np.zeros(grid.n, dtype=bool)
        mine[points_of(inner, grid.shape)] = True
        if number == 0:
            values, passes = _empty(grid.section_map, grid.n), np.full(grid.n, -1, dtype=np.int16)
            rows = grid.rows
            for first in range(0, len(rows), _CHUNK):
                chunk = rows[first : first + _CHUNK]
                points = grid.points(chunk.ravel())
                here = gaits_at(grid.section_map, points, None, in_row=rows.shape[1])
                for name, column in here.items():
                    values[name][chunk.ravel()] = column
            fresh = np.flatnonzero(values["status"] == FOUND)
        else:
            passes = read_box(arrays, PASSES, box)
            fresh = np.flatnonzero(~mine & (passes == number - 1))
            # what came later, or is left of a task that died, is not there yet
            later = passes >= number
            passes[later] = -1
            if not fresh.size or (passes[mine] >= 0).all():
                return 0
            values = {name: read_box(arrays, name, box) for name in _empty(grid.section_map, 1)}
            for name, row in _empty(grid.section_map, 1).items():
                values[name][later] = row[0]
        known = passes >= 0
        passes[fresh[mine[fresh]]] = number
        while fresh.size:
            fresh = _spread(grid, values, fresh, mine)
            passes[fresh] = number
        if number == 0 or (passes[mine] == number).any():
            write_box(arrays, region, {name: rows[mine] for name, rows in values.items()})
            write_box(arrays, region, {PASSES: passes[mine]})
        return int((~known & (passes >= 0)).sum())


def _grown(region: Box, shape: tuple[int, ...]) -> Box:
    """A region with the points around it."""
    return tuple(
        slice(max(s.start - 1, 0), min(s.stop + 1, size))
        for s, size in zip(region, shape, strict=True)
    )


def map_cost(
    walker: WalkerOrMap,
    axes: Mapping[str, Sequence[float] | Vector],
    **command: Unpack[CommandArguments],
) -> tuple[float, float]:
    """Estimate what a ``stability_map`` costs with one thread: bytes of memory without a Zarr store, and seconds from some single points on this machine, more than rows of them take."""
    grid = _Grid(section_map_of(walker, **command), axes)
    sample = np.linspace(0, grid.n - 1, min(grid.n, 16)).astype(np.intp)
    gaits_at(grid.section_map, grid.points(sample[:1]), None)  # compiles
    began = time.process_time()
    gaits_at(grid.section_map, grid.points(sample), None)
    each = (time.process_time() - began) / len(sample)
    return grid.n * _bytes(grid), grid.n * each


def _bytes(grid: _Grid) -> float:
    """Memory of a point: its numbers, and copies of them while they are written."""
    return 3.0 * sum(column.nbytes for column in _empty(grid.section_map, 1).values())


class _Grid:
    """The points of a map, in row-major order; checks every value of the axes."""

    def __init__(
        self, section_map: SectionMap, axes: Mapping[str, Sequence[float] | Vector]
    ) -> None:
        if not 1 <= len(require_mapping("axes", axes)) <= 6:
            raise ValueError(f"axes must name one to six parameters, got {list(axes)}")
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

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(axis.size for axis in self.axes.values())

    @property
    def n(self) -> int:
        return prod(self.shape)

    def box(self, box: Box) -> _Grid:
        """A part of the grid."""
        part = copy(self)
        part.axes = {name: axis[s] for (name, axis), s in zip(self.axes.items(), box, strict=True)}
        return part

    @property
    def rows(self) -> NDArray[np.intp]:
        """All points (rows, in row), those of a row along growing hip width where ``follow_grid`` follows gaits along it."""
        points = np.arange(self.n).reshape(self.shape)
        section_map, commands = self.section_map, COMMAND_PARAMETERS[1:]
        if (
            not isinstance(section_map, ActiveMap)
            or "hip_width" not in self.axes
            or any(name in self.axes or section_map.value(name) != 0.0 for name in commands)
        ):
            return points.reshape(-1, 1)
        along = list(self.axes).index("hip_width")
        return np.moveaxis(points, along, -1).reshape(-1, self.shape[along])

    def points(self, index: NDArray[np.intp]) -> dict[str, Vector]:
        """The parameters of some points."""
        places = np.unravel_index(index, self.shape)
        return {name: axis[k] for (name, axis), k in zip(self.axes.items(), places, strict=True)}


def _empty(section_map: SectionMap, n: int) -> Columns:
    """Points at which no gait was found."""
    size, modes = len(section_map.names), len(section_map.free)
    modes = size if modes > 3 else modes
    values: Columns = {name: np.full(n, np.nan) for name in NUMBERS}
    values["status"] = np.full(n, NONE_FOUND, dtype=np.int8)
    values["state"] = np.full((n, size), np.nan)
    for part in ("real", "imag"):
        values[f"eigenvalue_{part}"] = np.full((n, modes), np.nan)
    return values


def _set_eigenvalues(
    values: Columns, index: NDArray[np.intp], eigenvalues: NDArray[np.complex128]
) -> None:
    n = eigenvalues.shape[-1]
    values["eigenvalue_real"][index, :n] = np.real(eigenvalues)
    values["eigenvalue_imag"][index, :n] = np.imag(eigenvalues)


def gaits_at(
    section_map: SectionMap, points: Mapping[str, Vector], guesses: Vector | None, in_row: int = 1
) -> Columns:
    """The map's variables, n rows each, where the map is moved to n points: by parameter, its values (n,).

    Gaits are looked for anew, along rows of points (see ``follow_grid``), or found from guesses (n, k) that are near them.
    """
    if isinstance(section_map, ActiveMap):
        return _at_once(section_map, points, guesses, in_row)
    return _one_by_one(section_map, points, guesses)


def _one_by_one(
    section_map: SectionMap, points: Mapping[str, Vector], guesses: Vector | None
) -> Columns:
    n = len(next(iter(points.values())))
    values = _empty(section_map, n)
    for i in range(n):
        moved = section_map
        for name, array in points.items():
            moved = moved.moved(name, float(array[i]))
        try:
            if guesses is None:
                state = moved.main_gait()
            else:
                state = solve_fixed_point(moved, guesses[i])
                if np.abs(state - guesses[i]).max() > _NEAR:
                    continue
            cycle = cycle_at(moved, state)
        except NoGaitError:
            continue
        values["status"][i], values["state"][i] = FOUND, cycle.state
        for name in NUMBERS:
            values[name][i] = getattr(cycle, name)
        _set_eigenvalues(values, np.array([i]), cycle.eigenvalues)
    return values


def _at_once(
    section_map: ActiveMap, points: Mapping[str, Vector], guesses: Vector | None, in_row: int
) -> Columns:
    grid = walker_grid(section_map, points)
    if guesses is not None:
        gaits = solve_grid(grid, guesses)
        distance = np.abs(gaits.states - guesses[gaits.index]).max(axis=1, initial=0.0)
        return _columns(section_map, grid, gaits.at(distance <= _NEAR))
    first = grid.at(np.arange(0, grid.n, in_row))
    radius, slope = (first.bodies[:, Body._fields.index(k)] for k in ("foot_radius", "slope"))
    numbers = np.column_stack([radius, slope, first.inter_leg_angles])
    starts = np.zeros((first.n, STATE_SIZE))
    starts[:, 1] = 0.5 * first.inter_leg_angles
    starts[:, 3] = [planar_rate(r, g, angle, 0.0) for r, g, angle in numbers.tolist()]
    values = _columns(section_map, grid, follow_grid(grid, starts, in_row))
    # where only pumping drives the walker: one gait, from which neighbours are found
    pumped = np.repeat(np.isnan(starts[:, 3]), in_row) & (grid.offsets[:, 0] != grid.offsets[:, 1])
    candidates = np.flatnonzero(pumped)
    for i in candidates[
        np.linspace(0, candidates.size - 1, min(candidates.size, _STARTS), dtype=int)
    ]:
        here = {name: array[i : i + 1] for name, array in points.items()}
        for name, rows in _one_by_one(section_map, here, None).items():
            values[name][i] = rows[0]
        if values["status"][i] == FOUND:
            break
    return values


def _columns(section_map: ActiveMap, grid: WalkerGrid, gaits: GridGaits) -> Columns:
    """The map's variables at the walkers of a grid."""
    values, index = _empty(section_map, grid.n), gaits.index
    values["status"][index], values["state"][index] = FOUND, gaits.states
    steps = dict(zip(Outcome._fields, np.moveaxis(gaits.outcomes, 2, 0), strict=True))
    steps["displacement"] = np.stack([steps["displacement_x"], steps["displacement_z"]], axis=-1)
    has_downhill = grid.has_downhill[index]
    turn = np.where(has_downhill, 0.0, steps["heading"][:, 1] - gaits.states[:, 0])
    numbers = numbers_of_cycles({name: steps[name] for name in OF_STEPS}, turn)
    for name in NUMBERS[1:]:
        values[name][index] = numbers[name]
    for all_free, first in ((True, 0), (False, 1)):
        some = has_downhill == all_free
        eigenvalues = sorted_eigenvalues(gaits.strides[some, first:, first:])
        _set_eigenvalues(values, index[some], eigenvalues)
        values["spectral_radius"][index[some]] = np.abs(eigenvalues[:, 0])
    return values


def walker_grid(section_map: ActiveMap, points: Mapping[str, Vector]) -> WalkerGrid:
    """The walkers at some points, as arrays."""
    n = len(next(iter(points.values())))
    bodies = np.tile(np.array(section_map.walker.parameters.body()), (n, 1))
    for name in set(points) & set(BODY_PARAMETERS):
        bodies[:, Body._fields.index(name)] = points[name]
    angles, mean, apart = (
        points.get(name, np.full(n, section_map.value(name))) for name in COMMAND_PARAMETERS
    )
    offsets = np.column_stack([mean + apart, mean - apart])
    symmetric = np.full(n, section_map.n_steps % 2 == 1)
    return WalkerGrid(bodies, angles, offsets, symmetric)


def _spread(
    grid: _Grid, values: Columns, fresh: NDArray[np.intp], mine: NDArray[np.bool_]
) -> NDArray[np.intp]:
    """Try the neighbours (those of ``mine`` where none was found) of points that have just got a gait, direction by direction; those found."""
    places = np.array(np.unravel_index(fresh, grid.shape))
    found: list[NDArray[np.intp]] = []
    for axis, size in enumerate(grid.shape):
        for step in (-1, 1):
            there = places.copy()
            there[axis] += step
            inside = (there[axis] >= 0) & (there[axis] < size)
            points = np.asarray(np.ravel_multi_index(tuple(there[:, inside]), grid.shape))
            waits = mine[points] & (values["status"][points] == NONE_FOUND)
            points, sources = points[waits], fresh[inside][waits]
            for start in range(0, points.size, _CHUNK):
                part = slice(start, start + _CHUNK)
                here, guesses = points[part], values["state"][sources[part]]
                rows = gaits_at(grid.section_map, grid.points(here), guesses)
                good = rows["status"] == FOUND
                for name, column in rows.items():
                    values[name][here[good]] = column[good]
                found.append(here[good])
    return np.concatenate(found) if found else fresh[:0]
