"""Colours of pictures and films; the colour-blind can tell left from right too."""

from __future__ import annotations

from lean_yaw_env.parameters import Foot

Colour = tuple[int, int, int]

BACKGROUND: Colour = (236, 234, 228)
FLOOR: Colour = (250, 249, 246)
SKY: Colour = (250, 249, 246)
GROUND: Colour = (221, 216, 205)
GRID: Colour = (232, 229, 222)
STRONG_GRID: Colour = (214, 210, 200)
INK: Colour = (43, 45, 52)
FAINT_INK: Colour = (124, 125, 128)
LEFT: Colour = (37, 110, 178)
RIGHT: Colour = (214, 104, 37)
PATH: Colour = (92, 94, 102)
COMMAND: Colour = (22, 142, 104)
ANKLE_AXIS: Colour = (190, 38, 92)
GOAL: Colour = (222, 168, 30)
REFERENCE: Colour = (140, 110, 180)

FOOT_COLOURS: dict[Foot, Colour] = {"left": LEFT, "right": RIGHT}


def mixed(colour: Colour, other: Colour, share: float) -> Colour:
    """``colour`` with a share of another in it."""
    red, green, blue = (
        round((1.0 - share) * a + share * b) for a, b in zip(colour, other, strict=True)
    )
    return red, green, blue


def unit_colour(colour: Colour) -> tuple[float, float, float]:
    """The same colour in parts of one."""
    red, green, blue = (value / 255.0 for value in colour)
    return red, green, blue
