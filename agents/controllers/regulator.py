"""Optimal linear feedback (LQR) on the exact step map about a gait.

A right stance is taken as its mirror image, so that walking straight is one map repeated, z' = A z + B v, with

    z = (section state, mass offset in force) less the gait's,
    v = (inter-leg angle, change of the offset) less the gait's.

With the offset in the state and its change as the input, the limit on the change is part of what is optimised: asking for more costs more.
A heading phi off downhill is held by the offset of the closed form, sin(phi) = -offset / tan(slope); its mirror image is the gait of -phi,
so that the two alternate and the optimal gains are periodic, of period two. A gait that pumps has the masses on alternate sides: its own change
of the offset is part of it, and v is what is added.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_discrete_are

from lean_yaw_env.analysis.stride import differentiate_step
from lean_yaw_env.kernel.records import Command
from lean_yaw_env.parameters import MIRROR, STATE_SIZE, Vector
from lean_yaw_env.walker import Walker

SIZE = STATE_SIZE + 1
"""Of the regulated state: the section state and the mass offset in force."""
_PRIOR = (0.01, 0.03, 0.05, 0.08, 0.03)
"""How far states stray from the gait, heading apart; weighs what the last step's turn is estimated from."""

_NUDGE = 1e-6
"""For central differences: its square and round-off over it are both some 1e-10."""


@dataclass(frozen=True)
class LqrWeights:
    """Deviations that cost as much as one another; infinite ones cost nothing.

    Attributes
    ----------
    heading, ankle_angle : rad
    stance_pitch_rate, ankle_rate : rad / time unit
    mass_offset, offset_change : leg lengths
    inter_leg_angle : rad
    speed : leg lengths / time unit
        Of the step, which the state does not hold: a cost of state and inputs together.
    """

    heading: float = 0.08
    ankle_angle: float = 0.8
    stance_pitch_rate: float = 2.6
    ankle_rate: float = 0.22
    mass_offset: float = math.inf
    inter_leg_angle: float = 0.035
    offset_change: float = 0.016
    speed: float = math.inf

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0.0:
                raise ValueError(f"{name} must be in (0, inf], not {value!r}")
        for name in ("heading", "inter_leg_angle", "offset_change"):
            if math.isinf(getattr(self, name)):
                raise ValueError(
                    f"{name} must be in (0, inf), not inf: the feedback needs its cost"
                )

    def matrices(self) -> tuple[Vector, Vector]:
        """Costs of the state (6, 6) and of the inputs (2, 2)."""
        scales = np.array(
            [self.heading, math.inf, self.ankle_angle, self.stance_pitch_rate, self.ankle_rate, self.mass_offset]
        )  # fmt: skip
        inputs = np.array([self.inter_leg_angle, self.offset_change])
        return np.diag(scales**-2), np.diag(inputs**-2)


@dataclass(frozen=True)
class LinearStep:
    """The mirrored step map about a state on the left foot.

    Attributes
    ----------
    by_state : shape (6, 6)
    by_input : shape (6, 2)
    speed : shape (8,)
        How the step's speed along the mean heading of its two footprints follows from state and inputs.
    """

    by_state: Vector
    by_input: Vector
    speed: Vector


def linearise_step(
    walker: Walker,
    state: Vector,
    inter_leg_angle: float,
    mass_offset: float,
    previous_offset: float | None = None,
) -> LinearStep:
    """Linearise the mirrored step from a left-stance section state (5,), the masses going from ``previous_offset`` to ``mass_offset``.

    Without a previous offset they are held.

    Raises
    ------
    FellError
        If the walker does not complete the step.
    """
    before = mass_offset if previous_offset is None else previous_offset
    step = differentiate_step(walker, state, "left", Command(inter_leg_angle, mass_offset, before))
    by_state, by_input = np.zeros((SIZE, SIZE)), np.zeros((SIZE, 2))
    by_state[:STATE_SIZE, :STATE_SIZE] = MIRROR[:, None] * step.by_state
    by_state[:STATE_SIZE, -1] = MIRROR * (step.by_mass_offset + step.by_previous_offset)
    by_input[:STATE_SIZE, 0] = MIRROR * step.by_inter_leg_angle
    by_input[:STATE_SIZE, 1] = MIRROR * step.by_mass_offset
    # the masses arrive at old offset + change within the step, and the mirror turns their side round
    by_state[-1, -1] = by_input[-1, 1] = -1.0
    speed = _speed_gradient(
        walker, state, np.array([before, inter_leg_angle, mass_offset - before])
    )
    return LinearStep(by_state, by_input, speed)


def _speed_gradient(walker: Walker, state: Vector, others: Vector) -> Vector:
    """Central differences of a step's speed by the state (5,), and the old offset, the angle and the change of offset (3,)."""

    def speed(point: Vector) -> float:
        before, angle, change = point[STATE_SIZE:]
        step = walker.step(
            point[:STATE_SIZE],
            inter_leg_angle=angle,
            mass_offset=before + change,
            previous_offset=before,
        )
        heading = 0.5 * (point[0] + step.state[0])
        downhill, right = step.displacement
        return (downhill * math.cos(heading) - right * math.sin(heading)) / step.duration

    middle = np.concatenate([state, others])
    nudges = _NUDGE * np.eye(len(middle))
    return np.array([speed(middle + n) - speed(middle - n) for n in nudges]) / (2.0 * _NUDGE)


def periodic_gains(now: LinearStep, then: LinearStep, weights: LqrWeights) -> tuple[Vector, Vector]:
    """The optimal gains (2, 6), input = -gain z, for ``now`` and for ``then`` where the two steps alternate for ever.

    The Riccati equation is that of two steps at once; its solution is the cost to go before ``now``, and the one before ``then`` follows
    by one step of the recursion.
    """
    first, second = _costs(now, weights), _costs(then, weights)
    a, b = now.by_state, now.by_input
    both = then.by_state @ a
    by_both = np.hstack([then.by_state @ b, then.by_input])
    state_cost = first.state + a.T @ second.state @ a
    cross = np.hstack([first.cross + a.T @ second.state @ b, a.T @ second.cross])
    mixed = b.T @ second.cross
    input_cost = np.block([[first.input + b.T @ second.state @ b, mixed], [mixed.T, second.input]])
    cost_to_go = solve_discrete_are(both, by_both, state_cost, input_cost, s=cross)
    gain = _gain(then, cost_to_go, second)
    a, b = then.by_state, then.by_input
    before_then = second.state + a.T @ cost_to_go @ (a - b @ gain) - second.cross @ gain
    return _gain(now, 0.5 * (before_then + before_then.T), first), gain


class _Costs(NamedTuple):
    """z' state z + 2 z' cross v + v' input v."""

    state: Vector
    cross: Vector
    input: Vector


def _costs(step: LinearStep, weights: LqrWeights) -> _Costs:
    state, inputs = weights.matrices()
    by_state, by_input = step.speed[:SIZE] / weights.speed, step.speed[SIZE:] / weights.speed
    return _Costs(
        state + np.outer(by_state, by_state),
        np.outer(by_state, by_input),
        inputs + np.outer(by_input, by_input),
    )


def _gain(step: LinearStep, cost_to_go: Vector, costs: _Costs) -> Vector:
    weighed = step.by_input.T @ cost_to_go
    return np.linalg.solve(
        costs.input + weighed @ step.by_input, weighed @ step.by_state + costs.cross.T
    )


def last_turn(before: LinearStep, weights: LqrWeights) -> Vector:
    """What (5,) times (state without heading, offset) best estimates how far the last step turned.

    Feedback is on the heading of the last footprint, tasks show the error of the mean of two. The last step's heading change follows
    from what the step before started with, of which as much is left in the state as the map tells: the Gaussian estimate.
    """
    spread = np.array([*_PRIOR, 0.5 * weights.inter_leg_angle, weights.offset_change])
    ways = np.hstack([before.by_state[:, 1:], before.by_input]) * spread
    turned, seen = ways[0], ways[1:]
    floor = 1e-6 * np.diag(np.square(_PRIOR))
    return np.linalg.solve(seen @ seen.T + floor, seen @ turned)
