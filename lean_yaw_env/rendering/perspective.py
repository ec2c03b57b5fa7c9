"""The walker in perspective, as somebody sees it who follows it: the floor with its footprints, shadows, legs and feet, nearer parts over farther ones."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import chain, pairwise
from typing import Any

import numpy as np

from lean_yaw_env.parameters import Vector
from lean_yaw_env.rendering.camera import Panel, PerspectiveCamera, perspective_camera, upward
from lean_yaw_env.rendering.canvas import Canvas
from lean_yaw_env.rendering.footprints import footprint_length, footprint_outlines
from lean_yaw_env.rendering.geometry import LegShape, WalkerShape
from lean_yaw_env.rendering.palette import (
    ANKLE_AXIS,
    COMMAND,
    FLOOR,
    FOOT_COLOURS,
    GOAL,
    GRID,
    HORIZON,
    INK,
    LEFT,
    PATH,
    REFERENCE,
    RIGHT,
    STEEL,
    STRONG_GRID,
    WHITE,
    ZENITH,
    Colour,
    mixed,
)
from lean_yaw_env.rendering.scene import Scene

EYE = np.array([-2.3, 0.95, 1.75])
"""Of the camera from what it looks at: ahead, up and to the right of the walker, leg lengths."""
MIDDLE = 0.5
"""Height of what the camera looks at, leg lengths."""
VIEW_ANGLE = 0.6
"""Of the picture's lesser side, rad."""
LIGHT = np.array([-0.35, 0.8, 0.49])
"""To the sun: downhill, up, right."""
LEG_RADII = (0.028, 0.017)
"""Of a drawn leg at the hip and at the ankle, leg lengths."""
AXIS_RADII, AXLE_RADII = (0.007, 0.007), (0.012, 0.012)
MASS_RADIUS = 0.05
"""Of a drawn mass, leg lengths; the model's are points."""
AXIS_ABOVE, AXIS_BELOW = 0.3, 0.12
"""How far a drawn ankle axis goes up and down from the sole, in leg lengths."""
_REACH = 8  # leg lengths of floor around the walker that have lines and prints
_WAY_BEHIND = 1.5  # leg lengths of the walker's way that the camera turns with: some five steps
_BANDS = 24  # of sky and haze
_SHADOW = mixed(FLOOR, INK, 0.13)
_OLD_PRINT = 0.55  # how much prints have faded

_Part = tuple[float, Callable[..., None], tuple[Any, ...]]
"""Something to be drawn: its distance, what draws it on a canvas by a camera, and from what."""


def draw_perspective_view(canvas: Canvas, panel: Panel, scene: Scene, shape: WalkerShape) -> None:
    """Draw the walker from behind, above and the right, as the camera on the web page follows it."""
    canvas.clip(panel)
    camera = following_camera(panel, scene, shape)
    _draw_sky_and_floor(canvas, camera)
    _draw_floor_marks(canvas, camera, scene, shape)
    _draw_shadows(canvas, camera, shape)
    legs = (_leg_parts(camera, leg) for leg in (shape.stance_leg, shape.swing_leg))
    parts = [*chain(*legs), *_hip_parts(camera, shape)]
    for _, draw, what in sorted(parts, key=lambda part: -part[0]):
        draw(canvas, camera, *what)
    _draw_legend(canvas, panel)
    canvas.clip(None)


def following_camera(panel: Panel, scene: Scene, shape: WalkerShape) -> PerspectiveCamera:
    """A camera that goes along with the walker, and turns with the way behind it: continuously, where headings jump at heel strike."""
    up = upward(scene.parameters, float(scene.pose.state[0]))
    middle = shape.centre[[0, 2]]
    along = middle - _behind(scene, middle)
    angle = math.atan2(along[1], along[0])
    cosine, sine = math.cos(angle), math.sin(angle)
    size = 1.0 + 0.4 * max(scene.parameters.hip_width - 0.5, 0.0)
    axes = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    target = np.array([middle[0], MIDDLE, middle[1]])
    return perspective_camera(panel, target + size * EYE @ axes, target, up, VIEW_ANGLE)


def _behind(scene: Scene, middle: Vector) -> Vector:
    """A place on the walker's way that is ``_WAY_BEHIND`` behind it; the way begins with a straight piece."""
    heading = float(scene.headings[0]) if len(scene.headings) else float(scene.pose.state[0])
    way = np.vstack([middle, scene.path[::-1]])
    start = way[-1] - _WAY_BEHIND * np.array([math.cos(heading), -math.sin(heading)])
    way = np.vstack([way, start])
    lengths = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1)))
    return np.array([np.interp(_WAY_BEHIND, lengths, column) for column in way.T])


def _draw_sky_and_floor(canvas: Canvas, camera: PerspectiveCamera) -> None:
    """The sky darkens upward from the horizon; haze lies over the far floor."""
    panel, horizon = camera.panel, camera.horizon()
    canvas.rectangle(panel, FLOOR)
    edge = np.column_stack([[panel.left, panel.right], horizon])
    sky, haze = panel.top - horizon.max(), 0.2 * panel.height
    for low, high in pairwise(np.linspace(0.0, 1.0, _BANDS + 1).tolist()):
        tone = mixed(HORIZON, ZENITH, 0.55 * low**1.5), mixed(HORIZON, FLOOR, low)
        for height, colour, seam in ((sky, tone[0], -1.0), (haze, tone[1], 1.0)):
            far_edge = np.add(edge, [0.0, height * high + seam])[::-1]
            canvas.polygon(np.vstack([np.add(edge, [0.0, height * low]), far_edge]), colour)


def _draw_floor_marks(
    canvas: Canvas, camera: PerspectiveCamera, scene: Scene, shape: WalkerShape
) -> None:
    """What lies on the floor: lines every leg length, the path to be followed, goals, footprints, the centre's path, the command."""
    middle = shape.centre[[0, 2]]
    first = np.ceil(middle - _REACH).astype(int)
    for axis in (0, 1):
        for line in range(first[axis], first[axis] + 2 * _REACH):
            ends = np.array([middle - _REACH, middle + _REACH])
            ends[:, axis] = line
            colour = GRID if line % 5 else STRONG_GRID
            _draw_faded(canvas, camera, np.linspace(ends[0], ends[1], _REACH + 1), colour, 1.0)
    if scene.reference_path is not None:
        near = np.abs(scene.reference_path - middle).max(axis=1) < 2 * _REACH
        _draw_faded(canvas, camera, scene.reference_path[near], REFERENCE, 2.0)
    turns = np.linspace(0.0, 2.0 * np.pi, 40)
    circle = np.column_stack([np.cos(turns), np.sin(turns)])
    for goal in scene.goals:
        outline = camera.on_floor(np.array([goal.downhill, goal.right]) + goal.radius * circle)
        if len(outline) == len(circle):
            pale = mixed(GOAL, FLOOR, 0.85 if goal.reached else 0.5)
            canvas.polygon(outline, pale, mixed(GOAL, FLOOR, 0.5 if goal.reached else 0.0), 1.5)
    _draw_footprints(canvas, camera, scene, middle)
    path = np.vstack([scene.path, middle])
    _draw_faded(canvas, camera, path[np.abs(path - middle).max(axis=1) < _REACH], PATH, 1.25)
    if scene.commanded_heading is not None:
        _draw_command(canvas, camera, middle, scene.commanded_heading)


def _draw_faded(
    canvas: Canvas, camera: PerspectiveCamera, points: Vector, colour: Colour, width: float
) -> None:
    """A line on the floor that fades into the distance."""
    places, distances = camera.seen(np.insert(points, 1, 0.0, axis=1))
    for k in range(len(places) - 1):
        if np.isfinite(places[k : k + 2]).all():
            haze = min(distances[k] / (1.6 * _REACH), 1.0)
            canvas.lines(places[k : k + 2], mixed(colour, FLOOR, haze), width)


def _draw_footprints(
    canvas: Canvas, camera: PerspectiveCamera, scene: Scene, middle: Vector
) -> None:
    near = np.flatnonzero(np.abs(scene.footprints - middle).max(axis=-1, initial=0.0) < _REACH)
    feet = [scene.feet[i] for i in near.tolist()]
    length = footprint_length(scene.parameters.foot_radius)
    outlines = footprint_outlines(scene.footprints[near], scene.headings[near], feet, length)
    for foot, outline in zip(feet, outlines, strict=True):
        corners = camera.on_floor(outline)
        if len(corners) == len(outline):
            canvas.polygon(corners, mixed(FOOT_COLOURS[foot], FLOOR, _OLD_PRINT))


def _draw_command(
    canvas: Canvas, camera: PerspectiveCamera, middle: Vector, heading: float
) -> None:
    """An arrow on the floor before the walker, to where it should go."""
    ahead = np.array([math.cos(heading), -math.sin(heading)])
    right = np.array([math.sin(heading), math.cos(heading)])
    corners = [(0.35, 0.025), (0.8, 0.025), (0.8, 0.07), (1.0, 0.0)]
    outline = np.array([*corners, *((a, -b) for a, b in corners[::-1])])
    arrow = camera.on_floor(middle + outline @ np.array([ahead, right]))
    if len(arrow) == len(outline):
        canvas.polygon(arrow, COMMAND)


def _draw_shadows(canvas: Canvas, camera: PerspectiveCamera, shape: WalkerShape) -> None:
    def shadow(points: Vector) -> Vector:
        return points - points[..., 1:2] / LIGHT[1] * LIGHT

    for leg in (shape.stance_leg, shape.swing_leg):
        ends = shadow(np.array([leg.ankle, leg.hip]))
        _draw_limb(canvas, camera, ends, (LEG_RADII[1], LEG_RADII[0]), _SHADOW)
        sole = np.vstack([leg.inner_arc, leg.outer_arc[::-1]])
        _fill(canvas, camera, shadow(sole), _SHADOW)
    for mass in shadow(shape.masses):
        place, scale = camera.place(mass)
        canvas.disc(place, 0.8 * MASS_RADIUS * scale, _SHADOW)


def _fill(canvas: Canvas, camera: PerspectiveCamera, corners: Vector, colour: Colour) -> None:
    places, _ = camera.seen(corners)
    if np.isfinite(places).all():
        canvas.polygon(places, colour)


def _draw_limb(
    canvas: Canvas,
    camera: PerspectiveCamera,
    ends: Vector,
    radii: tuple[float, float],
    colour: Colour,
) -> None:
    """A round bar that tapers, lit from the right."""
    (start, start_scale), (end, end_scale) = camera.place(ends[0]), camera.place(ends[1])
    along = end - start
    aside = np.array([-along[1], along[0]]) / max(float(np.linalg.norm(along)), 1e-9)
    aside *= -1.0 if aside[0] < 0.0 else 1.0  # to the right
    widths = np.array([radii[0] * start_scale, radii[1] * end_scale])
    light = colour if colour == _SHADOW else mixed(colour, WHITE, 0.22)
    for low, high, tone in ((-1.0, 1.0, colour), (0.05, 0.6, light)):
        sides = [
            start + low * widths[0] * aside,
            start + high * widths[0] * aside,
            end + high * widths[1] * aside,
            end + low * widths[1] * aside,
        ]
        canvas.polygon(np.array(sides), tone)
    if colour != _SHADOW:
        canvas.disc(end, widths[1], colour)


def _leg_parts(camera: PerspectiveCamera, leg: LegShape) -> Iterator[_Part]:
    colour = FOOT_COLOURS[leg.foot]
    limb, axis = np.array([leg.hip, leg.ankle]), leg.axis_ends(AXIS_BELOW, AXIS_ABOVE)
    yield camera.distance(limb.mean(axis=0)), _draw_limb, (limb, LEG_RADII, colour)
    yield camera.distance(leg.ankle) - 0.03, _draw_limb, (axis, AXIS_RADII, ANKLE_AXIS)
    # The foot: two flat sides, from arc to chord, the plate on top, and the band of the sole
    for arc in (leg.inner_arc, leg.outer_arc):
        yield camera.distance(arc.mean(axis=0)), _fill, (arc, mixed(colour, INK, 0.12))
    plate = np.array([leg.inner_arc[0], leg.outer_arc[0], leg.outer_arc[-1], leg.inner_arc[-1]])
    yield camera.distance(leg.ankle) + 0.02, _fill, (plate, mixed(colour, WHITE, 0.3))
    for inner, outer in zip(pairwise(leg.inner_arc), pairwise(leg.outer_arc), strict=True):
        band = np.array([*inner, *outer[::-1]])
        yield camera.distance(band.mean(axis=0)) + 0.01, _fill, (band, mixed(colour, INK, 0.35))


def _hip_parts(camera: PerspectiveCamera, shape: WalkerShape) -> Iterator[_Part]:
    joints = np.vstack([shape.stance_leg.hip, shape.swing_leg.hip, shape.masses])
    along = joints @ shape.axle
    axle = np.array([joints[np.argmin(along)], joints[np.argmax(along)]])
    yield camera.distance(axle.mean(axis=0)), _draw_limb, (axle, AXLE_RADII, STEEL)
    for mass in shape.masses:
        yield camera.distance(mass) - 0.06, _draw_mass, (mass,)


def _draw_mass(canvas: Canvas, camera: PerspectiveCamera, mass: Vector) -> None:
    place, scale = camera.place(mass)
    radius = MASS_RADIUS * scale
    canvas.disc(place, radius, INK)
    canvas.disc(place + radius * np.array([0.25, -0.28]), 0.3 * radius, mixed(INK, ZENITH, 0.45))


def _draw_legend(canvas: Canvas, panel: Panel) -> None:
    place = panel.left + 14.0
    for words, colour in (("left", LEFT), ("right", RIGHT), ("ankle axes", ANKLE_AXIS)):
        place += 16.0 + canvas.text(words, (place, panel.bottom - 12.0), colour, anchor=(0.0, 1.0))
