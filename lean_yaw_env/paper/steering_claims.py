"""Section 4.4's claims about steering, and the disturbances that Table 1's walker survives."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from lean_yaw_env.analysis import largest_disturbance
from lean_yaw_env.paper.checks import Check, judge
from lean_yaw_env.paper.numbers import LARGE_OFFSET, statement
from lean_yaw_env.paper.results import Result
from lean_yaw_env.paper.steering import circling_gait, circling_walker
from lean_yaw_env.paper.walkers import table_1_gait
from lean_yaw_env.parameters import STATE_FIELDS, WalkerParameters
from lean_yaw_env.walker import Walker

_NAMES = tuple(field.name for field in STATE_FIELDS)
_RATE = "stance_pitch_rate"
_CIRCLES = 20
_RECOVERY_STEPS = 400
_RECOVERED = 0.1
"""Distance from the gait, relative to the disturbance, after ``_RECOVERY_STEPS``."""
_HOME_STEPS = 800
"""Long enough to come back from a right angle, at 0.986 a stride."""


def steering_claims() -> Result:
    """Circles, self-steering, asymmetry, and the disturbances survived."""
    return Result(
        (
            _circle_check(),
            _limp_check(),
            _self_steering_check(),
            _asymmetry_check(),
            *disturbance_checks(),
        )
    )


def _circle_check() -> Check:
    walker, gait = circling_walker(), circling_gait()
    steps = _CIRCLES * math.ceil(2.0 * math.pi / abs(gait.turn)) * 2
    walk = walker.walk(steps, state=gait.state, mass_offset=LARGE_OFFSET)
    holds = walk.fall is None and gait.is_stable
    return judge(
        statement("slope that turns"),
        holds,
        ours=f"greatest |λ| {abs(gait.eigenvalues[0]):.3f}, {walk.n_steps} steps walked",
        unless="It falls, or the circle is unstable.",
    )


def _limp_check() -> Check:
    left, right = (step.duration for step in circling_gait().steps)
    holds = abs(left / right - 1.0) > 0.01
    return judge(
        statement("limp"),
        holds,
        ours=f"{left:.3f} on the left foot, {right:.3f} on the right, inner one",
        unless="It does not limp.",
    )


def _self_steering_check() -> Check:
    """From how far aside the walker comes back, by bisection, and whether it is then in its gait."""
    gait, limits = table_1_gait().state, []
    for upward in (True, False):
        limit = largest_disturbance(
            Walker(),
            "heading",
            upward=upward,
            relative=False,
            most=math.pi,
            tolerance=1e-3,
            n_steps=_HOME_STEPS,
        ).largest
        start = gait.copy()
        start[0] += 0.999 * limit
        walk = Walker().walk(_HOME_STEPS, state=start)
        home = walk.fall is None and abs(walk.headings[-1] - gait[0]) < _RECOVERED
        limits.append(math.degrees(limit) if home else 0.0)
    holds = min(map(abs, limits)) >= 89.0
    return judge(
        statement("self-steering"),
        holds,
        ours=f"from up to {limits[0]:.1f}° to the left and {-limits[1]:.1f}° to the right",
        remark="Beyond a right angle the slope leads uphill, and the walker falls."
        if holds
        else "It does not come back from all of them.",
    )


def asymmetric_turn(
    *,
    parameter: str | None = None,
    value: float = 0.0,
    inter_leg_angle: float = 0.3,
    mass_offset: float = 0.0,
    n_strides: int = 300,
) -> float:
    """Turn per stride, rad, of a walker whose left foot's steps have another parameter or command.

    On a slope that turns along, after ``n_strides`` from Table 1's gait; nan if it falls.
    """
    usual = circling_walker()
    changed = {} if parameter is None else {parameter: value}
    other = Walker(replace(usual.parameters, **changed))
    state, turn = table_1_gait().state, 0.0
    for _ in range(n_strides):
        first = other.step(state, inter_leg_angle=inter_leg_angle, mass_offset=mass_offset)
        second = usual.step(first.state, stance="right", mass_offset=mass_offset)
        if first.fall or second.fall:
            return math.nan
        state, turn = second.state, first.heading_change + second.heading_change
    return turn


def _asymmetry_check() -> Check:
    turns = {
        "mass offset 0.001": asymmetric_turn(mass_offset=0.001),
        "inter-leg angle 0.303": asymmetric_turn(inter_leg_angle=0.303),
        "ankle spring 0.01": asymmetric_turn(parameter="ankle_stiffness", value=0.01),
        "ankle damper 0.01": asymmetric_turn(parameter="ankle_damping", value=0.01),
    }
    same = abs(asymmetric_turn())
    holds = all(abs(turn) > 1e-9 for turn in turns.values()) and same < 1e-9
    return judge(
        statement("asymmetry"),
        holds,
        ours="; ".join(f"{name}: {turn:+.1e}" for name, turn in turns.items())
        + f"; none: {same:.0e}",
        remark="Hip width and slope belong to both feet, and the model gives both feet one radius and "
        "one ankle tilt; what a step can have of its own is tried."
        if holds
        else "One of them walks straight.",
    )


def recovers(walker: Walker, coordinate: str, share: float) -> bool:
    """Whether a walk starts to return to Table 1's gait after a relative disturbance.

    It must walk ``_RECOVERY_STEPS`` steps and then be nearer the gait by ten times. The slowest
    mode, the heading's, decays by 0.986 a stride.
    """
    gait = table_1_gait().state
    start = gait.copy()
    start[_NAMES.index(coordinate)] *= 1.0 + share
    walk = walker.walk(_RECOVERY_STEPS, state=start)
    left = np.abs(walk.states[-1] - gait).max() if walk.n_steps % 2 == 0 else np.inf
    before = np.abs(walk.states[:20:2] - gait).max()
    return walk.fall is None and bool(left < _RECOVERED * before)


def disturbance_checks() -> tuple[Check, ...]:
    """Section 4.4, all with the contact rule "strike", which +200 % of the stance leg's angle needs."""
    strike, trip = Walker(WalkerParameters(early_contact="strike")), Walker()
    raised = {name: recovers(strike, name, 2.0) for name in _NAMES}
    lowered = {name: recovers(strike, name, -1.0) for name in _NAMES if name != _RATE}
    angles = [largest_disturbance(walker, "stance_pitch").relative for walker in (strike, trip)]
    rates = [largest_disturbance(walker, _RATE, upward=False).relative for walker in (strike, trip)]
    tens = recovers(strike, _RATE, -0.5) and not recovers(strike, _RATE, -0.6)
    return (
        judge(
            statement("disturbance +200 %"),
            all(raised.values()),
            ours=_listed(raised),
            remark="A swing foot that starts below the floor counts as an immediate heel strike here and "
            f"in the rows below. The stance leg's angle is then survived to {angles[0]:+.0%}; where "
            f"the foot must first rise above the floor, to {angles[1]:+.0%} only.",
        ),
        judge(
            statement("disturbance -100 %"),
            all(lowered.values()),
            ours=_listed(lowered),
            unless="Not all recover.",
        ),
        judge(
            statement("stance leg's rate"),
            tens,
            ours=f"{rates[0]:.1%}",
            remark=f"With the other contact rule {rates[1]:.1%}."
            if tens
            else "It falls earlier, or recovers from -60 % too.",
        ),
        _backward_check(strike),
    )


def ways_to_fall(walker: Walker) -> dict[int, str]:
    """How Table 1's walk ends, by the whole percents by which its stance leg's rate is lowered."""
    ways = {}
    for percent in range(51, 100):
        start = table_1_gait().state.copy()
        start[3] *= 1.0 - 0.01 * percent
        fall = walker.walk(_RECOVERY_STEPS, state=start).fall
        ways[percent] = "none" if fall is None else fall.value
    return ways


def _backward_check(strike: Walker) -> Check:
    """How the walker falls when its stance leg is slower than it can recover from."""
    ways = ways_to_fall(strike)
    falls = {percent: way for percent, way in ways.items() if way != "none"}
    others = [f"-{percent} %" for percent, way in falls.items() if way != "backward"]
    tens = all(ways[percent] == "backward" for percent in (60, 70, 80, 90))
    return judge(
        statement("beyond -50 %"),
        not others,
        ours=f"{len(falls) - len(others)} of {len(falls)} backward",
        remark=f"Sideways at {', '.join(others)}: just beyond the limit it hardly passes mid-stance, and "
        "leans over in the long step; at -98 % and -99 % it leans over before it rolls back. "
        + ("At -60, -70, -80 and -90 % it falls backward, as the paper says." if tens else ""),
    )


def _listed(outcomes: dict[str, bool]) -> str:
    return ", ".join(f"{name} {'recovers' if good else 'falls'}" for name, good in outcomes.items())
