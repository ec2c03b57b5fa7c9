"""Pictures of walkers with agents: eigenvalues, basins of attraction and largest pushes, the agents beside one another."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from lean_yaw_env.analysis import LargestPushes
from lean_yaw_env.analysis.many_walks import ENDINGS
from lean_yaw_env.rendering.figures import new_figure, save_figure
from lean_yaw_env.rendering.palette import (
    INK,
    LIGHT_GREY,
    SERIES_COLOURS,
    STRONG_GRID,
    Colour,
    mixed,
    unit_colour,
)

from ..registry import agent_colour
from .closed_loop_report import ClosedLoopReport, share_survived

_DPI = 110
_MARKERS = {"heading": "o", "lean": "^", "pitch": "s", "masses": "D"}
_WHITE: Colour = (255, 255, 255)
_ENDING_COLOURS = [unit_colour(each) for each in (mixed(LIGHT_GREY, _WHITE, 0.5), *SERIES_COLOURS)]
"""By ending, in the order of their codes: still walking, then the ways to fall."""
_WORDS = {
    "ankle_angle": "ankle angle (rad)",
    "ankle_rate": "ankle rate (rad / time unit)",
    "stance_pitch_rate": "stance pitch rate (rad / time unit)",
}


def save_eigenvalues(reports: Sequence[ClosedLoopReport], path: Path) -> None:
    """Draw the eigenvalues of each agent's gait in the complex plane with the unit circle, and their magnitudes agent by agent; colours
    are agents, shapes what a mode is about.
    """
    figure = new_figure(11.4, 5.2)
    plane, ladder = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
    _draw_plane(plane)
    ladder.axhline(1.0, color=unit_colour(INK), linewidth=1.4)
    ladder.grid(axis="y", color=unit_colour(STRONG_GRID), linewidth=0.6)
    ladder.set_axisbelow(True)
    for k, report in enumerate(reports):
        colour = agent_colour(report.agent)
        for mode in report.modes:
            value = mode.eigenvalue
            style: dict[str, Any] = {
                "marker": _MARKERS[mode.about], "markersize": 8, "linestyle": "", "markeredgecolor": colour, "alpha": 0.85,
                "markerfacecolor": "none" if mode.is_neutral else colour, "clip_on": False,
            }  # fmt: skip
            plane.plot(value.real, value.imag, **style)
            ladder.plot(k, abs(value), **style)
        if report.gait is None:
            ladder.text(k, 0.5, "no gait", ha="center", rotation=90.0)
    ladder.set_xticks(range(len(reports)), [report.agent for report in reports])
    ladder.set_xlim(-0.6, len(reports) - 0.4)
    ladder.set_ylim(bottom=0.0)
    ladder.set_ylabel("magnitude")
    figure.suptitle(f"{reports[0].task}: eigenvalues of the closed loop's stride")
    figure.legend(handles=_mode_handles(reports), loc="outside right center", frameon=False)
    save_figure(figure, path, dpi=_DPI)


def _draw_plane(axes: Axes) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    for radius, colour, width in ((0.5, STRONG_GRID, 0.8), (1.0, INK, 1.4)):
        axes.plot(
            radius * np.cos(angle), radius * np.sin(angle), color=unit_colour(colour), linewidth=width
        )  # fmt: skip
    axes.axhline(0.0, color=unit_colour(STRONG_GRID), linewidth=0.6)
    axes.axvline(0.0, color=unit_colour(STRONG_GRID), linewidth=0.6)
    axes.set_aspect("equal")
    axes.set_xlabel("real part")
    axes.set_ylabel("imaginary part")


def _mode_handles(reports: Sequence[ClosedLoopReport]) -> list[Line2D]:
    """Agents by colour, then modes by shape."""
    handles = [
        Line2D(
            [],
            [],
            color=agent_colour(report.agent),
            marker="o",
            linestyle="",
            markersize=8,
            label=report.agent,
        )
        for report in reports
    ]
    handles += [
        Line2D([], [], color="0.25", marker=marker, linestyle="", markersize=7, label=f"mostly {motion}")
        for motion, marker in _MARKERS.items()
    ]  # fmt: skip
    hollow = Line2D([], [], color="0.25", marker="o", linestyle="", markersize=7, markerfacecolor="none", label="hollow: neutral")  # fmt: skip
    return [*handles, hollow]


def save_basins(reports: Sequence[ClosedLoopReport], path: Path) -> None:
    """Draw the basins of attraction, an agent to a column, a plane to a row."""
    planes = len(reports[0].basins)
    figure = new_figure(2.9 * len(reports) + 0.6, 2.9 * planes + 1.0)
    axes = figure.subplots(planes, len(reports), squeeze=False, sharex="row", sharey="row")
    keys = sorted(ENDINGS)
    colours = ListedColormap(_ENDING_COLOURS[: len(keys)])
    norm = BoundaryNorm(np.append(keys, keys[-1] + 1.0) - 0.5, len(keys))
    seen: set[float] = set()
    for column, report in enumerate(reports):
        for row, found in enumerate(report.basins):
            x, y = found.ending.dims
            centre = json.loads(found.attrs["centre"])
            place = axes[row, column]
            place.pcolormesh(found[x], found[y], found.ending.T, cmap=colours, norm=norm)
            place.plot(centre[x], centre[y], marker="+", color="black", markersize=9)
            place.set_title(
                f"{report.agent}: {100.0 * share_survived(found):.0f} %", fontsize="medium"
            )
            place.set_xlabel(_WORDS[x])
            seen |= set(np.unique(found.ending).tolist())
            if column == 0:
                place.set_ylabel(_WORDS[y])
    figure.suptitle(f"{reports[0].task}: how a walk from each start ends, share survived")
    handles: list[Any] = [
        Patch(facecolor=_ENDING_COLOURS[k], edgecolor="black", linewidth=0.5, label=_ending(key))
        for k, key in enumerate(keys)
        if key in seen
    ]
    handles.append(Line2D([], [], color="black", marker="+", linestyle="", label="the walker's gait"))  # fmt: skip
    columns = len(handles) if len(reports) > 3 else len(reports) + 1
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, frameon=False)
    save_figure(figure, path, dpi=_DPI)


def save_pushes(reports: Sequence[ClosedLoopReport], path: Path) -> None:
    """Draw the largest push survived in every direction of the two rates; once more near the middle, where the weak directions are."""
    pushed = [report for report in reports if report.pushes is not None]
    figure = new_figure(12.4, 5.6)
    least = [float(report.pushes.sizes.min()) for report in pushed if report.pushes]
    worst = float(np.median(least)) if least else 1.0
    for k, (reach, title) in enumerate(((None, "all of it"), (2.2 * worst, "near the middle"))):
        axes: Any = figure.add_subplot(1, 2, k + 1, projection="polar")
        for report in pushed:
            if report.pushes is not None:
                label = report.agent if k == 0 else None
                _draw_pushes(axes, report.pushes, agent_colour(report.agent), label)
        axes.set_ylim(0.0, reach)
        axes.yaxis.set_major_locator(MaxNLocator(4))
        axes.set_rlabel_position(67.5)
        axes.set_xticks(np.pi * np.arange(0.0, 2.0, 0.5), [""] * 4)
        for x, y, words in _COMPASS:
            axes.text(
                0.5 + x, 0.5 + y, words, transform=axes.transAxes, rotation=-90.0 * x / 0.54 if x else 0.0,
                ha="center", va="center", fontsize="small",
            )  # fmt: skip
        axes.set_title(title, pad=24, fontsize="medium")
    figure.suptitle(f"{reports[0].task}: largest push survived (rad / time unit)")
    if pushed:
        figure.legend(loc="outside right center", frameon=False)
    save_figure(figure, path, dpi=_DPI)


_COMPASS = (
    (0.54, 0.0, "pitch rate up: slowed"),
    (0.0, 0.54, "ankle rate up"),
    (-0.54, 0.0, "pitch rate down: sped up"),
    (0.0, -0.54, "ankle rate down"),
)


def _draw_pushes(axes: Any, pushes: LargestPushes, colour: Any, label: str | None) -> None:
    """A closed line; a ring where nothing within reach fells the walker."""
    angles = np.append(pushes.angles, pushes.angles[0])
    sizes = np.append(pushes.sizes, pushes.sizes[0])
    axes.plot(angles, sizes, color=colour, linewidth=1.8, marker=".", label=label)
    beyond = ~pushes.is_limited
    axes.plot(pushes.angles[beyond], pushes.sizes[beyond], "o", color=colour, markersize=8)


def _ending(key: float) -> str:
    return "still walking" if key == 0.0 else f"fell: {ENDINGS[key]}"
