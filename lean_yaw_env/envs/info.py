"""The contents of ``info``: one table of names, meanings and where each number is read, for one walker and for many.

A step's numbers are written to a row for each walker, by code that is compiled from the table into each task's ``outputs.write_outputs``.
"""

from __future__ import annotations

import sys
from collections import deque
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.envs.state import BODY_NAMES, WALKER_FIELDS
from lean_yaw_env.envs.tasks.task import Metric, Task
from lean_yaw_env.kernel import records
from lean_yaw_env.kernel.compilation import written_formula
from lean_yaw_env.parameters import STATE_FIELDS, STATE_SIZE, Vector
from lean_yaw_env.walker import FALL_OF_STATUS

Flags = NDArray[np.bool_]


class FallCode(IntEnum):
    """How a step ended, the value of ``info["fall"]``; ``lean_yaw_env.Fall`` describes the falls."""

    NONE = 0
    """The step was completed."""
    BACKWARD = int(records.BACKWARD - records.STEPPED)
    SIDEWAYS = int(records.SIDEWAYS - records.STEPPED)
    TRIP = int(records.TRIP - records.STEPPED)
    LIFT_OFF = int(records.LIFT_OFF - records.STEPPED)
    SLIP = int(records.SLIP - records.STEPPED)
    NO_HEEL_STRIKE = int(records.NO_STRIKE - records.STEPPED)
    SOLVER = int(records.FAILED - records.STEPPED)
    """No fall: the integrator failed, and the episode ends where the step began."""

    @property
    def word(self) -> str | None:
        """The fall's name as ``lean_yaw_env.Fall`` has it, "solver", or None for no fall."""
        if self is FallCode.SOLVER:
            return "solver"
        fall = FALL_OF_STATUS.get(float(self) + records.STEPPED)
        return None if fall is None else fall.value


class Info(NamedTuple):
    """One key of ``info``: the expression in ``walker`` and ``task`` that gives its number, its unit, and what it means."""

    key: str
    source: str
    unit: str
    meaning: str


_FIELDS = {field.name: field for field in WALKER_FIELDS}


def _of_walker(name: str, key: str = "", condition: str = "") -> Info:
    """A field of the walker's record, under its own name or another one."""
    field = _FIELDS[name]
    return Info(key or name, f"walker.{name}", field.unit, field.meaning + condition)


_STEP_FIELDS = (
    "mass_offset", "inter_leg_angle", "commanded_offset", "time", "steps", "distance", "duration",
    "least_normal_force", "greatest_friction", "gravity_work", "shift_work", "impact_loss",
    "ankle_loss", "speed",
)  # fmt: skip
_COMMON = (_of_walker("side", "stance_side"), *map(_of_walker, _STEP_FIELDS))
_PUSH = tuple(_of_walker(name, condition="; with pushes") for name in ("pitch_push", "ankle_push"))
_BODY = tuple(_of_walker(name, condition="; with random bodies or slopes") for name in BODY_NAMES)
_HEADING = Info("commanded_heading", "", "rad", "of tasks that command one")
_STATE = "section state (5,), not mirrored, after the push if there is one"
_FOOTPRINT = "contact reference point of the stance foot (2,): downhill, right, from the start"
_CODES = ", ".join(f"{code.value} {code.word or 'none'}" for code in FallCode)

INFOS = (
    Info("state", "", "", _STATE),
    Info("footprint", "", "leg lengths", _FOOTPRINT),
    *_COMMON,
    Info("fall", "walker.fall", "", f"how the last step ended, as an integer: {_CODES}"),
)
"""Of every task."""
OPTIONAL_INFOS = (_HEADING, *_PUSH, *_BODY)

_ARRAYS = (*(f"walker.{field.name}" for field in STATE_FIELDS), "walker.place_x", "walker.place_z")
_FIRST_NUMBER = len(_ARRAYS)
_MOST_TABLES = 3  # looked through: who keeps the infos of many steps gets new tables anyway


def _read(name: str) -> str:
    return f"walker.{name}" if name in _FIELDS else f"task.{name}"


def _metric(key: str, metric: Metric) -> Info:
    source = _read(metric.field)
    if metric.divisor is not None:
        divisor = _read(metric.divisor)
        source = f"{source} / {divisor} if {divisor} > 0 else 0.0"
    return Info(key, source, "", metric.meaning)


def infos_of(task: Task) -> tuple[Info, ...]:
    """A task's numbers beside state, footprint and fall: those of pushes first, those of bodies last."""
    heading = () if task.heading_field is None else (task.heading_field,)
    common = {info.key for info in _COMMON}
    return (
        *_PUSH,
        *_COMMON,
        *(_metric(key, metric) for key, metric in task.metrics.items() if key not in common),
        *(_HEADING._replace(source=_read(name)) for name in heading),
        *_BODY,
    )


def info_report(task: Task) -> Any:
    """The formula ``report(row, walker, task)`` that fills a walker's row of infos: state, footprint, ``infos_of``."""
    sources = [*_ARRAYS, *(info.source for info in infos_of(task))]
    lines = [f"row[{k}] = {source}" for k, source in enumerate(sources)]
    return written_formula("report", ("row", "walker", "task"), lines)


class InfoMaker:
    """Makes ``info`` dictionaries of a task's rows of infos; ``size`` is how many numbers a row holds.

    Parameters
    ----------
    task : Task
    has_pushes, has_bodies : bool
        Whether the last push, and the walker's body, are among the infos.
    """

    def __init__(self, task: Task, *, has_pushes: bool, has_bodies: bool) -> None:
        infos = infos_of(task)
        self.size = _FIRST_NUMBER + len(infos)
        first = 0 if has_pushes else len(_PUSH)
        last = len(infos) - (0 if has_bodies else len(_BODY))
        self._columns = slice(_FIRST_NUMBER + first, _FIRST_NUMBER + last)
        self._names = tuple(info.key for info in infos[first:last])
        self._masks = tuple(f"_{key}" for key in (*self._names, "state", "footprint", "fall"))

    def views(self, row: Vector) -> tuple[Vector, Vector, Vector]:
        """Of a walker's row: the single numbers, the state, the footprint."""
        return row[self._columns], row[:STATE_SIZE], row[STATE_SIZE:_FIRST_NUMBER]

    def one(self, views: tuple[Vector, Vector, Vector], fall: np.int64) -> dict[str, Any]:
        """The info of a single environment: NumPy's numbers and two arrays."""
        numbers, state, footprint = views
        info: dict[str, Any] = dict(zip(self._names, numbers, strict=False))
        info["state"] = state.copy()
        info["footprint"] = footprint.copy()
        info["fall"] = fall
        return info

    def many(self, table: Vector, falls: NDArray[np.int64], mask: Flags) -> dict[str, Any]:
        """The infos of a vector environment, views of its table (n, size), each key beside its mask."""
        info: dict[str, Any] = dict.fromkeys(self._masks, mask)
        columns = range(*self._columns.indices(self.size))
        info.update((name, table[:, k]) for name, k in zip(self._names, columns, strict=False))
        state, footprint = table[:, :STATE_SIZE], table[:, STATE_SIZE:_FIRST_NUMBER]
        return {**info, "state": state, "footprint": footprint, "fall": falls}


class InfoTable:
    """A table of infos of n walkers, and the ``info`` that shows it; to make its views takes as long as stepping a dozen walkers."""

    def __init__(self, maker: InfoMaker, n: int) -> None:
        everyone = np.ones(n, dtype=np.bool_)
        everyone.flags.writeable = False
        self.rows = np.empty((n, maker.size))
        self.falls = np.zeros(n, dtype=np.int64)
        self.info = maker.many(self.rows, self.falls, everyone)
        names = [key for key in self.info if not key.startswith("_")]
        self._arrays = [self.rows, *(self.info[name] for name in names)]

    def references(self) -> int:
        """How often its arrays are referred to; a view of one of them, or a tensor that shares its memory, counts as well."""
        return sum(map(sys.getrefcount, self._arrays))


class InfoTables:
    """Tables of infos for one step after the other: a table is used again once nobody holds an array of it any more."""

    def __init__(self, maker: InfoMaker, n: int) -> None:
        self._maker, self._n = maker, n
        self._tables: deque[InfoTable] = deque(maxlen=_MOST_TABLES)
        self._unshared = 0

    def take(self) -> InfoTable:
        """A table to fill: one that is free again, or a new one."""
        for table in self._tables:
            if table.references() == self._unshared:
                return table
        self._tables.append(InfoTable(self._maker, self._n))
        self._unshared = self._tables[-1].references()
        return self._tables[-1]
