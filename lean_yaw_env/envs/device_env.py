"""Many walkers on a GPU: a vector environment whose records, actions, observations, rewards and ends stay there. It needs the extra ``gpu``.

A step is four kernels with a thread for each walker: actions are made into commands; the walkers step; the rare ones whose landing was not
found step again, carefully; and each walker moves on, is judged, and begins a new episode if its own has ended. The formulas are those of the
CPU's environment. An explicit reset is done on the CPU, by the same code as there, and copied.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.utils import EzPickle
from gymnasium.vector import AutoresetMode
from numpy.typing import ArrayLike

from lean_yaw_env.envs.dynamics import OUTCOME_SIZE, command, gather, move, outcome_of, push
from lean_yaw_env.envs.info import info_report
from lean_yaw_env.envs.options import ACTION_SIZE
from lean_yaw_env.envs.outputs import ROW_PARTS, Event, compiled_for, write_row
from lean_yaw_env.envs.reset import start_episode
from lean_yaw_env.envs.snapshots import State
from lean_yaw_env.envs.state import SLOPE, WALKER_FIELDS
from lean_yaw_env.envs.tasks import Task
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.extras import is_gpu
from lean_yaw_env.kernel.compilation import borrowed, filled, written_formula
from lean_yaw_env.kernel.cuda import (
    cuda,
    is_device_array,
    kernel,
    launch,
    require_gpu,
    step_all,
)
from lean_yaw_env.kernel.random import raw_number
from lean_yaw_env.parameters import STATE_SIZE

_STEP, _RESET = int(Event.STEP), int(Event.RESET)
CLEAR: Any = None
REPORT: Any = None


@kernel
def find_bad_actions(actions, skip, bad):
    """Set ``bad`` (1,) if an action of walkers, but those to skip, is not made of numbers."""
    i = cuda.grid(1)
    if i < len(skip) and not skip[i]:
        is_bad = not (math.isfinite(actions[i, 0]) and math.isfinite(actions[i, 1]))
        bad[0] = 1 if is_bad else bad[0]


@kernel
def command_walkers(walkers, bodies, settings, actions, skip, commands, states, sides):
    """Put what actions command into the records of walkers, but those to skip, and write their steps as the kernel takes them."""
    walkers, settings = borrowed(walkers), borrowed(settings)
    i = cuda.grid(1)
    if i < len(walkers) and not skip[i]:
        walker = walkers[i]
        command(walker, settings[0], actions[i])
        gather(walker, commands, states, sides, i)
        if len(bodies) == len(walkers):
            bodies[i, SLOPE] = walker.slope


def settle(
    in_same_step, initial, walkers, tasks, bodies, settings, generators, ended, outcomes,
    observations, rewards, ends, infos, falls, last_observations, last_infos, last_falls,
):  # fmt: skip
    """Take the steps' outcomes into the records and write what they return; walkers whose episode has ended begin the next one.

    A template of ``compiled_for``. Arguments as of ``write_outputs``, and:

    Parameters
    ----------
    in_same_step : bool
        Whether an episode that ends is followed by the next one at once: ``last_observations``, ``last_infos`` and ``last_falls`` keep its
        end. Otherwise the walkers in ``ended`` begin theirs instead of a step.
    initial : record (1,), of the task at the start of an episode
    generators : uint64 (n, 6)
        See ``random.raw_number``; an episode's random numbers derive from the next one.
    ended : bool (n,), read and written
    outcomes : (n, 18), of those that have not ended
    ends : bool (3, n): terminated, truncated, either
    falls : int64 (n,), written if infos are
    """
    walkers, tasks = borrowed(walkers), borrowed(tasks)
    settings, initial = borrowed(settings), borrowed(initial)
    i = cuda.grid(1)
    if i < len(walkers):
        walker, task, common = walkers[i], tasks[i], settings[0]
        begins = ended[i]
        if begins:
            rewards[i], ended[i] = 0.0, False
            ends[0, i], ends[1, i], ends[2, i] = False, False, False
        else:
            move(walker, outcome_of(outcomes[i]), common.horizon)
            push(walker, common)
            write_row(_STEP, walker, task, common, observations[i], rewards, ends, i)
            over = ends[0, i] or ends[1, i]
            ends[2, i] = over
            begins = over and in_same_step
            ended[i] = over and not in_same_step
            if begins:
                for k in range(observations.shape[1]):
                    last_observations[i, k] = observations[i, k]
                if len(infos) > 0:
                    REPORT(last_infos[i], walker, task)
                    last_falls[i] = walker.fall
        if begins:
            CLEAR(walker, task, initial[0])
            walker.key = raw_number(generators[i])
            start_episode(walker, bodies[i if len(bodies) > 1 else 0], common)
            write_row(_RESET, walker, task, common, observations[i], rewards, ends, i)
        if len(infos) > 0:
            REPORT(infos[i], walker, task)
            falls[i] = walker.fall


def _clearing(task: Task) -> list[str]:
    """Lines that put a walker's record to zero, and the task's to its initial values: other tasks with these fields have others."""
    lines = [f"walker.{field.name} = 0" for field in WALKER_FIELDS]
    for field in task.fields:
        each = "" if field.size == 1 else "[k]"
        line = f"task.{field.name}{each} = initial.{field.name}{each}"
        lines.append(line if field.size == 1 else f"for k in range({field.size}): {line}")
    return lines


def settling(task: Task) -> Any:
    """The kernel ``settle`` of a task."""

    def tables() -> dict[str, Any]:
        clear = written_formula("clear", ("walker", "task", "initial"), _clearing(task))
        return {"REPORT": info_report(task), "CLEAR": clear}

    return compiled_for(
        task, settle, ROW_PARTS, tables, lambda *given, **names: kernel(filled(*given, **names))
    )


class DeviceVectorEnv(WalkerVectorEnv):
    """``num_envs`` walkers at a task on a GPU: experimental. Seeded alike, they begin the same episodes as those of ``WalkerVectorEnv``.

    Observations (float32), rewards (float64) and ends (bool) are arrays on the device, and so are infos. They have
    ``__cuda_array_interface__``: ``torch.as_tensor(observations, device="cuda")`` shares their memory, ``copy_to_host()`` makes a NumPy array.
    Actions may be such an array too, float32 (num_envs, 2), or anything that NumPy takes. Everything runs on CUDA's default stream.

    Parameters
    ----------
    num_envs, task, autoreset_mode, step_info, max_episode_steps, **options
        As of ``WalkerVectorEnv``; it draws no pictures. With ``SAME_STEP``, ``final_obs`` and ``final_info`` hold arrays for all walkers, whose
        rows have a meaning where ``_final_obs`` is true.
    device : "cuda"
    copy : bool
        Return fresh arrays each step. Without, all arrays of a step are overwritten by the next one, which saves their allocation.

    Raises
    ------
    MissingLibraryError, NoGpuError
        If the extra ``gpu`` is not installed, or there is no GPU.
    TypeError, ValueError, NoGaitError
        As ``WalkerVectorEnv``.
    """

    def __init__(
        self,
        num_envs: int = 1,
        task: str | Task = "Heading",
        *,
        device: str = "cuda",
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        step_info: bool = True,
        max_episode_steps: int | None = None,
        **options: Any,
    ) -> None:
        if not is_gpu(device):
            raise ValueError(f"device must be 'cuda', got {device!r}")
        if options.pop("render_mode", None) is not None or options.pop("threads", 1) != 1:
            raise ValueError(
                "device='cuda' has neither render_mode nor threads: leave device='cpu'"
            )
        require_gpu()
        super().__init__(
            num_envs, task, autoreset_mode=autoreset_mode, copy=copy, step_info=step_info,
            max_episode_steps=max_episode_steps, **options,
        )  # fmt: skip
        EzPickle.__init__(
            self, num_envs, task, device=device, autoreset_mode=autoreset_mode, copy=copy,
            step_info=step_info, max_episode_steps=max_episode_steps, **options,
        )  # fmt: skip
        n, simulation = self.num_envs, self.simulation
        self._settle = settling(self.task)
        self._settings = cuda.to_device(simulation.settings)
        self._initial = cuda.to_device(self.task.initial)
        self._steps = [
            cuda.device_array((n, size) if size else (n,), dtype=np.float64)
            for size in (3, STATE_SIZE, 0, OUTCOME_SIZE)
        ]
        self._everyone = cuda.to_device(np.ones(n, dtype=np.bool_))
        self._state: dict[str, Any] = {}
        self._results = self._new_results()
        self._last = self._new_results()

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """See ``WalkerVectorEnv.reset``. A generator for each walker is made on the CPU, which takes a while for a million of them."""
        self._download()
        _, info = super().reset(seed=seed, options=options)
        self._upload()
        observations = cuda.to_device(self.simulation.observations)
        return observations, {key: _on_device(value) for key, value in info.items()}

    def step(self, actions: ArrayLike) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """See ``WalkerVectorEnv.step``."""
        state, n = self._state, self.num_envs
        if not state:
            raise gym.error.ResetNeeded("call reset() before the first step")
        ended = state["ended"]
        if self.autoreset_mode is AutoresetMode.DISABLED and ended.copy_to_host().any():
            raise gym.error.ResetNeeded(
                "walkers have ended; reset them by options={'reset_mask': ...}"
            )
        given = self._actions_on_device(actions)
        bad = cuda.to_device(np.zeros(1, dtype=np.int32))
        launch(find_bad_actions, n, given, ended, bad)
        if bad.copy_to_host()[0]:
            raise ValueError("actions must be numbers in [-1, 1], got some that are no numbers")
        if self.copy:
            self._results, self._last = self._new_results(), self._new_results()
        walkers, bodies = state["walkers"], state["bodies"]
        commands, states, sides, outcomes = self._steps
        launch(
            command_walkers, n, walkers, bodies, self._settings, given, ended,
            commands, states, sides,
        )  # fmt: skip
        step_all(bodies, commands, states, sides, ended, outcomes)
        in_same_step = self.autoreset_mode is AutoresetMode.SAME_STEP
        observations, rewards, ends, infos, falls = self._results
        last_observations, _, _, last_infos, last_falls = self._last
        launch(
            self._settle, n, in_same_step, self._initial, walkers, state["tasks"], bodies, self._settings,
            state["generators"], ended, outcomes, observations, rewards, ends, infos, falls,
            last_observations, last_infos, last_falls,
        )  # fmt: skip
        state["observations"] = observations
        return observations, rewards, ends[0], ends[1], self._step_info()

    def get_state(self) -> State:
        """See ``WalkerVectorEnv.get_state``; NumPy's arrays."""
        self._download()
        return super().get_state()

    def set_state(self, state: State) -> None:
        """See ``WalkerVectorEnv.set_state``."""
        super().set_state(state)
        self._upload()

    def _step_info(self) -> dict[str, Any]:
        _, _, ends, infos, falls = self._results
        info: dict[str, Any] = {}
        maker = self.simulation.info
        if self.step_info:
            info = maker.many(infos, falls, self._everyone)
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            observations, _, _, infos, falls = self._last
            info |= {"final_obs": observations, "_final_obs": ends[2]}
            if self.step_info:
                last = maker.many(infos, falls, ends[2])
                info |= {"final_info": last, "_final_info": ends[2]}
        return info

    def _actions_on_device(self, actions: Any) -> Any:
        shape = (self.num_envs, ACTION_SIZE)
        if not hasattr(actions, "__cuda_array_interface__") and not is_device_array(actions):
            return cuda.to_device(self.simulation.require_actions("actions", actions, shape))
        given = actions if is_device_array(actions) else cuda.as_cuda_array(actions)
        if given.shape != shape or given.dtype != np.float32:
            raise ValueError(
                f"actions must be float32 in shape {shape}, got {given.dtype} in shape {tuple(given.shape)}"
            )
        return given

    def _upload(self) -> None:
        """Copy what the next step depends on to the device."""
        self._state = {name: cuda.to_device(each) for name, each in super().get_state().items()}

    def _download(self) -> None:
        """Bring the CPU's copy up to date, if episodes are under way."""
        if self._state:
            super().set_state({name: each.copy_to_host() for name, each in self._state.items()})

    def _new_results(self) -> tuple[Any, ...]:
        """Arrays for observations, rewards, ends, infos and falls."""
        n, simulation = self.num_envs, self.simulation
        infos = n if self.step_info else 0
        return (
            cuda.device_array(simulation.observations.shape, dtype=np.float32),
            cuda.device_array(n, dtype=np.float64),
            cuda.device_array((3, n), dtype=np.bool_),
            cuda.device_array((infos, simulation.info.size), dtype=np.float64),
            cuda.device_array(infos, dtype=np.int64),
        )


def _on_device(value: Any) -> Any:
    return cuda.to_device(np.ascontiguousarray(value))
