"""A batch's memory as tensors: numbers of the environment's own, and tensors that gradients flow through in place of some."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import torch
from torch import Tensor

from lean_yaw_env.envs import columns as c
from lean_yaw_env.parameters import Vector


class Columns:
    """An environment's memory (see ``lean_yaw_env.envs.columns``), column by column, each of shape (n,).

    Parameters
    ----------
    truth : shape (n, MEMORY)
        The environment's numbers.
    followed : column to tensor of shape (n,)
        The same numbers as functions of what came before.
    """

    def __init__(self, truth: Tensor, followed: Mapping[int, Tensor]) -> None:
        self.truth = truth
        self.followed = dict(followed)

    @classmethod
    def of(cls, memory: Vector) -> Columns:
        """A copy of an environment's memory, with nothing followed."""
        return cls(torch.from_numpy(memory.copy()), {})

    def __getitem__(self, column: int) -> Tensor:
        found = self.followed.get(column)
        return self.truth[:, column] if found is None else found

    def with_task_of(self, other: Columns) -> Columns:
        """These columns, but the task's own, as its commands, of another moment."""
        truth = torch.cat([self.truth[:, : c.TASK], other.truth[:, c.TASK :]], dim=1)
        return Columns(truth, self.followed)

    def restarted(self, rows: Tensor, memory: Vector) -> Columns:
        """These columns, but those rows (bool, shape (n,)) anew from memory, where gradients end."""
        truth = torch.from_numpy(memory.copy())
        followed = {
            column: torch.where(rows, truth[:, column], tensor)
            for column, tensor in self.followed.items()
        }
        return Columns(truth, followed)


def wrapped(angle: Tensor) -> Tensor:
    """An angle's equal between -pi and pi."""
    turn = 2.0 * np.pi
    return angle - turn * torch.floor(angle.detach() / turn + 0.5)


def mean_heading(memory: Columns) -> Tensor:
    """Mean heading of the last two footprints."""
    return 0.5 * (memory[c.HEADING] + memory[c.PREVIOUS_HEADING])


def middle_place(memory: Columns) -> tuple[Tensor, Tensor]:
    """Where the walker is, downhill and to the right: below the middle of the hips."""
    aside = 0.5 * memory[c.SIDE] * memory[c.BODY]
    heading = memory[c.HEADING]
    return (
        memory[c.PLACE_X] + aside * torch.sin(heading),
        memory[c.PLACE_Z] + aside * torch.cos(heading),
    )
