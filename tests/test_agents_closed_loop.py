"""Walker and agent as one map: it is the environment's, its eigenvalues are those known otherwise, and what it is said to survive it does."""

from __future__ import annotations

import csv
import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_discrete_are
from typer.testing import CliRunner

from agents import FixedController, HeadingFeedback, HeadingGains, RandomController
from agents.evaluation.closed_loop import app, examine, write_report
from agents.evaluation.closed_loop_gait import (
    ZERO,
    find_closed_loop_gait,
    stride,
    stride_jacobian,
)
from agents.evaluation.closed_loop_map import ClosedLoop
from agents.evaluation.closed_loop_report import LINES, csv_text, plain
from agents.evaluation.closed_loop_survival import (
    REACHES,
    SURVIVED,
    basin_slice,
    box_survival,
    largest_pushes,
    pushed,
    walk_on,
)
from agents.observations import ObservationLayout
from lean_yaw_env import Walker, WalkerParameters
from lean_yaw_env.analysis import find_limit_cycle
from lean_yaw_env.analysis.stride import differentiate_step
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.kernel.records import Command
from lean_yaw_env.parameters import MIRROR, STATE_FIELDS

FIXED = ClosedLoop(FixedController(), "Heading")
# gains of its own: those tuned may change, and may bring a gait next to a limit of its actions
GAINS = HeadingGains(
    proportional=0.05, ankle=-0.056, ankle_rate=0.01, feedforward=0.95, inter_leg_angle=0.1
)
FEEDBACK = ClosedLoop(HeadingFeedback(gains=GAINS), "Heading")


class Linear:
    """Feedback of a gain (2, 6) on the deviation from a gait: inter-leg angle, and change of the offset; the left foot's frame."""

    def __init__(self, gain, gait) -> None:
        self.gain, self.gait = gain, gait
        self.layout = ObservationLayout.of("Heading", EnvOptions())

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        seen = self.layout.require(observation)
        names = [*(field.name for field in STATE_FIELDS), "mass_offset"]
        now = np.stack([self.layout.quantity(seen, name) for name in names], axis=-1)
        inputs = -(now - np.append(self.gait, 0.0)) @ self.gain.T
        actions = np.stack([inputs[..., 0] / 0.15, (now[..., 5] + inputs[..., 1]) / 0.05], axis=-1)
        return np.clip(actions, -1.0, 1.0).astype(np.float32), None


class Away:
    """Asks for as much offset away from the stance foot as there is, at every step."""

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        actions = np.zeros((*np.shape(observation)[:-1], 2), dtype=np.float32)
        actions[..., 1] = 1.0
        return actions, None


class Remembers(FixedController):
    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return super().predict(observation)[0], (np.zeros(1),)


def mirrored_linear_step(walker, gait):
    """Matrices of z' = A z + B v over one step of the gait seen in the left foot's frame; z: state and offset, v: angle and change."""
    step = differentiate_step(walker, gait, "left", Command(0.3, 0.0, 0.0))
    a, b = np.zeros((6, 6)), np.zeros((6, 2))
    a[:5, :5] = MIRROR[:, None] * step.by_state
    a[:5, 5] = MIRROR * (step.by_mass_offset + step.by_previous_offset)
    b[:5, 0] = MIRROR * step.by_inter_leg_angle
    b[:5, 1] = MIRROR * step.by_mass_offset
    a[5, 5] = b[5, 1] = -1.0
    return a, b


def matched(found, expected):
    """The largest distance of an expected eigenvalue from the nearest found one."""
    return max(np.abs(np.asarray(found) - value).min() for value in expected)


def own_eigenvalues(gait):
    return [mode.eigenvalue for mode in gait.modes]


@pytest.mark.parametrize(("task", "slope"), [("Heading", 0.01), ("Push", 0.01), ("Walk", 0.02)])
def test_the_walker_that_is_not_acted_on_keeps_the_eigenvalues_of_its_own_gait(task, slope):
    loop = ClosedLoop(FixedController(), task, EnvOptions(slope=slope))
    gait = find_closed_loop_gait(loop)
    cycle = find_limit_cycle(Walker(WalkerParameters(slope=slope)))
    assert matched(own_eigenvalues(gait), cycle.eigenvalues) < 1e-6
    assert np.allclose(gait.state[:5], cycle.state, atol=1e-9)
    # what is left of the offset and of the footprint before is gone after a stride
    assert sum(abs(value) < 1e-6 for value in own_eigenvalues(gait)) == 3
    for name in ("speed", "step_length", "greatest_friction", "least_normal_force", "gravity_work"):
        assert getattr(gait.cycle, name) == pytest.approx(getattr(cycle, name), abs=1e-9)


def test_linear_feedback_moves_the_eigenvalues_to_those_of_a_minus_b_k(walker, gait):
    a, b = mirrored_linear_step(walker, gait)
    costs, inputs = np.diag([150.0, 0.0, 2.0, 0.2, 20.0, 0.0]), np.diag([800.0, 4e3])
    cost_to_go = solve_discrete_are(a, b, costs, inputs)
    gain = np.linalg.solve(inputs + b.T @ cost_to_go @ b, b.T @ cost_to_go @ a)
    found = find_closed_loop_gait(ClosedLoop(Linear(gain, gait), "Heading"))
    expected = np.linalg.eigvals(a - b @ gain) ** 2
    kept = [value for value in expected if abs(value) > 0.01]
    # actions are rounded to 6e-8 of their range, differences of them to some 1e-5, which the gait's error bounds
    assert matched(own_eigenvalues(found), kept) < max(found.error, 1e-4) < 2e-3
    assert found.is_stable and found.spectral_radius < np.abs(find_limit_cycle(walker).eigenvalues).max()  # fmt: skip


@pytest.mark.parametrize("loop", [FIXED, FEEDBACK], ids=["fixed", "feedback"])
def test_the_map_is_the_environments_own_step_bit_for_bit(loop):
    env = WalkerEnv("Heading", start_disturbance=0.0, horizon=math.inf)
    state = loop.start.copy()
    state[[0, 2, 3]] += 0.1, 0.01, 0.02
    state[6] = state[0]  # an episode starts with both footprints alike
    observation, info = env.reset(
        seed=1, options={"state": state[:5], "stance": "left", "command": 0.0}
    )
    rows = loop.placed(state[None], 1.0)
    for _ in range(6):
        assert np.array_equal(observation, rows.observations[0])
        observation, _, _, _, info = env.step(loop.agent.predict(observation)[0])
        loop.advance(rows, np.ones(1, dtype=bool))
        assert np.array_equal(info["state"], loop.states(rows)[0, :5])
        assert info["mass_offset"] == loop.states(rows)[0, 5]


@pytest.mark.parametrize("task", ["Heading", "SpeedHeading"])
def test_the_jacobian_is_the_limit_of_small_differences_of_the_environments_stride(task):
    loop = ClosedLoop(HeadingFeedback(task, gains=GAINS), task)
    gait = find_closed_loop_gait(loop)
    matrix, error = stride_jacobian(loop, gait.state)
    for column in range(len(gait.state)):
        small = 2e-4 * np.eye(len(gait.state))[column]
        ahead, back = (stride(loop, gait.state + way * small)[0][-1] for way in (1.0, -1.0))
        # commands are rounded to some 1e-8, over 4e-4; the third derivative times 4e-8 is less
        assert np.allclose(matrix[:, column], (ahead - back) / 4e-4, atol=2e-4, rtol=2e-4)
    assert error.max() < 1e-3


def test_small_disturbances_die_out_at_the_rate_of_the_largest_eigenvalue():
    gait = find_closed_loop_gait(FEEDBACK)
    slowest = gait.modes[0].eigenvalue
    assert slowest.imag == 0.0
    values, vectors = np.linalg.eig(gait.cycle.jacobian)
    way = np.real(vectors[:, np.argmin(np.abs(values - slowest))])
    state = gait.state + 1e-4 * way
    for _ in range(10):
        state = stride(FEEDBACK, state)[0][-1]
    # of second order in a disturbance of 1e-4 of states whose scale is 0.03
    shrunk = np.linalg.norm(state - gait.state) / 1e-4
    assert shrunk == pytest.approx(abs(slowest) ** 10, rel=0.02)


def test_an_agent_that_asks_for_more_change_than_there_may_be_leaves_the_mean_offset_neutral():
    gait = find_closed_loop_gait(ClosedLoop(Away(), "Heading"))
    assert gait.is_at_limit
    assert abs(gait.mass_offsets[0] - gait.mass_offsets[1]) == pytest.approx(0.005, abs=1e-12)
    assert gait.cycle.shift_work > 0.0
    neutral = [mode for mode in gait.modes if mode.is_neutral]
    assert len(neutral) == 1 and neutral[0].about == "masses"
    assert gait.spectral_radius < 1.0 and gait.is_stable


@pytest.mark.parametrize(("task", "about"), [("Waypoint", "heading"), ("Slalom", "heading")])
def test_what_the_agent_does_not_answer_to_is_neutral_and_kept_apart(task, about):
    gait = find_closed_loop_gait(ClosedLoop(FixedController(), task))
    assert [mode.about for mode in gait.modes if mode.is_neutral] == [about]
    assert gait.is_stable and math.isfinite(gait.strides_to_halve)


def test_modes_are_named_by_what_takes_part():
    found = {mode.about for mode in find_closed_loop_gait(FIXED).modes if abs(mode.eigenvalue) > ZERO}  # fmt: skip
    assert found == {"heading", "pitch", "lean"}


def test_the_largest_push_is_survived_and_a_little_more_is_not():
    gait = find_closed_loop_gait(FIXED)
    pushes = largest_pushes(FIXED, gait, directions=8)
    assert pushes.is_limited.all()
    within = pushed(gait.state, pushes.angles) - gait.state
    sizes = pushes.sizes[:, None]
    assert (walk_on(FIXED, gait.state + sizes * within) == SURVIVED).all()
    beyond = gait.state + (sizes + 1.01 * pushes.tolerance) * within
    assert (walk_on(FIXED, beyond) != SURVIVED).all()
    # half of it, a size of its own, is survived in every direction: the basin has no hole there
    assert (walk_on(FIXED, gait.state + 0.5 * sizes * within) == SURVIVED).all()


def test_a_push_that_nothing_fells_is_as_large_as_was_looked():
    gait = find_closed_loop_gait(FIXED)
    pushes = largest_pushes(FIXED, gait, directions=4, most=0.05)
    assert not pushes.is_limited.any() and np.allclose(pushes.sizes, 0.05)


def test_pushes_start_from_the_direction_zero_of_the_pitch_rate():
    states = pushed(np.zeros(7), np.array([0.0, 0.5 * math.pi]), 0.1)
    assert np.allclose(states, [[0, 0, 0, 0.1, 0, 0, 0], [0, 0, 0, 0, 0.1, 0, 0]])


def test_the_basin_holds_the_gait_and_shrinks_as_more_steps_are_asked_for():
    few, many = (
        basin_slice(FIXED, "ankle_angle", "ankle_rate", points=15, n_steps=n) for n in (5, 60)
    )
    assert few.endings[7, 7] == many.endings[7, 7] == SURVIVED
    assert not ((many.endings == SURVIVED) & (few.endings != SURVIVED)).any()
    assert 0.0 < many.share < few.share < 1.0
    assert few.centre == (FIXED.start[2], FIXED.start[4])


@settings(max_examples=10)
@given(ankle=st.floats(-0.3, 0.3), pitch_rate=st.floats(-0.4, 0.4), ankle_rate=st.floats(-0.8, 0.8))
def test_a_walk_ends_as_the_environments_episode_does(ankle, pitch_rate, ankle_rate):
    state = FEEDBACK.start.copy()
    state[2:5] += ankle, pitch_rate, ankle_rate
    ending = walk_on(FEEDBACK, state[None], 20)[0]
    env = WalkerEnv("Heading", horizon=math.inf)
    observation, _ = env.reset(
        seed=0, options={"state": state[:5], "stance": "left", "command": 0.0}
    )
    ends = False
    for _ in range(20):
        observation, _, ends, _, _ = env.step(FEEDBACK.agent.predict(observation)[0])
        if ends:
            break
    assert ends == (ending != SURVIVED)


def test_the_box_is_the_same_for_every_agent_and_time():
    first, again = (box_survival(FIXED, starts=64, n_steps=20) for _ in range(2))
    assert np.array_equal(first, again) and 0.0 < first.mean() < 1.0


def test_agents_and_options_without_one_map_are_refused():
    with pytest.raises(ValueError, match="draws"):
        ClosedLoop(RandomController(0), "Heading")
    with pytest.raises(ValueError, match="remember nothing"):
        ClosedLoop(Remembers(), "Heading")
    for bad in (
        {"sensor_noise": 0.1},
        {"action_delay": True},
        {"random_body": "training"},
    ):
        with pytest.raises(ValueError, match=next(iter(bad))):
            ClosedLoop(FixedController(), "Heading", EnvOptions(**bad))
    with pytest.raises(ValueError, match="speed"):
        ClosedLoop(FixedController(), "Heading", commands={"speed": 0.4})
    with pytest.raises(ValueError, match=r"\[0.3, 0.55\]"):
        ClosedLoop(FixedController(), "SpeedHeading", commands={"speed": 0.9})


def test_numbers_out_of_range_are_refused():
    gait = find_closed_loop_gait(FIXED)
    for call in (
        lambda: basin_slice(FIXED, "heading", "ankle_rate"),
        lambda: basin_slice(FIXED, "ankle_angle", "ankle_rate", points=1),
        lambda: box_survival(FIXED, starts=0),
        lambda: largest_pushes(FIXED, gait, directions=0),
        lambda: largest_pushes(FIXED, gait, most=0.0),
        lambda: walk_on(FIXED, gait.state[None], 0),
    ):
        with pytest.raises(ValueError, match="must be"):
            call()
    assert set(REACHES) <= set(FIXED.coordinates)


def test_a_walker_without_a_gait_is_reported_as_such(tmp_path):
    report = examine("fixed", FixedController(), "Level", points=3, starts=8, directions=2)
    assert report.gait is None and "repeats every stride" in report.why_no_gait
    page = write_report([report], tmp_path, "command")
    assert "repeats every stride" in page.read_text(encoding="utf-8")
    assert plain(report)["spectral_radius"] is None


def test_the_command_writes_page_numbers_and_pictures_and_prints_json(tmp_path):
    arguments = ["--agents", "fixed,feedback", "--points", "5", "--starts", "16", "--directions", "4"]  # fmt: skip
    result = CliRunner().invoke(app, [*arguments, "--json", "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    rows = json.loads(result.stdout)
    assert [row["agent"] for row in rows] == ["fixed", "feedback"]
    assert len(rows[0]["eigenvalues"]) == 7 and len(rows[0]["pushes"]) == 4
    page = (tmp_path / "closed_loop.md").read_text(encoding="utf-8")
    for what in ("eigenvalues", "basins", "pushes"):
        name = f"images/closed_loop_heading_{what}.png"
        assert name in page
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")
    written = list(csv.DictReader((tmp_path / "closed_loop.csv").open(encoding="utf-8")))
    assert [row["agent"] for row in written] == ["fixed", "feedback"]
    assert set(written[0]) == {"task", "agent", *(line.name for line in LINES)}
    assert float(written[1]["speed"]) == rows[1]["speed"]


def test_the_csv_leaves_empty_what_is_undefined():
    report = examine("fixed", FixedController(), "Level", points=3, starts=8, directions=2)
    row = next(csv.DictReader(csv_text([report]).splitlines()))
    assert row["speed"] == "" and row["box"] != ""


@pytest.mark.parametrize(
    "arguments",
    [["--task", "Nowhere"], ["--agents", "nobody"], ["--agents", ","], ["--agents", "random"]],
)
def test_the_command_refuses_names_it_does_not_know(arguments):
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 2 and "must" in result.output
