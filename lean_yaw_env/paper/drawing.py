"""What the paper's graphs have in common: black lines on white, a box, Greek names on the axes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lean_yaw_env.rendering.figures import save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STABLE_FACE = "#dfeee2"
"""Behind a stable region."""
FAINT = "#7c7d80"
MULTIPLIER, TILT = "|λ|", "ankle joint orientation α (rad)"
TOP = 1.5
"""The greatest |λ| shown; the paper's text does not give the ranges of its axes."""


def name_axes(axes: Axes, x: str, y: str, *, title: str = "") -> None:
    """Label an axes and give it the paper's plain box with ticks inside."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.set_title(title, fontsize=11)
    axes.tick_params(direction="in", top=True, right=True)


def picture_of(figure: Any) -> Callable[[Path], None]:
    """What draws a matplotlib figure into a file."""
    return partial(save_figure, figure, dpi=130)


def multiplier_columns(name: str, values: Any, pairs: Iterable[tuple[Any, Any]]) -> dict[str, Any]:
    """Columns of |λ| along a parameter, from fore-aft and lateral ones at each value, and whether all are below one."""
    fore_aft, lateral = (np.array(block) for block in zip(*pairs, strict=True))
    columns = {name: values}
    for kind, block in (("fore_aft", fore_aft), ("lateral", lateral)):
        columns |= {f"{kind}_{i + 1}": block[:, i] for i in range(block.shape[1])}
    return columns | {"stable": (np.hstack([fore_aft, lateral]).max(axis=1) < 1.0).astype(int)}


def draw_multipliers(axes: Axes, columns: dict[str, Any], x: str, *, title: str = "") -> None:
    """Draw such columns: three-dimensional modes solid, fore-aft modes dashed, the stable range shaded."""
    parameter, *_ = columns.values()
    axes.fill_between(
        parameter, 0.0, 1.0, where=columns["stable"] > 0, transform=axes.get_xaxis_transform(),
        color=STABLE_FACE, linewidth=0, zorder=0,
    )  # fmt: skip
    for kind, style, width in (("lateral", "k-", 1.4), ("fore_aft", "k--", 1.1)):
        for name, values in columns.items():
            if name.startswith(kind):
                # Without what is far off the graph, where a curve would be a mere vertical stroke
                shown = np.where(values < 5.0 * TOP, values, np.nan)
                axes.plot(parameter, shown, style, linewidth=width)
    axes.axhline(1.0, color=FAINT, linewidth=0.8, linestyle=":")
    axes.set_xlim(parameter[0], parameter[-1])
    axes.set_ylim(0.0, TOP)
    name_axes(axes, x, MULTIPLIER, title=title)
