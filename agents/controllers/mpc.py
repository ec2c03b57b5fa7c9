"""Planning by sampling: at every step, deviations from a base agent's actions are tried on copies of the walker, and the best one's first step is taken.

The search is the cross-entropy method (Rubinstein 1999; for planning, Kobilarov 2012). The base agent answers to what its copy observes all along a
plan and walks alone after it, so that no plan gains by leaving the walker in a bad state. A walker's random numbers depend on its key and a counter
alone: copies with other keys meet other pushes, commands and goals than the walker will, copies with its own key meet the same ones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.parameters import Vector
from lean_yaw_env.validation import require_count, require_number

from ..agent import Agent, State
from ..observations import ObservationLayout
from ..settings import tuned

_TABLES = 16  # of random numbers, one for each step of an episode in turn
_KEYS = 64  # sets of scenarios, one for each step of an episode in turn
_BLOCK = 4096  # copies walked together: they stay in the processor's cache
_FLOOR = 0.12  # least spread, as a share of the first: what is found early may still be left
_DIRECTIONS = 3  # of ``MpcSettings.spread``
_KNOTS = (
    0.0,
    0.15,
    0.35,
    0.7,
)  # shares of a plan where what is tried is drawn; linear in between and held after the last
_ELITES = 6  # one of so many plans tried is among those that the next are made of
_SHORTEST_STEP = 0.125  # time units, of a gait; ends copies that no longer get on


@dataclass(frozen=True)
class MpcSettings:
    """Settings of ``MpcController``."""

    steps: int = 12
    """1 to 64 walking steps in which plans deviate from the base agent's actions."""
    window: float = 20.0
    """Time in which plans are compared, (0, 1000]: the base agent walks what is left of it."""
    samples: int = 24
    """4 to 4096 plans tried at once."""
    iterations: int = 2
    """1 to 64."""
    spread: tuple[float, float, float] = (0.3, 0.3, 0.3)
    """First standard deviations of what is tried, as shares of the actions' ranges, 0 to 2: of the inter-leg angle, of the mass offset to one side, and
    of the mass offset that changes sides with the stance foot, which pumps."""
    fall: float = 50.0
    """Reward that the end of an episode before its horizon costs."""
    trust: float = 1.0
    """Reward that it costs to deviate from the base agent's actions by 1, mean square over a plan."""
    scenarios: int = 4
    """0 to 64 draws of pushes, commands and goals that every plan is tried under, the same for all plans. 0 is for references: plans are tried under
    what the walker is going to meet, which no agent can know."""

    def __post_init__(self) -> None:
        for name, low, high in (
            ("steps", 1, 64), ("samples", 4, 4096), ("iterations", 1, 64), ("scenarios", 0, 64),
        ):  # fmt: skip
            require_count(name, getattr(self, name), low, high)
        require_number("window", self.window, 0.0, 1000.0, "(]")
        for name in ("fall", "trust"):
            require_number(name, getattr(self, name), 0.0, math.inf, "[)")
        if len(self.spread) != _DIRECTIONS or not any(self.spread):
            raise ValueError(
                f"spread must hold {_DIRECTIONS} numbers, not all 0, got {self.spread!r}"
            )
        for value in self.spread:
            require_number("spread", value, 0.0, 2.0)


class MpcController:
    """Plans some steps ahead at every step; ``attach`` it to the environment first.

    It has the whole state of the episode: the true section state, whatever noise the sensors have; the body; the command and when it runs out; the
    whole path. With scenarios it does not see what has yet to be drawn. The same seed makes the same decisions, whatever other walkers the
    environment has: random numbers depend on the seed and the episode's step alone.

    Parameters
    ----------
    task, options : the environment's
    base : an agent without memory, which plans deviate from
    settings : those tuned for the task otherwise
    seed : int >= 0, or ``ValueError``
    """

    def __init__(
        self,
        task: str,
        options: EnvOptions,
        base: Agent,
        settings: MpcSettings | None = None,
        seed: int = 0,
    ) -> None:
        self._task, self._options, self._base = task, options, base
        self._layout = ObservationLayout.of(task, options)
        self._settings = own = tuned("mpc", task, MpcSettings()) if settings is None else settings
        number = int(require_number("seed", seed, 0, 2**63))
        knots = sorted({int(share * own.steps) for share in _KNOTS})
        steps = np.arange(own.steps)
        self._steps_of_knots = np.stack(
            [np.interp(steps, knots, row) for row in np.eye(len(knots))], 1
        )
        sizes = (_TABLES, own.iterations, own.samples, len(knots), _DIRECTIONS)
        self._tables = np.random.default_rng((number, 0)).standard_normal(sizes)
        generator = np.random.default_rng((number, 1))
        self._keys = generator.integers(2**64, size=(_KEYS, own.scenarios), dtype=np.uint64)
        self._simulation: Simulation | None = None
        self._scratch: dict[int, Simulation] = {}

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
        self._scratch = {}

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
        simulation, own = self._walked(), self._settings
        seen = self._layout.require(observation)
        shape = seen.shape[:-1]
        if int(np.prod(shape)) != simulation.n:
            raise ValueError(
                f"observation must hold one for each of {simulation.n} walkers, got {seen.shape}"
            )
        plans = np.zeros((simulation.n, own.steps, _DIRECTIONS))
        if state is not None:
            plans[:, :-1] = state[0][:, 1:]
        if episode_start is not None:
            plans[np.reshape(episode_start, simulation.n)] = 0.0
        size = max(1, _BLOCK // (own.samples * max(own.scenarios, 1)))
        for first in range(0, simulation.n, size):
            block = np.arange(first, min(first + size, simulation.n))
            plans[block] = self._search(block, plans[block])
        base = self._base.predict(simulation.observations)[0]
        return self._deviating(simulation, base, plans[:, 0]).reshape(*shape, -1), (plans,)

    def copies(self, block: NDArray[np.int64], each: int) -> Simulation:
        """A simulation with ``each`` copies of every walker of a block, one walker's after another's; the next call may overwrite it."""
        original, rows = self._walked(), np.repeat(block, each)
        if len(rows) not in self._scratch:
            self._scratch[len(rows)] = Simulation(original.task, original.options, len(rows))
        copies = self._scratch[len(rows)]
        copies.settings[:] = original.settings
        copies.take_over(original, rows)
        copies.observations[:] = original.observations[rows]
        scenarios = self._settings.scenarios
        if scenarios:
            keys = self._keys[copies.walkers["steps"] % _KEYS]
            draws = np.arange(len(rows)) % scenarios
            copies.walkers["key"] = np.take_along_axis(keys, draws[:, None], axis=1)[:, 0]
            copies.walkers["counter"] = 0
        return copies

    def _search(self, block: NDArray[np.int64], left: Vector) -> Vector:
        """The best plans found for a block of walkers, (block, steps, directions), around what is left of their last ones."""
        own, each, n = self._settings, np.arange(len(block)), len(block)
        tables = self._tables[self._walked().walkers["steps"][block] % _TABLES]
        spread = np.array(own.spread)
        mean = np.zeros((n, *tables.shape[3:]))
        deviation = np.broadcast_to(spread, mean.shape)
        best, most = left, np.full(n, -np.inf)
        for iteration in range(own.iterations):
            tried = mean[:, None] + deviation[:, None] * tables[:, iteration]
            tried[:, 0] = mean
            plans = left[:, None] + np.einsum("hk,nmkd->nmhd", self._steps_of_knots, tried)
            if iteration == 0:
                plans[:, 1] = 0.0  # the base agent's own
            worth = self._worth(plans, block)
            found = worth.argmax(axis=1)
            is_better = worth[each, found] > most
            best = np.where(is_better[:, None, None], plans[each, found], best)
            most = np.maximum(most, worth[each, found])
            mean, deviation = _best_of(tried, worth, iteration == 0)
            deviation = np.maximum(deviation, _FLOOR * spread)
            if iteration == 0:
                # where the last plan's rest is worse than none, what was tried around it says nothing
                changes = (worth[:, 1] > worth[:, 0])[:, None, None]
                left = np.where(changes, 0.0, left)
                mean = np.where(changes, 0.0, mean)
                deviation = np.where(changes, 0.5 * spread, deviation)
        return best

    def _worth(self, plans: Vector, block: NDArray[np.int64]) -> Vector:
        """Worth (block, m) of plans (block, m, steps, directions), each by itself: the reward within the window, less what the settings say."""
        own, (n, m) = self._settings, plans.shape[:2]
        draws = max(own.scenarios, 1)
        copies = self.copies(block, m * draws)
        deviations = np.repeat(plans.reshape(n * m, own.steps, _DIRECTIONS), draws, axis=0)
        time = copies.walkers["time"]
        end = time + own.window
        worth, live = np.zeros(copies.n), np.ones(copies.n, dtype=np.bool_)
        for step in range(math.ceil(own.window / _SHORTEST_STEP)):
            actions = self._base.predict(copies.observations)[0]
            if step < own.steps:
                actions = self._deviating(copies, actions, deviations[:, step])
            copies.actions[:] = actions
            left = end - time
            copies.step_many(~live, 0, copies.n)
            # of the step that leaves the window, the share within it
            share = np.minimum(left / np.maximum(copies.walkers["duration"], 1e-9), 1.0)
            gained = copies.rewards * share - own.fall * copies.terminated
            worth += np.where(live, gained, 0.0)
            live &= ~copies.ends.any(axis=0) & (time < end)
            if not live.any():
                break
        strays = np.square(plans).mean(axis=(2, 3))
        return worth.reshape(n, m, draws).mean(axis=-1) - own.trust * strays

    def _deviating(self, simulation: Simulation, base: Any, deviations: Vector) -> Any:
        """Actions (n, 2) that deviate from the base agent's: by angle, offset to one side and offset that changes sides, (n, directions)."""
        side, angle, steady, alternating = simulation.walkers["side"], *deviations.T
        # actions of a mirrored environment are as of a left stance
        is_mirrored = self._options.mirror
        offset = side * steady + alternating if is_mirrored else steady + side * alternating
        changed = base + np.column_stack([angle, offset])
        return np.clip(changed, -1.0, 1.0).astype(np.float32)

    def _walked(self) -> Simulation:
        if self._simulation is None:
            raise RuntimeError("attach(env) must be called before predict: plans are tried on it")
        return self._simulation


def _best_of(tried: Vector, worth: Vector, has_base: bool) -> tuple[Vector, Vector]:
    """Mean and standard deviation of the best of what was tried; the base agent's plan was not drawn."""
    ranked = worth.copy()
    if has_base:
        ranked[:, 1] = -np.inf
    elites = max(2, worth.shape[1] // _ELITES)
    best = np.argpartition(-ranked, elites, axis=1)[:, :elites]
    chosen = np.take_along_axis(tried, best[:, :, None, None], axis=1)
    return chosen.mean(axis=1), chosen.std(axis=1)
