"""The records behind an environment and the calls that move them: the same for one walker and for many."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.envs.dynamics import command_many, walk_many, walk_one
from lean_yaw_env.envs.info import FallCode, InfoMaker
from lean_yaw_env.envs.options import ACTION_SIZE, EnvOptions, settings_of
from lean_yaw_env.envs.outputs import Event, outputs_of
from lean_yaw_env.envs.reset import start_episodes
from lean_yaw_env.envs.state import (
    BODY_NAMES,
    WALKER,
    WALKER_FIELDS,
    Records,
    as_records,
    mirror,
    states_of,
)
from lean_yaw_env.envs.tasks import Task
from lean_yaw_env.kernel.compilation import for_types_of
from lean_yaw_env.parameters import Vector, WalkerParameters, require_foot, require_state
from lean_yaw_env.validation import (
    require_array,
    require_count,
    require_instance,
    require_mapping,
    require_number,
    require_shape,
    suggestion,
)
from lean_yaw_env.walker import SIDE

RESET_OPTIONS = ("state", "stance")
"""Of every task; some have commands besides."""
_SOLVER = int(FallCode.SOLVER)
_STEP, _RESET, _EDIT, _NONE = (int(event) for event in Event)
Flags = NDArray[np.bool_]
_SINGLE = np.dtype(np.float32)


class Simulation:
    """``n`` walkers at one task.

    Parameters
    ----------
    task : Task
    options : EnvOptions
    n : int >= 1
    max_episode_steps : int >= 1, optional
        Steps after which an episode is truncated.

    Attributes
    ----------
    walkers : records (n,), see ``state.WALKER_FIELDS``
    tasks : records (n,), see ``Task.fields``
    falls : shape (n,), a view of the walkers' field ``fall``
    solver_failures : how many episodes have ended because the integrator failed, as ``note_failures`` counts them
    settings : record (1,), see ``state.SETTINGS_FIELDS``
    bodies : shape (n or 1, 11)
        The walkers' constants as the kernels take them; one row for all unless bodies are random or slopes vary.
    actions : float32 (n, 2), of the next step
    observations : float32 (n, numbers)
    rewards : shape (n,)
    ends : bool (2, n): terminated, truncated
    """

    def __init__(
        self, task: Task, options: EnvOptions, n: int, *, max_episode_steps: int | None = None
    ) -> None:
        self.task = require_instance("task", task, Task)
        self.options = require_instance("options", options, EnvOptions)
        self.n = n = require_count("n", n)
        if max_episode_steps is not None:
            require_count("max_episode_steps", max_episode_steps)
        own = options.for_task(task)
        self.parameters = own.parameters
        self.settings = settings_of(options, task, max_episode_steps=max_episode_steps)
        one_each = own.random_body != "nominal" or task.slope_varies
        self.bodies = np.tile(np.array(self.parameters.body()), (n if one_each else 1, 1))
        self.walkers: Records = np.zeros(n, WALKER)
        self.tasks: Records = np.zeros(n, task.record)
        self.actions = np.zeros((n, ACTION_SIZE), dtype=np.float32)
        self.observations = np.zeros((n, len(options.observation_names(task))), dtype=np.float32)
        self.rewards = np.zeros(n)
        self.ends = np.zeros((2, n), dtype=np.bool_)
        has_pushes = bool((self.settings["pitch_push"] > 0.0) | (self.settings["ankle_push"] > 0.0))
        self.info = InfoMaker(task, has_pushes=has_pushes, has_bodies=one_each)
        self.solver_failures = 0
        self._no_infos = np.zeros((0, self.info.size))
        self._nobody = np.zeros(n, dtype=np.bool_)
        self.falls: NDArray[np.int64] = self.walkers["fall"]
        self._keys = self.walkers["key"]
        self._words = _words(self.walkers), _words(self.tasks), _words(task.initial)
        self._start_episodes = for_types_of(
            start_episodes, self.walkers, self.bodies, self.settings, self._nobody
        )
        self._write_outputs = for_types_of(
            outputs_of(task), *self._arguments(_STEP, self._nobody, None, 0, n)
        )

    @property
    def states(self) -> Vector:
        """Section states, a view (n, 5)."""
        return states_of(self.walkers)

    @property
    def terminated(self) -> Flags:
        """Whose episode ended, but for the horizon, shape (n,)."""
        return self.ends[0]

    @property
    def truncated(self) -> Flags:
        """Whose episode was cut by the horizon or the number of steps, shape (n,)."""
        return self.ends[1]

    def new_infos(self, *, cleared: bool = False) -> Vector:
        """A fresh table of infos, as ``step_many`` fills it; of zeros if not every walker's are to be filled."""
        return (np.zeros if cleared else np.empty)((self.n, self.info.size))

    def renew_results(self) -> None:
        """Fresh arrays for the next step's rewards and ends: those there are belong to whom they were returned to."""
        self.rewards = np.zeros(self.n)
        self.ends = np.zeros((2, self.n), dtype=np.bool_)

    def note_failures(self) -> None:
        """Count the solver's failures among the steps just made."""
        self.solver_failures += int(np.count_nonzero(self.falls[self.terminated] == _SOLVER))

    def start(
        self, mask: Flags, generators: list[np.random.Generator], infos: Vector | None = None
    ) -> None:
        """Begin episodes of these walkers, each drawing its key from its own generator."""
        walkers, tasks, initial = self._words
        walkers[mask] = 0
        tasks[mask] = initial
        for row in np.flatnonzero(mask).tolist():
            # as ``integers(2**64)`` draws it, a dozen times as fast
            self._keys[row] = generators[row].bit_generator.random_raw()
        skip = ~mask
        self._start_episodes(self.walkers, self.bodies, self.settings, skip)
        self._write(_RESET, skip, infos)

    def place(self, mask: Flags, options: dict[str, Any], infos: Vector | None = None) -> None:
        """Override the drawn start by reset options (``RESET_OPTIONS``); arguments are checked before anything changes."""
        checked = self.check_options(options)
        for row in np.flatnonzero(mask).tolist():
            walker, task = self.walkers[row : row + 1], self.tasks[row : row + 1]
            if checked.get("side", walker["side"][0]) != walker["side"][0]:
                mirror(walker, WALKER_FIELDS)
            if "state" in checked:
                states_of(walker)[:] = checked["state"]
            walker["previous_heading"] = walker["heading"]
            for name, command in self.task.commands.items():
                for field, value in zip(command.fields, checked.get(name, ()), strict=False):
                    task[field] = value
        self._write(_EDIT, ~mask, infos)

    def report(self, mask: Flags) -> Vector:
        """The infos of these walkers, as after their last step, among zeros for the others."""
        infos = self.new_infos(cleared=True)
        self._write(_NONE, ~mask, infos)
        return infos

    def observe(self) -> None:
        """Show records that were set by hand: derived fields and observations anew, without a step."""
        self._write(_EDIT, self._nobody, None)

    def command(self) -> None:
        """Put what ``actions`` command into the records (``inter_leg_angle``, ``commanded_offset``), without a step."""
        command_many(self.walkers, self.settings, self.actions)

    def take_over(self, other: Simulation, rows: NDArray[np.int64]) -> None:
        """Put walkers of another simulation of this task, those of ``rows`` (n,), in the place of these; ``observe`` shows them."""
        self.walkers[:] = other.walkers[rows]
        self.tasks[:] = other.tasks[rows]
        if len(self.bodies) == self.n:
            self.bodies[:] = other.bodies[rows if len(other.bodies) > 1 else 0]

    def check_options(self, options: dict[str, Any]) -> dict[str, Any]:
        """Reset options as numbers, or ``ValueError``."""
        checked: dict[str, Any] = {}
        known = (*RESET_OPTIONS, *self.task.commands)
        for key in require_mapping("options", options):
            if key not in known:
                raise ValueError(
                    f"reset option {key!r} is not one of {', '.join(known)} (task {self.task.name}){suggestion(key, known)}"
                )
        if "stance" in options:
            checked["side"] = SIDE[require_foot(options["stance"])]
        if "state" in options:
            checked["state"] = require_state(options["state"])
        for name, (fields, low, high, _) in self.task.commands.items():
            if name in options and len(fields) == 1:
                checked[name] = [require_number(name, options[name], low, high)]
            elif name in options:
                checked[name] = require_array(name, options[name], (len(fields),), low, high, "[]")
        return checked

    def require_actions(
        self, name: str, value: ArrayLike, shape: tuple[int, ...]
    ) -> NDArray[np.float32]:
        """Actions as float32 numbers, NaN included, of a shape; an array that is this already is returned as it is."""
        if type(value) is np.ndarray and value.dtype == _SINGLE and value.shape == shape:
            return value
        return require_shape(name, value, shape).astype(np.float32)

    def step_one(self, infos: Vector) -> bool:
        """Step the only walker by ``actions``; return whether they are numbers, else nothing has changed."""
        if not self._walk_one(self.walkers, self.bodies, self.settings, self.actions):
            return False
        self._write_outputs(
            _STEP, self.walkers, self.tasks, self.settings, self.observations, self.rewards,
            self.ends, infos, self._nobody, 0, 1,
        )  # fmt: skip
        return True

    def step_many(self, skip: Flags, first: int, last: int, infos: Vector | None = None) -> None:
        """Step walkers ``first`` to ``last`` - 1 by ``actions``, which must be numbers, but for those to skip."""
        self._walk_many(self.walkers, self.bodies, self.settings, self.actions, skip, first, last)
        self._write_outputs(*self._arguments(_STEP, skip, infos, first, last))

    def body_parameters(self, row: int) -> WalkerParameters:
        """The parameters of a walker: its own body, and the slope under it."""
        own = {name: float(self.walkers[name][row]) for name in BODY_NAMES}
        return replace(self.parameters, **own)

    def records(self, row: int) -> tuple[Any, Any]:
        """A walker's record and the task's, as formulas take them when Python calls them."""
        return as_records(self.walkers)[row], as_records(self.tasks)[row]

    @cached_property
    def _walk_one(self) -> Any:
        return for_types_of(walk_one, self.walkers, self.bodies, self.settings, self.actions)

    @cached_property
    def _walk_many(self) -> Any:
        return for_types_of(
            walk_many, self.walkers, self.bodies, self.settings, self.actions, self._nobody, 0, 0
        )

    def _write(self, event: int, skip: Flags, infos: Vector | None) -> None:
        self._write_outputs(*self._arguments(event, skip, infos, 0, self.n))

    def _arguments(
        self, event: int, skip: Flags, infos: Vector | None, first: int, last: int
    ) -> tuple[Any, ...]:
        return (
            event, self.walkers, self.tasks, self.settings, self.observations, self.rewards,
            self.ends, self._no_infos if infos is None else infos, skip, first, last,
        )  # fmt: skip


def _words(records: Records) -> NDArray[np.uint64]:
    """Records as rows of words of 64 bits, a view: quicker to fill than field by field."""
    return records.view(np.uint64).reshape(len(records), -1)
