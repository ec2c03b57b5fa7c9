"""A plain second version of the walker, from rotation matrices and scipy, slow and independent of the kernels.

Positions of the two hip masses are written as products of matrices; velocities and accelerations come from their derivatives by the
complex step, the equations of motion from D'Alembert's principle on the masses, the landing from ``solve_ivp``'s event.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

TINY = 1e-30


def rotation(axis, angle):
    """Rodrigues' formula; the angle may be complex."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)


X, Y, Z = np.eye(3)


@dataclass(frozen=True)
class ReferenceWalker:
    hip_width: float = 0.3
    foot_radius: float = 0.5
    ankle_tilt: float = 0.55
    slope: float = 0.01
    ankle_stiffness: float = 0.0
    ankle_damping: float = 0.0
    shift_time: float = 0.35

    @property
    def axis(self):
        return np.array([np.sin(self.ankle_tilt), -np.cos(self.ankle_tilt), 0.0])

    @property
    def gravity(self):
        return np.array([np.sin(self.slope), -np.cos(self.slope), 0.0])

    def pose(self, heading, pitch, ankle, side):
        """Stance hip and leg frame, with the contact reference point at the origin."""
        foot = rotation(Y, heading) @ rotation(Z, pitch)
        direction = rotation(Y, heading) @ X
        centre = -self.foot_radius * pitch * direction + self.foot_radius * Y
        pivot = centre + foot @ np.array([0.0, -self.foot_radius, 0.0])
        leg = foot @ rotation(self.axis, ankle)
        return pivot + leg @ Y, leg

    def masses(self, heading, pitch, ankle, offset, side):
        hip, leg = self.pose(heading, pitch, ankle, side)
        other = hip + side * self.hip_width * leg @ Z
        return np.concatenate([hip + offset * leg @ Z, other + offset * leg @ Z])

    def swing_foot(self, heading, pitch, ankle, inter_leg, side):
        """Cylinder centre, foot frame and ankle angle of the swing foot."""
        hip, leg = self.pose(heading, pitch, ankle, side)
        other = hip + side * self.hip_width * leg @ Z
        swing = leg @ rotation(Z, inter_leg)

        def slant(angle):
            return (swing @ rotation(self.axis, -angle) @ Z)[1]

        angle = brentq(slant, -np.pi / 2 + 1e-9, np.pi / 2 - 1e-9, xtol=1e-15, rtol=1e-15)
        for _ in range(2):
            slope = (slant(angle + 1j * TINY)).imag / TINY
            angle -= slant(angle) / slope
        foot = swing @ rotation(self.axis, -angle)
        return other - swing @ Y + foot @ np.array([0.0, self.foot_radius, 0.0]), foot, angle

    def shift(self, time, before, after):
        s = time / self.shift_time
        if np.real(s) >= 1.0:
            return after, 0.0, 0.0
        change = after - before
        return (
            before + change * (10 * s**3 - 15 * s**4 + 6 * s**5),
            change / self.shift_time * (30 * s**2 - 60 * s**3 + 30 * s**4),
            change / self.shift_time**2 * (60 * s - 180 * s**2 + 120 * s**3),
        )

    def jacobian(self, heading, q, side):
        """Positions by (pitch, ankle, offset), shape (6, 3); ``q`` may be complex only through ``directional``."""
        columns = []
        for i in range(3):
            step = np.array(q, dtype=complex)
            step[i] += 1j * TINY
            columns.append(self.masses(heading, *step, side).imag / TINY)
        return np.array(columns).T

    def acceleration_bias(self, heading, q, rate, side):
        """Second derivative of the positions along a straight line in q, by a fourth-order formula of complex steps."""
        # second derivative from the imaginary part of a rotated step: f(x + h e^{i pi/4} r) has i h^2 r'f''r / 2
        h = 1e-3
        total = np.zeros(6)
        for scale, weight in ((1.0, 16.0 / 15.0), (2.0, -1.0 / 15.0 / 4.0)):
            w = scale * h * np.exp(0.25j * np.pi)
            both = self.masses(heading, *(q + w * rate), side) + self.masses(
                heading, *(q - w * rate), side
            )
            total += weight * both.imag / h**2
        return total

    def motion(self, heading, time, y, before, after, side):
        offset, offset_rate, offset_acceleration = self.shift(time, before, after)
        q = np.array([y[0], y[1], offset])
        rate = np.array([y[2], y[3], offset_rate])
        j = self.jacobian(heading, q, side)
        bias = self.acceleration_bias(heading, q, rate, side) + j[:, 2] * offset_acceleration
        force = j[:, :2].T @ (0.5 * (np.tile(self.gravity, 2) - bias))
        force[1] -= self.ankle_stiffness * y[1] + self.ankle_damping * y[3]
        return np.linalg.solve(0.5 * j[:, :2].T @ j[:, :2], force), bias, j

    def step(self, state, side, inter_leg, before, after, tolerance=1e-13):
        heading = state[0]

        def rhs(time, y):
            return np.concatenate([y[2:], self.motion(heading, time, y, before, after, side)[0]])

        def gap(time, y):
            return self.swing_foot(heading, y[0], y[1], inter_leg, side)[0][1] - self.foot_radius

        gap.terminal, gap.direction = True, -1
        pieces = [0.0, self.shift_time, 10.0] if before != after else [0.0, 10.0]
        y = np.array(state[1:])
        for begin, end in pairwise(pieces):
            s = solve_ivp(
                rhs, (begin, end), y, "DOP853", events=gap, rtol=tolerance, atol=tolerance
            )
            y = s.y[:, -1]
            if s.status == 1:
                break
        time = s.t[-1]
        for _ in range(3):  # the event of solve_ivp is as good as its dense output: polish in time
            dy = rhs(time, y)
            height = gap(time, y)
            step = (gap(time, y + 1e-6 * dy) - gap(time, y - 1e-6 * dy)) / 2e-6
            move = solve_ivp(
                rhs, (time, time - height / step), y, "DOP853", rtol=tolerance, atol=tolerance
            )
            time, y = move.t[-1], move.y[:, -1]
        return self.strike(heading, time, y, side, inter_leg, before, after)

    def strike(self, heading, time, y, side, inter_leg, before, after):
        offset, offset_rate, _ = self.shift(time, before, after)
        old = self.jacobian(heading, np.array([y[0], y[1], offset]), side)
        velocity = old @ np.array([y[2], y[3], offset_rate])
        velocity = np.concatenate(
            [velocity[3:], velocity[:3]]
        )  # the other hip is the new stance hip
        centre, foot, ankle = self.swing_foot(heading, y[0], y[1], inter_leg, side)
        # foot = Ry(heading') Rz(pitch')
        new_heading = np.arctan2(foot[0, 2], foot[2, 2])
        pitch = np.arctan2(foot[1, 0], foot[1, 1])
        new = self.jacobian(new_heading, np.array([pitch, ankle, offset]), -side)[:, :2]
        rates = np.linalg.solve(new.T @ new, new.T @ velocity)
        direction = rotation(Y, new_heading) @ X
        place = centre + self.foot_radius * pitch * direction - self.foot_radius * Y
        return np.array([new_heading, pitch, ankle, *rates]), time, place[[0, 2]]
