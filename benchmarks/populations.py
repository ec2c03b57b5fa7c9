"""Walkers to measure with, drawn from fixed seeds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lean_yaw_env import Walker, WalkerParameters
from lean_yaw_env.analysis.limit_cycle import find_gait
from lean_yaw_env.batch import bodies_of
from lean_yaw_env.kernel.records import Outcome
from lean_yaw_env.parameters import INTER_LEG_ANGLE, MIRROR, Vector

PERTURBATION = 0.5  # of each coordinate of the gait
HEADINGS = 0.3  # rad, either side of downhill
OFFSETS = 0.01  # leg lengths, either side: twice what a step of the tasks may change
SLOWEST, SLOW = 0.02, 0.3  # of the pitch rate


class Population(NamedTuple):
    """Rows as the batch kernel takes them, and where it puts what comes out."""

    bodies: Vector
    commands: Vector
    states: Vector
    sides: Vector
    outcomes: Vector

    @property
    def size(self) -> int:
        return len(self.states)


def _population(states: Vector, sides: Vector, offsets: Vector, before: Vector) -> Population:
    commands = np.column_stack([np.full(len(states), INTER_LEG_ANGLE), offsets, before])
    outcomes = np.zeros((len(states), len(Outcome._fields)))
    return Population(bodies_of(WalkerParameters()), commands, states, sides, outcomes)


def perturbed_gait(n: int, *, moving: bool = False, seed: int = 0) -> Population:
    """The gait with each coordinate changed by up to half and any heading within 0.3 rad, on either foot.

    The masses rest at an offset within 0.01, or move from one such offset to another.
    """
    rng = np.random.default_rng(seed)
    states = find_gait(Walker()) * rng.uniform(1 - PERTURBATION, 1 + PERTURBATION, (n, 5))
    states[:, 0] = rng.uniform(-HEADINGS, HEADINGS, n)
    sides = rng.choice([-1.0, 1.0], n)
    states[sides < 0.0] *= MIRROR
    offsets = rng.uniform(-OFFSETS, OFFSETS, n)
    before = rng.uniform(-OFFSETS, OFFSETS, n) if moving else offsets.copy()
    return _population(states, sides, offsets, before)


def slow_near_falls(n: int, *, seed: int = 0) -> Population:
    """The perturbed gait at 2 to 30 % of its pitch rate, with the masses at rest.

    Such walkers creep over mid-stance in twice the gait's time, or fall sideways while they try; at rest they would all fall but those that
    the perturbation has put ahead already.
    """
    population = perturbed_gait(n, seed=seed)
    population.states[:, 3] *= np.random.default_rng(seed + 1).uniform(SLOWEST, SLOW, n)
    return population
