"""The skateboard, with eqs. (1) to (3) and Figures 1 and 2, and the bicycle, with eq. (5) and Figures 3 and 4."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from lean_yaw_env.paper.checks import Check, Result, assess, compare
from lean_yaw_env.paper.drawing import FAINT, STABLE_FACE, name_axes, picture_of
from lean_yaw_env.rendering.figures import new_figure
from lean_yaw_env.vehicles import (
    LinearBicycle,
    Skateboard,
    benchmark_bicycle,
    follow_eigenvalues,
    paper_bicycle,
    parameters_2005,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_TILTS = (0.3, 0.6, 0.9, 1.2)
_ALPHAS = f"α = {', '.join(map(str, _TILTS))}"
_SMALL_LEAN, _LEAN = 1e-3, 0.2
"""rad; the second one of the board drawn in Figure 2."""
_TOP_SPEED = 10.0
"""m/s, Figure 4's caption."""
_BODY = {"color": "k", "linewidth": 1.6, "solid_capstyle": "round"}
_THIN = {"color": FAINT, "linewidth": 0.8, "linestyle": "--"}
_ARROW = {"arrowstyle": "->"}


def truck_turn(lean: float, steering_tilt: float) -> float:
    """Angle by which an axle turns about its steering axis to stay level under a leaning board, rad.

    The axle (0, 1, 0), turned by b about the axis (-sin α, 0, -cos α) of the board and leant by θ about the x-axis, has the height
    cos(b) sin(θ) - sin(α) sin(b) cos(θ), which is zero where tan(b) = tan(θ) / sin(α).
    """
    return math.atan(math.tan(lean) / math.sin(steering_tilt))


def turning_circle(board: Skateboard, lean: float) -> float:
    """Radius on which a leaning board runs, m, from where its axles point, front and rear opposite."""
    turn = truck_turn(lean, board.steering_tilt)
    steer = math.atan(math.cos(board.steering_tilt) * math.tan(turn) * math.cos(lean))
    return 0.5 * board.wheelbase / math.tan(steer)


def skateboard() -> Result:
    """Section 2.1 on a board of our own numbers, with Figures 1 and 2: the parameters, a lean from behind and from above."""
    board = Skateboard()
    figure = new_figure(11.0, 4.2)
    places = figure.subplots(1, 3)
    titles = ("side view", "rear view", f"top view, θ = {_LEAN:g} rad")
    for axes, draw, title in zip(places, (_draw_side, _draw_rear, _draw_top), titles, strict=True):
        draw(axes, board)
        axes.set_aspect("equal", adjustable="datalim")  # all titles at one height
        axes.set_axis_off()
        axes.set_title(title, fontsize=10)
    checks = [*_equation_checks(board), *_board_checks(board)]
    return Result(checks, picture=picture_of(figure))


def _equation_checks(board: Skateboard) -> list[Check]:
    boards = [replace(board, steering_tilt=tilt) for tilt in _TILTS]
    off = max(
        abs(each.lateral_acceleration(_SMALL_LEAN, 1.0) * turning_circle(each, _SMALL_LEAN) - 1.0)
        for each in boards
    )
    # Newton's law of the lean: gravity, the floor that accelerates sideways, the springs
    speeds = np.linspace(0.0, 10.0, 20)
    fall = board.mass * board.gravity * board.rider_height - 2.0 * board.spring_stiffness
    push = board.mass * board.rider_height * board.lateral_acceleration(1.0, speeds)
    squared = (fall - push) / (board.mass * board.rider_height**2)
    apart = float(np.abs(board.eigenvalues(speeds)[:, 0] ** 2 - squared).max())
    speed = board.critical_speed()
    below, above = board.eigenvalues([0.999 * speed, 1.001 * speed])
    stiffness = [2.0 * (truck_turn(_SMALL_LEAN, tilt) / _SMALL_LEAN) ** 2 for tilt in _TILTS]
    return [
        assess("eq. (1)", bool(off < 1e-6), f"largest relative difference {off:.1e} at {_ALPHAS}"),
        assess(
            "eq. (2), motion",
            apart < 1e-12 * float(np.abs(squared).max()),
            f"largest difference {apart:.0e} 1/s²",
        ),
        assess(
            "eq. (2), springs",
            max(stiffness) < 2.0 * (1.0 + 1e-6),
            f"at {_ALPHAS}: {', '.join(f'{value:.2f} k' for value in stiffness)}",
        ),
        assess(
            "eq. (3)",
            bool(below.real.max() > 0.0 and abs(above.real).max() == 0.0),
            f"{speed:.4f} m/s for the default board, both ways",
        ),
    ]


def _board_checks(board: Skateboard) -> list[Check]:
    balance = 0.5 * board.mass * board.gravity * board.rider_height
    stiff = replace(board, spring_stiffness=1.01 * balance).eigenvalues(np.linspace(0.0, 10.0, 50))
    speeds = [replace(board, steering_tilt=tilt).critical_speed() for tilt in _TILTS]
    fast = 2.0 * board.critical_speed()
    damped = replace(board, damping=5.0).eigenvalues(fast).real
    rising = bool(np.all(np.diff(speeds) > 0.0))
    undamped = bool((board.eigenvalues(fast).real == 0.0).all())
    return [
        assess(
            "stiff springs",
            bool((stiff.real <= 0.0).all()),
            "no growing eigenvalue from 0 to 10 m/s",
        ),
        assess("tilt", rising, f"{_ALPHAS}: {', '.join(f'{v:.2f}' for v in speeds)} m/s"),
        assess("undamped", undamped, "an imaginary pair"),
        assess("damping", bool((damped < 0.0).all()), f"real parts {damped.max():.3f} 1/s"),
    ]


def _measure(axes: Axes, start: tuple[float, float], end: tuple[float, float], name: str) -> None:
    """A line with an arrowhead at both ends and a name beside its middle."""
    style = {"arrowstyle": "<->", "color": FAINT, "linewidth": 0.8}
    axes.annotate("", end, xytext=start, arrowprops=style)
    middle = 0.5 * (np.array(start) + end)
    axes.annotate(name, tuple(middle), xytext=(4, 4), textcoords="offset points", fontsize=10)


def _draw_side(axes: Axes, board: Skateboard) -> None:
    from matplotlib.patches import Circle

    half, high, tilt = 0.5 * board.wheelbase, board.rider_height, board.steering_tilt
    axes.plot([-0.8, 0.8], [0.0, 0.0], color=FAINT, linewidth=1.0)
    axes.plot([-1.5 * half, 1.5 * half], [0.1, 0.1], **_BODY)
    axes.plot([0.0, 0.0], [0.1, high], **_BODY)
    axes.plot(0.0, high, "ko", markersize=11)
    axes.annotate("m", (0.05, high))
    for sign in (-1.0, 1.0):
        axes.add_patch(Circle((sign * half, 0.04), 0.04, facecolor="w", edgecolor="k"))
        reach = 0.3 * np.array([-sign * math.sin(tilt), math.cos(tilt)])
        axes.plot([sign * half, sign * half + reach[0]], [0.04, 0.04 + reach[1]], **_THIN)
        axes.plot([sign * half] * 2, [0.04, 0.34], color=FAINT, linewidth=0.6, linestyle=":")
        axes.annotate("α, k", (sign * half + 0.05 * (sign - 1.0), 0.36), fontsize=9)
    _measure(axes, (-half, -0.08), (half, -0.08), "w")
    _measure(axes, (0.5, 0.0), (0.5, high), "h")
    axes.annotate("v", (0.72, 0.12), xytext=(0.52, 0.1), arrowprops=_ARROW)


def _draw_rear(axes: Axes, board: Skateboard) -> None:
    high = board.rider_height
    lean = high * np.array([math.sin(_LEAN), math.cos(_LEAN)])
    across = 0.15 * np.array([math.cos(_LEAN), -math.sin(_LEAN)])
    axes.plot([-0.5, 0.5], [0.0, 0.0], color=FAINT, linewidth=1.0)
    axes.plot([0.0, 0.0], [0.0, high], **_THIN)
    axes.plot([0.0, lean[0]], [0.05, lean[1]], **_BODY)
    axes.plot([-across[0], across[0]], [0.05 - across[1], 0.05 + across[1]], **_BODY)
    axes.plot(*lean, "ko", markersize=11)
    axes.plot([-0.12, 0.12], [0.02, 0.02], **_BODY)
    axes.annotate("θ", (0.04, 0.75 * high), fontsize=11)


def _draw_top(axes: Axes, board: Skateboard) -> None:
    half, radius = 0.5 * board.wheelbase, turning_circle(board, _LEAN)
    axes.plot([-half, half], [0.0, 0.0], **_BODY)
    centre = np.array([0.0, -radius])
    for sign in (-1.0, 1.0):
        middle = np.array([sign * half, 0.0])
        along = (middle - centre) / np.linalg.norm(middle - centre)
        ends = np.array([middle - 0.12 * along, middle + 0.12 * along])
        axes.plot(*ends.T, color="k", linewidth=2.4)
        axes.plot(*np.array([middle, centre]).T, **_THIN)
    axes.plot(*centre, "k+", markersize=8)
    _measure(axes, (0.0, 0.0), (0.0, -radius), "$r_c$")
    axes.annotate("v", (0.12, 0.096), xytext=(-0.1, 0.08), arrowprops=_ARROW)


def figure_3() -> Result:
    """In place of Figure 3: the benchmark bicycle from the side, its bodies, axes and degrees of freedom."""
    from matplotlib.patches import Circle

    p = parameters_2005()
    figure = new_figure(7.5, 5.2)
    axes = figure.subplots()
    wheels = (
        ((0.0, p.rear_wheel.radius), p.rear_wheel, "rear wheel"),
        ((p.wheelbase, p.front_wheel.radius), p.front_wheel, "front wheel"),
    )
    axes.plot([-0.6, 1.7], [0.0, 0.0], color=FAINT, linewidth=1.0)
    for hub, wheel, name in wheels:
        axes.add_patch(Circle(hub, wheel.radius, fill=False, edgecolor="k", linewidth=1.6))
        axes.annotate(name, (hub[0], hub[1] - 0.08), ha="center", fontsize=9)
    # The steer axis meets the floor a trail in front of the front contact
    foot = np.array([p.wheelbase + p.trail, 0.0])
    upward = np.array([-math.sin(p.steer_axis_tilt), math.cos(p.steer_axis_tilt)])
    head = foot + 0.8 * upward
    axes.plot(*np.array([foot, foot + 1.25 * upward]).T, **_THIN)
    frame, fork = ((body.x, -body.z) for body in (p.rear_frame, p.front_frame))
    axes.plot(*np.array([wheels[0][0], frame, head]).T, **_BODY)
    axes.plot(*np.array([wheels[1][0], head]).T, **_BODY)
    for place, name in ((frame, "rear frame with rider"), (fork, "front frame")):
        axes.plot(*place, "ko", markersize=7)
        axes.annotate(name, place, xytext=(8, 6), textcoords="offset points", fontsize=9)
    _measure(axes, (0.0, -0.14), (p.wheelbase, -0.14), "wheelbase")
    _measure(axes, (p.wheelbase, -0.05), (foot[0], -0.05), "")
    axes.annotate("trail", (foot[0] + 0.04, -0.07), fontsize=10)
    axes.annotate("steer δ, about this axis", tuple(foot + 1.2 * upward), fontsize=10)
    axes.annotate("lean φ, about x", (-0.62, 0.06), fontsize=10)
    axes.annotate("$θ_r$", (0.04, p.rear_wheel.radius + 0.05), fontsize=10)
    for name, end in (("x", (-0.3, 0.0)), ("z", (-0.55, -0.25))):
        axes.annotate("", end, xytext=(-0.55, 0.0), arrowprops=_ARROW | {"linewidth": 1.0})
        axes.annotate(name, (end[0] + 0.02, end[1] + 0.01), fontsize=10)
    axes.set_xlim(-0.7, 1.8)
    axes.set_ylim(-0.3, 1.4)
    axes.set_aspect("equal")
    axes.set_axis_off()
    return Result(picture=picture_of(figure))


def figure_4(points: int = 401) -> Result:
    """Figure 4: eigenvalues of eq. (5)'s bicycle from 0 to 10 m/s, real parts solid, imaginary parts dashed.

    The speeds at which real roots meet or an eigenvalue crosses are among those drawn; they are roots
    of conditions on the characteristic polynomial, not read off a grid.
    """
    bicycle = paper_bicycle()
    special = (bicycle.double_root_speed(), bicycle.weave_speed(), bicycle.capsize_speed())
    double, weave, capsize = (math.nan if speed is None else speed for speed in special)
    meetings = [root.speed for root in bicycle.double_roots() if root.speed < _TOP_SPEED]
    speeds = np.unique(np.concatenate([np.linspace(0.0, _TOP_SPEED, points), meetings]))
    branches = follow_eigenvalues(bicycle, speeds)
    table: dict[str, Any] = {"speed": speeds}
    for name, values in zip(branches.names, branches.eigenvalues.T, strict=True):
        table |= {f"{name}_real": values.real, f"{name}_imag": values.imag}
    figure = new_figure(7.0, 5.0)
    axes = figure.subplots()
    axes.axvspan(weave, capsize, color=STABLE_FACE, lw=0, zorder=0)
    axes.axhline(0.0, color=FAINT, linewidth=0.8)
    axes.plot(speeds, branches.eigenvalues.real, "k-", linewidth=1.4)
    frequency = np.abs(branches.eigenvalues[:, 0].imag)
    shown = np.where(branches.is_weave_oscillatory, frequency, np.nan)
    axes.plot(speeds, shown, "k--", linewidth=1.2)
    axes.set_xlim(0.0, _TOP_SPEED)
    axes.set_ylim(-10.0, 10.0)
    for speed, name in ((weave, "$v_w$"), (capsize, "$v_c$")):
        axes.plot([speed, speed], [0.0, -9.0], color=FAINT, linewidth=0.8, linestyle=":")
        axes.annotate(f"{name} = {speed:.2f}", (speed, -9.4), ha="center", va="center")
    meeting = branches.eigenvalues[np.argmin(np.abs(speeds - double)), 0].real
    axes.plot(double, meeting, "ko", markersize=4)
    for text, place in (
        ("weave, Re(λ)", (2.7, 3.3)),
        ("weave, Im(λ)", (6.6, 8.5)),
        ("capsize, Re(λ)", (7.8, 0.55)),
        ("caster, Re(λ)", (2.5, -7.0)),
        ("stable", (0.5 * (weave + capsize), -3.5)),
    ):
        axes.annotate(text, place, fontsize=9, ha="center")
    name_axes(axes, "forward speed v (m/s)", "eigenvalues λ (1/s)")
    checks = [
        _equation_5_check(bicycle),
        compare("double root", double),
        compare("weave speed", weave),
        compare("capsize speed", capsize),
        *_bicycle_checks(bicycle, double),
    ]
    return Result(checks, {"figure4": table}, picture_of(figure))


def _bicycle_checks(bicycle: LinearBicycle, double: float) -> list[Check]:
    """Section 2.2's statements."""
    slow = bicycle.eigenvalues(np.linspace(0.01, 0.99 * double, 20))
    is_pendulum = bool(np.all(slow.imag == 0.0) and np.all((slow.real > 0.0).sum(axis=1) == 2))
    # Above the weave's bifurcation
    fast = np.array([5.0, 10.0, 20.0, 40.0])
    per_speed = follow_eigenvalues(bicycle, fast).weave[:, 0].imag / fast
    capsize = []
    for values in bicycle.eigenvalues([10.0, 100.0, 1000.0]):
        real = values[values.imag == 0.0].real
        capsize.append(float(real[np.argmin(np.abs(real))]))
    return [
        assess(
            "low speed",
            is_pendulum,
            "two and two, all real" if is_pendulum else "not at every speed below",
        ),
        assess(
            "weave frequency",
            bool(per_speed[1] / per_speed[0] < 1.1),
            "frequency over speed at 5, 10, 20, 40 m/s: "
            f"{', '.join(f'{value:.3f}' for value in per_speed)} rad/m",
        ),
        assess(
            "high speed",
            capsize[0] > 5.0 * capsize[1] > 25.0 * capsize[2] > 0.0,
            f"at 10, 100, 1000 m/s: {', '.join(f'{v:.2g}' for v in capsize)} 1/s",
        ),
    ]


def _equation_5_check(printed: LinearBicycle) -> Check:
    """Eq. (5)'s matrices against those computed from masses and lengths, in units of a last digit."""
    computed, worst = benchmark_bicycle(parameters_2005()), 0.0
    for name in ("mass_matrix", "damping_matrix", "static_stiffness", "dynamic_stiffness"):
        expected, found = getattr(printed, name), getattr(computed, name)
        digits = 4 - np.floor(np.log10(np.where(expected == 0.0, 1.0, np.abs(expected))))
        worst = max(worst, float((np.abs(found - expected) * 10.0**digits).max()))
    return assess("eq. (5)", worst <= 0.5, f"at most {worst:.2f} units of the fifth digit away")
