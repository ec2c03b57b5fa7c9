"""Learning curves: of one training, episode by episode, and of several that differ by their seed alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import EngFormatter

from lean_yaw_env.parameters import Vector
from lean_yaw_env.rendering.figures import new_figure, save_figure
from lean_yaw_env.rendering.palette import LIGHT_GREY, VERMILION, unit_colour

from ..evaluation.episodes import RETURN, Row
from ..registry import agent_colour
from .recorder import TrainingLog

WINDOW = 128
"""Episodes that a curve's mean is of, where there are as many."""
_POINTS = 400
_LINES = ("-.", "--", ":", (0, (6, 2, 1, 2, 1, 2)), (0, (1, 4)), (0, (2, 2)))
_OWN_LINE = (0, (9, 3))


def save_learning_curve(
    log: TrainingLog,
    rows: Sequence[Row],
    algorithm: str,
    title: str,
    trained_steps: int,
    path: Path,
) -> None:
    """Draw every episode's return against the steps trained, their running mean, and the evaluated agents' means as levels.

    Parameters
    ----------
    log : of the training
    rows : of the evaluation
    algorithm : the name that the trained agent has in ``rows``
    title, trained_steps, path : of the picture, its abscissa's end, and its file
    """
    figure, axes = _new_axes()
    fell = ~log.survived
    axes.plot(log.steps[~fell], log.returns[~fell], ".", color=unit_colour(LIGHT_GREY),
              markersize=3, label="an episode, survived")  # fmt: skip
    if fell.any():
        axes.plot(log.steps[fell], log.returns[fell], "x", color=unit_colour(VERMILION),
                  markersize=4, alpha=0.5, label="an episode, fell")  # fmt: skip
    if len(log.returns) >= WINDOW:
        mean = np.convolve(log.returns, np.full(WINDOW, 1.0 / WINDOW), "valid")
        axes.plot(log.steps[WINDOW - 1 :], mean, color=agent_colour(algorithm),
                  label=f"mean of {WINDOW}, exploring")  # fmt: skip
    means = {row.agent: row.mean for row in rows if row.metric == RETURN}
    _draw_levels(axes, {name: mean for name, mean in means.items() if name != algorithm})
    if algorithm in means:
        _draw_own_level(axes, algorithm, means[algorithm], f"{algorithm}, evaluated: {means[algorithm]:.1f}")  # fmt: skip
    _finish(figure, axes, title, trained_steps, path)


def save_seeds_curves(
    logs: Sequence[TrainingLog],
    algorithm: str,
    own: tuple[str, float],
    levels: Mapping[str, float],
    title: str,
    trained_steps: int,
    path: Path,
) -> None:
    """Draw the median and the range over trainings of their running mean returns, and evaluated agents as levels.

    Parameters
    ----------
    logs : one of each training
    algorithm : of the trainings
    own : words of the legend and mean return of the trained policies
    levels : mean returns of other agents by their names, each a line of another style
    title, trained_steps, path : as of ``save_learning_curve``
    """
    figure, axes = _new_axes()
    colour = agent_colour(algorithm)
    steps, means = running_means(logs)
    if len(steps):
        axes.fill_between(steps, means.min(axis=0), means.max(axis=0), color=colour, alpha=0.25,
                          linewidth=0.0, label=f"range over {len(logs)} seeds")  # fmt: skip
        axes.plot(steps, np.median(means, axis=0), color=colour, label="median, exploring")
    _draw_own_level(axes, algorithm, own[1], own[0])
    _draw_levels(axes, levels)
    _finish(figure, axes, title, trained_steps, path)


def running_means(logs: Sequence[TrainingLog]) -> tuple[Vector, Vector]:
    """Running means of the returns of each training on common steps.

    Returns
    -------
    steps : shape (points,)
        Where every training has a mean; none if a training has no episode.
    means : shape (trainings, points)
    """
    fewest = min(len(log.returns) for log in logs)
    if fewest == 0:
        return np.empty(0), np.empty((len(logs), 0))
    window = max(1, min(WINDOW, fewest // 4))
    mean = np.full(window, 1.0 / window)
    curves = [(log.steps[window - 1 :], np.convolve(log.returns, mean, "valid")) for log in logs]
    first, last = max(c[0][0] for c in curves), min(c[0][-1] for c in curves)
    steps = np.linspace(first, last, _POINTS)
    return steps, np.array([np.interp(steps, *curve) for curve in curves])


def _new_axes() -> tuple[Any, Axes]:
    figure = new_figure(7.0, 4.2)
    return figure, figure.subplots()


def _draw_own_level(axes: Axes, algorithm: str, level: float, label: str) -> None:
    axes.axhline(
        level, color=agent_colour(algorithm), linewidth=1.2, linestyle=_OWN_LINE, label=label
    )


def _draw_levels(axes: Axes, levels: Mapping[str, float]) -> None:
    for k, (name, level) in enumerate(levels.items()):
        axes.axhline(level, color=agent_colour(name), linewidth=1.4, linestyle=_LINES[k % len(_LINES)],
                     label=f"{name}, evaluated: {level:.1f}")  # fmt: skip


def _finish(figure: Any, axes: Axes, title: str, trained_steps: int, path: Path) -> None:
    axes.xaxis.set_major_formatter(EngFormatter(sep=""))
    axes.set_xlabel("walking steps trained (k: thousands, M: millions)")
    axes.set_ylabel("return of an episode")
    axes.set_title(title)
    axes.set_xlim(0, trained_steps)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axes.grid(color="0.9")
    axes.set_axisbelow(True)
    figure.legend(loc="outside right center", fontsize="small", frameon=False, handlelength=3.5)
    save_figure(figure, path)
