"""Pictures of evaluations: each task's headline with intervals, time per fall against push level, and agents' footprints on the same episode."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.rendering.figures import new_figure, panels, save_figure
from lean_yaw_env.rendering.palette import COMMAND, GOAL, REFERENCE, unit_colour
from lean_yaw_env.rendering.picture import footprint_figure

from ..agent import Agent
from ..registry import agent_colour
from .episodes import Row, direction, is_share, words
from .recording import RecordedEpisode, record_episode

PICTURED_STEPS = 120
"""Steps of an episode that are drawn: two or three commands, at a scale at which single footprints are visible."""
_DPI = 110  # as sharp as a page shows it, and a small file
_ARROW = 4.0  # leg lengths, of a commanded heading

_COLUMNS = 4
_INK = "0.2"
_LINES = ("-", "--", "-.", ":")
_MARKERS = "osD^vP*X"


def save_leaderboard_plot(rows: Sequence[Row], path: Path) -> None:
    """A panel for each task: its headline, an agent to a line, each agent in its colour."""
    tasks = list(dict.fromkeys(row.task for row in rows))
    most = max(len({row.agent for row in rows if row.task == task}) for task in tasks)
    figure, places = panels(len(tasks), _COLUMNS, (3.4, 0.9 + 0.27 * most), (0.0, 0.5))
    for task, axes in zip(tasks, places, strict=True):
        headline = task_named(task).headline
        found = [row for row in rows if row.task == task and row.metric == headline]
        _draw_headline(axes, found, task, headline)
    keys = (
        ("o", "mean, 95 % interval", _INK),
        ("o", "interquartile mean", "none"),
        ("|", "lowest and highest mean of a training", _INK),
        (">", "lower bound: no fall", _INK),
    )
    handles = [
        Line2D([], [], color=_INK, markerfacecolor=fill, marker=marker, linestyle="", label=label)
        for marker, label, fill in keys
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(tasks), 4), fontsize="small", frameon=False)  # fmt: skip
    save_figure(figure, path)


def _draw_headline(axes: Axes, rows: Sequence[Row], task: str, headline: str) -> None:
    share = is_share(task, headline)
    for place, row in enumerate(rows):
        colour = agent_colour(row.agent)
        axes.plot([row.low, row.high], [place, place], color=colour, linewidth=3.0, alpha=0.6, solid_capstyle="butt")  # fmt: skip
        # what is undefined, as the interquartile mean of a share, is not drawn
        axes.plot(row.score, place, _mark(row), color=colour, markersize=5, clip_on=False)
        axes.plot(row.iqm, place, "o", markerfacecolor="none", color=colour, markersize=8, clip_on=False)  # fmt: skip
        if row.trainings > 1:
            ends = [row.least_training, row.greatest_training]
            axes.plot(ends, [place, place], "|", color=colour, markersize=9)
    axes.set_yticks(range(len(rows)), [row.agent for row in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)
    better = "right" if direction(task, headline) > 0 else "left"
    axes.set_title(task)
    unit = " (share)" if share else ""
    axes.set_xlabel(f"{words(headline)}{unit}, better to the {better}")
    if share:
        axes.set_xlim(-0.03, 1.03)
    elif all(row.low >= 0.0 for row in rows):
        axes.set_xlim(left=0.0)
    axes.grid(axis="x", color="0.9")
    axes.set_axisbelow(True)


def _mark(row: Row) -> str:
    """Of a mean, or of what it is at least."""
    return ">" if math.isnan(row.mean) else "o"


def save_push_levels_plot(levels: Mapping[float, Sequence[Row]], path: Path) -> None:
    """Time per fall against push level, by agent, with 95 % intervals; a triangle marks a lower bound."""
    figure = new_figure(6.4, 4.0)
    axes = figure.subplots()
    for k, agent in enumerate(dict.fromkeys(row.agent for rows in levels.values() for row in rows)):
        found = {level: row for level, rows in levels.items() for row in rows if row.agent == agent}
        low, high, score = (
            np.array([10.0 ** getattr(row, name) for row in found.values()]) for name in ("low", "high", "score")
        )  # fmt: skip
        colour, x = agent_colour(agent), np.array(list(found))
        axes.fill_between(x, low, high, color=colour, alpha=0.15, linewidth=0.0)
        axes.plot(
            x, score, _LINES[k % len(_LINES)], marker=_MARKERS[k % len(_MARKERS)],
            color=colour, label=agent, markersize=5,
        )  # fmt: skip
        bound = np.isnan(high)
        axes.plot(x[bound], score[bound], "^", color=colour, markersize=10)
    axes.set_xlabel(
        "push level (1: standard deviations 0.08 on the pitch rate, 0.15 on the ankle rate)"
    )
    axes.set_ylabel("time per fall (time units)")
    axes.set_yscale("log")
    axes.grid(color="0.9")
    axes.set_axisbelow(True)
    figure.legend(loc="outside right center", fontsize="small", frameon=False)
    save_figure(figure, path)


def save_agents_footprints(
    agents: Mapping[str, tuple[Agent, EnvOptions]], task: str, path: Path, *, seed: int
) -> None:
    """Draw the first steps of one episode, of an environment's seed, for each agent in its environment, all to one scale.

    Arrows show commanded headings where they were given, circles goals (full: reached), a broad line the path to be followed.
    """
    episodes: dict[str, RecordedEpisode] = {}
    for name, (agent, options) in agents.items():
        episode = record_episode(agent, task, seed=seed, options=options, most_steps=PICTURED_STEPS)
        ending = " (ended early)" if episode.terminated else ""
        episodes[name + (" (fell)" if episode.fall else ending)] = episode
    goals = [(goal.downhill, goal.right) for each in episodes.values() for goal in each.scene.goals]
    # the same episode has the same body for every agent
    radius = next(iter(episodes.values())).scene.parameters.foot_radius
    figure, places = footprint_figure(episodes, foot_radius=radius, places=goals)
    for axes, episode in zip(places, episodes.values(), strict=True):
        _draw_task(axes, episode)
        axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
        axes.yaxis.set_major_locator(MaxNLocator(8, integer=True))
    save_figure(figure, path, dpi=_DPI)


def _draw_task(axes: Axes, episode: RecordedEpisode) -> None:
    """Commanded headings, the path to be followed and goals."""
    arrow = {"arrowstyle": "-|>", "color": unit_colour(COMMAND), "linewidth": 1.5}
    for step, heading in episode.commands:
        downhill, right = episode.footprints[step]  # a positive heading is to the left
        tip = (right - _ARROW * np.sin(heading), downhill + _ARROW * np.cos(heading))
        axes.annotate("", xy=tip, xytext=(right, downhill), arrowprops=arrow)
    if episode.scene.reference_path is not None:
        downhill, right = episode.scene.reference_path.T
        axes.plot(right, downhill, color=unit_colour(REFERENCE), linewidth=3.0, alpha=0.45, zorder=0.5)  # fmt: skip
    colour = unit_colour(GOAL)
    for goal in episode.scene.goals:
        inside = colour if goal.reached else "none"
        place = (goal.right, goal.downhill)
        axes.add_patch(Circle(place, goal.radius, facecolor=inside, edgecolor=colour, linewidth=1.5))  # fmt: skip
