"""Pictures of a training: its learning curve, and footprints of agents on one episode."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from matplotlib.ticker import EngFormatter, MaxNLocator

from agents.agent import Agent
from agents.evaluation.recording import RecordedEpisode, record_episode
from agents.evaluation.results import RETURN, Row
from agents.learning.results import TrainingLog
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.parameters import Vector
from lean_yaw_env.rendering.figures import new_figure, save_figure
from lean_yaw_env.rendering.palette import COMMAND, GOAL, REFERENCE, unit_colour
from lean_yaw_env.rendering.picture import footprint_figure

WINDOW = 128
"""Episodes that the curve's mean is of."""
PICTURED_STEPS = 120
"""Steps of an episode that are drawn: two or three commands, at a scale at which footprints can be told apart."""
_FOOTPRINTS_DPI = 110  # as sharp as a page shows it, and a small file
_ARROW = 4.0  # leg lengths, of a commanded heading
_STYLES = {"random": ":", "fixed": "-.", "feedback": "--", "ppo": "-"}


def save_learning_curve(
    log: TrainingLog, rows: list[Row], title: str, trained_steps: int, path: Path
) -> None:
    """Draw every episode's return against the steps trained, their running mean, and the evaluated agents' means as levels."""
    figure = new_figure(7.0, 4.2)
    axes = figure.subplots()
    fell = ~log.survived
    axes.plot(
        log.steps[~fell],
        log.returns[~fell],
        ".",
        color="0.75",
        markersize=3,
        label="an episode, survived",
    )
    if fell.any():
        axes.plot(log.steps[fell], log.returns[fell], "x", color="tab:red", markersize=4, alpha=0.5, label="an episode, fell")  # fmt: skip
    if len(log.returns) >= WINDOW:
        mean = np.convolve(log.returns, np.full(WINDOW, 1.0 / WINDOW), "valid")
        axes.plot(
            log.steps[WINDOW - 1 :], mean, color="tab:blue", label=f"mean of {WINDOW}, exploring"
        )
    for row in rows:
        if row.metric == RETURN:
            style = _STYLES.get(row.agent, "-")
            axes.axhline(row.mean, color="black", linewidth=1.0, linestyle=style, label=f"{row.agent}, evaluated: {row.mean:.1f}")  # fmt: skip
    axes.xaxis.set_major_formatter(EngFormatter(sep=""))
    axes.set_xlabel("walking steps trained (k: thousands, M: millions)")
    axes.set_ylabel("return of an episode")
    axes.set_title(title)
    axes.set_xlim(0, trained_steps)
    axes.set_ylim(bottom=0)
    axes.grid(color="0.9")
    axes.set_axisbelow(True)
    figure.legend(loc="outside right center", fontsize="small", frameon=False)
    save_figure(figure, path)


def save_agents_footprints(
    agents: Mapping[str, Agent],
    task: str,
    path: Path,
    *,
    seed: int,
    options: EnvOptions | None = None,
) -> None:
    """Draw the first steps of one episode, of an environment's seed, for each agent, all to one scale.

    Arrows show commanded headings where they were given, circles goals (full: reached), a broad line the path to be followed.
    """
    episodes = {
        name: record_episode(agent, task, seed=seed, options=options, most_steps=PICTURED_STEPS)
        for name, agent in agents.items()
    }
    parameters = (EnvOptions() if options is None else options).walker_parameters(task_named(task))
    titled = {_title(name, episode): episode for name, episode in episodes.items()}
    goals = [(goal.downhill, goal.right) for each in titled.values() for goal in each.goals]
    figure, panels = footprint_figure(titled, foot_radius=parameters.foot_radius, places=goals)
    for panel, episode in zip(panels, titled.values(), strict=True):
        _draw_task(panel, episode)
        panel.xaxis.set_major_locator(MaxNLocator(5, integer=True))
        panel.yaxis.set_major_locator(MaxNLocator(8, integer=True))
    save_figure(figure, path, dpi=_FOOTPRINTS_DPI)


def _title(name: str, episode: RecordedEpisode) -> str:
    if episode.fall is not None:
        return f"{name} (fell)"
    return f"{name} (ended early)" if episode.terminated else name


def _draw_task(axes: Axes, episode: RecordedEpisode) -> None:
    """What was asked for: headings, goals, a path."""
    for step, heading in episode.commands:
        _draw_command(axes, episode.footprints[step], heading)
    if episode.reference_path is not None:
        downhill, right = episode.reference_path.T
        axes.plot(right, downhill, color=unit_colour(REFERENCE), linewidth=3.0, alpha=0.45, zorder=0.5)  # fmt: skip
    for goal in episode.goals:
        colour = unit_colour(GOAL)
        axes.add_patch(
            Circle(
                (goal.right, goal.downhill),
                goal.radius,
                facecolor=colour if goal.reached else "none",
                edgecolor=colour,
                linewidth=1.5,
            )
        )


def _draw_command(axes: Axes, footprint: Vector, heading: float) -> None:
    """An arrow from a footprint towards a heading; a positive one is to the left."""
    downhill, right = footprint
    tip = (right - _ARROW * np.sin(heading), downhill + _ARROW * np.cos(heading))
    axes.annotate(
        "",
        xy=tip,
        xytext=(right, downhill),
        arrowprops={"arrowstyle": "-|>", "color": unit_colour(COMMAND), "linewidth": 1.5},
    )
