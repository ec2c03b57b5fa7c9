"""How far from its gait a walker may be put: basins of attraction, largest disturbances survived."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lean_yaw_env.analysis.limit_cycle import LimitCycle, find_limit_cycle
from lean_yaw_env.analysis.many_walks import ENDINGS, walk_many
from lean_yaw_env.analysis.progress import Counter
from lean_yaw_env.analysis.section_map import ActiveMap, PassiveMap, section_map_of
from lean_yaw_env.analysis.storage import labelled, load_dataset, require_same, save_dataset
from lean_yaw_env.errors import SolverError
from lean_yaw_env.kernel.records import FAILED
from lean_yaw_env.parameters import INTER_LEG_ANGLE, QUARTER_TURN, Vector, require_number
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.walker import Walker

if TYPE_CHECKING:
    import xarray

_CHUNK = 4096
_SECTIONS = 64
"""Sizes tried in one batch; each round narrows the bracket by as much."""
_BOUNDED = ("stance_pitch", "ankle_angle")
"""Angles that must stay within a right angle."""


def basin(
    walker: Walker | PassiveWalker,
    x: tuple[str, Sequence[float] | Vector],
    y: tuple[str, Sequence[float] | Vector],
    *,
    n_steps: int = 60,
    inter_leg_angle: float = INTER_LEG_ANGLE,
    mass_offset: float | tuple[float, float] = 0.0,
    path: str | Path | None = None,
    progress: bool = False,
) -> xarray.Dataset:
    """Walk from every point of a plane of the section through the gait.

    Parameters
    ----------
    walker : Walker or PassiveWalker
    x, y : (name, values)
        Two coordinates of the section state with their values; the others are the gait's.
    n_steps : int >= 1
        A walk of so many steps counts as survived. A fall comes within some ten of them; how long
        the way back takes is in the multipliers.
    inter_leg_angle, mass_offset : see ``find_limit_cycle``
    path : file name, optional
        Where to keep what is done, whole or not at all; an interrupted basin goes on from there.
    progress : bool

    Returns
    -------
    xarray.Dataset
        Over x and y: ``steps`` completed, ``ending`` (0 survived, otherwise how it fell, see the
        variable's ``meanings``), ``distance`` of the last state from the gait (largest coordinate
        of the free ones, mirrored to the left foot). Attribute ``gait``: the section state.

    Raises
    ------
    ValueError
        If an argument is outside its range, or the file holds another basin.
    NoGaitError
        If there is no gait.
    """
    require_number("n_steps", n_steps, 1, 1_000_000)
    section_map = section_map_of(walker, inter_leg_angle=inter_leg_angle, mass_offset=mass_offset)
    cycle = find_limit_cycle(walker, inter_leg_angle=inter_leg_angle, mass_offset=mass_offset)
    axes = {name: _axis(section_map, name, values) for name, values in (x, y)}
    if len(axes) != 2:
        raise ValueError(f"x and y must be different coordinates, not {x[0]!r} twice")
    states = np.tile(cycle.state, (axes[x[0]].size * axes[y[0]].size, 1))
    grid = np.meshgrid(axes[x[0]], axes[y[0]], indexing="ij")
    for name, values in zip(axes, grid, strict=True):
        states[:, section_map.names.index(name)] = values.ravel()
    n = len(states)
    result = {"steps": np.zeros(n), "ending": np.full(n, -1.0), "distance": np.full(n, np.nan)}
    fresh = _dataset(section_map, axes, result, cycle, n_steps)
    if path is not None and Path(path).exists():
        stored = load_dataset(path)
        require_same(stored, fresh, path)
        result = {name: stored[name].to_numpy().ravel().copy() for name in result}
    with Counter("basin", progress, n) as counter:
        waiting = np.flatnonzero(result["ending"] < 0.0)
        counter.advance(n - waiting.size)
        for first in range(0, waiting.size, _CHUNK):
            some = waiting[first : first + _CHUNK]
            walks = walk_many(section_map, states[some], int(n_steps))
            result["steps"][some] = walks.steps
            result["ending"][some] = walks.endings
            result["distance"][some] = _distance(
                section_map, walks.states, walks.steps.tolist(), cycle
            )
            counter.advance(some.size)
            if path is not None:
                save_dataset(_dataset(section_map, axes, result, cycle, n_steps), path)
    return _dataset(section_map, axes, result, cycle, n_steps)


@dataclass(frozen=True)
class Disturbance:
    """The largest change of one coordinate of a gait's state that the walker survives.

    Attributes
    ----------
    coordinate : str
    gait_value : float
        The coordinate in the gait.
    largest : float
        The change, in the coordinate's unit, with its sign; all smaller ones tried are survived.
    relative : float
        The same as a share of the gait's value: 2.0 is +200 %, -1.0 is -100 %.
    is_limited : bool
        Whether a larger one makes it fall; otherwise ``largest`` is as far as was looked.
    fall : str
        How it falls beyond, of ``ENDINGS``; empty if not limited.
    """

    coordinate: str
    gait_value: float
    largest: float
    relative: float
    is_limited: bool
    fall: str


def largest_disturbance(
    walker: Walker | PassiveWalker,
    coordinate: str,
    *,
    upward: bool = True,
    relative: bool = True,
    most: float = 5.0,
    tolerance: float = 1e-4,
    n_steps: int = 60,
    inter_leg_angle: float = INTER_LEG_ANGLE,
    mass_offset: float | tuple[float, float] = 0.0,
) -> Disturbance:
    """Search for the largest disturbance of one coordinate that the gait survives.

    Parameters
    ----------
    walker : Walker or PassiveWalker
    coordinate : name of a section coordinate
    upward : bool
        Whether to add to the coordinate. With ``relative``, to its magnitude: +100 % doubles it.
    relative : bool
        Whether ``most`` and ``tolerance`` are shares of the gait's value or in its unit.
    most : float > 0
        How far to look; where the angle would leave its range, less.
    tolerance : float > 0
        To which ``largest`` is known.
    n_steps : int >= 1
        A walk of so many steps counts as survived.
    inter_leg_angle, mass_offset : see ``find_limit_cycle``

    Raises
    ------
    ValueError
        If an argument is outside its range, or ``relative`` to a coordinate that is zero.
    NoGaitError
        If there is no gait.
    SolverError
        If the integrator fails.
    """
    require_number("most", most, 0.0, 1e6, "(]")
    require_number("tolerance", tolerance, 0.0, most, "(]")
    require_number("n_steps", n_steps, 1, 1_000_000)
    section_map = section_map_of(walker, inter_leg_angle=inter_leg_angle, mass_offset=mass_offset)
    index = _index(section_map, coordinate)
    cycle = find_limit_cycle(walker, inter_leg_angle=inter_leg_angle, mass_offset=mass_offset)
    value = float(cycle.state[index])
    if relative and value == 0.0:
        raise ValueError(f"{coordinate} is 0 in the gait: ask for an absolute disturbance")
    unit = (value if relative else 1.0) * (1.0 if upward else -1.0)
    reach = most
    if coordinate in _BOUNDED:
        room = QUARTER_TURN - (value if unit > 0.0 else -value)
        reach = min(most, 0.999 * room / abs(unit))
    low, high, fall = 0.0, reach, ""
    while True:
        sizes = low + (high - low) * np.arange(1, _SECTIONS + 1) / _SECTIONS
        states = np.tile(cycle.state, (sizes.size, 1))
        states[:, index] += sizes * unit
        walks = walk_many(section_map, states, int(n_steps))
        if np.any(walks.endings == FAILED):
            bad = states[np.argmax(walks.endings == FAILED)].tolist()
            raise SolverError(f"the walk from {bad} of {walker.parameters} did not converge")
        fallen = np.flatnonzero(~walks.survived)
        if not fallen.size:
            low = high
            break
        first = int(fallen[0])
        fall = ENDINGS[float(walks.endings[first])]
        high = float(sizes[first])
        low = float(sizes[first - 1]) if first else low
        if high - low <= tolerance:
            break
    largest = low * unit
    return Disturbance(
        coordinate=coordinate,
        gait_value=value,
        largest=largest,
        relative=largest / value if value != 0.0 else float("nan"),
        is_limited=bool(fall),
        fall=fall,
    )


def _index(section_map: ActiveMap | PassiveMap, coordinate: str) -> int:
    names = [section_map.names[i] for i in section_map.free]
    if coordinate not in names:
        raise ValueError(f"coordinate must be one of {', '.join(names)}; not {coordinate!r}")
    return section_map.names.index(coordinate)


def _axis(
    section_map: ActiveMap | PassiveMap, name: str, values: Sequence[float] | Vector
) -> Vector:
    _index(section_map, name)
    array = np.asarray(values, dtype=float)
    if array.ndim != 1 or array.size == 0 or np.any(np.diff(array) <= 0.0):
        raise ValueError(f"values of {name} must be growing numbers, not {values!r}")
    bound = QUARTER_TURN if name in _BOUNDED else 1e6
    if not np.all(np.abs(array) < bound):
        raise ValueError(f"values of {name} must be in ({-bound:g}, {bound:g}), not {values!r}")
    return array


def _distance(
    section_map: ActiveMap | PassiveMap, states: Vector, steps: Sequence[int], cycle: LimitCycle
) -> Vector:
    """From the gait on the foot that stands, in the free coordinates."""
    standing = {0: cycle.state, 1: section_map.over(2).results(cycle.state)[0].state}
    goals = np.array([standing[int(k) % 2] for k in steps])
    return np.abs(states - goals)[:, section_map.free].max(axis=1)


def _dataset(
    section_map: ActiveMap | PassiveMap,
    axes: dict[str, Vector],
    result: dict[str, Vector],
    cycle: LimitCycle,
    n_steps: int,
) -> xarray.Dataset:
    shape = tuple(axis.size for axis in axes.values())
    question = {
        "walker": type(section_map.walker).__name__,
        "parameters": asdict(section_map.walker.parameters),
        "n_steps": int(n_steps),
        "command": [section_map.inter_leg_angle, *section_map.mass_offset]
        if isinstance(section_map, ActiveMap)
        else [],
        "planar": isinstance(section_map, PassiveMap) and section_map.walker.planar,
    }
    meanings = {"meanings": json.dumps({str(int(k)): text for k, text in ENDINGS.items()})}
    return labelled().Dataset(
        {
            name: (list(axes), values.reshape(shape), meanings if name == "ending" else {})
            for name, values in result.items()
        },
        coords=axes,
        attrs={
            "question": json.dumps(question, sort_keys=True),
            "gait": json.dumps(cycle.state.round(12).tolist()),
        },
    )
