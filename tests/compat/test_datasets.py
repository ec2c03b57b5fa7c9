"""Datasets for offline learning: they are read back as they were walked, and behaviour cloning learns from them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from agents.command_line import app
from agents.datasets import KINDS, make_dataset
from agents.evaluation.scoring import run_episodes
from agents.seeds import training_seed
from lean_yaw_env.envs.walker_env import WalkerEnv

minari = pytest.importorskip("minari", reason="pip install 'lean-yaw-env[compat]'")


@pytest.fixture(scope="module")
def datasets(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """A dataset of each kind, of Heading."""
    out = tmp_path_factory.mktemp("datasets")
    names = [make_dataset("Heading", kind, out, episodes=12, progress=False) for kind in KINDS]
    return {kind: minari.load_dataset(name) for kind, name in zip(KINDS, names, strict=True)}


def returns(dataset: Any) -> np.ndarray:
    return np.array([episode.rewards.sum() for episode in dataset.iterate_episodes()])


def test_episodes_are_those_of_training_seeds_bit_for_bit(datasets: dict[str, Any]) -> None:
    env = WalkerEnv("Heading")
    for k, episode in zip(range(3), datasets["medium"].iterate_episodes(), strict=False):
        observation, _ = env.reset(seed=training_seed(0) + k)
        assert np.array_equal(observation, episode.observations[0])
        for action, reward, after in zip(episode.actions, episode.rewards, episode.observations[1:], strict=True):  # fmt: skip
            observation, again, *_ = env.step(action)
            assert again == reward and np.array_equal(observation, after)


def test_kinds_are_as_good_as_their_names_say(datasets: dict[str, Any]) -> None:
    means = {kind: returns(dataset).mean() for kind, dataset in datasets.items()}
    assert means["random"] < means["medium"] < means["expert"]
    assert means["random"] < means["mixed"] < means["expert"]


class Cloned:
    """A network as an agent."""

    def __init__(self, network: Any) -> None:
        self.network = network

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        import torch

        with torch.no_grad():
            return self.network(torch.as_tensor(np.asarray(observation))).numpy(), None


def test_behaviour_cloning_learns_from_the_expert(datasets: dict[str, Any]) -> None:
    import torch

    torch.manual_seed(0)
    episodes = list(datasets["expert"].iterate_episodes())
    seen = torch.as_tensor(np.concatenate([each.observations[:-1] for each in episodes]))
    done = torch.as_tensor(np.concatenate([each.actions for each in episodes]))
    network = torch.nn.Sequential(
        torch.nn.Linear(seen.shape[1], 64), torch.nn.Tanh(), torch.nn.Linear(64, 2), torch.nn.Tanh()
    )
    optimiser = torch.optim.Adam(network.parameters(), lr=3e-3)
    for _ in range(1000):
        optimiser.zero_grad()
        torch.nn.functional.mse_loss(network(seen), done).backward()
        optimiser.step()
    cloned = run_episodes(Cloned(network), "Heading", episodes=32).metrics["return"].mean()
    low, high = returns(datasets["random"]).mean(), returns(datasets["expert"]).mean()
    assert cloned > low + 0.5 * (high - low)


def test_the_command_writes_where_it_is_told_and_refuses_bad_values(tmp_path: Path) -> None:
    arguments = ["dataset", "--task", "Waypoint", "--kind", "random", "--episodes", "2", "--out", str(tmp_path)]  # fmt: skip
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    assert "leanyaw/waypoint/random-v1" in result.output
    place = tmp_path / "leanyaw" / "waypoint" / "random-v1"
    written = {path: path.read_bytes() for path in place.rglob("*") if path.is_file()}
    assert written and not list(tmp_path.rglob(".partial-*"))
    again = CliRunner().invoke(app, arguments)  # which goes on where it was, and so does nothing
    assert again.exit_code == 0, again.output
    assert {path: path.read_bytes() for path in place.rglob("*") if path.is_file()} == written
    other = CliRunner().invoke(app, [*arguments, "--seed", "1"])
    assert other.exit_code == 2 and "holds another dataset" in other.output
    bad = CliRunner().invoke(app, [*arguments[:6], "0"], env={"COLUMNS": "400"})
    assert bad.exit_code == 2 and "episodes must be from 1" in bad.output


def test_a_folder_of_something_else_is_refused_and_stays(tmp_path: Path) -> None:
    place = tmp_path / "leanyaw" / "heading" / "random-v1"
    place.mkdir(parents=True)
    (place / "letter.txt").write_text("dear")
    with pytest.raises(ValueError, match="random-v1"):
        make_dataset("Heading", "random", tmp_path, episodes=1, progress=False)
    assert (place / "letter.txt").read_text() == "dear"


def test_an_error_leaves_no_part_of_a_dataset(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*arguments: Any) -> None:
        raise OSError("No space left on device")

    monkeypatch.setattr("agents.datasets._record", fail)
    with pytest.raises(OSError, match="No space left"):
        make_dataset("Heading", "random", tmp_path, episodes=1, progress=False)
    assert not list(tmp_path.iterdir())
