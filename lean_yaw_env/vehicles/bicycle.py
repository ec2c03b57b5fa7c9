"""The bicycle: lean and yaw coupled dynamically, through a steering fork of its own.

Section 2.2 of Wisse and Schwab, "Skateboards, Bicycles, and Three-dimensional Biped Walking Machines: Velocity-dependent Stability by Means
of Lean-to-yaw Coupling" (2005), eqs. (4), (5) and Figure 4: an uncontrolled bicycle with a rigid rider, linearised about upright straight
motion. SI units; coordinates q = (lean of the rear frame, steer), rad.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from lean_yaw_env.validation import require_array, require_finite, require_vector
from lean_yaw_env.vehicles.bicycle_parameters import (
    BENCHMARK_2007,
    BicycleParameters,
    canonical_matrices,
)
from lean_yaw_env.vehicles.characteristic import CharacteristicPolynomial, DoubleRoot
from lean_yaw_env.vehicles.stability import (
    ComplexArray,
    FloatArray,
    SpeedRange,
    linear_motion,
    stable_speed_range,
)

_ROUND_OFF = 1e-9
"""Real part, relative to the greatest eigenvalue, below which a mode counts as not growing."""


@dataclass(frozen=True, eq=False)
class BicycleMotion:
    """A time history of the uncontrolled bicycle; every field has shape (n,), in s, rad and rad / s."""

    times: FloatArray
    lean: FloatArray
    steer: FloatArray
    lean_rate: FloatArray
    steer_rate: FloatArray


@dataclass(frozen=True, eq=False)
class LinearBicycle:
    """M q'' + v C1 q' + (K0 + v^2 K2) q = 0, eq. (4) without forces; q = (lean, steer).

    Parameters
    ----------
    mass_matrix, damping_matrix : shape (2, 2)
        M, kg m^2, symmetric and positive definite; C1, kg m, multiplied by the speed.
    static_stiffness, dynamic_stiffness : shape (2, 2)
        K0, N m / rad, with gravity's value already in it as in eq. (5); K2, kg, multiplied by the speed squared.

    Raises
    ------
    ValueError
        If a matrix has another shape or a value that is not finite, or the mass matrix is not symmetric and positive definite.
    """

    mass_matrix: FloatArray
    damping_matrix: FloatArray
    static_stiffness: FloatArray
    dynamic_stiffness: FloatArray

    def __post_init__(self) -> None:
        for name in ("mass_matrix", "damping_matrix", "static_stiffness", "dynamic_stiffness"):
            matrix = require_array(name, getattr(self, name), (2, 2))
            matrix.setflags(write=False)
            object.__setattr__(self, name, matrix)
        mass = self.mass_matrix
        if not np.allclose(mass, mass.T, rtol=1e-9, atol=0.0) or np.linalg.eigvalsh(mass)[0] <= 0:
            raise ValueError(
                f"mass_matrix must be symmetric and positive definite, got {mass.tolist()}"
            )

    @cached_property
    def characteristic(self) -> CharacteristicPolynomial:
        """The characteristic polynomial, whose coefficients are polynomials in the speed."""
        return CharacteristicPolynomial.of_matrices(
            self.mass_matrix, self.damping_matrix, self.static_stiffness, self.dynamic_stiffness
        )

    def state_matrix(self, speeds: ArrayLike) -> FloatArray:
        """A of x' = A x, x = (lean, steer, lean rate, steer rate), at each speed; shape (n, 4, 4).

        ``speeds`` is a number or has shape (n,), m / s; negative rolls backwards.

        Raises
        ------
        ValueError
            If a speed is not finite.
        """
        v = require_vector("speeds", speeds)[:, None, None]
        matrix = np.zeros((v.size, 4, 4))
        matrix[:, :2, 2:] = np.eye(2)
        stiffness = self.static_stiffness + v**2 * self.dynamic_stiffness
        matrix[:, 2:, :2] = -np.linalg.solve(self.mass_matrix, stiffness)
        matrix[:, 2:, 2:] = -np.linalg.solve(self.mass_matrix, v * self.damping_matrix)
        return matrix

    def eigenvalues(self, speeds: ArrayLike) -> ComplexArray:
        """Eigenvalues at each speed, 1/s, by falling real part, then falling imaginary part; shape (n, 4).

        ``follow_eigenvalues`` sorts them by mode. Arguments and errors as for ``state_matrix``.
        """
        values = np.linalg.eigvals(self.state_matrix(speeds))
        return np.sort_complex(values.astype(np.complex128))[:, ::-1]

    def modes(self, speed: float) -> tuple[ComplexArray, ComplexArray]:
        """Eigenvalues at one speed, m / s, with their shapes.

        Returns
        -------
        eigenvalues : shape (4,)
            1/s, in no particular order.
        shapes : shape (4, 2)
            Row i is (lean, steer) of mode i, of unit length, lean real and not negative: the steer is then seen relative to the lean.

        Raises
        ------
        ValueError
            If the speed is not finite.
        """
        values, vectors = np.linalg.eig(self.state_matrix(require_finite("speed", speed))[0])
        shapes = vectors[:2].T.astype(np.complex128)
        shapes /= np.linalg.norm(shapes, axis=1, keepdims=True)
        leans = shapes[:, :1]
        # Without any lean there is no phase to refer to; the shape then stays as it is.
        phases = np.where(np.abs(leans) > 0.0, leans / np.maximum(np.abs(leans), 1e-300), 1.0)
        return values.astype(np.complex128), shapes / phases

    def double_roots(self) -> list[DoubleRoot]:
        """All positive speeds at which two real eigenvalues meet, rising, with the eigenvalue."""
        return self.characteristic.double_roots()

    def double_root_speed(self) -> float | None:
        """Lowest positive speed, m / s, at which two real eigenvalues meet and the weave emerges, 0.7 m/s in the paper; or None."""
        roots = self.double_roots()
        return roots[0].speed if roots else None

    def weave_speed(self) -> float | None:
        """Lowest speed, m / s, at which a growing oscillation becomes a decaying one, 4.3 m/s in the paper; or None."""
        polynomial = self.characteristic
        for speed, frequency in polynomial.imaginary_pairs():
            if polynomial.eigenvalue_rate(speed, 1j * frequency).real < 0.0:
                return speed
        return None

    def capsize_speed(self) -> float | None:
        """Lowest speed, m / s, at which a real eigenvalue rises through zero, 6.1 m/s in the paper; or None."""
        polynomial = self.characteristic
        for speed in polynomial.zero_eigenvalue_speeds():
            if polynomial.eigenvalue_rate(speed, 0.0).real > 0.0:
                return speed
        return None

    def stable_speed_range(self) -> SpeedRange | None:
        """Lowest range of positive speeds at which no mode grows, m / s, or None.

        An eigenvalue can cross the imaginary axis only at zero or as an imaginary pair. The speeds of both are known exactly, and between two
        of them one look at the eigenvalues decides.
        """
        polynomial = self.characteristic
        pair_speeds = [speed for speed, _ in polynomial.imaginary_pairs()]
        borders = [0.0, *sorted({*polynomial.zero_eigenvalue_speeds(), *pair_speeds}), math.inf]
        lower = None
        for low, high in pairwise(borders):
            beyond = 2.0 * max(low, polynomial.speed_scale)
            stable = self._has_no_growth(0.5 * (low + high) if math.isfinite(high) else beyond)
            if stable and lower is None:
                lower = low
            if not stable and lower is not None:
                return SpeedRange(lower, low)
        return None if lower is None else SpeedRange(lower, math.inf)

    def _has_no_growth(self, speed: float) -> bool:
        values = self.eigenvalues(speed)
        return bool(np.max(values.real) <= _ROUND_OFF * np.max(np.abs(values)))

    def motion(
        self,
        speed: float,
        times: ArrayLike,
        *,
        lean: float = 0.0,
        steer: float = 0.0,
        lean_rate: float = 0.0,
        steer_rate: float = 0.0,
    ) -> BicycleMotion:
        """Motion of the uncontrolled bicycle from a lean and a steer (rad) and their rates (rad / s), exact but for round-off.

        ``speed`` is in m / s; ``times`` is a number or has shape (n,), s after the start.

        Raises
        ------
        ValueError
            If an argument is not finite.
        OverflowError
            If an unstable motion outgrows floating point.
        """
        start = {"lean": lean, "steer": steer, "lean_rate": lean_rate, "steer_rate": steer_rate}
        state = np.array([require_finite(name, value) for name, value in start.items()])
        samples = require_vector("times", times)
        matrix = self.state_matrix(require_finite("speed", speed))[0]
        return BicycleMotion(samples, *linear_motion(matrix, state, samples).T)


stable_speed_range.register(LinearBicycle, LinearBicycle.stable_speed_range)


def paper_bicycle() -> LinearBicycle:
    """The paper's bicycle, eq. (5) as printed, to five digits; to all digits it is ``benchmark_bicycle(parameters_2005())``."""
    return LinearBicycle(
        mass_matrix=np.array([[80.812, 2.3234], [2.3234, 0.30127]]),
        damping_matrix=np.array([[0.0, 33.774], [-0.84823, 1.7070]]),
        static_stiffness=np.array([[-794.12, -25.739], [-25.739, -8.1394]]),
        dynamic_stiffness=np.array([[0.0, 76.406], [0.0, 2.6756]]),
    )


def benchmark_bicycle(parameters: BicycleParameters = BENCHMARK_2007) -> LinearBicycle:
    """The linear bicycle of given masses and lengths, by default the 2007 benchmark.

    Raises
    ------
    ValueError
        If the parameters leave lean or steer without inertia.
    """
    matrices = canonical_matrices(parameters)
    return LinearBicycle(
        mass_matrix=matrices.mass,
        damping_matrix=matrices.damping,
        static_stiffness=parameters.gravity * matrices.gravity_stiffness,
        dynamic_stiffness=matrices.speed_stiffness,
    )
