"""Colours of pictures, films and the web page, chosen so that readers with any kind of colour blindness can tell them apart."""

from __future__ import annotations

from lean_yaw_env.parameters import Foot

Colour = tuple[int, int, int]

WHITE: Colour = (255, 255, 255)
BACKGROUND: Colour = (236, 234, 228)
FLOOR: Colour = (246, 244, 238)
HORIZON: Colour = (239, 240, 238)
ZENITH: Colour = (185, 210, 228)
GROUND: Colour = (221, 216, 205)
GRID: Colour = (232, 229, 222)
STRONG_GRID: Colour = (214, 210, 200)
INK: Colour = (43, 45, 52)
FAINT_INK: Colour = (99, 100, 106)
LEFT: Colour = (37, 110, 178)
RIGHT: Colour = (214, 104, 37)
PATH: Colour = (92, 94, 102)
STEEL: Colour = (201, 204, 209)
COMMAND: Colour = (22, 142, 104)
ANKLE_AXIS: Colour = (190, 38, 92)
GOAL: Colour = (222, 168, 30)
REFERENCE: Colour = (140, 110, 180)

FOOT_COLOURS: dict[Foot, Colour] = {"left": LEFT, "right": RIGHT}

# Okabe and Ito, "Color universal design" (2008), without yellow, which is too faint for a line on white
BLACK: Colour = (0, 0, 0)
ORANGE: Colour = (230, 159, 0)
SKY_BLUE: Colour = (86, 180, 233)
GREEN: Colour = (0, 158, 115)
BLUE: Colour = (0, 114, 178)
VERMILION: Colour = (213, 94, 0)
PURPLE: Colour = (204, 121, 167)
LIGHT_GREY: Colour = (192, 192, 192)
WINE: Colour = (136, 34, 85)
VIOLET: Colour = (120, 0, 220)
BROWN: Colour = (80, 60, 0)
NAVY: Colour = (20, 40, 140)
CRIMSON: Colour = (220, 0, 60)
LIGHT_GREEN: Colour = (140, 200, 100)

AGENT_COLOURS: dict[str, Colour] = {
    "random": LIGHT_GREY,
    "fixed": BLACK,
    "feedback": ORANGE,
    "lqr": SKY_BLUE,
    "linear": LIGHT_GREEN,
    "mpc": GREEN,
    "ppo": VERMILION,
    "sac": PURPLE,
    "apg": BLUE,
    "tqc": VIOLET,
    "frames": BROWN,
    "recurrent": NAVY,
    "oracle": CRIMSON,
    "her": WINE,
}
"""The colour of each agent, the same in every picture."""
SERIES_COLOURS: tuple[Colour, ...] = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY_BLUE, BLACK)
"""Of curves that are not agents, in this order; then another line style is needed."""


def mixed(colour: Colour, other: Colour, share: float) -> Colour:
    """``colour`` with a share of another in it."""
    red, green, blue = (
        round((1.0 - share) * a + share * b) for a, b in zip(colour, other, strict=True)
    )
    return red, green, blue


def unit_colour(colour: Colour) -> tuple[float, float, float]:
    """The same colour in parts of one, as matplotlib takes it."""
    red, green, blue = (value / 255.0 for value in colour)
    return red, green, blue
