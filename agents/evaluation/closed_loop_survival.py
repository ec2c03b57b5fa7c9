"""What a walker with its agent survives: basins of attraction, a box of starts, the largest push in every direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agents.evaluation.closed_loop_gait import ClosedLoopGait
from agents.evaluation.closed_loop_map import ClosedLoop
from lean_yaw_env.envs import columns as c
from lean_yaw_env.kernel.records import STEPPED
from lean_yaw_env.parameters import STATE_FIELDS, Vector, require_number

SURVIVED = 0.0
"""Ending of a walk that goes on; otherwise the kernel's status, see ``lean_yaw_env.analysis.many_walks.ENDINGS``."""
STEPS = 100
"""Walked by what counts as survived: a fall for lack of balance comes within some ten."""

PLANES = (("ankle_angle", "ankle_rate"), ("stance_pitch_rate", "ankle_rate"))
"""Planes of the section in which basins are drawn."""
REACHES = {"ankle_angle": 0.3, "stance_pitch_rate": 0.4, "ankle_rate": 0.8}
"""How far from the start the planes and the box reach, rad and rad / time unit."""
PUSHED = ("stance_pitch_rate", "ankle_rate")
"""Rates that a push changes, the first along the direction zero."""

_CHUNK = 2048
_SECTIONS = 32  # sizes of a push tried at once
_NAMES = [field.name for field in STATE_FIELDS]


def walk_on(loop: ClosedLoop, states: Vector, n_steps: int = STEPS) -> Vector:
    """Walk from states (n, k) on the left foot, and return how each walk ends, shape (n,): ``SURVIVED``, or how it fell."""
    require_number("n_steps", n_steps, 1, 1_000_000)
    parts = [
        _walk_chunk(loop, states[first : first + _CHUNK], n_steps)
        for first in range(0, len(states), _CHUNK)
    ]
    return np.concatenate(parts)


def _walk_chunk(loop: ClosedLoop, states: Vector, n_steps: int) -> Vector:
    rows = loop.placed(states, 1.0)
    endings = np.zeros(len(states))
    walking = np.ones(len(states), dtype=np.bool_)
    for _ in range(n_steps):
        loop.advance(rows, walking)
        status = rows.outcomes[:, c.OUTCOME_STATUS]
        falls = walking & (status != STEPPED)
        endings[falls] = status[falls]
        walking &= ~falls
        if not walking.any():
            break
    return endings


@dataclass(frozen=True)
class BasinSlice:
    """Starts in a plane of the section, and how the walks from them end.

    Attributes
    ----------
    x, y : names of coordinates
    x_values, y_values : shapes (nx,), (ny,)
    centre : (x, y) of the start that the plane goes through
    endings : shape (nx, ny)
    """

    x: str
    y: str
    x_values: Vector
    y_values: Vector
    centre: tuple[float, float]
    endings: Vector

    @property
    def share(self) -> float:
        """Share of the starts survived."""
        return float((self.endings == SURVIVED).mean())


def basin_slice(
    loop: ClosedLoop, x: str, y: str, *, points: int = 61, n_steps: int = STEPS
) -> BasinSlice:
    """Walk from every point of a plane of the section through the loop's start, the same for every agent.

    Raises
    ------
    ValueError
        If a coordinate has no reach in ``REACHES``, or a number is out of its range.
    """
    require_number("points", points, 2, 2000)
    for name in (x, y):
        if name not in REACHES:
            raise ValueError(f"coordinate must be one of {', '.join(REACHES)}, not {name!r}")
    columns = [_NAMES.index(x), _NAMES.index(y)]
    axes = [
        loop.start[column] + REACHES[name] * np.linspace(-1.0, 1.0, points)
        for name, column in zip((x, y), columns, strict=True)
    ]
    states = np.tile(loop.start, (points * points, 1))
    states[:, columns] = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    endings = walk_on(loop, states, n_steps).reshape(points, points)
    centre = (float(loop.start[columns[0]]), float(loop.start[columns[1]]))
    return BasinSlice(x, y, axes[0], axes[1], centre, endings)


def box_survival(
    loop: ClosedLoop, *, starts: int = 4096, n_steps: int = STEPS
) -> NDArray[np.bool_]:
    """Which starts are survived of a box around the loop's start, ``REACHES`` wide to either side; the same starts for every agent.

    They are drawn evenly from a fixed seed, so that agents may be compared start by start.
    """
    require_number("starts", starts, 1, 1_000_000)
    places = np.random.default_rng(0).uniform(-1.0, 1.0, (int(starts), len(REACHES)))
    states = np.tile(loop.start, (starts, 1))
    for k, (name, reach) in enumerate(REACHES.items()):
        states[:, _NAMES.index(name)] += reach * places[:, k]
    return walk_on(loop, states, n_steps) == SURVIVED


@dataclass(frozen=True)
class LargestPushes:
    """The largest pushes that a gait survives, by direction.

    Attributes
    ----------
    angles : shape (n,)
        rad; zero adds to the stance pitch rate (it is negative: slows the walker), a quarter turn to the ankle rate.
    sizes : shape (n,)
        All smaller ones tried are survived; rad / time unit.
    is_limited : bool, shape (n,)
        Whether a larger one fells the walker; otherwise ``sizes`` is as far as was looked.
    tolerance : float
        To which sizes are known.
    """

    angles: Vector
    sizes: Vector
    is_limited: NDArray[np.bool_]
    tolerance: float


def largest_pushes(
    loop: ClosedLoop,
    gait: ClosedLoopGait,
    *,
    directions: int = 24,
    most: float = 1.6,
    n_steps: int = STEPS,
) -> LargestPushes:
    """Push the rates at the start of a left step of the gait, in every direction ever harder, until the walker falls.

    A scan finds the first size that fells it, a second one narrows that bracket.

    Raises
    ------
    ValueError
        If a number is out of its range.
    """
    require_number("directions", directions, 1, 3600)
    require_number("most", most, 0.0, 100.0, "(]")
    angles = 2.0 * np.pi * np.arange(directions) / directions
    low, high = np.zeros(directions), np.full(directions, most)
    is_limited = np.ones(directions, dtype=np.bool_)
    for _ in range(2):
        share = np.arange(1, _SECTIONS + 1) / _SECTIONS
        sizes = low[:, None] + (high - low)[:, None] * share
        states = gait.state + sizes.reshape(-1, 1) * np.repeat(
            pushed(gait.state, angles) - gait.state, _SECTIONS, axis=0
        )
        falls = walk_on(loop, states, n_steps).reshape(directions, _SECTIONS) != SURVIVED
        is_limited &= falls.any(axis=1)
        first = np.where(falls.any(axis=1), falls.argmax(axis=1), _SECTIONS - 1)
        low, high = (
            np.where(first > 0, np.take_along_axis(sizes, np.maximum(first - 1, 0)[:, None], 1)[:, 0], low),
            np.take_along_axis(sizes, first[:, None], 1)[:, 0],
        )  # fmt: skip
    return LargestPushes(angles, np.where(is_limited, low, most), is_limited, most / _SECTIONS**2)


def pushed(state: Vector, angles: Vector, size: float = 1.0) -> Vector:
    """States (n, k) after pushes of a size in directions (n,)."""
    states = np.tile(state, (len(angles), 1))
    for name, share in zip(PUSHED, (np.cos(angles), np.sin(angles)), strict=True):
        states[:, _NAMES.index(name)] += size * share
    return states
