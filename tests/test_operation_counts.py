"""How often a step evaluates the equations of motion, over fixed seeds: a measure of work that no machine makes noisy."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.populations import Population, perturbed_gait, slow_near_falls
from lean_yaw_env.kernel.batch import step_batch
from lean_yaw_env.kernel.records import SIDEWAYS, STEPPED, Outcome
from lean_yaw_env.parameters import Vector

WALKERS = 4096
STATUS = Outcome._fields.index("status")
EVALUATIONS = Outcome._fields.index("evaluations")
DURATION = Outcome._fields.index("duration")

# Mean counts as recorded. A count is whole, but which side of an error bound a step falls on may change with the last bit of another
# processor's or compiler's arithmetic, for a few walkers in thousands: 0.2 leaves room for 60 of 4,096 by one stage set of 13.
RECORDED = {"resting": 36.84, "near falls": 64.43, "moving": 77.76}
ROOM = 0.2


def _outcomes(population: Population) -> Vector:
    step_batch(*population, 0, population.size)
    return population.outcomes


def test_steps_of_the_perturbed_gait_take_at_most_forty_evaluations_on_average() -> None:
    outcomes = _outcomes(perturbed_gait(WALKERS))
    assert (outcomes[:, STATUS] == STEPPED).all()
    assert outcomes[:, EVALUATIONS].mean() <= 40.0


def test_slow_near_falls_take_at_most_seventy_five_evaluations_on_average() -> None:
    outcomes = _outcomes(slow_near_falls(WALKERS))
    falls = outcomes[:, STATUS] == SIDEWAYS
    # the set is what it says: slow, and with some on either side of the edge
    assert 0.05 < falls.mean() < 0.5
    assert (falls | (outcomes[:, STATUS] == STEPPED)).all()
    assert outcomes[:, DURATION].mean() > 1.2  # the gait's is 0.72
    assert outcomes[:, EVALUATIONS].mean() <= 75.0


@pytest.mark.parametrize(
    ("name", "population"),
    [
        ("resting", perturbed_gait(WALKERS)),
        ("near falls", slow_near_falls(WALKERS)),
        ("moving", perturbed_gait(WALKERS, moving=True)),
    ],
)
def test_counts_are_as_recorded(name: str, population: Population) -> None:
    assert abs(_outcomes(population)[:, EVALUATIONS].mean() - RECORDED[name]) <= ROOM


def test_every_count_is_a_start_some_attempts_and_a_landing() -> None:
    population = perturbed_gait(WALKERS, moving=True)
    attempts = (_outcomes(population)[:, EVALUATIONS] - 5.0) / 13.0
    assert (attempts >= 1.0).all()
    assert (attempts == np.round(attempts)).all()
