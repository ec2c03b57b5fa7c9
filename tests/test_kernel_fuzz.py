"""The fuzzing program: no random step fails, and what it prints of a failure reproduces it."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from benchmarks.fuzz import Fuzz, as_hex, draw_bodies, reproduce
from lean_yaw_env.batch import bodies_of
from lean_yaw_env.kernel import records
from lean_yaw_env.walker import failure_of


def test_every_random_step_ends_as_a_step_or_a_fall() -> None:
    fuzz = Fuzz(seed=3, walkers=4096)
    for _ in range(8):
        fuzz.step()
    assert not fuzz.failures
    ends = {
        records.STEPPED, records.BACKWARD, records.SIDEWAYS, records.TRIP, records.LIFT_OFF,
        records.SLIP, records.NO_STRIKE,
    }  # fmt: skip
    assert set(fuzz.counts) == ends
    assert sum(fuzz.counts.values()) == 8 * 4096


def test_no_step_fails_between_two_that_end_differently() -> None:
    fuzz = Fuzz(seed=4, walkers=4096)
    assert fuzz.visit_edges() > 60
    assert not fuzz.failures


def test_all_bodies_drawn_are_allowed() -> None:
    rows = draw_bodies(np.random.default_rng(0), 2000)
    assert (bodies_of(rows) == rows).all()


@pytest.fixture
def failing_row() -> np.ndarray:
    """An ankle next to without inertia on a damper a million times stiffer."""
    body = [0.0, 0.5, 1e-3, 0.01, 0.0, 50.0, 0.35, np.inf, 10.0, 0.0, 0.0]
    return np.array([*body, 0.2, 0.0, 0.0, 1.0 / 3.0, 0.1, 0.1, -0.4, 0.1, 1.0])


def test_a_failure_is_reproduced_from_what_is_printed(failing_row: np.ndarray) -> None:
    assert reproduce(failing_row).status == records.FAILED
    again = np.array([float.fromhex(number) for number in as_hex(failing_row).split()])
    assert (again == failing_row).all()
    # an error's message ends with the same numbers
    body, command = records.Body(*failing_row[:11]), records.Command(*failing_row[11:14])
    error = failure_of(body, command, failing_row[14:19], failing_row[19])
    assert str(error).endswith(as_hex(failing_row))


def test_the_program_goes_on_for_as_long_as_told_and_says_how_steps_ended() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.fuzz", "--seconds", "0.01"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "stepped" in done.stdout
    assert "FAILED" not in done.stdout
