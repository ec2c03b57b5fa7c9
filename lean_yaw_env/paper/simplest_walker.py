"""The simplest walking model: its gaits, multipliers, small slopes, and the way to chaos."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from lean_yaw_env.analysis import (
    LimitCycle,
    PassiveMap,
    continue_gait,
    find_passive_gaits,
    find_periodic_gait,
)
from lean_yaw_env.analysis.fixed_point import solve_fixed_point
from lean_yaw_env.errors import FellError
from lean_yaw_env.paper.checks import Check, compare, judge
from lean_yaw_env.paper.numbers import GARCIA_SLOPE, number, numbers_of, statement
from lean_yaw_env.paper.results import Result, Section
from lean_yaw_env.paper.slope_limits import doubling_slope
from lean_yaw_env.paper.walkers import point_foot_walker
from lean_yaw_env.parameters import Vector

_FEIGENBAUM = 4.669201609
_SERIES_SLOPES, _SERIES_POINTS = (3e-4, 0.009), 8
_END_STEPS = 1000
_WIDTH, _WEIGHTS = 5e-5, np.array([45.0, -9.0, 1.0])
"""Of central differences with six neighbours."""


@lru_cache(maxsize=16)
def gaits(slope: float = GARCIA_SLOPE) -> tuple[LimitCycle, LimitCycle]:
    """The long and the short gait."""
    *_, long, short = find_passive_gaits(point_foot_walker(slope))
    return long, short


def step_multipliers(gait: LimitCycle, slope: float = GARCIA_SLOPE) -> np.ndarray:
    """Multipliers of one step, the greatest first, from differences of steps that are exact to the sixth order."""
    section_map = PassiveMap(point_foot_walker(slope))
    columns = []
    for unit in np.eye(gait.state.size)[section_map.free]:
        changes = [
            section_map.image(gait.state + k * _WIDTH * unit)
            - section_map.image(gait.state - k * _WIDTH * unit)
            for k in (1, 2, 3)
        ]
        columns.append(_WEIGHTS @ np.array(changes)[:, section_map.free] / (60.0 * _WIDTH))
    values = np.linalg.eigvals(np.array(columns).T)
    return values[np.lexsort((-values.imag, -np.abs(values)))]


def simplest_walker() -> Result:
    """Garcia et al. and Bhounsule."""
    return Result(
        (*_gait_checks(), *_multiplier_checks(), *_statement_checks(), *_series_checks()),
        sections=(_digits_section(),),
    )


def _gait_checks() -> list[Check]:
    states = [gait.state[[1, 3, 5]] for gait in gaits()]
    # The publications' φ is the swing leg's angle from the stance leg: its rate is the opposite
    ours = np.array([[pitch, rate, -swing] for pitch, rate, swing in states])
    checks = [
        compare(printed, float(value))
        for printed, value in zip(numbers_of("fixed point, "), ours[:, :2].ravel(), strict=True)
    ]
    checks += [
        compare(printed, float(value))
        for printed, value in zip(numbers_of("root, "), ours.ravel(), strict=True)
    ]
    checks += [
        compare(printed, 0.5 * gait.stride_period)
        for printed, gait in zip(numbers_of("step time, "), gaits(), strict=True)
    ]
    return checks


def _multiplier_checks() -> list[Check]:
    long, short = (step_multipliers(gait) for gait in gaits())
    ours = (long[0].real, long[0].imag, short[0].real, short[1].real)
    return [
        compare(
            printed,
            float(value),
            unless="His Jacobian is of differences of steps that were integrated to 1e-10. Garcia's "
            "equations, integrated with thirty digits by another program, give ours.",
        )
        for printed, value in zip(numbers_of("multiplier, "), ours, strict=True)
    ]


def _statement_checks() -> list[Check]:
    limit = doubling_slope(point_foot_walker(0.009), (0.001, 0.03))
    cycles = [gaits(slope) for slope in (0.001, 0.005, 0.01, 0.0149)]
    one = all(long.is_stable and not short.is_stable for long, short in cycles)
    gentle, steeper = (gaits(slope)[0] for slope in (1e-5, 2e-5))
    angle = np.log2(steeper.state[1] / gentle.state[1])
    power = np.log(2.0 * steeper.speed / gentle.speed) / np.log(steeper.speed / gentle.speed)
    scales = abs(angle - 1.0 / 3.0) < 0.01 and abs(power - 4.0) < 0.01
    slopes = doubling_slopes()
    ratio = float((slopes[-2] - slopes[-3]) / (slopes[-1] - slopes[-2]))
    doubles = abs(ratio / _FEIGENBAUM - 1.0) < 0.01
    return [
        judge(statement("two gaits"), one, ours="two each", unless="It is not so."),
        compare(number("stable below"), limit),
        judge(
            statement("scaling"),
            bool(scales),
            ours=f"{angle:.4f} and {power:.3f}",
            unless="Other exponents.",
        ),
        judge(
            statement("to chaos"),
            doubles,
            ours=", ".join(f"{slope:.6f}" for slope in slopes) + f"; last ratio {ratio:.3f}",
            unless="The ratio is another one.",
        ),
        compare(number("end of walking"), end_of_walking()),
    ]


@lru_cache(maxsize=1)
def doubling_slopes(most_steps: int = 8) -> tuple[float, ...]:
    """Slopes at which the stable gaits of 1, 2, 4, ... steps double."""
    found = [doubling_slope(point_foot_walker(0.009), (0.001, 0.03))]
    gap, n_steps = 0.0027, 2
    while n_steps <= most_steps:
        # A little past the doubling, where the walk settles fast to the gait that was born there
        slope = found[-1] + 0.15 * gap
        walker = point_foot_walker(slope)
        state = find_periodic_gait(walker, n_steps=n_steps).state
        limits = (0.99 * slope, slope + 1.5 * gap)
        branch = continue_gait(walker, "slope", limits, state=state, n_steps=n_steps)
        found.append(next(event.value for event in branch.events if event.is_leaving))
        gap, n_steps = (found[-1] - found[-2]) / _FEIGENBAUM, 2 * n_steps
    return tuple(found)


def end_of_walking() -> float:
    """The steepest slope, in steps of 5e-5, on which a walk that comes from a gentler slope goes on for 1000 steps."""
    state, last = find_periodic_gait(point_foot_walker(0.0175), n_steps=2).state, np.nan
    for slope in np.arange(0.0185, 0.0196, 5e-5):
        section_map = PassiveMap(point_foot_walker(float(slope)))
        try:
            for _ in range(_END_STEPS):
                state = section_map.image(state)
        except FellError:
            break
        last = float(slope)
    return last


@dataclass(frozen=True)
class SmallSlopes:
    """A gait's first terms in the cube root of the slope.

    Attributes
    ----------
    time : float
        Step time as the slope vanishes.
    angle, angle_slope : float
        θ = angle γ^(1/3) + angle_slope γ.
    ratio, offset : float
        θ' = ratio θ + offset γ.
    """

    time: float
    angle: float
    angle_slope: float
    ratio: float
    offset: float


def small_slopes(gait: LimitCycle, points: int = _SERIES_POINTS) -> SmallSlopes:
    """The first terms, from polynomials in γ^(2/3) through gaits at Chebyshev's places of that variable.

    Parameters
    ----------
    gait : LimitCycle
        At the slope ``GARCIA_SLOPE``, from where it is followed.
    points : int
        Places; the polynomials pass through all of them.
    """
    low, high = np.array(_SERIES_SLOPES) ** (2.0 / 3.0)
    places = np.cos(np.pi * (2.0 * np.arange(points) + 1.0) / (2.0 * points))
    powers = 0.5 * (low + high) + 0.5 * (high - low) * places
    state, before, rows = gait.state.copy(), GARCIA_SLOPE, []
    for slope in powers**1.5:
        scale = (slope / before) ** (1.0 / 3.0)
        guess = state * np.array([1.0, scale, 1.0, scale, 1.0, scale**3])
        section_map = PassiveMap(point_foot_walker(float(slope)))
        state, before = solve_fixed_point(section_map, guess), slope
        root = slope ** (1.0 / 3.0)
        rows.append((section_map.results(state)[0].duration, state[1] / root, state[3] / root))
    time, angle, rate = (_first_terms(powers, column) for column in np.array(rows).T)
    ratio = rate[0] / angle[0]
    return SmallSlopes(time[0], angle[0], angle[1], ratio, rate[1] - ratio * angle[1])


def _first_terms(x: Vector, y: Vector) -> Vector:
    return np.polynomial.Polynomial.fit(x, y, x.size - 1).convert().coef[:2]


def _series_checks() -> list[Check]:
    checks = []
    for gait, series in zip(
        gaits(), (numbers_of("series, long"), numbers_of("series, short")), strict=True
    ):
        ours = small_slopes(gait)
        values = (ours.time, ours.angle, ours.angle_slope, ours.ratio, ours.offset)
        root = GARCIA_SLOPE ** (1.0 / 3.0)
        evaluated = series[1].value * root + series[2].value * GARCIA_SLOPE
        checks += [
            compare(
                printed,
                float(value),
                unless=f"The printed terms give θ = {evaluated:.5f} at γ = {GARCIA_SLOPE}, where the authors' "
                f"own program has the fixed point at {gait.state[1]:.5f}; with ours they give "
                f"{ours.angle * root + ours.angle_slope * GARCIA_SLOPE:.5f}. All other terms agree, so this one "
                "is wrong as printed.",
            )
            for printed, value in zip(series, values, strict=True)
        ]
    return checks


def _digits_section() -> Section:
    """Multipliers, for which no printed ones could be read."""
    pairs = [step_multipliers(gait)[:2] for gait in gaits()]
    return Section(
        "Multipliers",
        "Bhounsule 2014 gives the simplest walker's eigenvalues to twelve digits; his table could not be read in "
        "any source at hand, so that it is not compared. Ours for one step at γ = 0.009:",
        {
            "gait": ["long", "long", "short", "short"],
            "real part": [f"{value.real:.7f}" for pair in pairs for value in pair],
            "imaginary part": [f"{value.imag:.7f}" for pair in pairs for value in pair],
        },
    )
