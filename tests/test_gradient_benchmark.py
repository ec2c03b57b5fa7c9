"""The comparison of the gradient agent with PPO: policies looked at are those trained, and what is made of the looks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from agents.learning.algorithms import train
from agents.learning.apg import GradientSettings
from agents.learning.ppo import PPOSettings
from agents.learning.recorder import read_checkpoint
from benchmarks.gradient import Curve, policy_in, save_comparison, table

ID = "LeanYaw/Heading-v1"
PPO = PPOSettings(steps=256, walkers=8, steps_per_update=16, batch_size=64, epochs=1, hidden=(8, 8))
APG = GradientSettings(
    steps=256, walkers=8, window=8, critic_first=0, critic_epochs=1, critic_batches=2, hidden=(8, 8)
)


@pytest.mark.parametrize(("algorithm", "settings"), [("ppo", PPO), ("apg", APG)])
def test_policy_looked_at_in_a_checkpoint_is_the_one_trained(algorithm, settings, tmp_path: Path):
    file = tmp_path / "checkpoint.safetensors"
    trained = train(algorithm, ID, settings, checkpoint=file, progress=False)
    found = policy_in(ID, algorithm, read_checkpoint(file))
    observation = np.random.default_rng(0).normal(size=(50, 7)).astype(np.float32)
    assert (found.predict(observation)[0] == trained.policy.predict(observation)[0]).all()


def curves() -> list[Curve]:
    """Two trainings that come to 50 at 300 and 500 steps, and one that does not."""
    return [
        Curve("apg", 0, {}, [100, 300, 500], [1.0, 3.0, 5.0], [10.0, 50.0, 90.0]),
        Curve("apg", 1, {}, [100, 300, 500], [1.0, 3.0, 5.0], [10.0, 40.0, 80.0]),
        Curve("ppo", 0, {}, [1000, 3000], [2.0, 6.0], [10.0, 45.0]),
    ]


def test_a_level_is_reached_at_the_first_look_at_or_above_it():
    first, _, never = curves()
    assert first.reaches(50.0) == (300.0, 3.0)
    assert never.reaches(50.0) == (np.inf, np.inf)
    lines = table(curves(), [50.0]).splitlines()
    assert lines[1].split() == ["50", "apg", "2", "400", "4.0"]  # the median of 300 and 500
    assert lines[2].split() == ["50", "ppo", "1", "inf", "inf"]


def test_picture_of_the_comparison_is_written(tmp_path: Path):
    path = tmp_path / "curves.png"
    save_comparison(curves(), "Heading", {"processor": "a processor"}, path)
    assert path.read_bytes().startswith(b"\x89PNG")
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    save_comparison([replace(curves()[2])], "Heading", {"processor": "a processor"}, path)
