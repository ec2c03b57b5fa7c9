"""What plans are worth: many of them walked by the environment's own compiled steps, in a simulation copied from the episode's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.envs.options import ACTION_SIZE
from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.parameters import Vector

from ..agent import Agent
from .mpc_settings import MpcSettings

_KEYS = 64  # sets of scenarios, one for each step of an episode in turn
_LARGEST_PUSH = 10.0  # push level that there is
_OFFSET = 1  # the action that says which way the masses go


class _Account:
    """Running worth of plans, row by row; of rewards and durations the last two steps'."""

    def __init__(self, times: Vector) -> None:
        n = len(times)
        self.worth, self.start = np.zeros(n), times.copy()
        self.live = np.ones(n, dtype=np.bool_)
        self.rewards = np.zeros((2, n))
        self.durations = np.full((2, n), 1e-9)  # divided by only once there is one


class Rollouts:
    """Simulates plans on copies of the walkers and returns their worth.

    The worth of a plan is the task's reward within a window of time. The simulation has the whole state of the episode: the true section
    state, whatever noise the sensors have; the body; the command and when it runs out; the whole path. It does not see what has yet to be
    drawn. Without scenarios nobody pushes, and where the task draws something new, a command or a goal, a plan ends; with
    scenarios, numbers are drawn from keys of its own.

    The environment's simulation is read, never changed; ``base``, which remembers nothing, walks the tail; ``seed`` is that of the scenarios.
    """

    def __init__(
        self, simulation: Simulation, settings: MpcSettings, base: Agent, seed: int
    ) -> None:
        self._simulation = simulation
        self._settings = settings
        self._base = base
        options = simulation.options
        level = options.for_task(simulation.task).push_level
        self._quiet = replace(options, push_level=0.0, sensor_noise=0.0, hidden_rates=False)
        scale = settings.push_scale if settings.scenarios else 0.0
        self._pushed = replace(self._quiet, push_level=min(scale * level, _LARGEST_PUSH))
        generator = np.random.default_rng((seed, 1))
        self._keys = generator.integers(
            2**64, size=(_KEYS, max(settings.scenarios, 1)), dtype=np.uint64
        )
        self._scratch: dict[tuple[int, bool], Simulation] = {}

    def sides(self, block: NDArray[np.int64]) -> Vector:
        """What turns an offset in space into an action and back, (block,): actions of a mirrored environment are as of a left stance."""
        sides = self._simulation.walkers["side"][block]
        return sides if self._quiet.mirror else np.ones_like(sides)

    def base_plans(self, block: NDArray[np.int64]) -> Vector:
        """The base controller's actions from here on if nobody pushes, (block, horizon, 2), offsets in space."""
        n, horizon = len(block), self._settings.horizon
        copies = self._copied(block, 1, is_pushed=False)
        plans = np.zeros((n, horizon, ACTION_SIZE))
        ended = np.zeros(n, dtype=np.bool_)
        for step in range(horizon):
            actions = self._base.predict(copies.observations)[0]
            plans[:, step] = actions
            plans[:, step, _OFFSET] *= self._signs(copies)
            copies.actions[:] = actions
            copies.step_many(ended, 0, n)
            ended |= copies.ends.any(axis=0)
        return plans

    def worth(self, plans: Vector, block: NDArray[np.int64]) -> Vector:
        """Worth (block, m) of plans (block, m, horizon, 2), each by itself, in reward."""
        settings = self._settings
        n, m = plans.shape[:2]
        draws = max(settings.scenarios, 1)
        copies = self._copied(block, m * draws, is_pushed=True)
        actions = np.repeat(plans.reshape(n * m, settings.horizon, ACTION_SIZE), draws, axis=0)
        account = _Account(copies.walkers["time"])
        last = settings.horizon + settings.tail - 1
        for step in range(last + 1):
            if step < settings.horizon:
                copies.actions[:] = actions[:, step]
                copies.actions[:, _OFFSET] *= self._signs(copies)
            else:
                copies.actions[:] = self._base.predict(copies.observations)[0]
            copies.step_many(~account.live, 0, copies.n)
            self._update_account(copies, account, step, step == last)
            if not account.live.any():
                break
        return account.worth.reshape(n, m, draws).mean(axis=-1)

    def _update_account(
        self, copies: Simulation, account: _Account, step: int, is_last: bool
    ) -> None:
        """Take a step into the account; one that the solver gave up counts as a fall."""
        settings, walkers = self._settings, copies.walkers
        terminated, truncated = copies.ends
        falls = account.live & terminated
        rewards = copies.rewards - settings.step_price
        account.worth += np.where(account.live, rewards, 0.0) - settings.fall * falls
        account.rewards[step % 2, account.live] = rewards[account.live]
        account.durations[step % 2, account.live] = walkers["duration"][account.live]
        elapsed = walkers["time"] - account.start
        window = np.minimum(settings.window, copies.settings["horizon"] - account.start)
        ends = (elapsed >= window) | truncated | is_last
        if not settings.scenarios:
            ends |= walkers["counter"] > 0  # the task drew something
        ends &= account.live & ~falls
        rate = account.rewards.sum(axis=0) / account.durations.sum(axis=0)
        account.worth += np.where(ends, rate * (window - elapsed), 0.0)
        account.live &= ~(ends | falls)

    def _copied(self, block: NDArray[np.int64], copies: int, *, is_pushed: bool) -> Simulation:
        """A simulation with as many copies of each walker of the block."""
        n = len(block) * copies
        simulation = self._scratch.get((n, is_pushed))
        if simulation is None:
            options = self._pushed if is_pushed else self._quiet
            simulation = Simulation(self._simulation.task, options, n)
            self._scratch[n, is_pushed] = simulation
        simulation.take_over(self._simulation, np.repeat(block, copies))
        keys = self._keys[self._simulation.walkers["steps"][block] % _KEYS]
        repeats = -(-copies // keys.shape[1])
        simulation.walkers["key"] = np.tile(keys, (1, repeats))[:, :copies].ravel()
        simulation.walkers["counter"] = 0
        simulation.ends[:] = False
        simulation.observe()  # without noise
        return simulation

    def _signs(self, copies: Simulation) -> Vector | float:
        return copies.walkers["side"] if self._quiet.mirror else 1.0
