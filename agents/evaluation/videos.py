"""Films of agents at their tasks, with what is asked of them and the pushes that they get."""

from __future__ import annotations

import math
from bisect import bisect_right
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.rendering.filming import FilmFile, Frame
from lean_yaw_env.rendering.motion import SECONDS_PER_TIME_UNIT
from lean_yaw_env.rendering.palette import ANKLE_AXIS, FAINT_INK, FLOOR, INK
from lean_yaw_env.rendering.pygame_renderer import Renderer
from lean_yaw_env.rendering.scene import Scene
from lean_yaw_env.validation import require_number

from ..agent import Agent
from ..registry import AgentRequest, agent_entry, env_id_of, make_agent, names_for
from ..seeds import first_seed
from .recording import RecordedEpisode, record_episode

STAND_INS = ("lqr", "feedback", "fixed")
"""Who is filmed where there is no trained agent, the first that is for the task."""
DIAL_RADIUS = 22.0
"""Of the dial that shows pushes, pixels: a push of ``_DIAL_REACH`` standard deviations."""
_DIAL_REACH = 2.0
_DIAL_PLACE = (
    30.0,
    28.0,
)  # pixels from the right and from the top: beside the walker in perspective


def film_agent(
    agent: Agent,
    task: str,
    path: str | Path,
    *,
    seed: int = 0,
    options: EnvOptions | None = None,
    seconds: float = 11.0,
    speed: float = 2.0,
    fps: float = 10.0,
    size: tuple[int, int] = (600, 380),
    name: str = "",
    progress: bool = False,
) -> str | None:
    """Film the first seconds of a validation episode.

    Parameters
    ----------
    agent, task, options : who walks, at which task, under which options
    path : an .mp4 or a .gif; written whole or not at all
    seed : int >= 0
        Another one films another episode.
    seconds : (0, 600]
    speed : (0, 100]
        Times real time for legs of a metre.
    fps : [1, 60]
    size : pixels
    name : shown beside the picture

    Returns
    -------
    The way the walker fell, or None.

    Raises
    ------
    ValueError
        If an argument is out of its range, or the path has another ending.
    gymnasium.error.DependencyNotInstalled
        If what draws or writes is not installed.
    """
    require_number("seconds", seconds, 0.0, 600.0, "(]")
    require_number("speed", speed, 0.0, 100.0, "(]")
    require_number("fps", fps, 1.0, 60.0)
    file = FilmFile(path, fps)
    renderer = Renderer(size)
    per_second = speed / SECONDS_PER_TIME_UNIT
    most = seconds * per_second
    first = first_seed("validation", seed)
    episode = record_episode(agent, task, seed=first, options=options, most_time=most)
    end = episode.steps[-1].end
    times = np.arange(0.0, min(end, most), per_second / file.rate)
    scenes = (_scene_at(episode, time, name) for time in times)
    frames = (draw_push(renderer.frame(scene), push) for scene, push in scenes)
    fall = episode.fall if end <= most else None
    file.write(frames, len(times), holds_last=fall is not None, progress=progress)
    return fall


def _scene_at(
    episode: RecordedEpisode, time: float, name: str
) -> tuple[Scene, tuple[float, float] | None]:
    """The scene at an instant, and the push on its step."""
    steps, last = episode.steps, len(episode.steps) - 1
    i = min(bisect_right(steps, time, key=lambda step: step.end), last)
    step = steps[i]
    share = min(1.0 + (time - step.end) / step.motion.duration, 1.0)
    walked = [earlier.motion.path() for earlier in steps[:i]]
    path = np.vstack([*walked, step.motion.path(share)])
    now = f"falls: {episode.fall}" if episode.fall and i == last else f"time {time:.0f}"
    lines = (name, now) if name else (now,)  # more of them would hide the walker of a small picture
    return replace(step.scene, pose=step.motion.pose(share), path=path, lines=lines), step.push


def agent_for(name: str, task: str, runs: Path, path: Path | None = None) -> tuple[str, Agent]:
    """The agent of that name for a task; where it is a trained one that is not there, or not for the task, the best stand-in.

    Raises
    ------
    ValueError
        If there is no agent or task of that name, or none of them is for the task.
    """
    agent_entry(name)
    request = AgentRequest(env_id_of(task), EnvOptions(), path=path, runs=runs)
    found = names_for(request)
    for candidate in (name, *STAND_INS):
        if candidate in found:
            with suppress(NoGaitError):  # lqr on a slope whose gait is none without an agent
                return candidate, make_agent(candidate, request)
    raise ValueError(f"agent must be one for {task}: {', '.join(found)}; got {name!r}")


def draw_push(frame: Frame, push: tuple[float, float] | None) -> Frame:
    """A frame with the push (pitch rate, ankle rate), in standard deviations, as an arrow.

    A negative pitch rate is forward and up on the dial; a positive ankle rate is to the right.
    """
    if push is None:
        return frame
    from PIL import Image, ImageDraw

    picture = Image.fromarray(frame)
    draw = ImageDraw.Draw(picture)
    x, y = frame.shape[1] - _DIAL_PLACE[0], _DIAL_PLACE[1]
    r = DIAL_RADIUS
    draw.ellipse((x - r, y - r, x + r, y + r), fill=FLOOR, outline=FAINT_INK)
    draw.text((x, y + r + 2.0), "push", fill=INK, anchor="mt")
    pitch, ankle = push
    size = min(math.hypot(pitch, ankle) / _DIAL_REACH, 1.0) * r
    angle = math.atan2(-pitch, ankle)  # from the right, upward
    tip = (x + size * math.cos(angle), y - size * math.sin(angle))
    draw.line((x, y, *tip), fill=ANKLE_AXIS, width=3)
    if size > 1.0:
        ends = (angle - 0.5, angle + 0.5)
        barbs = [(tip[0] - 8.0 * math.cos(end), tip[1] + 8.0 * math.sin(end)) for end in ends]
        draw.polygon([tip, *barbs], fill=ANKLE_AXIS)
    return np.asarray(picture).copy()
