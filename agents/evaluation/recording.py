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
from lean_yaw_env.rendering.motion import StepMotion
from lean_yaw_env.rendering.scene import Scene

from ..agent import Agent, State, attach


@dataclass(frozen=True, eq=False)
class RecordedStep:
    """A walking step with the motion within it."""

    scene: Scene
    """At its start."""
    end: float
    """From the start of the record, in units of time."""
    motion: StepMotion
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
        paths = [step.motion.path() for step in self.steps]
        times = np.concatenate(
            [
                np.linspace(step.end - step.motion.duration, step.end, len(path))
                for step, path in zip(self.steps, paths, strict=True)
            ]
        )
        downhill, right = np.concatenate(paths).T
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
    footage = Footage(env.simulation)
    steps: list[RecordedStep] = []
    state: State = None
    terminated = truncated = False
    now = 0.0
    while not (terminated or truncated) and len(steps) < most_steps and now < most_time:
        scene, push = footage.scene(), _push(info, env)
        action, state = agent.predict(observation, state, np.array(not steps), True)
        observation, _, terminated, truncated, info = env.step(action)
        footage.extend()
        now += footage.motion.duration
        steps.append(RecordedStep(scene, now, footage.motion, push))
    env.close()
    return RecordedEpisode(
        tuple(steps), footage.scene(), env.task.heading_field is not None, FallCode(info["fall"]).word, bool(terminated)
    )  # fmt: skip


def _push(info: dict[str, Any], env: WalkerEnv) -> tuple[float, float] | None:
    if "pitch_push" not in info:
        return None
    pitch, ankle = (float(info[name] / env.simulation.settings[name][0]) for name in ("pitch_push", "ankle_push"))  # fmt: skip
    return pitch, ankle
