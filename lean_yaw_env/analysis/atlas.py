"""An atlas: gaits over many designs at once, and answers to what a designer asks of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.analysis.active_map import ActiveMap
from lean_yaw_env.analysis.filling import Arrays, Box, Layout, fill_grid, values_in, write_box
from lean_yaw_env.analysis.gait_map import walker_grid
from lean_yaw_env.analysis.storage import labelled
from lean_yaw_env.engine import ONE_THREAD, Engine
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.kernel.records import STEPPED, Outcome
from lean_yaw_env.parameters import STATE_SIZE, Vector
from lean_yaw_env.validation import (
    require_choice,
    require_count,
    require_finite,
    require_instance,
    require_number,
    require_pair,
)
from lean_yaw_env.walker import Walker

if TYPE_CHECKING:
    import xarray

DESIGNS: Mapping[str, Vector] = {
    "slope": np.linspace(0.002, 0.05, 25),
    "inter_leg_angle": np.linspace(0.1, 0.565, 32),
    "foot_radius": np.linspace(0.05, 0.81, 20),
    "hip_width": np.linspace(0.0, 0.6, 25),
    "ankle_tilt": np.linspace(0.1, 1.3, 25),
}
"""Ten million designs: the axes of the atlas."""

PUSHES = 32
"""Disturbed states from which a design's basin is judged."""
_REACH = np.array([0.3, 0.05, 0.1, 0.1, 0.1])
"""How far each coordinate of the section is put off, either way."""
_DESIGNS_AT_ONCE = 128
_STATUS = Outcome._fields.index("status")


def basin_sizes(
    gaits: xarray.Dataset,
    *,
    every: int = 3,
    n_steps: int = 30,
    path: str | Path | None = None,
    engine: Engine = ONE_THREAD,
    progress: bool = False,
) -> xarray.Dataset:
    """How much each design stands, on a coarser grid of a stability map of an active walker on a fixed slope.

    Parameters
    ----------
    gaits : xarray.Dataset
        From ``stability_map``, of a ``Walker`` without mass offsets.
    every : int >= 1
        Take each so-many-th value of every axis.
    n_steps : int >= 1
        A walk of so many steps counts as survived.
    path, engine, progress : see ``fill_grid``

    Returns
    -------
    xarray.Dataset
        ``basin`` over the coarser axes: the share of ``PUSHES`` states around the gait from which the walker does not fall; nan where there
        is no stable gait. The states are the same for all designs: points of a Sobol sequence in the box gait ± (0.3 rad of heading, 0.05 of
        stance pitch, 0.1 of ankle angle, 0.1 of both rates).

    Raises
    ------
    ValueError
        If an argument is outside its range, or the store holds another result.
    """
    _with("spectral_radius", "gaits", gaits)
    require_count("every", every)
    require_count("n_steps", n_steps, 1, 1_000_000)
    coarse = gaits.isel({str(name): slice(None, None, every) for name in gaits["status"].dims})
    axes = {str(name): coarse[name].to_numpy() for name in coarse["status"].dims}
    states = np.asarray(coarse["state"].to_numpy())
    stable = np.asarray(coarse["spectral_radius"].to_numpy() < 1.0)
    question = {"gaits": gaits.attrs["question"], "every": every, "n_steps": n_steps}
    layout = Layout("basin sizes", axes, {"basin": np.full(1, np.nan)}, question, most=2**14)
    return fill_grid(layout, _Basins(axes, states, stable, n_steps), path, engine, progress)


@dataclass(frozen=True)
class _Basins:
    """Walks of every stable design of a region from the disturbed states."""

    axes: dict[str, Vector]
    states: Vector
    stable: NDArray[np.bool_]
    n_steps: int

    def __call__(self, arrays: Arrays, region: Box, number: int) -> int:
        stable = self.stable[region].ravel()
        states = self.states[region].reshape(-1, STATE_SIZE)
        designs = values_in(self.axes, region)
        sizes = np.full(stable.size, np.nan)
        who = np.flatnonzero(stable)
        for first in range(0, who.size, _DESIGNS_AT_ONCE):
            some = who[first : first + _DESIGNS_AT_ONCE]
            here = {name: values[some] for name, values in designs.items()}
            sizes[some] = _survived(here, states[some], self.n_steps)
        write_box(arrays, region, {"basin": sizes})
        return 0


def _survived(designs: Mapping[str, Vector], states: Vector, n_steps: int) -> Vector:
    """The share (n,) of disturbed states from which each of n designs walks on."""
    from scipy.stats import qmc

    off = _REACH * (2.0 * qmc.Sobol(STATE_SIZE, scramble=False).random(PUSHES) - 1.0)
    every = {name: np.repeat(values, PUSHES) for name, values in designs.items()}
    grid = walker_grid(ActiveMap(Walker()), every)
    current = (states[:, None] + off).reshape(-1, STATE_SIZE)
    who = np.arange(len(current))
    for k in range(n_steps):
        rows = grid.at(who).step(current, k % 2)
        done = rows[:, _STATUS] == STEPPED
        who, current = who[done], rows[done, :STATE_SIZE]
    return np.bincount(who // PUSHES, minlength=len(states)) / PUSHES


def _with(column: str, name: str, data: xarray.Dataset) -> xarray.Dataset:
    """Return a dataset that has a column, or raise ``ValueError``."""
    if column not in require_instance(name, data, labelled().Dataset):
        raise ValueError(f"{name} must have {column!r}, got {list(data)}")
    return data


class Atlas:
    """Answers about the designs of a stability map, in memory: two numbers for each design.

    Parameters
    ----------
    gaits : xarray.Dataset
        From ``stability_map``.
    basins : xarray.Dataset, optional
        From ``basin_sizes``; only ``largest_basin`` needs it.

    Raises
    ------
    ValueError
        If one of them is something else.
    """

    def __init__(self, gaits: xarray.Dataset, basins: xarray.Dataset | None = None) -> None:
        self.gaits = _with("spectral_radius", "gaits", gaits)
        self.basins = None if basins is None else _with("basin", "basins", basins)
        self.axes = {str(name): gaits[name].to_numpy() for name in gaits["status"].dims}
        self._speeds = gaits["speed"].to_numpy().astype(np.float32)
        self._speeds[~(gaits["spectral_radius"].to_numpy() < 1.0)] = -np.inf

    def nearest_stable(self, **wanted: float) -> dict[str, float]:
        """The stable design nearest to the values wanted: their differences as shares of the axes' lengths, squared and added.

        Raises
        ------
        ValueError
            If a name is no axis, or a value no finite number.
        NoGaitError
            If no design is stable.
        """
        distance = np.zeros((1,) * len(self.axes), dtype=np.float32)
        for name, value in wanted.items():
            axis, k = self._axis(name)
            value = require_number(name, value, -1e6, 1e6)
            apart = ((axis - value) / max(float(np.ptp(axis)), 1e-12)) ** 2
            shape = [-1 if i == k else 1 for i in range(len(self.axes))]
            distance = distance + apart.astype(np.float32).reshape(shape)
        return self._best(np.where(self._speeds > 0.0, -distance, np.float32(-np.inf)), self.axes)

    def fastest_stable(self, **limits: tuple[float, float]) -> dict[str, float]:
        """The stable design that walks fastest, with each named axis between its two limits.

        Raises
        ------
        ValueError
            If a name is no axis, or limits hold no value of it.
        NoGaitError
            If no design there is stable.
        """
        axes, box = dict(self.axes), [slice(None)] * len(self.axes)
        for name, pair in limits.items():
            axis, k = self._axis(name)
            low, high = (require_finite(f"limits of {name}", each) for each in require_pair(name, pair, "least, greatest"))  # fmt: skip
            first, last = np.searchsorted(axis, [low, np.nextafter(high, np.inf)])
            if first >= last:
                raise ValueError(f"limits of {name} must hold some of {axis.tolist()}, got {low!r} and {high!r}")  # fmt: skip
            axes[name], box[k] = axis[first:last], slice(int(first), int(last))
        return self._best(self._speeds[tuple(box)], axes)

    def largest_basin(self, speed: float) -> dict[str, float]:
        """The stable design with the largest basin that walks at least so fast; of several the fastest.

        Raises
        ------
        ValueError
            If there are no basin sizes, or the speed is outside its range.
        NoGaitError
            If no stable design is so fast.
        """
        if self.basins is None:
            raise ValueError("basins must be given to the atlas to ask for the largest one")
        require_number("speed", speed, 0.0, 1e6)
        axes = {name: self.basins[name].to_numpy() for name in self.axes}
        places = [np.searchsorted(self.axes[name], axes[name]) for name in self.axes]
        speeds = self._speeds[np.ix_(*places)]
        sizes = self.basins["basin"].to_numpy()
        merit = np.where((speeds >= speed) & (sizes >= 0.0), sizes + 1e-6 * speeds, -np.inf)
        best = self._best(merit, axes)
        size = self.basins["basin"].sel({name: best[name] for name in axes})
        return {**best, "basin": float(size)}

    def _axis(self, name: str) -> tuple[Vector, int]:
        require_choice("axis", name, list(self.axes))
        return self.axes[name], list(self.axes).index(name)

    def _best(self, merit: NDArray[np.floating], axes: Mapping[str, Vector]) -> dict[str, float]:
        """The design of the greatest merit, with what the map says of its gait."""
        place = np.unravel_index(int(np.argmax(merit)), merit.shape)
        if not merit[place] > -np.inf:
            raise NoGaitError("no design of the atlas is as wanted: widen the limits, or ask for less")  # fmt: skip
        design = {name: float(axis[k]) for (name, axis), k in zip(axes.items(), place, strict=True)}
        gait = self.gaits.sel(design)
        numbers = ("speed", "spectral_radius", "step_length", "least_normal_force", "greatest_friction")  # fmt: skip
        return {**design, **{name: float(gait[name]) for name in numbers}}
