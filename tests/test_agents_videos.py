"""Films of agents: they show the episode that the environment walks, for as long as asked, with the pushes on it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from agents import FixedController
from agents.command_line import app
from agents.evaluation import videos
from agents.evaluation.recording import record_episode
from agents.evaluation.videos import DIAL_RADIUS, agent_for, draw_push, film_agent
from agents.seeds import first_seed
from lean_yaw_env.envs.walker_env import WalkerEnv


def test_the_motion_between_heel_strikes_joins_the_episodes_states():
    steps = record_episode(
        FixedController(), "Slalom", seed=first_seed("validation", 0), most_time=8.0
    ).steps
    env = WalkerEnv("Slalom")
    _, info = env.reset(seed=first_seed("validation", 0))
    for step in steps:
        assert np.array_equal(step.scene.pose.state, info["state"])
        assert step.motion.pose(0.0).state[1] == pytest.approx(info["state"][1], abs=1e-12)
        assert step.push is None or np.isfinite(step.push).all()
        _, _, _, _, info = env.step(np.zeros(2, dtype=np.float32))
        assert step.end == pytest.approx(info["time"], rel=1e-12)
    assert steps[-2].end < 8.0 <= steps[-1].end
    # the path within a step ends where the next one's begins: the hips do not jump at heel strike
    for before, after in pairwise(steps):
        assert np.allclose(before.motion.path()[-1], after.motion.path()[0], atol=1e-6)


def test_pushes_are_told_in_standard_deviations_of_the_task():
    steps = record_episode(
        FixedController(), "Metastable", seed=first_seed("validation", 1), most_time=12.0
    ).steps
    sizes = np.array([step.push for step in steps[1:]])
    assert 0.1 < np.abs(sizes).mean() < 2.0  # 0.8 of normal numbers, of some ten here


def test_a_film_lasts_as_long_as_asked(tmp_path):
    path = tmp_path / "push.gif"
    film_agent(FixedController(), "Metastable", path, seconds=0.5, fps=10.0, size=(480, 360), name="fixed")  # fmt: skip
    with Image.open(path) as film:
        assert film.size == (480, 360)
        assert film.n_frames == 5  # pyright: ignore[reportAttributeAccessIssue]
        assert film.info["duration"] == 100


def test_a_push_is_drawn_on_its_dial_only_and_no_push_leaves_the_frame_alone():
    frame = np.full((360, 480, 3), 200, dtype=np.uint8)
    assert draw_push(frame, None) is frame
    drawn = draw_push(frame, (-2.0, 0.0))
    changed = np.argwhere((drawn != frame).any(axis=-1))
    assert len(changed) > 100 and (frame == 200).all()
    assert np.abs(changed[:, 1] - 450).max() <= DIAL_RADIUS + 1 and changed[:, 0].max() < 70
    # forward is up: the arrow fills more of the dial's upper half
    inked = (np.abs(drawn.astype(int) - drawn[28, 450].astype(int)).sum(axis=-1) < 30)[:52, 410:480]
    assert inked[:27].sum() > 2 * inked[30:].sum()


def test_a_stand_in_is_filmed_where_no_trained_agent_is(tmp_path, monkeypatch):
    monkeypatch.setattr(videos, "names_for", lambda request: ("random", "fixed", "lqr"))
    assert agent_for("ppo", "Heading", tmp_path)[0] == "lqr"
    assert agent_for("fixed", "Heading", tmp_path)[0] == "fixed"
    monkeypatch.setattr(videos, "names_for", lambda request: ("random",))
    with pytest.raises(ValueError, match="must be one for Heading"):
        agent_for("ppo", "Heading", tmp_path)


@pytest.mark.parametrize(
    "arguments",
    [
        {"path": "film.avi"},
        {"seconds": 0.0},
        {"fps": 0.5},
        {"speed": -1.0},
        {"size": (10, 10)},
        {"seed": -1},
    ],
)
def test_bad_arguments_are_refused_before_anything_is_written(tmp_path, arguments):
    path = tmp_path / arguments.pop("path", "film.gif")
    with pytest.raises(ValueError, match="must"):
        film_agent(FixedController(), "Walk", path, **arguments)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("arguments", [["--task", "Nowhere"], ["--agent", "nobody"]])
def test_the_command_refuses_names_it_does_not_know(tmp_path, arguments):
    result = CliRunner().invoke(app, ["film", *arguments, "--out", str(tmp_path / "films")])
    assert result.exit_code == 2 and "must" in result.output
    assert not (tmp_path / "films").exists()
