"""Where passive gaits are looked for: many starts in the plane, then the hip width raised."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lean_yaw_env.analysis.fixed_point import follow_fixed_point, solve_fixed_point
from lean_yaw_env.analysis.section_map import PassiveMap
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.parameters import Vector
from lean_yaw_env.passive import PassiveWalker

# Stance pitch over the scaling law's, and rate over pitch: 0.94 to 1.16 and 0.79 to 1.05 in the
# gaits of point feet and of radius 0.5; other radii in between and somewhat beyond.
_PITCHES = np.linspace(0.85, 1.35, 11)
_RATES = np.linspace(0.7, 1.1, 17)
_SAME_GAIT = 1e-7
_LEAST_PITCH = 1e-3
"""A smaller step is the solution of not walking at all."""


def planar_starts(walker: PassiveWalker) -> list[Vector]:
    """Guesses of the planar gait, from Garcia's scaling law carried to round feet; empty uphill."""
    slope, radius = walker.parameters.slope, walker.parameters.foot_radius
    if slope <= 0.0:
        return []
    scale = (slope / (1.0 - radius) ** 2) ** (1.0 / 3.0)
    starts = []
    for pitch in scale * _PITCHES:
        for rate in -pitch * _RATES:
            # Momentum kept by the trailing foot: exact for point feet, halved for radius 0.5
            swing = -(1.0 - radius) * rate * (1.0 - np.cos(2.0 * pitch))
            starts.append(np.array([0.0, pitch, 0.0, rate, 0.0, swing]))
    return starts


def search_passive(walker: PassiveWalker) -> list[Vector]:
    """Section states of all symmetric gaits found.

    Raises
    ------
    NoGaitError
        If there is none; says what was tried.
    """
    flat = replace(walker, planar=True)
    states: list[Vector] = []
    reasons: set[str] = set()
    for start in planar_starts(walker):
        try:
            state = solve_fixed_point(PassiveMap(flat), start)
        except NoGaitError as error:
            reasons.add(str(error))
            continue
        is_new = all(np.abs(state - other).max() > _SAME_GAIT for other in states)
        if is_new and state[1] > _LEAST_PITCH:
            states.append(state)
    if not walker.planar and walker.parameters.hip_width != 0.0:
        states = _widened(walker, states, reasons)
    if not states:
        some = "; ".join(sorted(reasons)[:4]) if reasons else "the slope gives no energy"
        raise NoGaitError(
            f"no gait found for the passive walker of {walker.parameters}; tried: "
            f"{_PITCHES.size * _RATES.size} planar starts, following each gait from no hip width; "
            f"reasons: {some}"
        )
    return states


def _widened(walker: PassiveWalker, states: list[Vector], reasons: set[str]) -> list[Vector]:
    """Follow planar gaits to the walker's hip width; those that end on the way are left out."""
    width = walker.parameters.hip_width

    def path(share: float) -> PassiveMap:
        return PassiveMap(walker).moved("hip_width", share * width)

    found: list[Vector] = []
    for state in states:
        try:
            found.append(follow_fixed_point(path, state)[1])
        except NoGaitError as error:
            reasons.add(f"from no hip width {error}")
    return found
