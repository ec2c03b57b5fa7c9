"""How far from its gait a walker may be put: basins of attraction, largest disturbances and pushes survived."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.analysis.filling import (
    Arrays,
    Box,
    Columns,
    Layout,
    fill_grid,
    values_in,
    write_box,
)
from lean_yaw_env.analysis.limit_cycle import LimitCycle, find_limit_cycle
from lean_yaw_env.analysis.many_walks import ENDINGS, SURVIVED, walk_many
from lean_yaw_env.analysis.section_map import (
    CommandArguments,
    SectionMap,
    WalkerOrMap,
    section_map_of,
)
from lean_yaw_env.analysis.storage import require_axis
from lean_yaw_env.engine import ONE_THREAD, Engine
from lean_yaw_env.parameters import QUARTER_TURN, Vector
from lean_yaw_env.validation import (
    require_choice,
    require_count,
    require_flag,
    require_instance,
    require_number,
    require_pair,
)

if TYPE_CHECKING:
    import xarray
    from typing_extensions import Unpack

PUSHED = ("stance_pitch_rate", "ankle_rate")
"""Rates that a push changes, the first along the direction zero."""

_DISTURBANCES, _PUSHES = 64, 32
"""Sizes tried at once of a disturbance and of a push; each round narrows the bracket by as much."""
_BOUNDED = ("stance_pitch", "ankle_angle")
"""Angles that must stay within a right angle."""


def basin(
    walker: WalkerOrMap,
    x: tuple[str, Sequence[float] | Vector],
    y: tuple[str, Sequence[float] | Vector],
    *,
    centre: Vector | None = None,
    n_steps: int = 60,
    path: str | Path | None = None,
    engine: Engine = ONE_THREAD,
    progress: bool = False,
    **command: Unpack[CommandArguments],
) -> xarray.Dataset:
    """Walk from every point of a plane of the section.

    Parameters
    ----------
    walker : Walker, PassiveWalker or SectionMap
    x, y : (name, values)
        Two coordinates of the state with their values; the others are the centre's.
    centre : shape (k,), optional
        A state in the plane; by default the gait's. With it no gait is looked for.
    n_steps : int >= 1
        A walk of so many steps counts as survived. A fall comes within some ten of them; how long the way back takes is in the multipliers.
    path, engine, progress : see ``fill_grid``
        Called again with the same path, an interrupted basin goes on where it was.
    inter_leg_angle, mass_offset : see ``find_limit_cycle``

    Returns
    -------
    xarray.Dataset
        Over x and y: ``steps`` completed, ``ending`` (0 survived, otherwise how it fell, see the variable's ``meanings``), and without a
        ``centre`` the ``distance`` of the last state from the gait (largest coordinate of the free ones, on the foot that stands).
        Attribute ``centre``: the state by coordinate, as JSON.

    Raises
    ------
    ValueError
        If an argument is outside its range, or the store holds another basin.
    NoGaitError
        If there is no gait.
    """
    require_count("n_steps", n_steps, 1, 1_000_000)
    section_map = section_map_of(walker, **command)
    cycle = find_limit_cycle(section_map) if centre is None else None
    middle = require_centre(section_map, centre) if cycle is None else cycle.state
    x, y = (require_pair(*axis, "coordinate, values") for axis in (("x", x), ("y", y)))
    if x[0] == y[0]:
        raise ValueError(f"x and y must be different coordinates, got {x[0]!r} twice")
    walks = _Walks(section_map, require_plane(section_map, dict((x, y))), middle, n_steps, cycle)
    columns = {"ending": np.full(1, -1.0), "steps": np.zeros(1)}
    if cycle is not None:
        columns["distance"] = np.full(1, np.nan)
    named = dict(zip(section_map.names, middle.round(12).tolist(), strict=True))
    meanings = json.dumps({str(int(key)): text for key, text in ENDINGS.items()})
    layout = Layout(
        "basin", walks.axes, columns, {**section_map.question(), "n_steps": n_steps},
        attrs={"centre": json.dumps(named)}, notes={"ending": {"meanings": meanings}},
        is_threadsafe=section_map.is_threadsafe,
    )  # fmt: skip
    return fill_grid(layout, walks, path, engine, progress)


@dataclass(frozen=True)
class _Walks:
    """Walks from the states of a region."""

    section_map: SectionMap
    axes: dict[str, Vector]
    centre: Vector
    n_steps: int
    cycle: LimitCycle | None

    def __call__(self, arrays: Arrays, region: Box, number: int) -> int:
        states = states_in(self.section_map, self.axes, region, self.centre)
        walks = walk_many(self.section_map, states, self.n_steps)
        columns: Columns = {"ending": walks.endings, "steps": walks.steps}
        if self.cycle is not None:
            on_foot = np.array([self.cycle.state, self.cycle.steps[0].state])[walks.steps % 2]
            apart = np.abs(walks.states - on_foot)[:, self.section_map.free]
            columns["distance"] = apart.max(axis=1)
        write_box(arrays, region, columns)
        return 0


def require_centre(section_map: SectionMap, centre: Any) -> Vector:
    """Return a state of a map as its ``require_state`` does; the message calls it ``centre``."""
    try:
        return section_map.require_state(centre)
    except ValueError as error:
        raise ValueError(f"centre: {error}") from error


def require_plane(
    section_map: SectionMap, axes: Mapping[str, Sequence[float] | Vector]
) -> dict[str, Vector]:
    """The axes of a slice or box of the section, or ``ValueError`` if a name is no coordinate, or its values do not grow or leave its range."""
    checked: dict[str, Vector] = {}
    for name, values in axes.items():
        _index(section_map, name)
        bound = QUARTER_TURN if name in _BOUNDED else 1e6
        checked[name] = require_axis(f"values of {name}", values, -bound, bound)
    return checked


def states_in(
    section_map: SectionMap, axes: Mapping[str, Vector], box: Box, centre: Vector
) -> Vector:
    """The states (n, k) of a part of a slice or box of the section, the other coordinates those of ``centre`` (k,)."""
    columns = np.column_stack([*values_in(axes, box).values()])
    states = np.tile(centre, (len(columns), 1))
    states[:, [section_map.names.index(name) for name in axes]] = columns
    return states


@dataclass(frozen=True)
class Disturbance:
    """The largest change of one coordinate of a gait's state that the walker survives.

    Attributes
    ----------
    gait_value : float
        The coordinate in the gait.
    largest, relative : float
        The change, in the coordinate's unit, with its sign, and as a share of the gait's value: 2.0 is +200 %. All smaller ones tried are survived.
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
    walker: WalkerOrMap,
    coordinate: str,
    *,
    upward: bool = True,
    relative: bool = True,
    most: float = 5.0,
    tolerance: float = 1e-4,
    n_steps: int = 60,
    **command: Unpack[CommandArguments],
) -> Disturbance:
    """Search for the largest disturbance of one coordinate that the gait survives.

    Parameters
    ----------
    walker : Walker, PassiveWalker or SectionMap
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
    require_flag("upward", upward)
    require_flag("relative", relative)
    require_number("most", most, 0.0, 1e6, "(]")
    require_number("tolerance", tolerance, 0.0, most, "(]")
    section_map = section_map_of(walker, **command)
    index = _index(section_map, coordinate)
    cycle = find_limit_cycle(section_map)
    value = float(cycle.state[index])
    if relative and value == 0.0:
        raise ValueError(f"{coordinate} is 0 in the gait: ask for an absolute disturbance")
    unit = (value if relative else 1.0) * (1.0 if upward else -1.0)
    reach = most
    if coordinate in _BOUNDED:
        room = QUARTER_TURN - (value if unit > 0.0 else -value)
        reach = min(most, 0.999 * room / abs(unit))
    way = unit * np.eye(len(cycle.state))[[index]]
    sizes, endings = _largest_survived(cycle, way, reach, tolerance, _DISTURBANCES, n_steps)
    largest, ending = float(sizes[0]) * unit, float(endings[0])
    return Disturbance(
        coordinate=coordinate,
        gait_value=value,
        largest=largest,
        relative=largest / value if value != 0.0 else float("nan"),
        is_limited=ending != SURVIVED,
        fall=ENDINGS[ending] if ending != SURVIVED else "",
    )


@dataclass(frozen=True)
class LargestPushes:
    """The largest pushes that a gait survives, by direction.

    Attributes
    ----------
    angles : shape (n,)
        rad; zero adds to the stance pitch rate (it is negative: slows the walker), a quarter turn to the ankle rate.
    sizes : shape (n,)
        All smaller ones tried are survived, to the ``tolerance``; rad / time unit.
    is_limited : bool, shape (n,)
        Whether a larger one fells the walker; otherwise ``sizes`` is as far as was looked.
    """

    angles: Vector
    sizes: Vector
    is_limited: NDArray[np.bool_]
    tolerance: float


def largest_pushes(
    cycle: LimitCycle, *, directions: int = 24, most: float = 1.6, n_steps: int = 60
) -> LargestPushes:
    """Push the rates at the start of a left step of a gait, in every direction ever harder, until the walker falls.

    Parameters
    ----------
    cycle : LimitCycle
    directions : int >= 1
        All round, evenly, from the direction zero.
    most : float > 0
        How far to look, rad / time unit.
    n_steps : int >= 1
        A walk of so many steps counts as survived.

    Raises
    ------
    ValueError
        If an argument is outside its range.
    SolverError
        If the integrator fails.
    """
    require_instance("cycle", cycle, LimitCycle)
    require_count("directions", directions, 1, 3600)
    require_number("most", most, 0.0, 100.0, "(]")
    angles = 2.0 * np.pi * np.arange(directions) / directions
    ways = push_ways(cycle.section_map, angles)
    tolerance = most / _PUSHES**2
    sizes, endings = _largest_survived(cycle, ways, most, tolerance, _PUSHES, n_steps)
    return LargestPushes(angles, sizes, endings != SURVIVED, tolerance)


def push_ways(section_map: SectionMap, angles: Vector) -> Vector:
    """Changes (n, k) of a state by pushes of size one in directions (n,)."""
    ways = np.zeros((len(angles), len(section_map.names)))
    for name, share in zip(PUSHED, (np.cos(angles), np.sin(angles)), strict=True):
        ways[:, section_map.names.index(name)] = share
    return ways


def _largest_survived(
    cycle: LimitCycle, ways: Vector, most: float, tolerance: float, sections: int, n_steps: int
) -> tuple[Vector, Vector]:
    """How far a gait's state may be moved along each of the ways (n, k), and how the walk from a little farther ends (0 where nothing falls).

    A scan finds the first of some sizes at which the walker falls; further ones narrow that bracket until it is as small as the tolerance.
    """
    low, width = np.zeros(len(ways)), most
    endings = np.zeros(len(ways))
    going = np.arange(len(ways))
    is_first = True
    while going.size and (is_first or width > tolerance):
        sizes = low[going, None] + width * np.arange(1, sections + 1) / sections
        states = cycle.state + sizes[:, :, None] * ways[going, None, :]
        starts = states.reshape(-1, cycle.state.size)
        walks = walk_many(cycle.section_map, starts, n_steps).require_solved()
        ended = walks.endings.reshape(going.size, sections)
        falls = ended != SURVIVED
        falls[:, -1] |= not is_first  # the bracket's end, but for rounding
        is_limited = falls.any(axis=1)
        low[going[~is_limited]] = most
        going, first, ended = going[is_limited], falls[is_limited].argmax(axis=1), ended[is_limited]
        width /= sections
        low[going] += first * width
        found = np.take_along_axis(ended, first[:, None], axis=1)[:, 0]
        endings[going] = np.where(found != SURVIVED, found, endings[going])
        is_first = False
    return low, endings


def _index(section_map: SectionMap, coordinate: str) -> int:
    require_choice("coordinate", coordinate, [section_map.names[i] for i in section_map.free])
    return section_map.names.index(coordinate)
