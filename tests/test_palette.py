"""The palette is told apart by readers with and without colour blindness."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from lean_yaw_env.rendering import palette
from lean_yaw_env.rendering.palette import (
    AGENT_COLOURS,
    FOOT_COLOURS,
    SERIES_COLOURS,
    Colour,
    unit_colour,
)

# What is seen of linear RGB; Machado, Oliveira and Fernandes (2009), Table 1, severity 1
SIGHTS = {
    "normal": np.eye(3),
    "protanopia": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deuteranopia": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "tritanopia": np.array(
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ]
    ),
}
XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)
"""Of linear sRGB (IEC 61966-2-1)."""


def lab(colour: Colour, sight: np.ndarray) -> np.ndarray:
    """CIE L*a*b* of a colour as it is seen."""
    light = np.array(unit_colour(colour))
    linear = np.where(light <= 0.04045, light / 12.92, ((light + 0.055) / 1.055) ** 2.4)
    seen = XYZ @ np.clip(sight @ linear, 0.0, 1.0) / XYZ.sum(axis=1)
    x, y, z = np.where(seen > 0.008856, np.cbrt(seen), 7.787 * seen + 16.0 / 116.0)
    return np.array([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


@pytest.mark.parametrize("sight", SIGHTS.values(), ids=SIGHTS)
@pytest.mark.parametrize(
    "colours",
    [tuple(AGENT_COLOURS.values()), SERIES_COLOURS, tuple(FOOT_COLOURS.values())],
    ids=["agents", "series", "feet"],
)
def test_any_two_colours_are_told_apart(colours: tuple[Colour, ...], sight: np.ndarray) -> None:
    distances = [
        np.linalg.norm(lab(first, sight) - lab(second, sight))
        for first, second in combinations(colours, 2)
    ]
    # A difference of 2.3 is just noticeable side by side (Mahy et al. 1994); thin lines apart need several times that
    assert min(distances) > 15.0


def test_the_page_has_the_colours_of_pictures_and_films() -> None:
    source = Path(__file__).parents[1] / "web" / "src" / "scene" / "palette.ts"
    page = dict(re.findall(r"(\w+): \"(#[0-9a-f]{6})\"", source.read_text(encoding="utf-8")))
    others = {"faint": "FAINT_INK", "axis": "ANKLE_AXIS"}
    assert len(page) >= 15
    for name, colour in page.items():
        ours = getattr(palette, others.get(name, name.upper()))
        assert colour == "#{:02x}{:02x}{:02x}".format(*ours), name
