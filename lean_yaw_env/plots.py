"""Figures of what the analysis finds: a gait, a map of gaits, a basin of attraction, a vehicle's eigenvalues. They need matplotlib."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lean_yaw_env.analysis import LimitCycle, modes
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.rendering.figures import new_figure, panels
from lean_yaw_env.rendering.palette import (
    FAINT_INK,
    GREEN,
    LIGHT_GREY,
    SERIES_COLOURS,
    STRONG_GRID,
    mixed,
    unit_colour,
)

__all__ = ["basin_figure", "eigenvalue_figure", "gait_figure", "map_figure", "use_style"]

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from lean_yaw_env.parameters import Vector

_FAINT = unit_colour(FAINT_INK)
_STABLE, _UNSTABLE = (
    unit_colour(mixed(colour, (255, 255, 255), 0.7)) for colour in (GREEN, LIGHT_GREY)
)
_COLOURS = [unit_colour(colour) for colour in SERIES_COLOURS]
_MOST_PANELS = 6


def _name(name: str) -> str:
    return name.replace("_", " ")


def use_style() -> None:
    """Give pyplot's figures of this program the colours and lines of the package's own."""
    from cycler import cycler
    from matplotlib import rcParams

    rcParams.update(
        {
            "axes.prop_cycle": cycler(color=_COLOURS),
            "axes.spines.right": False,
            "axes.spines.top": False,
            "figure.constrained_layout.use": True,
            "figure.figsize": (8.0, 3.6),
            "grid.color": unit_colour(STRONG_GRID),
            "legend.frameon": False,
        }
    )


def gait_figure(cycle: LimitCycle) -> Figure:
    """A gait: angles and contact force over its cycle, and its multipliers beside the unit circle."""
    figure = new_figure(12.0, 4.0)
    angles, force, plane = figure.subplots(1, 3, width_ratios=(1.3, 1.0, 1.0))
    walker, began = cycle.section_map.walker, 0.0
    for step in cycle.steps:
        motion = cycle.stance_motion(step)
        time = began + motion["time"]
        curves = {"stance leg": motion["stance_pitch"], "ankle": motion["ankle_angle"]}
        if isinstance(walker, PassiveWalker):
            swing = walker.motion(step.start, duration=step.duration, stance=step.foot)
            curves["swing leg"] = swing["stance_pitch"] + swing["inter_leg_angle"]
        for (name, curve), colour in zip(curves.items(), _COLOURS, strict=False):
            angles.plot(time, curve, color=colour, label=name if began == 0.0 else None)
        force.plot(time, motion["normal_force"], color=_COLOURS[0])
        began += step.duration
        for axes in (angles, force):
            axes.axvline(began, color=_FAINT, linewidth=0.6, linestyle=":")
    angles.legend(frameon=False)
    angles.set(xlabel="time", ylabel="angle (rad)", title="angles, from heel strike to heel strike")
    force.set(xlabel="time", ylabel="normal force (weights)", title="contact")
    force.set_ylim(0.0, 1.1 * force.get_ylim()[1])
    _draw_multipliers(plane, cycle)
    kind = "stable" if cycle.is_stable else "unstable"
    figure.suptitle(f"{kind} gait: speed {cycle.speed:.4g}, step length {cycle.step_length:.4g}")
    return figure


def _draw_multipliers(plane: Axes, cycle: LimitCycle) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    plane.plot(np.cos(turn), np.sin(turn), color=_FAINT, linewidth=0.8)
    for name, colour in zip(("fore-aft", "three-dimensional"), _COLOURS, strict=False):
        values = [mode.eigenvalue for mode in modes(cycle) if mode.name == name]
        if values:
            plane.plot(np.real(values), np.imag(values), "o", color=colour, label=name)
    plane.axhline(0.0, color=_FAINT, linewidth=0.5)
    plane.axvline(0.0, color=_FAINT, linewidth=0.5)
    plane.set_aspect("equal", adjustable="datalim")
    plane.legend(frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2)
    plane.set(xlabel="real part", ylabel="imaginary part", title="multipliers of the cycle")


def map_figure(data: xarray.Dataset) -> Figure:
    """A stability map: over one parameter the magnitudes of the multipliers and the speed, over two a plane, over three planes at some values of the first."""
    names = [str(name) for name in data["spectral_radius"].dims]
    if len(names) == 1:
        return _line_map(data, names[0])
    if len(names) == 2:
        slices = {"": data}
    else:
        first, values = names[0], data[names[0]].to_numpy()
        chosen = np.unique(np.linspace(0, values.size - 1, min(values.size, _MOST_PANELS)).round())
        slices = {
            f"{_name(first)} {values[k]:.4g}": data.isel({first: k}) for k in chosen.astype(int)
        }
    figure, places = panels(len(slices), 3, (5.5, 4.2), (0.5, 0.0))
    for axes, (title, part) in zip(places, slices.items(), strict=True):
        _draw_plane(axes, part, *names[-2:])
        axes.set_title(title, fontsize=10)
    figure.suptitle(
        "green stable, grey unstable, hatched no gait found; lines of equal speed", fontsize=10
    )
    return figure


def _line_map(data: xarray.Dataset, name: str) -> Figure:
    x = data[name].to_numpy()
    magnitudes = np.hypot(data["eigenvalue_real"].to_numpy(), data["eigenvalue_imag"].to_numpy())
    figure = new_figure(7.0, 6.0)
    above, below = figure.subplots(2, 1, sharex=True)
    stable = data["spectral_radius"].to_numpy() < 1.0
    above.fill_between(
        x, 0.0, 1.0, where=stable, transform=above.get_xaxis_transform(), color=_STABLE, linewidth=0
    )
    above.plot(x, magnitudes, "k.-", linewidth=1.0, markersize=3)
    above.axhline(1.0, color=_FAINT, linewidth=0.8, linestyle=":")
    above.set(ylabel="|λ| of the stride", ylim=(0.0, 2.0), title="stable where green")
    below.plot(x, data["speed"].to_numpy(), ".-", color=_COLOURS[0], markersize=3)
    below.set(xlabel=_name(name), ylabel="speed")
    return figure


def _draw_plane(axes: Axes, data: xarray.Dataset, x: str, y: str) -> None:
    from matplotlib.colors import ListedColormap

    radius, speed = data["spectral_radius"].to_numpy().T, data["speed"].to_numpy().T
    places = (data[x].to_numpy(), data[y].to_numpy())
    axes.set_facecolor("white")
    axes.patch.set(hatch="////", edgecolor=unit_colour(LIGHT_GREY))
    colours = ListedColormap([_STABLE, _UNSTABLE])
    shown = np.ma.masked_where(np.isnan(radius), (radius >= 1.0).astype(float))
    axes.pcolormesh(*places, shown, cmap=colours, vmin=0.0, vmax=1.0, shading="nearest")
    if np.isfinite(speed).sum() > 3 and min(speed.shape) > 1:
        lines = axes.contour(*places, speed, levels=8, colors="k", linewidths=0.8)
        axes.clabel(lines, fmt="%.2g", fontsize=8)
    axes.set(xlabel=_name(x), ylabel=_name(y))


def basin_figure(data: xarray.Dataset) -> Figure:
    """A basin of attraction: how the walk from each point of the plane ends, and where the gait is."""
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    x, y = (str(name) for name in data["ending"].dims)
    meanings = json.loads(data["ending"].attrs["meanings"])
    endings = data["ending"].to_numpy().T
    found = [code for code in sorted(map(int, meanings)) if (endings == code).any()]
    colours = [_STABLE if code == 0 else _COLOURS[1 + k] for k, code in enumerate(found)]
    index = np.searchsorted(found, endings)
    figure = new_figure(8.0, 5.0)
    axes = figure.subplots()
    axes.pcolormesh(
        data[x].to_numpy(), data[y].to_numpy(), index, cmap=ListedColormap(colours), shading="nearest",
        vmin=-0.5, vmax=len(found) - 0.5,
    )  # fmt: skip
    centre = json.loads(data.attrs["centre"])
    axes.plot(centre[x], centre[y], "k+", markersize=12, markeredgewidth=2.0)
    handles: list[Any] = [
        Patch(color=colour, label=f"{meanings[str(code)]} ({np.mean(endings == code):.1%})")
        for colour, code in zip(colours, found, strict=True)
    ]
    figure.legend(handles=handles, loc="outside right upper", frameon=False)
    axes.set(xlabel=_name(x), ylabel=_name(y), title="how walks end; +: the gait")
    return figure


def eigenvalue_figure(
    speeds: Vector, names: Sequence[str], eigenvalues: Any, stable: Sequence[float] | None
) -> Figure:
    """A vehicle's eigenvalues (n, k) over its speeds (n,): real parts solid, imaginary parts dashed, the stable speeds shaded."""
    if len(speeds) < 2:
        raise ValueError("a picture needs a range of speeds: low:high:count")
    figure = new_figure(8.0, 5.0)
    axes = figure.subplots()
    if stable is not None:
        axes.axvspan(*np.clip(stable, speeds[0], speeds[-1]), color=_STABLE, linewidth=0)
    for name, values, colour in zip(names, np.transpose(eigenvalues), _COLOURS, strict=False):
        axes.plot(speeds, values.real, color=colour, label=_name(name))
        shown = np.where(values.imag > 0.0, values.imag, np.nan)
        axes.plot(speeds, shown, color=colour, linestyle="--")
    axes.axhline(0.0, color=_FAINT, linewidth=0.8)
    axes.legend(frameon=False)
    axes.set(
        xlabel="speed (m/s)", ylabel="eigenvalue (1/s): real part solid, imaginary part dashed"
    )
    axes.set_title("stable where green" if stable is not None else "stable at no speed")
    return figure
