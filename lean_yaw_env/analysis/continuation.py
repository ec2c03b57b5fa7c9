"""Following a gait along a parameter, round folds, by pseudo-arclength continuation.

Each step along the branch is predicted along its tangent and corrected by Newton's method on the
section map with all its derivatives exact, the parameter's among them. Where a multiplier leaves or
enters the unit circle is located by a root finder along the branch.

A symmetric gait is followed as fixed point of one mirrored step, and its multipliers are of that; a
stride's are their squares. A multiplier of -1 of the mirrored step, +1 of the stride, is where a
gait begins that repeats after two steps: one that limps, or, in a three-dimensional mode, turns.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

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
from lean_yaw_env.analysis.progress import Counter
from lean_yaw_env.analysis.section_map import SectionMap, section_map_of
from lean_yaw_env.errors import LeanYawError, NoGaitError
from lean_yaw_env.parameters import INTER_LEG_ANGLE, Vector
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.validation import require_count, require_number
from lean_yaw_env.walker import Walker

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

    def cycle(self, index: int) -> LimitCycle:
        """The gait at a point of the branch."""
        moved = self.section_map.moved(self.parameter, float(self.values[index]))
        return cycle_at(moved, self.states[index])


def continue_gait(
    walker: Walker | PassiveWalker | SectionMap,
    parameter: str,
    limits: tuple[float, float],
    *,
    state: Vector | None = None,
    n_steps: int | None = None,
    inter_leg_angle: float = INTER_LEG_ANGLE,
    mass_offset: float | tuple[float, float] = 0.0,
    upward: bool = True,
    longest_step: float = 0.05,
    most_points: int = 1000,
    progress: bool = False,
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
    inter_leg_angle, mass_offset : see ``find_limit_cycle``
    upward : bool
        Whether the parameter grows at first.
    longest_step : (0, 1]
        Of the arclength, in which the interval has length one and ``STATE_SCALE`` too.
    most_points : int >= 2
    progress : bool
        Show a counter of points.

    Raises
    ------
    NoGaitError
        If there is no gait to start from.
    ValueError
        If an argument is outside its range.
    """
    simple = section_map_of(walker, inter_leg_angle=inter_leg_angle, mass_offset=mass_offset)
    section_map = simple.along(parameter) if n_steps is None else simple.over(n_steps)
    low, high = _require_limits(limits, parameter, section_map.value(parameter))
    require_number("longest_step", longest_step, 0.0, 1.0, "(]")
    require_count("most_points", most_points, 2, 1_000_000)
    start = find_limit_cycle(simple).state if state is None else section_map.require_state(state)
    neutral = np.abs(cycle_at(section_map, start).eigenvalues - 1.0) < section_map.neutral_within
    curve = _Curve(section_map, parameter, start, high - low, int(neutral.sum()))
    point = curve.start(1.0 if upward else -1.0)
    points, events = [point], []
    step, ended = min(_FIRST_STEP, longest_step), "the asked number of points"
    with Counter("continuation", progress) as counter:
        while len(points) < most_points:
            following, step, why = _next_point(curve, points[-1], step, longest_step, (low, high))
            if following is None:
                ended = why
                break
            events.extend(_events(curve, points[-1], following))
            points.append(following)
            counter.advance()
            if curve.value(following) in (low, high):
                ended = f"{parameter} reached {curve.value(following):g}"
                break
    return Branch(
        parameter=parameter,
        values=np.array([curve.value(p) for p in points]),
        states=np.array([curve.state(p.place) for p in points]),
        eigenvalues=np.array([p.eigenvalues for p in points]),
        n_steps=section_map.n_steps,
        events=tuple(events),
        ended=ended,
        section_map=section_map,
    )


@dataclass(frozen=True)
class _Point:
    """A point of the branch in scaled coordinates, the parameter last; its tangent, multipliers."""

    place: Vector
    tangent: Vector
    eigenvalues: NDArray[np.complex128]
    answering: NDArray[np.complex128]
    """The eigenvalues without those that are neutral all along the branch."""
    iterations: int
    limit: float | None = None
    """The parameter's value, where it is a limit that rounding must not pass."""


@dataclass(frozen=True)
class _Curve:
    """The scaled curve of fixed points in the space of free coordinates and parameter."""

    section_map: SectionMap
    parameter: str
    template: Vector
    parameter_scale: float
    neutral: int
    """How many multipliers are neutral wherever the gait is."""

    @property
    def scales(self) -> Vector:
        return np.append(np.full(len(self.section_map.free), STATE_SCALE), self.parameter_scale)

    @property
    def residual_limit(self) -> float:
        return max(_RESIDUAL, self.section_map.precision)

    def _solved(self, bordered: Vector, wanted: Vector) -> Vector:
        return least_change(bordered, wanted, self.section_map.precision)

    def value(self, point: _Point) -> float:
        return float(point.place[-1] * self.parameter_scale) if point.limit is None else point.limit

    def state(self, place: Vector) -> Vector:
        state = self.template.copy()
        state[self.section_map.free] = (place * self.scales)[:-1]
        return state

    def equations(self, place: Vector, limit: float | None) -> tuple[Vector, Vector, Vector]:
        """Residual (m,), its scaled derivative (m, m + 1), and the map's own Jacobian (m, m)."""
        value = float(place[-1] * self.parameter_scale) if limit is None else limit
        moved = self.section_map.moved(self.parameter, value)
        free, state = self.section_map.free, self.state(place)
        image, matrix, by_parameter = moved.sensitivity(state, self.parameter)
        own = matrix[np.ix_(free, free)]
        whole = np.column_stack([own - np.eye(len(free)), by_parameter[free]])
        return (image - state)[free], whole * self.scales, own

    def start(self, direction: float) -> _Point:
        place = (
            np.append(self.template[self.section_map.free], self.section_map.value(self.parameter))
            / self.scales
        )
        along = np.zeros(place.size)
        along[-1] = direction
        return self.corrected(place, along, self.section_map.value(self.parameter))

    def corrected(self, place: Vector, along: Vector, limit: float | None = None) -> _Point:
        """The branch's point in the plane through ``place`` square to ``along``.

        With ``limit``, ``along`` is along the parameter, which has that value in the plane.

        Raises
        ------
        NoGaitError, ValueError
            If Newton's method does not reach it.
        """
        anchor = place
        for iteration in range(_NEWTON_STEPS):
            residual, slope, own = self.equations(place, limit)
            bordered = np.vstack([slope, along])
            if iteration > 0 and float(np.abs(residual).max()) < self.residual_limit:
                tangent = self._solved(bordered, np.append(np.zeros(residual.size), 1.0))
                eigenvalues = sorted_eigenvalues(own)
                nearest_one = np.argsort(np.abs(eigenvalues - 1.0), kind="stable")
                return _Point(
                    place=place,
                    tangent=tangent / np.linalg.norm(tangent),
                    eigenvalues=eigenvalues,
                    answering=eigenvalues[np.sort(nearest_one[self.neutral :])],
                    iterations=iteration,
                    limit=limit,
                )
            miss = np.append(residual, along @ (place - anchor))
            place = place - self._solved(bordered, miss)
        raise NoGaitError("Newton's method does not reach the branch")

    def beyond(self, point: _Point, length: float) -> _Point:
        """The branch's point at this arclength along the tangent."""
        return self.corrected(point.place + length * point.tangent, point.tangent)


def _next_point(
    curve: _Curve, point: _Point, step: float, longest: float, limits: tuple[float, float]
) -> tuple[_Point | None, float, str]:
    """The next point with the step to try after it, or None and why the branch ends."""
    why = ""
    while step >= _SMALLEST_STEP:
        try:
            found = _attempt(curve, point, step, limits)
        except (LeanYawError, ValueError, np.linalg.LinAlgError) as error:
            why, step = str(error), 0.5 * step
            continue
        if found.tangent @ point.tangent < _MOST_TURN:
            why, step = "the branch turns too sharply", 0.5 * step
            continue
        factor = 1.5 if found.iterations <= 3 else 0.7 if found.iterations >= 6 else 1.0
        return found, min(step * factor, longest), ""
    return None, step, why


def _attempt(curve: _Curve, point: _Point, step: float, limits: tuple[float, float]) -> _Point:
    """The point a step further, or on the parameter's limit where the step would go beyond."""
    ahead = float(point.place[-1] + step * point.tangent[-1]) * curve.parameter_scale
    limit = min(max(ahead, limits[0]), limits[1])
    if limit == ahead:
        found = curve.beyond(point, step)
        if not limits[0] <= curve.value(found) <= limits[1]:
            raise NoGaitError("the branch leaves the interval")
        return found
    length = (limit / curve.parameter_scale - point.place[-1]) / point.tangent[-1]
    along = np.zeros(point.place.size)
    along[-1] = np.sign(point.tangent[-1])
    return curve.corrected(point.place + length * point.tangent, along, limit)


def _fold_test(point: _Point) -> float:
    return float(point.tangent[-1])


def _plus_test(point: _Point) -> float:
    return float(np.real(np.prod(point.answering - 1.0)))


def _minus_test(point: _Point) -> float:
    return float(np.real(np.prod(point.answering + 1.0)))


def _pair_test(point: _Point) -> float:
    """The product over all pairs of (product of the two, less one): zero for a pair on the circle."""
    values = point.answering
    first, second = np.triu_indices(values.size, 1)
    return float(np.real(np.prod(values[first] * values[second] - 1.0)))


_TESTS: tuple[tuple[EventKind, Callable[[_Point], float], complex], ...] = (
    ("fold", _fold_test, 1.0),
    ("real +1", _plus_test, 1.0),
    ("real -1", _minus_test, -1.0),
    ("complex pair", _pair_test, 1j),
)


def _events(curve: _Curve, point: _Point, following: _Point) -> list[Event]:
    """Crossings of the unit circle between two points, in their order."""
    whole = float((following.place - point.place) @ point.tangent)
    found: list[tuple[float, Event]] = []
    for kind, test, circle in _TESTS:
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
        if eigenvalue is None:
            continue
        if any(
            other.kind == "fold" and kind == "real +1" and abs(at - length) < 1e-6
            for at, other in found
        ):
            continue  # a fold is a real +1 already
        outside = [int((np.abs(p.answering) > 1.0).sum()) for p in (point, following)]
        event = Event(
            kind, curve.value(place), curve.state(place.place), eigenvalue, outside[1] > outside[0]
        )
        found.append((length, event))
    return [event for _, event in sorted(found, key=lambda pair: pair[0])]


def _critical(point: _Point, kind: EventKind, circle: complex) -> complex | None:
    """The multiplier on the circle; None for two real ones whose product is one."""
    values = point.answering
    if kind != "complex pair":
        return complex(values[np.argmin(np.abs(values - circle))])
    upper = values[np.imag(values) > _NOT_REAL]
    if upper.size == 0 or np.abs(np.abs(upper) - 1.0).min() > _SAME_PLACE**0.5:
        return None
    return complex(upper[np.argmin(np.abs(np.abs(upper) - 1.0))])


def _require_limits(
    limits: tuple[float, float], parameter: str, value: float
) -> tuple[float, float]:
    low, high = (float(limit) for limit in limits)
    if not low < high:
        raise ValueError(f"limits must be (low, high) with low < high, got {limits!r}")
    if not low <= value <= high:
        raise ValueError(f"limits must hold the start's {parameter}, {value:g}, got {limits!r}")
    return low, high
