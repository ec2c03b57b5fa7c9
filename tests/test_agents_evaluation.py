"""The evaluator: the same episodes for all, means and intervals that mean what they say, and what is printed."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from typer.testing import CliRunner

from agents import FixedController, HeadingFeedback, RandomController
from agents.command_line import app
from agents.evaluation import scoring
from agents.evaluation.episodes import Results, Row, summary
from agents.evaluation.row_tables import results_table, rows_to_csv, rows_to_json
from agents.evaluation.scoring import evaluate, run_episodes
from agents.seeds import (
    MOST_EPISODES,
    MOST_EVALUATIONS,
    MOST_WALKERS,
    TRAINING_SEEDS,
    first_seed,
    training_seed,
)
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.walker_env import WalkerEnv

SHORT = EnvOptions(horizon=15.0)


def test_training_validation_and_test_share_no_episode():
    assert training_seed(TRAINING_SEEDS - 1) + MOST_WALKERS <= first_seed("test")
    assert first_seed("test", MOST_EVALUATIONS - 1) + MOST_EPISODES <= first_seed("validation")
    assert training_seed(1) == training_seed(0) + MOST_WALKERS
    for episode_set in ("validation", "test"):
        assert first_seed(episode_set, 1) == first_seed(episode_set) + MOST_EPISODES


def test_an_evaluated_episode_is_the_single_environment_s():
    results = run_episodes(HeadingFeedback(), "Heading", episodes=3, seed=2, options=SHORT)
    env = WalkerEnv("Heading", horizon=15.0)
    for i in range(3):
        observation, info = env.reset(seed=first_seed("validation", 2) + i)
        total, ends = 0.0, False
        while not ends:
            action, _ = HeadingFeedback().predict(observation)
            observation, reward, terminated, truncated, info = env.step(action)
            total += reward
            ends = terminated or truncated
        assert results.survived[i] == truncated
        # the same sums of the same numbers; actions of one row or of three are the same float32
        assert results.metrics["return"][i] == total
        for name in ("mean_absolute_heading_error", "settled_fraction"):
            assert results.metrics[name][i] == info[name]
        assert results.metrics["speed"][i] == info["distance"] / info["time"]


def test_episodes_do_not_depend_on_how_many_are_walked_together(monkeypatch):
    whole = run_episodes(FixedController(), "Heading", episodes=5, options=SHORT)
    monkeypatch.setattr(scoring, "_CHUNK", 2)
    parts = run_episodes(FixedController(), "Heading", episodes=5, options=SHORT)
    for name, values in whole.metrics.items():
        assert np.array_equal(values, parts.metrics[name], equal_nan=True)


def test_another_seed_draws_other_episodes_and_the_same_seed_the_same():
    returns = [
        run_episodes(FixedController(), "Heading", episodes=4, seed=seed, options=SHORT).metrics["return"]
        for seed in (0, 0, 1)
    ]  # fmt: skip
    assert np.array_equal(returns[0], returns[1])
    assert not np.intersect1d(returns[0], returns[2]).size


def test_settling_is_undefined_where_no_command_was_settled_rather_than_zero():
    results = run_episodes(
        FixedController(), "Heading", episodes=32, options=EnvOptions(horizon=5.0)
    )
    settled = results.metrics["settled_fraction"] > 0.0
    assert not settled.all()
    assert np.isnan(results.metrics["mean_settling_time"][~settled]).all()
    assert np.isfinite(results.metrics["mean_settling_time"][settled]).all()


def test_survival_stands_beside_every_metric():
    wild = EnvOptions(horizon=40.0, max_offset_change=0.1, friction_limit=math.inf)
    results = run_episodes(RandomController(0), "Heading", episodes=16, options=wild)
    assert 0.0 < results.survived.mean() < 1.0
    rows = summary(Results("Heading", "random", (results,)))
    assert {row.survival for row in rows} == {results.survived.mean()}
    assert rows[-1].metric == "survival"
    assert {row.episodes for row in rows} == {16}


def test_the_table_and_the_json_hold_every_row():
    agents = {"fixed": FixedController(), "random": RandomController()}
    rows = evaluate("Heading", agents, episodes=4, options=SHORT)
    plain = json.loads(rows_to_json(rows))
    assert [(row["agent"], row["metric"]) for row in plain] == [(r.agent, r.metric) for r in rows]
    assert list(plain[0])[:8] == ["task", "agent", "metric", "mean", "low", "high", "survival", "episodes"]  # fmt: skip
    assert set(plain[0]) == set(Row.__dataclass_fields__)
    lines = rows_to_csv(rows).splitlines()
    assert lines[0].split(",") == list(plain[0])
    assert len(lines) == 1 + len(rows)
    table = results_table(rows)
    assert [column.header for column in table.columns] == ["metric", "fixed", "random"]
    # of the return, the mean has a line of its own
    assert table.row_count == len({row.metric for row in rows}) + 1


def test_the_command_line_takes_agents_one_after_the_other():
    arguments = ["evaluate", "--task", "Walk", "--agents", "fixed", "random", "--episodes", "2", "--seed", "1", "--json"]  # fmt: skip
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    rows = json.loads(result.stdout)
    assert list(dict.fromkeys(row["agent"] for row in rows)) == ["fixed", "random"]
    assert {row["task"] for row in rows} == {"Walk"}


def test_tasks_and_agents_may_be_repeated_or_separated_by_commas():
    arguments = ["evaluate", "--task", "Walk,Metastable", "--task", "Walk", "--agents", "random,fixed", "--agents", "fixed"]  # fmt: skip
    short = ["--episodes", "2", "--processes", "1", "--json"]
    result = CliRunner().invoke(app, [*arguments, *short])
    assert result.exit_code == 0, result.output
    rows = json.loads(result.stdout)
    assert list(dict.fromkeys((row["task"], row["agent"]) for row in rows)) == [
        ("Walk", "random"), ("Walk", "fixed"), ("Metastable", "random"), ("Metastable", "fixed"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--task", "Fly"], "task must be one of"),
        (["--task", "Walk", "--agents", "feedback"], "feedback is an agent for Heading"),
        (["--agents", "nobody"], "agent must be one of"),
        (["--agents", "fixed", "--episodes", "0"], "episodes must be from"),
        (["--agents", "fixed", "--seed", "-1"], "seed must be from"),
        (["--agents", "ppo", "--agent-path", "nowhere"], "--agent-path"),
    ],
)
def test_the_command_line_refuses_bad_values_by_name(arguments, message):
    result = CliRunner().invoke(app, ["evaluate", *arguments], env={"COLUMNS": "400"})
    assert result.exit_code == 2
    assert message in result.output


def test_no_agents_and_bad_numbers_are_refused():
    with pytest.raises(ValueError, match="agents must hold one"):
        evaluate("Heading", {}, episodes=1)
    with pytest.raises(ValueError, match="task must be one of"):
        run_episodes(FixedController(), "Nothing", episodes=1)
