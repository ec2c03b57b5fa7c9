"""Colours of pictures and films.

Colours that must be told apart are those of Okabe and Ito (2008, "Color universal design"), which colour-blind readers tell apart too.
"""

from __future__ import annotations

from lean_yaw_env.parameters import Foot

Colour = tuple[int, int, int]

ORANGE: Colour = (230, 159, 0)
SKY_BLUE: Colour = (86, 180, 233)
BLUISH_GREEN: Colour = (0, 158, 115)
BLUE: Colour = (0, 114, 178)
VERMILLION: Colour = (213, 94, 0)
REDDISH_PURPLE: Colour = (204, 121, 167)
GREY: Colour = (150, 150, 150)

BACKGROUND: Colour = (236, 234, 228)
FLOOR: Colour = (250, 249, 246)
SKY: Colour = (250, 249, 246)
GROUND: Colour = (221, 216, 205)
GRID: Colour = (232, 229, 222)
STRONG_GRID: Colour = (214, 210, 200)
INK: Colour = (43, 45, 52)
FAINT_INK: Colour = (124, 125, 128)
LEFT = BLUE
RIGHT = VERMILLION
PATH: Colour = (92, 94, 102)
COMMAND = BLUISH_GREEN
ANKLE_AXIS: Colour = (190, 38, 92)
GOAL = ORANGE
REFERENCE = REDDISH_PURPLE

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
