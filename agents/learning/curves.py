"""Learning curves of several trainings that differ by their seed alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.ticker import EngFormatter

from agents.learning.results import TrainingLog
from lean_yaw_env.files import written_whole
from lean_yaw_env.parameters import Vector
from lean_yaw_env.rendering.picture import new_figure

WINDOW = 128
"""Episodes that a curve's mean is of, where there are as many."""
_POINTS = 400
_DPI = 150
_LINES = (":", "-.", "--", (0, (6, 2, 1, 2, 1, 2)), (0, (1, 4)), (0, (2, 2)))
_OWN_LINE = (0, (9, 3))


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


def save_seeds_curves(
    logs: Sequence[TrainingLog],
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
    own : words of the legend and mean return of the trained policies
    levels : the same of other agents, each a line of another style
    title, trained_steps, path : of the picture, its abscissa's end, and its file
    """
    figure = new_figure(7.0, 4.2)
    axes = figure.subplots()
    steps, means = running_means(logs)
    if len(steps):
        axes.fill_between(steps, means.min(axis=0), means.max(axis=0), color="tab:blue", alpha=0.25,
                          linewidth=0.0, label=f"range over {len(logs)} seeds")  # fmt: skip
        axes.plot(steps, np.median(means, axis=0), color="tab:blue", label="median, exploring")
    axes.axhline(own[1], color="tab:blue", linewidth=1.2, linestyle=_OWN_LINE, label=own[0])
    for k, (words, level) in enumerate(levels.items()):
        style = _LINES[k % len(_LINES)]
        axes.axhline(level, color="black", linewidth=1.2, linestyle=style, label=words)
    axes.xaxis.set_major_formatter(EngFormatter(sep=""))
    axes.set_xlabel("walking steps trained (k: thousands, M: millions)")
    axes.set_ylabel("return of an episode")
    axes.set_title(title)
    axes.set_xlim(0, trained_steps)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axes.grid(color="0.9")
    axes.set_axisbelow(True)
    figure.legend(loc="outside right center", fontsize="small", frameon=False, handlelength=3.5)
    with written_whole(path) as temporary:
        figure.savefig(temporary, dpi=_DPI)
