"""Model-predictive control by sampling: at every step plans are tried on the walker itself, and the best one's first step is taken.

The search is the cross-entropy method (Rubinstein 1999; for planning, Kobilarov 2012) around the better of two plans: what was left of the
last one, and what a base controller would do. It is a yardstick rather than a controller that could be built: see ``Rollouts``
for what it knows.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.envs.options import ACTION_SIZE, EnvOptions
from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.parameters import Vector
from lean_yaw_env.validation import require_number

from ..agent import Agent, State
from ..observations import ObservationLayout
from ..settings import tuned
from .guidance import guided
from .mpc_rollouts import Rollouts
from .mpc_settings import MpcSettings
from .simple import FixedController

_TABLES = 16  # of random numbers, one for each step of an episode in turn
_BLOCK = 4096  # rows walked together: they stay in the processor's cache
_FLOOR = 0.12  # least spread, as a share of the first: what is found early may still be left
_DIRECTIONS = 3  # of ``PlanSpread``


class MpcController:
    """Plans some steps ahead at every step; ``attach`` it to the environment first.

    The same seed makes the same decisions, whatever other walkers the environment has: random numbers depend on the seed and the
    episode's step alone.

    Parameters
    ----------
    task, options : the environment's
    settings : those tuned for the task otherwise
    seed : int >= 0, or ``ValueError``
    base : a controller without memory, whose plan is among those tried; the regulator otherwise, or for a walker without a gait the fixed one
    """

    def __init__(
        self,
        task: str = "Heading",
        options: EnvOptions | None = None,
        settings: MpcSettings | None = None,
        seed: int = 0,
        base: Agent | None = None,
    ) -> None:
        self._task = task
        self._options = EnvOptions() if options is None else options
        self._layout = ObservationLayout.of(task, self._options)
        self._settings = tuned("mpc", task, MpcSettings()) if settings is None else settings
        self._seed = int(require_number("seed", seed, 0, 2**63))
        self._base = _regulator(task, self._options) if base is None else base
        own, steps = self._settings, np.arange(self._settings.horizon)
        weights = [np.interp(steps, own.knots, row) for row in np.eye(len(own.knots))]
        self._steps_of_knots = np.stack(weights, axis=1)
        sizes = (_TABLES, own.iterations, own.samples, len(own.knots), _DIRECTIONS)
        self._tables = np.random.default_rng((self._seed, 0)).standard_normal(sizes)
        self._simulation: Simulation | None = None
        self._rollouts: Rollouts | None = None

    def attach(self, env: Any) -> None:
        """Plan for the walkers of this environment from now on.

        Raises
        ------
        ValueError
            If the environment is of another task or other options.
        """
        simulation: Simulation = getattr(env, "unwrapped", env).simulation
        if simulation.task.name != self._task:
            raise ValueError(f"env must be of task {self._task!r}, got {simulation.task.name!r}")
        if simulation.options != self._options:
            raise ValueError(f"env must have options {self._options}, got {simulation.options}")
        self._simulation = simulation
        self._rollouts = Rollouts(simulation, self._settings, self._base, self._seed)

    def predict(
        self,
        observation: ArrayLike,
        state: State = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], State]:
        """Actions of the best plans found, which are the new state; see ``Agent.predict``.

        Of the observation only the shape is used, and checked: the environment is read.

        Raises
        ------
        RuntimeError
            Before ``attach``.
        ValueError
            If there is not one observation for each of the environment's walkers.
        """
        simulation, rollouts = self._simulation, self._rollouts
        if simulation is None or rollouts is None:
            raise RuntimeError("attach(env) must be called before predict: plans are tried on it")
        seen = self._layout.require(observation)
        shape = seen.shape[:-1]
        if int(np.prod(shape)) != simulation.n:
            raise ValueError(
                f"observation must hold one for each of {simulation.n} walkers, got {seen.shape}"
            )
        starts = np.ones(simulation.n, dtype=np.bool_)
        left = np.zeros((simulation.n, self._settings.horizon, ACTION_SIZE))
        if state is not None:
            starts = np.zeros(simulation.n, dtype=np.bool_)
            left = _one_step_on(state[0])
        if episode_start is not None:
            starts = starts | np.reshape(episode_start, simulation.n)
        plans = np.empty_like(left)
        size = max(1, _BLOCK // (self._settings.samples * max(self._settings.scenarios, 1)))
        for first in range(0, simulation.n, size):
            block = np.arange(first, min(first + size, simulation.n))
            plans[block] = self._search(rollouts, block, left[block], starts[block])
        actions = plans[:, 0].copy()
        actions[:, 1] *= rollouts.sides(np.arange(simulation.n))
        return actions.astype(np.float32).reshape(*shape, ACTION_SIZE), (plans,)

    def _search(
        self, rollouts: Rollouts, block: NDArray[np.int64], left: Vector, starts: NDArray[np.bool_]
    ) -> Vector:
        """The best plans found for a block of walkers, (block, horizon, 2)."""
        settings, each = self._settings, np.arange(len(block))
        base = rollouts.base_plans(block)
        centre = np.where(starts[:, None, None], base, left)
        spread = np.array(list(vars(settings.spread).values()))
        knots = (len(block), len(settings.knots), _DIRECTIONS)
        mean, deviation = np.zeros(knots), np.broadcast_to(spread, knots)
        best, most = base, np.full(len(block), -np.inf)
        of_base = most
        tables = self._tables[self._read(block, "steps") % _TABLES]
        for iteration in range(settings.iterations):
            tried = mean[:, None] + deviation[:, None] * tables[:, iteration]
            tried[:, 0] = mean
            plans = self._plans(centre, tried, block)
            if iteration == 0:
                plans[:, 1] = base
            worth = rollouts.worth(plans, block)
            if settings.trust:
                strays = np.square(0.5 * (plans - base[:, None])).mean(axis=(2, 3))
                worth = worth - settings.trust * strays
            found = worth.argmax(axis=1)
            better = worth[each, found] > most
            best = np.where(better[:, None, None], plans[each, found], best)
            most = np.maximum(most, worth[each, found])
            mean, deviation = self._narrowed(tried, worth, iteration == 0)
            deviation = np.maximum(deviation, _FLOOR * spread)
            if iteration == 0:
                of_base = worth[:, 1]
                # what was tried around the plan left says nothing about the base's, if that is where to search on
                changes = (worth[:, 1] > worth[:, 0])[:, None, None]
                centre = np.where(changes, base, centre)
                mean = np.where(changes, 0.0, mean)
                deviation = np.where(changes, 0.5 * spread, deviation)
        # a small advantage may be an error: the window is finite, and the plans see no pushes or too few
        return np.where((most > of_base + settings.margin)[:, None, None], best, base)

    def _narrowed(self, tried: Vector, worth: Vector, has_base: bool) -> tuple[Vector, Vector]:
        """Mean and standard deviation of the best of what was tried; the base's plan was not drawn."""
        ranked = worth.copy()
        if has_base:
            ranked[:, 1] = -np.inf
        elites = np.argpartition(-ranked, self._settings.elites, axis=1)[:, : self._settings.elites]
        chosen = np.take_along_axis(tried, elites[:, :, None, None], axis=1)
        return chosen.mean(axis=1), chosen.std(axis=1)

    def _plans(self, centre: Vector, tried: Vector, block: NDArray[np.int64]) -> Vector:
        """Plans (block, m, horizon, 2) from deviations at the knots (block, m, knots, 3)."""
        change = np.einsum("hk,nmkd->nmhd", self._steps_of_knots, tried)
        feet = np.where(np.arange(self._settings.horizon) % 2 == 0, 1.0, -1.0)
        stance = self._read(block, "side")[:, None, None] * feet
        plans = np.repeat(centre[:, None], tried.shape[1], axis=1)
        plans[..., 0] += change[..., 0]
        plans[..., 1] += change[..., 1] + stance * change[..., 2]
        return np.clip(plans, -1.0, 1.0)

    def _read(self, block: NDArray[np.int64], field: str) -> NDArray[Any]:
        assert self._simulation is not None
        return self._simulation.walkers[field][block]


def _one_step_on(plans: Vector) -> Vector:
    """What is left of plans (n, horizon, 2) a step later; it ends as it did two steps, the same foot, before."""
    return np.concatenate([plans[:, 1:], plans[:, -2:][:, :1]], axis=1)


def _regulator(task: str, options: EnvOptions) -> Agent:
    """The regulator; for a walker without a gait the controller that never acts."""
    try:
        return guided(task, options)
    except NoGaitError:
        return FixedController()
