"""Many walkers as a Gymnasium vector environment, stepped together by the compiled batch kernel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.utils import EzPickle, seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.options import ACTION_SIZE, EnvOptions, action_space
from lean_yaw_env.envs.rows import WalkerRows
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.parameters import require_number
from lean_yaw_env.threads import share_out

Observations = NDArray[np.float32]


class WalkerVectorEnv(VectorEnv[Observations, NDArray[np.float32], NDArray[Any]], EzPickle):
    """``num_envs`` walkers at a task, bit for bit as so many ``WalkerEnv`` seeded ``seed + i``.

    Parameters
    ----------
    num_envs : int >= 1
    task : str
    autoreset_mode : AutoresetMode or its value
        ``NEXT_STEP`` (the default), ``SAME_STEP`` (the ended episode's last observation and info are ``final_obs`` and ``final_info``)
        or ``DISABLED`` (reset ended ones by ``options={"reset_mask": ...}``).
    copy : bool
        Return fresh observations each step. Without, the same array is returned and overwritten by the next step; rewards, ends
        and infos are fresh in either case.
    step_info : bool
        Fill ``info`` at every step. Without, only ``final_obs`` and ``final_info`` are filled, which saves a few per cent.
    threads : int >= 1
        Threads that share the walkers of a step; worth it from some thousands of walkers on.
    **options
        See ``EnvOptions``.

    Raises
    ------
    ValueError, NoGaitError, SolverError
        As ``WalkerEnv``.
    """

    metadata: dict[str, Any] = {}  # noqa: RUF012 (each environment sets its own)

    def __init__(
        self,
        num_envs: int = 1,
        task: str = "Heading",
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        step_info: bool = True,
        threads: int = 1,
        render_mode: None = None,
        **options: Any,
    ) -> None:
        EzPickle.__init__(
            self, num_envs, task, autoreset_mode=autoreset_mode, copy=copy, step_info=step_info,
            threads=threads, render_mode=render_mode, **options,
        )  # fmt: skip
        self.num_envs = int(require_number("num_envs", num_envs, 1, 10_000_000))
        self.threads = int(require_number("threads", threads, 1, 1024))
        if render_mode is not None:
            raise ValueError(f"render_mode must be None for many walkers, not {render_mode!r}")
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {"autoreset_mode": self.autoreset_mode}
        self.render_mode = None
        self.copy = copy
        self.step_info = step_info
        self.options = EnvOptions(**options)
        self.task = task_named(task)
        self.rows = WalkerRows(self.task, self.options, self.num_envs)
        self.single_observation_space = self.options.observation_space(self.task)
        self.single_action_space = action_space()
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._generators: list[np.random.Generator] | None = None
        self._ended = np.ones(self.num_envs, dtype=np.bool_)

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
        placement = dict(options or {})
        mask = self._reset_mask(placement.pop("reset_mask", None))
        self.rows.check_options(placement)
        self._seed(seed, mask)
        rows = np.flatnonzero(mask)
        self._begin(rows)
        if placement:
            self.rows.place(rows, placement)
        return self._observations(), self._infos(mask)

    def step(
        self, actions: ArrayLike
    ) -> tuple[Observations, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Walk one step each; walkers whose episode has ended do as the autoreset mode says."""
        if self._generators is None:
            raise gym.error.ResetNeeded("call reset() before the first step")
        rows = self.rows
        chosen = np.asarray(actions, dtype=np.float32)
        if chosen.shape != rows.actions.shape:
            raise ValueError(
                f"actions must have shape ({self.num_envs}, {ACTION_SIZE}), not {chosen.shape}"
            )
        restarts = np.flatnonzero(self._ended)
        if len(restarts) and self.autoreset_mode is AutoresetMode.DISABLED:
            raise gym.error.ResetNeeded(
                f"walkers {restarts.tolist()} have ended; reset them by options={{'reset_mask': ...}}"
            )
        if not np.isfinite(chosen).all():
            bad = ~np.isfinite(chosen).all(axis=1) & ~self._ended
            if bad.any():
                raise ValueError(
                    f"actions must be numbers in [-1, 1], not {chosen[bad][0].tolist()}"
                )
        rows.actions[:] = chosen
        self._walk()
        if len(restarts):
            self._begin(restarts)
        return self._results()

    def _results(self) -> tuple[Any, ...]:
        rows = self.rows
        rewards, terminated, truncated = rows.results()
        np.logical_or(terminated, truncated, out=self._ended)
        final: dict[str, Any] = {}
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._ended.any():
            final = self._restart_in_same_step()
        info = self._infos(np.ones(self.num_envs, dtype=np.bool_)) if self.step_info else {}
        return self._observations(), rewards, terminated, truncated, final | info

    def _restart_in_same_step(self) -> dict[str, Any]:
        """Keep what the ended episodes ended with, then begin new ones."""
        mask = self._ended.copy()
        observations = np.full(self.num_envs, None, dtype=object)
        ended = np.flatnonzero(mask)
        for i in ended:
            observations[i] = self.rows.observations[i].copy()
        final = {
            "final_obs": observations,
            "_final_obs": mask,
            "final_info": self._infos(mask),
            "_final_info": mask,
        }
        self._begin(ended)
        return final

    def _reset_mask(self, mask: Any) -> NDArray[np.bool_]:
        if mask is None:
            return np.ones(self.num_envs, dtype=np.bool_)
        if (
            not isinstance(mask, np.ndarray)
            or mask.dtype != np.bool_
            or mask.shape != (self.num_envs,)
        ):
            raise ValueError(
                f"reset_mask must be a bool array of shape ({self.num_envs},), not {mask!r}"
            )
        if not mask.any():
            raise ValueError("reset_mask must be true for at least one walker")
        return mask.copy()

    def _seed(self, seed: int | Sequence[int | None] | None, mask: NDArray[np.bool_]) -> None:
        """Give the walkers of the mask their generators."""
        if seed is None:
            seeds: list[int | None] = [None] * self.num_envs
        elif isinstance(seed, (int, np.integer)):
            seeds = [int(seed) + i for i in range(self.num_envs)]
        else:
            seeds = list(seed)
            if len(seeds) != self.num_envs:
                raise ValueError(
                    f"seed must be one number or {self.num_envs} of them, not {len(seeds)}"
                )
        if self._generators is None:
            self._generators = [seeding.np_random(s)[0] for s in seeds]
            return
        for i in np.flatnonzero(mask):
            if seeds[i] is not None:
                self._generators[i] = seeding.np_random(seeds[i])[0]

    def _begin(self, rows: NDArray[np.int64]) -> None:
        assert self._generators is not None
        self.rows.start(rows, self._generators)
        self._ended[rows] = False

    def _observations(self) -> Observations:
        return self.rows.observations.copy() if self.copy else self.rows.observations

    def _infos(self, mask: NDArray[np.bool_]) -> dict[str, Any]:
        rows = self.rows
        table = rows.info.fill(rows.memory, rows.outcomes, self.threads)
        return rows.info.many(table, rows.outcomes[:, c.OUTCOME_STATUS], mask)

    def _walk(self) -> None:
        """Step every row, the rows shared out to the threads."""
        rows = self.rows
        codes = share_out(
            lambda first, last: rows.step_many(self._ended, first, last),
            self.num_envs,
            self.threads,
        )
        rows.raise_for(max(codes))
