"""What ``info`` tells: one table of names, meanings and where each number is read, for one walker and for many.

A step's numbers are written to a row for each walker, by code that is compiled from the table into each task's ``judge``.
"""

from __future__ import annotations

import sys
from collections import deque
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.envs.state import BODY_NAMES, WALKER_FIELDS
from lean_yaw_env.kernel import records
from lean_yaw_env.kernel.compilation import written_formula
from lean_yaw_env.parameters import STATE_FIELDS, STATE_SIZE, Vector
from lean_yaw_env.walker import FALL_OF_STATUS

Flags = NDArray[np.bool_]


class FallCode(IntEnum):
    """How a step ended, as ``info["fall"]`` tells it; the falls are described in ``lean_yaw_env.Fall``."""

    NONE = 0
    """The walker walks on."""
    BACKWARD = int(records.BACKWARD - records.STEPPED)
    SIDEWAYS = int(records.SIDEWAYS - records.STEPPED)
    TRIP = int(records.TRIP - records.STEPPED)
    LIFT_OFF = int(records.LIFT_OFF - records.STEPPED)
    SLIP = int(records.SLIP - records.STEPPED)
    NO_HEEL_STRIKE = int(records.NO_STRIKE - records.STEPPED)
    SOLVER = int(records.FAILED - records.STEPPED)
    """No fall: the integrator gave the step up, and the episode ends where the step began."""

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
    """A field of the walker's record, told under its own name or another one."""
    field = _FIELDS[name]
    return Info(key or name, f"walker.{name}", field.unit, field.meaning + condition)


STATE_INFO = Info(
    "state", "", "", "section state (5,), not mirrored, after the push if there is one"
)
FOOTPRINT_INFO = Info(
    "footprint",
    "",
    "leg lengths",
    "contact reference point of the stance foot (2,): downhill, right, from the start",
)
_ARRAYS = (*(f"walker.{field.name}" for field in STATE_FIELDS), "walker.place_x", "walker.place_z")
_FOOTPRINT = slice(STATE_SIZE, STATE_SIZE + 2)
_FIRST_NUMBER = STATE_SIZE + 2
_MOST_PAGES = 3  # looked through: who keeps the infos of many steps gets new pages anyway

COMMON_INFOS = (
    _of_walker("side", "stance_side"),
    *map(
        _of_walker,
        (
            "mass_offset", "inter_leg_angle", "commanded_offset", "time", "steps", "distance",
            "duration", "least_normal_force", "greatest_friction", "gravity_work", "shift_work",
            "impact_loss", "ankle_loss", "speed",
        ),
    ),
)  # fmt: skip
FALL_INFO = Info(
    "fall",
    "walker.fall",
    "",
    "how the last step ended, as an integer: "
    + ", ".join(f"{code.value} {code.word or 'none'}" for code in FallCode),
)
PUSH_INFOS = tuple(
    _of_walker(name, condition="; with pushes") for name in ("pitch_push", "ankle_push")
)
BODY_INFOS = tuple(_of_walker(name, condition="; with random bodies") for name in BODY_NAMES)
HEADING_INFO = Info("commanded_heading", "", "rad", "of tasks that command one")


def _read(name: str) -> str:
    return f"walker.{name}" if name in _FIELDS else f"task.{name}"


def _metric(key: str, metric: Any) -> Info:
    source = _read(metric.field)
    if metric.divisor is not None:
        divisor = _read(metric.divisor)
        source = f"{source} / {divisor} if {divisor} > 0 else 0.0"
    return Info(key, source, "", metric.meaning)


def infos_of(task: Any) -> tuple[Info, ...]:
    """The numbers that a task tells beside state, footprint and fall: those of pushes first, those of bodies last."""
    heading = () if task.heading_field is None else (task.heading_field,)
    common = {info.key for info in COMMON_INFOS}
    return (
        *PUSH_INFOS,
        *COMMON_INFOS,
        *(_metric(key, metric) for key, metric in task.metrics.items() if key not in common),
        *(HEADING_INFO._replace(source=_read(name)) for name in heading),
        *BODY_INFOS,
    )


def info_size(task: Any) -> int:
    """How many numbers a walker's row of infos holds."""
    return _FIRST_NUMBER + len(infos_of(task))


def info_report(task: Any) -> Any:
    """The formula ``report(row, walker, task)`` that fills such a row: state, footprint, ``infos_of``."""
    sources = [*_ARRAYS, *(info.source for info in infos_of(task))]
    lines = [f"row[{k}] = {source}" for k, source in enumerate(sources)]
    return written_formula("report", ("row", "walker", "task"), lines)


class InfoMaker:
    """Makes ``info`` dictionaries of a task's rows of infos.

    Parameters
    ----------
    task : Task
    has_pushes, has_bodies : bool
        Whether the environment tells the last push, and the walker's body.
    """

    def __init__(self, task: Any, *, has_pushes: bool, has_bodies: bool) -> None:
        self.size = info_size(task)
        infos = infos_of(task)
        first = 0 if has_pushes else len(PUSH_INFOS)
        last = len(infos) - (0 if has_bodies else len(BODY_INFOS))
        self._columns = slice(_FIRST_NUMBER + first, _FIRST_NUMBER + last)
        self._names = tuple(info.key for info in infos[first:last])
        self._masks = tuple(f"_{key}" for key in (*self._names, "state", "footprint", "fall"))

    def views(self, row: Vector) -> tuple[Vector, Vector, Vector]:
        """Of a walker's row: the numbers that are told one by one, the state, the footprint."""
        return row[self._columns], row[:STATE_SIZE], row[_FOOTPRINT]

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
        info.update(zip(self._names, table.T[self._columns], strict=False))
        info["state"] = table[:, :STATE_SIZE]
        info["footprint"] = table[:, _FOOTPRINT]
        info["fall"] = falls
        return info


class InfoPage:
    """A table of infos of all of n walkers, and the views of it that an ``info`` hands out: made once, used for step after step.

    To make the views anew takes as long as stepping a dozen walkers. ``is_free`` tells whether the arrays of an earlier ``info`` are in nobody's
    hands any more; a view of one of them, or a tensor that shares its memory, counts as well.
    """

    def __init__(self, maker: InfoMaker, n: int) -> None:
        everyone = np.ones(n, dtype=np.bool_)
        everyone.flags.writeable = False
        self.table = np.empty((n, maker.size))
        self._falls = np.zeros(n, dtype=np.int64)
        self._info = maker.many(self.table, self._falls, everyone)
        told = [array for key, array in self._info.items() if not key.startswith("_")]
        self._arrays = [self.table, *told]
        del told
        self._references = self._count()

    def is_free(self) -> bool:
        """Whether nobody but this page holds its arrays."""
        return self._count() == self._references

    def info(self, falls: NDArray[np.int64]) -> dict[str, Any]:
        """The ``info`` of the table as it is filled."""
        self._falls[:] = falls
        return self._info.copy()

    def _count(self) -> int:
        return sum(map(sys.getrefcount, self._arrays))


class InfoPages:
    """As many pages as are in use at a time.

    Parameters
    ----------
    maker : InfoMaker
    n : int
        Walkers.
    """

    def __init__(self, maker: InfoMaker, n: int) -> None:
        self._maker = maker
        self._n = n
        self._pages: deque[InfoPage] = deque(maxlen=_MOST_PAGES)

    def take(self) -> InfoPage:
        """A page to fill: one that is free again, or a new one."""
        for page in self._pages:
            if page.is_free():
                return page
        page = InfoPage(self._maker, self._n)
        self._pages.append(page)
        return page
