"""One episode of an agent recorded step by step, with the motion within its steps, for films and pictures of footprints."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from lean_yaw_env.envs.info import FallCode
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.pictures import Footage
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.parameters import Foot, Vector
from lean_yaw_env.rendering.scene import Scene
from lean_yaw_env.walker import Walker

from ..agent import Agent, State, attach

SAMPLES = 17
"""Of the motion within a step."""


@dataclass(frozen=True, eq=False)
class RecordedStep:
    """A walking step with the motion within it, sampled at even times."""

    scene: Scene
    """At its start."""
    end: float
    """From the start of the record, in units of time."""
    duration: float
    pitch: Vector
    ankle: Vector
    offset: Vector
    centre: Vector
    """Of mass, shape (SAMPLES, 2): (downhill, right)."""
    angles: tuple[float, float]
    """Inter-leg angles before and now."""
    push: tuple[float, float] | None
    """(Pitch rate, ankle rate) that the step started with, in standard deviations of the task's; None without pushes."""


@dataclass(frozen=True, eq=False)
class RecordedEpisode:
    """The steps of an episode, which ``rendering.draw_footprints`` draws.

    ``fall`` is the way the walker fell, or None; ``terminated`` says whether a fall or the task's own end cut the episode short.
    """

    steps: tuple[RecordedStep, ...]
    scene: Scene
    """At the end, or before the step in which the walker fell: its footprints, its goals, the path to be followed and the body."""
    commands_heading: bool
    fall: str | None
    terminated: bool

    @property
    def footprints(self) -> Vector:
        return self.scene.footprints

    @property
    def headings(self) -> Vector:
        return self.scene.headings

    @property
    def stances(self) -> tuple[Foot, ...]:
        return tuple(self.scene.feet)

    @property
    def path(self) -> Vector:
        """The centre of mass, shape (m, 4): (time, downhill, 0, right)."""
        times = np.concatenate([np.linspace(s.end - s.duration, s.end, SAMPLES) for s in self.steps])  # fmt: skip
        downhill, right = np.concatenate([step.centre for step in self.steps]).T
        return np.column_stack([times, downhill, np.zeros_like(times), right])

    @property
    def commands(self) -> list[tuple[int, float]]:
        """(step, heading) of every commanded heading, given at ``footprints[step]``, rad; none for tasks without one."""
        if not self.commands_heading:
            return []
        headings = [step.scene.commanded_heading for step in self.steps]
        return [
            (k, heading)
            for k, heading in enumerate(headings)
            if heading is not None and (k == 0 or heading != headings[k - 1])
        ]


def record_episode(
    agent: Agent,
    task: str,
    *,
    seed: int,
    options: EnvOptions | None = None,
    most_steps: int = 10_000,
    most_time: float = math.inf,
) -> RecordedEpisode:
    """Record an episode of an environment's seed, or its first steps, or those of its first units of time."""
    env = WalkerEnv(task, **vars(EnvOptions() if options is None else options))
    observation, info = env.reset(seed=seed)
    attach(agent, env)
    walker = Walker(env.simulation.body_parameters(0))  # a random body is drawn by the reset
    footage = Footage(env.simulation)
    scene = footage.scene(None)
    steps: list[RecordedStep] = []
    state: State = None
    terminated = truncated = False
    now = 0.0
    while not (terminated or truncated) and len(steps) < most_steps and now < most_time:
        before = info
        action, state = agent.predict(observation, state, np.array(not steps), True)
        observation, _, terminated, truncated, info = env.step(action)
        steps.append(_recorded_step(env, walker, scene, before, info, now))
        now = steps[-1].end
        if info["fall"] == FallCode.NONE:
            footage.extend()
            scene = footage.scene(None)
    env.close()
    return RecordedEpisode(
        tuple(steps), scene, env.task.heading_field is not None, FallCode(info["fall"]).word, bool(terminated)
    )  # fmt: skip


def _recorded_step(
    env: WalkerEnv,
    walker: Walker,
    scene: Scene,
    before: dict[str, Any],
    after: dict[str, Any],
    now: float,
) -> RecordedStep:
    duration = max(float(after["duration"]), 1e-6)  # a fall at the start of a step lasts no time
    motion = walker.stance_motion(
        before["state"],
        duration=duration,
        samples=SAMPLES,
        stance=scene.pose.stance,
        inter_leg_angle=after["inter_leg_angle"],
        mass_offset=after["commanded_offset"],
        previous_offset=before["mass_offset"],
    )
    heading = float(before["state"][0])
    cosine, sine = math.cos(heading), math.sin(heading)
    ahead, right = motion["centre_x"], motion["centre_z"]
    turned = np.column_stack([cosine * ahead + sine * right, cosine * right - sine * ahead])
    settings, push = env.simulation.settings, None
    if "pitch_push" in before:
        push = (
            float(before["pitch_push"] / settings["pitch_push"][0]),
            float(before["ankle_push"] / settings["ankle_push"][0]),
        )
    return RecordedStep(
        scene=scene,
        end=now + duration,
        duration=duration,
        pitch=motion["stance_pitch"],
        ankle=motion["ankle_angle"],
        offset=motion["mass_offset"],
        centre=before["footprint"] + turned,
        angles=(float(before["inter_leg_angle"]), float(after["inter_leg_angle"])),
        push=push,
    )
