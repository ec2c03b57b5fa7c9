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
from agents.command_line import app
from agents.evaluation.closed_loop_interface import closed_loop
from agents.evaluation.closed_loop_page import csv_text, write_report
from agents.evaluation.closed_loop_report import (
    LINES,
    REACHES,
    ZERO,
    box_survival,
    examine,
    plain,
)
from agents.observations import ObservationLayout
from lean_yaw_env import Walker, WalkerParameters
from lean_yaw_env.analysis import find_limit_cycle, largest_pushes, modes
from lean_yaw_env.analysis.many_walks import walk_many
from lean_yaw_env.analysis.step_derivatives import differentiate_step
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.kernel.records import Command
from lean_yaw_env.parameters import MIRROR, STATE_FIELDS
from tests.closed_loop_cases import CASES, KEPT, NUMBERS, described, examined

FIXED = closed_loop(FixedController(), "Heading")
# gains of its own: those tuned may change, and may bring a gait next to a limit of its actions
GAINS = HeadingGains(
    proportional=0.05, ankle=-0.056, ankle_rate=0.01, feedforward=0.95, inter_leg_angle=0.1
)
FEEDBACK_AGENT = HeadingFeedback(gains=GAINS)
FEEDBACK = closed_loop(FEEDBACK_AGENT, "Heading")


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


@pytest.mark.parametrize(("task", "agent"), CASES)
def test_results_are_those_kept(task, agent):
    """Written by an implementation of its own, before walker and agent became a section map."""
    kept = {(each["task"], each["agent"]): each for each in json.loads(KEPT.read_text())}
    before, now = kept[task, agent], described(examined(task, agent))
    for name in ("basins", "box"):
        ends = zip("".join(before[name]), "".join(now[name]), strict=True)
        # single precision differs from processor to processor, and a start at a basin's edge may tip over
        assert sum(a != b for a, b in ends) <= 2
    if before["gait"] is None:
        assert now["gait"] is None
        return
    before, now = before["gait"], now["gait"]
    # agents' actions are rounded to some 1e-8, through multipliers near one
    for name, value in before["state"].items():
        assert now["state"][name] == pytest.approx(value, abs=1e-6)
    for name in NUMBERS:
        assert now[name] == pytest.approx(before[name], abs=1e-6)
    assert np.allclose(now["commands"], before["commands"], atol=1e-6)
    assert np.allclose(now["pushes"], before["pushes"], atol=1.6 / 1024 + 1e-9)
    assert (now["neutral"], now["is_at_limit"]) == (before["neutral"], before["is_at_limit"])
    found = [complex(*value) for value in now["eigenvalues"]]
    for value, error, about in zip(*(before[k] for k in ("eigenvalues", "errors", "about")), strict=True):  # fmt: skip
        if abs(complex(*value)) > ZERO:
            nearest = int(np.abs(np.array(found) - complex(*value)).argmin())
            assert abs(found[nearest] - complex(*value)) <= error + 1e-9
            assert now["about"][nearest] == about


@pytest.mark.parametrize(
    ("task", "slope"), [("Heading", 0.01), ("Metastable", 0.01), ("Walk", 0.02)]
)
def test_the_walker_that_is_not_acted_on_keeps_the_eigenvalues_of_its_own_gait(task, slope):
    gait = find_limit_cycle(closed_loop(FixedController(), task, EnvOptions(slope=slope)))
    cycle = find_limit_cycle(Walker(WalkerParameters(slope=slope)))
    assert matched(gait.eigenvalues, cycle.eigenvalues) < 1e-6
    assert np.allclose(gait.state[:5], cycle.state, atol=1e-9)
    # what is left of the offset and of the footprint before is gone after a stride
    assert sum(abs(value) < 1e-6 for value in gait.eigenvalues) == 3
    for name in ("speed", "step_length", "greatest_friction", "least_normal_force", "gravity_work"):
        assert getattr(gait, name) == pytest.approx(getattr(cycle, name), abs=1e-9)


def test_linear_feedback_moves_the_eigenvalues_to_those_of_a_minus_b_k(walker, gait):
    a, b = mirrored_linear_step(walker, gait)
    costs, inputs = np.diag([150.0, 0.0, 2.0, 0.2, 20.0, 0.0]), np.diag([800.0, 4e3])
    cost_to_go = solve_discrete_are(a, b, costs, inputs)
    gain = np.linalg.solve(inputs + b.T @ cost_to_go @ b, b.T @ cost_to_go @ a)
    found = find_limit_cycle(closed_loop(Linear(gain, gait), "Heading"))
    error = max(mode.error for mode in modes(found) if abs(mode.eigenvalue) > ZERO)
    expected = np.linalg.eigvals(a - b @ gain) ** 2
    kept = [value for value in expected if abs(value) > 0.01]
    # actions are rounded to 6e-8 of their range, differences of them to some 1e-5, which the gait's error bounds
    assert matched(found.eigenvalues, kept) < max(error, 1e-4) < 2e-3
    assert found.is_stable and found.spectral_radius < np.abs(find_limit_cycle(walker).eigenvalues).max()  # fmt: skip


@pytest.mark.parametrize("task", ["Heading", "SpeedHeading"])
def test_the_map_is_the_environments_own_step_bit_for_bit(task):
    agent = HeadingFeedback(task, gains=GAINS)
    commands = {"speed": 0.4} if task == "SpeedHeading" else {}
    loop = closed_loop(agent, task, commands=commands)
    env = WalkerEnv(task, start_disturbance=0.0, horizon=math.inf)
    state = loop.start.copy()
    state[[0, 2, 3]] += 0.1, 0.01, 0.02
    options = {"state": state[:5], "stance": "left", "command": 0.0, **commands}
    observation, _ = env.reset(seed=1, options=options)
    foot, carried = 0, np.zeros(1)
    state[6] = state[0]  # an episode starts with both footprints alike
    for k in range(6):
        if k:  # at the start of an episode there is no last speed to observe
            assert np.array_equal(observation, loop.interface.observe(state[None], ("left", "right")[foot])[0])  # fmt: skip
        action = agent.predict(observation)[0]
        command = loop.interface.command(state[None], ("left", "right")[foot], action[None])[0]
        observation, _, _, _, info = env.step(action)
        assert command.tolist() == [info["inter_leg_angle"], info["commanded_offset"]]
        loop_after, _, _ = loop.step_many(state[None], carried, foot)
        if k or task == "Heading":
            assert np.array_equal(info["state"], loop_after[0, :5])
            assert info["mass_offset"] == loop_after[0, 5]
        state, foot = np.array([*info["state"], info["mass_offset"], state[0], *([info["speed"]] if len(state) > 7 else [])]), 1 - foot  # fmt: skip


@pytest.mark.parametrize("task", ["Heading", "SpeedHeading"])
def test_the_jacobian_is_the_limit_of_small_differences_of_the_stride(task):
    loop = closed_loop(HeadingFeedback(task, gains=GAINS), task)
    gait = find_limit_cycle(loop)
    for column in range(len(gait.state)):
        small = 2e-4 * np.eye(len(gait.state))[column]
        ahead, back = (loop.image(gait.state + way * small) for way in (1.0, -1.0))
        # commands are rounded to some 1e-8, over 4e-4; the third derivative times 4e-8 is less
        assert np.allclose(gait.jacobian[:, column], (ahead - back) / 4e-4, atol=2e-4, rtol=2e-4)
    assert gait.jacobian_error.max() < 1e-3


def test_small_disturbances_die_out_at_the_rate_of_the_largest_eigenvalue():
    gait = find_limit_cycle(FEEDBACK)
    slowest = modes(gait)[0]
    assert slowest.eigenvalue.imag == 0.0
    state = gait.state + 1e-4 * np.real(slowest.vector)
    for _ in range(10):
        state = FEEDBACK.image(state)
    # of second order in a disturbance of 1e-4 of states whose scale is 0.03
    shrunk = np.linalg.norm(state - gait.state) / 1e-4
    assert shrunk == pytest.approx(abs(slowest.eigenvalue) ** 10, rel=0.02)


def test_an_agent_that_asks_for_more_change_than_there_may_be_leaves_the_mean_offset_neutral():
    report = examine("away", Away(), "Heading", points=3, starts=8, directions=2)
    gait = report.gait
    assert gait is not None and report.is_at_limit
    left, right = (step.command.mass_offset for step in gait.steps)
    assert abs(left - right) == pytest.approx(0.005, abs=1e-12)
    assert gait.shift_work > 0.0
    neutral = [mode for mode in report.modes if mode.is_neutral]
    assert len(neutral) == 1 and neutral[0].about == "masses"
    assert gait.spectral_radius < 1.0 and gait.is_stable


@pytest.mark.parametrize(("task", "about"), [("Waypoint", "heading"), ("Slalom", "heading")])
def test_what_the_agent_does_not_answer_to_is_neutral_and_kept_apart(task, about):
    gait = find_limit_cycle(closed_loop(FixedController(), task))
    assert [mode.about for mode in modes(gait) if mode.is_neutral] == [about]
    assert gait.is_stable and math.isfinite(gait.cycles_to_halve)


def test_modes_are_named_by_what_takes_part():
    found = {mode.about for mode in modes(find_limit_cycle(FIXED)) if abs(mode.eigenvalue) > ZERO}
    assert found == {"heading", "pitch", "lean"}


def test_pushes_are_those_that_the_agent_survives():
    few, many = (
        largest_pushes(find_limit_cycle(loop), directions=4, n_steps=40)
        for loop in (FIXED, FEEDBACK)
    )
    assert few.is_limited.all() and many.is_limited.all()
    assert not np.allclose(few.sizes, many.sizes, atol=10 * few.tolerance)


@settings(max_examples=10)
@given(ankle=st.floats(-0.3, 0.3), pitch_rate=st.floats(-0.4, 0.4), ankle_rate=st.floats(-0.8, 0.8))
def test_a_walk_ends_as_the_environments_episode_does(ankle, pitch_rate, ankle_rate):
    state = FEEDBACK.start.copy()
    state[2:5] += ankle, pitch_rate, ankle_rate
    survived = walk_many(FEEDBACK, state[None], 20).survived[0]
    env = WalkerEnv("Heading", horizon=math.inf)
    observation, _ = env.reset(
        seed=0, options={"state": state[:5], "stance": "left", "command": 0.0}
    )
    ends = False
    for _ in range(20):
        observation, _, ends, _, _ = env.step(FEEDBACK_AGENT.predict(observation)[0])
        if ends:
            break
    assert ends != survived


def test_the_box_is_the_same_for_every_agent_and_time():
    first, again = (box_survival(FIXED, starts=64, n_steps=20) for _ in range(2))
    assert np.array_equal(first, again) and 0.0 < first.mean() < 1.0


def test_agents_and_options_without_one_map_are_refused():
    with pytest.raises(ValueError, match="draws"):
        closed_loop(RandomController(0), "Heading")
    with pytest.raises(ValueError, match="remember nothing"):
        closed_loop(Remembers(), "Heading")
    for bad in (
        {"sensor_noise": 0.1},
        {"action_delay": True},
        {"random_body": "training"},
    ):
        with pytest.raises(ValueError, match=next(iter(bad))):
            closed_loop(FixedController(), "Heading", EnvOptions(**bad))
    with pytest.raises(ValueError, match="speed"):
        closed_loop(FixedController(), "Heading", commands={"speed": 0.4})
    with pytest.raises(ValueError, match=r"\[0.3, 0.55\]"):
        closed_loop(FixedController(), "SpeedHeading", commands={"speed": 0.9})


def test_numbers_out_of_range_are_refused():
    for bad in ({"points": 1}, {"starts": 0}, {"directions": 0}):
        with pytest.raises(ValueError, match=f"{next(iter(bad))} must be"):
            examine("fixed", FixedController(), "Heading", **{"points": 3, "starts": 8, "directions": 2, **bad})  # fmt: skip
    assert set(REACHES) <= set(FIXED.names)


def test_a_walker_without_a_gait_is_reported_as_such(tmp_path):
    report = examine("fixed", FixedController(), "Level", points=3, starts=8, directions=2)
    assert report.gait is None and "repeats every 2 steps" in report.why_no_gait
    page = write_report([report], tmp_path, "command")
    assert "repeats every 2 steps" in page.read_text(encoding="utf-8")
    assert plain(report)["spectral_radius"] is None


def test_the_command_writes_page_numbers_and_pictures_and_prints_json(tmp_path):
    arguments = ["closed-loop", "--agents", "fixed,feedback", "--points", "5", "--starts", "16", "--directions", "4"]  # fmt: skip
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
    result = CliRunner().invoke(app, ["closed-loop", *arguments])
    assert result.exit_code == 2 and "must" in result.output
