"""Many walkers behind Stable-Baselines3's ``VecEnv`` contract, a thin shell over ``WalkerVectorEnv``."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from lean_yaw_env.envs.goal_env import WaypointGoalVectorEnv
from lean_yaw_env.envs.options import ACTION_SIZE
from lean_yaw_env.envs.snapshots import from_plain, plain
from lean_yaw_env.envs.tasks import Task
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.registration import GOAL_ENV_ID
from lean_yaw_env.validation import require_count, require_mapping, require_text

Observations = Any
"""An array (num_envs, features); of goal-conditioned walkers a dictionary of such arrays."""

_TRUNCATED = "TimeLimit.truncated"


class WalkerVecEnv(VecEnv):
    """``num_envs`` walkers at a task for Stable-Baselines3, bit for bit as a ``DummyVecEnv`` of so many ``WalkerEnv``.

    Where an episode ends, ``infos`` has the ended episode's info, its last observation as ``terminal_observation``, whether only the
    horizon ended it as ``TimeLimit.truncated``, and ``episode``: its return ``r``, steps ``l`` and wall-clock seconds since the
    environment was made ``t``, as SB3's ``Monitor`` writes them. Elsewhere it has ``TimeLimit.truncated`` alone, in dicts that are used
    again and again, unless ``step_info`` asks for all of it.

    Parameters
    ----------
    num_envs : int >= 1
    task : str or Task
        A task's name, its environment id, or a task of your own. Observations are dictionaries for the id ``LeanYaw/WaypointGoal-v1`` only.
    step_info : bool
        Fill every walker's info at every step, which costs far more than the step itself.
    threads : int >= 1
    render_mode : None or "rgb_array"
    **options
        See ``EnvOptions``.

    Raises
    ------
    TypeError, ValueError, NoGaitError
        As ``WalkerVectorEnv``.
    """

    def __init__(
        self,
        num_envs: int,
        task: str | Task = "Heading",
        *,
        step_info: bool = False,
        threads: int = 1,
        render_mode: str | None = None,
        **options: Any,
    ) -> None:
        arguments: dict[str, Any] = {
            "autoreset_mode": AutoresetMode.SAME_STEP,
            "step_info": step_info,
            "threads": threads,
            "render_mode": render_mode,
            **options,
        }
        if task == GOAL_ENV_ID:
            self.walkers = WaypointGoalVectorEnv(num_envs, **arguments)
        else:
            self.walkers = WalkerVectorEnv(num_envs, task, **arguments)
        self.walkers._reports_episodes = True
        space = self.walkers.single_observation_space
        super().__init__(num_envs, space, self.walkers.single_action_space)
        self._step_info = step_info
        self._quiet: list[dict[str, Any]] = [{_TRUNCATED: False} for _ in range(num_envs)]
        self._actions: NDArray[Any] | None = None
        self._born = time.monotonic()
        self.episode_returns = np.zeros(num_envs)
        self.episode_lengths = np.zeros(num_envs, dtype=np.int64)

    def reset(self) -> Observations:
        """Begin episodes of all walkers, with the seeds and options set since the last call."""
        seeds = None if all(seed is None for seed in self._seeds) else self._seeds
        first = self._options[0]
        if all(options == first for options in self._options):
            observations, info = self.walkers.reset(seed=seeds, options=first)
            self.reset_infos = [_of_walker(info, i) for i in range(self.num_envs)]
        else:
            observations = self._reset_each(seeds)
        self.episode_returns[:] = 0.0
        self.episode_lengths[:] = 0
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: NDArray[Any]) -> None:
        """Take the actions (num_envs, 2) that ``step_wait`` will step by."""
        shape = (self.num_envs, ACTION_SIZE)
        self._actions = self.walkers.simulation.require_actions("actions", actions, shape)

    def step_wait(
        self,
    ) -> tuple[Observations, NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Walk one step each; walkers whose episode ends show the first observation of the next."""
        if self._actions is None:
            raise RuntimeError("call step_async() before step_wait()")
        actions, self._actions = self._actions, None
        observations, rewards, terminated, truncated, info = self.walkers.step(actions)
        self.episode_returns += rewards
        self.episode_lengths += 1
        dones = terminated | truncated
        infos = self._infos(info)
        for i in np.flatnonzero(dones):
            infos[i] = self._end(int(i), info, bool(truncated[i] and not terminated[i]))
        return observations, rewards.astype(np.float32), dones, infos

    def close(self) -> None:
        """Close the walkers' environment; the threads of a process serve all its environments and stay."""
        self.walkers.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """The attribute of the walkers' common environment, once for each index."""
        value = getattr(self.walkers, require_text("attr_name", attr_name))
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of the walkers' common environment; ``ValueError`` for some of the walkers only."""
        require_text("attr_name", attr_name)
        if sorted(self._get_indices(indices)) != list(range(self.num_envs)):
            raise ValueError(
                f"indices must be all {self.num_envs} walkers, which share {attr_name!r}, got {indices!r}"
            )
        setattr(self.walkers, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of the walkers' common environment once; its result, once for each index."""
        rows = self._get_indices(indices)
        method = getattr(self.walkers, require_text("method_name", method_name))
        result = method(*method_args, **method_kwargs)
        return [result for _ in rows]

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """No walker is wrapped on its own."""
        return [False for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """A picture of each walker, if the environment is made with ``render_mode="rgb_array"``; SB3 puts them side by side."""
        return self.walkers.render() or [None for _ in range(self.num_envs)]

    def step_durations(self) -> NDArray[np.float64]:
        """How long each walker's last step took in simulated time, shape (num_envs,); 0 where it ended an episode."""
        return self.walkers.simulation.walkers["duration"].copy()

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """Copies of all that the walkers' next steps depend on, as plain arrays for a file; only after ``reset``.

        ``walkers.get_state()`` has the same with names for every field.
        """
        return {
            **plain(self.walkers.get_state()),
            "episode_returns": self.episode_returns.copy(),
            "episode_lengths": self.episode_lengths.copy(),
        }

    def restore(self, snapshot: dict[str, NDArray[Any]]) -> None:
        """Bring the walkers to a snapshot's state.

        Raises
        ------
        ValueError
            If it is a snapshot of other walkers; nothing has changed then.
        """
        sums = {"episode_returns": self.episode_returns, "episode_lengths": self.episode_lengths}
        for name, own in sums.items():
            given = require_mapping("snapshot", snapshot).get(name)
            if not isinstance(given, np.ndarray) or given.shape != own.shape:
                raise ValueError(f"snapshot must hold {name!r} in shape {own.shape}, got {given!r}")
        self.walkers.set_state(from_plain(self.walkers.simulation, snapshot))
        for name, own in sums.items():
            own[:] = snapshot[name]

    def _get_indices(self, indices: Any) -> list[int]:
        """The walkers' numbers: of all, of one or of some."""
        some = range(self.num_envs) if indices is None else indices
        some = [some] if isinstance(some, (int, np.integer)) else some
        if not isinstance(some, (range, list, tuple, np.ndarray)):
            raise ValueError(f"indices must be whole numbers, got {indices!r}")
        return [require_count("indices", i, 0, self.num_envs - 1) for i in some]

    def _reset_each(self, seeds: list[int | None] | None) -> Observations:
        """Reset walkers that have options of their own, one after the other."""
        for i, options in enumerate(self._options):
            mask = np.zeros(self.num_envs, dtype=np.bool_)
            mask[i] = True
            observations, info = self.walkers.reset(
                seed=seeds, options={**options, "reset_mask": mask}
            )
            self.reset_infos[i] = _of_walker(info, i)
        return observations

    def _infos(self, info: dict[str, Any]) -> list[dict[str, Any]]:
        if not self._step_info:
            return list(self._quiet)
        return [{**_of_walker(info, i), _TRUNCATED: False} for i in range(self.num_envs)]

    def _end(self, i: int, info: dict[str, Any], truncated: bool) -> dict[str, Any]:
        """The info of a walker whose episode has just ended; its sums begin anew."""
        ended = _of_walker(info["final_info"], i)
        ended["terminal_observation"] = info["final_obs"][i]
        ended[_TRUNCATED] = truncated
        ended["episode"] = {
            "r": float(self.episode_returns[i]),
            "l": int(self.episode_lengths[i]),
            "t": round(time.monotonic() - self._born, 6),
        }
        self.episode_returns[i] = 0.0
        self.episode_lengths[i] = 0
        return ended


def _of_walker(info: dict[str, Any], i: int) -> dict[str, Any]:
    """One walker's share of a vector environment's info, as a single environment gives it."""
    return {key: value[i] for key, value in info.items() if not key.startswith(("_", "final_"))}
