"""The steered walker: Figures 14 and 15, section 4.4's claims, and single-motor walkers that steer, built since."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from lean_yaw_env.analysis import find_limit_cycle, largest_disturbance
from lean_yaw_env.analysis.path import radius_of_walk
from lean_yaw_env.paper.checks import Check, Result, Section, assess, compare
from lean_yaw_env.paper.drawing import FAINT, name_axes, picture_of
from lean_yaw_env.paper.walkers import (
    LARGE_OFFSET,
    SMALL_OFFSET,
    circling_gait,
    circling_walker,
    table_1_gait,
)
from lean_yaw_env.parameters import STATE_FIELDS, WalkerParameters
from lean_yaw_env.rendering.figures import new_figure
from lean_yaw_env.rendering.footprints import footprint_length, footprint_outlines
from lean_yaw_env.walker import Walk, Walker

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_NAMES = tuple(field.name for field in STATE_FIELDS)
_RATE = "stance_pitch_rate"
_RECOVERY_STEPS = 400
_RECOVERED = 0.1
"""Distance from the gait, relative to the disturbance, after ``_RECOVERY_STEPS``."""
_HOME_STEPS = 800
"""Long enough to come back from a right angle, at 0.986 a stride."""


def settled_heading(mass_offset: float = SMALL_OFFSET) -> float:
    """Heading, rad to the right, of the gait across the slope, the mean of both feet."""
    walker = Walker()
    gait = find_limit_cycle(walker, mass_offset=mass_offset)
    step = walker.step(gait.state, mass_offset=mass_offset)
    return -0.5 * float(gait.state[0] + step.state[0])


def asymptotic_heading(mass_offset: float = SMALL_OFFSET) -> float:
    """The same in closed form, sin(heading) = offset / tan(slope), rad to the right.

    Where the line from foot to centre of mass, moved aside, is plumb across the course.
    """
    return math.asin(mass_offset / math.tan(WalkerParameters().slope))


def walk_from_gait(steps: int, mass_offset: float = 0.0, samples: int = 41) -> Walk:
    """A walk from Table 1's gait, the centre of mass sampled within the steps."""
    state = table_1_gait().state
    return Walker().walk(steps, state=state, mass_offset=mass_offset, samples_per_step=samples)


def footprint_columns(walk: Walk) -> dict[str, Any]:
    """Footprints of a walk."""
    return {
        "step": range(len(walk.stances)),
        "foot": walk.stances,
        "downhill": walk.footprints[:, 0],
        "right": walk.footprints[:, 1],
        "heading": walk.headings,
    }


def _draw_prints(axes: Axes, walk: Walk, exaggeration: float = 1.0) -> None:
    from matplotlib.collections import PolyCollection

    length = 0.6 * footprint_length(WalkerParameters().foot_radius)
    headings = exaggeration * walk.headings
    outlines = list(footprint_outlines(walk.footprints, headings, walk.stances, length))
    axes.add_collection(PolyCollection(outlines, facecolors="0.85", edgecolors="k", linewidths=0.7))


def _use_floor(axes: Axes) -> None:
    """Downhill to the right of the page, the walker's right hand downwards, to scale."""
    axes.set_aspect("equal")
    axes.invert_yaxis()
    axes.grid(color="0.8", linewidth=0.6)
    axes.set_axisbelow(True)


def figure_14() -> Result:
    """Figure 14: the steady walk from above."""
    walk, gait = walk_from_gait(12), table_1_gait()
    figure = new_figure(9.0, 3.2)
    axes = figure.subplots()
    # The paper exaggerates the footprints' direction too, by how much it does not say
    _draw_prints(axes, walk, 60.0)
    axes.plot(walk.path[:, 1], walk.path[:, 3], "k-", linewidth=1.4)
    end, middle = walk.footprints[-1, 0] + 0.3, float(walk.path[:, 3].mean())
    axes.set_xlim(-0.3, end)
    axes.set_ylim(middle - 0.5, middle + 0.5)
    _use_floor(axes)
    axes.set_xticks(np.arange(0.0, end))
    axes.set_yticks([middle - 0.5, middle + 0.5], ["", ""])
    name_axes(axes, "downhill (leg lengths)", "")
    checks = [
        compare("step length", gait.step_length),
        compare("excursion", float(0.5 * np.ptp(walk.path[:, 3]))),
        compare("footprint angle", float(gait.state[0])),
    ]
    path = dict(zip(("time", "downhill", "up", "right"), walk.path.T, strict=True))
    tables = {"figure14_footprints": footprint_columns(walk), "figure14_path": path}
    return Result(checks, tables, picture_of(figure))


def figure_15() -> Result:
    """Figure 15: the gentle turn solid, the tight one dashed and enlarged with its footprints."""
    gentle, tight = (walk_from_gait(500, offset, 10) for offset in (SMALL_OFFSET, LARGE_OFFSET))
    figure = new_figure(10.0, 5.0)
    axes, inset = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
    axes.plot(gentle.path[:, 1], gentle.path[:, 3], "k-", linewidth=1.2)
    axes.plot(tight.path[:, 1], tight.path[:, 3], "k--", linewidth=1.2)
    axes.plot(*gentle.footprints.T, ".", color=FAINT, markersize=1.5, zorder=0)
    axes.annotate("μ = 0.006, 500 steps", (62.0, 14.0), fontsize=9)
    axes.annotate("μ = 0.05", (11.0, 8.0), fontsize=9)
    # The direction in which the gait with this offset would walk for ever, from the start
    end, rise = gentle.footprints[-1, 0], math.tan(asymptotic_heading())
    axes.plot([0.0, end], [0.0, rise * end], color=FAINT, linewidth=0.8, linestyle=":")
    axes.annotate("0.64 rad", (0.55 * end, rise * 0.55 * end - 3.0), fontsize=9, color=FAINT)
    _draw_prints(inset, tight)
    inset.plot(tight.path[:, 1], tight.path[:, 3], "k--", linewidth=1.0)
    inset.autoscale_view()
    for place, title in ((axes, "both walks"), (inset, "the tight turn, enlarged")):
        _use_floor(place)
        name_axes(place, "downhill (leg lengths)", "right (leg lengths)", title=title)
    tables = {
        "figure15_gentle": footprint_columns(gentle),
        "figure15_tight": footprint_columns(tight),
    }
    return Result(_turn_checks(gentle, tight), tables, picture_of(figure))


def _turn_checks(gentle: Walk, tight: Walk) -> list[Check]:
    reached = -float(gentle.headings[-2:].mean())
    angle = math.degrees(float(np.abs(tight.headings - tight.headings[0]).max()))
    ending = (
        f"walks all {tight.n_steps} steps"
        if tight.fall is None
        else f"falls {tight.fall.value} after {tight.n_steps} steps, having turned {angle:.0f}°"
    )
    return [
        compare(
            "heading under an offset",
            settled_heading(),
            remark=f"The heading approached; after the 500 steps drawn it is {reached:.3f}.",
        ),
        compare("turning radius, as drawn", radius_of_walk(Walker(), tight)),
        compare("turning radius", circling_gait().turning_radius),
        assess("tight turn's end", tight.fall is not None and angle > 90.0, ending),
    ]


def steering_claims() -> Result:
    """Circles, self-steering, asymmetry, and the disturbances survived."""
    gait = circling_gait()
    steps = 20 * math.ceil(2.0 * math.pi / abs(gait.turn)) * 2
    circles = circling_walker().walk(steps, state=gait.state, mass_offset=LARGE_OFFSET)
    left, right = (step.duration for step in gait.steps)
    checks = [
        assess(
            "slope that turns",
            circles.fall is None and gait.is_stable,
            f"greatest |λ| {abs(gait.eigenvalues[0]):.3f}, {circles.n_steps} steps walked",
        ),
        assess(
            "limp",
            0.01 < abs(right / left - 1.0) < 1.0,
            f"{left:.3f} on the left foot, {right:.3f} on the right, inner one",
            remark=f"More than somewhat: the steps on the inner foot last {right / left:.1f} times as long.",
        ),
        _self_steering_check(),
        _asymmetry_check(),
        *disturbance_checks(),
    ]
    return Result(checks)


def _self_steering_check() -> Check:
    """From how far aside the walker comes back, by bisection, and whether it is then in its gait."""
    gait, limits = table_1_gait().state, []
    for upward in (True, False):
        limit = largest_disturbance(
            Walker(), "heading", upward=upward, relative=False, most=math.pi, tolerance=1e-3,
            n_steps=_HOME_STEPS,
        ).largest  # fmt: skip
        walk = Walker().walk(_HOME_STEPS, state=gait + 0.999 * limit * np.eye(5)[0])
        home = walk.fall is None and abs(walk.headings[-1] - gait[0]) < _RECOVERED
        limits.append(math.degrees(limit) if home else 0.0)
    return assess(
        "self-steering",
        min(map(abs, limits)) >= 89.0,
        f"from up to {limits[0]:.1f}° to the left and {-limits[1]:.1f}° to the right",
    )


def asymmetric_turn(
    *,
    inter_leg_angle: float = 0.3,
    mass_offset: float = 0.0,
    n_strides: int = 300,
    **changed: float,
) -> float:
    """Turn per stride, rad, of a walker whose left foot's steps have another command or other parameters, ``changed``.

    On a slope that turns along, after ``n_strides`` from Table 1's gait; nan if it falls.
    """
    usual = circling_walker()
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
        "ankle spring 0.01": asymmetric_turn(ankle_stiffness=0.01),
        "ankle damper 0.01": asymmetric_turn(ankle_damping=0.01),
    }
    same = abs(asymmetric_turn())
    texts = "; ".join(f"{name}: {turn:+.1e}" for name, turn in turns.items())
    holds = all(abs(turn) > 1e-6 for turn in turns.values()) and same < 1e-9
    return assess("asymmetry", holds, f"{texts}; none: {same:.0e}")


def disturbed_walk(walker: Walker, coordinate: str, share: float) -> Walk:
    """A walk after a relative disturbance of one coordinate of Table 1's gait."""
    start = table_1_gait().state.copy()
    start[_NAMES.index(coordinate)] *= 1.0 + share
    return walker.walk(_RECOVERY_STEPS, state=start)


def recovers(walker: Walker, coordinate: str, share: float) -> bool:
    """Whether a walk starts to return to Table 1's gait after a relative disturbance.

    It must walk ``_RECOVERY_STEPS`` steps and then be nearer the gait by ten times. The slowest
    mode, the heading's, decays by 0.986 a stride.
    """
    gait, walk = table_1_gait().state, disturbed_walk(walker, coordinate, share)
    left = np.abs(walk.states[-1] - gait).max() if walk.n_steps % 2 == 0 else np.inf
    before = np.abs(walk.states[:20:2] - gait).max()
    return walk.fall is None and bool(left < _RECOVERED * before)


def disturbance_checks() -> list[Check]:
    """Section 4.4, all with the contact rule "strike", which +200 % of the stance leg's angle needs."""
    strike, trip = Walker(WalkerParameters(early_contact="strike")), Walker()
    raised = {name: recovers(strike, name, 2.0) for name in _NAMES}
    lowered = {name: recovers(strike, name, -1.0) for name in _NAMES if name != _RATE}
    angles = [largest_disturbance(walker, "stance_pitch").relative for walker in (strike, trip)]
    rates = [largest_disturbance(walker, _RATE, upward=False).relative for walker in (strike, trip)]
    ways = {p: disturbed_walk(strike, _RATE, -0.01 * p).fall for p in range(51, 100)}
    falls = {percent: way.value for percent, way in ways.items() if way is not None}
    others = [f"-{percent} %" for percent, way in falls.items() if way != "backward"]
    tens = all(falls.get(percent) == "backward" for percent in (60, 70, 80, 90))
    return [
        assess(
            "disturbance +200 %",
            all(raised.values()),
            _outcomes(raised),
            remark="A swing foot that starts below the floor counts as an immediate heel strike here and "
            f"in the rows below. The stance leg's angle is then survived to {angles[0]:+.0%}; where "
            f"the foot must first rise above the floor, to {angles[1]:+.0%} only.",
        ),
        assess("disturbance -100 %", all(lowered.values()), _outcomes(lowered)),
        assess(
            "stance leg's rate",
            recovers(strike, _RATE, -0.5) and not recovers(strike, _RATE, -0.6),
            f"{rates[0]:.1%}",
            remark=f"With the other contact rule {rates[1]:.1%}.",
        ),
        assess(
            "beyond -50 %",
            not others,
            f"{len(falls) - len(others)} of {len(falls)} backward",
            remark=f"Sideways at {', '.join(others)}: just beyond the limit it hardly passes mid-stance, and "
            "leans over in the long step; at -98 % and -99 % it leans over before it rolls back."
            + (" At -60, -70, -80 and -90 % it falls backward, as the paper says." if tens else ""),
        ),
    ]


def _outcomes(recovered: dict[str, bool]) -> str:
    return ", ".join(
        f"{name} {'recovers' if good else 'falls'}" for name, good in recovered.items()
    )


def froude_number(speed: float, leg_length: float, gravity: float = 9.81) -> float:
    """v² / (g l), in SI units."""
    return speed**2 / (gravity * leg_length)


def steering_robots() -> Result:
    """What is known of single-motor walkers that steer, beside the paper's walker: context without verdicts."""
    # Zippy's m/s and leg lengths a second: arXiv 2505.05686, abstract
    zippy, leg = 0.25, 0.25 / 10.0
    speed, unread = table_1_gait().speed, "could not be read"
    table = {
        "walker": (
            "this walker, Table 1 (simulated)",
            "Mugatu (2023, arXiv 2308.08401)",
            f"Zippy (2025, arXiv 2505.05686), leg {100 * leg:.1f} cm",
        ),
        "speed": (f"{speed:.2f} (gl)^(1/2)", unread, f"{zippy} m/s"),
        "Froude number": (
            f"{froude_number(speed, 1.0, 1.0):.2f}", unread, f"{froude_number(zippy, leg):.2f}",
        ),
        "turning radius": (f"{circling_gait().turning_radius:.1f} (μ = 0.05)", unread, unread),
    }  # fmt: skip
    section = Section(
        "Steering walkers with a single motor",
        "Mugatu and Zippy each have one motor at the hip and round feet, and steer by a swing of the "
        "legs that is not the same to both sides. Froude number v² / (g l); turning radius in leg "
        "lengths. Only the abstracts could be read: Zippy's gives its speed, from which the leg's length "
        "and the Froude number follow. The full texts, and so the turning radii, could not be read.",
        table,
    )
    return Result(sections=(section,))
