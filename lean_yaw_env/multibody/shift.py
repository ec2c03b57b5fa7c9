"""Smooth displacement of the hip masses along the axle at the start of a step."""

from __future__ import annotations

from dataclasses import dataclass

from lean_yaw_env.multibody.dynamics import Offset


@dataclass(frozen=True)
class Shift:
    """From ``start`` to ``target`` in ``duration``, smoothly.

    Velocity and acceleration are zero at both ends.

    The blend is the polynomial 10 s^3 - 15 s^4 + 6 s^5 of s = t / duration.
    """

    start: float
    target: float
    duration: float

    def at(self, time: float) -> Offset:
        """Place, rate and acceleration of the masses at ``time`` since the start of the step."""
        distance = self.target - self.start
        s = time / self.duration
        if distance == 0.0 or s >= 1.0:
            return Offset(self.target)
        return Offset(
            self.start + distance * s**3 * (10.0 - 15.0 * s + 6.0 * s**2),
            distance * 30.0 * s**2 * (1.0 - s) ** 2 / self.duration,
            distance * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / self.duration**2,
        )
