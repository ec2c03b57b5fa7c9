"""Bicycle modes followed continuously in the speed and named: weave, capsize, caster (Figure 4)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise, permutations

import numpy as np
from numpy.typing import ArrayLike

from lean_yaw_env.validation import require_instance, require_vector
from lean_yaw_env.vehicles.bicycle import LinearBicycle
from lean_yaw_env.vehicles.stability import ComplexArray, FloatArray

BRANCH_NAMES = ("weave_upper", "weave_lower", "capsize", "caster")
"""Order of the branches. The weave is two branches: a conjugate pair, positive frequency first, or at low speed two real roots, the greater
first."""

UNNAMED_BRANCHES = ("mode_1", "mode_2", "mode_3", "mode_4")
"""Of a bicycle that at no speed has one oscillation and two real roots. Order: at the speed where the branches
start, oscillations before real roots, each by falling real part."""

_ASSIGNMENTS = np.array(list(permutations(range(4))))
_CLEAR = 0.3
"""The best assignment must cost less than this part of the next best one to be believed."""
_LONGEST_STEP = 0.05
"""Of the speed followed in one go, relative to the speed itself."""
_SHORTEST_STEP = 1e-7
"""Relative step below which two modes are taken as meeting: which is which has no meaning then."""
_SAME = 1e-7
"""Eigenvalues closer than this, relative to the greatest, are one and the same: round-off's square root is 1e-8."""


@dataclass(frozen=True, eq=False)
class EigenvalueBranches:
    """Eigenvalues against speed, one column for each mode.

    Attributes
    ----------
    names : of the columns, ``BRANCH_NAMES``, or ``UNNAMED_BRANCHES`` where those names have no meaning
    speeds : shape (n,), m / s
    eigenvalues : shape (n, 4), 1 / s
    mode_shapes : shape (n, 4, 2)
        (lean, steer), of unit length, lean real and not negative.
    """

    names: tuple[str, ...]
    speeds: FloatArray
    eigenvalues: ComplexArray
    mode_shapes: ComplexArray

    @property
    def weave(self) -> ComplexArray:
        """Both weave eigenvalues, shape (n, 2), 1 / s."""
        return self._named("weave_upper", "weave_lower")

    @property
    def capsize(self) -> ComplexArray:
        """Shape (n,), 1 / s; real unless it has joined another mode's pair."""
        return self._named("capsize")[:, 0]

    @property
    def caster(self) -> ComplexArray:
        """Shape (n,), 1 / s; real unless it has joined another mode's pair."""
        return self._named("caster")[:, 0]

    @property
    def is_weave_oscillatory(self) -> np.ndarray:
        """Whether the weave is a complex pair, shape (n,), bool."""
        return np.all(self.weave.imag != 0.0, axis=1)

    def _named(self, *names: str) -> ComplexArray:
        if self.names != BRANCH_NAMES:
            raise ValueError(
                "this bicycle's modes have no names: at no speed does it have one oscillation and two real "
                "eigenvalues; read the columns of eigenvalues"
            )
        return self.eigenvalues[:, [BRANCH_NAMES.index(name) for name in names]]


@dataclass(frozen=True, eq=False)
class _Modes:
    """Named modes at one speed."""

    speed: float
    eigenvalues: ComplexArray
    shapes: ComplexArray

    def has_equal(self) -> bool:
        """Whether two eigenvalues are the same, so that no step is small enough to tell them apart."""
        gaps = np.abs(self.eigenvalues[:, None] - self.eigenvalues[None, :])[np.triu_indices(4, 1)]
        return bool(gaps.min() <= _SAME * np.max(np.abs(self.eigenvalues)))


def follow_eigenvalues(bicycle: LinearBicycle, speeds: ArrayLike) -> EigenvalueBranches:
    """Follow the four eigenvalues of a bicycle in the speed, each under its mode's name.

    The names are given where they are beyond doubt, at a speed with one oscillation and two real roots: the oscillation is the weave, of the
    real roots the greater is the capsize mode and the lesser the caster mode. From there each mode is followed up and down, in steps small
    enough that the assignment of old to new eigenvalues and mode shapes is clearly the cheapest. A bicycle without such a speed has branches
    without names.

    Parameters
    ----------
    bicycle : LinearBicycle
    speeds : a number or shape (n,)
        m / s, not negative, in any order. The result for a speed does not depend on the others.

    Raises
    ------
    ValueError
        If a speed is negative or not finite.
    """
    require_instance("bicycle", bicycle, LinearBicycle)
    requested = require_vector("speeds", speeds, 0.0, math.inf, "[)")
    start, names = _start(bicycle)
    ordered, place = np.unique(requested, return_inverse=True)
    found: dict[float, _Modes] = {}
    for side in (ordered[ordered >= start.speed], ordered[ordered < start.speed][::-1]):
        modes = start  # on its own steps, so that no speed's result depends on the others
        for speed in side:
            while abs(speed - modes.speed) > _longest_step(bicycle, modes):
                modes = _step(bicycle, modes, math.copysign(math.inf, speed - modes.speed))
            there = modes
            while there.speed != speed:
                there = _step(bicycle, there, float(speed))
            found[float(speed)] = there
    rows = [found[float(speed)] for speed in ordered[place.reshape(-1)]]
    return EigenvalueBranches(
        names=names,
        speeds=requested,
        eigenvalues=np.array([row.eigenvalues for row in rows]),
        mode_shapes=np.array([row.shapes for row in rows]),
    )


def _start(bicycle: LinearBicycle) -> tuple[_Modes, tuple[str, ...]]:
    """Modes at a speed with one complex pair and two real roots, in the order of the names.

    The number of real roots changes only where two real ones meet, so one speed of each range between those speeds is enough. The fastest
    range is tried first. Where none will do, the modes there have no names.
    """
    scale = bicycle.characteristic.speed_scale
    borders = [0.0, *(meeting.speed for meeting in bicycle.double_roots())]
    weave_speed = bicycle.weave_speed()
    trials = [] if weave_speed is None else [weave_speed]
    trials += [max(2.0 * borders[-1], scale)]
    trials += [0.5 * (low + high) for low, high in pairwise(borders)][::-1]
    for speed in trials:
        modes = _sorted_modes(bicycle, speed)
        if np.sum(modes.eigenvalues.imag == 0.0) == 2:
            return modes, BRANCH_NAMES
    return _sorted_modes(bicycle, trials[0]), UNNAMED_BRANCHES


def _sorted_modes(bicycle: LinearBicycle, speed: float) -> _Modes:
    """The modes at a speed: first oscillations, then real ones, each by falling real part, of a pair the positive frequency first."""
    values, shapes = bicycle.modes(speed)
    order = np.lexsort((-values.imag, -values.real, values.imag == 0.0))
    return _Modes(float(speed), values[order], shapes[order])


def _longest_step(bicycle: LinearBicycle, modes: _Modes) -> float:
    return _LONGEST_STEP * max(modes.speed, bicycle.characteristic.speed_scale)


def _step(bicycle: LinearBicycle, modes: _Modes, speed: float) -> _Modes:
    """Follow the modes a step towards a speed, halving it until the assignment is clear."""
    longest = _longest_step(bicycle, modes)
    step = float(np.clip(speed - modes.speed, -longest, longest))
    whole = abs(speed - modes.speed) <= longest
    following, is_clear = _assign(bicycle, modes, speed if whole else modes.speed + step)
    while not (is_clear or modes.has_equal()) and abs(step) > _SHORTEST_STEP * longest:
        step *= 0.5
        following, is_clear = _assign(bicycle, modes, modes.speed + step)
    return following


def _assign(bicycle: LinearBicycle, modes: _Modes, speed: float) -> tuple[_Modes, bool]:
    """Give the modes at a new speed the names of those they are nearest to.

    All 24 assignments are priced, for the runner-up's cost tells how clear the best one is.
    """
    values, shapes = bicycle.modes(speed)
    distance = np.abs(modes.eigenvalues[:, None] - values[None, :]) / (
        np.max(np.abs(values)) or 1.0
    )
    likeness = np.abs(modes.shapes.conj() @ shapes.T)
    cost = distance + 1.0 - np.minimum(likeness, 1.0)
    totals = cost[np.arange(4), _ASSIGNMENTS].sum(axis=1)
    best, second = np.argsort(totals)[:2]
    order = _ASSIGNMENTS[best]
    upper, lower = values[order[:2]]
    same_kind = (upper.imag == 0.0) == (lower.imag == 0.0)
    if same_kind and (lower.imag, lower.real) > (upper.imag, upper.real):
        order = order[[1, 0, 2, 3]]
    return _Modes(speed, values[order], shapes[order]), bool(totals[best] < _CLEAR * totals[second])
