"""One episode recorded step by step, and drawn as footprints from above: agents side by side on the same episode."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator

from lean_yaw_env.envs.info import FallCode
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.parameters import Foot, Vector, WalkerParameters
from lean_yaw_env.rendering.figures import save_figure
from lean_yaw_env.rendering.palette import COMMAND, GOAL, REFERENCE, unit_colour
from lean_yaw_env.rendering.picture import footprint_figure
from lean_yaw_env.rendering.scene import Goal
from lean_yaw_env.walker import Walker

from ..agent import Agent, State, attach

PICTURED_STEPS = 120
"""Steps of an episode that are drawn: two or three commands, at a scale at which footprints can be told apart."""
_SAMPLES = 8  # of the centre of mass's path, in each step
_DPI = 110  # as sharp as a page shows it, and a small file
_ARROW = 4.0  # leg lengths, of a commanded heading


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
    body : WalkerParameters
        The walker of the episode: with random bodies, the one that was drawn.
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
    body: WalkerParameters = field(default_factory=WalkerParameters)


def record_episode(
    agent: Agent,
    task: str,
    *,
    seed: int,
    options: EnvOptions | None = None,
    most_steps: int = 10_000,
) -> RecordedEpisode:
    """Record an episode of an environment's seed, or its first steps, as an agent leads it."""
    chosen = EnvOptions() if options is None else options
    env = WalkerEnv(task, **vars(chosen))
    observation, info = env.reset(seed=seed)
    walker = Walker(env.simulation.body_parameters(0))  # a random body is drawn by the reset
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
        if info["fall"] == FallCode.NONE:
            infos.append(info)
            places.append(_goal_place(env))
    path = _reference_path(env)
    env.close()
    return RecordedEpisode(
        footprints=np.array([seen["footprint"] for seen in infos]),
        headings=np.array([seen["state"][0] for seen in infos]),
        stances=tuple(_foot(seen) for seen in infos),
        path=np.concatenate(paths) if paths else np.empty((0, 4)),
        commands=_commands(infos),
        fall=FallCode(info["fall"]).word,
        terminated=bool(terminated),
        goals=_goals(places, env.task.goal_radius),
        reference_path=path,
        body=walker.parameters,
    )


def _goal_place(env: WalkerEnv) -> tuple[float, float] | None:
    fields = env.task.goal_fields
    if fields is None:
        return None
    downhill, right = (float(env.simulation.tasks[name][0]) for name in fields)
    return downhill, right


def _goals(places: list[tuple[float, float] | None], radius: float) -> tuple[Goal, ...]:
    distinct = [place for place in dict.fromkeys(places) if place is not None]
    return tuple(
        Goal(*place, radius, reached=k < len(distinct) - 1) for k, place in enumerate(distinct)
    )


def _reference_path(env: WalkerEnv) -> Vector | None:
    path = env.task.reference_path
    return None if path is None else path(*env.simulation.records(0))


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


def save_agents_footprints(
    agents: Mapping[str, Agent],
    task: str,
    path: Path,
    *,
    seed: int,
    options: EnvOptions | None = None,
) -> None:
    """Draw the first steps of one episode, of an environment's seed, for each agent, all to one scale.

    Arrows show commanded headings where they were given, circles goals (full: reached), a broad line the path to be followed.
    """
    episodes = {
        name: record_episode(agent, task, seed=seed, options=options, most_steps=PICTURED_STEPS)
        for name, agent in agents.items()
    }
    titled = {_title(name, episode): episode for name, episode in episodes.items()}
    goals = [(goal.downhill, goal.right) for each in titled.values() for goal in each.goals]
    # the same episode has the same body, whoever acts
    radius = next(iter(titled.values())).body.foot_radius
    figure, panels = footprint_figure(titled, foot_radius=radius, places=goals)
    for panel, episode in zip(panels, titled.values(), strict=True):
        _draw_task(panel, episode)
        panel.xaxis.set_major_locator(MaxNLocator(5, integer=True))
        panel.yaxis.set_major_locator(MaxNLocator(8, integer=True))
    save_figure(figure, path, dpi=_DPI)


def _title(name: str, episode: RecordedEpisode) -> str:
    if episode.fall is not None:
        return f"{name} (fell)"
    return f"{name} (ended early)" if episode.terminated else name


def _draw_task(axes: Axes, episode: RecordedEpisode) -> None:
    """What was asked for: headings, goals, a path."""
    for step, heading in episode.commands:
        _draw_command(axes, episode.footprints[step], heading)
    if episode.reference_path is not None:
        downhill, right = episode.reference_path.T
        axes.plot(right, downhill, color=unit_colour(REFERENCE), linewidth=3.0, alpha=0.45, zorder=0.5)  # fmt: skip
    for goal in episode.goals:
        colour = unit_colour(GOAL)
        axes.add_patch(
            Circle(
                (goal.right, goal.downhill),
                goal.radius,
                facecolor=colour if goal.reached else "none",
                edgecolor=colour,
                linewidth=1.5,
            )
        )


def _draw_command(axes: Axes, footprint: Vector, heading: float) -> None:
    """An arrow from a footprint towards a heading; a positive one is to the left."""
    downhill, right = footprint
    tip = (right - _ARROW * np.sin(heading), downhill + _ARROW * np.cos(heading))
    axes.annotate(
        "",
        xy=tip,
        xytext=(right, downhill),
        arrowprops={"arrowstyle": "-|>", "color": unit_colour(COMMAND), "linewidth": 1.5},
    )
