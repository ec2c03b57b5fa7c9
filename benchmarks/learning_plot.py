"""Learning curves of two algorithms, against steps and against seconds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from matplotlib.ticker import EngFormatter

from lean_yaw_env.rendering.figures import new_figure, save_figure
from lean_yaw_env.rendering.palette import AGENT_COLOURS, unit_colour

NAMES = {"apg": "gradient agent", "ppo": "PPO"}


class LearningCurve(Protocol):
    """What is drawn of a training."""

    @property
    def algorithm(self) -> str: ...
    @property
    def steps(self) -> list[int]: ...
    @property
    def seconds(self) -> list[float]: ...
    @property
    def returns(self) -> list[float]: ...


def save_comparison(
    curves: Sequence[LearningCurve], task: str, machine: Mapping[str, Any], path: Path
) -> None:
    """Draw each training thin and the median of each algorithm's thick, on logarithmic axes of cost; the picture is written whole."""
    figure = new_figure(10.0, 4.2)
    panels = figure.subplots(1, 2, sharey=True)
    for axes, cost in zip(panels, ("steps", "seconds"), strict=True):
        for algorithm, name in NAMES.items():
            colour = unit_colour(AGENT_COLOURS[algorithm])
            own = [curve for curve in curves if curve.algorithm == algorithm]
            for curve in own:
                axes.plot(getattr(curve, cost), curve.returns, color=colour, linewidth=0.7, alpha=0.5)  # fmt: skip
            if own:
                label = f"{name}, median of {len(own)}" if len(own) > 1 else f"{name}, one training"  # fmt: skip
                axes.plot(*_median(own, cost), color=colour, linewidth=2.2, label=label)
        axes.set_xscale("log")
        axes.grid(color="0.9", which="both")
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].xaxis.set_major_formatter(EngFormatter(sep=""))
    panels[0].set_xlabel("walking steps trained (k: thousands, M: millions)")
    panels[1].xaxis.set_major_formatter(EngFormatter(sep=""))
    panels[1].set_xlabel("processor seconds of one core")
    panels[0].set_ylabel("return of a held-out episode")
    panels[0].legend(loc="lower right", frameon=False)
    figure.suptitle(
        f"{task}: score while training, without exploration ({machine['processor']})", fontsize=11
    )
    save_figure(figure, path)


def _median(curves: Sequence[LearningCurve], cost: str) -> tuple[Any, Any]:
    """The median return at costs that every training came to, interpolated between looks."""
    costs = [np.array(getattr(curve, cost), dtype=float) for curve in curves]
    low, high = max(c[0] for c in costs), min(c[-1] for c in costs)
    grid = np.geomspace(low, high, 100)
    values = [np.interp(grid, c, curve.returns) for c, curve in zip(costs, curves, strict=True)]
    return grid, np.median(values, axis=0)
