"""The simplest walking model: its gaits, multipliers, small slopes, and the way to chaos."""

from __future__ import annotations

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
from lean_yaw_env.paper.checks import Check, Result, Section, assess, compare, compare_all, printed
from lean_yaw_env.paper.walkers import doubling_slope, eigenvalues, point_foot_walker

GARCIA_SLOPE = 0.009
"""Slope of the published gaits."""
_FEIGENBAUM = 4.669201609
_SERIES_SLOPES = (3e-4, GARCIA_SLOPE)


@lru_cache(maxsize=16)
def gaits(slope: float = GARCIA_SLOPE) -> tuple[LimitCycle, ...]:
    """The long and the short gait."""
    return find_passive_gaits(point_foot_walker(slope))


def step_multipliers(gait: LimitCycle) -> np.ndarray:
    """Multipliers of one step, by falling magnitude."""
    section_map = gait.section_map
    return eigenvalues(section_map.derivative(gait.state)[1], section_map.free)


def simplest_walker() -> Result:
    """Garcia et al. and Bhounsule."""
    long, short = pairs = [step_multipliers(gait)[:2] for gait in gaits()]
    # The publications' φ is the swing leg's angle from the stance leg: its rate is the opposite
    states = np.array([gait.state[[1, 3, 5]] * (1.0, 1.0, -1.0) for gait in gaits()])
    checks = [
        *compare_all("fixed point, ", states[:, :2].ravel()),
        *compare_all("root, ", states.ravel()),
        *compare_all("step time, ", (0.5 * gait.stride_period for gait in gaits())),
        *compare_all("multiplier, ", (long[0].real, long[0].imag, *np.real(short))),
        *_statement_checks(),
        *_series_checks(*gaits()),
    ]
    section = Section(
        "Multipliers",
        "Bhounsule 2014 gives the simplest walker's eigenvalues to twelve digits; his table could not be read in "
        "any source at hand, so that it is not compared. Ours for one step at γ = 0.009:",
        {
            "gait": ["long", "long", "short", "short"],
            "real part": [f"{value.real:.7f}" for pair in pairs for value in pair],
            "imaginary part": [f"{value.imag:.7f}" for pair in pairs for value in pair],
        },
    )
    return Result(checks, sections=(section,))


def _statement_checks() -> list[Check]:
    limit = doubling_slope(point_foot_walker(GARCIA_SLOPE), (0.001, 0.03))
    cycles = [gaits(slope) for slope in (0.001, 0.005, 0.01, 0.0149)]
    one = all(long.is_stable and not short.is_stable for long, short in cycles)
    gentle, steeper = (gaits(slope)[0] for slope in (1e-5, 2e-5))
    angle = np.log2(steeper.state[1] / gentle.state[1])
    power = np.log(2.0 * steeper.speed / gentle.speed) / np.log(steeper.speed / gentle.speed)
    scales = abs(angle - 1.0 / 3.0) < 0.01 and abs(power - 4.0) < 0.01
    slopes = doubling_slopes()
    ratio = float((slopes[-2] - slopes[-3]) / (slopes[-1] - slopes[-2]))
    return [
        assess("two gaits", one, "two each"),
        compare("stable below", limit),
        assess("scaling", bool(scales), f"{angle:.4f} and {power:.3f}"),
        assess(
            "to chaos",
            abs(ratio / _FEIGENBAUM - 1.0) < 0.01,
            f"{', '.join(f'{slope:.6f}' for slope in slopes)}; last ratio {ratio:.3f}",
        ),
        compare("end of walking", end_of_walking()),
    ]


@lru_cache(maxsize=1)
def doubling_slopes(most_steps: int = 8) -> tuple[float, ...]:
    """Slopes at which the stable gaits of 1, 2, 4, ... steps double."""
    found = [doubling_slope(point_foot_walker(GARCIA_SLOPE), (0.001, 0.03))]
    gap, n_steps = 0.0027, 2
    while n_steps <= most_steps:
        # A little past the doubling, where the walk settles fast to the gait that was born there
        slope = found[-1] + 0.15 * gap
        walker = point_foot_walker(slope)
        state = find_periodic_gait(walker, n_steps=n_steps).state
        limits = (0.99 * slope, slope + 1.5 * gap)
        branch = continue_gait(walker, "slope", limits, state=state, n_steps=n_steps)
        found.append(branch.ends_of_stability[0])
        gap, n_steps = (found[-1] - found[-2]) / _FEIGENBAUM, 2 * n_steps
    return tuple(found)


def end_of_walking() -> float:
    """The steepest slope, in steps of 5e-5, on which a walk that comes from a gentler slope goes on for 1000 steps."""
    state, last = find_periodic_gait(point_foot_walker(0.0175), n_steps=2).state, np.nan
    for slope in np.arange(0.0185, 0.0196, 5e-5):
        section_map = PassiveMap(point_foot_walker(float(slope)))
        try:
            for _ in range(1000):
                state = section_map.image(state)
        except FellError:
            break
        last = float(slope)
    return last


def small_slopes(gait: LimitCycle, points: int = 8) -> tuple[float, float, float, float, float]:
    """A gait's first terms in the cube root of the slope: τ0, Θ0, Θ1, α, c1.

    The step time is τ0 as the slope γ vanishes, the angle θ = Θ0 γ^(1/3) + Θ1 γ, and its rate θ' = α θ + c1 γ. From polynomials
    in γ^(2/3) that pass through gaits at Chebyshev's ``points`` of that variable.

    Parameters
    ----------
    gait : LimitCycle
        At the slope ``GARCIA_SLOPE``, from where it is followed.
    points : int
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
    time, angle, rate = (
        np.polynomial.Polynomial.fit(powers, column, points - 1).convert().coef
        for column in np.array(rows).T
    )
    ratio = rate[0] / angle[0]
    return time[0], angle[0], angle[1], ratio, rate[1] - ratio * angle[1]


def _series_checks(long: LimitCycle, short: LimitCycle) -> list[Check]:
    ours, root = small_slopes(long), GARCIA_SLOPE ** (1.0 / 3.0)
    terms = [printed(f"series, long gait, {name}").value for name in ("Θ0", "Θ1")]
    theirs = terms[0] * root + terms[1] * GARCIA_SLOPE
    contradiction = (
        f"The printed terms give θ = {theirs:.5f} at γ = {GARCIA_SLOPE}, where the authors' "
        f"own program has the fixed point at {long.state[1]:.5f}; with ours they give "
        f"{ours[1] * root + ours[2] * GARCIA_SLOPE:.5f}. All other terms agree, so this one "
        "is wrong as printed."
    )
    return [
        *compare_all("series, long", ours, otherwise=contradiction),
        *compare_all("series, short", small_slopes(short)),
    ]
