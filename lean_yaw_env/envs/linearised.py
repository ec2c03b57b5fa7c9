"""The derivatives of the steps that a simulation makes, one Jacobian for each walker."""

from __future__ import annotations

import numpy as np

from lean_yaw_env.envs.derivatives import COMMANDED, FOLLOWED, followed_fields
from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.envs.state import states_of
from lean_yaw_env.kernel.jacobian import OUTPUTS, step_jacobians
from lean_yaw_env.kernel.records import Command
from lean_yaw_env.parameters import STATE_SIZE, Vector
from lean_yaw_env.threads import share_out


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
        own = followed_fields(simulation.task.fields)
        observed = simulation.options.observation_names(simulation.task)
        self.followed = (*FOLLOWED, *own)
        self.inputs = (*self.followed, *COMMANDED)
        self.outputs = (*self.followed, *observed, "reward", "duration")
        n = simulation.n
        self._before = simulation.walkers.copy(), simulation.tasks.copy()
        self._afters = np.zeros(n), np.zeros((n, STATE_SIZE))
        self._steps = np.zeros((n, len(OUTPUTS), STATE_SIZE + len(Command._fields)))

    def prepare(self) -> None:
        """Note the records before a step."""
        walkers, tasks = self._before
        walkers[:], tasks[:] = self._simulation.walkers, self._simulation.tasks

    def values(self) -> Vector:
        """The followed fields as they are, shape (n, followed)."""
        walkers, tasks = self._simulation.walkers, self._simulation.tasks
        own = self.followed[len(FOLLOWED) :]
        columns = [walkers[name] for name in FOLLOWED] + [tasks[name] for name in own]
        return np.column_stack(columns)

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
            simulation.task.differentiate(
                before, tasks_before, walkers, simulation.tasks, simulation.settings,
                self._steps, found, first, last,
            )  # fmt: skip

        share_out(share, simulation.n, self._threads)
        return found
