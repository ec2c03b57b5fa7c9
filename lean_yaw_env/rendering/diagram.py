"""A labelled drawing of the walker with its parameters, after the paper's Figure 5."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from lean_yaw_env.files import require_ending
from lean_yaw_env.parameters import Foot, Vector, WalkerParameters
from lean_yaw_env.rendering.camera import upward
from lean_yaw_env.rendering.figures import ENDINGS, new_figure, save_figure
from lean_yaw_env.rendering.footprints import footprint_length, footprint_outlines
from lean_yaw_env.rendering.geometry import LegShape, Pose, walker_shape
from lean_yaw_env.rendering.palette import (
    ANKLE_AXIS,
    COMMAND,
    FAINT_INK,
    FOOT_COLOURS,
    GROUND,
    INK,
    WHITE,
    Colour,
    mixed,
    unit_colour,
)
from lean_yaw_env.validation import require_instance

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# A pose in which everything can be seen; no gait leans or turns so far.
_HEADING, _STANCE_PITCH, _INTER_LEG_ANGLE, _LEAN, _MASS_OFFSET = 0.35, 0.2, 0.5, 0.25, 0.1
_LEAST_SLOPE = 0.09  # a gait's own slope would look level
_INCHES = 2.9  # per leg length
_HEIGHT = 1.45  # of each drawing, in leg lengths
_AXIS_ABOVE, _AXIS_BELOW = 0.42, 0.14
_AXLE = mixed(INK, WHITE, 0.3)
_RIGHT, _UP = np.array([1.0, 0.0]), np.array([0.0, 1.0])


def draw_walker(parameters: WalkerParameters, path: str | os.PathLike[str]) -> None:
    """Draw the walker from the side, from behind and from above, with its parameters' names, to a .png, .svg or .pdf.

    The proportions are the parameters'; the pose, and a slope too slight to be seen, are exaggerated, and the picture says so.

    Raises
    ------
    ValueError
        If the path has another ending.
    gymnasium.error.DependencyNotInstalled
        If matplotlib is not installed.
    """
    require_ending(path, ENDINGS)
    require_instance("parameters", parameters, WalkerParameters)
    widths = (1.7, 0.9 + parameters.hip_width, 1.0 + parameters.hip_width)
    figure = new_figure(_INCHES * sum(widths), _INCHES * _HEIGHT + 1.0)
    side, rear, top = figure.subplots(1, 3, width_ratios=widths)
    _draw_side(side, parameters)
    _draw_rear(rear, parameters)
    _draw_top(top, parameters)
    for axes, title in ((side, "from the side"), (rear, "from behind"), (top, "from above")):
        axes.set_title(title, color=unit_colour(FAINT_INK), fontsize=11)
        axes.set_aspect("equal")
        axes.set_axis_off()
    figure.supxlabel(_caption(parameters), fontsize=10, color=unit_colour(INK))
    save_figure(figure, path)


def _caption(parameters: WalkerParameters) -> str:
    values = (
        f"hip width $d$ = {parameters.hip_width:g}",
        f"foot radius $r$ = {parameters.foot_radius:g}",
        rf"ankle tilt $\alpha$ = {parameters.ankle_tilt:g} rad",
        rf"slope $\gamma$ = {parameters.slope:g} rad",
    )
    coordinates = (
        r"stance pitch $\theta$, ankle angle $u$, heading $\varphi$, inter-leg angle $\Delta$ "
        r"and mass offset $\mu$, like the slope, drawn large to be seen; leg length 1"
    )
    return (5 * " ").join(values) + "\n" + coordinates


def _draw_side(axes: Axes, parameters: WalkerParameters) -> None:
    slope = parameters.slope
    if slope != 0.0:
        slope = math.copysign(max(abs(slope), _LEAST_SLOPE), slope)
    pose = Pose(np.array([0.0, _STANCE_PITCH, 0.0, 0.0, 0.0]), "right", _INTER_LEG_ANGLE)
    shape = walker_shape(parameters, pose)
    up = upward(replace(parameters, slope=slope, slope_turns=False), 0.0)
    view = np.column_stack([np.cross(up, np.array([0.0, 0.0, 1.0])), up])  # to the page's axes
    downhill, normal, _ = view
    contact = shape.contact @ view
    _draw_floor(axes, contact, downhill, 0.6, 0.85)
    _draw_leg(axes, view, shape.swing_leg, 0.5)
    _draw_leg(axes, view, shape.stance_leg, 0.0)
    hip, ankle, axis = (
        part @ view
        for part in (shape.stance_leg.hip, shape.stance_leg.ankle, shape.stance_leg.ankle_axis)
    )
    _draw_masses(axes, hip)
    if slope != 0.0:
        start = contact - 0.57 * downhill if slope > 0.0 else contact + 0.82 * downhill
        ahead = _RIGHT if slope > 0.0 else -_RIGHT
        along = downhill if slope > 0.0 else -downhill
        _line(axes, start, start + 0.4 * ahead, FAINT_INK, 0.8, "--")
        _draw_angle(axes, start, ahead, along, 0.3, r"$\gamma$")
    _line(axes, ankle, ankle + 0.75 * normal, FAINT_INK, 0.8, "--")
    _draw_angle(axes, ankle, normal, hip - ankle, 0.66, r"$\theta$")
    _draw_angle(axes, ankle, hip - ankle, -axis, 0.38, r"$\alpha$", ANKLE_AXIS)
    _draw_angle(axes, hip, ankle - hip, shape.swing_leg.ankle @ view - hip, 0.5, r"$\Delta$")
    if parameters.foot_radius > 0.0:
        leg = shape.swing_leg
        centre, toe = leg.centre @ view, 0.5 * (leg.inner_arc + leg.outer_arc)[-1] @ view
        _line(axes, centre, toe, INK, 0.9)
        axes.plot(*centre, marker="+", color=unit_colour(INK), markersize=6)
        _label(axes, 0.5 * (centre + toe), "$r$", (8, 2))
    aside = np.array([hip[0] + 0.62, hip[1]])
    _draw_arrow(axes, aside, -0.22 * _UP, COMMAND)
    _label(axes, aside - 0.11 * _UP, "$g$", (9, 0), COMMAND)
    _label(axes, hip + 0.4 * (ankle - hip), "1", (-10, 0))
    _set_window(axes, contact - np.array([0.75, 0.25]), 1.7)


def _draw_rear(axes: Axes, parameters: WalkerParameters) -> None:
    pose = Pose(np.array([0.0, 0.0, -_LEAN, 0.0, 0.0]), "right", 0.45, mass_offset=_MASS_OFFSET)
    shape = walker_shape(parameters, pose)
    view = np.eye(3)[:, [2, 1]]
    contact = shape.contact @ view
    _draw_floor(axes, contact, _RIGHT, 0.35 + parameters.hip_width, 0.35)
    _draw_leg(axes, view, shape.swing_leg, 0.5)
    _draw_leg(axes, view, shape.stance_leg, 0.0)
    hips = np.array([shape.swing_leg.hip, shape.stance_leg.hip]) @ view
    masses = shape.masses @ view
    along = shape.axle @ view
    _line(axes, hips[0], masses[1], _AXLE, 2.5)
    _draw_masses(axes, *masses)
    across = np.array([-along[1], along[0]])
    if parameters.hip_width > 0.0:
        _draw_span(axes, hips[0] + 0.2 * across, hips[1] + 0.2 * across, "$d$")
    _draw_span(axes, hips[1] + 0.09 * across, masses[1] + 0.09 * across, r"$\mu$")
    ankle, above = shape.stance_leg.ankle @ view, shape.stance_leg.axis_ends(0.0, _AXIS_ABOVE)[1]
    _line(axes, ankle, ankle + 0.8 * _UP, FAINT_INK, 0.8, "--")
    _draw_angle(axes, ankle, _UP, hips[1] - ankle, 0.7, "")
    _label(axes, ankle + 0.7 * _UP, "lean", (18, 0))
    _draw_turn(axes, above @ view, ankle - above @ view)
    width = 0.9 + parameters.hip_width
    _set_window(axes, contact - np.array([width - 0.4, 0.2]), width)


def _draw_top(axes: Axes, parameters: WalkerParameters) -> None:
    stance: Foot = "right"
    pose = Pose(np.array([_HEADING, -0.05, 0.0, 0.0, 0.0]), stance, 0.4)
    shape = walker_shape(parameters, pose)
    length = footprint_length(parameters.foot_radius)
    foot = np.zeros(2)
    places = np.array([foot, shape.swing_leg.ankle[[0, 2]]])
    feet: list[Foot] = [shape.stance_leg.foot, shape.swing_leg.foot]
    outlines = footprint_outlines(places, np.full(2, _HEADING), feet, length)
    for name, outline, alpha in zip(feet, outlines, (1.0, 0.4), strict=True):
        axes.fill(*outline.T[::-1], color=unit_colour(FOOT_COLOURS[name]), alpha=alpha, lw=0)
    hips = np.array([shape.stance_leg.hip, shape.swing_leg.hip])[:, [2, 0]]
    _line(axes, hips[0], hips[1], _AXLE, 2.5)
    _draw_masses(axes, *hips)
    heading = np.array([-math.sin(_HEADING), math.cos(_HEADING)])
    _draw_arrow(axes, foot, 0.75 * heading, FOOT_COLOURS[stance])
    _draw_arrow(axes, foot, 0.75 * _UP, FAINT_INK)
    _label(axes, 0.75 * _UP, "downhill", (0, 8), FAINT_INK)
    _label(axes, 0.75 * heading, "heading", (0, 8), FOOT_COLOURS[stance])
    _draw_angle(axes, foot, _UP, heading, 0.6, r"$\varphi$")
    width = 1.0 + parameters.hip_width
    _set_window(axes, np.array([0.4 - width, -0.5]), width)


def _set_window(axes: Axes, corner: Vector, width: float) -> None:
    axes.set_xlim(corner[0], corner[0] + width)
    axes.set_ylim(corner[1], corner[1] + _HEIGHT)


def _draw_floor(axes: Axes, contact: Vector, along: Vector, back: float, front: float) -> None:
    edge = np.array([contact - back * along, contact + front * along])
    deep = edge - 0.09 * np.array([-along[1], along[0]])
    axes.fill(*np.vstack([edge, deep[::-1]]).T, color=unit_colour(GROUND), lw=0)
    _line(axes, edge[0], edge[1], INK, 1.0)


def _draw_leg(axes: Axes, view: Vector, leg: LegShape, fading: float) -> None:
    colour = mixed(FOOT_COLOURS[leg.foot], WHITE, fading)
    pale = unit_colour(mixed(colour, WHITE, 0.6))
    for arc in (leg.inner_arc, leg.outer_arc):
        axes.fill(*(arc @ view).T, color=pale, lw=0)
    sole = np.vstack([leg.inner_arc, leg.outer_arc[::-1]]) @ view
    axes.fill(*sole.T, facecolor=pale, edgecolor=unit_colour(colour))
    _line(axes, leg.ankle @ view, leg.hip @ view, colour, 4.5)
    below, above = leg.axis_ends(_AXIS_BELOW, _AXIS_ABOVE) @ view
    _line(axes, above, below, mixed(ANKLE_AXIS, WHITE, fading), 1.3, (0, (5, 2, 1, 2)))


def _line(
    axes: Axes, start: Vector, end: Vector, colour: Colour, width: float, style: object = "-"
) -> None:
    line: Any = {"linestyle": style, "linewidth": width, "solid_capstyle": "round"}
    axes.plot(*np.array([start, end]).T, color=unit_colour(colour), **line)


def _draw_masses(axes: Axes, *places: Vector) -> None:
    for place in places:
        axes.plot(*place, marker="o", markersize=13, color=unit_colour(INK))


def _label(
    axes: Axes, place: Vector, words: str, shift: tuple[float, float], colour: Colour = INK
) -> None:
    axes.annotate(
        words, tuple(place), xytext=shift, textcoords="offset points", annotation_clip=False,
        ha="center", va="center", color=unit_colour(colour), fontsize=13 if words.startswith("$") else 10,
    )  # fmt: skip


def _draw_angle(
    axes: Axes, corner: Vector, first: Vector, second: Vector, radius: float, words: str, colour: Colour = INK,
) -> None:  # fmt: skip
    """An arc from one direction to another, the short way, with its name outside."""
    start = math.atan2(first[1], first[0])
    turn = math.remainder(math.atan2(second[1], second[0]) - start, 2.0 * math.pi)
    angles = start + turn * np.linspace(0.0, 1.0, 30)
    arc = corner + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    axes.plot(*arc.T, color=unit_colour(colour), linewidth=0.9)
    middle = start + 0.5 * turn
    outward = np.array([math.cos(middle), math.sin(middle)])
    shift = 9.0 if words.startswith("$") else 12.0
    _label(axes, corner + radius * outward, words, (shift * outward[0], shift * outward[1]), colour)


def _draw_span(axes: Axes, start: Vector, end: Vector, words: str) -> None:
    """A dimension line between two points, its name above."""
    _draw_patch(axes, np.array([start, end]), "<->", INK, 0.9)
    _label(axes, 0.5 * (start + end), words, (0, 9))


def _draw_arrow(axes: Axes, start: Vector, along: Vector, colour: Colour) -> None:
    _draw_patch(axes, np.array([start, start + along]), "-|>", colour, 1.4)


def _draw_patch(axes: Axes, points: Vector, style: str, colour: Colour, width: float) -> None:
    """An arrow along points."""
    from matplotlib.patches import FancyArrowPatch
    from matplotlib.path import Path

    patch = FancyArrowPatch(
        path=Path(points), arrowstyle=style, color=unit_colour(colour), fill=style == "-|>",
        linewidth=width, mutation_scale=11.0, clip_on=False,
    )  # fmt: skip
    axes.add_patch(patch)


def _draw_turn(axes: Axes, place: Vector, along: Vector) -> None:
    """A curved arrow about the ankle axis, named u."""
    angle = math.atan2(along[1], along[0])
    s = np.linspace(-0.8 * math.pi, 0.8 * math.pi, 40)
    local = np.column_stack([0.02 * np.cos(s), 0.06 * np.sin(s)])
    cosine, sine = math.cos(angle), math.sin(angle)
    ring = place + local @ np.array([[cosine, sine], [-sine, cosine]])
    _draw_patch(axes, ring, "->", ANKLE_AXIS, 1.2)
    _label(axes, place, "$u$", (20, 6), ANKLE_AXIS)
