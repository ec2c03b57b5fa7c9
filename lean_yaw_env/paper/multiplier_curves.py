"""Curves of |λ| against one parameter of a flat walker: Figures 8, 10 and 11."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.paper.drawing import MULTIPLIER, mark_unit_circle, name_axes, shade_intervals
from lean_yaw_env.paper.results import Columns
from lean_yaw_env.paper.walkers import FlatGait, flat_active_walker
from lean_yaw_env.parameters import Vector

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class MultiplierCurves:
    """Magnitudes of the stride's multipliers along a parameter.

    Attributes
    ----------
    parameter : str
    values : shape (n,)
    fore_aft : shape (n, 2) or (n, 3)
        By falling magnitude.
    lateral : shape (n, 3)
        Of the three-dimensional modes, by falling magnitude.
    """

    parameter: str
    values: Vector
    fore_aft: Vector
    lateral: Vector

    @property
    def is_stable(self) -> NDArray[np.bool_]:
        """Shape (n,)."""
        return np.hstack([self.fore_aft, self.lateral]).max(axis=1) < 1.0

    def columns(self) -> Columns:
        columns = {self.parameter: self.values}
        for name, block in (("fore_aft", self.fore_aft), ("lateral", self.lateral)):
            columns |= {f"{name}_{i + 1}": block[:, i] for i in range(block.shape[1])}
        return {**columns, "stable": self.is_stable.astype(int)}


def along_tilt(gait: FlatGait, tilts: Vector) -> MultiplierCurves:
    """Multipliers of a flat gait against the ankle tilt."""
    pairs = [gait.multipliers(float(tilt)) for tilt in tilts]
    return MultiplierCurves(
        "ankle_tilt", tilts, np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs])
    )


def along_slope(slopes: Vector, ankle_tilt: float) -> MultiplierCurves:
    """Multipliers of the flat active walker against the slope; nan where it has no gait."""
    fore_aft, lateral = np.full((slopes.size, 2), np.nan), np.full((slopes.size, 3), np.nan)
    for i, slope in enumerate(slopes):
        try:
            gait = FlatGait.of(flat_active_walker(float(slope), ankle_tilt))
        except NoGaitError:
            continue
        fore_aft[i], lateral[i] = gait.multipliers(ankle_tilt)
    return MultiplierCurves("slope", slopes, fore_aft, lateral)


def draw_curves(
    axes: Axes, curves: MultiplierCurves, *, x: str, top: float, title: str = ""
) -> None:
    """Draw |λ|: three-dimensional modes solid, fore-aft modes dashed, the stable range shaded."""
    shade_intervals(axes, curves.values, curves.is_stable, label="stable")
    axes.plot(curves.values, _within(curves.lateral, top), "k-", linewidth=1.4)
    axes.plot(curves.values, _within(curves.fore_aft, top), "k--", linewidth=1.1)
    mark_unit_circle(axes)
    axes.set_xlim(curves.values[0], curves.values[-1])
    axes.set_ylim(0.0, top)
    name_axes(axes, x, MULTIPLIER, title=title)


def _within(values: Vector, top: float) -> Vector:
    """Without what is far off the graph, where a curve would be a mere vertical stroke."""
    return np.where(values < 5.0 * top, values, np.nan)
