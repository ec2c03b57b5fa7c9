"""The walker from the side and from behind, on its sloping floor."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from lean_yaw_env.parameters import Vector
from lean_yaw_env.rendering.camera import BodyCamera, Panel, body_camera, upward
from lean_yaw_env.rendering.canvas import Canvas
from lean_yaw_env.rendering.geometry import LegShape, WalkerShape
from lean_yaw_env.rendering.palette import (
    ANKLE_AXIS,
    FAINT_INK,
    FOOT_COLOURS,
    GROUND,
    INK,
    LEFT,
    RIGHT,
    SKY,
    STRONG_GRID,
    Colour,
    mixed,
)
from lean_yaw_env.rendering.scene import Scene

FLOOR_HEIGHT = 46.0
"""Pixels from a panel's lower edge to the floor under the walker."""
HEAD_ROOM = 46.0
"""Pixels from the hips of an upright walker to the panel's upper edge."""
AXIS_ABOVE, AXIS_BELOW = 0.3, 0.12
"""How far a drawn ankle axis goes up and down from the sole, in leg lengths."""
MASS_RADIUS = 0.045
"""Of a drawn mass, in leg lengths; the model's are points."""
_FAR = 0.45  # how much the farther leg fades
_RECENT_PRINTS = 5  # as many as the side view has room for


def draw_side_view(canvas: Canvas, panel: Panel, scene: Scene, shape: WalkerShape) -> None:
    """Draw the walker as seen from its right, walking to the right."""
    _draw_body(canvas, panel, scene, shape, _level(shape.axle), "from the side")


def draw_rear_view(canvas: Canvas, panel: Panel, scene: Scene, shape: WalkerShape) -> None:
    """Draw the walker as seen from behind."""
    x, _, z = _level(shape.axle)
    _draw_body(canvas, panel, scene, shape, np.array([-z, 0.0, x]), "from behind")


def _level(direction: Vector) -> Vector:
    """A direction laid down on the floor; of an upright axle, to the right."""
    flat = direction * np.array([1.0, 0.0, 1.0])
    length = float(np.linalg.norm(flat))
    return flat / length if length > 1e-6 else np.array([0.0, 0.0, 1.0])


def _draw_body(
    canvas: Canvas, panel: Panel, scene: Scene, shape: WalkerShape, toward: Vector, title: str
) -> None:
    scale = min(
        panel.height - FLOOR_HEIGHT - HEAD_ROOM, panel.width / (scene.parameters.hip_width + 1.2)
    )
    below = shape.centre * np.array([1.0, 0.0, 1.0])
    place = np.array([panel.middle[0], panel.bottom - FLOOR_HEIGHT])
    up = upward(scene.parameters, float(scene.pose.state[0]))
    camera = body_camera(panel, toward, up, below, place, scale)
    canvas.clip(panel)
    canvas.rectangle(panel, SKY)
    _draw_floor(canvas, camera, scene)
    near, far = shape.stance_leg, shape.swing_leg
    if camera.nearness(near.ankle + near.hip) < camera.nearness(far.ankle + far.hip):
        near, far = far, near
    _draw_leg(canvas, camera, far, _FAR)
    _draw_axle(canvas, camera, shape)
    _draw_leg(canvas, camera, near, 0.0)
    _draw_masses(canvas, camera, shape)
    canvas.text(title, (panel.left + 14.0, panel.top + 14.0), FAINT_INK)
    _draw_legend(canvas, panel)
    canvas.clip(None)


def _draw_floor(canvas: Canvas, camera: BodyCamera, scene: Scene) -> None:
    """The floor where it passes under the walker, with the last footprints on it."""
    panel, place = camera.panel, camera.place
    steepness = camera.right[1] / camera.up[1]
    edge = np.array([[x, place[1] + steepness * (x - place[0])] for x in (panel.left, panel.right)])
    corners = [[panel.right, panel.bottom], [panel.left, panel.bottom]]
    canvas.polygon(np.vstack([edge, corners]), GROUND)
    canvas.lines(edge, mixed(GROUND, INK, 0.45), 1.5)
    for position, foot in zip(
        scene.footprints[-_RECENT_PRINTS:], scene.feet[-_RECENT_PRINTS:], strict=True
    ):
        mark = camera.pixels(np.array([position[0], 0.0, position[1]]))
        mark[1] = place[1] + steepness * (mark[0] - place[0]) + 5.0
        half = np.array([1.0, steepness]) * 0.05 * camera.scale
        canvas.bar(mark - half, mark + half, mixed(FOOT_COLOURS[foot], GROUND, 0.35), 3.0)


def _draw_legend(canvas: Canvas, panel: Panel) -> None:
    place = panel.left + 14.0
    for words, colour in (("left", LEFT), ("right", RIGHT), ("ankle axes", ANKLE_AXIS)):
        place += 16.0 + canvas.text(words, (place, panel.bottom - 12.0), colour, anchor=(0.0, 1.0))


def _draw_leg(canvas: Canvas, camera: BodyCamera, leg: LegShape, fading: float) -> None:
    colour = mixed(FOOT_COLOURS[leg.foot], SKY, fading)
    _draw_foot(canvas, camera, leg, colour)
    hip, ankle = camera.pixels(np.array([leg.hip, leg.ankle]))
    canvas.bar(hip, ankle, colour, 0.03 * camera.scale)
    below, above = camera.pixels(leg.axis_ends(AXIS_BELOW, AXIS_ABOVE))
    canvas.dashes(below, above, mixed(ANKLE_AXIS, SKY, fading), 1.5)


def _draw_foot(canvas: Canvas, camera: BodyCamera, leg: LegShape, colour: Colour) -> None:
    """The part of the cylinder under the leg, filled up to the chord between heel and toe."""
    corners = camera.pixels(np.vstack([leg.inner_arc, leg.outer_arc]))
    try:
        outline = corners[ConvexHull(np.round(corners, 6)).vertices]
    except QhullError:  # all on a line
        canvas.bar(corners[0], corners[-1], colour, 3.0)
    else:
        canvas.polygon(outline, mixed(colour, SKY, 0.55), colour, 1.5)


def _draw_axle(canvas: Canvas, camera: BodyCamera, shape: WalkerShape) -> None:
    for joint in (shape.stance_leg.hip, shape.swing_leg.hip):
        for mass in shape.masses:
            start, end = camera.pixels(np.array([joint, mass]))
            canvas.bar(start, end, mixed(INK, SKY, 0.3), 3.0)


def _draw_masses(canvas: Canvas, camera: BodyCamera, shape: WalkerShape) -> None:
    radius = MASS_RADIUS * camera.scale
    for mass in sorted(shape.masses, key=camera.nearness):
        canvas.disc(camera.pixels(mass), radius, INK)
        canvas.ring(camera.pixels(mass), radius, STRONG_GRID, 0.5)
    canvas.disc(camera.pixels(shape.centre), 4.0, SKY)
    canvas.ring(camera.pixels(shape.centre), 4.5, INK, 1.5)
    canvas.disc(camera.pixels(shape.centre), 1.5, INK)
