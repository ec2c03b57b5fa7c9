"""Tuning: what is tried, what is kept and where, and that a study goes on where it ended."""

from __future__ import annotations

import json
import math
import os
import signal
import sqlite3
import subprocess
import sys
import textwrap
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import optuna
import pytest
from optuna.trial import TrialState
from typer.testing import CliRunner

from agents import AgentRequest, make_agent
from agents import settings as settings_module
from agents.command_line import app
from agents.controllers.guidance import PathSettings
from agents.controllers.lqr import LqrSettings
from agents.controllers.mpc import MpcSettings
from agents.controllers.simple import FixedController, HeadingGains
from agents.learning.algorithms import ALGORITHMS, settings_for
from agents.learning.ppo import PPOSettings
from agents.observations import ObservationLayout
from agents.registry import AGENTS
from agents.seeds import TRAINING_SEEDS
from agents.settings import all_settings, tuned, values_of, with_values
from agents.shipping import ship
from agents.tuning import spaces, study
from agents.tuning.spaces import RANGES, space_of
from agents.tuning.study import FIRST_SEED, Tuning, best_trial, tune
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.files import write_json
from lean_yaw_env.registration import TASK_VERSIONS

TINY = PPOSettings(steps=1024, walkers=8, steps_per_update=32, batch_size=128, epochs=1)
PPO = Tuning("ppo", "Walk", episodes=2)
GAINS = Tuning("feedback", "Heading", episodes=2, horizon=10.0)
TUNABLE = [*RANGES, *((agent, task) for agent in ("ppo", "sac") for task in TASK_VERSIONS)]


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """A file of settings of our own in place of the package's."""
    file = tmp_path / "settings.json"
    file.write_text("{}")
    monkeypatch.setattr(settings_module, "FILE", file)
    all_settings.cache_clear()
    yield file
    all_settings.cache_clear()


@pytest.fixture
def tiny(monkeypatch):
    """Tunings that begin with tiny settings of PPO."""
    monkeypatch.setattr(spaces, "settings_for", lambda algorithm, task: TINY)


@pytest.fixture
def untrained(tiny, monkeypatch):
    """Trainings that tell of the returns in a list, one of them each, and give the fixed controller; the seeds that they were given."""
    told = SimpleNamespace(returns=[], seeds=[])

    def train(algorithm, env_id, settings, *, seed, progress, report):
        told.seeds.append(seed)
        value = told.returns[(len(told.seeds) - 1) % len(told.returns)]
        if value is KeyboardInterrupt:
            raise value
        for steps in range(0, TINY.steps + 1, TINY.steps // 64):
            report(steps, value if steps > 100 else math.nan)
        return SimpleNamespace(policy=FixedController())

    monkeypatch.setattr(study, "train", train)
    return told


def quiet(tuning: Tuning, trials: int, storage: Path | None = None, **others) -> optuna.Study:
    return tune(tuning, trials, storage, progress=False, shown=lambda line: None, **others)


# --- settings in one file


def test_settings_of_the_package_make_agents_and_lie_where_they_are_tuned():
    for agent, tasks in all_settings().items():
        for task, values in tasks.items():
            if AGENTS[agent].kind == "learned":
                assert set(values) <= {*values_of(settings_for(agent, task))}
                continue
            made = make_agent(agent, AgentRequest(f"LeanYaw/{task}-v1", EnvOptions()))
            if agent != "mpc":  # which needs the environment
                width = len(ObservationLayout.of(task, EnvOptions()).names)
                assert np.abs(made.predict(np.zeros((2, width)))[0]).max() <= 1.0
                assert agent == "linear" or set(values) <= set(RANGES[agent, task])


@pytest.mark.parametrize("settings", [LqrSettings(), PathSettings(), MpcSettings(), TINY])
def test_values_are_what_settings_differ_in_from_the_default(settings):
    assert with_values(type(settings)(), values_of(settings)) == settings
    assert not values_of(type(settings)())


def test_values_of_nested_settings_stand_under_their_paths():
    settings = with_values(PathSettings(), {"ahead": 1.0, "loop.weights.heading": 0.5})
    assert (settings.ahead, settings.loop.weights.heading) == (1.0, 0.5)
    assert values_of(settings) == {"ahead": 1.0, "loop.weights.heading": 0.5}
    with pytest.raises(ValueError, match="LqrSettings has no 'speed'"):
        with_values(LqrSettings(), {"speed": 1.0})
    with pytest.raises(ValueError, match="ahead must be in"):
        with_values(PathSettings(), {"ahead": 9.0})


# --- what is tried


@pytest.mark.parametrize(("agent", "task"), TUNABLE)
def test_whatever_is_drawn_are_sound_settings_and_trials_begin_with_those_there_are(agent, task):
    space = space_of(agent, task)
    drawn = optuna.create_study(sampler=optuna.samplers.RandomSampler(seed=0))
    for _ in range(5):
        assert type(space.suggest(drawn.ask())) is type(space.settings)
    start = optuna.trial.FixedTrial(dict(space.start))
    if agent in ("feedback", "lqr"):
        values = values_of(space.settings)
        for path, value in values_of(space.suggest(start)).items():
            assert values.get(path, value) == value
    if agent in ALGORITHMS:
        assert space.suggest(start) == space.settings


@pytest.mark.parametrize("algorithm", ["ppo", "sac"])
def test_settings_of_a_learner_that_no_choice_holds_can_be_drawn(algorithm, monkeypatch):
    others = replace(settings_for(algorithm, "Heading"), hidden=(24, 16))
    monkeypatch.setattr(spaces, "settings_for", lambda algorithm, task: others)
    space = space_of(algorithm, "Heading")
    assert space.suggest(optuna.trial.FixedTrial(dict(space.start))) == others
    drawn = space.suggest(optuna.create_study().ask())
    assert (drawn.steps, drawn.walkers) == (others.steps, others.walkers)


def test_gains_are_sought_around_the_settings_as_they_are(monkeypatch):
    tried: list[HeadingGains] = []
    monkeypatch.setattr(
        study, "_mean_return", lambda agent, *rest: tried.append(agent._gains) or 0.0
    )
    quiet(Tuning("feedback", "Heading", episodes=1), 40)
    now = tuned("feedback", "Heading", HeadingGains())
    assert tried[0] == now
    for name, width in (("ankle", 2.0), ("feedforward", 2.0), ("proportional", 0.3)):
        steps = np.array([getattr(gains, name) - getattr(now, name) for gains in tried[1:]])
        # CMA-ES begins with a standard deviation of 0.15 of the range; 39 draws, some at its end
        assert 0.5 < np.std(steps) / (0.15 * width) < 1.5
        assert np.abs(steps).max() <= 0.45 * width


def test_a_number_that_has_no_value_yet_begins_in_the_middle_of_its_range(kept):
    start = space_of("lqr", "Heading").start
    assert start["turning_angle"] == pytest.approx(0.325)  # in [0.2, 0.45]
    assert start["weights.mass_offset"] == 50.0  # infinite, and the range ends there
    assert space_of("lqr", "Heading").settings == LqrSettings()


def test_tuning_finds_no_worse_settings_and_the_same_every_time(tmp_path):
    one, other = (quiet(GAINS, 8) for _ in range(2))
    values = [trial.value for trial in one.trials]
    assert values == [trial.value for trial in other.trials]
    best = best_trial(one)
    assert best is not None and best.value == max(values) >= values[0]
    assert len({tuple(trial.params.values()) for trial in one.trials}) == 8


def test_values_that_make_no_agent_rank_last_and_are_not_run(monkeypatch):
    made, tried = [], []

    def controller(task, options, gains):
        made.append(gains)
        if len(made) % 2 == 0:
            raise ValueError
        return FixedController()

    def returns(agent, tuning, options):
        tried.append(agent)
        return 1.0

    monkeypatch.setattr(study, "_mean_return", returns)
    monkeypatch.setattr(spaces, "HeadingFeedback", controller)
    found = quiet(GAINS, 8)
    assert [trial.value for trial in found.trials] == [1.0, -math.inf] * 4
    assert len(tried) == 4
    best = best_trial(found)
    assert best is not None and best.value == 1.0


def test_a_tuning_runs_the_episodes_that_it_judges_by():
    best = best_trial(quiet(Tuning("lqr", "Walk", episodes=1, horizon=2.0), 2))
    # one reward unit and less for a unit of time
    assert best is not None and best.value is not None and 0.0 < best.value <= 4.0


def test_a_trial_below_the_median_of_the_others_is_given_up(untrained):
    untrained.returns = [10.0, 11.0, 12.0, 13.0, 14.0, 1.0, 20.0]
    found = quiet(PPO, 7)
    states = [trial.state for trial in found.trials]
    assert states == [TrialState.COMPLETE] * 5 + [TrialState.PRUNED, TrialState.COMPLETE]
    best = best_trial(found)
    assert best is not None and best.state is TrialState.COMPLETE


def test_seeds_of_tuning_are_no_shipped_training_s(untrained):
    untrained.returns = [1.0]
    quiet(replace(PPO, repeats=3), 2)
    assert untrained.seeds == [FIRST_SEED, FIRST_SEED + 1, FIRST_SEED + 2] * 2
    assert 5 <= FIRST_SEED < TRAINING_SEEDS


# --- what is kept, and going on


def test_a_tuning_trains_scores_and_goes_on_with_its_file(tiny, tmp_path):
    storage, out = tmp_path / "made" / "study.db", tmp_path / "there" / "best.json"
    quiet(PPO, 1, storage, out=out)
    first = json.loads(out.read_text())
    assert with_values(PPOSettings(), first["values"]) == TINY  # it begins with what there is
    found = quiet(PPO, 2, storage, out=out)
    assert [trial.state for trial in found.trials] == [TrialState.COMPLETE] * 2
    assert found.trials[0].params != found.trials[1].params
    best = json.loads(out.read_text())
    assert best["score"] == max(trial.value for trial in found.trials if trial.value) > 0.0
    assert (best["agent"], best["task"]) == ("ppo", "Walk")
    assert len(quiet(PPO, 2, storage).trials) == 2  # done already


@pytest.mark.parametrize("place", [0, 2])
def test_an_interruption_loses_the_trial_under_way_only_and_not_the_first(
    untrained, tmp_path, place
):
    storage = tmp_path / "study.db"
    untrained.returns = [1.0] * place + [KeyboardInterrupt] + [1.0] * 4
    with pytest.raises(KeyboardInterrupt):
        quiet(PPO, 4, storage)
    found = quiet(PPO, 4, storage)
    complete = found.get_trials(states=(TrialState.COMPLETE,))
    assert len(complete) == 4
    values = [tuple(sorted(trial.params.items())) for trial in complete]
    assert len(set(values)) == 4  # going on draws nothing a second time
    (unfinished,) = found.get_trials(states=(TrialState.FAIL,))
    assert tuple(sorted(unfinished.params.items())) in values  # it is tried again
    kept = [trial.user_attrs["values"] for trial in complete]
    assert values_of(TINY) in kept  # the settings as they are


@pytest.mark.skipif(os.name == "nt", reason="there is no SIGKILL")
def test_a_killed_first_trial_is_tried_again_and_none_runs_for_ever(tmp_path):
    storage = tmp_path / "study.db"
    program = f"""
        import os, signal
        from pathlib import Path
        from agents.tuning import study
        study._mean_return = lambda *rest: os.kill(os.getpid(), signal.SIGKILL)
        study.tune(study.Tuning("feedback", "Heading", 1), 3, Path({str(storage)!r}))
    """
    killed = subprocess.run([sys.executable, "-c", textwrap.dedent(program)], cwd=Path(__file__).parents[1])  # fmt: skip
    assert killed.returncode == -signal.SIGKILL
    found = quiet(Tuning("feedback", "Heading", 1), 3, storage)
    states = [trial.state for trial in found.trials]
    assert states == [TrialState.FAIL] + [TrialState.COMPLETE] * 3
    assert found.trials[1].params == found.trials[0].params


def test_another_tuning_or_another_file_is_refused_and_left_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "_mean_return", lambda *rest: 1.0)
    storage = tmp_path / "study.db"
    quiet(GAINS, 1, storage)
    with pytest.raises(ValueError, match="storage must be the study of the same tuning"):
        quiet(replace(GAINS, episodes=3), 2, storage)
    with pytest.raises(ValueError, match="storage must be the file of 'lqr Metastable'"):
        quiet(Tuning("lqr", "Metastable", 1), 1, storage)
    text, other = tmp_path / "text.db", tmp_path / "other.db"
    text.write_text("no study at all, but some other text " * 100)
    with sqlite3.connect(other) as database:
        database.execute("CREATE TABLE birds (name TEXT)")
    for file in (text, other, tmp_path):
        before = file.read_bytes() if file.is_file() else None
        with pytest.raises(ValueError, match="storage must be a study's file or a new one"):
            quiet(GAINS, 1, file)
        assert before is None or file.read_bytes() == before


def test_tuning_leaves_the_settings_of_the_package_alone_until_they_are_shipped(
    kept, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(study, "_mean_return", lambda agent, *rest: agent._gains.ankle)
    arguments = ["tune", "feedback", "Heading", "--trials", "6", "--episodes", "1"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    assert "6 of 6" in result.output and "ankle = " in result.output
    assert kept.read_text() == "{}"
    best = tmp_path / "runs" / "tuning" / "feedback-Heading.best.json"
    values = json.loads(best.read_text())["values"]
    assert values["ankle"] > -0.056  # the default: more was better
    shipped = CliRunner().invoke(app, ["ship", str(best)])
    assert shipped.exit_code == 0, shipped.output
    assert all_settings() == {"feedback": {"Heading": values}}
    write_json(best, json.loads(best.read_text()) | {"values": {"ankle": 0.5}})
    with pytest.raises(ValueError, match="replace them by --replace"):
        ship(best)
    assert ship(best, replace=True) == [kept]
    assert all_settings() == {"feedback": {"Heading": {"ankle": 0.5}}}


def test_shorter_trainings_do_not_make_the_shipped_ones_shorter(untrained, tmp_path):
    untrained.returns = [1.0]
    out = tmp_path / "best.json"
    quiet(replace(PPO, steps=512), 1, out=out)
    assert json.loads(out.read_text())["values"]["steps"] == TINY.steps


@pytest.mark.parametrize("record", ["[]", '{"agent": "lqr"}', '{"agent": "lqr", "task": "Metastable", "values": {"x": 1}}'])  # fmt: skip
def test_what_no_tuning_left_is_not_shipped(kept, tmp_path, record):
    file = tmp_path / "best.json"
    file.write_text(record)
    with pytest.raises(ValueError, match=r"not what a tuning leaves|has no 'x'"):
        ship(file)
    assert kept.read_text() == "{}"


# --- bad input


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["ppo", "Fly"], "task must be one of"),
        (["lqr", "WaypointGoal"], "task must be one of Heading"),
        (["dqn", "Walk"], "agent must be one of"),
        (["feedback", "Walk"], "task must be one of Heading"),
        (["ppo", "Walk", "--steps", "0"], "steps must be from"),
        (["ppo", "Walk", "--trials", "0"], "trials must be from"),
        (["ppo", "Walk", "--repeats", "0"], "repeats must be from"),
        (["lqr", "Walk", "--episodes", "0"], "episodes must be from"),
        (["lqr", "Walk", "--steps", "100"], "steps and repeats must not be given for lqr"),
        (["lqr", "Walk", "--horizon", "-1"], "horizon must be in"),
        (["ppo", "Walk", "--horizon", "1"], "horizon must not be given for ppo"),
    ],
)
def test_the_command_line_refuses_bad_values(tmp_path, arguments, message):
    storage = tmp_path / "study.db"
    result = CliRunner().invoke(app, ["tune", *arguments, "--storage", str(storage)], env={"COLUMNS": "400"})  # fmt: skip
    assert result.exit_code == 2
    assert message in result.output
    assert not storage.exists()
