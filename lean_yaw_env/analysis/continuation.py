"""Following a gait along a parameter, round folds, by pseudo-arclength continuation.

Each step along the branch is predicted along its tangent and corrected by Newton's method on the section map with all its derivatives exact,
the parameter's among them. Where a multiplier leaves or enters the unit circle is located by a root finder along the branch.

A symmetric gait is followed as fixed point of one mirrored step, and its multipliers are of that; a stride's are their squares. A multiplier
of -1 of the mirrored step, +1 of the stride, is where a gait begins that repeats after two steps: one that limps, or, in a
three-dimensional mode, turns.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from lean_yaw_env.analysis.fixed_point import least_change
from lean_yaw_env.analysis.limit_cycle import (
    LimitCycle,
    cycle_at,
    find_limit_cycle,
    sorted_eigenvalues,
    spectral_radii,
)
from lean_yaw_env.analysis.section_map import (
    CommandArguments,
    SectionMap,
    WalkerOrMap,
    section_map_of,
)
from lean_yaw_env.analysis.storage import progress_bar
from lean_yaw_env.errors import LeanYawError, NoGaitError
from lean_yaw_env.parameters import Vector
from lean_yaw_env.validation import (
    require_count,
    require_finite,
    require_flag,
    require_number,
    require_pair,
)

if TYPE_CHECKING:
    from typing_extensions import Unpack

EventKind = Literal["fold", "real +1", "real -1", "complex pair"]

STATE_SCALE = 0.3
"""A change of a coordinate by this counts as much as the parameter's whole range."""
_FIRST_STEP = 0.01
_SMALLEST_STEP = 1e-6
_NEWTON_STEPS = 10
_RESIDUAL = 1e-11
_MOST_TURN = 0.9
"""Least cosine of the angle between the tangents at a step's ends."""
_NOT_REAL = 1e-6
_SAME_PLACE = 1e-9


@dataclass(frozen=True)
class Event:
    """A place on a branch where a multiplier crosses the unit circle.

    Attributes
    ----------
    kind : "fold", "real +1", "real -1" or "complex pair"
        A fold is a real +1 where the branch turns back in the parameter.
    value : float
        Of the parameter.
    state : shape (k,)
    eigenvalue : complex
        The multiplier on the unit circle, of the branch's map.
    is_leaving : bool
        Whether the number of multipliers outside the unit circle grows along the branch.
    """

    kind: EventKind
    value: float
    state: Vector
    eigenvalue: complex
    is_leaving: bool


@dataclass(frozen=True)
class Branch:
    """A gait followed along a parameter, in the order in which it was followed.

    Attributes
    ----------
    parameter : str
    values : shape (n,)
        Of the parameter; not monotonic past a fold.
    states : shape (n, k)
    eigenvalues : shape (n, m), complex
        Of the map over ``n_steps``: mirrored steps for a symmetric gait, by falling magnitude.
    n_steps : int
    events : tuple of Event
    ended : str
        Why the branch ends.
    section_map : SectionMap
        The map at the start of the branch.
    """

    parameter: str
    values: Vector
    states: Vector
    eigenvalues: NDArray[np.complex128]
    n_steps: int
    events: tuple[Event, ...]
    ended: str
    section_map: SectionMap

    @property
    def is_stable(self) -> NDArray[np.bool_]:
        """Whether the gait at each point is stable, shape (n,)."""
        return spectral_radii(self.eigenvalues, self.section_map.neutral_within) < 1.0

    @property
    def ends_of_stability(self) -> list[float]:
        """Values of the parameter at which a multiplier leaves the unit circle, in the branch's order."""
        return [event.value for event in self.events if event.is_leaving]

    def cycle(self, index: int) -> LimitCycle:
        """The gait at a point of the branch."""
        require_count("index", index, -len(self.values), len(self.values) - 1)
        moved = self.section_map.moved(self.parameter, float(self.values[index]))
        return cycle_at(moved, self.states[index])


def continue_gait(
    walker: WalkerOrMap,
    parameter: str,
    limits: tuple[float, float],
    *,
    state: Vector | None = None,
    n_steps: int | None = None,
    upward: bool = True,
    longest_step: float = 0.05,
    most_points: int = 1000,
    progress: bool = False,
    **command: Unpack[CommandArguments],
) -> Branch:
    """Follow a gait along a parameter until it leaves an interval, ends, or enough points are known.

    Parameters
    ----------
    walker : Walker, PassiveWalker or SectionMap
        Where the branch starts.
    parameter : str
        One of the map's ``parameters``: of any map ``BODY_PARAMETERS``, of the active walker ``COMMAND_PARAMETERS`` too.
    limits : (low, high)
        Interval of the parameter, which holds its value at the start.
    state : shape (k,), optional
        A gait's section state to start from; by default ``find_limit_cycle``'s.
    n_steps : int, optional
        Steps until ``state`` recurs; by default the fewest for a simple gait.
    upward : bool
        Whether the parameter grows at first.
    longest_step : (0, 1]
        Of the arclength, in which the interval has length one and ``STATE_SCALE`` too.
    most_points : int >= 2
    progress : bool
        Show a counter of points.
    inter_leg_angle, mass_offset : see ``find_limit_cycle``

    Raises
    ------
    NoGaitError
        If there is no gait to start from.
    ValueError
        If an argument is outside its range.
    """
    simple = section_map_of(walker, **command)
    section_map = simple.along(parameter) if n_steps is None else simple.over(n_steps)
    value = section_map.value(parameter)
    low, high = (
        require_finite("limits", limit) for limit in require_pair("limits", limits, "low, high")
    )
    if not low < high:
        raise ValueError(f"limits must be (low, high) with low < high, got {limits!r}")
    if not low <= value <= high:
        raise ValueError(f"limits must hold the start's {parameter}, {value:g}, got {limits!r}")
    require_flag("upward", upward)
    require_flag("progress", progress)
    require_number("longest_step", longest_step, 0.0, 1.0, "(]")
    require_count("most_points", most_points, 2, 1_000_000)
    start = find_limit_cycle(simple).state if state is None else section_map.require_state(state)
    curve = _Curve(section_map, parameter, start, (low, high))
    points, events = [curve.start(1.0 if upward else -1.0)], []
    step, ended = min(_FIRST_STEP, longest_step), "the asked number of points"
    with closing(progress_bar("continuation", progress)) as bar:
        while len(points) < most_points:
            following, step, why = _next_point(curve, points[-1], step, longest_step)
            if following is None:
                ended = why
                break
            events.extend(_events(curve, points[-1], following))
            points.append(following)
            bar.update()
            if following.value in (low, high):
                ended = f"{parameter} reached {following.value:g}"
                break
    return Branch(
        parameter=parameter,
        values=np.array([point.value for point in points]),
        states=np.array([point.state for point in points]),
        eigenvalues=np.array([point.eigenvalues for point in points]),
        n_steps=section_map.n_steps,
        events=tuple(events),
        ended=ended,
        section_map=section_map,
    )


@dataclass(frozen=True)
class _Point:
    """A point of the branch: its ``place`` and ``tangent`` in scaled coordinates, the parameter last, and what is there.

    ``answering`` are the eigenvalues without those that are neutral all along the branch; so many ``iterations`` of Newton's method led to it.
    """

    place: Vector
    tangent: Vector
    value: float
    state: Vector
    eigenvalues: NDArray[np.complex128]
    answering: NDArray[np.complex128]
    iterations: int


class _Curve:
    """The scaled curve of fixed points in the space of free coordinates and parameter, within limits of the parameter."""

    def __init__(
        self, section_map: SectionMap, parameter: str, start: Vector, limits: tuple[float, float]
    ) -> None:
        self.limits, self.range = limits, limits[1] - limits[0]
        self._map, self._parameter, self._start = section_map, parameter, start
        self._free = section_map.free
        self._scales = np.append(np.full(len(self._free), STATE_SCALE), self.range)
        self._residual_limit = max(_RESIDUAL, section_map.precision)
        from_one = np.abs(cycle_at(section_map, start).eigenvalues - 1.0)
        self._neutral = int((from_one < section_map.neutral_within).sum())

    def start(self, direction: float) -> _Point:
        """The point to start from, where the parameter grows or falls at first."""
        value = self._map.value(self._parameter)
        place = np.append(self._start[self._free], value) / self._scales
        return self.corrected(place, direction * np.eye(place.size)[-1], value)

    def corrected(self, place: Vector, along: Vector, limit: float | None = None) -> _Point:
        """The branch's point in the plane through ``place`` square to ``along``.

        With ``limit``, ``along`` is along the parameter, which has exactly that value in the plane, whatever the rounding of its place.

        Raises
        ------
        NoGaitError, ValueError
            If Newton's method does not reach it.
        """
        anchor, free = place, self._free
        for iteration in range(_NEWTON_STEPS):
            value = float(place[-1] * self.range) if limit is None else limit
            state = self._start.copy()
            state[free] = (place * self._scales)[:-1]
            moved = self._map.moved(self._parameter, value)
            image, matrix, by_parameter = moved.sensitivity(state, self._parameter)
            own, residual = matrix[np.ix_(free, free)], (image - state)[free]
            slope = np.column_stack([own - np.eye(len(free)), by_parameter[free]]) * self._scales
            bordered = np.vstack([slope, along])
            if iteration > 0 and float(np.abs(residual).max()) < self._residual_limit:
                tangent = self._solved(bordered, np.append(np.zeros(residual.size), 1.0))
                tangent /= np.linalg.norm(tangent)
                eigenvalues = sorted_eigenvalues(own)
                nearest_one = np.argsort(np.abs(eigenvalues - 1.0), kind="stable")
                answering = eigenvalues[np.sort(nearest_one[self._neutral :])]
                return _Point(place, tangent, value, state, eigenvalues, answering, iteration)
            miss = np.append(residual, along @ (place - anchor))
            place = place - self._solved(bordered, miss)
        raise NoGaitError("Newton's method does not reach the branch")

    def beyond(self, point: _Point, length: float) -> _Point:
        """The branch's point at this arclength along the tangent."""
        return self.corrected(point.place + length * point.tangent, point.tangent)

    def _solved(self, bordered: Vector, wanted: Vector) -> Vector:
        return least_change(bordered, wanted, self._map.precision)


def _next_point(
    curve: _Curve, point: _Point, step: float, longest: float
) -> tuple[_Point | None, float, str]:
    """The next point with the step to try after it, or None and why the branch ends."""
    why = ""
    while step >= _SMALLEST_STEP:
        try:
            found = _attempt(curve, point, step)
        except (LeanYawError, ValueError, np.linalg.LinAlgError) as error:
            why, step = str(error), 0.5 * step
            continue
        if found.tangent @ point.tangent < _MOST_TURN:
            why, step = "the branch turns too sharply", 0.5 * step
            continue
        factor = 1.5 if found.iterations <= 3 else 0.7 if found.iterations >= 6 else 1.0
        return found, min(step * factor, longest), ""
    return None, step, why


def _attempt(curve: _Curve, point: _Point, step: float) -> _Point:
    """The point a step further, or on the parameter's limit where the step would go beyond."""
    low, high = curve.limits
    ahead = float(point.place[-1] + step * point.tangent[-1]) * curve.range
    limit = min(max(ahead, low), high)
    if limit == ahead:
        found = curve.beyond(point, step)
        if not low <= found.value <= high:
            raise NoGaitError("the branch leaves the interval")
        return found
    length = (limit / curve.range - point.place[-1]) / point.tangent[-1]
    along = np.sign(point.tangent[-1]) * np.eye(point.place.size)[-1]
    return curve.corrected(point.place + length * point.tangent, along, limit)


def _pair_test(point: _Point) -> float:
    """The product over all pairs of (product of the two, less one): zero for a pair on the circle."""
    values = point.answering
    first, second = np.triu_indices(values.size, 1)
    return float(np.real(np.prod(values[first] * values[second] - 1.0)))


_TESTS: dict[EventKind, tuple[Callable[[_Point], float], complex]] = {
    "fold": (lambda point: float(point.tangent[-1]), 1.0),
    "real +1": (lambda point: float(np.real(np.prod(point.answering - 1.0))), 1.0),
    "real -1": (lambda point: float(np.real(np.prod(point.answering + 1.0))), -1.0),
    "complex pair": (_pair_test, 1j),
}
"""By the kind of event: a function that changes sign there, and the multiplier on the circle."""


def _events(curve: _Curve, point: _Point, following: _Point) -> list[Event]:
    """Crossings of the unit circle between two points, in their order."""
    whole = float((following.place - point.place) @ point.tangent)
    found: list[tuple[float, Event]] = []
    outside = [int((np.abs(each.answering) > 1.0).sum()) for each in (point, following)]
    for kind, (test, circle) in _TESTS.items():
        before, after = test(point), test(following)
        if before == 0.0 or before * after >= 0.0:
            continue

        def signed(length: float, test: Callable[[_Point], float] = test) -> float:
            return test(curve.beyond(point, length))

        try:
            length = float(brentq(signed, 0.0, whole, xtol=1e-12))  # pyright: ignore[reportArgumentType]
        except (LeanYawError, ValueError):
            continue  # the corrector fails in between: nothing can be said
        place = curve.beyond(point, length)
        eigenvalue = _critical(place, kind, circle)
        is_fold_too = kind == "real +1" and any(
            event.kind == "fold" and abs(at - length) < 1e-6 for at, event in found
        )
        if eigenvalue is None or is_fold_too:
            continue
        event = Event(kind, place.value, place.state, eigenvalue, outside[1] > outside[0])
        found.append((length, event))
    return [event for _, event in sorted(found, key=lambda pair: pair[0])]


def _critical(point: _Point, kind: EventKind, circle: complex) -> complex | None:
    """The multiplier on the circle; None for two real ones whose product is one."""
    values = point.answering
    if kind != "complex pair":
        return complex(values[np.argmin(np.abs(values - circle))])
    upper = values[np.imag(values) > _NOT_REAL]
    from_circle = np.abs(np.abs(upper) - 1.0)
    if from_circle.min(initial=np.inf) > _SAME_PLACE**0.5:
        return None
    return complex(upper[from_circle.argmin()])
