"""Scenes as pictures: an array without a display, or a window."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.extras import needs_extra
from lean_yaw_env.rendering.camera import Panel
from lean_yaw_env.rendering.canvas import Canvas
from lean_yaw_env.rendering.geometry import walker_shape
from lean_yaw_env.rendering.palette import BACKGROUND
from lean_yaw_env.rendering.perspective import draw_perspective_view
from lean_yaw_env.rendering.scene import Scene
from lean_yaw_env.rendering.top_view import draw_top_view
from lean_yaw_env.validation import require_count, require_instance, require_number

SIZE = (960, 540)
"""Width and height of a picture, pixels."""
LEAST_SIZE, GREATEST_SIZE = (480, 360), (3840, 2160)
_INVISIBLE = ("offscreen", "dummy", "evdev")
"""SDL's drivers without a window, taken where there is no display; who names one in ``SDL_VIDEODRIVER`` wants it."""
_GAP = 6.0
_TOP_SHARE = 0.585  # of the width, for the view from above


class Renderer:
    """Draws scenes: from above on the left, and in perspective on the right.

    Parameters
    ----------
    size : (width, height)
        Pixels, from (480, 360) to (3840, 2160).

    Raises
    ------
    ValueError
        If the size is outside its range.
    gymnasium.error.DependencyNotInstalled
        If pygame is not installed.
    """

    def __init__(self, size: tuple[int, int] = SIZE) -> None:
        self.size = _require_size(size)
        with needs_extra("render"):
            import pygame
        self._pygame: Any = pygame
        self._canvas = Canvas(self.size, BACKGROUND)
        self._window: Any = None
        self._clock: Any = None
        self._closed_by_user = False

    def frame(self, scene: Scene) -> NDArray[np.uint8]:
        """The picture of a scene; shape (height, width, 3), uint8. Needs and opens no display."""
        self._draw(require_instance("scene", scene, Scene))
        return self._canvas.array()

    def show(self, scene: Scene, fps: float = 30.0) -> bool:
        """Show a scene in a window, waiting as long as the frame rate asks.

        Returns False once its user has closed the window; it stays closed, and nothing more is drawn.

        Raises
        ------
        RuntimeError
            If there is no display; ``frame`` needs none.
        """
        rate = require_number("fps", fps, 0.0, 1000.0, "(]")
        require_instance("scene", scene, Scene)
        if self._closed_by_user:
            return False
        window = self._opened_window()
        self._draw(scene)
        window.blit(self._canvas.surface(), (0, 0))
        self._pygame.display.flip()
        self._clock.tick(rate)
        for event in self._pygame.event.get():
            if event.type == self._pygame.QUIT:
                self.close()
                self._closed_by_user = True
                return False
        return True

    def close(self) -> None:
        """Close the window, if there is one; a later ``show`` opens a new one."""
        if self._window is not None:
            self._window = None
            self._pygame.display.quit()

    def _opened_window(self) -> Any:
        if self._window is None:
            display = self._pygame.display
            try:
                display.init()
                if display.get_driver() in _INVISIBLE and "SDL_VIDEODRIVER" not in os.environ:
                    display.quit()
                    raise self._pygame.error("there is no display")
                self._window = display.set_mode(self.size)
            except self._pygame.error as error:
                raise RuntimeError(
                    f"no window could be opened ({error}); without a display, ask for arrays"
                ) from error
            display.set_caption("Lean-to-yaw walker")
            self._clock = self._pygame.time.Clock()
        return self._window

    def _draw(self, scene: Scene) -> None:
        width, height = self.size
        split = round(_TOP_SHARE * width)
        shape = walker_shape(scene.parameters, scene.pose)
        self._canvas.clear()
        draw_top_view(self._canvas, Panel(0.0, 0.0, split, height), scene, shape)
        beside = Panel(split + _GAP, 0.0, width - split - _GAP, height)
        draw_perspective_view(self._canvas, beside, scene, shape)


def _require_size(size: tuple[int, int]) -> tuple[int, int]:
    try:
        width, height = size
    except (TypeError, ValueError) as error:
        raise ValueError(f"size must be (width, height) in pixels, got {size!r}") from error
    return (
        require_count("size: width", width, LEAST_SIZE[0], GREATEST_SIZE[0]),
        require_count("size: height", height, LEAST_SIZE[1], GREATEST_SIZE[1]),
    )
