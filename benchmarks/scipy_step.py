"""A walking step by ``scipy.integrate.solve_ivp``: the peer that users would write, and the reference for the kernels' accuracy.

The right-hand side and the event are this package's closed forms, compiled: only the solver is compared.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.loops import gap_and_rate, motion, strike
from benchmarks.populations import Population
from lean_yaw_env.kernel.records import Outcome
from lean_yaw_env.parameters import Vector

LONGEST = 10.0  # units of time


class ScipyStep:
    """Steps of one population's walkers, each a call of ``solve_ivp``.

    The default tolerances are the loosest round ones whose steps are within 1e-10, as the kernels' are (measured: 8e-11).
    """

    def __init__(self, population: Population, relative: float = 1e-10, absolute: float = 1e-11):
        self._population = population
        self._relative = relative
        self._absolute = absolute

    def step(self, i: int) -> Vector:
        """The section state (5,) after the step of walker ``i``, as a user would compute it."""
        times, y = self._landing(i)
        return self._strike(i, times[-1], y[:, -1])

    def polished_step(self, i: int) -> Vector:
        """The same, with the landing solved on the integrator's own steps: the event is only as good as the dense output."""
        (before, time), path = self._landing(i)
        y = self._integrate(i, before, time, path[:, 0]).y[:, -1]
        for _ in range(3):
            gap, rate = gap_and_rate(time, y, *self._arguments(i))
            y = self._integrate(i, time, time - gap / rate, y).y[:, -1]
            time = time - gap / rate
        return self._strike(i, time, y)

    def _arguments(self, i: int) -> tuple[Vector, Vector, float, float]:
        p = self._population
        return p.bodies[0], p.commands[i], float(p.states[i, 0]), float(p.sides[i])

    def _integrate(self, i: int, begin: float, end: float, y: Vector, events=None):
        arguments = self._arguments(i)
        rates = np.empty(4)

        def right_hand_side(time: float, y: Vector) -> Vector:
            motion(time, y, *arguments, rates)
            return rates.copy()

        return solve_ivp(
            right_hand_side, (begin, end), y, "DOP853", events=events,
            rtol=self._relative, atol=self._absolute,
        )  # fmt: skip

    def _landing(self, i: int) -> tuple[Vector, Vector]:
        """Times (2,) and coordinates (4, 2) where the last step before the landing begins, and at the landing."""
        _, pitch, ankle, pitch_rate, ankle_rate = self._population.states[i]
        arguments = self._arguments(i)

        def gap(time: float, y: Vector) -> float:
            return gap_and_rate(time, y, *arguments)[0]

        gap.terminal, gap.direction = True, -1.0  # pyright: ignore[reportFunctionMemberAccess]
        y = np.array([pitch, -ankle, pitch_rate, -ankle_rate])
        solution = self._integrate(i, 0.0, LONGEST, y, gap)
        return solution.t[-2:], solution.y[:, -2:]

    def _strike(self, i: int, time: float, y: Vector) -> Vector:
        outcome = np.empty(len(Outcome._fields))
        strike(time, y, *self._arguments(i), outcome)
        return outcome[:5]
