"""Learning curves: of one training, episode by episode, and of several that differ only by their seed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter

from lean_yaw_env.parameters import Vector
from lean_yaw_env.rendering.figures import new_figure, save_figure
from lean_yaw_env.rendering.palette import LIGHT_GREY, VERMILION, unit_colour

from ..evaluation.episodes import RETURN, Row
from ..registry import agent_colour
from .recorder import TrainingLog

WINDOW = 128
"""Episodes in a running mean, if there are as many."""
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
    """Draw every episode's return against the steps trained, their running mean, and the evaluated agents' mean returns as levels.

    Parameters
    ----------
    log : of the training
    rows : of the evaluation
    algorithm : the trained agent's name in ``rows``
    title, trained_steps, path : of the picture: its title, the end of its abscissa, its file
    """
    figure, axes = _new_axes()
    for episodes, marker, colour, alpha, words in (
        (log.survived, ".", LIGHT_GREY, 1.0, "survived"),
        (~log.survived, "x", VERMILION, 0.5, "fell"),
    ):
        if episodes.any():
            axes.plot(log.steps[episodes], log.returns[episodes], marker, color=unit_colour(colour),
                      markersize=3, alpha=alpha, label=f"an episode, {words}")  # fmt: skip
    if len(log.returns) >= WINDOW:
        axes.plot(log.steps[WINDOW - 1 :], _running_mean(log.returns, WINDOW),
                  color=agent_colour(algorithm), label=f"mean of {WINDOW}, exploring")  # fmt: skip
    levels = {row.agent: row.mean for row in rows if row.metric == RETURN}
    own = {algorithm: levels.pop(algorithm)} if algorithm in levels else {}
    _draw_levels(axes, levels, _LINES)
    _draw_levels(axes, own, (_OWN_LINE,))
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
    logs : one for each training
    algorithm : of the trainings
    own : label in the legend, and mean return of the trained policies
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
    _draw_levels(axes, {algorithm: own[1]}, (_OWN_LINE,), own[0])
    _draw_levels(axes, levels, _LINES)
    _finish(figure, axes, title, trained_steps, path)


def running_means(logs: Sequence[TrainingLog]) -> tuple[Vector, Vector]:
    """Running means of the returns of each training at common steps.

    Returns
    -------
    steps : shape (points,)
        Where every training has a mean; empty if a training has no episode.
    means : shape (trainings, points)
    """
    fewest = min(len(log.returns) for log in logs)
    if fewest == 0:
        return np.empty(0), np.empty((len(logs), 0))
    window = max(1, min(WINDOW, fewest // 4))
    curves = [(log.steps[window - 1 :], _running_mean(log.returns, window)) for log in logs]
    first, last = max(c[0][0] for c in curves), min(c[0][-1] for c in curves)
    steps = np.linspace(first, last, _POINTS)
    return steps, np.array([np.interp(steps, *curve) for curve in curves])


def _running_mean(values: Vector, window: int) -> Vector:
    return np.convolve(values, np.full(window, 1.0 / window), "valid")


def _new_axes() -> tuple[Figure, Axes]:
    figure = new_figure(7.0, 4.2)
    return figure, figure.subplots()


def _draw_levels(
    axes: Axes, levels: Mapping[str, float], styles: Sequence[object], label: str | None = None
) -> None:
    for k, (name, level) in enumerate(levels.items()):
        axes.axhline(level, color=agent_colour(name), linewidth=1.3, linestyle=styles[k % len(styles)],
                     label=label or f"{name}, evaluated: {level:.1f}")  # fmt: skip


def _finish(figure: Figure, axes: Axes, title: str, trained_steps: int, path: Path) -> None:
    axes.xaxis.set_major_formatter(EngFormatter(sep=""))
    axes.set(
        xlabel="walking steps trained (k: thousands, M: millions)",
        ylabel="return of an episode",
        title=title,
        xlim=(0, trained_steps),
        ylim=(min(0.0, axes.get_ylim()[0]), None),
        axisbelow=True,
    )
    axes.grid(color="0.9")
    figure.legend(loc="outside right center", fontsize="small", frameon=False, handlelength=3.5)
    save_figure(figure, path)
