"""Several seeds of one training: which seeds, going on with what is unfinished, and what the picture and table are of."""

from __future__ import annotations

import csv
import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from typer.testing import CliRunner

import train
from agents.evaluation.episodes import Episodes, Results, metric_row
from agents.learning import curves, series
from agents.learning.algorithms import ALGORITHMS
from agents.learning.curves import running_means
from agents.learning.recorder import TrainingLog
from agents.learning.runs import Training, is_finished, new_run, read_log
from agents.learning.series import (
    RunError,
    make_series,
    new_series,
    parse_seeds,
    resumed,
    run_series,
    run_side_by_side,
    runs_of,
    seeds_table,
    trainings_of,
)
from agents.policies import policy_files
from agents.registry import agent_colour, newest_policy
from agents.shipping import retrain, ship

# the least that PPO's own settings for the task allow: one update
TINY = {"steps": 4096, "episodes": 2, "checkpoint_seconds": 0.0}


def ended(folder: Path) -> None:
    """A run that looks finished: another's results stand in."""
    for name in ("policy.json", "evaluation.json"):
        (folder / name).write_text("[]")


@pytest.mark.parametrize(
    ("text", "seeds"),
    [("5", (0, 1, 2, 3, 4)), ("0-4", (0, 1, 2, 3, 4)), ("0,3,7", (0, 3, 7)), ("2-3, 9", (2, 3, 9)), ("4-4", (4,))],
)  # fmt: skip
def test_seeds_are_a_number_of_them_ranges_or_a_list(text, seeds):
    assert parse_seeds(text) == seeds


@pytest.mark.parametrize(
    "text", ["", "0", "-1", "3-1", "1,1", "a", "0-", "999999999", "1.5", "1,,2"]
)
def test_other_words_for_seeds_are_refused(text):
    with pytest.raises(ValueError, match="seeds must be as 5"):
        parse_seeds(text)


def log_of(steps: list[int], returns: list[float]) -> TrainingLog:
    n = len(steps)
    return TrainingLog(
        np.array(steps), np.array(returns), np.ones(n, dtype=np.int64), np.ones(n, dtype=bool), 1.0
    )


def test_curves_of_steady_trainings_are_their_returns_where_all_have_some():
    short = log_of(list(range(100, 1100, 100)), [3.0] * 10)
    longer = log_of(list(range(300, 2300, 100)), [5.0] * 20)
    steps, means = running_means([short, longer])
    # windows of two episodes: the second episode of the later, and the last of the earlier
    assert (steps[0], steps[-1]) == (400, 1000)
    assert means == pytest.approx(np.array([[3.0], [5.0]]) * np.ones(len(steps)))  # rounding
    steps, means = running_means([short, log_of([], [])])
    assert means.shape == (2, 0)


def test_levels_of_a_learning_curve_have_their_agents_colours(monkeypatch, tmp_path):
    drawn = []
    monkeypatch.setattr(curves, "save_figure", lambda figure, path: drawn.append(figure))
    levels = {"fixed": 1.0, "lqr": 2.0}
    log = log_of(list(range(1000)), [3.0] * 1000)
    rows = [
        metric_row(
            Results("Heading", agent, (Episodes(np.ones(4, bool), {"return": np.full(4, value)}),)),
            "return",
        )
        for agent, value in {**levels, "ppo": 3.0}.items()
    ]
    curves.save_learning_curve(log, rows, "ppo", "title", 1000, tmp_path / "one.png")
    curves.save_seeds_curves([log, log], "ppo", ("ppo", 3.0), levels, "title", 1000, tmp_path)
    for figure in drawn:
        lines = {line.get_label().split(",")[0].strip(): line for line in figure.axes[0].lines}
        for name in ("fixed", "lqr", "ppo"):
            assert to_rgb(lines[name].get_color()) == agent_colour(name)
        assert len({lines[name].get_linestyle() for name in levels}) == 2


def test_a_series_goes_on_with_what_is_unfinished_and_gathers_its_seeds(tmp_path, monkeypatch):
    folder = new_series("Walk", [0, 3], tmp_path, TINY)
    original, trained = series.run, []

    def interrupted(place: Path, **keywords):
        if trained:
            raise KeyboardInterrupt
        trained.append(place.name)
        return original(place, **keywords)

    monkeypatch.setattr(series, "run", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_series(folder, progress=False)
    monkeypatch.setattr(series, "run", original)
    runs = runs_of(folder)
    assert [is_finished(place) for place in runs.values()] == [True, False]
    assert resumed("Walk", tmp_path) == folder
    before = (runs[0] / "policy.safetensors").stat().st_mtime_ns
    result = run_series(folder, progress=False)
    assert (runs[0] / "policy.safetensors").stat().st_mtime_ns == before  # not trained again
    with pytest.raises(ValueError, match="is finished"):
        resumed("Walk", tmp_path, folder)
    means = [
        row["mean"]
        for place in runs.values()
        for row in json.loads((place / "evaluation.json").read_text())
        if (row["agent"], row["metric"]) == ("ppo", "return")
    ]
    assert result.seeds == (0, 3)
    assert result.means["return"] == means
    (median,) = (row[1] for row in result.rows() if row[0] == "return")
    assert median == pytest.approx(np.mean(means))  # of two; rounding
    assert {"random", "fixed"} <= set(result.others["return"])
    assert seeds_table(result).row_count == len(result.means)
    with (folder / "seeds.csv").open() as file:
        assert next(csv.reader(file)) == ["metric", "median", "lowest", "highest", "seed0", "seed3"]
    assert (folder / "learning_curves.png").stat().st_size > 0
    assert newest_policy("LeanYaw/Walk-v1", tmp_path) == runs[3]
    monkeypatch.setattr(policy_files, "SHIPPED", tmp_path / "trained")
    ship(folder)
    assert policy_files.shipped_seeds("LeanYaw/Walk-v1") == [0, 3]


def test_the_newest_of_runs_and_series_is_gone_on_with(tmp_path):
    run_folder = new_run(Training.of_task("Walk", **TINY), tmp_path)
    folder = new_series("Walk", [0], tmp_path, TINY)
    for age, path in enumerate([folder / "series.json", run_folder / "run.json"]):
        os.utime(path, (1000.0 + age, 1000.0 + age))
    assert resumed("Walk", tmp_path) == run_folder
    ended(run_folder)
    assert resumed("Walk", tmp_path) == folder
    with pytest.raises(ValueError, match="leave out seeds"):
        resumed("Walk", tmp_path, folder, {"seeds": "0-1"})
    with pytest.raises(ValueError, match="no unfinished training of Heading"):
        resumed("Heading", tmp_path)


def test_runs_side_by_side_finish_and_one_that_fails_is_named(tmp_path):
    folder = new_series("Walk", [0, 1], tmp_path, TINY)
    runs = list(runs_of(folder).values())
    (runs[1] / "checkpoint.safetensors").write_bytes(b"nothing of the kind")
    with pytest.raises(RunError, match="seed1"):
        list(run_side_by_side(runs[1:], 2, progress=False))
    (runs[1] / "checkpoint.safetensors").unlink()
    (runs[0] / "run.json").rename(runs[0] / "kept.json")
    with pytest.raises(RunError, match="seed0"):
        list(run_side_by_side(runs, 2, progress=False))
    assert is_finished(runs[1])  # the other run went on
    (runs[0] / "kept.json").rename(runs[0] / "run.json")
    assert set(run_side_by_side(runs, 2, progress=False)) == set(runs)
    assert all(is_finished(place) for place in runs)
    assert all(read_log(place).seconds > 0.0 for place in runs)


def test_a_broken_run_of_a_series_does_not_stop_the_others(tmp_path, monkeypatch):
    folder = new_series("Walk", [0, 1], tmp_path, TINY)
    first, second = runs_of(folder).values()
    (first / "checkpoint.safetensors").write_bytes(b"nothing of the kind")
    trained = []
    original = series.run

    def noted(place: Path, **keywords):
        result = original(place, **keywords)
        trained.append(place)
        return result

    monkeypatch.setattr(series, "run", noted)
    with pytest.raises(RunError, match=r"seed0.*no checkpoint can be read"):
        run_series(folder, progress=False)
    assert trained == [second]


@pytest.mark.parametrize(
    "changes",
    ["[]", {"env_id": 3}, {"seeds": []}, {"seeds": [1, 1]}, {"seeds": ["0"]}, {"seeds": 2}, {"seeds": [0.5]}, {"seeds": [-1]}],
)  # fmt: skip
def test_a_damaged_series_is_refused(tmp_path, changes):
    folder = new_series("Walk", [0, 1], tmp_path, TINY)
    file = folder / "series.json"
    file.write_text(
        changes if isinstance(changes, str) else json.dumps(json.loads(file.read_text()) | changes)
    )
    with pytest.raises(ValueError, match="is not a series'"):
        resumed("Walk", tmp_path, folder)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--seeds", "x"], "seeds must be as 5"),
        (["--seeds", "2", "--seed", "1"], "seeds must not be given together with"),
        (["--seeds", "2", "--steps", "0"], "steps must be from"),
        (["--algorithm", "dqn"], "algorithm must be one of"),
        (["--resume", "--seeds", "2"], "leave out seeds"),
        (["--jobs", "0"], "--jobs"),
    ],
)
def test_bad_series_are_refused_before_anything_is_written(tmp_path, arguments, message):
    result = CliRunner().invoke(train.app, [*arguments, "--out", str(tmp_path)], env={"COLUMNS": "400"})  # fmt: skip
    assert result.exit_code == 2
    assert message in result.output
    assert not list(tmp_path.iterdir())


def test_the_command_line_trains_several_seeds(tmp_path):
    arguments = ["--task", "Walk", "--seeds", "2", "--steps", "4096", "--episodes", "2", "--out", str(tmp_path)]  # fmt: skip
    result = CliRunner().invoke(train.app, arguments, env={"COLUMNS": "400"})
    assert result.exit_code == 0, result.output
    assert "median" in result.output
    assert "fixed" in result.output
    (folder,) = tmp_path.iterdir()
    again = CliRunner().invoke(train.app, ["--resume", "--run", str(folder), "--task", "Walk"], env={"COLUMNS": "400"})  # fmt: skip
    assert again.exit_code == 2
    assert "is finished" in again.output


def test_agents_of_the_package_are_trained_anew_by_one_command_that_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr(policy_files, "SHIPPED", tmp_path / "trained")
    entry = replace(ALGORITHMS["ppo"], shipped=("Walk", "Heading"), seeds=2)
    monkeypatch.setitem(ALGORITHMS, "ppo", entry)
    for old in ("Walk-v99/ppo/seed0", "Walk-v1/ppo/seed7"):  # another version's, and one too many
        (tmp_path / "trained" / old).mkdir(parents=True)
    out, choices = tmp_path / "a folder", {"steps": 4096, "episodes": 2}
    arguments = {"jobs": 2, "shipped": True, "choices": choices, "progress": False}
    (damaged,) = make_damaged(out / "Walk-ppo", choices)
    with pytest.raises(RunError, match="seed1"):
        list(retrain(["Walk"], ["ppo"], out, **arguments))
    damaged.unlink()
    first = out / "Walk-ppo" / "seed0" / "policy.safetensors"
    before = first.stat().st_mtime_ns
    assert list(retrain(["Walk"], ["ppo"], out, **arguments)) == [out / "Walk-ppo"]
    assert first.stat().st_mtime_ns == before  # not trained again
    shipped = sorted(path.parent for path in (tmp_path / "trained").glob("*/*/*/policy.json"))
    assert shipped == [tmp_path / "trained" / "Walk-v1" / "ppo" / f"seed{k}" for k in (0, 1)]
    assert [path.name for path in (tmp_path / "trained").iterdir()] == ["Walk-v1"]
    assert list((tmp_path / "trained" / "Walk-v1" / "ppo").iterdir()) != []
    rows = [json.loads((place / "evaluation.json").read_text()) for place in shipped]
    assert all({row["agent"] for row in each} == {"ppo"} for each in rows)
    with pytest.raises(ValueError, match="other settings"):
        list(retrain(["Walk"], ["ppo"], out, choices={"steps": 8192}))


def test_training_anew_leaves_a_folder_that_is_no_training_as_it_is(tmp_path):
    (tmp_path / "Walk-ppo").mkdir()
    (tmp_path / "Walk-ppo" / "letter.txt").write_text("dear")
    with pytest.raises(ValueError, match=r"Walk-ppo.*holds no trainings"):
        list(retrain(["Walk"], ["ppo"], tmp_path, choices={"steps": 4096}))
    assert (tmp_path / "Walk-ppo" / "letter.txt").read_text() == "dear"


def make_damaged(folder: Path, choices: dict) -> list[Path]:
    """A series of two Walk trainings whose second has a damaged checkpoint; the checkpoint."""
    make_series(trainings_of("Walk", range(2), {**choices, "algorithm": "ppo"}), folder)
    checkpoint = folder / "seed1" / "checkpoint.safetensors"
    checkpoint.write_bytes(b"nothing of the kind")
    return [checkpoint]
