"""Many walks of one map at once, step by step in compiled batches, until each falls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.analysis.section_map import SectionMap
from lean_yaw_env.errors import SolverError
from lean_yaw_env.kernel import records
from lean_yaw_env.parameters import Vector
from lean_yaw_env.validation import require_count

SURVIVED = 0.0
"""Ending of a walk that went to its end."""
ENDINGS = {
    SURVIVED: "walked to the end",
    records.BACKWARD: "backward",
    records.SIDEWAYS: "sideways",
    records.TRIP: "trip",
    records.LIFT_OFF: "lift-off or forward",
    records.SLIP: "slip",
    records.NO_STRIKE: "no heel strike",
    records.FAILED: "solver failure",
}
"""What ``ManyWalks.endings`` holds. A passive state that no foot behind can stand in is a trip."""

_CHUNK = 4096
"""Walks at a time, so that memory does not grow with their number but for what is returned."""


@dataclass(frozen=True)
class ManyWalks:
    """How ``n`` walks went.

    Attributes
    ----------
    steps : shape (n,)
        Steps completed.
    endings : shape (n,)
        Keys of ``ENDINGS``.
    states : shape (n, k)
        Where each walk was last, as it stood on whichever foot.
    """

    steps: NDArray[np.int64]
    endings: Vector
    states: Vector

    @property
    def survived(self) -> NDArray[np.bool_]:
        """Whether each walk went to its end."""
        return self.endings == SURVIVED

    def require_solved(self) -> ManyWalks:
        """Return these walks, or raise ``SolverError`` if the integrator has given up on one: it has not fallen."""
        raise_for_failures(self.endings, self.states)
        return self


def raise_for_failures(statuses: Vector, states: Vector) -> None:
    """Raise ``SolverError`` if the integrator has given up on one of the steps from states (n, k) with statuses (n,)."""
    failed = statuses == records.FAILED
    if failed.any():
        bad = states[np.argmax(failed)].tolist()
        raise SolverError(f"the step from {bad} did not converge")


def walk_many(
    section_map: SectionMap,
    states: Vector,
    n_steps: int,
    *,
    foot: int = 0,
    carried: Vector | None = None,
) -> ManyWalks:
    """Walk ``n_steps`` from each of states (n, k) on the left (0) or right (1) foot; how many steps the map itself takes plays no part.

    ``carried`` (n,) is what the first step finds of an earlier one, by default the map's.

    Raises
    ------
    ValueError
        If ``n_steps`` is outside its range.
    """
    require_count("n_steps", n_steps, 1, 1_000_000)
    current = np.array(states, dtype=float)
    steps, endings = np.zeros(len(current), dtype=np.int64), np.zeros(len(current))
    for first in range(0, len(current), _CHUNK):
        walking = np.arange(first, min(first + _CHUNK, len(current)))
        found = np.full(walking.size, section_map.carried) if carried is None else carried[walking]
        for k in range(n_steps):
            if not walking.size:
                break
            after, found, status = section_map.step_many(current[walking], found, (foot + k) % 2)
            done = status == records.STEPPED
            # the integrator's failure leaves nothing that means anything
            known = status != records.FAILED
            current[walking[known]] = after[known]
            steps[walking[done]] += 1
            endings[walking[~done]] = status[~done]
            walking, found = walking[done], found[done]
    return ManyWalks(steps, endings, current)
