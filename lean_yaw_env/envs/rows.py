"""The arrays behind an environment, one row per walker, and the calls that move them: the same for one walker and for many."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.info import InfoTable
from lean_yaw_env.envs.options import ACTION_SIZE, BODY_NAMES, EnvOptions
from lean_yaw_env.envs.running import FAILURE, NOT_A_NUMBER
from lean_yaw_env.envs.tasks import Task
from lean_yaw_env.errors import SolverError
from lean_yaw_env.kernel import records
from lean_yaw_env.parameters import (
    MIRROR,
    STATE_SIZE,
    Vector,
    WalkerParameters,
    require_foot,
    require_number,
    require_state,
)
from lean_yaw_env.walker import SIDE

RESET_OPTIONS = ("state", "stance")
"""Of every task; some have commands besides."""
_KEYS = 2**64
_ODD_COLUMNS = (c.OFFSET, c.COMMANDED_OFFSET, c.PENDING_OFFSET)
"""What changes sign, beside the state, in a mirror image of the start."""

_RESULT_BYTES = 10  # a reward and two ends


def _views(buffer: NDArray[np.uint8]) -> tuple[Vector, NDArray[np.bool_], NDArray[np.bool_]]:
    """Rewards, terminated and truncated, side by side in one buffer."""
    n = len(buffer) // _RESULT_BYTES
    return (
        buffer[: 8 * n].view(np.float64),
        buffer[8 * n : 9 * n].view(np.bool_),
        buffer[9 * n :].view(np.bool_),
    )


class WalkerRows:
    """Memory, random streams, observations and rewards of ``n`` walkers at one task."""

    def __init__(self, task: Task, options: EnvOptions, n: int) -> None:
        self.task = task
        self.options = options
        self.n = n
        self.parameters = options.walker_parameters(task)
        self.settings = options.settings(task)
        one_each = options.random_body is not None
        self.bodies = np.tile(np.array(self.parameters.body()), (n if one_each else 1, 1))
        self.memory = np.zeros((n, c.MEMORY))
        self.stream = np.zeros((n, 2), dtype=np.uint64)
        self.actions = np.zeros((n, ACTION_SIZE), dtype=np.float32)
        self.outcomes = np.zeros((n, c.OUTCOMES))
        self.observations = np.zeros((n, len(options.observation_names(task))), dtype=np.float32)
        self._results = np.zeros(n * _RESULT_BYTES, dtype=np.uint8)
        self.rewards, self.terminated, self.truncated = _views(self._results)
        self.info = InfoTable(task, self.settings)
        self._step_arguments = (
            self.bodies, self.memory, self.stream, self.settings, self.actions, self.outcomes,
            self.observations, self.rewards, self.terminated, self.truncated,
        )  # fmt: skip
        # commands, states and sides as the batch kernel takes them
        self.kernel_rows = (np.zeros((n, 3)), np.zeros((n, STATE_SIZE)), np.zeros(n))

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
        self._start_many(rows, True)

    def place(self, rows: NDArray[np.int64], options: dict[str, Any]) -> None:
        """Override the drawn start by reset options (``RESET_OPTIONS``); arguments are checked before anything changes."""
        checked = self.check_options(options)
        for row in rows:
            memory = self.memory[row]
            if "side" in checked:
                if memory[c.SIDE] != checked["side"]:
                    memory[:STATE_SIZE] *= MIRROR
                    memory[list(_ODD_COLUMNS)] *= -1.0
                memory[c.SIDE] = checked["side"]
            if "state" in checked:
                memory[:STATE_SIZE] = checked["state"]
            memory[c.PREVIOUS_HEADING] = memory[c.HEADING]
            for name, command in self.task.commands.items():
                if name in checked:
                    memory[list(command.columns)] = checked[name]
        self._start_many(rows, False)

    def body_parameters(self, row: int) -> WalkerParameters:
        """The walker of a row: of random bodies, its own."""
        if self.options.random_body is None:
            return self.parameters
        own = self.memory[row, c.BODY : c.BODY + c.BODY_COLUMNS].tolist()
        return replace(self.parameters, **dict(zip(BODY_NAMES, own, strict=True)))

    def _start_many(self, rows: NDArray[np.int64], fresh: bool) -> None:
        self.task.start_many(
            self.bodies, self.memory, self.stream, self.settings, self.observations, rows, fresh
        )

    def check_options(self, options: dict[str, Any]) -> dict[str, Any]:
        """Reset options as numbers, or ``ValueError``."""
        checked: dict[str, Any] = {}
        known = (*RESET_OPTIONS, *self.task.commands)
        for key in options:
            if key not in known:
                raise ValueError(
                    f"reset option {key!r} is not one of {', '.join(known)} (task {self.task.name})"
                )
        if "stance" in options:
            checked["side"] = SIDE[require_foot(options["stance"])]
        if "state" in options:
            checked["state"] = require_state(options["state"])
        for name, command in self.task.commands.items():
            if name in options:
                values = np.atleast_1d(np.asarray(options[name], dtype=object)).tolist()
                if len(values) != len(command.columns):
                    raise ValueError(
                        f"reset option {name!r} must hold {len(command.columns)} numbers, not {options[name]!r}"
                    )
                checked[name] = [
                    require_number(name, value, command.low, command.high) for value in values
                ]
        return checked

    def results(self) -> tuple[Vector, NDArray[np.bool_], NDArray[np.bool_]]:
        """Copies of rewards and ends, each (n,), in one fresh buffer."""
        return _views(self._results.copy())

    def step_one(self) -> None:
        """Step row 0 by ``actions``."""
        self.raise_for(self.task.step_one(*self._step_arguments))

    def step_many(self, skip: NDArray[np.bool_], first: int, last: int) -> int:
        """Step rows ``first`` to ``last`` - 1 by ``actions``, but for those to skip; return what ``raise_for`` takes."""
        return self.task.step_many(*self._step_arguments, *self.kernel_rows, skip, first, last)

    def raise_for(self, code: int) -> None:
        if code == NOT_A_NUMBER:
            bad = self.actions[~np.isfinite(self.actions).all(axis=1)]
            raise ValueError(f"action must be numbers in [-1, 1], not {bad[0].tolist()}")
        if code == FAILURE:
            row = int(np.flatnonzero(self.outcomes[:, c.OUTCOME_STATUS] == records.FAILED)[0])
            raise SolverError(
                f"the step from {self.memory[row, :STATE_SIZE].tolist()} of {self.parameters} did not converge"
            )
