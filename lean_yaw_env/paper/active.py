"""The active flat walker: Figures 10, 11 and 13, and what sections 4.2 and 4.3 say of its slopes and its speed."""

from __future__ import annotations

import contextlib
import itertools
from functools import lru_cache

import numpy as np

from lean_yaw_env.analysis import continue_gait, planar_gait_rate, stability_map
from lean_yaw_env.engine import Engine
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.paper.checks import Check, Result, assess, compare, names_of
from lean_yaw_env.paper.drawing import (
    TILT,
    draw_multipliers,
    multiplier_columns,
    name_axes,
    picture_of,
)
from lean_yaw_env.paper.walkers import (
    CRITICAL_TILTS,
    PASSIVE_SLOPE,
    FlatGait,
    flat_active_walker,
    flat_passive_walker,
    gait_of,
    root,
)
from lean_yaw_env.parameters import INTER_LEG_ANGLE, Vector, WalkerParameters
from lean_yaw_env.rendering.figures import new_figure
from lean_yaw_env.vehicles import critical_speed
from lean_yaw_env.walker import Walker

_NARROW, _WIDE = (0.13, 0.17), (0.02, 0.8)
"""Tilts of Figure 10, left and right."""
_SLOPES_11 = (0.0005, 0.02)
_SLOPES_13, _RADII_13 = (0.0004, 0.1), (0.0, 0.9)
_GREYS = ("#d9d9d9", "#a6a6a6")
"""Of Figure 13's two stable regions."""


def figure_10(points: int = 401) -> Result:
    """Figure 10: the active flat walker at slope 0.00058 and 0.01 against its ankle tilt."""
    flat = FlatGait.of(flat_active_walker())
    gentle, passive = (
        FlatGait.of(make(PASSIVE_SLOPE)) for make in (flat_active_walker, flat_passive_walker)
    )
    figure, tables = new_figure(10.0, 4.4), {}
    for axes, side, gait, tilts, slope in zip(
        figure.subplots(1, 2), ("left", "right"), (gentle, flat), (_NARROW, _WIDE),
        (PASSIVE_SLOPE, 0.01), strict=True,
    ):  # fmt: skip
        grid = np.linspace(*tilts, points)
        columns = multiplier_columns("ankle_tilt", grid, map(gait.multipliers, grid))
        draw_multipliers(axes, columns, TILT, title=f"γ = {slope:g}")
        tables[f"figure10_{side}"] = columns
    low, high = flat.stable_tilts(*_WIDE)
    ours, other = gentle.stable_tilts(*_NARROW), passive.stable_tilts(*_NARROW)
    wider = (ours[1] - ours[0]) / (other[1] - other[0]) - 1.0
    zero = float(flat.multipliers(0.3)[0][-1])
    checks = [
        compare("least stable tilt", low),
        compare("greatest stable tilt", high),
        assess(
            "active beside passive",
            abs(wider) <= 0.1,
            f"active {ours[0]:.4f} to {ours[1]:.4f}, passive {other[0]:.4f} to {other[1]:.4f}",
            remark=f"The active walker's interval is {wider:.0%} wider, at its lower end. That is little beside "
            f"what the slope does: at γ = 0.01 it is {(high - low) / (ours[1] - ours[0]):.0f} times as wide.",
        ),
        assess(
            "held swing leg",
            zero < 1e-9,
            f"{zero:.0e}; the swing rate has left the section's state altogether",
        ),
    ]
    return Result(checks, tables, picture_of(figure))


def figure_11(points: int = 196) -> Result:
    """Figure 11: ankle tilt 0.55 against the slope; nan where there is no gait."""

    def multipliers(slope: float) -> tuple[Vector, Vector]:
        try:
            return FlatGait.of(flat_active_walker(float(slope))).multipliers(0.55)
        except NoGaitError:
            return np.full(2, np.nan), np.full(3, np.nan)

    slopes = np.linspace(*_SLOPES_11, points)
    columns = multiplier_columns("slope", slopes, map(multipliers, slopes))
    figure = new_figure(6.5, 4.4)
    draw_multipliers(figure.subplots(), columns, "slope angle γ (rad)")
    check = compare("least stable slope", stable_slope())
    return Result([check], {"figure11": columns}, picture_of(figure))


def stable_slope() -> float:
    """The slope at which the flat active walker with ankle tilt 0.55 becomes stable; nan if no multiplier crosses."""
    branch = continue_gait(flat_active_walker(_SLOPES_11[1]), "slope", _SLOPES_11, upward=False)
    return branch.events[0].value if branch.events else np.nan


def figure_13(slopes: int = 100, radii: int = 91) -> Result:
    """Figure 13: velocity contours solid, stability regions grey with dashed boundaries."""
    axes = {
        "ankle_tilt": np.array(CRITICAL_TILTS),
        # Closer where it is gentle, for there the speed changes fast
        "slope": np.linspace(_SLOPES_13[0] ** 0.5, _SLOPES_13[1] ** 0.5, slopes) ** 2,
        "foot_radius": np.linspace(*_RADII_13, radii),
    }
    data = stability_map(flat_active_walker(), axes, engine=Engine(threads=2))
    # The tilt plays no part in the speed, but not every tilt's gait is found from every start
    first, second = data["speed"].to_numpy()
    speeds, greatest = np.where(np.isnan(first), second, first), data["spectral_radius"].to_numpy()
    grid = np.meshgrid(axes["slope"], axes["foot_radius"], indexing="ij")
    table = {
        "slope": grid[0].ravel(),
        "foot_radius": grid[1].ravel(),
        "speed": speeds.ravel(),
        "greatest_multiplier_pi_8": greatest[0].ravel(),
        "greatest_multiplier_pi_4": greatest[1].ravel(),
    }
    figure = new_figure(7.5, 5.4)
    plane = figure.subplots()
    for radius, grey in zip(greatest, _GREYS, strict=True):
        plane.contourf(*grid, radius, levels=[0.0, 1.0], colors=[grey])
    for radius in greatest:
        plane.contour(*grid, radius, levels=[1.0], colors="k", linestyles="--", linewidths=1.8)
    lines = plane.contour(
        *grid, speeds, levels=np.arange(0.1, 1.25, 0.1), colors="k", linewidths=0.8
    )
    plane.clabel(lines, fmt="%.1f", fontsize=8)
    missing = np.isnan(speeds).astype(float)
    plane.contourf(*grid, missing, levels=[0.5, 1.5], colors=["none"], hatches=["...."])
    for name, place, grey in zip("84", ((0.0295, 0.16), (0.06, 0.36)), _GREYS, strict=True):
        box = {"facecolor": grey, "edgecolor": "none", "pad": 1.5}
        plane.annotate(f"stable for\nα < π/{name}", place, ha="center", fontsize=10, bbox=box)
    plane.set_xlim(0.0, _SLOPES_13[1])
    plane.set_ylim(*_RADII_13)
    name_axes(plane, "slope angle γ (rad)", "foot radius r")
    return Result([*_boundary_checks(), *_speed_checks()], {"figure13": table}, picture_of(figure))


@lru_cache(maxsize=16)
def flat_critical_speed(ankle_tilt: float, foot_radius: float = 0.5) -> float:
    """Lowest speed above which the active flat walker is stable."""
    return critical_speed(flat_active_walker(0.02, ankle_tilt, foot_radius))


def overestimate(slope: float, foot_radius: float) -> float:
    """The paper's approximate velocity, eq. (8), at its initial stance leg angle of 0.15, over the gait's, less one."""
    approximate = np.sqrt(slope / (0.5 * INTER_LEG_ANGLE)) / (1.0 - foot_radius)
    return float(approximate) / gait_of(flat_active_walker(slope, 0.55, foot_radius)).speed - 1.0


def _boundary_checks() -> list[Check]:
    """Critical speeds at foot radius 0.5, and how little they depend on the radius."""
    checks = []
    for name, tilt in zip(("π/8", "π/4"), CRITICAL_TILTS, strict=True):
        speeds = np.array([flat_critical_speed(tilt, r) for r in (0.1, 0.2, 0.4, 0.6, 0.8)])
        apart = float(np.abs(speeds - speeds.mean()).max())
        falls = np.ptp(speeds) / speeds.mean()
        is_one = apart <= 0.005
        checks += [
            compare(f"critical speed, {name}", flat_critical_speed(tilt)),
            assess(
                f"boundary is a velocity contour, {name}",
                is_one,
                f"{', '.join(f'{v:.3f}' for v in speeds)} at r = 0.1, 0.2, 0.4, 0.6, 0.8",
                remark=f"Within {apart:.4f} of their mean."
                if is_one
                else f"The speed falls with the foot radius, by {falls:.1%} in all.",
            ),
        ]
    return checks


def _speed_checks() -> list[Check]:
    """That the speed does not depend on the ankle tilt, and where eq. (8) stands to it."""
    speeds = [gait_of(flat_active_walker(0.02, tilt)).speed for tilt in (0.2, 0.4, 0.7)]
    usual, gentle = (overestimate(slope, 0.5) for slope in (0.01, PASSIVE_SLOPE))
    others: dict[float, list[float]] = {}
    for slope, radius in itertools.product((0.01, 0.04), (0.0, 0.3, 0.5, 0.7, 0.8, 0.9)):
        with contextlib.suppress(NoGaitError):
            others.setdefault(radius, []).append(overestimate(slope, radius))
    least, greatest = min(map(min, others.values())), max(map(max, others.values()))
    over = [radius for radius, values in others.items() if min(values) > 0.0]
    return [
        assess(
            "velocity and tilt",
            float(np.ptp(speeds)) < 1e-9,
            f"{speeds[0]:.6f} at α = 0.2, 0.4, 0.7",
        ),
        assess(
            "eq. (8), sign",
            least > 0.0,
            f"by {least:.1%} to {greatest:.1%}",
            remark=f"It does so up to r = {max(over):g}; with larger feet it underestimates the velocity a little.",
        ),
        assess(
            "eq. (8), size",
            max(usual, gentle) < 0.05,
            f"{usual:.1%} at γ = 0.01, {gentle:.0%} at γ = 0.00058",
        ),
    ]


def active_claims() -> Result:
    """The heuristic that the critical speed is the ankle tilt, and how steep a slope may be."""
    gentle, usual = (FlatGait.of(flat_active_walker(slope)) for slope in (PASSIVE_SLOPE, 0.01))
    speeds = [gentle.cycle.speed, usual.cycle.speed, *map(flat_critical_speed, CRITICAL_TILTS)]
    tilts = [gentle.stable_tilts(*_NARROW)[1], usual.stable_tilts(0.1, 0.8)[1], *CRITICAL_TILTS]
    checks = [
        compare(name, speed / tilt, remark=f"v = {speed:.3f} at α = {tilt:.3f}.")
        for name, speed, tilt in zip(names_of("v_min over α"), speeds, tilts, strict=True)
    ]
    slope, offset = np.polyfit(tilts, speeds, 1)
    apart = np.array(speeds) - slope * np.array(tilts) - offset
    explained = 1.0 - float(apart.var() / np.var(speeds))
    checks += [
        compare(
            "one-to-one",
            slope,
            remark=f"v_min = {slope:.3f} α {offset:+.3f} through the four points.",
        ),
        assess(
            "linear",
            explained >= 0.99,
            f"{explained:.1%} explained; at most {np.abs(apart).max():.3f} from the line",
        ),
        assess("steep slopes", False, f"{lift_off_slope():.4f}"),
        _any_combination_check(),
    ]
    return Result(checks, {"critical_speeds": {"ankle_tilt": tilts, "critical_speed": speeds}})


def _any_combination_check() -> Check:
    axes = {
        "ankle_tilt": np.linspace(0.2, 0.5 * np.pi, 15),
        "foot_radius": np.linspace(0.0, 0.8, 5),
        "slope": np.linspace(0.002, 0.16, 80),
    }
    counts = []
    for hip_width in (0.0, WalkerParameters().hip_width):
        data = stability_map(Walker(WalkerParameters(hip_width)), axes, engine=Engine(threads=2))
        counts.append(int((data["spectral_radius"] < 1.0).any("slope").sum()))
    return assess(
        "any combination", counts[0] == 75, f"{counts[0]} of 75; at d = 0.3 {counts[1]} of 75"
    )


def least_normal_force(slope: float) -> float:
    """Least normal force, in weights, over a step of the flat active gait; below zero the floor has to pull."""
    walker = flat_active_walker(slope)
    half, rate = 0.5 * INTER_LEG_ANGLE, planar_gait_rate(walker, INTER_LEG_ANGLE)
    state = np.array([0.0, half, 0.0, rate, 0.0])
    # It never turns as slowly as half of its rate just after a strike on slopes as steep as these
    motion = walker.stance_motion(state, duration=4.0 * half / abs(rate), samples=2001)
    return float(motion["normal_force"][motion["stance_pitch"] >= -half].min())


def lift_off_slope() -> float:
    """The slope beyond which the flat active walker's foot lifts off."""
    return root(least_normal_force, 0.04, 0.12, 1e-6)
