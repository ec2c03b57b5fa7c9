"""Many walks of one walker at once, step by step in compiled batches, until each falls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.analysis.section_map import ActiveMap, PassiveMap
from lean_yaw_env.kernel import records
from lean_yaw_env.kernel.batch import step_batch
from lean_yaw_env.kernel.passive import PassiveOutcome
from lean_yaw_env.kernel.records import Outcome
from lean_yaw_env.parameters import Vector
from lean_yaw_env.passive import step_passive_rows

ENDINGS = {
    0.0: "walked to the end",
    records.BACKWARD: "backward",
    records.SIDEWAYS: "sideways",
    records.TRIP: "trip",
    records.LIFT_OFF: "lift-off or forward",
    records.SLIP: "slip",
    records.NO_STRIKE: "no heel strike",
    records.FAILED: "solver failure",
}
"""What ``ManyWalks.endings`` holds. A passive state that no foot behind can stand in is a trip."""

_STATUS = Outcome._fields.index("status")
_OFFSET = Outcome._fields.index("mass_offset")
_PASSIVE_STATUS = PassiveOutcome._fields.index("status")
_PASSIVE_ANGLE = PassiveOutcome._fields.index("inter_leg_angle")


@dataclass(frozen=True)
class ManyWalks:
    """How ``n`` walks went.

    Attributes
    ----------
    steps : shape (n,)
        Steps completed.
    endings : shape (n,)
        Keys of ``ENDINGS``.
    states : shape (n, 5) or (n, 6)
        Where each walk was last, as it stood on whichever foot.
    """

    steps: NDArray[np.int64]
    endings: Vector
    states: Vector

    @property
    def survived(self) -> NDArray[np.bool_]:
        """Whether each walk went to its end."""
        return self.endings == 0.0


def walk_many(section_map: ActiveMap | PassiveMap, states: Vector, n_steps: int) -> ManyWalks:
    """Walk ``n_steps`` from each state, left foot first, with the map's command.

    Parameters
    ----------
    section_map : ActiveMap or PassiveMap
        How many steps it takes itself plays no part.
    states : shape (n, 5) or (n, 6)
    n_steps : int
    """
    n = len(states)
    current = np.array(states, dtype=float)
    steps, endings = np.zeros(n, dtype=np.int64), np.zeros(n)
    stepper = (
        _ActiveStepper(section_map, n)
        if isinstance(section_map, ActiveMap)
        else _PassiveStepper(section_map, n)
    )
    walking = np.arange(n)
    for k in range(n_steps):
        if not walking.size:
            break
        after, status = stepper.step(walking, current[walking], k % 2)
        current[walking] = after
        done = status == records.STEPPED
        steps[walking[done]] += 1
        endings[walking[~done]] = status[~done]
        walking = walking[done]
    return ManyWalks(steps, endings, current)


class _ActiveStepper:
    def __init__(self, section_map: ActiveMap, n: int) -> None:
        self._bodies = np.array([section_map.walker.parameters.body()])
        self._angle, self._offsets = section_map.inter_leg_angle, section_map.mass_offset
        self._in_force = np.full(n, self._offsets[1])

    def step(self, who: NDArray[np.intp], states: Vector, foot: int) -> tuple[Vector, Vector]:
        n = who.size
        commands = np.column_stack(
            [np.full(n, self._angle), np.full(n, self._offsets[foot]), self._in_force[who]]
        )
        rows = np.empty((n, len(Outcome._fields)))
        sides = np.full(n, 1.0 - 2.0 * foot)
        step_batch(self._bodies, commands, np.ascontiguousarray(states), sides, rows, 0, n)
        self._in_force[who] = rows[:, _OFFSET]
        return rows[:, :5], rows[:, _STATUS]


class _PassiveStepper:
    def __init__(self, section_map: PassiveMap, n: int) -> None:
        self._walker = section_map.walker
        self._angles = np.full(n, np.nan)

    def step(self, who: NDArray[np.intp], states: Vector, foot: int) -> tuple[Vector, Vector]:
        sides = np.full(who.size, 1.0 - 2.0 * foot)
        rows = step_passive_rows(self._walker, states, sides, self._angles[who])
        self._angles[who] = rows[:, _PASSIVE_ANGLE]
        return rows[:, :6], rows[:, _PASSIVE_STATUS]
