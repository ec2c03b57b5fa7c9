"""The characteristic polynomial of a bicycle and the speeds at which its roots do something.

det(M s^2 + v C1 s + K0 + v^2 K2) is a quartic in the eigenvalue s whose coefficients are polynomials in the speed v. The special speeds are
roots of polynomials made of those coefficients; nothing is read off a grid.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from scipy.optimize import root

from lean_yaw_env.validation import require_array
from lean_yaw_env.vehicles.stability import FloatArray

_NEGLIGIBLE = 1e-14
"""Relative size below which a coefficient is taken for round-off of zero."""
_NEARLY_REAL = 1e-5
"""Relative imaginary part up to which a computed root of a polynomial may be a real one; false ones are refused by the refinement that
follows, or lie where nothing changes."""


class DoubleRoot(NamedTuple):
    """Two real eigenvalues (1 / s) meet at a speed (m / s)."""

    speed: float
    eigenvalue: float


@dataclass(frozen=True, eq=False)
class CharacteristicPolynomial:
    """sum_i coefficients[i](v) s^i, i = 0 to 4, where odd powers of s have odd polynomials and even powers even ones.

    ``speed_scale`` is a typical speed of this bicycle, m / s, against which round-off is compared.
    """

    coefficients: tuple[Polynomial, ...]
    speed_scale: float

    @classmethod
    def of_matrices(
        cls, mass: FloatArray, damping: FloatArray, static: FloatArray, dynamic: FloatArray
    ) -> CharacteristicPolynomial:
        """Expand the determinant of eq. (4), each matrix of shape (2, 2)."""
        mass, damping, static, dynamic = (
            require_array(name, matrix, (2, 2))
            for name, matrix in zip(
                ("mass", "damping", "static", "dynamic"),
                (mass, damping, static, dynamic),
                strict=True,
            )
        )
        largest = float(np.max(np.abs(dynamic)))
        scale = float(np.sqrt(np.max(np.abs(static)) / largest)) if largest > 0.0 else 1.0
        zero = np.zeros((2, 2))
        # Matrices of s^0, s^1 and s^2, each a polynomial in the speed
        powers = [(static, zero, dynamic), (zero, damping), (mass,)]

        def entry(power: int, row: int, column: int) -> Polynomial:
            return Polynomial([matrix[row, column] for matrix in powers[power]])

        coefficients = [Polynomial([0.0])] * 5
        for i in range(3):
            for j in range(3):
                coefficients[i + j] += entry(i, 0, 0) * entry(j, 1, 1)
                coefficients[i + j] -= entry(i, 0, 1) * entry(j, 1, 0)
        return cls(tuple(coefficients), scale if scale > 0.0 else 1.0)

    def derivative(
        self, speed: float, eigenvalue: complex, *, in_eigenvalue: int, in_speed: int
    ) -> complex:
        """Partial derivative of the polynomial, of the orders said; real for a real eigenvalue."""
        values = [c.deriv(in_speed)(speed) if in_speed else c(speed) for c in self.coefficients]
        in_s = Polynomial(values)
        return in_s.deriv(in_eigenvalue)(eigenvalue) if in_eigenvalue else in_s(eigenvalue)

    def eigenvalue_rate(self, speed: float, eigenvalue: complex) -> complex:
        """d eigenvalue / d speed of a simple root, 1 / m."""
        change = self.derivative(speed, eigenvalue, in_eigenvalue=0, in_speed=1)
        slope = self.derivative(speed, eigenvalue, in_eigenvalue=1, in_speed=0)
        return complex(-change / slope)

    def zero_eigenvalue_speeds(self) -> list[float]:
        """Positive speeds, rising, at which an eigenvalue is zero: det(K0 + v^2 K2) = 0."""
        return self._positive_roots(self.coefficients[0])

    def imaginary_pairs(self) -> list[tuple[float, float]]:
        """Positive speeds, rising, with a pair of imaginary eigenvalues, and their frequency.

        Hurwitz' determinant a1 a2 a3 - a0 a3^2 - a4 a1^2 vanishes where two roots add up to zero; they are imaginary where a1 / a3, minus
        their square, is positive.
        """
        a0, a1, a2, a3, a4 = self.coefficients
        pairs = []
        for speed in self._positive_roots(a1 * a2 * a3 - a0 * a3**2 - a4 * a1**2):
            if a1(speed) * a3(speed) > 0.0:
                pairs.append((speed, float(np.sqrt(a1(speed) / a3(speed)))))
        return pairs

    def double_roots(self) -> list[DoubleRoot]:
        """Where two real eigenvalues meet at a positive speed, by rising speed.

        The discriminant, a polynomial of high degree, gives the candidates. Each is refined as a solution of p = dp/ds = 0, which is well
        conditioned where the discriminant is not.
        """
        found: list[DoubleRoot] = []
        for speed in self._positive_roots(self._discriminant()):
            roots = np.roots([c(speed) for c in self.coefficients[::-1]])
            distance = np.abs(roots[:, None] - roots[None, :]) + np.diag(np.full(4, np.inf))
            start = complex(np.mean(roots[list(np.unravel_index(np.argmin(distance), (4, 4)))]))
            if abs(start.imag) > 1e-2 * abs(start):
                continue  # two complex eigenvalues meet two others, not two real ones
            refined = self._refine_double_root(speed, start.real)
            if refined is None:
                continue
            if not any(np.isclose(refined.speed, known.speed, rtol=1e-9) for known in found):
                found.append(refined)
        return sorted(found)

    def _discriminant(self) -> Polynomial:
        """27 times the discriminant of e s^4 + d s^3 + c s^2 + b s + a from its invariants, 4 I^3 - J^2; a polynomial in the speed."""
        a, b, c, d, e = self.coefficients
        invariant_2 = 12 * e * a - 3 * d * b + c**2
        invariant_3 = 72 * e * c * a + 9 * d * c * b - 27 * e * b**2 - 27 * a * d**2 - 2 * c**3
        return 4 * invariant_2**3 - invariant_3**2

    def _refine_double_root(self, speed: float, eigenvalue: float) -> DoubleRoot | None:
        """Solve p = dp/ds = 0 from a start nearby; None if the start was no double root."""

        def equations(unknown: FloatArray) -> tuple[FloatArray, FloatArray]:
            s, v = unknown

            def p(in_s: int, in_v: int) -> float:
                return self.derivative(v, s, in_eigenvalue=in_s, in_speed=in_v).real

            slope = p(1, 0)
            return np.array([p(0, 0), slope]), np.array([[slope, p(0, 1)], [p(2, 0), p(1, 1)]])

        solution = root(equations, np.array([eigenvalue, speed]), jac=True, tol=1e-14)
        s, v = (float(x) for x in solution.x)
        size = sum(abs(c(v) * s**i) for i, c in enumerate(self.coefficients))
        solved = abs(solution.fun[0]) <= 1e-11 * size and abs(solution.fun[1] * s) <= 1e-8 * size
        # A wandering solve has found another root, which has its own candidate.
        near = abs(v - speed) <= 1e-2 * speed
        return DoubleRoot(v, s) if solved and near else None

    def _positive_roots(self, even: Polynomial) -> list[float]:
        """Positive real roots, rising, of an even polynomial in the speed."""
        squares = np.asarray(even.coef[::2], dtype=np.float64)
        squares = squares * self.speed_scale ** (2.0 * np.arange(squares.size))
        negligible = _NEGLIGIBLE * np.max(np.abs(squares))
        kept = np.flatnonzero(np.abs(squares) > negligible)
        if kept.size == 0:
            return []
        # Zero coefficients at the low end are roots at rest, at the high end roots at infinity.
        roots = np.roots(squares[kept[0] : kept[-1] + 1][::-1])
        real = roots[(np.abs(roots.imag) <= _NEARLY_REAL * np.abs(roots)) & (roots.real > 0.0)].real
        return sorted(float(s) for s in self.speed_scale * np.sqrt(real))
