"""What ``info`` tells: one table of names, meanings and where each number is read, for one walker and for many.

A step's numbers are written to a fresh record for each walker, by code that is compiled from the table into each task's ``judge``.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.envs.state import BODY_NAMES, WALKER_FIELDS, Records
from lean_yaw_env.kernel import records
from lean_yaw_env.kernel.compilation import written_formula
from lean_yaw_env.parameters import STATE_FIELDS, STATE_SIZE
from lean_yaw_env.walker import FALL_OF_STATUS


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
    def description(self) -> str:
        """The fall's name as ``lean_yaw_env.Fall`` has it, "solver", or "none"."""
        fall = FALL_OF_STATUS.get(float(self) + records.STEPPED)
        return self.name.lower() if fall is None else fall.value


class Info(NamedTuple):
    """One key of ``info``: the expression in ``walker`` and ``task`` that gives its number, and what it means."""

    key: str
    source: str
    meaning: str


STATE_MEANING = "section state (5,), not mirrored, after the push if there is one"
FOOTPRINT_MEANING = (
    "contact reference point of the stance foot (2,): downhill, right, from the start, in leg lengths"
)
_ARRAYS = (
    *((f"state[{k}]", f"walker.{field.name}") for k, field in enumerate(STATE_FIELDS)),
    ("footprint[0]", "walker.place_x"),
    ("footprint[1]", "walker.place_z"),
)
_FOOTPRINT = slice(STATE_SIZE, STATE_SIZE + 2)
_FIRST_NUMBER = STATE_SIZE + 2

COMMON_INFOS = (
    Info("stance_side", "walker.side", "+1 while the left foot stands, -1 the right"),
    Info(
        "mass_offset",
        "walker.mass_offset",
        "offset in force, leg lengths, positive to the right",
    ),
    Info("inter_leg_angle", "walker.inter_leg_angle", "commanded in the last step, rad"),
    Info("commanded_offset", "walker.commanded_offset", "commanded in the last step"),
    Info("time", "walker.time", "since the start of the episode"),
    Info("steps", "walker.steps", "since the start of the episode"),
    Info(
        "distance",
        "walker.distance",
        "sum of the steps' advances along the mean heading of their two footprints",
    ),
    Info("duration", "walker.duration", "of the last step"),
    Info("least_normal_force", "walker.least_normal_force", "of the last step, in weights"),
    Info(
        "greatest_friction",
        "walker.greatest_friction",
        "of the last step, tangential over normal force",
    ),
    Info("gravity_work", "walker.gravity_work", "of the last step, in weight times leg length"),
    Info("shift_work", "walker.shift_work", "of the last step, put in by moving the masses"),
    Info("impact_loss", "walker.impact_loss", "of the last step"),
    Info("ankle_loss", "walker.ankle_loss", "of the last step, into the ankle's spring and damper"),
    Info("speed", "walker.speed", "advance over duration of the last completed step"),
)
FALL_INFO = Info(
    "fall",
    "walker.fall",
    "how the last step ended, as an integer: "
    + ", ".join(f"{code.value} {code.description}" for code in FallCode),
)
PUSH_INFOS = tuple(
    Info(f"{name}_push", f"walker.{name}_push", f"the last push on the {name} rate; with pushes")
    for name in ("pitch", "ankle")
)
BODY_INFOS = tuple(
    Info(name, f"walker.{name}", "of this episode's body; with random bodies")
    for name in BODY_NAMES
)
HEADING_INFO = Info("commanded_heading", "", "rad; of tasks that command one")
_WALKER_NAMES = {field.name for field in WALKER_FIELDS}


def _read(name: str) -> str:
    return f"walker.{name}" if name in _WALKER_NAMES else f"task.{name}"


def _metric(key: str, metric: Any) -> Info:
    source = _read(metric.field)
    if metric.divisor is not None:
        divisor = _read(metric.divisor)
        source = f"{source} / {divisor} if {divisor} > 0 else 0.0"
    return Info(key, source, metric.meaning)


def infos_of(task: Any) -> tuple[Info, ...]:
    """The numbers that a task's record of infos holds after state and footprint, but for the fall; the last six are told on some conditions."""
    heading = () if task.heading_field is None else (task.heading_field,)
    common = {info.key for info in COMMON_INFOS}
    return (
        *COMMON_INFOS,
        *(_metric(key, metric) for key, metric in task.metrics.items() if key not in common),
        *(HEADING_INFO._replace(source=_read(name)) for name in heading),
        *PUSH_INFOS,
        *BODY_INFOS,
    )


def info_type(task: Any) -> np.dtype[np.void]:
    """The type of a task's record of infos."""
    entries: list[Any] = [("state", "f8", (STATE_SIZE,)), ("footprint", "f8", (2,))]
    entries += [(info.key, "f8") for info in infos_of(task)]
    return np.dtype([*entries, ("fall", "i8")])


def info_report(task: Any) -> Any:
    """The formula ``report(info, walker, task)`` that fills such a record."""
    pairs = [*_ARRAYS, *((info.key, info.source) for info in infos_of(task)), FALL_INFO[:2]]
    lines = [f"info.{key} = {source}" for key, source in pairs]
    return written_formula("report", ("info", "walker", "task"), lines)


class InfoMaker:
    """Makes ``info`` dictionaries of a task's records.

    Parameters
    ----------
    task : Task
    has_pushes, has_bodies : bool
        Whether the environment tells the last push, and the walker's body.
    """

    def __init__(self, task: Any, *, has_pushes: bool, has_bodies: bool) -> None:
        self.type = info_type(task)
        hidden: set[str] = set()
        hidden |= set() if has_pushes else {info.key for info in PUSH_INFOS}
        hidden |= set() if has_bodies else {info.key for info in BODY_INFOS}
        told = [
            (k, info.key) for k, info in enumerate(infos_of(task)) if info.key not in hidden
        ]
        self._columns = [_FIRST_NUMBER + k for k, _ in told]
        self._is_prefix = self._columns == [_FIRST_NUMBER + k for k in range(len(told))]
        self._last = _FIRST_NUMBER + len(told)
        self._names = tuple(name for _, name in told)
        keys = ("state", "footprint", *self._names, "fall")
        self._masks = tuple(f"_{key}" for key in keys)
        self._template: dict[str, Any] = dict.fromkeys(keys)

    def one(self, infos: Records) -> dict[str, Any]:
        """The info of a single environment: NumPy's numbers and two arrays."""
        row = infos.view(np.float64)
        info = self._template.copy()  # a copy that is filled is quicker than a dict that grows
        numbers = row[_FIRST_NUMBER : self._last] if self._is_prefix else row[self._columns]
        info.update(zip(self._names, numbers, strict=True))
        info["state"] = row[:STATE_SIZE].copy()
        info["footprint"] = row[_FOOTPRINT].copy()
        info["fall"] = infos["fall"][0]
        return info

    def many(self, infos: Records, mask: NDArray[np.bool_]) -> dict[str, Any]:
        """The infos of a vector environment, views of its records, each key beside its mask."""
        table = infos.view(np.float64).reshape(len(infos), -1)
        rows = table.T[_FIRST_NUMBER : self._last] if self._is_prefix else table.T
        numbers = list(rows) if self._is_prefix else [rows[k] for k in self._columns]
        info = self._template.copy()
        info.update(zip(self._names, numbers, strict=True))
        info["state"] = table[:, :STATE_SIZE]
        info["footprint"] = table[:, _FOOTPRINT]
        info["fall"] = infos["fall"]
        info.update(dict.fromkeys(self._masks, mask))
        return info
