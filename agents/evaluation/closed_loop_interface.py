"""An agent at a task as a closed loop: what the environment shows of a state, and what it makes of an action."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.analysis import ClosedLoopMap
from lean_yaw_env.analysis.closed_loop_map import Numbers
from lean_yaw_env.analysis.section_map import Motion
from lean_yaw_env.envs.formulas import advance, place
from lean_yaw_env.envs.observation import OFFSET_SCALE, STATE_SCALES
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.envs.state import as_records
from lean_yaw_env.envs.tasks import Task, task_named
from lean_yaw_env.parameters import STATE_FIELDS, Foot, Vector
from lean_yaw_env.validation import require_choice
from lean_yaw_env.walker import SIDE, Walker

from ..agent import Agent, Planner

GOAL_AHEAD = 12.0
"""Leg lengths from the walker at which a goal is held: the middle of the distances at which they are set."""
_FIELDS = (*(field.name for field in STATE_FIELDS), "mass_offset")
"""Of a walker's record, what every state begins with."""


class Remembered(NamedTuple):
    """A coordinate that observations depend on beside the section state and the offset."""

    field: str
    """Of a walker's record."""
    motion: Motion
    scale: float
    """A change that an observation shows as about one."""
    after: Callable[[Numbers, Mapping[str, Numbers]], Numbers]
    """Its value after steps, from states (n, k) before them and the steps' outputs (n,) by name."""


def _speed(states: Numbers, outputs: Mapping[str, Numbers]) -> Numbers:
    mean_heading = 0.5 * (states[:, 0] + outputs["heading"])
    return advance(outputs["displacement_x"], outputs["displacement_z"], mean_heading) / outputs["duration"]  # fmt: skip


_PREVIOUS_HEADING = Remembered("previous_heading", "heading", STATE_SCALES[0], lambda states, _: states[:, 0])  # fmt: skip
EXTRAS: dict[str, dict[str, Remembered]] = {
    "SpeedHeading": {"last_speed": Remembered("speed", "pitch", 0.1, _speed)},
    "Slalom": {"aside": Remembered("place_z", "heading", 1.0, lambda states, outputs: states[:, -1] + outputs["displacement_z"])},
}  # fmt: skip
"""By task. A path is held straight downhill, and the walker's place beside it counts."""


class TaskInterface:
    """What a task's environment shows of a state, and what it makes of an action, while its command is held; see ``analysis.ControlInterface``.

    The options are without noise, delay and random bodies; the commands are by the task's reset options.
    """

    def __init__(self, task: Task, options: EnvOptions, commands: Mapping[str, float]) -> None:
        self._task, self._options = task, options
        self._coordinates = {"previous_heading": _PREVIOUS_HEADING, **EXTRAS.get(task.name, {})}
        self.remembered: Mapping[str, Motion] = {
            name: each.motion for name, each in self._coordinates.items()
        }
        sees_heading = task.heading_field is not None or task.goal_fields is not None
        self.headings: tuple[str, ...] = () if sees_heading else ("heading", "previous_heading")
        self.scales = np.array(
            [*STATE_SCALES, OFFSET_SCALE, *(each.scale for each in self._coordinates.values())]
        )
        self.reach = np.array([options.inter_leg_angle_range, options.mass_offset_range])
        self._fields = (*_FIELDS, *(each.field for each in self._coordinates.values()))
        self._simulation = self._started(commands)
        # the gait that the task's episodes start near, on the left foot
        self.start = np.array([float(self._first_walker[name][0]) for name in self._fields])

    def observe(self, states: Vector, foot: Foot) -> NDArray[np.float32]:
        """What the environment shows of states (n, k)."""
        simulation = self._placed(states, foot)
        goal = self._task.goal_fields
        if goal is not None:
            downhill, right = place(as_records(simulation.walkers))
            simulation.tasks[goal[0]] = downhill + GOAL_AHEAD
            simulation.tasks[goal[1]] = right
        simulation.observe()
        return simulation.observations.copy()

    def command(self, states: Vector, foot: Foot, actions: NDArray[np.float32]) -> Vector:
        """Inter-leg angles and mass offsets (n, 2) that the environment makes of actions, within its limits."""
        simulation = self._placed(states, foot)
        simulation.actions[:] = actions
        simulation.command()
        walkers = simulation.walkers
        return np.column_stack([walkers["inter_leg_angle"], walkers["commanded_offset"]])

    def remember(self, states: Numbers, outputs: Mapping[str, Numbers]) -> Numbers:
        """What observations depend on beside section state and offset."""
        return np.column_stack([each.after(states, outputs) for each in self._coordinates.values()])

    def _placed(self, states: Vector, foot: Foot) -> Simulation:
        """Walkers in these states, in the middle of a walk, with the command in force."""
        n = len(states)
        if self._simulation.n != n:
            self._simulation = Simulation(self._task, self._options, n)
        simulation = self._simulation
        simulation.walkers[:] = self._first_walker
        simulation.tasks[:] = self._first_task
        for name, column in zip(self._fields, states.T, strict=True):
            simulation.walkers[name] = column
        simulation.walkers["side"] = SIDE[foot]
        return simulation

    def _started(self, commands: Mapping[str, float]) -> Simulation:
        """A walker at the start of an episode on the left foot, with what is commanded."""
        task = self._task
        held = {name: 0.5 * (each.low + each.high) for name, each in task.commands.items()}
        held.pop("goal", None)
        for name in commands:
            require_choice("command", name, tuple(held))
        simulation = Simulation(task, self._options, 1)
        one = np.ones(1, dtype=np.bool_)
        simulation.start(one, [np.random.default_rng(0)])
        simulation.place(one, {"stance": "left", **held, **commands})
        self._first_walker, self._first_task = simulation.walkers.copy(), simulation.tasks.copy()
        self._first_walker["steps"] = 1
        if task.reference_path is not None:
            self._first_task[:] = task.initial  # waves of no height: straight downhill
        return simulation


def closed_loop(
    agent: Agent,
    task: str,
    options: EnvOptions | None = None,
    *,
    commands: Mapping[str, float] | None = None,
) -> ClosedLoopMap:
    """The closed loop of an agent at a task whose command is held.

    Parameters
    ----------
    agent : Agent
        One that answers the same observation always the same.
    task : str
    options : EnvOptions
        The environment's; pushes and time limit play no part.
    commands : by the task's reset options, what is commanded; otherwise straight downhill, and the middle of the range of speeds

    Raises
    ------
    ValueError
        If the agent plans, remembers or draws, if the options add noise, delay or random bodies, or a command is not one of the task.
    """
    chosen = EnvOptions() if options is None else options
    chosen_task = task_named(task)
    has_bodies = chosen.for_task(chosen_task).random_body != "nominal"
    if chosen.sensor_noise or chosen.action_delay or has_bodies or chosen_task.slope_varies:
        raise ValueError(
            "options must have no sensor_noise, action_delay or random_body, and the task one slope, so that the closed loop is one map of the state"
        )
    if isinstance(agent, Planner):
        raise ValueError("agent must answer from its observation alone, but it plans on the environment")  # fmt: skip
    quiet = replace(chosen, push_level=0.0, start_disturbance=0.0)
    interface = TaskInterface(chosen_task, quiet, commands or {})
    _require_one_answer(agent, interface.observe(interface.start[None], "left"))

    def predict(observations: NDArray[np.float32]) -> NDArray[np.float32]:
        return agent.predict(observations, None, np.zeros(len(observations), np.bool_), True)[0]

    walker = Walker(quiet.for_task(chosen_task).parameters)
    return ClosedLoopMap(walker, interface, predict, interface.start)


def _require_one_answer(agent: Agent, observations: NDArray[np.float32]) -> None:
    """Refuse agents that remember or draw: with them the map would be one of more than the state, or of chance."""
    answers = [agent.predict(observations, None, np.array([k == 0]), True) for k in range(2)]
    if any(memory is not None for _, memory in answers):
        raise ValueError("agent must remember nothing, but its predict returns a state")
    if not np.array_equal(answers[0][0], answers[1][0]):
        raise ValueError("agent must answer the same observation the same, but it draws")
