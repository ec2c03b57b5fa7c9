"""Films of walks, with frames within the steps."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.extras import needs_extra
from lean_yaw_env.files import require_ending, written_whole
from lean_yaw_env.parameters import INTER_LEG_ANGLE, Foot, Vector
from lean_yaw_env.rendering.geometry import Pose
from lean_yaw_env.rendering.motion import SECONDS_PER_TIME_UNIT, SWING_SHARE, StepMotion
from lean_yaw_env.rendering.pygame_renderer import SIZE, Renderer
from lean_yaw_env.rendering.scene import Scene, status_lines
from lean_yaw_env.validation import (
    require_flag,
    require_instance,
    require_number,
    require_one_or_each,
)
from lean_yaw_env.walker import Walk, Walker

HOLD_SECONDS = 1.0
"""How long a film stays with a walker that has fallen."""

Frame = NDArray[np.uint8]
Encoder = Callable[[Path, Iterable[Frame], float], None]


def film(
    walker: Walker,
    n_steps: int,
    path: str | os.PathLike[str],
    *,
    state: ArrayLike,
    stance: Foot = "left",
    inter_leg_angle: float | Sequence[float] | Vector = INTER_LEG_ANGLE,
    mass_offset: float | Sequence[float] | Vector = 0.0,
    previous_offset: float | None = None,
    commanded_heading: float | Sequence[float] | Vector | None = None,
    fps: int = 30,
    seconds_per_time_unit: float = SECONDS_PER_TIME_UNIT,
    swing_share: float = SWING_SHARE,
    size: tuple[int, int] = SIZE,
    progress: bool = True,
) -> Walk:
    """Walk, and film it.

    Parameters
    ----------
    walker : Walker
    n_steps, state, stance, inter_leg_angle, mass_offset, previous_offset : see ``Walker.walk``
    path : str or path
        An .mp4 or a .gif; written whole or not at all.
    commanded_heading : float, or one per step, optional
        rad; drawn as an arrow.
    fps : [1, 120]
        Frames per second.
    seconds_per_time_unit : (0, 100]
        Of the film; by default real time for legs of one metre.
    swing_share : [0, 1]
        See ``StepMotion``.
    size : (width, height)
        Pixels.
    progress : bool
        Show a progress bar.

    Raises
    ------
    ValueError, SolverError
        As ``Walker.walk``; also if the path has another ending.
    gymnasium.error.DependencyNotInstalled
        If what writes such a file is not installed.
    """
    require_instance("walker", walker, Walker)
    require_flag("progress", progress)
    require_number("fps", fps, 1, 120)
    file = FilmFile(path, fps)
    require_number("seconds_per_time_unit", seconds_per_time_unit, 0.0, 100.0, "(]")
    require_number("swing_share", swing_share, 0.0, 1.0)
    renderer = Renderer(size)
    command: dict[str, Any] = {"inter_leg_angle": inter_leg_angle, "mass_offset": mass_offset}
    start: dict[str, Any] = {"state": state, "stance": stance, "previous_offset": previous_offset}
    walk = walker.walk(n_steps, **start, **command)
    commanded = None
    if commanded_heading is not None:
        commanded = require_one_or_each("commanded_heading", commanded_heading, n_steps)
    motions = _motions(walker, walk, swing_share)
    ends = np.cumsum([motion.duration for motion in motions])
    times = np.arange(0.0, ends[-1], 1.0 / (file.rate * seconds_per_time_unit))
    frames = (renderer.frame(_scene(walk, motions, ends, commanded, time)) for time in times)
    file.write(frames, len(times), holds_last=walk.fall is not None, progress=progress)
    return walk


def _motions(walker: Walker, walk: Walk, swing_share: float) -> list[StepMotion]:
    """The motion within each step, the unfinished one of a fall included."""
    motions: list[StepMotion] = []
    for i, (angle, offset) in enumerate(walk.commands.tolist()):
        state, foot, before = walk.states[i], walk.stances[i], float(walk.mass_offsets[i])
        command = {"inter_leg_angle": angle, "mass_offset": offset}
        if i < walk.n_steps:
            duration = float(walk.durations[i])
        else:
            duration = walker.step(state, stance=foot, previous_offset=before, **command).duration
        comes_from = -walk.commands[i - 1, 0] if i else angle  # at first it is in front
        pose = Pose(state, foot, comes_from, before, walk.footprints[i])
        motion = StepMotion(walker, pose, duration=duration, swing_share=swing_share, **command)
        motions.append(motion)
    return motions


def _scene(
    walk: Walk, motions: list[StepMotion], ends: Vector, commanded: Vector | None, time: float
) -> Scene:
    i = min(int(np.searchsorted(ends, time, side="right")), len(ends) - 1)
    start = ends[i - 1] if i else 0.0
    share = (time - start) / (ends[i] - start)
    seen = slice(0, i + 1)
    command = None if commanded is None else float(commanded[i])
    recent = max(i - 2, 0)
    way, duration = walk.footprints[i] - walk.footprints[recent], walk.durations[recent:i].sum()
    fall = walk.fall if i == walk.n_steps else None
    return Scene(
        parameters=walk.parameters,
        pose=motions[i].pose(share),
        footprints=walk.footprints[seen],
        headings=walk.headings[seen],
        feet=walk.stances[seen],
        path=np.vstack([*(motion.path() for motion in motions[:i]), motions[i].path(share)]),
        commanded_heading=command,
        lines=status_lines(
            step=i,
            time=time,
            speed=float(np.linalg.norm(way) / duration) if i >= 2 else None,
            heading=float(walk.headings[max(i - 1, 0) : i + 1].mean()),
            commanded_heading=command,
            status=f"falls: {fall.value}" if fall else "walking",
        ),
    )


class FilmFile:
    """An .mp4 or a .gif, written whole or not at all.

    Parameters
    ----------
    path : str or path
    fps : float
        Frames per second. A gif's frames last whole hundredths of a second, two or more, to which ``rate`` is rounded: viewers slow
        faster films down.

    Raises
    ------
    ValueError
        If the path has another ending.
    gymnasium.error.DependencyNotInstalled
        If what writes such a file is not installed.
    """

    def __init__(self, path: str | os.PathLike[str], fps: float) -> None:
        self._path = require_ending(path, (".mp4", ".gif"))
        is_gif = self._path.suffix.lower() == ".gif"
        self.rate = 100.0 / max(round(100.0 / fps), 2) if is_gif else float(fps)
        self._encode = _gif_encoder() if is_gif else _mp4_encoder()
        with needs_extra("render"):
            from tqdm import tqdm
        self._progress_bar = tqdm

    def write(
        self, frames: Iterable[Frame], count: int, *, holds_last: bool, progress: bool
    ) -> None:
        """Write ``count`` frames, the last for a second more if a walker has fallen in it."""
        hold = round(HOLD_SECONDS * self.rate) if holds_last else 0
        frames = _with_last_repeated(frames, hold)
        if progress:
            total, name = count + hold, self._path.name
            frames = self._progress_bar(frames, total=total, desc=name, unit="frame")
        with written_whole(self._path) as temporary:
            self._encode(temporary, frames, self.rate)


def _with_last_repeated(frames: Iterable[Frame], count: int) -> Iterator[Frame]:
    last: list[Frame] = []
    for frame in frames:
        last = [frame]
        yield frame
    for _ in range(count):
        yield from last


def _mp4_encoder() -> Encoder:
    with needs_extra("render"):
        import imageio_ffmpeg
    # Its type hints know only its defaults' types
    write_frames: Any = imageio_ffmpeg.write_frames

    def encode(path: Path, frames: Iterable[Frame], fps: float) -> None:
        frames = iter(frames)
        first = next(frames)
        # Macro blocks of 2 keep an even size as it is; the rest suits thin lines on an even ground
        encoder = write_frames(
            str(path),
            first.shape[1::-1],
            fps=fps,
            codec="libx264",
            quality=None,
            macro_block_size=2,
            output_params=["-crf", "22", "-preset", "fast", "-tune", "animation"],
        )
        encoder.send(None)
        try:
            for frame in itertools.chain([first], frames):
                encoder.send(frame)
        finally:
            encoder.close()

    return encode


def _gif_encoder() -> Encoder:
    with needs_extra("render"):
        from PIL import Image

    def encode(path: Path, frames: Iterable[Frame], fps: float) -> None:
        # One palette for all frames: colours do not flicker, and what stays the same costs next to nothing
        pictures = (Image.fromarray(frame) for frame in frames)
        first = next(pictures).quantize(128, dither=Image.Dither.NONE)
        rest = (picture.quantize(palette=first, dither=Image.Dither.NONE) for picture in pictures)
        first.save(
            path,
            save_all=True,
            append_images=rest,
            duration=round(1000.0 / fps),
            loop=0,
            optimize=True,  # takes pixels that stay the same out of a frame: a third of the size
        )

    return encode
