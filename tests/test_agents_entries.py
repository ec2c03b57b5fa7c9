"""Agents from outside the package: a folder enters the leaderboard, and a results file holds every episode."""

from __future__ import annotations

import csv
import json
import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from agents import FixedController
from agents.command_line import app
from agents.evaluation.entries import read_entry
from agents.evaluation.episodes import RETURN, TIME_PER_FALL
from agents.evaluation.plan import Evaluation
from agents.evaluation.results_files import read_results, write_results
from agents.evaluation.scoring import run_episodes
from agents.policies.policy_files import options_from_plain
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.files import read_json

PAGE = Path(__file__).parents[1] / "docs" / "enter_your_agent.md"
RECORD = {
    "format": "lean-yaw-agent", "format_version": 1, "name": "still", "tasks": ["Walk", "Metastable"],
    "trainings": ["one", "two"],
}  # fmt: skip
LOADER = """
from pathlib import Path
import numpy as np

class Still:
    def __init__(self, text): self.value = float(text)
    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.full((*np.shape(observation)[:-1], 2), self.value, dtype=np.float32), None

def load(path): return Still(Path(path).read_text())
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """An agent that does the same all the time: nothing in its first training, little in its second."""
    place = tmp_path / "still"
    place.mkdir()
    (place / "agent.json").write_text(json.dumps(RECORD))
    (place / "agent.py").write_text(LOADER)
    (place / "one").write_text("0.0")
    (place / "two").write_text("0.1")
    return place


def page_blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE.read_text(), re.DOTALL)


def test_the_page_s_script_trains_an_agent_elsewhere_that_enters_the_leaderboard(tmp_path: Path):
    script, loader = page_blocks("python")
    tiny = script.replace("1_000_000", "128").replace("range(3)", "range(2)").replace("n_steps=64", "n_steps=2")  # fmt: skip
    (tmp_path / "train_mine.py").write_text(tiny)
    subprocess.run([sys.executable, "train_mine.py"], cwd=tmp_path, check=True, timeout=300)
    folder = tmp_path / "my_agent"
    record = json.loads(page_blocks("json")[0])
    record["trainings"] = record["trainings"][:2]
    (folder / "agent.json").write_text(json.dumps(record))
    (folder / "agent.py").write_text(loader)
    common = ["evaluate", "--agent-path", str(folder), "--task", "Heading", "--agents", "random,fixed,lqr", "--episodes", "3"]  # fmt: skip
    validated = CliRunner().invoke(app, [*common, "--json"])
    assert validated.exit_code == 0, validated.output
    rows = [row for row in json.loads(validated.stdout) if row["agent"] == "my_ppo"]
    assert {row["trainings"] for row in rows} == {2}
    out, results = tmp_path / "board", tmp_path / "results"
    entered = CliRunner().invoke(app, [*common, "--out", str(out), "--results", str(results), "--runs", str(tmp_path)])  # fmt: skip
    assert entered.exit_code == 0, entered.output
    page = (out / "leaderboard.md").read_text()
    assert "| my_ppo | entered | 2 | 3 |" in page and "lqr < my_ppo" in page
    assert (results / "Heading-my_ppo.json").exists()
    # the file alone enters another leaderboard, with the same numbers
    again = tmp_path / "again"
    arguments = ["evaluate", "--task", "Heading", "--agents", "random,fixed,lqr", "--episodes", "3", "--out", str(again)]  # fmt: skip
    added = CliRunner().invoke(app, [*arguments, "--others", str(results / "Heading-my_ppo.json"), "--runs", str(tmp_path)])  # fmt: skip
    assert added.exit_code == 0, added.output
    boards = [csv.DictReader((place / "leaderboard.csv").open()) for place in (out, again)]
    first, second = ([row for row in board if row["agent"] == "my_ppo"] for board in boards)
    assert first == second != []


def test_an_entry_runs_the_episodes_of_all_agents_for_each_of_its_trainings(folder: Path):
    short = EnvOptions(horizon=8.0)
    evaluation = Evaluation(episodes=4, options=short, path=folder, progress=False)
    candidates = evaluation.candidates(["Walk", "Heading"], ["fixed"])
    assert [(each.task, each.agent) for each in candidates] == [
        ("Walk", "fixed"), ("Walk", "still"), ("Heading", "fixed"),
    ]  # fmt: skip
    fixed, still = evaluation.run(candidates[:2])
    assert np.array_equal(still.values(RETURN)[0], fixed.values(RETURN)[0])
    assert not np.array_equal(still.values(RETURN)[1], fixed.values(RETURN)[0])
    own = run_episodes(FixedController(), "Walk", episodes=4, options=short)
    assert np.array_equal(fixed.values(RETURN)[0], own.metrics[RETURN])


def test_kept_episodes_of_an_entry_are_run_again_when_its_code_has_changed(folder: Path, tmp_path):
    evaluation = Evaluation(
        episodes=2, options=EnvOptions(horizon=8.0), path=folder, cache=tmp_path / "kept", progress=False
    )  # fmt: skip
    candidates = evaluation.candidates(["Walk"], ["fixed"])[1:]
    evaluation.run(candidates)
    assert len(list((tmp_path / "kept").iterdir())) == 2
    evaluation.run(candidates)
    assert len(list((tmp_path / "kept").iterdir())) == 2
    (folder / "agent.py").write_text(LOADER.replace("float(text)", "2.0 * float(text)"))
    from agents.evaluation import plan

    plan._digest.cache_clear()  # as another process would
    evaluation.run(candidates)
    assert len(list((tmp_path / "kept").iterdir())) == 4


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": "ppo"}, "name in .* must be a lower-case word and none of random"),
        ({"name": "My agent"}, "must be a lower-case word"),
        ({"tasks": []}, "tasks in .* must be a list of one or more texts"),
        ({"tasks": ["Fly"]}, "task must be one of"),
        ({"trainings": ["three"]}, "three', which does not exist"),
        ({"format_version": 2}, "must have format 'lean-yaw-agent' and format_version 1"),
        (
            {"colour": "red"},
            "must be an object with format, format_version, name, tasks, trainings",
        ),
    ],
)
def test_a_bad_description_is_refused_by_name(folder: Path, change: dict, message: str):
    (folder / "agent.json").write_text(json.dumps(RECORD | change))
    with pytest.raises(ValueError, match=message):
        read_entry(folder)


def test_a_loader_without_load_is_refused(folder: Path):
    (folder / "agent.py").write_text("agent = None\n")
    evaluation = Evaluation(episodes=1, path=folder, progress=False)
    with pytest.raises(ValueError, match=r"must define load\(path\)"):
        evaluation.run(evaluation.candidates(["Walk"], ["fixed"]))


def test_a_results_file_holds_every_episode_bit_for_bit(folder: Path, tmp_path: Path):
    evaluation = Evaluation(episodes=3, path=folder, progress=False)
    (found,) = evaluation.run(evaluation.candidates(["Metastable"], ["fixed"])[1:])
    path = write_results(found, tmp_path, "validation", 0)
    assert path.name == "Metastable-still.json"
    again = read_results(path, "validation", 0)
    assert (again.task, again.agent, len(again.runs)) == ("Metastable", "still", 2)
    for metric in {*found.metrics, "time", "fell"} - {
        TIME_PER_FALL
    }:  # which is of all episodes together
        assert np.array_equal(again.values(metric), found.values(metric), equal_nan=True)


def test_a_results_file_keeps_an_option_that_is_infinite(tmp_path: Path):
    options = EnvOptions(friction_limit=math.inf, horizon=8.0)
    evaluation = Evaluation(episodes=1, options=options, progress=False)
    (found,) = evaluation.run(evaluation.candidates(["Walk"], ["fixed"]))
    record = read_json(write_results(found, tmp_path, "validation", 0))
    assert options_from_plain(record["options"]) == options


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"episode_set": "validation"}, "episode_set in .* must be 'test', got 'validation'"),
        ({"seed": 5}, "seed in .* must be 0, got 5"),
        ({"options": {"slope": 0.1}}, "options in .* must be {}"),
        ({"env_id": "LeanYaw/Walk-v7"}, "this package's environment is LeanYaw/Walk-v"),
        ({"trainings": [{}]}, "is damaged"),
        (
            {"trainings": [{"survived": [True], "metrics": {"return": [1.0]}}]},
            "must hold .* of every episode",
        ),
    ],
)
def test_results_of_other_episodes_do_not_enter(tmp_path: Path, change: dict, message: str):
    evaluation = Evaluation(episodes=1, episode_set="test", progress=False)
    (found,) = evaluation.run(evaluation.candidates(["Walk"], ["fixed"]))
    path = write_results(found, tmp_path, "test", 0)
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(ValueError, match=message):
        read_results(path, "test", 0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--option", "noise=1"], "option must be one of parameters, "),
        (["--option", "sensor_noise"], "option must be as NAME=VALUE, got 'sensor_noise'"),
        (["--option", "slope=0", "--option", "slope=1"], "option 'slope' must be given once"),
        (["--option", "sensor_noise=-1"], "sensor_noise must be"),
        (["--option", "slope=0", "--out", "board"], "option must not be given with --out"),
    ],
)
def test_bad_options_are_refused_by_name(tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    common = ["evaluate", "--task", "Walk", "--agents", "fixed", "--episodes", "1"]
    result = CliRunner().invoke(app, [*common, *arguments], env={"COLUMNS": "400"})
    assert result.exit_code == 2 and message in result.output
    assert not list(tmp_path.iterdir())
