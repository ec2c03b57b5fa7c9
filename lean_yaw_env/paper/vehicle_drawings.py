"""Figures 1 to 3: the skateboard and the bicycle with their parameters, drawn to scale."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from lean_yaw_env.paper.drawing import FAINT, new_figure, picture_of
from lean_yaw_env.paper.results import Result
from lean_yaw_env.paper.skateboard_claims import skateboard_checks, turning_circle
from lean_yaw_env.vehicles import Skateboard, parameters_2005

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LEAN = 0.2
"""rad; of the board drawn in Figure 2."""
_BODY = {"color": "k", "linewidth": 1.6, "solid_capstyle": "round"}
_THIN = {"color": FAINT, "linewidth": 0.8, "linestyle": "--"}


def draw_skateboard() -> Any:
    """Figures 1 and 2: side view with the parameters; rear and top view of a lean to the right."""
    board = Skateboard()
    figure = new_figure(11.0, 4.2)
    side, rear, top = figure.subplots(1, 3)
    _draw_side(side, board)
    _draw_rear(rear, board)
    _draw_top(top, board)
    for axes, title in (
        (side, "side view"),
        (rear, "rear view"),
        (top, f"top view, θ = {_LEAN:g} rad"),
    ):
        axes.set_aspect("equal")
        axes.set_axis_off()
        axes.set_title(title, fontsize=10)
    return figure


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
    axes.set_ylim(-0.2, 1.15 * high)
    _measure(axes, (-half, -0.08), (half, -0.08), "w")
    _measure(axes, (0.5, 0.0), (0.5, high), "h")
    axes.annotate("v", (0.72, 0.12), xytext=(0.52, 0.1), arrowprops={"arrowstyle": "->"})


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
    half = 0.5 * board.wheelbase
    radius = turning_circle(board, _LEAN)
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
    axes.annotate("a", (0.0, -0.25), xytext=(-0.02, 0.02), arrowprops={"arrowstyle": "->"})
    axes.annotate(
        "v", (half + 0.35, 0.0), xytext=(half + 0.1, -0.02), arrowprops={"arrowstyle": "->"}
    )


def skateboard_figures() -> Result:
    """Section 2.1's checks with Figures 1 and 2."""
    return Result(
        skateboard_checks(),
        picture=picture_of(draw_skateboard()),
        caption=(
            "In place of Figures 1 and 2: the skateboard's parameters, and a lean to the right, from behind "
            "and from above, where the axles point at the centre of the turning circle. To scale, for our board."
        ),
    )


def draw_bicycle() -> Any:
    """Figure 3: the benchmark bicycle from the side, its bodies, axes and degrees of freedom."""
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
    arrow = {"arrowstyle": "->", "linewidth": 1.0}
    for name, end in (("x", (-0.3, 0.0)), ("z", (-0.55, -0.25))):
        axes.annotate("", end, xytext=(-0.55, 0.0), arrowprops=arrow)
        axes.annotate(name, (end[0] + 0.02, end[1] + 0.01), fontsize=10)
    axes.set_xlim(-0.7, 1.8)
    axes.set_ylim(-0.3, 1.4)
    axes.set_aspect("equal")
    axes.set_axis_off()
    return figure


def figure_3() -> Result:
    """In place of Figure 3."""
    return Result(
        picture=picture_of(draw_bicycle()),
        caption=(
            "In place of Figure 3: the benchmark bicycle with its four bodies (dots: centres of mass of the two "
            "frames), coordinates and degrees of freedom; to scale, by the parameters of 2005."
        ),
    )
