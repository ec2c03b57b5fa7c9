"""What a step of the nine-coordinate walker returns."""

from __future__ import annotations

from dataclasses import dataclass

from lean_yaw_env.multibody.dynamics import ContactForces
from lean_yaw_env.multibody.kinematics import Vector

FALLS = ("trip", "lift-off", "backward", "forward", "sideways", "no-heel-strike")
"""The ways a step can end other than by heel strike."""


@dataclass(frozen=True)
class ForceExtremes:
    """Extremes over a step, on the samples of the integration; units as in `ContactForces`."""

    least_normal_force: float
    greatest_friction: float
    greatest_yaw_torque: float
    greatest_hip_torque: float


@dataclass(frozen=True)
class Trajectory:
    """A stance phase on the samples of its integration.

    Attributes
    ----------
    time : shape (n,)
        Since the start of the step.
    coordinates : shape (n, 9)
        x_h, y_h, z_h, u1 to u6 in the paper's order: centre of the axle, yaw, lean, right and
        left leg pitch, right and left ankle. The swing ankle is the one that keeps its foot flat;
        while the swing ankle's axis is vertical that angle is ill-defined.
    rates : shape (n, 8)
        Of all coordinates but the swing ankle, which has no inertia, in the same order.
    forces : tuple of ContactForces
        At each sample.
    energies : shape (n, 2)
        Kinetic and potential.
    """

    time: Vector
    coordinates: Vector
    rates: Vector
    forces: tuple[ContactForces, ...]
    energies: Vector


@dataclass(frozen=True)
class MultibodyStep:
    """One step, from just after a heel strike to just after the next.

    Attributes
    ----------
    state : tuple of 5 or 6 floats
        Section state after the impact (see `MultibodyWalker.step`); after a fall, the state in
        which it was noticed.
    stance : "left" or "right"
        The foot that stands now.
    duration : float
        Of the stance phase.
    displacement : tuple of 2 floats
        From the old contact reference point to the new one, x and z; zero after a fall.
    mass_offset : float
        Offset in force at the end of the step; differs from the commanded one if heel strike came
        in mid-shift.
    inter_leg_angle, inter_leg_rate : float
        Swing minus stance leg pitch just after the impact (the new swing leg is behind) and its
        rate.
    fall : str or None
        One of `FALLS`.
    forces : ForceExtremes
        Over the stance phase.
    impulse : ContactForces or None
        Impulses on the new stance foot; None after a fall.
    energies : tuple of 3 floats
        Kinetic plus potential: at the start, at the end before the impact and just after it (nan
        after a fall).
    constraint_residual : float
        Largest violation of a contact constraint, or of its rate, that has built up by the end of
        the phase.
    trajectory : Trajectory or None
        On request.
    """

    state: tuple[float, ...]
    stance: str
    duration: float
    displacement: tuple[float, float]
    mass_offset: float
    inter_leg_angle: float
    inter_leg_rate: float
    fall: str | None
    forces: ForceExtremes
    impulse: ContactForces | None
    energies: tuple[float, float, float]
    constraint_residual: float
    trajectory: Trajectory | None = None
