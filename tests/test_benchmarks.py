"""Each benchmark runs at its smallest size, and its reports hold together; no value is judged."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from benchmarks import environments, infos, kernel, startup, training
from benchmarks.compare import as_text as comparison_text
from benchmarks.compare import compare, save_plot
from benchmarks.measure import (
    SMALLEST,
    Measurement,
    Timings,
    as_json,
    as_text,
    machine,
    measure,
)

REPOSITORY = Path(__file__).parents[1]
KERNEL_KEYS = {
    "scalar_steps_per_second",
    "batch_steps_per_second",
    "batch_two_cores_steps_per_second",
    "solve_ivp_steps_per_second",
    "max_abs_error",
    "jacobian_over_single_call",
}


@pytest.mark.parametrize("benchmark", [kernel, environments, infos, startup, training])
def test_a_benchmark_runs_at_its_smallest_and_names_each_measurement_once(
    benchmark: ModuleType,
) -> None:
    measured = benchmark.run(smallest=True)
    names = [each.name for each in measured]
    assert len(set(names)) == len(names)
    assert all(np.isfinite(each.value) for each in measured)
    text = as_text(measured)
    assert all(name in text for name in names)


def test_the_kernel_prints_one_json_object_with_the_values_that_are_promised() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.kernel", "--json", "--smallest"],
        cwd=REPOSITORY, capture_output=True, text=True, check=True,
    )  # fmt: skip
    printed = json.loads(done.stdout)
    assert printed.keys() >= KERNEL_KEYS
    # not a timing: the kernels keep this at any size
    assert printed["max_abs_error"] <= 1e-10


def test_the_comparison_is_sorted_plotted_and_says_what_each_peer_steps(tmp_path: Path) -> None:
    speeds = compare(smallest=True)
    rates = [speed.steps_per_second for speed in speeds]
    assert rates == sorted(rates, reverse=True)
    assert all(speed.note for speed in speeds)
    assert {speed.ours for speed in speeds} == {True, False}
    save_plot(speeds, machine(), tmp_path / "comparison.png")
    assert [path.name for path in tmp_path.iterdir()] == ["comparison.png"]
    assert (tmp_path / "comparison.png").read_bytes().startswith(b"\x89PNG")
    assert all(speed.name in comparison_text(speeds) for speed in speeds)


def test_a_target_is_met_from_its_own_side() -> None:
    assert Measurement("a", 2.0, "x", ">=", 2.0).verdict == "met"
    assert Measurement("a", 1.9, "x", ">=", 2.0).verdict == "missed"
    assert Measurement("a", 2.1, "us", "<=", 2.0).verdict == "missed"
    assert Measurement("a", 2.1, "us").verdict == ""
    kept = as_json([Measurement("a", 1.9, "x", ">=", 2.0), Measurement("b", 3.0)])
    assert kept["a"] == 1.9
    assert kept["verdicts"] == {"a": "missed"}
    assert kept["machine"]["cores"] >= 1


def test_a_ratio_is_taken_within_each_round() -> None:
    timings = Timings({"slow": np.array([2.0, 40.0, 6.0]), "fast": np.array([1.0, 20.0, 2.0])})
    assert timings.ratio("slow", "fast") == 2.0
    assert timings.median("slow") == 6.0


def test_every_case_is_called_in_every_round() -> None:
    calls: list[str] = []
    cases = {name: lambda name=name: calls.append(name) for name in ("a", "b")}
    timings = measure(cases, SMALLEST, "turns")
    # one call that is not counted and one that sets the number of repetitions, then one a round
    assert calls[4:] == ["a", "b"] * SMALLEST.rounds
    assert all(len(seconds) == SMALLEST.rounds for seconds in timings.seconds.values())
