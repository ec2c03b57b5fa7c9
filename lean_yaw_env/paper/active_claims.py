"""Claims about the vehicles and the active walker that are in no figure."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from lean_yaw_env.analysis import Disturbance, find_limit_cycle, largest_disturbance
from lean_yaw_env.paper.checks import Check, compare, judge
from lean_yaw_env.paper.numbers import (
    CRITICAL_TILTS,
    LARGE_OFFSET,
    PASSIVE_SLOPE,
    number,
    numbers_of,
    statement,
)
from lean_yaw_env.paper.results import Result
from lean_yaw_env.paper.steering import circling_gait, circling_walker
from lean_yaw_env.paper.velocity_figure import flat_critical_speed
from lean_yaw_env.paper.walkers import FlatGait, flat_active_walker, table_1_gait
from lean_yaw_env.parameters import STATE_FIELDS, WalkerParameters
from lean_yaw_env.vehicles import Skateboard
from lean_yaw_env.walker import Walker

_RATE = "stance_pitch_rate"
_CIRCLES = 20
_RECOVERY_STEPS = 400
_RECOVERED = 0.1
"""Distance from the gait, relative to the disturbance, after ``_RECOVERY_STEPS``."""


def skateboard_claims() -> Result:
    """Section 2.1, on a board of our own numbers: the paper gives none."""
    board = Skateboard()
    speed = board.critical_speed()
    below, above = board.eigenvalues([0.999 * speed, 1.001 * speed])
    passes = bool(below.real.max() > 0.0 and abs(above.real).max() == 0.0)
    stiff = replace(
        board, spring_stiffness=1.01 * board.mass * board.gravity * board.rider_height / 2.0
    )
    never = bool((stiff.eigenvalues(np.linspace(0.0, 10.0, 50)).real <= 0.0).all())
    tilts = [replace(board, steering_tilt=tilt).critical_speed() for tilt in (0.3, 0.6, 0.9, 1.2)]
    damped = replace(board, damping=5.0).eigenvalues(2.0 * speed).real
    marginal = board.eigenvalues(2.0 * speed).real
    rows = (
        ("eq. (3)", passes, f"{speed:.4f} m/s for the default board, both ways"),
        ("stiff springs", never, "no growing eigenvalue from 0 to 10 m/s"),
        (
            "tilt",
            bool(np.all(np.diff(tilts) > 0.0)),
            "α = 0.3, 0.6, 0.9, 1.2: " + ", ".join(f"{v:.2f}" for v in tilts) + " m/s",
        ),
        ("undamped", bool((marginal == 0.0).all()), "an imaginary pair"),
        (
            "damping",
            bool((damped < 0.0).all()),
            f"real parts {damped.max():.3f} 1/s",
        ),
    )
    return Result(
        tuple(
            judge(statement(name), holds, ours=ours, unless="It does not hold.")
            for name, holds, ours in rows
        )
    )


def active_claims() -> Result:
    """The heuristic that the critical speed is the ankle tilt.

    The paper's own pairs, (0.36, pi/8) and (0.72, pi/4), are up to 8 % off; twice that is allowed.
    """
    gentle = FlatGait.of(flat_active_walker(PASSIVE_SLOPE))
    usual = FlatGait.of(flat_active_walker())
    points = [
        (gentle.cycle.speed, gentle.stable_tilts(0.13, 0.17)[1]),
        (usual.cycle.speed, usual.stable_tilts(0.1, 0.8)[1]),
        *((flat_critical_speed(tilt), tilt) for tilt in CRITICAL_TILTS),
    ]
    checks = [
        compare(
            printed,
            speed / tilt,
            remark=f"v = {speed:.3f} at α = {tilt:.3f}.",
            unless="On so gentle a slope the boundary is held up by the lower one, where the axis "
            "becomes vertical at the step's end; the rule holds for faster walks.",
        )
        for printed, (speed, tilt) in zip(numbers_of("v_min over α"), points, strict=True)
    ]
    return Result(
        tuple(checks),
        {
            "critical_speeds": {
                "ankle_tilt": [tilt for _, tilt in points],
                "critical_speed": [speed for speed, _ in points],
            }
        },
    )


def steering_claims() -> Result:
    """Circles, and the disturbances that Table 1's walker survives."""
    return Result((_circle_check(), *disturbance_checks()))


def _circle_check() -> Check:
    walker, gait = circling_walker(), circling_gait()
    steps = _CIRCLES * math.ceil(2.0 * math.pi / abs(gait.turn)) * 2
    walk = walker.walk(steps, state=gait.state, mass_offset=LARGE_OFFSET)
    holds = walk.fall is None and gait.is_stable
    return judge(
        statement("slope that turns"),
        holds,
        ours=f"greatest |λ| {abs(gait.eigenvalues[0]):.3f}, radius {gait.turning_radius:.2f}, "
        f"{walk.n_steps} steps walked",
        unless="It falls, or the circle is unstable.",
    )


def recovers(walker: Walker, coordinate: str, share: float) -> bool:
    """Whether a walk starts to return to Table 1's gait after a relative disturbance.

    It must walk ``_RECOVERY_STEPS`` steps and then be nearer the gait by ten times. The slowest
    mode, the heading's, decays by 0.986 a stride.
    """
    gait = table_1_gait().state
    start = gait.copy()
    index = [field.name for field in STATE_FIELDS].index(coordinate)
    start[index] += share * gait[index]
    walk = walker.walk(_RECOVERY_STEPS, state=start)
    left = np.abs(walk.states[-1] - gait).max() if walk.n_steps % 2 == 0 else np.inf
    before = np.abs(walk.states[:20:2] - gait).max()
    return walk.fall is None and bool(left < _RECOVERED * before)


def disturbance_checks() -> tuple[Check, ...]:
    """Section 4.4: +200 %, -100 %, and -50 % of the stance leg's rate."""
    names = [field.name for field in STATE_FIELDS]
    striking = Walker(WalkerParameters(early_contact="strike"))
    raised = {name: recovers(striking, name, 2.0) for name in names}
    lowered = {name: recovers(Walker(), name, -1.0) for name in names if name != _RATE}
    trips = largest_disturbance(Walker(), "stance_pitch")
    strikes = largest_disturbance(striking, "stance_pitch")
    rate = largest_disturbance(Walker(), _RATE, upward=False)
    return (
        judge(
            statement("disturbance +200 %"),
            all(raised.values()),
            ours=_listed(raised),
            remark="For the stance leg's angle only where a swing foot that starts below the floor "
            f"counts as an immediate heel strike (limit {strikes.relative:+.0%}); where it must "
            f"first rise above the floor the limit is {trips.relative:+.0%}.",
        ),
        judge(
            statement("disturbance -100 %"),
            all(lowered.values()),
            ours=_listed(lowered),
            unless="Not all recover.",
        ),
        compare(
            number("stance leg's rate"),
            100.0 * rate.relative,
            unless=f"It recovers from {rate.relative:.1%}, and falls beyond.",
        ),
        _backward_check(rate),
    )


def _backward_check(rate: Disturbance) -> Check:
    """How the walker falls when its stance leg is slower than it can recover from."""
    gait = find_limit_cycle(Walker())
    ways = {}
    for share in (0.6, 0.7, 0.8, 0.9):
        start = gait.state.copy()
        start[3] *= 1.0 - share
        fall = Walker().walk(_RECOVERY_STEPS, state=start).fall
        ways[share] = "none" if fall is None else fall.value
    backward = all(way == "backward" for way in ways.values())
    return judge(
        statement("beyond -50 %"),
        backward,
        ours=", ".join(f"-{share:.0%}: {way}" for share, way in ways.items()),
        unless=f"Just beyond the limit ({rate.relative:.1%}) it falls by {rate.fall}: it hardly passes "
        "mid-stance, leans over in the long step, and starts a later one leaning so far that the swing "
        "foot is below the floor. Slower still it falls backward at once, as the paper says.",
    )


def _listed(outcomes: dict[str, bool]) -> str:
    return ", ".join(f"{name} {'recovers' if good else 'falls'}" for name, good in outcomes.items())
