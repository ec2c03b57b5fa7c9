"""The fuzzing program: no random step fails, and what it prints of a failure reproduces it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks import fuzz
from benchmarks.fuzz import Round, as_hex, draw_bodies, reproduce
from lean_yaw_env.batch import bodies_of
from lean_yaw_env.kernel import records
from lean_yaw_env.registration import ENV_IDS
from lean_yaw_env.walker import failure_of

ENV_ID = ENV_IDS[0]

ENDS = {
    records.STEPPED, records.BACKWARD, records.SIDEWAYS, records.TRIP, records.LIFT_OFF,
    records.SLIP, records.NO_STRIKE,
}  # fmt: skip


def test_every_random_step_ends_as_a_step_or_a_fall() -> None:
    each = Round(seed=3, number=0)
    each.walk(4096, 8)
    assert not each.failures
    assert set(each.counts) == ENDS
    assert sum(each.counts.values()) == 8 * 4096


def test_every_random_step_of_an_environment_ends_as_a_step_or_a_fall() -> None:
    each = Round(seed=3, number=0)
    each.play(ENV_ID, 1024, 32)
    assert not each.failures
    assert set(each.counts) <= ENDS
    # those that fell take no step while they begin again
    assert 0.5 * 32 * 1024 < sum(each.counts.values()) < 32 * 1024


def test_no_step_fails_between_two_that_end_differently() -> None:
    each = Round(seed=4, number=0)
    assert each.bisect() > 60
    assert not each.failures


def test_a_round_depends_on_seed_and_number_alone() -> None:
    def counts(number: int) -> dict[int, int]:
        each = Round(seed=5, number=number)
        each.walk(256, 4)
        each.play(ENV_ID, 64, 4)
        return each.counts

    assert counts(7) == counts(7)
    assert counts(7) != counts(8)


def test_all_bodies_drawn_are_allowed() -> None:
    rows = draw_bodies(np.random.default_rng(0), 2000)
    assert (bodies_of(rows) == rows).all()


@pytest.fixture
def failing_row() -> np.ndarray:
    """An ankle next to without inertia on a damper a million times stiffer."""
    body = [0.0, 0.5, 1e-3, 0.01, 0.0, 50.0, 0.35, np.inf, 10.0, 0.0, 0.0]
    return np.array([*body, 0.2, 0.0, 0.0, 1.0 / 3.0, 0.1, 0.1, -0.4, 0.1, 1.0])


def numbers_of(failure: str) -> np.ndarray:
    return np.array([float.fromhex(number) for number in failure.split()[1:]])


def test_a_failure_is_reproduced_from_what_is_printed(failing_row: np.ndarray) -> None:
    assert reproduce(failing_row).status == records.FAILED
    assert (numbers_of(f"--reproduce {as_hex(failing_row)}") == failing_row).all()
    # an error's message ends with the same numbers
    body, command = records.Body(*failing_row[:11]), records.Command(*failing_row[11:14])
    error = failure_of(body, command, failing_row[14:19], failing_row[19])
    assert str(error).endswith(as_hex(failing_row))


def test_a_failure_in_an_environment_is_reproduced_from_what_is_printed(
    failing_row: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fuzz, "draw_bodies", lambda rng, n: np.tile(failing_row[:11], (n, 1)))
    each = Round(seed=1, number=0)
    each.play(ENV_ID, 64, 1)
    assert len(each.failures) == each.counts[int(records.FAILED)] > 0
    assert all(reproduce(numbers_of(failure)).status == records.FAILED for failure in each.failures)


def test_the_program_goes_on_for_as_long_as_told_and_says_how_steps_ended(tmp_path: Path) -> None:
    given = ["--seconds", "0.01", "--out", str(tmp_path / "fuzz.json")]
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.fuzz", *given],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "stepped" in done.stdout
    assert "FAILED" not in done.stdout
    result = json.loads((tmp_path / "fuzz.json").read_text())
    assert result["failures"] == []
    assert sum(result["ends"].values()) == result["steps"] > 1e5
