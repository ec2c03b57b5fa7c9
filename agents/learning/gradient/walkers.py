"""Walkers at a task whose steps gradients flow through: the compiled environment walks, the exact Jacobians lead back."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from torch import Tensor

from agents.learning.gradient.columns import Columns, mean_heading, wrapped
from agents.learning.gradient.differentiation import bounded, with_known_jacobians
from agents.learning.gradient.tasks import StepTaken, formulas_of
from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.sb3 import WalkerVecEnv
from lean_yaw_env.envs.transition import (
    OBSERVATION_LIMIT,
    OFFSET_SCALE,
    STATE_CENTRES,
    STATE_SCALES,
)
from lean_yaw_env.kernel.jacobian import INPUTS, OUTPUTS
from lean_yaw_env.kernel.jacobians import step_jacobians
from lean_yaw_env.kernel.records import Outcome
from lean_yaw_env.parameters import STATE_SIZE
from lean_yaw_env.threads import share_out

_OUTPUT_COLUMNS = [Outcome._fields.index(name) for name in OUTPUTS]
_DURATION, _X, _Z, _OFFSET, _WORK = range(STATE_SIZE, len(OUTPUTS))
_ODD = (c.HEADING, c.ANKLE, c.ANKLE_RATE)
"""What of the state changes sign in a mirror image."""
_RATES = (c.PITCH_RATE, c.ANKLE_RATE)


class Walked(NamedTuple):
    """What came of a step, with gradients; each of shape (n,), but for observations.

    Attributes
    ----------
    observations : shape (n, features)
        After the step: where it ended an episode, that episode's last ones.
    rewards, durations
    terminated, truncated : bool
    returns, lengths : of the episodes so far, without gradients; whole where this step ended one
    """

    observations: Tensor
    rewards: Tensor
    durations: Tensor
    terminated: Tensor
    truncated: Tensor
    returns: Tensor
    lengths: Tensor


class DifferentiableWalkers:
    """``n`` walkers of an environment. All numbers are the environment's own; the formulas beside it serve derivatives alone.

    Parameters
    ----------
    task : str
    options : EnvOptions
    n : int >= 1
    threads : int >= 1

    Attributes
    ----------
    observations : shape (n, features)
        Of the steps to come, with gradients to the steps since the last ``cut``.

    Raises
    ------
    ValueError
        If the task has no differentiable formulas, or actions are delayed: those would need the commands on their way followed too.
    """

    def __init__(self, task: str, options: EnvOptions, n: int, *, threads: int = 1) -> None:
        self._formulas = formulas_of(task)
        if options.action_delay:
            raise ValueError("action_delay must be False for walkers that gradients flow through")
        self.options = options
        self._saved = WalkerVecEnv(n, task, threads=threads, **vars(options))
        self.env = self._saved.walkers
        # the last numbers of an ended episode are still needed
        self.env.autoreset_mode = AutoresetMode.DISABLED
        self._settings = self.env.rows.settings.tolist()
        self._jacobians = np.zeros((n, len(OUTPUTS), INPUTS))
        self._scratch = (np.zeros(n), np.zeros((n, STATE_SIZE)))
        self._returns, self._lengths = np.zeros(n), np.zeros(n, dtype=np.int64)

    def reset(self, seed: int) -> Tensor:
        """Begin episodes of all walkers, walker i seeded ``seed + i``."""
        observations, _ = self.env.reset(seed=seed)
        self._returns[:], self._lengths[:] = 0.0, 0
        return self._begin_from(observations)

    def cut(self) -> Tensor:
        """Let no gradient of what follows reach what came before."""
        return self._begin_from(self.env.rows.observations)

    def _begin_from(self, observations: NDArray[np.float32]) -> Tensor:
        """The environment's memory and observations as they are, with no gradients."""
        self._memory = Columns.of(self.env.rows.memory)
        self.observations = torch.from_numpy(observations.astype(float))
        return self.observations

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """Copies of all that the walkers' next steps depend on; only after ``reset``, and right for a moment at which gradients are cut."""
        return self._saved.snapshot() | {
            "episode_returns": self._returns.copy(),
            "episode_lengths": self._lengths.copy(),
        }

    def restore(self, snapshot: dict[str, NDArray[Any]]) -> None:
        """Bring the walkers to a snapshot's state, or raise ``ValueError`` if it is of other walkers."""
        self._saved.restore(snapshot)
        self._returns[:], self._lengths[:] = (
            snapshot["episode_returns"],
            snapshot["episode_lengths"],
        )
        self._begin_from(self.env.rows.observations)

    def step(self, actions: Tensor) -> Walked:
        """Walk one step each by actions (n, 2); walkers whose episode ended begin another, to which no gradient leads.

        Raises
        ------
        ValueError
            If an action is not a number.
        SolverError
            If the solver gives up on a step.
        """
        before = self._memory
        command, effort = self._command(before, actions)
        _, rewards, terminated, truncated, _ = self.env.step(actions.detach().numpy())
        outputs = self._walk(before, command)
        after = self._moved(before, outputs)
        taken = StepTaken(outputs[:, _DURATION], outputs[:, _WORK], effort)
        reward = self._formulas.reward(after.with_task_of(before), taken)
        after.followed |= self._formulas.kept(after, taken.duration)
        self._returns += rewards
        self._lengths += 1
        lives = torch.from_numpy(~terminated)
        walked = Walked(
            self._exact(self._observe(after)),
            _valued(torch.where(lives, reward, 0.0), torch.from_numpy(rewards)),
            torch.where(lives, taken.duration, 0.0),
            ~lives,
            torch.from_numpy(truncated),
            torch.from_numpy(self._returns.copy()),
            torch.from_numpy(self._lengths.copy()),
        )
        self._go_on(after, walked, terminated | truncated)
        return walked

    def _command(self, memory: Columns, actions: Tensor) -> tuple[Tensor, Tensor]:
        """Inter-leg angle, offset and the offset before, shape (n, 3), as an action commands them; and the action's effort."""
        settings = self._settings
        zero = torch.zeros_like(actions[:, 0])
        first, second = (bounded(actions[:, k], zero, 1.0) for k in (0, 1))
        angle = settings[c.BASE_ANGLE] + settings[c.ANGLE_RANGE] * first
        wanted = self._sign(memory) * settings[c.OFFSET_RANGE] * second
        offset = bounded(wanted, memory[c.OFFSET], settings[c.OFFSET_CHANGE])
        command = torch.stack([angle, offset, memory[c.OFFSET]], dim=1)
        return command, 0.5 * (first * first + second * second)

    def _walk(self, before: Columns, command: Tensor) -> Tensor:
        """The step's ``OUTPUTS``, shape (n, 10), which the environment has just computed, as a function of state and command."""
        rows, jacobians = self.env.rows, self._jacobians
        commands, states, sides = rows.kernel_rows
        statuses, afters = self._scratch
        share_out(
            lambda first, last: step_jacobians(
                rows.bodies, commands, states, sides, statuses, afters, jacobians, first, last
            ),
            self.env.num_envs,
            self.env.threads,
        )
        # a fall has no step to differentiate: its derivatives may be anything, and its duration, by which speeds divide, zero
        jacobians[rows.terminated] = 0.0
        inputs = torch.cat(
            [torch.stack([before[k] for k in range(STATE_SIZE)], dim=1), command], dim=1
        )
        values = rows.outcomes[:, _OUTPUT_COLUMNS]
        values[rows.terminated, _DURATION] = 1.0
        return with_known_jacobians(
            inputs, torch.from_numpy(values), torch.from_numpy(jacobians.copy())
        )

    def _moved(self, before: Columns, outputs: Tensor) -> Columns:
        """Memory after a step and its push."""
        after = Columns.of(self.env.rows.memory)
        followed = {k: outputs[:, k] for k in range(STATE_SIZE)}
        for rate, push in zip(_RATES, (c.PITCH_PUSH, c.ANKLE_PUSH), strict=True):
            followed[rate] = followed[rate] + after[push]
        x, z = outputs[:, _X], outputs[:, _Z]
        followed[c.PREVIOUS_HEADING] = before[c.HEADING]
        followed[c.OFFSET] = outputs[:, _OFFSET]
        followed[c.PLACE_X] = before[c.PLACE_X] + x
        followed[c.PLACE_Z] = before[c.PLACE_Z] + z
        after.followed = before.followed | followed
        heading = mean_heading(after)
        after.followed[c.ADVANCE] = x * torch.cos(heading) - z * torch.sin(heading)
        return after

    def _sign(self, memory: Columns) -> Tensor:
        """-1 for walkers that are shown as their mirror images."""
        side = memory[c.SIDE]
        return side if self.options.mirror else torch.ones_like(side)

    def _observe(self, memory: Columns) -> Tensor:
        """The observation without noise, shape (n, features)."""
        sign = self._sign(memory)
        shown: list[Tensor] = []
        for k in range(STATE_SIZE):
            value = wrapped(memory[k]) if k == c.HEADING else memory[k]
            value = sign * value if k in _ODD else value
            if k == c.HEADING and self._settings[c.HIDES_HEADING]:
                value = torch.zeros_like(value)
            shown.append((value - STATE_CENTRES[k]) / STATE_SCALES[k])
        shown.append(sign * memory[c.OFFSET] / OFFSET_SCALE)
        if not self.options.mirror:
            shown.append(memory[c.SIDE])
        shown += self._formulas.features(memory, sign)
        limited = torch.stack(shown, dim=1).clamp(-OBSERVATION_LIMIT, OBSERVATION_LIMIT)
        if self.options.hidden_rates:
            seen = torch.ones(limited.shape[1], dtype=limited.dtype)
            seen[list(_RATES)] = 0.0
            limited = limited * seen
        return limited

    def _exact(self, observations: Tensor) -> Tensor:
        """Observations with the environment's own numbers, noise included."""
        return _valued(observations, torch.from_numpy(self.env.rows.observations.astype(float)))

    def _go_on(self, after: Columns, walked: Walked, ended: np.ndarray) -> None:
        """Begin new episodes where they ended."""
        self._memory, self.observations = after, walked.observations
        if not ended.any():
            return
        fresh, _ = self.env.reset(options={"reset_mask": ended})
        mask = torch.from_numpy(ended)
        self._memory = after.restarted(mask, self.env.rows.memory)
        start = torch.from_numpy(fresh.astype(float))
        self.observations = torch.where(mask[:, None], start, walked.observations)
        self._returns[ended], self._lengths[ended] = 0.0, 0


def _valued(formula: Tensor, values: Tensor) -> Tensor:
    """A formula's derivatives with values computed elsewhere."""
    return formula + (values - formula).detach()
