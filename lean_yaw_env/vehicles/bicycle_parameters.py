"""Linear bicycle matrices from masses and lengths.

The algorithm and the benchmark are those of J. P. Meijaard, J. M. Papadopoulos, A. Ruina and A. L. Schwab, "Linearized dynamics equations
for the balance and steer of a bicycle: a benchmark and review", Proc. R. Soc. A 463 (2007) 1955-1982, appendix A. SI units. Axes: origin at
the rear contact point, x forward, y to the right, z down, so that heights are negative z.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from lean_yaw_env.validation import require_finite, require_instance, require_number
from lean_yaw_env.vehicles.stability import FloatArray

_INERTIA_SLACK = 1e-9
"""Relative room left for round-off when a principal inertia equals the sum of the two others."""


@dataclass(frozen=True)
class Wheel:
    """A wheel with a knife edge, symmetric about its axle.

    Parameters
    ----------
    radius, mass : float
        m, positive; kg, not negative.
    inertia_xx, inertia_yy : float
        About a diameter and about the axle, kg m^2. Not negative; the axle's is at most twice the diameter's.

    Raises
    ------
    ValueError
        If a value is outside its range.
    """

    radius: float
    mass: float
    inertia_xx: float
    inertia_yy: float

    def __post_init__(self) -> None:
        require_number("wheel radius", self.radius, 0.0, math.inf, "()")
        for name in ("mass", "inertia_xx", "inertia_yy"):
            require_number(f"wheel {name}", getattr(self, name), 0.0, math.inf, "[)")
        if self.inertia_yy > 2.0 * self.inertia_xx * (1.0 + _INERTIA_SLACK):
            raise ValueError(
                f"wheel inertia_yy must be in [0, 2 * inertia_xx = {2.0 * self.inertia_xx:g}], "
                f"got {self.inertia_yy!r}"
            )


@dataclass(frozen=True)
class FrameBody:
    """A rigid body that is symmetric about the bicycle's plane.

    Parameters
    ----------
    mass : float
        kg. Not negative.
    x, z : float
        Centre of mass, forward of the rear contact and below the floor (negative: above), m.
    inertia_xx, inertia_xz, inertia_yy, inertia_zz : float
        Entries of the inertia tensor about the centre of mass, kg m^2. The principal values must be possible for a body: none negative,
        none above the sum of the two others.

    Raises
    ------
    ValueError
        If a value is outside its range.
    """

    mass: float
    x: float
    z: float
    inertia_xx: float
    inertia_xz: float
    inertia_yy: float
    inertia_zz: float

    def __post_init__(self) -> None:
        require_number("frame mass", self.mass, 0.0, math.inf, "[)")
        for name in ("x", "z", "inertia_xx", "inertia_xz", "inertia_yy", "inertia_zz"):
            require_finite(f"frame {name}", getattr(self, name))
        plane = np.array([[self.inertia_xx, self.inertia_xz], [self.inertia_xz, self.inertia_zz]])
        principal = np.sort([*np.linalg.eigvalsh(plane), self.inertia_yy])
        slack = _INERTIA_SLACK * abs(principal[2])
        if principal[0] < -slack or principal[2] > principal[0] + principal[1] + slack:
            raise ValueError(
                "frame inertia is impossible: principal values must be at least 0 and at most the "
                f"sum of the two others, got {principal.tolist()}"
            )


@dataclass(frozen=True)
class BicycleParameters:
    """A bicycle with a rigid rider. The defaults are the 2007 benchmark, exact as published.

    Parameters
    ----------
    wheelbase, trail : float
        w, m, positive; c, of the front contact behind the steer axis, m, negative in front of it.
    steer_axis_tilt : float
        lambda, of the steer axis from the vertical, backwards, rad, within (-pi/2, pi/2).
    gravity : float
        g, m / s^2. Positive.
    rear_wheel, rear_frame, front_frame, front_wheel
        The four bodies; the rear frame carries the rider, the front frame is handlebar and fork.

    Raises
    ------
    ValueError
        If a value is outside its range, or the front frame and wheel have no mass at all.
    """

    wheelbase: float = 1.02
    trail: float = 0.08
    steer_axis_tilt: float = math.pi / 10
    gravity: float = 9.81
    rear_wheel: Wheel = field(default_factory=lambda: Wheel(0.3, 2.0, 0.0603, 0.12))
    rear_frame: FrameBody = field(
        default_factory=lambda: FrameBody(85.0, 0.3, -0.9, 9.2, 2.4, 11.0, 2.8)
    )
    front_frame: FrameBody = field(
        default_factory=lambda: FrameBody(4.0, 0.9, -0.7, 0.05892, -0.00756, 0.06, 0.00708)
    )
    front_wheel: Wheel = field(default_factory=lambda: Wheel(0.35, 3.0, 0.1405, 0.28))

    def __post_init__(self) -> None:
        for name, kind in (("wheel", Wheel), ("frame", FrameBody)):
            for end in ("rear", "front"):
                require_instance(f"{end}_{name}", getattr(self, f"{end}_{name}"), kind)
        require_number("wheelbase", self.wheelbase, 0.0, math.inf, "()")
        require_finite("trail", self.trail)
        require_number("steer_axis_tilt", self.steer_axis_tilt, -math.pi / 2, math.pi / 2, "()")
        require_number("gravity", self.gravity, 0.0, math.inf, "()")
        front_mass = self.front_frame.mass + self.front_wheel.mass
        require_number(
            "mass of front_frame and front_wheel together", front_mass, 0.0, math.inf, "()"
        )


BENCHMARK_2007 = BicycleParameters()
"""The benchmark bicycle of Meijaard et al. (2007), m, kg, rad."""


def parameters_2005() -> BicycleParameters:
    """The bicycle behind eq. (5) of the walking paper, m, kg, rad.

    The paper prints the matrices and refers to Schwab, Meijaard and Papadopoulos (2005) for the parameters. These reproduce every printed
    digit. They differ from the 2007 benchmark in the steer axis (a head angle of arctan 3), in the orientation of the fork's inertia (its
    principal values 0.06, 0.06 and 0.006 are the same) and in wheels that are exactly flat rings.
    """
    return BicycleParameters(
        steer_axis_tilt=math.atan(1.0 / 3.0),
        rear_wheel=Wheel(0.3, 2.0, 0.06, 0.12),
        front_frame=FrameBody(4.0, 0.9, -0.7, 0.0546, -0.0162, 0.06, 0.0114),
        front_wheel=Wheel(0.35, 3.0, 0.14, 0.28),
    )


class CanonicalMatrices(NamedTuple):
    """M, C1, K0, K2 of M q'' + v C1 q' + (g K0 + v^2 K2) q = f; each (2, 2), q = (lean, steer)."""

    mass: FloatArray
    damping: FloatArray
    gravity_stiffness: FloatArray
    speed_stiffness: FloatArray


class _Body(NamedTuple):
    """Mass, centre of mass and inertia of a body, or of several bodies together."""

    mass: float
    x: float
    z: float
    xx: float
    xz: float
    zz: float


def _together(bodies: list[_Body], about: tuple[float, float] | None = None) -> _Body:
    """Bodies as one, with the inertia about a point (x, z), by default about their common centre of mass."""
    mass = sum(b.mass for b in bodies)
    x = sum(b.mass * b.x for b in bodies) / mass
    z = sum(b.mass * b.z for b in bodies) / mass
    x0, z0 = (x, z) if about is None else about
    return _Body(
        mass,
        x,
        z,
        xx=sum(b.xx + b.mass * (b.z - z0) ** 2 for b in bodies),
        xz=sum(b.xz - b.mass * (b.x - x0) * (b.z - z0) for b in bodies),
        zz=sum(b.zz + b.mass * (b.x - x0) ** 2 for b in bodies),
    )


def canonical_matrices(parameters: BicycleParameters) -> CanonicalMatrices:
    """Matrices of the linearised equations of lean and steer, eqs. (A 1) to (A 24) of the 2007 benchmark paper in its notation.

    The stiffness due to gravity is not multiplied by g.
    """
    require_instance("parameters", parameters, BicycleParameters)
    w, c = parameters.wheelbase, parameters.trail
    rear, front = (
        [
            _Body(wheel.mass, x, -wheel.radius, wheel.inertia_xx, 0.0, wheel.inertia_xx),
            _Body(f.mass, f.x, f.z, f.inertia_xx, f.inertia_xz, f.inertia_zz),
        ]
        for wheel, x, f in (
            (parameters.rear_wheel, 0.0, parameters.rear_frame),
            (parameters.front_wheel, w, parameters.front_frame),
        )
    )
    whole, front = _together(rear + front, about=(0.0, 0.0)), _together(front)
    sine, cosine = math.sin(parameters.steer_axis_tilt), math.cos(parameters.steer_axis_tilt)

    # The front assembly about the steer axis: u is its distance in front of that axis.
    u = (front.x - w - c) * cosine - front.z * sine
    i_ll = front.mass * u**2 + front.xx * sine**2 + 2 * front.xz * sine * cosine
    i_ll += front.zz * cosine**2
    i_lx = -front.mass * u * front.z + front.xx * sine + front.xz * cosine
    i_lz = front.mass * u * front.x + front.xz * sine + front.zz * cosine

    mu = c / w * cosine  # yaw of the rear frame for a unit steer with the front contact fixed
    rear_spin = parameters.rear_wheel.inertia_yy / parameters.rear_wheel.radius
    front_spin = parameters.front_wheel.inertia_yy / parameters.front_wheel.radius
    spin = rear_spin + front_spin
    s_a = front.mass * u + mu * whole.mass * whole.x

    m_12 = i_lx + mu * whole.xz
    gyroscopic = mu * spin + front_spin * cosine
    rate = cosine / w  # yaw rate of the rear frame per unit of speed and steer
    return CanonicalMatrices(
        mass=np.array([[whole.xx, m_12], [m_12, i_ll + 2 * mu * i_lz + mu**2 * whole.zz]]),
        damping=np.array(
            [
                [0.0, gyroscopic + whole.xz * rate - mu * whole.mass * whole.z],
                [-gyroscopic, i_lz * rate + mu * (s_a + whole.zz * rate)],
            ]
        ),
        gravity_stiffness=np.array([[whole.mass * whole.z, -s_a], [-s_a, -s_a * sine]]),
        speed_stiffness=np.array(
            [[0.0, (spin - whole.mass * whole.z) * rate], [0.0, (s_a + front_spin * sine) * rate]]
        ),
    )
