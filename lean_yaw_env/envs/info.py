"""What ``info`` tells: one table of names and where each number comes from, filled in one compiled call for one walker or many."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.envs import columns as c
from lean_yaw_env.envs.options import BODY_NAMES
from lean_yaw_env.envs.tasks import Task
from lean_yaw_env.kernel.compilation import entry_point
from lean_yaw_env.kernel.records import Outcome
from lean_yaw_env.parameters import STATE_SIZE, Vector
from lean_yaw_env.threads import share_out
from lean_yaw_env.walker import FALL_OF_STATUS


class Source(IntEnum):
    """Where a number of ``info`` is read."""

    MEMORY = 0
    OUTCOME = 1
    QUOTIENT = 2
    SPEED = 3


_MEMORY_FIELDS = (
    ("stance_side", c.SIDE),
    ("mass_offset", c.OFFSET),
    ("inter_leg_angle", c.INTER_LEG_ANGLE),
    ("commanded_offset", c.COMMANDED_OFFSET),
    ("time", c.TIME),
    ("steps", c.STEPS),
    ("distance", c.DISTANCE),
)
_OUTCOME_FIELDS = (
    "duration",
    "least_normal_force",
    "greatest_friction",
    "gravity_work",
    "shift_work",
    "impact_loss",
    "ankle_loss",
)
_FIRST_SCALAR = STATE_SIZE + 2  # after the state and the footprint


class InfoTable:
    """The numbers of ``info`` for a task and its settings, in order.

    ``state`` (5,) and ``footprint`` (2,) come first, then scalars: see ``describe``. ``fall`` is the way the walker fell in this step, or None.
    """

    def __init__(self, task: Task, settings: Vector) -> None:
        rows = [(Source.MEMORY, k, 0) for k in range(STATE_SIZE)]
        rows += [(Source.MEMORY, c.PLACE_X, 0), (Source.MEMORY, c.PLACE_Z, 0)]
        names: list[str] = []
        for name, column in _MEMORY_FIELDS:
            names.append(name)
            rows.append((Source.MEMORY, column, 0))
        for name in _OUTCOME_FIELDS:
            names.append(name)
            rows.append((Source.OUTCOME, Outcome._fields.index(name), 0))
        names.append("speed")
        rows.append((Source.SPEED, 0, 0))
        for name, metric in task.metrics.items():
            names.append(name)
            kind = Source.MEMORY if metric.divisor is None else Source.QUOTIENT
            rows.append((kind, metric.column, metric.divisor or 0))
        memory_fields: list[tuple[str, int]] = []
        if task.command_column is not None:
            memory_fields.append(("commanded_heading", task.command_column))
        if settings[c.PITCH_PUSH_SIZE] > 0.0 or settings[c.ANKLE_PUSH_SIZE] > 0.0:
            memory_fields += [("pitch_push", c.PITCH_PUSH), ("ankle_push", c.ANKLE_PUSH)]
        if settings[c.BODY_DRAW] > 0.0:
            memory_fields += [(name, c.BODY + k) for k, name in enumerate(BODY_NAMES)]
        for name, column in memory_fields:
            names.append(name)
            rows.append((Source.MEMORY, column, 0))
        self.names = tuple(names)
        self.sources = np.array(rows, dtype=np.int64)
        keys = ("state", "footprint", *names, "fall")
        self._masks = tuple(f"_{key}" for key in keys)
        self._template: dict[str, Any] = dict.fromkeys(keys)

    def fill(self, memory: Vector, outcomes: Vector, threads: int = 1) -> Vector:
        """A fresh array (numbers, walkers)."""
        n = len(memory)
        table = np.empty((len(self.sources), n))
        if threads == 1 or n < _WORTH_SHARING:
            fill_info(table, memory, outcomes, self.sources, 0, n)
        else:
            share_out(
                lambda first, last: fill_info(table, memory, outcomes, self.sources, first, last),
                n,
                threads,
            )
        return table

    def one(self, table: Vector, status: float) -> dict[str, Any]:
        """The info of a single environment."""
        column = table[:, 0]
        info = self._template.copy()  # a copy that is filled is quicker than a dict that grows
        info.update(zip(self.names, column[_FIRST_SCALAR:].tolist(), strict=True))
        info["state"] = column[:STATE_SIZE]
        info["footprint"] = column[STATE_SIZE:_FIRST_SCALAR]
        fall = FALL_OF_STATUS.get(status)
        if fall is not None:
            info["fall"] = fall.value
        return info

    def many(self, table: Vector, statuses: Vector, mask: NDArray[np.bool_]) -> dict[str, Any]:
        """The infos of a vector environment, each key beside its mask; numbers outside the mask are zero."""
        if not mask.all():
            table[:, ~mask] = 0.0
        falls = np.full(len(mask), None, dtype=object)
        for i in np.flatnonzero((statuses > _STEPPED) & mask):
            falls[i] = FALL_OF_STATUS[statuses[i]].value
        info: dict[str, Any] = {
            "state": table[:STATE_SIZE].T,
            "footprint": table[STATE_SIZE:_FIRST_SCALAR].T,
            **dict(zip(self.names, table[_FIRST_SCALAR:], strict=True)),
            "fall": falls,
        }
        info.update(dict.fromkeys(self._masks, mask))
        return info


_STEPPED = 2.0
# Copying a walker's numbers takes a fifth of its step's time: fewer walkers than these are copied while a helper wakes up.
_WORTH_SHARING = 8192
_MEMORY, _OUTCOME, _QUOTIENT = (int(s) for s in (Source.MEMORY, Source.OUTCOME, Source.QUOTIENT))


@entry_point()
def fill_info(table, memory, outcomes, sources, first, last):
    """Fill ``table`` (numbers, walkers) from the rows that ``sources`` names, for walkers ``first`` to ``last`` - 1."""
    for k in range(sources.shape[0]):
        kind, a, b = sources[k, 0], sources[k, 1], sources[k, 2]
        for i in range(first, last):
            if kind == _MEMORY:
                table[k, i] = memory[i, a]
            elif kind == _OUTCOME:
                table[k, i] = outcomes[i, a]
            elif kind == _QUOTIENT:
                table[k, i] = memory[i, a] / memory[i, b] if memory[i, b] > 0.0 else 0.0
            else:
                duration = outcomes[i, c.OUTCOME_DURATION]
                table[k, i] = memory[i, c.ADVANCE] / duration if duration > 0.0 else 0.0
