"""Pictures of walkers with agents: eigenvalues, basins of attraction and largest pushes, the agents beside one another."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
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
_COMPASS = (
    (0.54, 0.0, -90.0, "pitch rate up: slowed"),
    (0.0, 0.54, 0.0, "ankle rate up"),
    (-0.54, 0.0, 90.0, "pitch rate down: sped up"),
    (0.0, -0.54, 0.0, "ankle rate down"),
)
"""Where words stand around a plot of pushes, from its middle, and their turn in degrees."""


def save_eigenvalues(reports: Sequence[ClosedLoopReport], path: Path) -> None:
    """Draw the eigenvalues of each agent's gait in the complex plane with the unit circle, and their magnitudes agent by agent; colours
    are agents, shapes what a mode is about.
    """
    figure = new_figure(11.4, 5.2)
    plane, ladder = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
    angles = np.linspace(0.0, 2.0 * np.pi, 361)
    for radius, colour, width in ((0.5, STRONG_GRID, 0.8), (1.0, INK, 1.4)):
        x, y = radius * np.cos(angles), radius * np.sin(angles)
        plane.plot(x, y, color=unit_colour(colour), linewidth=width)
    plane.axhline(0.0, color=unit_colour(STRONG_GRID), linewidth=0.6)
    plane.axvline(0.0, color=unit_colour(STRONG_GRID), linewidth=0.6)
    plane.set(aspect="equal", xlabel="real part", ylabel="imaginary part")
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
    ladder.set(xlim=(-0.6, len(reports) - 0.4), ylim=(0.0, None), ylabel="magnitude")
    figure.suptitle(f"{reports[0].task}: eigenvalues of the closed loop's stride")
    figure.legend(handles=_mode_handles(reports), loc="outside right center", frameon=False)
    save_figure(figure, path, dpi=_DPI)


def _mode_handles(reports: Sequence[ClosedLoopReport]) -> list[Line2D]:
    """Agents by colour, then modes by shape."""
    keys: list[tuple[str, str, Any, str | None]]
    keys = [(report.agent, "o", agent_colour(report.agent), None) for report in reports]
    keys += [(f"mostly {motion}", marker, "0.25", None) for motion, marker in _MARKERS.items()]
    keys.append(("hollow: neutral", "o", "0.25", "none"))
    return [
        Line2D([], [], label=label, marker=marker, color=colour, markerfacecolor=fill, linestyle="", markersize=7)
        for label, marker, colour, fill in keys
    ]  # fmt: skip


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
            share = f"{100.0 * share_survived(found):.0f} %"
            place.set_title(f"{report.agent}: {share}", fontsize="medium")
            place.set_xlabel(_WORDS[x])
            seen |= set(np.unique(found.ending).tolist())
            if column == 0:
                place.set_ylabel(_WORDS[y])
    figure.suptitle(f"{reports[0].task}: how a walk from each start ends, share survived")
    handles: list[Any] = [
        Patch(
            facecolor=_ENDING_COLOURS[k],
            edgecolor="black",
            linewidth=0.5,
            label=f"fell: {ENDINGS[key]}" if key else "still walking",
        )
        for k, key in enumerate(keys)
        if key in seen
    ]
    handles.append(Line2D([], [], color="black", marker="+", linestyle="", label="the walker's gait"))  # fmt: skip
    columns = len(handles) if len(reports) > 3 else len(reports) + 1
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, frameon=False)
    save_figure(figure, path, dpi=_DPI)


def save_pushes(reports: Sequence[ClosedLoopReport], path: Path) -> None:
    """Draw the largest push survived in every direction of the two rates; once more near the middle, where the weak directions are."""
    pushed = {each.agent: each.pushes for each in reports if each.pushes is not None}
    figure = new_figure(12.4, 5.6)
    least = [float(pushes.sizes.min()) for pushes in pushed.values()]
    worst = float(np.median(least)) if least else 1.0
    for k, (reach, title) in enumerate(((None, "all of it"), (2.2 * worst, "near the middle"))):
        axes: Any = figure.add_subplot(1, 2, k + 1, projection="polar")
        for agent, pushes in pushed.items():
            _draw_pushes(axes, pushes, agent_colour(agent), agent if k == 0 else None)
        axes.set_ylim(0.0, reach)
        axes.yaxis.set_major_locator(MaxNLocator(4))
        axes.set_rlabel_position(67.5)
        axes.set_xticks(np.pi * np.arange(0.0, 2.0, 0.5), [""] * 4)
        for x, y, turn, words in _COMPASS:
            axes.text(
                0.5 + x, 0.5 + y, words, transform=axes.transAxes, rotation=turn, ha="center", va="center", fontsize="small"
            )  # fmt: skip
        axes.set_title(title, pad=24, fontsize="medium")
    figure.suptitle(f"{reports[0].task}: largest push survived (rad / time unit)")
    if pushed:
        figure.legend(loc="outside right center", frameon=False)
    save_figure(figure, path, dpi=_DPI)


def _draw_pushes(axes: Any, pushes: LargestPushes, colour: Any, label: str | None) -> None:
    """A closed line; a ring marks a direction in which no push within reach causes a fall."""
    angles = np.append(pushes.angles, pushes.angles[0])
    sizes = np.append(pushes.sizes, pushes.sizes[0])
    axes.plot(angles, sizes, color=colour, linewidth=1.8, marker=".", label=label)
    beyond = ~pushes.is_limited
    axes.plot(pushes.angles[beyond], pushes.sizes[beyond], "o", color=colour, markersize=8)
