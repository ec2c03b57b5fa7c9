"""Figures 7 and 8: the passive walkers' legs over a step, and the flat one against ankle tilt."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from lean_yaw_env.analysis import PassiveMap
from lean_yaw_env.analysis.fixed_point import solve_fixed_point
from lean_yaw_env.paper.checks import Check, compare, judge
from lean_yaw_env.paper.drawing import FAINT, name_axes, new_figure, picture_of
from lean_yaw_env.paper.multiplier_curves import MultiplierCurves, along_tilt, draw_curves
from lean_yaw_env.paper.numbers import PASSIVE_SLOPE, POINT_FOOT_SLOPE, Statement, number, statement
from lean_yaw_env.paper.results import Result
from lean_yaw_env.paper.walkers import (
    FlatGait,
    arc_foot_walker,
    flat_passive_walker,
    passive_gait,
    point_foot_walker,
)
from lean_yaw_env.parameters import Vector

_SAMPLES = 121
_TILTS_8 = (0.13, 0.17)
_TOP_8 = 1.5


@dataclass(frozen=True)
class LegAngles:
    """Both legs' pitch over one step of a gait.

    Attributes
    ----------
    time : shape (n,)
    stance, swing : shape (n,)
        rad from the floor's normal, positive with the foot ahead of the hip.
    """

    time: Vector
    stance: Vector
    swing: Vector


def leg_angles(samples: int = _SAMPLES) -> tuple[LegAngles, LegAngles]:
    """Figure 7: point-foot and arc-foot walker."""
    found = []
    for walker in (point_foot_walker(), arc_foot_walker()):
        gait = passive_gait(walker)
        motion = walker.motion(gait.state, duration=0.5 * gait.stride_period, samples=samples)
        stance = motion["stance_pitch"]
        found.append(LegAngles(motion["time"], stance, stance + motion["inter_leg_angle"]))
    return found[0], found[1]


def draw_leg_angles(points: LegAngles, arcs: LegAngles) -> Any:
    """Figure 7: point feet solid, arc feet dashed."""
    figure = new_figure(6.5, 4.4)
    axes = figure.subplots()
    for data, style, name in ((points, "k-", "point feet (A)"), (arcs, "k--", "arc feet (B)")):
        axes.plot(data.time, data.stance, style, linewidth=1.4, label=name)
        axes.plot(data.time, data.swing, style, linewidth=1.4)
    axes.axhline(0.0, color=FAINT, linewidth=0.8, linestyle=":")
    axes.annotate("stance leg", (0.25, 0.16), fontsize=9)
    axes.annotate("swing leg", (0.25, -0.235), fontsize=9)
    axes.set_xlim(0.0, 4.0)
    axes.set_ylim(-0.3, 0.3)
    axes.legend(loc="upper right", frameon=False)
    name_axes(axes, "time (leg length / gravity)$^{1/2}$", "leg angle (rad)")
    return figure


def figure_7() -> Result:
    """Figure 7 with its checks."""
    points, arcs = leg_angles()
    gaits = [passive_gait(walker) for walker in (point_foot_walker(), arc_foot_walker())]
    return Result(
        checks=_gait_checks(*[(gait.state[1], gait.speed) for gait in gaits]),
        tables={
            "figure7": {
                "model": ["A"] * points.time.size + ["B"] * arcs.time.size,
                "time": np.concatenate([points.time, arcs.time]),
                "stance_leg": np.concatenate([points.stance, arcs.stance]),
                "swing_leg": np.concatenate([points.swing, arcs.swing]),
            }
        },
        picture=picture_of(draw_leg_angles(points, arcs)),
        caption=(
            "Leg angles over one step of the passive gaits: point feet at slope 0.004 solid, arc "
            "feet (radius 0.5) at slope 0.00058 dashed. The swing leg's passing of the floor near "
            "mid-stance is ignored, as in the paper."
        ),
    )


def _gait_checks(points: tuple[float, float], arcs: tuple[float, float]) -> tuple[Check, ...]:
    same = round(arcs[1], 2) == round(points[1], 2)
    return (
        compare(number("stance leg angle, A"), points[0]),
        compare(number("stance leg angle, B"), arcs[0]),
        judge(
            statement("velocity of A and B"),
            same,
            ours=f"A {points[1]:.4f}, B {arcs[1]:.4f}, {abs(arcs[1] / points[1] - 1.0):.1%} apart",
            unless="They round to different numbers.",
        ),
        compare(
            number("efficiency"),
            POINT_FOOT_SLOPE / slope_of_pitch(points[0]),
            remark="The cost of transport is the slope.",
        ),
    )


def slope_of_pitch(pitch: float) -> float:
    """The slope on which the arc-foot walker's gait starts its steps with this pitch."""
    state = passive_gait(arc_foot_walker()).state

    def excess(slope: float) -> float:
        return float(solve_fixed_point(PassiveMap(arc_foot_walker(slope)), state)[1]) - pitch

    usual = PASSIVE_SLOPE
    return float(brentq(excess, 0.95 * usual, 1.05 * usual, xtol=1e-9))  # pyright: ignore[reportArgumentType]


def passive_multipliers(points: int = 801) -> MultiplierCurves:
    """Figure 8: the flat passive walker at slope 0.00058 against its ankle tilt."""
    gait = FlatGait.of(flat_passive_walker())
    return along_tilt(gait, np.linspace(*_TILTS_8, points))


def draw_passive_multipliers(curves: MultiplierCurves) -> Any:
    """Figure 8."""
    figure = new_figure(6.5, 4.4)
    axes = figure.subplots()
    draw_curves(axes, curves, x="ankle joint orientation α (rad)", top=_TOP_8)
    return figure


def figure_8() -> Result:
    """Figure 8 with its check."""
    curves = passive_multipliers()
    return Result(
        checks=(tilt_check(statement("stable tilt, passive"), PASSIVE_SLOPE, _TILTS_8),),
        tables={"figure8": curves.columns()},
        picture=picture_of(draw_passive_multipliers(curves)),
        caption=(
            "|λ| of the passive flat walker (d = 0, r = 0.5, γ = 0.00058): three-dimensional modes "
            "solid, fore-aft modes dashed, the stable region shaded. The ranges of the axes are "
            "ours; the paper's text does not give them."
        ),
    )


def tilt_check(printed: Statement, slope: float, within: tuple[float, float]) -> Check:
    """Whether the ankle tilt that the paper names is stable, and none of another second decimal."""
    low, high = FlatGait.of(flat_passive_walker(slope)).stable_tilts(*within)
    named = float(printed.printed.split()[-1])
    holds = low < named < high and round(low, 2) == named == round(high, 2)
    return judge(
        printed,
        holds,
        ours=f"stable from {low:.5f} to {high:.5f}",
        unless="It is not so.",
    )
