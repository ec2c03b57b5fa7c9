"""Films of agents at their tasks, with what is asked of them and the pushes that they get."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lean_yaw_env.envs.info import FallCode
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.pictures import Footage
from lean_yaw_env.envs.state import Records
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.parameters import Foot, Vector
from lean_yaw_env.rendering.filming import (
    SECONDS_PER_TIME_UNIT,
    FilmFile,
    Frame,
    swing_angle,
)
from lean_yaw_env.rendering.geometry import Pose
from lean_yaw_env.rendering.palette import ANKLE_AXIS, FAINT_INK, FLOOR, INK
from lean_yaw_env.rendering.pygame_renderer import Renderer
from lean_yaw_env.rendering.scene import Scene
from lean_yaw_env.validation import require_number
from lean_yaw_env.walker import Walker

from ..agent import Agent, State, attach
from ..registry import AgentRequest, agent_entry, env_id_of, make_agent, names_for
from ..seeds import evaluation_seed

SIZE = (600, 380)
FPS = 10.0
SECONDS = 11.0
SPEED = 2.0
"""Times as fast as a walker of a metre's leg on earth."""
SWING_SHARE = 0.6
STAND_INS = ("lqr", "feedback", "fixed")
"""Who is filmed where there is no trained agent, the first that is for the task."""
DIAL_RADIUS = 22.0
"""Of the dial that shows pushes, pixels: a push of ``_DIAL_REACH`` standard deviations."""
_DIAL_REACH = 2.0
_DIAL_PLACE = (0.5, 28.0)  # share of the width, pixels from the top
_SAMPLES = 17  # of the motion within a step


@dataclass(frozen=True, eq=False)
class FilmedStep:
    """A walking step with the motion within it.

    Attributes
    ----------
    scene : Scene
        At its start.
    end : when it ends, from the start of the film, in units of time
    duration : float
    pitch, ankle, offset : shape (samples,), at even times
    centre : shape (samples, 2)
        (downhill, right).
    angles : inter-leg angles (before, now)
    push : (pitch rate, ankle rate) that the step started with, in standard deviations of the task's, or None without pushes
    fall : the way it ended, or None
    """

    scene: Scene
    end: float
    duration: float
    pitch: Vector
    ankle: Vector
    offset: Vector
    centre: Vector
    angles: tuple[float, float]
    push: tuple[float, float] | None
    fall: str | None


def film_agent(
    agent: Agent,
    task: str,
    path: str | Path,
    *,
    seed: int = 0,
    options: EnvOptions | None = None,
    seconds: float = SECONDS,
    speed: float = SPEED,
    fps: float = FPS,
    size: tuple[int, int] = SIZE,
    name: str = "",
    progress: bool = False,
) -> str | None:
    """Film the first seconds of an episode that is kept for evaluation.

    Parameters
    ----------
    agent : Agent
    task : str
    path : an .mp4 or a .gif; written whole or not at all
    seed : int >= 0
        Another one films another episode.
    options : EnvOptions
    seconds : (0, 600]
    speed : (0, 100]
        Times real time for legs of a metre.
    fps : [1, 60]
    size : pixels
    name : of the agent, shown beside the picture
    progress : bool

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
    steps = record_steps(
        agent, task, seed=evaluation_seed(seed), options=options, time=seconds * per_second
    )
    ends = np.array([step.end for step in steps])
    times = np.arange(0.0, min(ends[-1], seconds * per_second), per_second / file.rate)
    scenes = (_scene_at(steps, ends, time, name) for time in times)
    frames = (draw_push(renderer.frame(scene), push) for scene, push in scenes)
    fall = steps[-1].fall if ends[-1] <= seconds * per_second else None
    file.write(frames, len(times), holds_last=fall is not None, progress=progress)
    return fall


def record_steps(
    agent: Agent,
    task: str,
    *,
    seed: int,
    time: float,
    options: EnvOptions | None = None,
) -> list[FilmedStep]:
    """Walk an episode of an environment's seed for so many units of time, and keep the motion within its steps."""
    env = WalkerEnv(task, **vars(EnvOptions() if options is None else options))
    observation, info = env.reset(seed=seed)
    attach(agent, env)
    walker = Walker(env.simulation.body_parameters(0))
    footage = Footage(env.simulation)
    steps: list[FilmedStep] = []
    state: State = None
    ended, now = False, 0.0
    while not ended and now < time:
        scene, before = footage.scene(None), info
        action, state = agent.predict(observation, state, np.array(not steps), True)
        observation, _, terminated, truncated, info = env.step(action)
        footage.extend()
        ended = terminated or truncated
        steps.append(_filmed(walker, scene, before, info, now, env.simulation.settings))
        now = steps[-1].end
    env.close()
    return steps


def _filmed(
    walker: Walker,
    scene: Scene,
    before: dict[str, Any],
    after: dict[str, Any],
    now: float,
    settings: Records,
) -> FilmedStep:
    foot: Foot = "left" if before["stance_side"] > 0.0 else "right"
    duration = max(float(after["duration"]), 1e-6)  # a fall at the start of a step lasts no time
    motion = walker.stance_motion(
        before["state"],
        duration=duration,
        samples=_SAMPLES,
        stance=foot,
        inter_leg_angle=after["inter_leg_angle"],
        mass_offset=after["commanded_offset"],
        previous_offset=before["mass_offset"],
    )
    heading = float(before["state"][0])
    cosine, sine = math.cos(heading), math.sin(heading)
    ahead, right = motion["centre_x"], motion["centre_z"]
    turned = np.column_stack([cosine * ahead + sine * right, cosine * right - sine * ahead])
    return FilmedStep(
        scene=scene,
        end=now + duration,
        duration=duration,
        pitch=motion["stance_pitch"],
        ankle=motion["ankle_angle"],
        offset=motion["mass_offset"],
        centre=before["footprint"] + turned,
        angles=(float(before["inter_leg_angle"]), float(after["inter_leg_angle"])),
        push=_push(before, settings),
        fall=FallCode(after["fall"]).word,
    )


def _push(info: dict[str, Any], settings: Records) -> tuple[float, float] | None:
    if "pitch_push" not in info:
        return None
    return (
        float(info["pitch_push"] / settings["pitch_push"][0]),
        float(info["ankle_push"] / settings["ankle_push"][0]),
    )


def _scene_at(
    steps: list[FilmedStep], ends: Vector, time: float, name: str
) -> tuple[Scene, tuple[float, float] | None]:
    """The scene at an instant, and the push on its step."""
    i = min(int(np.searchsorted(ends, time, side="right")), len(steps) - 1)
    step = steps[i]
    share = min(1.0 + (time - step.end) / step.duration, 1.0)
    place = share * (_SAMPLES - 1)
    grid = np.arange(_SAMPLES)
    pitch, ankle, offset = (
        float(np.interp(place, grid, values)) for values in (step.pitch, step.ankle, step.offset)
    )
    pose = Pose(
        state=np.array([step.scene.pose.state[0], pitch, ankle, 0.0, 0.0]),
        stance=step.scene.pose.stance,
        inter_leg_angle=swing_angle(np.array(step.angles), 1, share, SWING_SHARE) if i else step.angles[1],
        mass_offset=offset,
        contact=step.scene.pose.contact,
    )  # fmt: skip
    walked = [earlier.centre for earlier in steps[:i]]
    path = np.vstack([*walked, step.centre[: math.floor(place) + 1]])
    now = f"falls: {step.fall}" if step.fall else f"time {time:.0f}"
    lines = (name, now) if name else (now,)  # more of them would hide the walker of a small picture
    return replace(step.scene, pose=pose, path=path, lines=lines), step.push


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
    x, y = _DIAL_PLACE[0] * frame.shape[1], _DIAL_PLACE[1]
    draw.ellipse(
        (x - DIAL_RADIUS, y - DIAL_RADIUS, x + DIAL_RADIUS, y + DIAL_RADIUS),
        fill=FLOOR,
        outline=FAINT_INK,
    )
    draw.text((x, y + DIAL_RADIUS + 2.0), "push", fill=INK, anchor="mt")
    pitch, ankle = push
    size = min(math.hypot(pitch, ankle) / _DIAL_REACH, 1.0) * DIAL_RADIUS
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
