"""The passive walkers: Figures 7 and 8, and section 4.1's claims that are in no figure."""

from __future__ import annotations

import math

import numpy as np

from lean_yaw_env.analysis import PassiveMap, find_periodic_gait, largest_disturbance, modes
from lean_yaw_env.analysis.continuation import continue_gait
from lean_yaw_env.analysis.fixed_point import solve_fixed_point
from lean_yaw_env.multibody import MultibodyWalker, find_passive_gait
from lean_yaw_env.paper.checks import (
    Check,
    Columns,
    Result,
    Section,
    assess,
    compare,
    compare_all,
    printed,
)
from lean_yaw_env.paper.drawing import (
    FAINT,
    TILT,
    draw_multipliers,
    multiplier_columns,
    name_axes,
    picture_of,
)
from lean_yaw_env.paper.walkers import (
    PASSIVE_SLOPE,
    POINT_FOOT_SLOPE,
    FlatGait,
    arc_foot_walker,
    doubling_slope,
    eigenvalues,
    flat_passive_walker,
    gait_of,
    lateral_limit_slope,
    point_foot_walker,
    root,
)
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.rendering.figures import new_figure

_FOOT_MASS = 0.001
_TILTS = (0.13, 0.17)
"""Of Figure 8."""


def leg_angles(walker: PassiveWalker, samples: int = 121) -> dict[str, np.ndarray]:
    """Time, and both legs' pitch over one step of the gait, rad, positive with the foot ahead of the hip."""
    gait = gait_of(walker)
    motion = walker.motion(gait.state, duration=0.5 * gait.stride_period, samples=samples)
    stance = motion["stance_pitch"]
    swing = stance + motion["inter_leg_angle"]
    return {"time": motion["time"], "stance_leg": stance, "swing_leg": swing}


def figure_7() -> Result:
    """Figure 7: point feet solid, arc feet dashed."""
    walkers = {"A": point_foot_walker(), "B": arc_foot_walker()}
    found = {model: leg_angles(walker) for model, walker in walkers.items()}
    figure = new_figure(6.5, 4.4)
    axes = figure.subplots()
    for data, style, name in zip(
        found.values(), ("k-", "k--"), ("point feet (A)", "arc feet (B)"), strict=True
    ):
        axes.plot(data["time"], data["stance_leg"], style, linewidth=1.4, label=name)
        axes.plot(data["time"], data["swing_leg"], style, linewidth=1.4)
    axes.axhline(0.0, color=FAINT, linewidth=0.8, linestyle=":")
    axes.annotate("stance leg", (0.25, 0.16), fontsize=9)
    axes.annotate("swing leg", (0.25, -0.235), fontsize=9)
    axes.set_xlim(0.0, 4.0)
    axes.set_ylim(-0.3, 0.3)
    axes.legend(loc="upper right", frameon=False)
    name_axes(axes, "time (leg length / gravity)$^{1/2}$", "leg angle (rad)")
    table: Columns = {
        "model": [model for model, data in found.items() for _ in data["time"]],
        **{key: np.concatenate([data[key] for data in found.values()]) for key in found["A"]},
    }
    return Result(_gait_checks(), {"figure7": table}, picture_of(figure))


def _gait_checks() -> list[Check]:
    points, arcs = gait_of(point_foot_walker()), gait_of(arc_foot_walker())
    apart = abs(arcs.speed / points.speed - 1.0)
    return [
        *compare_all("stance leg angle, ", (points.state[1], arcs.state[1])),
        assess(
            "velocity of A and B",
            apart <= 0.03,
            f"A {points.speed:.4f}, B {arcs.speed:.4f}, {apart:.1%} apart",
        ),
        compare("efficiency", POINT_FOOT_SLOPE / slope_of_pitch(float(points.state[1]))),
    ]


def slope_of_pitch(pitch: float) -> float:
    """The slope on which the arc-foot walker's gait starts its steps with this pitch."""
    state = gait_of(arc_foot_walker()).state

    def excess(slope: float) -> float:
        return float(solve_fixed_point(PassiveMap(arc_foot_walker(slope)), state)[1]) - pitch

    return root(excess, 0.95 * PASSIVE_SLOPE, 1.05 * PASSIVE_SLOPE, 1e-9)


def figure_8(points: int = 801) -> Result:
    """Figure 8: the flat passive walker at slope 0.00058 against its ankle tilt."""
    gait, tilts = FlatGait.of(flat_passive_walker()), np.linspace(*_TILTS, points)
    columns = multiplier_columns("ankle_tilt", tilts, map(gait.multipliers, tilts))
    figure = new_figure(6.5, 4.4)
    draw_multipliers(figure.subplots(), columns, TILT)
    check = tilt_check("stable tilt, passive", PASSIVE_SLOPE, _TILTS)
    return Result([check], {"figure8": columns}, picture_of(figure))


def tilt_check(name: str, slope: float, within: tuple[float, float]) -> Check:
    """Whether the ankle tilt that the paper names is stable, and none of another second decimal."""
    low, high = FlatGait.of(flat_passive_walker(slope)).stable_tilts(*within)
    named = float(printed(name).printed.split()[-1])
    holds = low < named < high and round(low, 2) == named == round(high, 2)
    return assess(name, holds, f"stable from {low:.5f} to {high:.5f}")


def passive_claims() -> Result:
    """Slope limits, basins, modes, steeper slopes."""
    flat = modes(gait_of(flat_passive_walker()))
    fore_aft = [mode.name for mode in flat].count("fore-aft")
    mixed = max(1.0 - mode.lateral_share for mode in flat if mode.name != "fore-aft")
    steep = gait_of(flat_passive_walker(POINT_FOOT_SLOPE))
    pitch = float(steep.state[1])
    checks = [
        compare("slope limit, A", doubling_slope(point_foot_walker(), (0.001, 0.03))),
        compare(
            "maximal slope, C",
            doubling_slope(arc_foot_walker(), (0.0003, 0.08)),
            otherwise="Fore-aft the gait is stable to where its period doubles, 1.3 % short of the "
            f"paper's slope. No ankle tilt keeps the flat walker upright beyond {lateral_limit_slope():.4f}.",
        ),
        _basin_check("A", point_foot_walker()),
        _basin_check("B", arc_foot_walker()),
        assess(
            "modes, C",
            fore_aft == 3,
            f"{fore_aft} fore-aft, {len(flat) - fore_aft} three-dimensional",
        ),
        assess("three-dimensional modes, C", mixed > 1e-9, f"{mixed:.0e}" if mixed > 1e-9 else "0"),
        compare(
            "stance leg angle at γ = 0.004",
            pitch,
            remark=f"The stance leg's angle, not the step length, which is {steep.step_length:.3f}.",
        ),
        tilt_check("stable tilt at γ = 0.004", POINT_FOOT_SLOPE, (pitch - 0.03, pitch + 0.03)),
    ]
    return Result(checks, sections=(_maximal_slope_section(),))


def _basin_check(model: str, walker: PassiveWalker) -> Check:
    share, what = least_deviation(walker)
    percent = int(printed(f"basin, {model}").printed.split()[0])
    return assess(
        f"basin, {model}",
        percent <= 100.0 * share < percent + 1,
        f"{100.0 * share:.2f} %",
        remark=f"The least over both signs and all initial conditions, one at a time ({what}).",
    )


def least_deviation(walker: PassiveWalker) -> tuple[float, str]:
    """The smallest relative deviation of one initial condition that makes a planar gait fall, at most 1; and which."""
    found = []
    for coordinate in ("stance_pitch", "stance_pitch_rate", "inter_leg_rate"):
        for upward in (True, False):
            survived = largest_disturbance(walker, coordinate, upward=upward, most=1.0)
            found.append((abs(survived.relative), f"{coordinate} {'up' if upward else 'down'}"))
    return min(found)


def heavy_doubling_slope(usual: float) -> float:
    """The slope at which the planar gait's period doubles with heavy feet, to first order from there without, ``usual``."""
    state = gait_of(arc_foot_walker(usual)).state
    walker = MultibodyWalker(0.0, 0.5, float(state[1]), usual, foot_mass=_FOOT_MASS)
    gait = find_passive_gait(walker, np.append(state, -2.0 * state[1]))
    heavy = max(abs(eigenvalues(gait.stride_jacobian, [1, 3, 5, 6])))
    # How fast the multiplier grows with the slope
    width = 1e-4
    grows = gait_of(arc_foot_walker(usual + width)).spectral_radius - 1.0
    return usual - (heavy - 1.0) * width / grows


def _maximal_slope_section() -> Section:
    """Section 4.1's 0.046."""
    limping = find_periodic_gait(arc_foot_walker(0.048), n_steps=2)
    branch = continue_gait(
        arc_foot_walker(0.048), "slope", (0.048, 0.08), state=limping.state, n_steps=2
    )
    leaving = branch.ends_of_stability
    usual, wider = (
        doubling_slope(arc_foot_walker(foot_radius=radius), (0.0003, 0.08))
        for radius in (0.5, 0.5045)
    )
    rows = {
        "the paper": printed("maximal slope, C").printed,
        "the gait's period doubles, which ends its stability": f"{usual:.4f}",
        "the first slope beyond it in a search in steps of 0.001": f"{math.ceil(1000.0 * usual) / 1000.0:.3f}",
        "the same with foot radius 0.5045": f"{wider:.4f}",
        f"the same with feet of mass {_FOOT_MASS:g} each, to first order": f"{heavy_doubling_slope(usual):.4f}",
        "the limping gait of two steps, born there, doubles in its turn": f"{min(leaving):.4f}"
        if leaving
        else "not below 0.08",
        "no ankle tilt keeps the walker upright sideways beyond": f"{lateral_limit_slope():.4f}",
    }
    return Section(
        "What was tried: the maximal slope",
        "The paper's limit lies between two of ours: where the symmetric gait stops being stable, and where "
        "the gait that limps, which the paper's map of two steps also takes for a fixed point, does. A search "
        "in steps of 0.001 would find the paper's number as the first slope without a stable gait; whether it was "
        "found so cannot be told from the paper. A foot radius of 0.5045 would give it too, but its digits say 0.5. "
        "Heavy feet move the limit the other way. Sideways the walker is lost on a gentler slope than any of these.",
        {"what": list(rows), "slope": list(rows.values())},
    )
