"""Walkers at a task whose steps are differentiable: the compiled environment walks, and its exact Jacobians carry the gradients back."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from torch import Tensor
from torch.autograd import Function
from torch.autograd.function import once_differentiable

from lean_yaw_env.envs.derivatives import FOLLOWED, LinearisedSteps
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.sb3 import WalkerVecEnv
from lean_yaw_env.registration import TASK_VERSIONS
from lean_yaw_env.validation import require_choice

_OFFSET = FOLLOWED.index("mass_offset")


class Steps(NamedTuple):
    """A step of n walkers, with gradients; in a window of steps, each with an axis for the steps in front.

    Attributes
    ----------
    before : shape (n, features)
        Observations before the step.
    observations : shape (n, features)
        After the step: where it ended an episode, that episode's last ones.
    rewards, durations : shape (n,)
    terminated, truncated : bool, shape (n,)
    returns, lengths : shape (n,)
        Of the episodes so far, without gradients; of the whole episode where this step ended one.
    """

    before: Tensor
    observations: Tensor
    rewards: Tensor
    durations: Tensor
    terminated: Tensor
    truncated: Tensor
    returns: Tensor
    lengths: Tensor


class DifferentiableWalkers:
    """``n`` walkers of an environment, whose observations and rewards are the environment's own.

    Attributes
    ----------
    observations : shape (n, features)
        Of the steps to come, with gradients to the steps since the last ``cut``.

    Raises
    ------
    ValueError
        If there is no such task, or actions are delayed: gradients would have to follow the commands on their way too.
    """

    def __init__(self, task: str, options: EnvOptions, n: int, *, threads: int = 1) -> None:
        require_choice("task", task, TASK_VERSIONS)
        if options.action_delay:
            raise ValueError("action_delay must be False for walkers that gradients flow through")
        self._saved = WalkerVecEnv(n, task, threads=threads, **vars(options))
        self.env = self._saved.walkers
        # the last numbers of an ended episode are still needed
        self.env.autoreset_mode = AutoresetMode.DISABLED
        self._simulation = self.env.simulation
        self._linearised = LinearisedSteps(self._simulation, threads=threads)
        self._returns, self._lengths = np.zeros(n), np.zeros(n, dtype=np.int64)

    def reset(self, seed: int) -> Tensor:
        """Begin episodes of all walkers, walker i seeded ``seed + i``."""
        self.env.reset(seed=seed)
        self._returns[:], self._lengths[:] = 0.0, 0
        return self.cut()

    def cut(self) -> Tensor:
        """Let no gradient of what follows reach what came before."""
        self._followed = torch.from_numpy(self._linearised.values())
        self.observations = torch.from_numpy(self._simulation.observations.astype(float))
        return self.observations

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """Copies of all that the walkers' next steps depend on; only after ``reset``, and right for a moment at which gradients are cut."""
        episodes = {"episode_returns": self._returns, "episode_lengths": self._lengths}
        return self._saved.snapshot() | {name: each.copy() for name, each in episodes.items()}

    def restore(self, snapshot: dict[str, NDArray[Any]]) -> None:
        """Bring the walkers to a snapshot's state, or raise ``ValueError`` if it is of other walkers."""
        self._saved.restore(snapshot)
        self._returns[:] = snapshot["episode_returns"]
        self._lengths[:] = snapshot["episode_lengths"]
        self.cut()

    def step(self, actions: Tensor) -> Steps:
        """Walk one step each by actions (n, 2); walkers whose episode ended begin another, to which no gradient leads.

        Raises
        ------
        ValueError
            If an action is not a number.
        """
        inputs = torch.cat([self._followed, self._commanded(actions)], dim=1)
        self._linearised.prepare()
        _, rewards, terminated, truncated, _ = self.env.step(actions.detach().numpy())
        outputs = with_known_jacobians(
            inputs,
            torch.from_numpy(self._outputs()),
            torch.from_numpy(self._linearised.jacobians()),
        )
        self._returns += rewards
        self._lengths += 1
        size, before = self._followed.shape[1], self.observations
        self._followed, self.observations = outputs[:, :size], outputs[:, size:-2]
        done = (terminated, truncated, self._returns.copy(), self._lengths.copy())
        step = Steps(
            before, self.observations, outputs[:, -2], outputs[:, -1], *map(torch.from_numpy, done)
        )
        self._restart(terminated | truncated)
        return step

    def _commanded(self, actions: Tensor) -> Tensor:
        """Inter-leg angle, offset and effort, shape (n, 3), as an action commands them."""
        simulation = self._simulation
        settings = simulation.settings[0]
        zero = torch.zeros_like(actions[:, 0])
        first, second = (bounded(actions[:, k], zero, 1.0) for k in (0, 1))
        sides = simulation.walkers["side"] if settings["mirror"] else np.ones(simulation.n)
        wanted = torch.from_numpy(sides.copy()) * settings["mass_offset_range"] * second
        angle = settings["inter_leg_angle"] + settings["inter_leg_angle_range"] * first
        offset = bounded(wanted, self._followed[:, _OFFSET], float(settings["max_offset_change"]))
        return torch.stack([angle, offset, 0.5 * (first * first + second * second)], dim=1)

    def _outputs(self) -> NDArray[np.float64]:
        """The numbers of the step just made, as the Jacobians' rows name them; a fall takes no time here, and time ends at the horizon."""
        simulation, walkers = self._simulation, self._simulation.walkers
        durations = np.where(simulation.terminated, 0.0, walkers["share"] * walkers["duration"])
        observations = simulation.observations.astype(np.float64)
        return np.column_stack(
            [self._linearised.values(), observations, simulation.rewards, durations]
        )

    def _restart(self, ended: NDArray[np.bool_]) -> None:
        """Begin new episodes where they ended."""
        if not ended.any():
            return
        self._returns[ended], self._lengths[ended] = 0.0, 0
        fresh, _ = self.env.reset(options={"reset_mask": ended})
        mask, observed = torch.from_numpy(ended)[:, None], torch.from_numpy(fresh.astype(float))
        values = torch.from_numpy(self._linearised.values())
        self._followed = torch.where(mask, values, self._followed)
        self.observations = torch.where(mask, observed, self.observations)


class _Known(Function):
    """Values computed elsewhere, with the Jacobian that goes with them."""

    @staticmethod
    def forward(ctx: Any, inputs: Tensor, values: Tensor, jacobians: Tensor) -> Tensor:
        ctx.save_for_backward(jacobians)
        return values.clone()

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None, None]:
        (jacobians,) = ctx.saved_tensors
        return torch.einsum("nk,nkj->nj", gradient, jacobians), None, None


def with_known_jacobians(inputs: Tensor, values: Tensor, jacobians: Tensor) -> Tensor:
    """``values`` (n, k), which compiled code computed from ``inputs`` (n, j), as a differentiable function of them with Jacobians (n, k, j)."""
    return _Known.apply(inputs, values, jacobians)  # pyright: ignore[reportReturnType]


class _Bounded(Function):
    @staticmethod
    def forward(ctx: Any, value: Tensor, middle: Tensor, reach: float) -> Tensor:
        low, high = middle - reach, middle + reach
        ctx.save_for_backward(value < low, value > high)
        return torch.minimum(torch.maximum(value, low), high)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, Tensor, None]:
        below, above = ctx.saved_tensors
        by_value = torch.where(below, gradient.clamp(max=0.0), gradient)
        by_value = torch.where(above, gradient.clamp(min=0.0), by_value)
        return by_value, torch.where(below | above, gradient, 0.0), None


def bounded(value: Tensor, middle: Tensor, reach: float) -> Tensor:
    """``value`` kept within ``reach`` of ``middle``, each of shape (n,), with a derivative for descent on a loss.

    The true derivative by a value that is out of bounds is zero, from which descent never comes back. Here it is that at the bound
    where descent would bring the value back, and zero where it would lead further out, as in a projected gradient.
    """
    return _Bounded.apply(value, middle, reach)  # pyright: ignore[reportReturnType]


def time_discounted_returns(
    window: Steps, next_values: Tensor, time_constant: float, trace: float
) -> Tensor:
    """The lambda-return from each step on, shape (window, n).

    A step's discount is exp(-duration / time constant), and its reward, spread evenly over its duration, is discounted within the step
    too: a policy gains nothing by the length of its steps as such. After a fall nothing more is earned.

    Parameters
    ----------
    next_values : shape (window, n)
        The critic's, after each step.
    trace : lambda, from 0 (one step, then the critic) to 1 (the whole window, then the critic)
    """
    ratio = window.durations / time_constant
    lives = ~window.terminated
    # the limit for a step that took no time, which a fall may do
    within = torch.where(lives, -torch.expm1(-ratio) / torch.where(lives, ratio, 1.0), 1.0)
    rewards = window.rewards * within
    discounts = torch.where(lives, torch.exp(-ratio), 0.0)
    ends = window.terminated | window.truncated
    onward = next_values[-1]
    returns: list[Tensor] = []
    for step in range(len(rewards) - 1, -1, -1):
        value = next_values[step]
        mixed = torch.where(ends[step], value, value + trace * (onward - value))
        onward = rewards[step] + discounts[step] * mixed
        returns.append(onward)
    return torch.stack(returns[::-1])
