"""Figure 4: eigenvalues of the uncontrolled bicycle against its speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lean_yaw_env.paper.checks import Check, compare, judge
from lean_yaw_env.paper.drawing import FAINT, STABLE_FACE, name_axes, new_figure, picture_of
from lean_yaw_env.paper.numbers import number, statement
from lean_yaw_env.paper.results import Columns, Result
from lean_yaw_env.vehicles import (
    EigenvalueBranches,
    LinearBicycle,
    benchmark_bicycle,
    follow_eigenvalues,
    paper_bicycle,
    parameters_2005,
)

_TOP_SPEED = 10.0
"""m/s, Figure 4's caption."""
_FAST = (5.0, 10.0, 20.0, 40.0)
"""m/s, where the frequency is compared with the speed: above the weave's bifurcation."""
_ALMOST_PROPORTIONAL = 0.1
_VERY_FAST = (10.0, 100.0, 1000.0)


@dataclass(frozen=True)
class BicycleEigenvalues:
    """Figure 4's data: the named branches, and the speeds that matter, m/s.

    Attributes
    ----------
    branches : EigenvalueBranches
    double_root_speed, weave_speed, capsize_speed : float
        Found as roots of the characteristic polynomial's conditions, not read off the grid.
    """

    branches: EigenvalueBranches
    double_root_speed: float
    weave_speed: float
    capsize_speed: float

    def columns(self) -> Columns:
        columns: dict[str, Any] = {"speed": self.branches.speeds}
        for i, name in enumerate(self.branches.names):
            columns[f"{name}_real"] = self.branches.eigenvalues[:, i].real
            columns[f"{name}_imag"] = self.branches.eigenvalues[:, i].imag
        return columns


def bicycle_eigenvalues(points: int = 401) -> BicycleEigenvalues:
    """Eigenvalues of eq. (5)'s bicycle at ``points`` speeds from 0 to 10 m/s.

    The speeds at which real roots meet or an eigenvalue crosses are among them.
    """
    bicycle = paper_bicycle()
    speeds = [root.speed for root in bicycle.double_roots() if root.speed < _TOP_SPEED]
    double, weave, capsize = (
        speed if speed is not None else float("nan")
        for speed in (
            bicycle.double_root_speed(),
            bicycle.weave_speed(),
            bicycle.capsize_speed(),
        )
    )
    grid = np.unique(np.concatenate([np.linspace(0.0, _TOP_SPEED, points), speeds]))
    return BicycleEigenvalues(follow_eigenvalues(bicycle, grid), double, weave, capsize)


def draw_bicycle_eigenvalues(data: BicycleEigenvalues) -> Any:
    """Real parts solid, imaginary parts dashed, as in the caption of Figure 4."""
    figure = new_figure(7.0, 5.0)
    axes = figure.subplots()
    branches = data.branches
    axes.axvspan(data.weave_speed, data.capsize_speed, color=STABLE_FACE, lw=0, zorder=0)
    axes.axhline(0.0, color=FAINT, linewidth=0.8)
    for i in range(4):
        axes.plot(branches.speeds, branches.eigenvalues[:, i].real, "k-", linewidth=1.4)
    oscillating = branches.is_weave_oscillatory
    frequency = np.where(oscillating, np.abs(branches.eigenvalues[:, 0].imag), np.nan)
    axes.plot(branches.speeds, frequency, "k--", linewidth=1.2)
    axes.set_xlim(0.0, _TOP_SPEED)
    axes.set_ylim(-10.0, 10.0)
    for speed, name in ((data.weave_speed, "$v_w$"), (data.capsize_speed, "$v_c$")):
        axes.plot([speed, speed], [0.0, -9.0], color=FAINT, linewidth=0.8, linestyle=":")
        axes.annotate(f"{name} = {speed:.2f}", (speed, -9.4), ha="center", va="center")
    axes.plot(data.double_root_speed, _meeting(data), "ko", markersize=4)
    for text, place in (
        ("weave, Re(λ)", (2.7, 3.3)),
        ("weave, Im(λ)", (6.6, 8.5)),
        ("capsize, Re(λ)", (7.8, 0.55)),
        ("caster, Re(λ)", (2.5, -7.0)),
        ("stable", (0.5 * (data.weave_speed + data.capsize_speed), -3.5)),
    ):
        axes.annotate(text, place, fontsize=9, ha="center")
    name_axes(axes, "forward speed v (m/s)", "eigenvalues λ (1/s)")
    return figure


def _meeting(data: BicycleEigenvalues) -> float:
    """The real value at which two eigenvalues meet at the lowest such speed."""
    index = int(np.argmin(np.abs(data.branches.speeds - data.double_root_speed)))
    return float(data.branches.eigenvalues[index, 0].real)


def bicycle_checks(data: BicycleEigenvalues) -> tuple[Check, ...]:
    """Section 2.2's numbers and statements."""
    bicycle = paper_bicycle()
    slow = bicycle.eigenvalues(np.linspace(0.01, 0.99 * data.double_root_speed, 20))
    is_pendulum = bool(np.all(slow.imag == 0.0) and np.all((slow.real > 0.0).sum(axis=1) == 2))
    per_speed = follow_eigenvalues(bicycle, np.array(_FAST)).weave[:, 0].imag / np.array(_FAST)
    is_proportional = bool(per_speed[1] / per_speed[0] - 1.0 < _ALMOST_PROPORTIONAL)
    capsize = [_real_nearest_zero(bicycle, speed) for speed in _VERY_FAST]
    vanishes = capsize[0] > 5.0 * capsize[1] > 25.0 * capsize[2] > 0.0
    return (
        equation_5_check(bicycle),
        compare(number("double root"), data.double_root_speed),
        compare(number("weave speed"), data.weave_speed),
        compare(number("capsize speed"), data.capsize_speed),
        judge(
            statement("low speed"),
            is_pendulum,
            ours="two and two, all real" if is_pendulum else "not at every speed below",
            unless="Some speed below has another pattern.",
        ),
        judge(
            statement("weave frequency"),
            is_proportional,
            ours="frequency over speed at 5, 10, 20, 40 m/s: "
            + ", ".join(f"{value:.3f}" for value in per_speed)
            + " rad/m",
            unless="Between 5 and 10 m/s the frequency grows faster than the speed; proportional it "
            "becomes beyond 20 m/s, off the paper's figure.",
        ),
        judge(
            statement("high speed"),
            vanishes,
            ours="at 10, 100, 1000 m/s: " + ", ".join(f"{v:.2g}" for v in capsize) + " 1/s",
            unless="It does not.",
        ),
    )


def equation_5_check(printed: LinearBicycle) -> Check:
    """Eq. (5)'s matrices against those computed from masses and lengths, in units of a last digit."""
    computed = benchmark_bicycle(parameters_2005())
    worst = 0.0
    for name in ("mass_matrix", "damping_matrix", "static_stiffness", "dynamic_stiffness"):
        expected, found = getattr(printed, name), getattr(computed, name)
        digits = 4 - np.floor(np.log10(np.where(expected == 0.0, 1.0, np.abs(expected))))
        worst = max(worst, float((np.abs(found - expected) * 10.0**digits).max()))
    return judge(
        statement("eq. (5)"),
        worst <= 0.5,
        ours=f"at most {worst:.2f} units of the fifth digit away",
        unless="An entry rounds to other digits.",
    )


def _real_nearest_zero(bicycle: LinearBicycle, speed: float) -> float:
    values = bicycle.eigenvalues(speed)[0]
    real = values[values.imag == 0.0].real
    return float(real[np.argmin(np.abs(real))])


def figure_4() -> Result:
    """Figure 4 with its checks."""
    data = bicycle_eigenvalues()
    return Result(
        checks=bicycle_checks(data),
        tables={"figure4": data.columns()},
        picture=picture_of(draw_bicycle_eigenvalues(data)),
        caption=(
            "Eigenvalues of the paper's bicycle, eq. (5): real parts solid, imaginary part dashed. "
            "Shaded: the stable range of speeds. The dot is where two real eigenvalues meet."
        ),
    )
