"""A walker and its agent as one dynamical system: the map from heel strike to heel strike, and its derivatives.

The map is the environment's own step, with its observation, its mirror convention and its limits on actions; what a task commands is held.
Its state is all that the next step depends on: the section state, the mass offset in force, the heading of the footprint before (tasks show
the mean of two) and, of some tasks, one coordinate more. Derivatives are the exact ones of the walking step composed with differences of the
agent's commands: agents compute in single precision, in which a difference over a small step is noise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agents.agent import Agent, Planner
from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.rows import WalkerRows
from lean_yaw_env.envs.tasks import heading, speedheading, task_named, waypoint
from lean_yaw_env.envs.transition import OFFSET_SCALE, STATE_SCALES
from lean_yaw_env.errors import FellError
from lean_yaw_env.kernel.jacobian import OUTPUTS, step_jacobian
from lean_yaw_env.kernel.records import STEPPED, Command
from lean_yaw_env.parameters import STATE_FIELDS, STATE_SIZE, Foot, Vector
from lean_yaw_env.walker import SIDE, Walker

OFFSET, PREVIOUS_HEADING, EXTRA = STATE_SIZE, STATE_SIZE + 1, STATE_SIZE + 2
"""Where the state holds what the section does not."""

GOAL_AHEAD = 12.0
"""Leg lengths from the walker at which a goal is held: the middle of the distances at which they are set."""
COARSEST, SIZES = 0.25, 14
"""The differences' largest step, in units of the observation, and how many there are, each half the one before."""
ROUNDING = 2.0**-24
"""Of a number between a half and one in single precision."""
_DURATION, _X, _Z, _OFFSET = (OUTPUTS.index(name) for name in ("duration", "displacement_x", "displacement_z", "mass_offset"))  # fmt: skip


@dataclass(frozen=True)
class Extra:
    """One coordinate more that a task's observations depend on.

    Attributes
    ----------
    name : str
    column : of the environment's memory
    scale : of its differences, as large as the observation's
    row : from the state before, a step's outputs (``kernel.jacobian.OUTPUTS``) and their derivatives (outputs, k + 2) by the state and the
        two commands, its own derivatives (k + 2,)
    """

    name: str
    column: int
    scale: float
    row: Callable[[Vector, Vector, Vector], Vector]


def _last_speed(state: Vector, outputs: Vector, rows: Vector) -> Vector:
    """Of the advance along the mean heading of the two footprints, over the step's duration."""
    duration, x, z = outputs[[_DURATION, _X, _Z]]
    mean = 0.5 * (state[0] + outputs[0])
    by_mean = 0.5 * rows[0]
    by_mean[0] += 0.5
    cosine, sine = math.cos(mean), math.sin(mean)
    speed = (x * cosine - z * sine) / duration
    by_advance = rows[_X] * cosine - rows[_Z] * sine - (x * sine + z * cosine) * by_mean
    return (by_advance - speed * rows[_DURATION]) / duration


def _aside(state: Vector, outputs: Vector, rows: Vector) -> Vector:
    found = rows[_Z].copy()
    found[EXTRA] += 1.0
    return found


EXTRAS = {
    "SpeedHeading": Extra("last_speed", speedheading.LAST_SPEED, 0.1, _last_speed),
    "Slalom": Extra("aside", c.PLACE_Z, 1.0, _aside),
}
"""By task. A path is held straight downhill, and the walker's place beside it counts."""


@dataclass(frozen=True)
class Commands:
    """What an agent commands in a state, with its slopes.

    Attributes
    ----------
    values : shape (2,)
        Inter-leg angle and mass offset, in space.
    slopes, errors : shape (2, k)
        Derivatives by the state, and how far they are to be trusted.
    """

    values: Vector
    slopes: Vector
    errors: Vector


@dataclass(frozen=True)
class Linearised:
    """The derivatives of a step of the closed loop.

    Attributes
    ----------
    matrix, error : shape (k, k)
        The Jacobian, and a bound of what the differences leave uncertain in it.
    """

    matrix: Vector
    error: Vector


class ClosedLoop:
    """A walker led by an agent through a task whose command is held.

    Parameters
    ----------
    agent : Agent
        One that answers the same observation always the same.
    task : str
    options : EnvOptions
        The environment's; pushes are off and there is no time limit.
    commands : by the task's reset options, what is commanded; otherwise straight downhill, and the middle of the range of speeds

    Attributes
    ----------
    coordinates : names of the state's numbers
    start : shape (k,)
        The gait that the task's episodes start near, on the left foot.
    largest_change : of the mass offset in a step, leg lengths

    Raises
    ------
    ValueError
        If the agent plans, remembers or draws, if the options add noise, delay or random bodies, or a command is not one of the task.
    """

    def __init__(
        self,
        agent: Agent,
        task: str,
        options: EnvOptions | None = None,
        *,
        commands: Mapping[str, float] | None = None,
    ) -> None:
        chosen = EnvOptions() if options is None else options
        if chosen.sensor_noise or chosen.action_delay or chosen.random_body is not None:
            raise ValueError(
                "options must have no sensor_noise, action_delay or random_body for a closed loop that is one map of the state"
            )
        self.agent = agent
        self.task = task_named(task)
        self.options = replace(chosen, horizon=math.inf, push_level=0.0, start_disturbance=0.0)
        self.walker = Walker(self.options.walker_parameters(self.task))
        change = self.options.max_offset_change
        self.largest_change = self.task.max_offset_change if change is None else change
        self.extra = EXTRAS.get(task)
        self.coordinates = (
            *(field.name for field in STATE_FIELDS),
            "mass_offset",
            "previous_heading",
            *((self.extra.name,) if self.extra else ()),
        )
        self._columns = [*range(STATE_SIZE), c.OFFSET, c.PREVIOUS_HEADING]
        scales = [*STATE_SCALES, OFFSET_SCALE, STATE_SCALES[0]]
        if self.extra:
            self._columns.append(self.extra.column)
            scales.append(self.extra.scale)
        self._scales = np.array(scales)
        self._template = self._commanded_memory(dict(commands or {}))
        self.start = self._template[self._columns]
        self._require_one_answer()

    def placed(self, states: Vector, sides: Vector | float) -> WalkerRows:
        """Walkers in these states (n, k), on the left (+1) or right (-1) foot, and what they observe."""
        rows = WalkerRows(self.task, self.options, len(states))
        rows.memory[:] = self._template
        rows.memory[:, self._columns] = states
        rows.memory[:, c.SIDE] = sides
        self._observe(rows)
        return rows

    def advance(self, rows: WalkerRows, walking: NDArray[np.bool_]) -> None:
        """Walk a step with those that walk; the outcomes say how it ended."""
        seen = rows.observations[walking]
        starts = np.zeros(len(seen), dtype=np.bool_)
        rows.actions[walking] = self.agent.predict(seen, None, starts, True)[0]
        rows.step_many(~walking, 0, rows.n)
        if self.task.goal_columns is not None:
            self._observe(rows)

    def states(self, rows: WalkerRows) -> Vector:
        """The states (n, k) of walkers."""
        return rows.memory[:, self._columns].copy()

    def commands(self, state: Vector, foot: Foot) -> Commands:
        """The agent's commands in a state, with derivatives by central differences.

        Each derivative is extrapolated from two step sizes, at the size where those beside it agree best: larger ones see the curve, and
        limits, of the agent's law, smaller ones its rounding to single precision. How far they agree, and the rounding, is the error.
        """
        size = len(state)
        steps = COARSEST * 0.5 ** np.arange(SIZES)[:, None] * self._scales
        offsets = steps[:, :, None] * np.eye(size)  # (sizes, k, k)
        both = np.concatenate([offsets, -offsets]).reshape(-1, size)
        found = self._commands_at(np.vstack([state, state + both]), foot)
        values, sides = found[0], found[1:].reshape(2, SIZES, size, 2)
        central = (sides[0] - sides[1]) / (2.0 * steps[:, :, None])
        better = (4.0 * central[1:] - central[:-1]) / 3.0
        apart = np.abs(np.diff(better, axis=0))
        reaches = [self.options.inter_leg_angle_range, self.options.mass_offset_range]
        rounded = ROUNDING * np.array(reaches) / steps[2:-1, :, None]
        spread = np.maximum(apart[:-1], apart[1:]) + rounded
        best = spread.argmin(axis=0)[None]
        slopes = np.take_along_axis(better[1:-1], best, axis=0)[0]
        errors = np.take_along_axis(spread, best, axis=0)[0]
        return Commands(values, slopes.T, errors.T)

    def linearise(self, state: Vector, foot: Foot) -> Linearised:
        """A step with its Jacobian.

        Raises
        ------
        FellError
            If the walker does not complete the step.
        """
        asked = self.commands(state, foot)
        size = len(state)
        outputs, rows = self._exact(state, foot, asked.values)
        found = np.zeros((size, size + 2))
        found[:STATE_SIZE] = rows[:STATE_SIZE]
        found[OFFSET] = rows[_OFFSET]
        found[PREVIOUS_HEADING, 0] = 1.0
        if self.extra:
            found[EXTRA] = self.extra.row(state, outputs, rows)
        by_state, by_command = found[:, :size], found[:, size:]
        return Linearised(by_state + by_command @ asked.slopes, np.abs(by_command) @ asked.errors)

    def _exact(self, state: Vector, foot: Foot, command: Vector) -> tuple[Vector, Vector]:
        """A walking step's outputs, and their exact derivatives (outputs, k + 2) by the state and the two commands."""
        body = self.walker.parameters.body()
        given = Command(float(command[0]), float(command[1]), float(state[OFFSET]))
        status, outputs, rows = step_jacobian(body, given, state[:STATE_SIZE], SIDE[foot], inputs=8)
        if status != STEPPED:
            raise FellError(f"the walker fell in the step on its {foot} foot")
        wide = np.zeros((len(OUTPUTS), len(state) + 2))
        wide[:, :STATE_SIZE] = rows[:, :STATE_SIZE]
        wide[:, OFFSET] = rows[:, 7]
        wide[:, -2:] = rows[:, 5:7]
        return outputs, wide

    def _commands_at(self, states: Vector, foot: Foot) -> Vector:
        """Inter-leg angles and mass offsets (n, 2) that the environment makes of the agent's actions."""
        rows = self.placed(states, 1.0 if foot == "left" else -1.0)
        self.advance(rows, np.ones(rows.n, dtype=np.bool_))
        return rows.memory[:, [c.INTER_LEG_ANGLE, c.COMMANDED_OFFSET]]

    def _observe(self, rows: WalkerRows) -> None:
        columns = self.task.goal_columns
        if columns is not None:
            _hold_goal(rows.memory, columns)
        rows.task.start_many(
            rows.bodies, rows.memory, rows.stream, rows.settings, rows.observations,
            np.arange(rows.n), False,
        )  # fmt: skip

    def _commanded_memory(self, commands: dict[str, float]) -> Vector:
        """A row of memory at the start of an episode on the left foot, with what is commanded and no end of it."""
        task = self.task
        held = {name: 0.5 * (each.low + each.high) for name, each in task.commands.items()}
        held.pop("goal", None)
        for name in commands:
            if name not in held:
                raise ValueError(
                    f"commands must be among {', '.join(held) or 'none'} (task {task.name}), not {name!r}"
                )
        rows = WalkerRows(task, self.options, 1)
        held |= commands
        rows.start(np.array([0]), [np.random.default_rng(0)])
        rows.place(np.array([0]), {"stance": "left", **held})
        memory = rows.memory[0].copy()
        memory[c.STEPS] = 1.0  # as in the middle of a walk
        if task.command_column is not None:
            memory[heading.STEPS_LEFT] = math.inf
        if task.reference_path is not None:
            memory[c.TASK :] = 0.0  # waves of no height: straight downhill
        return memory

    def _require_one_answer(self) -> None:
        """Refuse agents that plan, remember or draw: with them the map would be one of more than the state, or of chance."""
        if isinstance(self.agent, Planner):
            raise ValueError(
                "agent must answer from its observation alone, but it plans on the environment"
            )
        rows = self.placed(np.array([self.start]), 1.0)
        answers = [
            self.agent.predict(rows.observations, None, np.array([k == 0]), True) for k in range(2)
        ]
        if any(memory is not None for _, memory in answers):
            raise ValueError("agent must remember nothing, but its predict returns a state")
        if not np.array_equal(answers[0][0], answers[1][0]):
            raise ValueError("agent must answer the same observation the same, but it draws")


def _hold_goal(memory: Vector, columns: tuple[int, int]) -> None:
    """Put the goal straight downhill of each walker's middle, as far as ever: it is never reached."""
    aside = 0.5 * memory[:, c.SIDE] * memory[:, c.BODY]
    memory[:, columns[0]] = memory[:, c.PLACE_X] + aside * np.sin(memory[:, c.HEADING]) + GOAL_AHEAD
    memory[:, columns[1]] = memory[:, c.PLACE_Z] + aside * np.cos(memory[:, c.HEADING])
    memory[:, waypoint.GOAL_DISTANCE] = GOAL_AHEAD
