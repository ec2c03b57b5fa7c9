"""One stance phase of the nine-coordinate walker, integrated to heel strike or a fall."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import root_scalar

from lean_yaw_env.errors import SolverError
from lean_yaw_env.multibody.dynamics import ContactForces, Stance
from lean_yaw_env.multibody.kinematics import LEAN, STANCE_LEG, SWING_LEG, Vector

FALLS = ("trip", "lift-off", "backward", "forward", "sideways", "no-heel-strike")
"""The ways a step can end other than by heel strike."""
_SAMPLES_PER_STEP = 8
"""Samples within a step of the integrator at which strike, falls and forces are looked at."""
_LONGEST_STEP = 20.0
"""Time after which a step without heel strike is given up; a gait's step takes about 1 to 4."""
_FALLEN_ANGLE = 0.8
"""Pitch or lean, rad, taken as fallen; a point mass tipping from rest lifts off at arccos(2/3)."""


@dataclass(frozen=True)
class PhaseEnd:
    """How a stance phase ended, and its samples."""

    time: float
    y: Vector
    fall: str | None
    times: tuple[float, ...]
    samples: tuple[Vector, ...]
    forces: tuple[ContactForces, ...]


def integrate(phase: Stance, start: Vector, tolerance: float) -> PhaseEnd:
    """Integrate from ``start``, role coordinates and rates (16,), to heel strike or a fall.

    Heel strike is located to round-off on the integrator's interpolant, which is as accurate as the integration itself (measured: 3e-12 at a
    tolerance of 1e-11). A fall is noticed on the samples and not located further.

    Raises
    ------
    SolverError
        If the integrator fails.
    """
    times, samples = [0.0], [start]
    forces = [phase.forces(0.0, start)]

    def end(time: float, y: Vector, fall: str | None) -> PhaseEnd:
        if time > times[-1]:
            times.append(time)
            samples.append(y)
            forces.append(phase.forces(time, y))
        return PhaseEnd(time, y, fall, tuple(times), tuple(samples), tuple(forces))

    clearance = phase.swing_foot(start).clearance
    if phase.is_held and clearance <= 0.0:
        return end(0.0, start, "trip")
    solver = DOP853(
        phase.derivative, 0.0, start, _LONGEST_STEP, rtol=tolerance, atol=0.1 * tolerance
    )
    while solver.status == "running":
        origin = solver.t
        message = solver.step()
        if solver.status == "failed":
            raise SolverError(f"the integrator gave up at t = {solver.t:.6g}: {message}")
        dense = solver.dense_output()
        for time in np.linspace(origin, solver.t, _SAMPLES_PER_STEP + 1)[1:].tolist():
            y = dense(time)
            before, clearance = clearance, phase.swing_foot(y).clearance
            if before > 0.0 >= clearance:
                strike = _locate(phase, dense, (times[-1], time))
                if _is_foot_in_front(phase, dense(strike)):
                    return end(strike, dense(strike), None)
            force = phase.forces(time, y)
            times.append(time)
            samples.append(y)
            forces.append(force)
            fall = _fall(phase, y, force)
            if fall is not None:
                return end(time, y, fall)
    return end(solver.t, solver.y, "no-heel-strike")


def _is_foot_in_front(phase: Stance, y: Vector) -> bool:
    """Whether meeting the floor here is a heel strike, not a passive leg's mid-stance scuff."""
    foot = phase.swing_foot(y)
    if not foot.is_before_vertical_axis or y[SWING_LEG] <= y[STANCE_LEG]:
        return False
    return phase.is_held or foot.pitch > 0.0 > phase.pitch(y)[0]


def _fall(phase: Stance, y: Vector, forces: ContactForces) -> str | None:
    """The way the walker has fallen, if it has."""
    pitch, _ = phase.pitch(y)
    if abs(y[LEAN]) > _FALLEN_ANGLE:
        return "sideways"
    if abs(pitch) > _FALLEN_ANGLE:
        return "backward" if pitch > 0.0 else "forward"
    return "lift-off" if forces.normal <= 0.0 else None


def _locate(phase: Stance, dense: Callable[[float], Vector], bracket: tuple[float, float]) -> float:
    def clearance(time: float) -> float:
        return phase.swing_foot(dense(time)).clearance

    if clearance(bracket[0]) <= 0.0:
        return bracket[0]
    return root_scalar(clearance, bracket=bracket, method="brentq", xtol=1e-14, rtol=1e-14).root
