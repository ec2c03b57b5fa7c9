"""The search for settings: what it tries, what it keeps, and that it goes on where it ended."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import optuna
import pytest
from optuna.trial import TrialState
from typer.testing import CliRunner

from agents.controllers.simple import FixedController
from agents.learning.algorithms import ALGORITHMS, settings_from_plain
from agents.learning.ppo_settings import PPOSettings
from agents.learning.search import FIRST_SEED, Search, app, best_file, best_trial, search
from agents.learning.search_spaces import SPACES, start_of
from agents.seeds import TRAINING_SEEDS
from lean_yaw_env.registration import ENV_IDS

TINY = PPOSettings(steps=1024, walkers=8, steps_per_update=32, batch_size=128, epochs=1)
WANTED = Search("LeanYaw/Walk-v0", "ppo", TINY.steps, episodes=2)


@pytest.fixture
def tiny(monkeypatch):
    """Searches that begin with tiny settings."""
    entry = replace(ALGORITHMS["ppo"], settings_for=lambda env_id: TINY)
    monkeypatch.setitem(ALGORITHMS, "ppo", entry)


@pytest.fixture
def untrained(tiny, monkeypatch):
    """Trainings that tell of the returns in a list, one of them each, and give the fixed controller; the seeds that they were given."""
    told = SimpleNamespace(returns=[], seeds=[])

    def train(env_id, settings, *, seed, progress, report):
        told.seeds.append(seed)
        value = told.returns[(len(told.seeds) - 1) % len(told.returns)]
        if value is KeyboardInterrupt:
            raise value
        for steps in range(0, TINY.steps + 1, TINY.steps // 64):
            report(steps, value if steps > 100 else math.nan)
        return SimpleNamespace(policy=FixedController())

    monkeypatch.setitem(ALGORITHMS, "ppo", replace(ALGORITHMS["ppo"], train=train))
    return told


def quiet(wanted: Search, trials: int, storage: Path) -> optuna.Study:
    return search(wanted, trials, storage, progress=False, shown=lambda line: None)


def test_a_search_trains_scores_and_goes_on_with_its_file(tiny, tmp_path):
    storage = tmp_path / "made" / "study.db"
    quiet(WANTED, 1, storage)
    first = json.loads(best_file(storage).read_text())
    assert settings_from_plain("ppo", first["settings"]) == TINY  # it begins with what there is
    study = quiet(WANTED, 2, storage)
    assert [trial.state for trial in study.trials] == [TrialState.COMPLETE] * 2
    assert study.trials[0].params != study.trials[1].params
    best = json.loads(best_file(storage).read_text())
    assert best["score"] == max(trial.value for trial in study.trials)
    assert best["score"] > 0.0
    assert best["env_id"] == WANTED.env_id
    assert isinstance(settings_from_plain("ppo", best["settings"]), PPOSettings)
    assert len(quiet(WANTED, 2, storage).trials) == 2  # done already


def test_an_interruption_loses_the_trial_under_way_only(untrained, tmp_path):
    storage = tmp_path / "study.db"
    untrained.returns = [1.0, 1.0, KeyboardInterrupt, 1.0]
    with pytest.raises(KeyboardInterrupt):
        quiet(WANTED, 4, storage)
    study = quiet(WANTED, 4, storage)
    complete = study.get_trials(states=(TrialState.COMPLETE,))
    assert len(complete) == 4
    values = [tuple(sorted(trial.params.items())) for trial in complete]
    assert len(set(values)) == 4  # going on draws nothing a second time


def test_a_trial_below_the_median_of_the_others_is_given_up(untrained, tmp_path):
    untrained.returns = [10.0, 11.0, 12.0, 13.0, 14.0, 1.0, 20.0]
    study = quiet(WANTED, 7, tmp_path / "study.db")
    states = [trial.state for trial in study.trials]
    assert states == [TrialState.COMPLETE] * 5 + [TrialState.PRUNED, TrialState.COMPLETE]
    best = best_trial(study)
    assert best is not None
    assert best.state is TrialState.COMPLETE


def test_seeds_of_the_search_are_no_shipped_training_s(untrained, tmp_path):
    untrained.returns = [1.0]
    quiet(replace(WANTED, repeats=3), 2, tmp_path / "study.db")
    assert untrained.seeds == [FIRST_SEED, FIRST_SEED + 1, FIRST_SEED + 2] * 2
    assert 5 <= FIRST_SEED < TRAINING_SEEDS


def test_another_search_or_another_file_is_refused(untrained, tmp_path):
    untrained.returns = [1.0]
    storage = tmp_path / "study.db"
    quiet(WANTED, 1, storage)
    with pytest.raises(ValueError, match="holds a search of"):
        quiet(replace(WANTED, episodes=3), 2, storage)
    (tmp_path / "other.db").write_text("no study at all, but some other text " * 100)
    with pytest.raises(ValueError, match="holds no study"):
        quiet(WANTED, 1, tmp_path / "other.db")


@pytest.mark.parametrize("algorithm", list(SPACES))
def test_whatever_is_drawn_are_sound_settings_and_the_present_ones_can_be_drawn(algorithm):
    entry = ALGORITHMS[algorithm]
    others = replace(entry.settings_for(ENV_IDS[0]), hidden=(24, 16))  # none of the choices
    for settings in [*(entry.settings_for(env_id) for env_id in ENV_IDS), others]:
        study = optuna.create_study(sampler=optuna.samplers.RandomSampler(seed=0))
        for _ in range(10):
            drawn = SPACES[algorithm](study.ask(), settings)  # a bad one raises
            assert (drawn.steps, drawn.walkers) == (settings.steps, settings.walkers)
        start = optuna.trial.FixedTrial(start_of(algorithm, settings))
        assert SPACES[algorithm](start, settings) == settings


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--task", "Fly"], "task must be one of"),
        (["--algorithm", "dqn"], "algorithm must be one of"),
        (["--steps", "0"], "steps must be in"),
        (["--trials", "0"], "trials must be in"),
        (["--repeats", "0"], "repeats must be in"),
        (["--episodes", "0"], "episodes must be in"),
    ],
)
def test_the_command_line_refuses_bad_values(tmp_path, arguments, message):
    storage = tmp_path / "study.db"
    result = CliRunner().invoke(app, [*arguments, "--storage", str(storage)], env={"COLUMNS": "400"})  # fmt: skip
    assert result.exit_code == 2
    assert message in result.output
    assert not storage.exists()


def test_the_command_line_searches_and_prints_the_best(untrained, tmp_path):
    untrained.returns = [1.0]
    storage = tmp_path / "study.db"
    arguments = ["--task", "Walk", "--trials", "2", "--episodes", "2", "--storage", str(storage)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    assert "2 of 2" in result.output
    assert "learning_rate = " in result.output
    assert best_file(storage).exists()
