"""Films of walks, with frames within the steps."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.extras import needs_extra
from lean_yaw_env.files import require_ending, written_whole
from lean_yaw_env.parameters import INTER_LEG_ANGLE, Foot, Vector
from lean_yaw_env.rendering.geometry import Pose
from lean_yaw_env.rendering.pygame_renderer import SIZE, Renderer
from lean_yaw_env.rendering.scene import Scene, status_lines
from lean_yaw_env.validation import require_number
from lean_yaw_env.walker import Walk, Walker

SECONDS_PER_TIME_UNIT = 1.0 / math.sqrt(9.81)
"""sqrt(leg length / gravity) for legs of one metre on earth: the film runs in real time."""
SWING_SHARE = 0.5
"""Share of a step in which the swing leg is drawn on its way; the model has it in front at once."""
HOLD_SECONDS = 1.0
"""How long a film stays with a walker that has fallen."""
_SAMPLES = 33  # per step; straight lines between them are wrong by less than 1e-4 leg lengths
_COORDINATES = ("stance_pitch", "ankle_angle", "mass_offset")

Frame = NDArray[np.uint8]
Encoder = Callable[[Path, Iterable[Frame], float], None]


@dataclass(frozen=True, eq=False)
class _Recording:
    """A walk with the motion within its steps, the unfinished one of a fall included.

    ``ends`` are the steps' ends in time; ``coordinates`` has shape (steps, samples, 3), ``path``
    shape (steps, samples, 2).
    """

    walk: Walk
    angles: Vector
    commanded: Vector | None
    ends: Vector
    coordinates: Vector
    path: Vector


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
        Share of a step in which the swing leg is drawn on its way to the front. The model has it
        there at once: massless, it acts on nothing.
    size : (width, height)
        Pixels.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Walk

    Raises
    ------
    ValueError, SolverError
        As ``Walker.walk``; also if the path has another ending.
    gymnasium.error.DependencyNotInstalled
        If what writes such a file is not installed.
    """
    require_number("fps", fps, 1, 120)
    file = FilmFile(path, fps)
    require_number("seconds_per_time_unit", seconds_per_time_unit, 0.0, 100.0, "(]")
    require_number("swing_share", swing_share, 0.0, 1.0)
    renderer = Renderer(size)
    walk = walker.walk(
        n_steps,
        state=state,
        stance=stance,
        inter_leg_angle=inter_leg_angle,
        mass_offset=mass_offset,
        previous_offset=previous_offset,
    )
    recording = _record(walker, walk, n_steps, inter_leg_angle, mass_offset, commanded_heading)
    times = np.arange(0.0, recording.ends[-1], 1.0 / (file.rate * seconds_per_time_unit))
    frames = (renderer.frame(_scene(walker, recording, time, swing_share)) for time in times)
    file.write(frames, len(times), holds_last=walk.fall is not None, progress=progress)
    return walk


def _record(
    walker: Walker,
    walk: Walk,
    n_steps: int,
    inter_leg_angle: float | Sequence[float] | Vector,
    mass_offset: float | Sequence[float] | Vector,
    commanded_heading: float | Sequence[float] | Vector | None,
) -> _Recording:
    angles = np.broadcast_to(np.asarray(inter_leg_angle, dtype=float), n_steps)
    offsets = np.broadcast_to(np.asarray(mass_offset, dtype=float), n_steps)
    commanded = None
    if commanded_heading is not None:
        commanded = np.asarray(commanded_heading, dtype=float)
        if commanded.shape not in ((), (n_steps,)):
            raise ValueError(
                f"commanded_heading must be one number or {n_steps}, got shape {commanded.shape}"
            )
        commanded = np.broadcast_to(commanded, n_steps)
    durations = walk.durations.tolist()
    if walk.fall is not None:
        i = walk.n_steps
        last = walker.step(walk.states[i], **_command(walk, i, angles, offsets))
        durations.append(max(last.duration, 1e-6))  # a fall at the start of a step lasts no time
    coordinates, path = [], []
    for i, duration in enumerate(durations):
        motion = walker.stance_motion(
            walk.states[i],
            duration=duration,
            samples=_SAMPLES,
            **_command(walk, i, angles, offsets),
        )
        coordinates.append(np.column_stack([motion[name] for name in _COORDINATES]))
        cosine, sine = math.cos(walk.headings[i]), math.sin(walk.headings[i])
        ahead, right = motion["centre_x"], motion["centre_z"]
        path.append(
            walk.footprints[i]
            + np.column_stack([cosine * ahead + sine * right, cosine * right - sine * ahead])
        )
    return _Recording(
        walk, angles, commanded, np.cumsum(durations), np.array(coordinates), np.array(path)
    )


def _command(walk: Walk, i: int, angles: Vector, offsets: Vector) -> dict[str, Any]:
    return {
        "stance": walk.stances[i],
        "inter_leg_angle": float(angles[i]),
        "mass_offset": float(offsets[i]),
        "previous_offset": float(walk.mass_offsets[i]),
    }


def _scene(walker: Walker, recording: _Recording, time: float, swing_share: float) -> Scene:
    walk, ends = recording.walk, recording.ends
    i = min(int(np.searchsorted(ends, time, side="right")), len(ends) - 1)
    start = ends[i - 1] if i else 0.0
    share = (time - start) / (ends[i] - start)
    place = share * (_SAMPLES - 1)
    grid = np.arange(_SAMPLES)
    pitch, ankle, offset = (np.interp(place, grid, column) for column in recording.coordinates[i].T)
    pose = Pose(
        state=np.array([walk.headings[i], pitch, ankle, 0.0, 0.0]),
        stance=walk.stances[i],
        inter_leg_angle=swing_angle(recording.angles, i, share, swing_share),
        mass_offset=float(offset),
        contact=walk.footprints[i],
    )
    seen = slice(0, i + 1)
    commanded = None if recording.commanded is None else float(recording.commanded[i])
    recent = walk.footprints[max(i - 2, 0)], walk.durations[max(i - 2, 0) : i].sum()
    fallen = walk.fall is not None and i == walk.n_steps
    return Scene(
        parameters=walker.parameters,
        pose=pose,
        footprints=walk.footprints[seen],
        headings=walk.headings[seen],
        feet=walk.stances[seen],
        path=np.vstack(
            [recording.path[:i].reshape(-1, 2), recording.path[i, : math.floor(place) + 1]]
        ),
        commanded_heading=commanded,
        lines=status_lines(
            step=i,
            time=time,
            speed=float(np.linalg.norm(walk.footprints[i] - recent[0]) / recent[1])
            if i >= 2
            else None,
            heading=float(walk.headings[max(i - 1, 0) : i + 1].mean()),
            commanded_heading=commanded,
            status=f"falls: {walk.fall.value}" if fallen and walk.fall else "walking",
        ),
    )


def swing_angle(angles: Vector, i: int, share: float, swing_share: float) -> float:
    """The inter-leg angle as drawn: from where the old stance leg was left to the front."""
    if i == 0 or share >= swing_share:
        return float(angles[i])
    s = share / swing_share
    blend = s * s * s * (10.0 + s * (6.0 * s - 15.0))
    return float(-angles[i - 1] + blend * (angles[i] + angles[i - 1]))


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
