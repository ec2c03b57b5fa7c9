"""The kernel compiled for the web gives the package's bits."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from lean_yaw_env import WalkerParameters
from lean_yaw_env.analysis import find_limit_cycle
from lean_yaw_env.kernel import records
from lean_yaw_env.kernel.fusing import multiply_add
from lean_yaw_env.kernel.jacobian import OUTPUTS, step_jacobian
from lean_yaw_env.kernel.passive import (
    INPUTS as PASSIVE_INPUTS,
)
from lean_yaw_env.kernel.passive import (
    PassiveOutcome,
    passive_batch,
    passive_jacobian,
    passive_trace,
)
from lean_yaw_env.kernel.records import Body, Command, Outcome
from lean_yaw_env.kernel.step import step
from lean_yaw_env.kernel.trace import COLUMNS, trace
from lean_yaw_env.passive import PassiveWalker

WEB = Path(__file__).parents[1] / "web"
NODE = shutil.which("node")
PASSIVE_COLUMNS = 8
SAMPLES = 17
INPUTS = 8  # the section state and the command

sys.path.insert(0, str(WEB))
build_kernel = pytest.importorskip("build_kernel", reason="the page's sources are not here")

pytestmark = pytest.mark.skipif(NODE is None, reason="Node.js is not installed")


def run_module(name, rows, results, *arguments):
    """What the module's function gives for each row: its arrays' numbers and, last, what it returns."""
    script = WEB / "tests" / "run_module.mjs"
    rows = np.ascontiguousarray(rows)
    done = subprocess.run(
        [NODE, script, build_kernel.MODULE, name, str(rows.shape[1]), str(results), *arguments],
        input=rows.tobytes(),
        stdout=subprocess.PIPE,
        check=True,
    )
    return np.frombuffer(done.stdout).reshape(len(rows), results)


def assert_same_bits(ours, theirs):
    same = ours.view(np.int64) == theirs.view(np.int64)
    assert np.all(same | (np.isnan(ours) & np.isnan(theirs)))


def bodies(rng, n):
    """Walkers of all kinds: some with springs, little friction, little time, or a slope that turns with them."""
    rows = np.tile(np.array(WalkerParameters().body()), (n, 1))

    def put(name, values, where):
        rows[where, Body._fields.index(name)] = values[where]

    kind = rng.integers(0, 8, n)
    put("hip_width", rng.uniform(0.0, 0.6, n), kind > 0)
    put("foot_radius", rng.uniform(0.0, 0.8, n), kind > 0)
    put("ankle_tilt", rng.uniform(0.2, 1.5, n), kind > 1)
    put("slope", rng.uniform(-0.02, 0.05, n), kind > 0)
    put("ankle_stiffness", rng.uniform(0.0, 0.5, n), kind == 2)
    put("ankle_damping", rng.uniform(0.0, 0.2, n), kind == 2)
    put("shift_time", rng.uniform(0.05, 0.6, n), kind == 3)
    put("friction_limit", rng.uniform(0.05, 0.6, n), kind == 4)
    put("max_step_duration", rng.uniform(0.3, 3.0, n), kind == 5)
    put("slope_turns", np.ones(n), kind == 6)
    put("strike_at_start", np.ones(n), kind == 7)
    return rows


def walker_rows(n, seed=1):
    rng = np.random.default_rng(seed)
    spread = np.where(rng.uniform(size=(n, 1)) < 0.5, 0.3, 2.5)
    gait = np.array([0.0, 0.155, -0.004, -0.42, -0.07])
    states = gait * (1.0 + spread * rng.uniform(-1.0, 1.0, (n, 5)))
    states[:, 0] = rng.uniform(-2.0, 2.0, n)
    states[:, 3] *= rng.choice([1.0, 2.5], n)
    states[:, 4] += spread[:, 0] * rng.uniform(-0.3, 0.3, n)
    offsets = rng.uniform(-0.06, 0.06, (n, 2)) * rng.choice([0.0, 1.0], (n, 1))
    commands = np.column_stack([rng.uniform(0.1, 0.6, n), offsets])
    return np.column_stack([bodies(rng, n), commands, states, rng.choice([-1.0, 1.0], n)])


def parts_of(rows):
    """Body, command, state and side of each row."""
    at, state = len(Body._fields), len(Body._fields) + len(Command._fields)
    for row in rows:
        yield row[:at].copy(), row[at:state].copy(), row[state:-1].copy(), row[-1]


def outcomes_of(rows):
    out = np.empty((len(rows), len(Outcome._fields)))
    for i, (body, command, state, side) in enumerate(parts_of(rows)):
        step(body, command, state, side, out[i])
    return out


def passive_rows(n, seed=2):
    """Rows around a gait of the passive walker; half start with the swing leg where they are told."""
    rng = np.random.default_rng(seed)
    gait = find_limit_cycle(PassiveWalker(WalkerParameters(hip_width=0.0, slope=0.004))).state
    states = gait * (1.0 + rng.choice([0.05, 0.5, 2.0], (n, 1)) * rng.uniform(-1.0, 1.0, (n, 6)))
    states[:, [0, 2, 4]] = (
        0.1 * rng.uniform(-1.0, 1.0, (n, 3)) * rng.choice([0.0, 1.0, 5.0], (n, 1))
    )
    states[:, 3] *= rng.choice([1.0, 4.0], n)
    angles = np.where(rng.uniform(size=n) < 0.5, np.nan, rng.uniform(-0.5, 0.3, n))
    return np.column_stack([bodies(rng, n), states, angles, rng.choice([-1.0, 1.0], n)])


def test_module_is_compiled_from_the_sources_as_they_are():
    module = build_kernel.MODULE.read_bytes()
    assert build_kernel.digest_in(module) == build_kernel.digest_of_sources(), (
        "the kernel has changed: run web/build_kernel.py, then npm run build in web"
    )


def test_steps_have_the_same_bits_whatever_their_end():
    rows = walker_rows(6000)
    expected = outcomes_of(rows)
    statuses = set(expected[:, Outcome._fields.index("status")])
    assert statuses >= {
        records.STEPPED, records.BACKWARD, records.SIDEWAYS, records.TRIP, records.LIFT_OFF,
        records.SLIP, records.NO_STRIKE,
    }  # fmt: skip
    size = expected.shape[1]
    assert_same_bits(run_module("walker_step", rows, size + 1, f"@{size}")[:, :size], expected)


def test_a_landing_that_only_the_careful_way_finds_has_the_same_bits():
    state = [
        0.08701609192211816, 0.0011395946107252142, 0.03551927686193307, -1.0638458784542566, -0.598656327897991,
    ]  # fmt: skip
    body, near = WalkerParameters().body(), np.random.default_rng(8).uniform(-1e-6, 1e-6, (10, 5))
    rows = np.array([[*body, 0.15, 0.0, 0.0, *(state + each), 1.0] for each in near])
    expected = outcomes_of(rows)
    assert (expected[:, Outcome._fields.index("status")] != records.FAILED).all()
    size = expected.shape[1]
    assert_same_bits(run_module("walker_step", rows, size + 1, f"@{size}")[:, :size], expected)
    derived = np.empty((len(rows), 5 + len(OUTPUTS) * INPUTS + 1))
    for i, (body, command, start, side) in enumerate(parts_of(rows)):
        status, outputs, jacobian = step_jacobian(body, command, start, side, inputs=INPUTS)
        derived[i] = [*outputs[:5], *jacobian.ravel(), status]
    ours = run_module("walker_jacobian", rows, derived.shape[1], "@5", f"@{len(OUTPUTS) * INPUTS}")
    assert_same_bits(ours, derived)


def test_motion_within_a_step_has_the_same_bits():
    rows = walker_rows(500, seed=3)
    durations = outcomes_of(rows)[:, Outcome._fields.index("duration")]
    expected = np.empty((len(rows), SAMPLES, len(COLUMNS)))
    for i, (body, command, state, side) in enumerate(parts_of(rows)):
        trace(Body(*body), Command(*command), *state, side, durations[i], expected[i])
    size = SAMPLES * len(COLUMNS)
    with_durations = np.column_stack([rows, durations])
    ours = run_module("walker_trace", with_durations, size + 1, "%", str(SAMPLES), f"@{size}")[
        :, :size
    ]
    assert_same_bits(ours, expected.reshape(len(rows), size))


def test_derivatives_of_a_step_have_the_same_bits():
    rows = walker_rows(1000, seed=4)
    n_outputs = len(OUTPUTS)
    expected = np.empty((len(rows), 5 + n_outputs * INPUTS + 1))
    for i, (body, command, state, side) in enumerate(parts_of(rows)):
        status, outputs, jacobian = step_jacobian(body, command, state, side, inputs=INPUTS)
        expected[i] = [*outputs[:5], *jacobian.ravel(), status]
    ours = run_module("walker_jacobian", rows, expected.shape[1], "@5", f"@{n_outputs * INPUTS}")
    assert_same_bits(ours, expected)


def test_a_walk_ends_after_the_same_steps_with_the_same_bits():
    rows = walker_rows(300, seed=5)
    size, n = len(Outcome._fields), 12
    expected, counts = np.empty((len(rows), size)), np.empty(len(rows))
    at = len(Body._fields)
    for i, row in enumerate(rows.copy()):
        for k in range(n):
            expected[i] = outcomes_of(row[None])[0]
            outcome = Outcome(*expected[i])
            if outcome.status != records.STEPPED:
                counts[i] = k
                break
            row[at + len(Command._fields) : -1] = outcome[:5]
            row[at + Command._fields.index("previous_offset")] = outcome.mass_offset
            row[-1] = -row[-1]
            counts[i] = k + 1
    ours = run_module("walker_walk", rows, size + 1, str(n), f"@{size}")
    assert_same_bits(ours[:, :size], expected)
    assert np.array_equal(ours[:, size], counts)
    assert len(set(counts)) > 3


def test_passive_steps_have_the_same_bits_whatever_their_end():
    rows = passive_rows(4000)
    n_body = len(Body._fields)
    expected = np.empty((len(rows), len(PassiveOutcome._fields)))
    passive_batch(
        np.ascontiguousarray(rows[:, :n_body]), np.ascontiguousarray(rows[:, n_body:-2]),
        rows[:, -2].copy(), rows[:, -1].copy(), expected, 0, len(rows),
    )  # fmt: skip
    statuses = set(expected[:, PassiveOutcome._fields.index("status")])
    assert statuses >= {
        records.STEPPED, records.BACKWARD, records.SIDEWAYS, records.TRIP, records.LIFT_OFF,
        records.SLIP, records.NO_STRIKE,
    }  # fmt: skip
    size = expected.shape[1]
    assert_same_bits(run_module("passive_step", rows, size + 1, f"@{size}")[:, :size], expected)


def test_passive_motion_and_derivatives_have_the_same_bits():
    rows = passive_rows(300, seed=6)
    n_body = len(Body._fields)
    size = SAMPLES * PASSIVE_COLUMNS
    moved, derived = np.empty((len(rows), size)), np.empty((len(rows), 6 + 6 * PASSIVE_INPUTS + 1))
    for i, row in enumerate(rows):
        body, state = Body(*row[:n_body]), row[n_body:-2].copy()
        passive_trace(body, state, row[-2], row[-1], 0.4, moved[i].reshape(SAMPLES, -1))
        after, jacobian = np.empty(6), np.empty((6, PASSIVE_INPUTS))
        status = passive_jacobian(body, state, row[-1], after, jacobian)
        derived[i] = [*after, *jacobian.ravel(), status]
    ours = run_module("passive_motion", rows, size + 1, "0.4", str(SAMPLES), f"@{size}")
    assert_same_bits(ours[:, :size], moved)
    ours = run_module("passive_derivative", rows, derived.shape[1], "@6", f"@{6 * PASSIVE_INPUTS}")
    assert_same_bits(ours, derived)


def test_multiply_add_rounds_once_for_ordinary_and_extreme_numbers():
    from numba import njit

    fused = njit(lambda a, b, c: multiply_add(a, b, c))
    rng = np.random.default_rng(7)
    n = 20_000
    exponents = rng.choice([1, 60, 500], n)
    numbers = rng.uniform(-1.0, 1.0, (n, 3)) * 2.0 ** np.round(
        exponents[:, None] * rng.uniform(-1.0, 1.0, (n, 3))
    )
    # sums that nearly cancel, and ties
    near = rng.uniform(size=n) < 0.3
    numbers[near, 2] = -numbers[near, 0] * numbers[near, 1]
    small = rng.uniform(size=n) < 0.2
    numbers[small] = np.round(numbers[small] * 8.0) / 8.0
    specials = np.array([0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, 5e-324, 1.7e308, 2.0**-537])
    corners = np.array(np.meshgrid(specials, specials, specials)).reshape(3, -1).T
    rows = np.vstack([numbers, corners])
    expected = np.array([fused(*row) for row in rows])
    ours = run_module("fused_multiply_add", rows, 1, "columns")
    assert_same_bits(ours[:, 0], expected)
