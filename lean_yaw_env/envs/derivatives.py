"""Exact derivatives of an environment's step, through the formulas of its motion, reward and observation.

Complex numbers carry them: an imaginary part of 1e-30 on one input gives imaginary parts 1e-30 times the derivatives, to round-off and
without a difference of nearby numbers. The walking step's own come from ``kernel.jacobian``.

Inputs are what a step's result depends on: the walker's ``FOLLOWED`` fields before the step, its slope where that varies, the task's fields
of which ``is_followed`` is set, then what is commanded (``COMMANDED``). Outputs are the followed fields after the step, the observation, the
reward, the duration. Of the step across the horizon, reward and duration count to the horizon, whose distance in time is taken as given.

``differentiate`` is a template, as ``outputs.write_outputs`` is.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lean_yaw_env.envs.dynamics import move
from lean_yaw_env.envs.formulas import counted_time
from lean_yaw_env.envs.observation import (
    ANKLE_RATE,
    COMMON_CENTRES,
    COMMON_ODD,
    COMMON_SCALES,
    OBSERVATION_LIMIT,
    PITCH_RATE,
    STANCE_FOOT,
    common_values,
    mirror_sign,
)
from lean_yaw_env.envs.outputs import compiled_for
from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.envs.state import (
    BODY_SIZE,
    SLOPE,
    WALKER_FIELDS,
    Field,
    record_type,
    states_of,
)
from lean_yaw_env.envs.tasks import Task
from lean_yaw_env.kernel.compilation import borrowed, formula, written_formula
from lean_yaw_env.kernel.jacobian import INPUTS, OUTPUTS, step_jacobians
from lean_yaw_env.kernel.records import STEPPED, Command, Outcome
from lean_yaw_env.parameters import STATE_FIELDS, STATE_SIZE, Vector
from lean_yaw_env.threads import share_out

FOLLOWED = (*(field.name for field in STATE_FIELDS), "mass_offset", "place_x", "place_z")
COMMANDED = ("inter_leg_angle", "commanded_offset", "effort")
TINY = 1e-30
_KERNEL_INPUTS = {name: k for k, name in enumerate(INPUTS)} | {
    "commanded_offset": INPUTS.index("mass_offset"),
    "mass_offset": INPUTS.index("previous_offset"),
}
"""The walking step's input that a field is: the offset in force is the one before the step."""


def _tables(task: Task) -> dict[str, Any]:
    """What ``differentiate`` takes of a task: formulas that copy, seed and read records."""
    fields = task.fields
    seeds = [("walker", name) for name in _followed_of_walker(task)]
    seeds += [("task", name) for name in _followed(fields)]
    followed_size = len(seeds)
    seeds += [("walker", name) for name in COMMANDED]
    kernel = [_KERNEL_INPUTS.get(name, -1) for _, name in seeds]
    return {
        "COPY_WALKER": _copy(WALKER_FIELDS),
        "COPY_TASK": _copy(fields),
        "SEED": written_formula(
            "seed",
            ("walker", "task", "k"),
            [
                f"if k == {k}: {record}.{name} = complex({record}.{name}.real, {TINY})"
                for k, (record, name) in enumerate(seeds)
            ],
        ),
        "READ": written_formula(
            "read",
            ("column", "walker", "task"),
            [
                f"column[{k}] = {record}.{name}.imag / {TINY}"
                for k, (record, name) in enumerate(seeds[:followed_size])
            ],
        ),
        "KERNEL_INPUTS": tuple(kernel),
        "FOLLOWED_SIZE": followed_size,
        "WALKER_TYPE": record_type(WALKER_FIELDS, "c16"),
        "TASK_TYPE": record_type(fields, "c16"),
    }


def _followed_of_walker(task: Task) -> tuple[str, ...]:
    """Names of the fields of a walker's record that derivatives lead through at a task."""
    return (*FOLLOWED, "slope") if task.slope_varies else FOLLOWED


def _followed(fields: Sequence[Field]) -> tuple[str, ...]:
    """Names of the fields of a task's record that derivatives lead through."""
    return tuple(field.name for field in fields if field.is_followed)


def _copy(fields: Sequence[Field]) -> Any:
    """The formula ``copy(target, source)`` of a record with these fields."""
    places = [field.name for field in fields if field.size == 1]
    places += [f"{each.name}[{k}]" for each in fields if each.size > 1 for k in range(each.size)]
    lines = [f"target.{place} = source.{place}" for place in places]
    return written_formula("copy", ("target", "source"), lines or ["pass"])


TASK_REWARD: Any = None
TASK_REFRESH: Any = None
TASK_FEATURES: Any = None
CENTRES, SCALES, ODD = COMMON_CENTRES, COMMON_SCALES, COMMON_ODD
COPY_WALKER: Any = None
COPY_TASK: Any = None
SEED: Any = None
READ: Any = None
KERNEL_INPUTS: tuple[int, ...] = ()
FOLLOWED_SIZE = len(FOLLOWED)
WALKER_TYPE: Any = None
TASK_TYPE: Any = None


@formula
def carrying(value: Any, steps: Any, row: int, column: int) -> Any:
    """A walking step's output with its derivative by one input, of which ``column`` is -1 if the step does not see it."""
    return complex(value, TINY * steps[row, column] if column >= 0 else 0.0)


@formula
def step_outcome(before: Any, after: Any, steps: Any, column: int) -> Any:
    """The completed step's outcome, with derivatives by one input. ``steps`` holds the rows of ``kernel.jacobian.OUTPUTS``."""
    return Outcome(
        carrying(after.heading, steps, 0, column),
        carrying(after.stance_pitch, steps, 1, column),
        carrying(after.ankle_angle, steps, 2, column),
        carrying(after.stance_pitch_rate - after.pitch_push, steps, 3, column),
        carrying(after.ankle_rate - after.ankle_push, steps, 4, column),
        STEPPED,
        carrying(after.duration, steps, 5, column),
        carrying(after.place_x - before.place_x, steps, 6, column),
        carrying(after.place_z - before.place_z, steps, 7, column),
        0.0,
        carrying(after.mass_offset, steps, 8, column),
        0.0,
        0.0,
        0.0,
        carrying(after.shift_work, steps, 9, column),
        0.0,
        0.0,
        0.0,
    )


def read_observation(column, walker, task, settings):
    """Write the observation's derivatives below those of the followed fields; return the row after them."""
    row = FOLLOWED_SIZE
    sign = mirror_sign(walker, settings)
    values = common_values(walker, settings) + TASK_FEATURES(walker, task)
    for k in range(len(values)):
        if k == STANCE_FOOT and settings.mirror != 0:
            continue
        value = sign * values[k] if ODD[k] else values[k]
        shown = (value - CENTRES[k]) / SCALES[k]
        is_rate = k in (PITCH_RATE, ANKLE_RATE)
        hides = abs(shown.real) > OBSERVATION_LIMIT or (is_rate and settings.hidden_rates != 0)
        column[row] = 0.0 if hides else shown.imag / TINY
        row += 1
    if settings.show_body != 0:
        column[row + SLOPE] = walker.slope.imag / settings.body_reach[SLOPE] / TINY
        row += BODY_SIZE
    return row


def differentiate(befores, tasks_before, walkers, tasks, settings, steps, jacobians, first, last):
    """Write the derivatives of the last step of walkers ``first`` to ``last`` - 1; of one that fell, zeros.

    Parameters
    ----------
    befores, tasks_before : records (n,), before the step
    walkers, tasks : records (n,), after it
    settings : records (1,)
    steps : (n, outputs, inputs), of the walking step: ``kernel.jacobian``
    jacobians : (n, followed + observation + 2, followed + 3), written
    """
    befores, tasks_before, walkers = borrowed(befores), borrowed(tasks_before), borrowed(walkers)
    tasks, settings, steps = borrowed(tasks), borrowed(settings), borrowed(steps)
    jacobians = borrowed(jacobians)
    common = settings[0]
    own_walker, own_task = np.empty(1, WALKER_TYPE), np.empty(1, TASK_TYPE)
    walker, task = own_walker[0], own_task[0]
    for i in range(first, last):
        if walkers[i].fall != 0:
            for row in range(jacobians.shape[1]):
                for k in range(jacobians.shape[2]):
                    jacobians[i, row, k] = 0.0
            continue
        for k in range(len(KERNEL_INPUTS)):
            COPY_WALKER(walker, befores[i])
            COPY_TASK(task, tasks_before[i])
            walker.inter_leg_angle = walkers[i].inter_leg_angle
            walker.commanded_offset = walkers[i].commanded_offset
            walker.effort = walkers[i].effort
            SEED(walker, task, k)
            outcome = step_outcome(befores[i], walkers[i], steps[i], KERNEL_INPUTS[k])
            move(walker, outcome, common.horizon)
            walker.stance_pitch_rate += walkers[i].pitch_push
            walker.ankle_rate += walkers[i].ankle_push
            column = jacobians[i, :, k]
            reward = walker.share * TASK_REWARD(walker, task)
            # what the task asks next is drawn, and no derivative leads through a draw
            COPY_TASK(task, tasks[i])
            TASK_REFRESH(walker, task)
            READ(column, walker, task)
            row = read_observation(column, walker, task, common)
            column[row] = reward.imag / TINY
            column[row + 1] = counted_time(walker).imag / TINY


class LinearisedSteps:
    """Exact derivatives of a simulation's steps.

    Call ``prepare`` before a step and ``jacobians`` after it, before any walker is reset.

    Parameters
    ----------
    simulation : Simulation
    threads : int >= 1

    Attributes
    ----------
    followed : names of the fields that a step's result depends on, of the walker's record and then the task's
    inputs : names of the Jacobians' columns: the followed fields before the step, and what was commanded
    outputs : names of their rows: the followed fields after it, the observation, ``reward``, ``duration``
    """

    def __init__(self, simulation: Simulation, *, threads: int = 1) -> None:
        self._simulation = simulation
        self._threads = threads
        task = simulation.task
        observed = simulation.options.observation_names(task)
        self.followed = (*_followed_of_walker(task), *_followed(task.fields))
        self.inputs = (*self.followed, *COMMANDED)
        self.outputs = (*self.followed, *observed, "reward", "duration")
        n = simulation.n
        self._differentiate = compiled_for(
            task, differentiate, (read_observation,), lambda: _tables(task)
        )
        self._before = simulation.walkers.copy(), simulation.tasks.copy()
        self._afters = np.zeros(n), np.zeros((n, STATE_SIZE))
        last = "slope" if task.slope_varies else Command._fields[-1]
        self._steps = np.zeros((n, len(OUTPUTS), INPUTS.index(last) + 1))

    def prepare(self) -> None:
        """Note the records before a step."""
        walkers, tasks = self._before
        walkers[:], tasks[:] = self._simulation.walkers, self._simulation.tasks

    def values(self) -> Vector:
        """The followed fields as they are, shape (n, followed)."""
        walkers, tasks = self._simulation.walkers, self._simulation.tasks
        names = walkers.dtype.names or ()
        return np.column_stack(
            [(walkers if name in names else tasks)[name] for name in self.followed]
        )

    def jacobians(self) -> Vector:
        """The derivatives of the step since ``prepare``, shape (n, outputs, inputs), in a fresh array; zeros for a step that was a fall."""
        simulation = self._simulation
        before, tasks_before = self._before
        walkers = simulation.walkers
        commands = [walkers["inter_leg_angle"], walkers["commanded_offset"], before["mass_offset"]]
        given = (
            np.column_stack(commands),
            np.ascontiguousarray(states_of(before)),
            np.ascontiguousarray(before["side"]),
        )
        found = np.zeros((simulation.n, len(self.outputs), len(self.inputs)))

        def share(first: int, last: int) -> None:
            step_jacobians(simulation.bodies, *given, *self._afters, self._steps, first, last)
            self._differentiate(
                before, tasks_before, walkers, simulation.tasks, simulation.settings,
                self._steps, found, first, last,
            )  # fmt: skip

        share_out(share, simulation.n, self._threads)
        return found
