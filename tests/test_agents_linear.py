"""Linear laws: symmetric between left and right, and found by a search that its own episodes do not deceive."""

from __future__ import annotations

import json

import numpy as np
import pytest

from agents.controllers.linear import LinearLaw, LinearSettings
from agents.controllers.simple import FixedController
from agents.settings import all_settings
from agents.tuning import linear
from agents.tuning.linear import search_linear, tune_linear
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.registration import TASK_VERSIONS


def law_of(task, **options):
    shape = LinearLaw(task).matrix.shape
    weights = np.random.default_rng(0).normal(0.0, 0.3, shape)
    return LinearLaw(task, EnvOptions(**options), LinearSettings(tuple(weights.ravel().tolist())))


@pytest.mark.parametrize("task", ["Heading", "Slalom", "Level"])
def test_actions_are_the_same_in_space_whether_observations_are_mirrored_or_not(task):
    mirrored, raw = (WalkerVectorEnv(8, task, mirror=mirror) for mirror in (True, False))
    seen, seen_raw = mirrored.reset(seed=5)[0], raw.reset(seed=5)[0]
    sides = mirrored.simulation.walkers["side"].astype(np.float32)
    assert set(sides) == {-1.0, 1.0}
    actions = law_of(task).predict(seen)[0]
    actions[:, 1] *= sides
    # a mirror image changes signs alone, which is exact
    np.testing.assert_array_equal(law_of(task, mirror=False).predict(seen_raw)[0], actions)


def test_a_law_without_weights_is_the_fixed_controller_and_one_of_too_few_is_refused():
    seen = np.ones((3, 7), dtype=np.float32)
    law = LinearLaw("Heading", settings=LinearSettings())
    np.testing.assert_array_equal(law.predict(seen)[0], FixedController().predict(seen)[0])
    with pytest.raises(ValueError, match="weights"):
        LinearLaw("Heading", settings=LinearSettings((1.0, 2.0)))


def test_many_laws_walk_as_each_would_alone():
    law = LinearLaw("Heading")
    matrices = np.random.default_rng(1).normal(0.0, 0.3, (4, *law.matrix.shape))
    seen = np.random.default_rng(2).normal(0.0, 1.0, (4, 7)).astype(np.float32)
    law.matrix = matrices
    together = law.predict(seen)[0]
    for matrix, observation, action in zip(matrices, seen, together, strict=True):
        law.matrix = matrix
        np.testing.assert_array_equal(law.predict(observation)[0], action)


@pytest.fixture
def short(monkeypatch):
    """Searches of a moment."""
    monkeypatch.setattr(linear, "_LONGEST", 20.0)
    monkeypatch.setattr(linear, "EPISODES", 4)
    monkeypatch.setattr(linear, "_VALIDATION_EPISODES", 16)


def test_a_search_finds_no_worse_a_law_than_it_began_with(short, tmp_path):
    lines: list[str] = []
    found, score = search_linear("Heading", 5, shown=lines.append)
    starts = [float(part.split()[-1]) for part in lines[0].split(",")]
    assert len(starts) >= 3
    assert score >= max(starts) - 0.01  # the lines are rounded
    assert tune_linear("Heading", 5, tmp_path / "law.json", shown=lines.append) == score
    record = json.loads((tmp_path / "law.json").read_text())
    assert record["values"] == {"weights": list(found.weights)}


def test_a_search_that_was_ended_goes_on_to_the_same_law_bit_for_bit(short, tmp_path, monkeypatch):
    alone = search_linear("Heading", 5, shown=lambda line: None)
    walked, file, worth = [], tmp_path / "kept.json", linear._worth

    def ended(*arguments):
        walked.append(arguments[2])
        if len(walked) == 3:
            raise KeyboardInterrupt
        return worth(*arguments)

    monkeypatch.setattr(linear, "_worth", ended)
    with pytest.raises(KeyboardInterrupt):
        search_linear("Heading", 5, file=file, shown=lambda line: None)
    assert search_linear("Heading", 5, file=file, shown=lambda line: None) == alone
    assert len(walked) == 6 and len(set(walked)) == 5  # none again but the one that was under way


@pytest.mark.parametrize("words", ["{}", "[1]", "dear", '{"question": {"task": "Slalom"}}'])
def test_a_file_that_holds_another_search_is_refused_and_stays(words, short, tmp_path):
    (tmp_path / "law.search.json").write_text(words)
    with pytest.raises(ValueError, match=r"law\.search\.json"):
        tune_linear("Heading", 1, tmp_path / "law.json", shown=lambda line: None)
    assert (tmp_path / "law.search.json").read_text() == words


def test_laws_that_come_with_the_package_are_of_its_tasks():
    for task in all_settings().get("linear", {}):
        assert task in TASK_VERSIONS
        assert np.any(LinearLaw(task).matrix)
