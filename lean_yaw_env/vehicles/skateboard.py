"""The skateboard: lean and yaw coupled kinematically, in one degree of freedom.

Section 2.1 of Wisse and Schwab, "Skateboards, Bicycles, and Three-dimensional Biped Walking Machines: Velocity-dependent Stability by Means
of Lean-to-yaw Coupling" (2005), eqs. (1) to (3), a simplified version of Hubbard (1979). The rider is a point mass fixed to a massless
board; leaning turns both pairs of wheels about their tilted axes. SI units.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from lean_yaw_env.validation import require_finite, require_number, require_numbers, require_vector
from lean_yaw_env.vehicles.stability import (
    ComplexArray,
    FloatArray,
    SpeedRange,
    linear_motion,
    stable_speed_range,
)


class LeanEquation(NamedTuple):
    """Coefficients of inertia * lean'' + damping * lean' + stiffness * lean = 0, eq. (2): kg m^2, N m s / rad and N m / rad."""

    inertia: float
    damping: float
    stiffness: float
    """Negative when the board falls over."""


@dataclass(frozen=True, eq=False)
class SkateboardMotion:
    """A time history of the linear motion; every field has shape (n,), in s, rad, rad / s and m.

    A positive lean is towards the side that a positive heading turns to. The heading and the lateral position of the board's middle are zero
    at time 0.
    """

    times: FloatArray
    lean: FloatArray
    lean_rate: FloatArray
    heading: FloatArray
    lateral_position: FloatArray


@dataclass(frozen=True)
class Skateboard:
    """A rider standing stiffly on a skateboard.

    The paper gives no numbers for its skateboard. The defaults are round and plausible, not measured: an adult whose centre of mass is 1 m
    above the floor, on a street board with trucks at 45 degrees that are soft enough to need speed (critical speed close to 1 m/s).

    Parameters
    ----------
    mass, rider_height : float
        m and h, of the rider, kg, and of the rider's centre of mass above the floor, m. Positive.
    wheelbase : float
        w, between the front and the rear wheels, m. Positive.
    steering_tilt : float
        alpha, of both steering axes from the vertical, rad, between 0 and pi/2, both excluded.
    spring_stiffness : float
        k, of the spring on each of the two axes, N m / rad. Not negative.
    gravity : float
        g, m / s^2. Positive.
    damping : float
        Of a viscous damper beside each spring, N m s / rad. Not negative. See Notes.

    Raises
    ------
    ValueError
        If a parameter is outside its range.

    Notes
    -----
    The paper only says that damping in the steering axis "could make it asymptotically stable". This damper turns with the axis just as the
    spring does. The tilt cancels in the spring's projected torque, 2 k theta in eq. (2), so it cancels in the damper's, which is 2 c theta'.
    """

    mass: float = 70.0
    rider_height: float = 1.0
    wheelbase: float = 0.4
    steering_tilt: float = math.pi / 4
    spring_stiffness: float = 150.0
    gravity: float = 9.81
    damping: float = 0.0

    def __post_init__(self) -> None:
        for name in ("mass", "rider_height", "wheelbase", "gravity"):
            require_number(name, getattr(self, name), 0.0, math.inf, "()")
        require_number("steering_tilt", self.steering_tilt, 0.0, math.pi / 2, "()")
        for name in ("spring_stiffness", "damping"):
            require_number(name, getattr(self, name), 0.0, math.inf, "[)")

    def curvature_per_lean(self) -> float:
        """Curvature of the path for a unit lean, 1 / (r_c theta) = 2 / (w tan alpha), 1/m."""
        return 2.0 / (self.wheelbase * math.tan(self.steering_tilt))

    def lateral_acceleration(self, lean: ArrayLike, speed: ArrayLike) -> FloatArray:
        """Sideways acceleration of the board towards the side of the lean, eq. (1), m / s^2.

        a = 2 v^2 theta / (w tan alpha), for leans (rad) and speeds (m / s) of shapes that broadcast.

        Raises
        ------
        ValueError
            If a lean or a speed is not finite.
        """
        angles, speeds = require_numbers("lean", lean), require_numbers("speed", speed)
        return np.asarray(speeds**2 * self.curvature_per_lean() * angles)

    def equation_of_motion(self, speed: float) -> LeanEquation:
        """Linear equation of the lean at a finite speed, m / s, eq. (2) with damping added. The speed's sign makes no difference."""
        v = require_finite("speed", speed)
        m, h = self.mass, self.rider_height
        return LeanEquation(
            inertia=m * h**2,
            damping=2.0 * self.damping,
            stiffness=2.0 * self.spring_stiffness
            - m * self.gravity * h
            + m * h * self.curvature_per_lean() * v**2,
        )

    def eigenvalues(self, speeds: ArrayLike) -> ComplexArray:
        """Eigenvalues of the lean at each speed, 1/s; shape (n, 2).

        Of a real pair the greater comes first, of a complex pair the one with positive imaginary part. ``speeds`` is a number or has shape
        (n,), m / s.

        Raises
        ------
        ValueError
            If a speed is not finite.
        """
        pairs = [_roots(self.equation_of_motion(v)) for v in require_vector("speeds", speeds)]
        return np.array(pairs, dtype=np.complex128)

    def critical_speed(self) -> float:
        """Speed above which the board is not unstable, eq. (3), m / s; 0 where the springs alone hold the rider up (2 k >= m g h)."""
        m, h = self.mass, self.rider_height
        lacking = m * self.gravity * h - 2.0 * self.spring_stiffness
        return math.sqrt(max(lacking, 0.0) / (m * h * self.curvature_per_lean()))

    def motion(
        self, speed: float, times: ArrayLike, *, lean: float = 0.05, lean_rate: float = 0.0
    ) -> SkateboardMotion:
        """Linear motion from a lean (rad) and its rate (rad / s), exact but for round-off.

        ``speed`` is in m / s; ``times`` is a number or has shape (n,), s after the start.

        Raises
        ------
        ValueError
            If an argument is not finite.
        OverflowError
            If an unstable motion outgrows floating point.
        """
        equation = self.equation_of_motion(speed)
        start = [require_finite("lean", lean), require_finite("lean_rate", lean_rate), 0.0, 0.0]
        samples = require_vector("times", times)
        matrix = np.zeros((4, 4))
        matrix[0, 1] = 1.0
        matrix[1, 0] = -equation.stiffness / equation.inertia
        matrix[1, 1] = -equation.damping / equation.inertia
        matrix[2, 0] = speed * self.curvature_per_lean()  # yaw rate = v / r_c
        matrix[3, 2] = speed
        return SkateboardMotion(samples, *linear_motion(matrix, np.array(start), samples).T)


@stable_speed_range.register
def _skateboard_range(vehicle: Skateboard) -> SpeedRange:
    return SpeedRange(vehicle.critical_speed(), math.inf)


def _roots(equation: LeanEquation) -> tuple[complex, complex]:
    """Roots of inertia s^2 + damping s + stiffness, without cancellation."""
    half = 0.5 * equation.damping / equation.inertia
    product = equation.stiffness / equation.inertia
    square = half**2 - product
    if square < 0.0:
        pair = complex(0.0 - half, math.sqrt(-square))  # not -half: an undamped root is 0, not -0
        return pair, pair.conjugate()
    lower = -half - math.sqrt(square)
    # half >= 0, so the lower root has no cancellation; the upper one follows from the product.
    return complex(product / lower if lower else 0.0), complex(lower)
