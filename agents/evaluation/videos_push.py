"""Pushes on a film's frames: an arrow in a small dial, forward up and the ankle's turn to the side."""

from __future__ import annotations

import math

import numpy as np

from lean_yaw_env.rendering.filming import Frame
from lean_yaw_env.rendering.palette import ANKLE_AXIS, FAINT_INK, FLOOR, INK

RADIUS = 22.0
"""Of the dial, pixels: a push of ``REACH`` standard deviations."""
REACH = 2.0
_PLACE = (0.5, 28.0)  # share of the width, pixels from the top


def draw_push(frame: Frame, push: tuple[float, float] | None) -> Frame:
    """A frame with the push (pitch rate, ankle rate), in standard deviations, as an arrow.

    A negative pitch rate is forward and up on the dial; a positive ankle rate is to the right.
    """
    if push is None:
        return frame
    from PIL import Image, ImageDraw

    picture = Image.fromarray(frame)
    draw = ImageDraw.Draw(picture)
    x, y = _PLACE[0] * frame.shape[1], _PLACE[1]
    draw.ellipse((x - RADIUS, y - RADIUS, x + RADIUS, y + RADIUS), fill=FLOOR, outline=FAINT_INK)
    draw.text((x, y + RADIUS + 2.0), "push", fill=INK, anchor="mt")
    pitch, ankle = push
    size = min(math.hypot(pitch, ankle) / REACH, 1.0) * RADIUS
    angle = math.atan2(-pitch, ankle)  # from the right, upward
    tip = (x + size * math.cos(angle), y - size * math.sin(angle))
    draw.line((x, y, *tip), fill=ANKLE_AXIS, width=3)
    barbs = [
        (tip[0] - 8.0 * math.cos(angle + turn), tip[1] + 8.0 * math.sin(angle + turn))
        for turn in (-0.5, 0.5)
    ]
    if size > 1.0:
        draw.polygon([tip, *barbs], fill=ANKLE_AXIS)
    return np.asarray(picture).copy()
