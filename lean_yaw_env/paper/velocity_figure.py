"""Figure 13: walking velocity and stability of the active flat walker over slope and foot radius."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from lean_yaw_env.analysis import find_limit_cycle, stability_map
from lean_yaw_env.paper.checks import Check, compare, judge
from lean_yaw_env.paper.drawing import DARK_GREY, LIGHT_GREY, name_axes, new_figure, picture_of
from lean_yaw_env.paper.numbers import CRITICAL_TILTS, PASSIVE_SLOPE, number, statement
from lean_yaw_env.paper.results import Columns, Result
from lean_yaw_env.paper.walkers import flat_active_walker
from lean_yaw_env.parameters import INTER_LEG_ANGLE, Vector
from lean_yaw_env.vehicles import critical_speed

_SLOPES = (0.0004, 0.1)
_RADII = (0.0, 0.9)
_CONTOURS = np.arange(0.1, 1.25, 0.1)
_BOUNDARY_RADII = (0.1, 0.2, 0.4, 0.6, 0.8)
_ALMOST = 0.005
"""How far from their mean the speeds along a boundary may be: half of the printed digit."""
_SLIGHT = 0.05


@dataclass(frozen=True)
class VelocityMap:
    """Speed and stability over slope and foot radius; nan where the foot lifts off.

    Attributes
    ----------
    slopes : shape (n,)
    radii : shape (m,)
    speeds : shape (n, m)
    greatest : shape (2, n, m)
        Greatest |λ| for each of the paper's two ankle tilts, pi/8 and pi/4.
    """

    slopes: Vector
    radii: Vector
    speeds: Vector
    greatest: Vector

    def columns(self) -> Columns:
        slopes, radii = np.meshgrid(self.slopes, self.radii, indexing="ij")
        return {
            "slope": slopes.ravel(),
            "foot_radius": radii.ravel(),
            "speed": self.speeds.ravel(),
            "greatest_multiplier_pi_8": self.greatest[0].ravel(),
            "greatest_multiplier_pi_4": self.greatest[1].ravel(),
        }


def velocity_map(slopes: int = 100, radii: int = 91) -> VelocityMap:
    """Figure 13's data."""
    axes = {
        "ankle_tilt": np.array(CRITICAL_TILTS),
        # Closer where it is gentle, for there the speed changes fast
        "slope": np.linspace(_SLOPES[0] ** 0.5, _SLOPES[1] ** 0.5, slopes) ** 2,
        "foot_radius": np.linspace(*_RADII, radii),
    }
    data = stability_map(flat_active_walker(), axes, threads=2)
    speeds = data["speed"].to_numpy()
    # The tilt plays no part in the speed, but not every tilt's gait is found from every start
    return VelocityMap(
        axes["slope"],
        axes["foot_radius"],
        np.where(np.isnan(speeds[0]), speeds[1], speeds[0]),
        data["spectral_radius"].to_numpy(),
    )


def draw_velocity_map(data: VelocityMap) -> Any:
    """Velocity contours solid, stability regions grey with dashed boundaries, as in Figure 13."""
    figure = new_figure(7.5, 5.4)
    axes = figure.subplots()
    grid = np.meshgrid(data.slopes, data.radii, indexing="ij")
    for greatest, shade in zip(data.greatest, (LIGHT_GREY, DARK_GREY), strict=True):
        axes.contourf(*grid, greatest, levels=[0.0, 1.0], colors=[shade])
    for greatest in data.greatest:
        axes.contour(*grid, greatest, levels=[1.0], colors="k", linestyles="--", linewidths=1.8)
    lines = axes.contour(*grid, data.speeds, levels=_CONTOURS, colors="k", linewidths=0.8)
    axes.clabel(lines, fmt="%.1f", fontsize=8)
    missing = np.isnan(data.speeds).astype(float)
    axes.contourf(*grid, missing, levels=[0.5, 1.5], colors=["none"], hatches=["...."])
    for text, place, shade in (
        ("stable for\nα < π/8", (0.0295, 0.16), LIGHT_GREY),
        ("stable for\nα < π/4", (0.06, 0.36), DARK_GREY),
    ):
        box = {"facecolor": shade, "edgecolor": "none", "pad": 1.5}
        axes.annotate(text, place, ha="center", fontsize=10, bbox=box)
    axes.set_xlim(0.0, _SLOPES[1])
    axes.set_ylim(*_RADII)
    name_axes(axes, "slope angle γ (rad)", "foot radius r")
    return figure


@lru_cache(maxsize=16)
def flat_critical_speed(ankle_tilt: float, foot_radius: float = 0.5) -> float:
    """Lowest speed above which the active flat walker is stable."""
    return critical_speed(flat_active_walker(0.02, ankle_tilt, foot_radius))


def equation_8(slope: float, foot_radius: float) -> float:
    """The paper's approximate velocity, eq. (8), at its initial stance leg angle of 0.15."""
    return float(np.sqrt(slope / (0.5 * INTER_LEG_ANGLE)) / (1.0 - foot_radius))


def overestimate(slope: float, foot_radius: float) -> float:
    """Eq. (8) over the gait's speed, less one."""
    gait = find_limit_cycle(flat_active_walker(slope, foot_radius=foot_radius))
    return equation_8(slope, foot_radius) / gait.speed - 1.0


def boundary_checks() -> tuple[Check, ...]:
    """Critical speeds at foot radius 0.5, and how little they depend on the radius."""
    checks = []
    for name, tilt in zip(("π/8", "π/4"), CRITICAL_TILTS, strict=True):
        speeds = np.array([flat_critical_speed(tilt, radius) for radius in _BOUNDARY_RADII])
        text = ", ".join(f"{v:.3f}" for v in speeds)
        apart = float(np.abs(speeds - speeds.mean()).max())
        checks += [
            compare(
                number(f"critical speed, {name}"),
                flat_critical_speed(tilt),
                unless="The boundary is no contour of one speed: the paper's is that of small feet, see "
                "the next row.",
            ),
            judge(
                statement(f"boundary is a velocity contour, {name}"),
                apart <= _ALMOST,
                ours=f"{text} at r = 0.1, 0.2, 0.4, 0.6, 0.8",
                remark=f"Within {apart:.4f} of their mean."
                if apart <= _ALMOST
                else f"The speed falls with the foot radius, by {np.ptp(speeds) / speeds.mean():.1%} in all.",
            ),
        ]
    return tuple(checks)


def tilt_checks() -> tuple[Check, ...]:
    """That the speed does not depend on the ankle tilt, and where eq. (8) stands to it."""
    speeds = [find_limit_cycle(flat_active_walker(0.02, tilt)).speed for tilt in (0.2, 0.4, 0.7)]
    same = float(np.ptp(speeds)) < 1e-9
    usual, gentle = (overestimate(slope, 0.5) for slope in (0.01, PASSIVE_SLOPE))
    others = [
        overestimate(slope, radius) for slope in (0.01, 0.04) for radius in (0.0, 0.3, 0.5, 0.7)
    ]
    over, slight = min(others) > 0.0, max(usual, gentle) < _SLIGHT
    return (
        judge(
            statement("velocity and tilt"),
            same,
            ours=f"{speeds[0]:.6f} at α = 0.2, 0.4, 0.7",
            unless="The speed changes with the tilt.",
        ),
        judge(
            statement("eq. (8), sign"),
            over,
            ours=f"by {min(others):.1%} to {max(others):.1%}",
            remark=f"With larger feet the sign changes: {overestimate(0.01, 0.8):+.2%} at r = 0.8, "
            "γ = 0.01."
            if over
            else "It is no overestimate.",
        ),
        judge(
            statement("eq. (8), size"),
            slight,
            ours=f"{usual:.1%} at γ = 0.01, {gentle:.0%} at γ = 0.00058",
            unless="Slight where the walk is fast. What it neglects, the slowing down at mid-stance, weighs "
            "more the slower the walk.",
        ),
    )


def figure_13() -> Result:
    """Figure 13 with its checks."""
    data = velocity_map()
    return Result(
        checks=(*boundary_checks(), *tilt_checks()),
        tables={"figure13": data.columns()},
        picture=picture_of(draw_velocity_map(data)),
        caption=(
            "Velocity contours of the active flat walker (d = 0) over slope and foot radius, and "
            "where it is stable for ankle tilts up to π/8 (light) and π/4 (dark grey), the "
            "boundaries dashed. Dotted: no gait; above, a foot that can only push would lift off, at "
            "the lower left the walker does not get past mid-stance. "
            "The ranges of the axes are ours."
        ),
    )
