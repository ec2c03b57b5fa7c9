"""A smooth drawing surface that needs no display: pygame's primitives, averaged down."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lean_yaw_env.extras import needs_extra
from lean_yaw_env.parameters import Vector
from lean_yaw_env.rendering.camera import Panel
from lean_yaw_env.rendering.palette import Colour

OVERSAMPLING = 2
"""Edges are drawn on a grid this much finer, and averaged."""
TEXT_SIZE = 12.0
"""Of ordinary words, pixels."""


class Canvas:
    """Draws in picture coordinates: floats, in pixels, from the upper left corner.

    Parameters
    ----------
    size : (width, height)
        Of the finished picture, pixels.
    background : Colour
    """

    def __init__(self, size: tuple[int, int], background: Colour) -> None:
        with needs_extra("render"):
            import pygame
            import pygame.freetype
        self._pygame: Any = pygame
        self._size = size
        # a depth of its own, not a display's: the same pixels with and without a window
        self._surface = self._pygame.Surface(_whole(size), 0, 32)
        self._background = background
        self.clear()

    def clear(self) -> None:
        """Start a picture."""
        self._surface.fill(self._background)
        # anew for each picture, for another user of pygame may have quit it meanwhile; pygame's own, so that every machine draws the same letters
        self._pygame.freetype.init()
        self._font = self._pygame.freetype.Font(None, OVERSAMPLING * TEXT_SIZE)
        self._font.origin = True

    def surface(self) -> Any:
        """The finished picture as a ``pygame.Surface``."""
        return self._pygame.transform.smoothscale(self._surface, self._size)

    def array(self) -> np.ndarray:
        """The finished picture; shape (height, width, 3), uint8."""
        width, height = self._size
        pixels = self._pygame.image.tobytes(self.surface(), "RGB")  # faster than pygame's arrays
        return np.frombuffer(pixels, dtype=np.uint8).reshape(height, width, 3).copy()

    def clip(self, panel: Panel | None) -> None:
        """Keep what follows within a panel; None ends that."""
        self._surface.set_clip(None if panel is None else _whole(panel))

    def rectangle(self, panel: Panel, colour: Colour, corner: float = 0.0) -> None:
        (radius,) = _whole([corner])
        self._pygame.draw.rect(self._surface, colour, _whole(panel), border_radius=radius)

    def polygon(
        self, points: Vector, fill: Colour | None, edge: Colour | None = None, width: float = 1.0
    ) -> None:
        """A polygon; shape (n, 2), n >= 3."""
        corners = _fine(points)
        if fill is not None:
            self._pygame.draw.polygon(self._surface, fill, corners)
        if edge is not None:
            self._pygame.draw.lines(self._surface, edge, True, corners, _thickness(width))

    def lines(self, points: Vector, colour: Colour, width: float = 1.0) -> None:
        """A thin line through points; shape (n, 2)."""
        if len(points) >= 2:
            self._pygame.draw.lines(self._surface, colour, False, _fine(points), _thickness(width))

    def bar(self, start: Vector, end: Vector, colour: Colour, width: float) -> None:
        """A straight bar with round ends, of any direction and any width."""
        along = end - start
        length = float(np.linalg.norm(along))
        if length > 0.0:
            aside = 0.5 * width / length * np.array([-along[1], along[0]])
            self.polygon(np.array([start + aside, end + aside, end - aside, start - aside]), colour)
        if width >= 1.5:
            for place in (start, end):
                self.disc(place, 0.5 * width, colour)

    def disc(self, centre: Vector, radius: float, colour: Colour) -> None:
        self._pygame.draw.circle(self._surface, colour, _fine(centre), OVERSAMPLING * radius)

    def ring(self, centre: Vector, radius: float, colour: Colour, width: float = 1.0) -> None:
        size = OVERSAMPLING * radius, _thickness(width)
        self._pygame.draw.circle(self._surface, colour, _fine(centre), *size)

    def arrow(self, start: Vector, end: Vector, colour: Colour, width: float) -> None:
        """An arrow with its tip at ``end``."""
        along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
        aside = np.array([-along[1], along[0]])
        neck = end - 4.5 * width * along
        self.bar(start, neck, colour, width)
        barb = end - 5.0 * width * along
        wing = 2.2 * width * aside
        self.polygon(np.array([end, barb + wing, neck, barb - wing]), colour)

    def text(
        self,
        words: str,
        place: tuple[float, float],
        colour: Colour,
        size: float = TEXT_SIZE,
        anchor: tuple[float, float] = (0.0, 0.0),
        ground: Colour | None = None,
    ) -> float:
        """Write one line, and return its width in pixels.

        Parameters
        ----------
        place, anchor : (float, float)
            ``anchor`` says which point of the line's box comes to ``place``: (0, 0) the upper left, (1, 1) the lower right.
        size : float
            Height of the letters' box, pixels.
        ground : Colour, optional
            Of a patch behind the words, to keep them readable over a drawing.
        """
        fine = OVERSAMPLING * size
        width = self._font.get_rect(words, size=fine).width
        height = (
            0.75 * fine
        )  # of capitals: lines of one size share their baseline, whichever letters they have
        left = OVERSAMPLING * place[0] - anchor[0] * width
        top = OVERSAMPLING * place[1] - anchor[1] * height
        if ground is not None:
            margin = 0.35 * fine
            patch = Panel(left - margin, top - margin, width + 2.0 * margin, height + 2.0 * margin)
            self.rectangle(
                Panel(*(value / OVERSAMPLING for value in patch)), ground, margin / OVERSAMPLING
            )
        baseline = (round(left), round(top + height))
        self._font.render_to(self._surface, baseline, words, colour, size=fine)
        return width / OVERSAMPLING


def _fine(points: Vector) -> list[Any]:
    """Places on the finer grid."""
    return (OVERSAMPLING * points).tolist()


def _whole(values: Sequence[float]) -> list[int]:
    """Whole pixels of the finer grid."""
    return [round(OVERSAMPLING * value) for value in values]


def _thickness(width: float) -> int:
    return max(1, *_whole([width]))
