"""Figures 10 and 11: the active flat walker's multipliers against ankle tilt and slope."""

from __future__ import annotations

from typing import Any

import numpy as np

from lean_yaw_env.analysis import continue_gait
from lean_yaw_env.paper.checks import compare, judge
from lean_yaw_env.paper.drawing import new_figure, picture_of
from lean_yaw_env.paper.multiplier_curves import (
    MultiplierCurves,
    along_slope,
    along_tilt,
    draw_curves,
)
from lean_yaw_env.paper.numbers import PASSIVE_SLOPE, number, statement
from lean_yaw_env.paper.results import Result
from lean_yaw_env.paper.walkers import FlatGait, flat_active_walker, flat_passive_walker

TILT = "ankle joint orientation α (rad)"
_SLOPES_10 = (PASSIVE_SLOPE, 0.01)
_TILTS_10 = ((0.13, 0.17), (0.02, 0.8))
_TOP = 1.5
_SLOPES_11 = (0.0005, 0.02)
_TILT_11 = 0.55


def active_multipliers(points: int = 401) -> tuple[MultiplierCurves, MultiplierCurves]:
    """Figure 10: slope 0.00058 and 0.01 against ankle tilt."""
    left, right = (
        along_tilt(FlatGait.of(flat_active_walker(slope)), np.linspace(*tilts, points))
        for slope, tilts in zip(_SLOPES_10, _TILTS_10, strict=True)
    )
    return left, right


def draw_active_multipliers(left: MultiplierCurves, right: MultiplierCurves) -> Any:
    """Figure 10, both graphs."""
    figure = new_figure(10.0, 4.4)
    for axes, curves, slope in zip(figure.subplots(1, 2), (left, right), _SLOPES_10, strict=True):
        draw_curves(axes, curves, x=TILT, top=_TOP, title=f"γ = {slope:g}")
    return figure


def figure_10() -> Result:
    """Figure 10 with its checks."""
    left, right = active_multipliers()
    flat = FlatGait.of(flat_active_walker())
    low, high = flat.stable_tilts(*_TILTS_10[1])
    active = FlatGait.of(flat_active_walker(PASSIVE_SLOPE)).stable_tilts(*_TILTS_10[0])
    passive = FlatGait.of(flat_passive_walker()).stable_tilts(*_TILTS_10[0])
    is_close = all(round(a, 2) == round(b, 2) for a, b in zip(active, passive, strict=True))
    wider = (active[1] - active[0]) / (passive[1] - passive[0]) - 1.0
    zero = float(flat.multipliers(0.3)[0][-1])
    return Result(
        checks=(
            compare(number("least stable tilt"), low),
            compare(number("greatest stable tilt"), high),
            judge(
                statement("active beside passive"),
                is_close,
                ours=f"active {active[0]:.4f} to {active[1]:.4f}, "
                f"passive {passive[0]:.4f} to {passive[1]:.4f}",
                remark=f"The active walker's interval is {wider:.0%} wider, at its lower end; at "
                f"γ = 0.01 it is {(high - low) / (active[1] - active[0]):.0f} times as wide."
                if is_close
                else "An end moves to another second decimal.",
            ),
            judge(
                statement("held swing leg"),
                zero < 1e-9,
                ours=f"{zero:.0e}; the swing rate has left the section's state altogether",
                unless="It is not zero.",
            ),
        ),
        tables={"figure10_left": left.columns(), "figure10_right": right.columns()},
        picture=picture_of(draw_active_multipliers(left, right)),
        caption=(
            "|λ| of the active flat walker (d = 0, r = 0.5) at slope 0.00058 (left) and 0.01 "
            "(right): three-dimensional modes solid, fore-aft modes dashed, the stable region "
            "shaded. Mind the scales of α. The ranges of the axes are ours."
        ),
    )


def slope_multipliers(points: int = 196) -> MultiplierCurves:
    """Figure 11: ankle tilt 0.55 against the slope."""
    return along_slope(np.linspace(*_SLOPES_11, points), _TILT_11)


def stable_slope() -> float:
    """The slope at which the flat active walker with ankle tilt 0.55 becomes stable.

    Located on the branch of gaits by a root finder; nan if no multiplier crosses.
    """
    branch = continue_gait(
        flat_active_walker(_SLOPES_11[1], _TILT_11), "slope", _SLOPES_11, upward=False
    )
    return branch.events[0].value if branch.events else float("nan")


def draw_slope_multipliers(curves: MultiplierCurves) -> Any:
    """Figure 11."""
    figure = new_figure(6.5, 4.4)
    draw_curves(figure.subplots(), curves, x="slope angle γ (rad)", top=_TOP)
    return figure


def figure_11() -> Result:
    """Figure 11 with its check."""
    curves = slope_multipliers()
    return Result(
        checks=(compare(number("least stable slope"), stable_slope()),),
        tables={"figure11": curves.columns()},
        picture=picture_of(draw_slope_multipliers(curves)),
        caption=(
            "|λ| of the active flat walker (d = 0, r = 0.5, α = 0.55) against the slope: "
            "three-dimensional modes solid, fore-aft modes dashed, the stable region shaded. The "
            "ranges of the axes are ours."
        ),
    )
