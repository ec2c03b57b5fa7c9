"""The arrays behind an environment, one row per walker, and the calls that move them: the same for one walker and for many."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.info import InfoTable
from lean_yaw_env.envs.options import ACTION_SIZE, EnvOptions
from lean_yaw_env.envs.running import FAILURE, NOT_A_NUMBER
from lean_yaw_env.envs.tasks import Task
from lean_yaw_env.errors import SolverError
from lean_yaw_env.kernel import records
from lean_yaw_env.parameters import MIRROR, STATE_SIZE, require_foot, require_number, require_state
from lean_yaw_env.walker import SIDE

RESET_OPTIONS = ("state", "stance", "command")
_KEYS = 2**64


class WalkerRows:
    """Memory, random streams, observations and rewards of ``n`` walkers at one task."""

    def __init__(self, task: Task, options: EnvOptions, n: int) -> None:
        self.task = task
        self.options = options
        self.n = n
        self.parameters = options.walker_parameters(task)
        self.settings = options.settings(task)
        self.bodies = np.array([self.parameters.body()])
        self.memory = np.zeros((n, c.MEMORY))
        self.stream = np.zeros((n, 2), dtype=np.uint64)
        self.actions = np.zeros((n, ACTION_SIZE), dtype=np.float32)
        self.outcomes = np.zeros((n, c.OUTCOMES))
        self.observations = np.zeros((n, len(options.observation_names(task))), dtype=np.float32)
        self.rewards = np.zeros(n)
        self.terminated = np.zeros(n, dtype=np.bool_)
        self.truncated = np.zeros(n, dtype=np.bool_)
        self.info = InfoTable(task)
        self._step_arguments = (
            self.bodies, self.memory, self.stream, self.settings, self.actions, self.outcomes,
            self.observations, self.rewards, self.terminated, self.truncated,
        )  # fmt: skip
        self._scratch = (np.zeros((n, 3)), np.zeros((n, STATE_SIZE)), np.zeros(n))

    def start(self, rows: NDArray[np.int64], generators: list[np.random.Generator]) -> None:
        """Begin episodes of these rows, each drawing its stream's key from its own generator."""
        for row in rows:
            self.stream[row, 0] = generators[row].integers(_KEYS, dtype=np.uint64)
        self.stream[rows, 1] = 0
        self.outcomes[rows] = 0.0
        self.outcomes[rows, c.OUTCOME_STATUS] = records.STEPPED
        self.rewards[rows] = 0.0
        self.terminated[rows] = False
        self.truncated[rows] = False
        self.task.start_many(self.memory, self.stream, self.settings, self.observations, rows, True)

    def place(self, rows: NDArray[np.int64], options: dict[str, Any]) -> None:
        """Override the drawn start by reset options (``RESET_OPTIONS``); arguments are checked before anything changes."""
        checked = self.check_options(options)
        for row in rows:
            memory = self.memory[row]
            if "side" in checked:
                if memory[c.SIDE] != checked["side"]:
                    memory[:STATE_SIZE] *= MIRROR
                memory[c.SIDE] = checked["side"]
            if "state" in checked:
                memory[:STATE_SIZE] = checked["state"]
            memory[c.PREVIOUS_HEADING] = memory[c.HEADING]
            if "command" in checked:
                memory[self.task.command_column] = checked["command"]
        self.task.start_many(
            self.memory, self.stream, self.settings, self.observations, rows, False
        )

    def check_options(self, options: dict[str, Any]) -> dict[str, Any]:
        """Reset options as numbers, or ``ValueError``."""
        checked: dict[str, Any] = {}
        for key in options:
            if key not in RESET_OPTIONS:
                raise ValueError(f"reset option {key!r} is not one of {', '.join(RESET_OPTIONS)}")
        if "stance" in options:
            checked["side"] = SIDE[require_foot(options["stance"])]
        if "state" in options:
            checked["state"] = require_state(options["state"])
        if "command" in options:
            if self.task.command_column is None:
                raise ValueError(
                    f"reset option 'command': the task {self.task.name} has no command"
                )
            checked["command"] = require_number("command", options["command"], -np.pi, np.pi)
        return checked

    def step_one(self) -> None:
        """Step row 0 by ``actions``."""
        self.raise_for(self.task.step_one(*self._step_arguments))

    def step_many(self, skip: NDArray[np.bool_], first: int, last: int) -> int:
        """Step rows ``first`` to ``last`` - 1 by ``actions``, but for those to skip; return what ``raise_for`` takes."""
        return self.task.step_many(*self._step_arguments, *self._scratch, skip, first, last)

    def raise_for(self, code: int) -> None:
        if code == NOT_A_NUMBER:
            bad = self.actions[~np.isfinite(self.actions).all(axis=1)]
            raise ValueError(f"action must be numbers in [-1, 1], not {bad[0].tolist()}")
        if code == FAILURE:
            row = int(np.flatnonzero(self.outcomes[:, c.OUTCOME_STATUS] == records.FAILED)[0])
            raise SolverError(
                f"the step from {self.memory[row, :STATE_SIZE].tolist()} of {self.parameters} did not converge"
            )
