"""The walk from above: footprints, path, where the walker heads and where it should."""

from __future__ import annotations

import math

import numpy as np

from lean_yaw_env.parameters import Vector
from lean_yaw_env.rendering.camera import FloorCamera, Panel, floor_camera
from lean_yaw_env.rendering.canvas import Canvas
from lean_yaw_env.rendering.footprints import CORNERS_PER_KNOT, footprint_length, footprint_outlines
from lean_yaw_env.rendering.geometry import WalkerShape
from lean_yaw_env.rendering.palette import (
    COMMAND,
    FAINT_INK,
    FLOOR,
    FOOT_COLOURS,
    GOAL,
    GRID,
    INK,
    PATH,
    REFERENCE,
    STRONG_GRID,
    mixed,
)
from lean_yaw_env.rendering.scene import Scene

BORDER = 64.0
"""Pixels between what must be seen and the panel's edge; the arrows have their place there."""
GREATEST_SCALE, LEAST_SCALE = 130.0, 22.0
"""Pixels per leg length: a dozen steps in the panel at first, 65 at last.

A longer walk is followed, and seen whole in an inset.
"""
WORDS_WIDTH = 220.0
"""Pixels from the panel's left edge in which a walker makes room for the words."""
_MOST_PATH_POINTS = 1500
_FULL_OUTLINE = 16.0  # a print shorter than this, in pixels, needs fewer corners
_COARSE = 2 * CORNERS_PER_KNOT
_OLD_PRINT = 0.4  # how much prints behind the walker have faded


def draw_top_view(canvas: Canvas, panel: Panel, scene: Scene, shape: WalkerShape) -> None:
    """Draw the walk from above into a panel."""
    walker = shape.centre[[0, 2]]
    camera = _camera(panel, scene, walker)
    canvas.clip(panel)
    canvas.rectangle(panel, FLOOR)
    _draw_grid(canvas, camera)
    _draw_tasks(canvas, camera, scene)
    _draw_footprints(canvas, camera, scene)
    _draw_path(canvas, camera, np.vstack([scene.path, walker]))
    _draw_walker(canvas, camera, scene, shape)
    _draw_arrows(canvas, camera, scene, walker)
    _draw_scale(canvas, camera)
    _draw_downhill(canvas, camera, scene)
    _draw_words(canvas, camera, scene, walker)
    if not camera.sees(scene.path).all():
        _draw_inset(canvas, camera, scene, walker)
    canvas.clip(None)


def _camera(panel: Panel, scene: Scene, walker: Vector) -> FloorCamera:
    goals = np.array([[goal.downhill, goal.right] for goal in scene.goals]).reshape(-1, 2)
    scales = {"least_scale": LEAST_SCALE, "greatest_scale": GREATEST_SCALE}
    return floor_camera(panel, np.vstack([scene.path, goals]), walker, border=BORDER, **scales)


def _draw_grid(canvas: Canvas, camera: FloorCamera) -> None:
    """Draw a line every leg length, every fifth one stronger and over the others."""
    low, high = camera.centre - camera.reach, camera.centre + camera.reach
    for weak in (True, False):
        for axis in (0, 1):
            for line in range(math.ceil(low[axis]), math.floor(high[axis]) + 1):
                if (line % 5 != 0) == weak:
                    ends = np.array([low, high])
                    ends[:, axis] = line
                    canvas.lines(camera.pixels(ends), GRID if weak else STRONG_GRID, 1.0)


def _draw_tasks(canvas: Canvas, camera: FloorCamera, scene: Scene) -> None:
    if scene.reference_path is not None:
        canvas.lines(camera.pixels(scene.reference_path), REFERENCE, 2.0)
    for goal in scene.goals:
        place = camera.pixels(np.array([goal.downhill, goal.right]))
        radius = max(camera.scale * goal.radius, 4.0)
        canvas.disc(place, radius, mixed(GOAL, FLOOR, 0.85 if goal.reached else 0.55))
        canvas.ring(place, radius, mixed(GOAL, FLOOR, 0.5 if goal.reached else 0.0), 1.5)


def _draw_footprints(canvas: Canvas, camera: FloorCamera, scene: Scene) -> None:
    length = footprint_length(scene.parameters.foot_radius)
    seen = np.flatnonzero(camera.sees(scene.footprints, length)).tolist()
    feet = [scene.feet[i] for i in seen]
    outlines = camera.pixels(
        footprint_outlines(scene.footprints[seen], scene.headings[seen], feet, length)
    )
    if camera.scale * length < _FULL_OUTLINE:
        outlines = outlines[:, ::_COARSE]
    old = {foot: mixed(colour, FLOOR, _OLD_PRINT) for foot, colour in FOOT_COLOURS.items()}
    newest = len(scene.footprints) - 1
    for i, foot, outline in zip(seen, feet, outlines, strict=True):
        canvas.polygon(outline, FOOT_COLOURS[foot] if i == newest else old[foot])


def _draw_path(canvas: Canvas, camera: FloorCamera, path: Vector) -> None:
    """Draw the pieces of a path that the camera sees."""
    points = _thinned(path)
    seen = camera.sees(points, margin=0.1 * float(camera.reach.max()))
    changes = np.flatnonzero(np.diff(seen)) + 1
    for piece, is_seen in zip(np.split(points, changes), seen[np.append(0, changes)], strict=True):
        if is_seen:
            canvas.lines(camera.pixels(piece), PATH, 1.25)


def _draw_walker(canvas: Canvas, camera: FloorCamera, scene: Scene, shape: WalkerShape) -> None:
    """The swing foot's outline above the floor, the axle and the two masses."""
    leg = shape.swing_leg
    length = footprint_length(scene.parameters.foot_radius)
    # the print it would leave were it set down as it is: around where its sole is at zero pitch
    ahead = scene.parameters.foot_radius * leg.pitch
    forward = np.array([math.cos(leg.heading), -math.sin(leg.heading)])
    reference = leg.centre[[0, 2]] + ahead * forward
    outline = footprint_outlines(reference[None], np.array([leg.heading]), [leg.foot], length)[0]
    canvas.polygon(camera.pixels(outline), None, FOOT_COLOURS[leg.foot], 1.0)
    hips = camera.pixels(np.array([shape.stance_leg.hip, leg.hip, *shape.masses])[:, [0, 2]])
    canvas.bar(hips[0], hips[1], INK, 2.5)
    radius = min(max(0.04 * camera.scale, 2.0), 5.0)
    for place in hips[2:]:
        canvas.disc(place, radius, INK)


def _draw_arrows(canvas: Canvas, camera: FloorCamera, scene: Scene, walker: Vector) -> None:
    """Where the walker heads (short, dark) and where it should (long, coloured)."""
    start = camera.pixels(walker)
    if scene.commanded_heading is not None:
        canvas.arrow(start, start + 58.0 * _on_picture(scene.commanded_heading), COMMAND, 3.0)
    canvas.arrow(start, start + 40.0 * _on_picture(scene.heading), INK, 2.0)


def _on_picture(heading: float) -> Vector:
    """Unit vector of a heading on the picture: zero is up, positive turns left."""
    return np.array([-math.sin(heading), -math.cos(heading)])


def _draw_scale(canvas: Canvas, camera: FloorCamera) -> None:
    panel = camera.panel
    end = np.array([panel.right - 16.0, panel.bottom - 16.0])
    start = end - np.array([camera.scale, 0.0])
    canvas.bar(start, end, INK, 1.5)
    for tick in (start, end):
        canvas.bar(tick - np.array([0.0, 4.0]), tick + np.array([0.0, 4.0]), INK, 1.5)
    place = (end[0], end[1] - 8.0)
    canvas.text("1 leg length", place, INK, anchor=(1.0, 1.0), ground=FLOOR)


def _draw_downhill(canvas: Canvas, camera: FloorCamera, scene: Scene) -> None:
    """Which way the slope falls, in the lower left corner."""
    slope = scene.parameters.slope
    panel = camera.panel
    tail = np.array([panel.left + 22.0, panel.bottom - 16.0])
    words = f"downhill, slope {abs(slope):.3g} rad"
    if scene.parameters.slope_turns:
        words = f"slope {slope:.3g} rad, turns with the walker"
    elif slope == 0.0:
        words = "level floor"
    else:
        length = np.array([0.0, -26.0])
        ends = (tail, tail + length) if slope > 0.0 else (tail + length, tail)
        canvas.arrow(*ends, FAINT_INK, 2.0)
    place = (panel.left + 34.0, panel.bottom - 16.0)
    canvas.text(words, place, FAINT_INK, anchor=(0.0, 1.0), ground=FLOOR)


def _draw_words(canvas: Canvas, camera: FloorCamera, scene: Scene, walker: Vector) -> None:
    """The scene's lines in the upper left corner, or in the upper right one if the walker is up there."""
    panel = camera.panel
    right, down = camera.pixels(walker) - (panel.left, panel.top)
    is_hidden = right < WORDS_WIDTH and down < 19.0 * len(scene.lines) + 32.0
    side, left = (1.0, panel.right - 16.0) if is_hidden else (0.0, panel.left + 16.0)
    for i, line in enumerate(scene.lines):
        place = (left, panel.top + 16.0 + 19.0 * i)
        canvas.text(line, place, INK, 13.0, anchor=(side, 0.0), ground=FLOOR)


def _draw_inset(canvas: Canvas, camera: FloorCamera, scene: Scene, walker: Vector) -> None:
    """The whole path, small, in the lower right corner, or in the upper one if the walker is down there."""
    size = 110.0
    place = camera.pixels(walker) - camera.panel.middle
    top = camera.panel.top + 14.0 if (place > 0.0).all() else camera.panel.bottom - size - 48.0
    panel = Panel(camera.panel.right - size - 14.0, top, size, size)
    whole = floor_camera(
        panel, scene.path, walker, border=10.0, least_scale=0.0, greatest_scale=LEAST_SCALE
    )
    canvas.rectangle(panel, STRONG_GRID, 5.0)
    canvas.rectangle(Panel(panel.left + 1.0, panel.top + 1.0, size - 2.0, size - 2.0), FLOOR, 4.0)
    _draw_path(canvas, whole, np.vstack([scene.path, walker]))
    canvas.disc(whole.pixels(walker), 3.5, INK)


def _thinned(points: Vector) -> Vector:
    """About so many of the points, the last among them. The stride is a power of two, so that the points chosen stay chosen as a path grows."""
    stride = 1
    while len(points) > stride * _MOST_PATH_POINTS:
        stride *= 2
    return np.vstack([points[:-1:stride], points[-1:]])
