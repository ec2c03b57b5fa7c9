"""One episode recorded step by step, for pictures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from agents.agent import Agent, State, attach
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.tasks import Task
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.parameters import Foot, Vector
from lean_yaw_env.rendering.scene import Goal
from lean_yaw_env.walker import Walker

_SAMPLES = 8  # of the centre of mass's path, in each step


@dataclass(frozen=True)
class RecordedEpisode:
    """Where an episode went and what was asked of it; ``rendering.draw_footprints`` draws it.

    Attributes
    ----------
    footprints : shape (n, 2)
        (downhill, right).
    headings : shape (n,)
        rad.
    stances : n of "left" or "right"
    path : shape (m, 4)
        The centre of mass: (time, downhill, up, right).
    commands : (step, heading) of every commanded heading
        It was given at ``footprints[step]``; rad. Empty for tasks without one.
    fall : the way it fell, or None
    terminated : whether a fall or the task's own end cut it short
    goals : those reached and, last, the one in force
        Empty for tasks without goals.
    reference_path : shape (k, 2), optional
        The path to be followed: (downhill, right).
    """

    footprints: Vector
    headings: Vector
    stances: tuple[Foot, ...]
    path: Vector
    commands: tuple[tuple[int, float], ...]
    fall: str | None
    terminated: bool = False
    goals: tuple[Goal, ...] = ()
    reference_path: Vector | None = None


def record_episode(
    agent: Agent,
    task: str,
    *,
    seed: int,
    options: EnvOptions | None = None,
    most_steps: int = 10_000,
) -> RecordedEpisode:
    """Record an episode of an environment's seed, or its first steps, as an agent leads it.

    With randomised bodies the path between heel strikes is the nominal body's.
    """
    chosen = EnvOptions() if options is None else options
    env = WalkerEnv(task, **vars(chosen))
    walker = Walker(env.rows.parameters)
    observation, info = env.reset(seed=seed)
    attach(agent, env)
    infos, paths = [info], []
    places = [_goal_place(env)]
    state: State = None
    terminated = ends = False
    while not ends and len(infos) <= most_steps:
        begins = np.array(len(infos) == 1)
        action, state = agent.predict(observation, state, begins, True)
        before = info
        observation, _, terminated, truncated, info = env.step(action)
        paths.append(_path(walker, before, info))
        ends = terminated or truncated
        if info["fall"] is None:
            infos.append(info)
            places.append(_goal_place(env))
    memory = env.rows.memory[0].copy()
    env.close()
    return RecordedEpisode(
        footprints=np.array([seen["footprint"] for seen in infos]),
        headings=np.array([seen["state"][0] for seen in infos]),
        stances=tuple(_foot(seen) for seen in infos),
        path=np.concatenate(paths) if paths else np.empty((0, 4)),
        commands=_commands(infos),
        fall=info["fall"],
        terminated=bool(terminated),
        goals=_goals(places, env.rows.task.goal_radius),
        reference_path=_reference_path(env.rows.task, memory),
    )


def _goal_place(env: WalkerEnv) -> tuple[float, float] | None:
    columns = env.rows.task.goal_columns
    if columns is None:
        return None
    downhill, right = env.rows.memory[0, list(columns)]
    return float(downhill), float(right)


def _goals(places: list[tuple[float, float] | None], radius: float) -> tuple[Goal, ...]:
    distinct = [place for place in dict.fromkeys(places) if place is not None]
    return tuple(
        Goal(*place, radius, reached=k < len(distinct) - 1) for k, place in enumerate(distinct)
    )


def _reference_path(task: Task, memory: Vector) -> Vector | None:
    return None if task.reference_path is None else task.reference_path(memory)


def _foot(info: dict[str, Any]) -> Foot:
    return "left" if info["stance_side"] > 0.0 else "right"


def _path(walker: Walker, before: dict[str, Any], after: dict[str, Any]) -> Vector:
    """The centre of mass's path in the step between two infos, walked once more from the first."""
    path = walker.walk(
        1,
        state=before["state"],
        stance=_foot(before),
        inter_leg_angle=after["inter_leg_angle"],
        mass_offset=after["commanded_offset"],
        previous_offset=before["mass_offset"],
        samples_per_step=_SAMPLES,
    ).path
    downhill, right = before["footprint"]
    return path + np.array([before["time"], downhill, 0.0, right])


def _commands(infos: list[dict[str, Any]]) -> tuple[tuple[int, float], ...]:
    headings = [info.get("commanded_heading") for info in infos]
    return tuple(
        (step, heading)
        for step, heading in enumerate(headings)
        if heading is not None and (step == 0 or heading != headings[step - 1])
    )
