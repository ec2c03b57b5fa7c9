"""Many walkers as a Gymnasium vector environment, stepped together by the compiled batch kernel."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy as copied
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils import EzPickle, seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.envs.info import InfoTables
from lean_yaw_env.envs.options import ACTION_SIZE, EnvOptions, action_space
from lean_yaw_env.envs.pictures import MOST_PICTURES, STEPS_PER_SECOND, Gallery
from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.envs.snapshots import PickledWithState, State, restore, state_of
from lean_yaw_env.envs.tasks import Task, task_named
from lean_yaw_env.parameters import Vector
from lean_yaw_env.rendering.pygame_renderer import LEAST_SIZE, Renderer
from lean_yaw_env.threads import MOST_THREADS, share_out
from lean_yaw_env.validation import (
    require_choice,
    require_count,
    require_flag,
    require_mapping,
    require_seed,
)

_RENDER_MODES = ("rgb_array",)
_OTHER_ARGUMENTS = (
    "num_envs", "task", "autoreset_mode", "copy", "step_info", "threads", "max_episode_steps", "render_mode",
)  # fmt: skip
Observations = NDArray[np.float32]


class WalkerVectorEnv(PickledWithState, VectorEnv[Observations, NDArray[np.float32], NDArray[Any]]):
    """``num_envs`` walkers at a task, bit for bit as so many ``WalkerEnv`` seeded ``seed + i``.

    Parameters
    ----------
    num_envs : int >= 1
    task : str or Task
        A task's name, its environment id, or a task of your own.
    autoreset_mode : AutoresetMode or its value
        ``NEXT_STEP`` (the default), ``SAME_STEP`` (the ended episode's last observation and info are ``final_obs`` and ``final_info``)
        or ``DISABLED`` (reset ended ones by ``options={"reset_mask": ...}``).
    copy : bool
        Return fresh observations each step. Without, the same array is returned and overwritten by the next step; rewards, ends
        and infos are fresh in either case.
    step_info : bool
        Fill ``info``. Without, resets and steps alike return no info but ``final_obs``, which saves a few per cent.
    threads : int >= 1
        Threads that share the walkers of a step; worth it from some thousands of walkers on.
    max_episode_steps : int >= 1, optional
        Steps after which an episode is truncated, besides the horizon of simulated time.
    render_mode : None or "rgb_array"
        Pictures of at most ``pictures.MOST_PICTURES`` walkers; they need pygame.
    **options
        See ``EnvOptions``.

    Raises
    ------
    TypeError, ValueError, NoGaitError
        As ``WalkerEnv``.
    """

    metadata: dict[str, Any] = {}  # noqa: RUF012 (each environment sets its own)
    _spec: EnvSpec | None = None

    def __init__(
        self,
        num_envs: int = 1,
        task: str | Task = "Heading",
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        step_info: bool = True,
        threads: int = 1,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        **options: Any,
    ) -> None:
        EzPickle.__init__(
            self, num_envs, task, autoreset_mode=autoreset_mode, copy=copy, step_info=step_info,
            threads=threads, max_episode_steps=max_episode_steps, render_mode=render_mode, **options,
        )  # fmt: skip
        self.num_envs = require_count("num_envs", num_envs)
        self.threads = require_count("threads", threads, 1, MOST_THREADS)
        if render_mode is not None:
            require_choice("render_mode", render_mode, _RENDER_MODES)
            require_count("num_envs with a render_mode", num_envs, 1, MOST_PICTURES)
        if not isinstance(autoreset_mode, AutoresetMode):
            modes = [mode.value for mode in AutoresetMode]
            autoreset_mode = AutoresetMode(require_choice("autoreset_mode", autoreset_mode, modes))
        self.autoreset_mode = autoreset_mode
        self.metadata = {
            "autoreset_mode": self.autoreset_mode,
            "render_modes": list(_RENDER_MODES),
            "render_fps": STEPS_PER_SECOND,
        }
        self.render_mode = render_mode
        self.copy = require_flag("copy", copy)
        self.step_info = require_flag("step_info", step_info)
        self.options = EnvOptions.of(options, _OTHER_ARGUMENTS)
        self.task = task_named(task)
        self.simulation = Simulation(
            self.task, self.options, self.num_envs, max_episode_steps=max_episode_steps
        )
        self.single_observation_space = self.options.observation_space(self.task)
        self.single_action_space = action_space()
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._generators: list[np.random.Generator] | None = None
        self._ended = np.ones(self.num_envs, dtype=np.bool_)
        self._reports_episodes = step_info
        self._gallery = None
        if render_mode is not None:
            self._gallery = Gallery(self.simulation, Renderer(LEAST_SIZE))
        self._tables = InfoTables(self.simulation.info, self.num_envs)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observations, dict[str, Any]]:
        """Begin episodes of all walkers, or of those in ``options["reset_mask"]`` (bool, (num_envs,)).

        A number seeds walker i by ``seed + i``, a sequence each by its own; None goes on with the generators there are. Other options are
        those of ``WalkerEnv.reset``, for every walker that is reset.
        """
        placement = {} if options is None else dict(require_mapping("options", options))
        mask = self._reset_mask(placement.pop("reset_mask", None))
        self.simulation.check_options(placement)
        self._seed(self._require_seeds(seed), mask)
        infos = self.simulation.new_infos(cleared=True) if self._reports_episodes else None
        self._begin(mask, infos)
        if placement:
            self.simulation.place(mask, placement, infos)
            if self._gallery is not None:
                self._gallery.restart(mask)
        return self._observations(), self._info(infos, mask)

    def step(
        self, actions: ArrayLike
    ) -> tuple[Observations, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Walk one step each; walkers whose episode has ended do as the autoreset mode says."""
        if self._generators is None:
            raise gym.error.ResetNeeded("call reset() before the first step")
        simulation = self.simulation
        restarts = np.count_nonzero(self._ended) > 0
        if restarts and self.autoreset_mode is AutoresetMode.DISABLED:
            raise gym.error.ResetNeeded(
                f"walkers {np.flatnonzero(self._ended).tolist()} have ended; reset them by options={{'reset_mask': ...}}"
            )
        simulation.actions[:] = self._require_actions(actions)
        table = self._tables.take() if self.step_info else None
        infos = None if table is None else table.rows
        simulation.renew_results()
        share_out(
            lambda first, last: simulation.step_many(self._ended, first, last, infos),
            self.num_envs,
            self.threads,
        )
        if self._gallery is not None:
            self._gallery.extend(~self._ended)
        if restarts:
            self._begin(self._ended.copy(), infos)
        rewards, (terminated, truncated) = simulation.rewards, simulation.ends
        np.logical_or(terminated, truncated, out=self._ended)
        ends = np.count_nonzero(self._ended) > 0
        if ends:
            simulation.note_failures()
        final: dict[str, Any] = {}
        if self.autoreset_mode is AutoresetMode.SAME_STEP and ends:
            final = self._restart_in_same_step(infos)
        if table is not None:
            table.falls[:] = simulation.falls
            final |= table.info
        return self._observations(), rewards, terminated, truncated, final

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """A picture of each walker just after its last heel strike, (height, width, 3), as ``SyncVectorEnv`` gives them; recorders put them side by side."""
        if self._gallery is None:
            gym.logger.warn("render() draws nothing: make the environment with a render_mode")
            return None
        if self._generators is None:
            raise gym.error.ResetNeeded("call reset() before render()")
        return self._gallery.frames()

    @property
    def is_under_way(self) -> bool:
        """Whether episodes have begun."""
        return self._generators is not None

    def get_state(self) -> State:
        """Copies of all that the next step depends on, random streams included, as arrays by name; see ``WalkerEnv.get_state``."""
        if self._generators is None:
            raise gym.error.ResetNeeded("call reset() before get_state()")
        return {**state_of(self.simulation, self._generators), "ended": self._ended.copy()}

    def set_state(self, state: State) -> None:
        """Go on from a state of this environment or of another one with the same walkers, task and options.

        Raises
        ------
        ValueError
            If it is no such state; nothing has changed then.
        """
        ended = require_mapping("state", state).get("ended")
        if not _is_flags(ended, self.num_envs):
            raise ValueError(
                f"state must hold 'ended', bool, in shape ({self.num_envs},), got {ended!r}"
            )
        self._generators = restore(self.simulation, state)
        self._ended[:] = ended
        if self._gallery is not None:
            self._gallery.restart(np.ones(self.num_envs, dtype=np.bool_))

    @property
    def spec(self) -> EnvSpec | None:  # pyright: ignore[reportIncompatibleVariableOverride]
        """What the environment is made from, its ``max_episode_steps`` included; ``gymnasium.make_vec`` sets it."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = copied(spec)
        if self._spec is not None:
            # make_vec leaves it among the arguments
            limit = self._spec.kwargs.get("max_episode_steps", self._spec.max_episode_steps)
            self._spec.max_episode_steps = limit

    def _require_actions(self, actions: ArrayLike) -> NDArray[np.float32]:
        chosen = self.simulation.require_actions("actions", actions, (self.num_envs, ACTION_SIZE))
        if np.count_nonzero(np.isfinite(chosen)) < chosen.size:
            bad = ~np.isfinite(chosen).all(axis=1) & ~self._ended
            if bad.any():
                raise ValueError(
                    f"actions must be numbers in [-1, 1], got {chosen[bad][0].tolist()}"
                )
        return chosen

    def _restart_in_same_step(self, infos: Vector | None) -> dict[str, Any]:
        """Keep what the ended episodes ended with, then begin new ones."""
        mask = self._ended.copy()
        observations = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(mask).tolist():
            observations[i] = self._observation(i)
        final = {"final_obs": observations, "_final_obs": mask}
        if self._reports_episodes:
            ended = self._info(self.simulation.report(mask), mask)
            final |= {"final_info": ended, "_final_info": mask}
        self._begin(mask, infos)
        return final

    def _reset_mask(self, mask: Any) -> NDArray[np.bool_]:
        if mask is None:
            return np.ones(self.num_envs, dtype=np.bool_)
        if not _is_flags(mask, self.num_envs):
            raise ValueError(
                f"reset_mask must be a bool array of shape ({self.num_envs},), got {mask!r}"
            )
        if not mask.any():
            raise ValueError(f"reset_mask must be true for at least one walker, got {mask}")
        return mask.copy()

    def _require_seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        """A seed for each walker."""
        if not isinstance(seed, (list, tuple, np.ndarray)):
            first = require_seed("seed", seed)
            return [None if first is None else first + i for i in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ValueError(f"seed must be one number or {self.num_envs} of them, got {len(seed)}")
        return [require_seed(f"seed[{i}]", each) for i, each in enumerate(seed)]

    def _seed(self, seeds: list[int | None], mask: NDArray[np.bool_]) -> None:
        """Give the walkers of the mask their generators."""
        if self._generators is None:
            self._generators = [seeding.np_random(s)[0] for s in seeds]
            return
        for i in np.flatnonzero(mask):
            if seeds[i] is not None:
                self._generators[i] = seeding.np_random(seeds[i])[0]

    def _begin(self, mask: NDArray[np.bool_], infos: Vector | None) -> None:
        assert self._generators is not None
        self.simulation.start(mask, self._generators, infos)
        self._ended[mask] = False
        if self._gallery is not None:
            self._gallery.restart(mask)

    def _observations(self) -> Observations:
        observations = self.simulation.observations
        return observations.copy() if self.copy else observations

    def _observation(self, row: int) -> Any:
        return self.simulation.observations[row].copy()

    def _info(self, infos: Vector | None, mask: NDArray[np.bool_]) -> dict[str, Any]:
        if infos is None:
            return {}
        falls = np.where(mask, self.simulation.falls, 0)
        return self.simulation.info.many(infos, falls, mask)


def _is_flags(value: Any, n: int) -> bool:
    """Whether it is a bool array (n,)."""
    return isinstance(value, np.ndarray) and value.dtype == np.bool_ and value.shape == (n,)
