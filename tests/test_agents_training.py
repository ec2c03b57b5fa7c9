"""Training: discounts in time, exact resumption, and what a run leaves behind."""

from __future__ import annotations

import json
import os
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import safetensors.numpy
import torch
from gymnasium import spaces
from typer.testing import CliRunner

import train
from agents import Policy, load, save
from agents.command_line import app as agents_app
from agents.evaluation.row_tables import rows_to_plain
from agents.learning import stable_baselines
from agents.learning.algorithms import ALGORITHMS, settings_for
from agents.learning.algorithms import train as train_agent
from agents.learning.experience import TimeDiscountedBuffer
from agents.learning.ppo import PPOSettings
from agents.learning.recorder import CheckpointError, read_checkpoint, write_checkpoint
from agents.learning.runs import Training, new_run, read_run, run
from agents.learning.series import resumed
from agents.policies import policy_files
from agents.settings import all_settings
from agents.shipping import ship
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.files import BusyError, locked

ID = "LeanYaw/Heading-v1"
TINY = PPOSettings(
    steps=1280, walkers=8, steps_per_update=32, batch_size=128, epochs=2, hidden=(8, 8)
)
# episodes of some twenty steps, so that training sees ends and restarts
SHORT = EnvOptions(horizon=15.0)
CPU = torch.device("cpu")


def filled_buffer(rate: float, durations: np.ndarray, values: float, constant: float):
    """A buffer of one walker whose every step earns ``rate`` times its duration."""
    size = len(durations)
    space = spaces.Box(-1.0, 1.0, (1,), np.float32)
    buffer = TimeDiscountedBuffer(size, space, space, CPU, gae_lambda=1.0, n_envs=1, time_constant=constant)  # fmt: skip
    for duration in durations:
        buffer.durations[buffer.pos] = duration
        buffer.add(
            np.zeros((1, 1)), np.zeros((1, 1)), np.array([rate * duration]),
            np.array([False]), torch.tensor([values]), torch.tensor([0.0]),
        )  # fmt: skip
    return buffer


@pytest.mark.parametrize("step", [0.2, 0.73, 3.0])
def test_a_steady_rate_is_worth_the_same_whatever_the_steps_length(step):
    rate, constant = 0.8, 24.0
    worth = rate * constant  # the integral of rate exp(-t / constant)
    buffer = filled_buffer(rate, np.full(50, step), worth, constant)
    buffer.compute_returns_and_advantage(torch.tensor([worth]), np.array([False]))
    # at its own worth nothing surprises; float32 values of about 20
    assert np.abs(buffer.advantages).max() < 2e-4
    assert buffer.returns == pytest.approx(np.full((50, 1), worth), rel=1e-5)


def test_returns_of_uneven_steps_are_the_discounted_integral():
    rate, constant = 0.5, 10.0
    durations = np.random.default_rng(0).uniform(0.3, 1.5, 20)
    buffer = filled_buffer(rate, durations, 0.0, constant)
    buffer.compute_returns_and_advantage(torch.tensor([0.0]), np.array([False]))
    left = durations[::-1].cumsum()[::-1]
    expected = rate * constant * (1.0 - np.exp(-left / constant))
    assert buffer.returns[:, 0] == pytest.approx(expected, rel=1e-5)  # float32


def test_nothing_after_an_episode_s_end_counts():
    buffer = filled_buffer(1.0, np.array([1.0, 0.0, 1.0]), 5.0, 10.0)
    buffer.episode_starts[2] = 1.0  # the second step ended an episode with a reward of 0
    buffer.compute_returns_and_advantage(torch.tensor([1e6]), np.array([True]))
    assert buffer.returns[1, 0] == 0.0
    assert buffer.returns[2, 0] == pytest.approx(10.0 * (1.0 - np.exp(-0.1)), rel=1e-6)  # float32


class Interruption(Exception):
    """In place of a key pressed or a power cut."""


def test_an_interrupted_training_resumes_bit_for_bit(tmp_path, monkeypatch):
    whole = train_agent("ppo", ID, TINY, seed=3, options=SHORT, progress=False)
    checkpoint = tmp_path / "checkpoint.safetensors"
    arguments = {"seed": 3, "options": SHORT, "checkpoint": checkpoint, "checkpoint_seconds": 0.0, "progress": False}  # fmt: skip
    original = stable_baselines._Callback._on_step

    def interrupted(self) -> bool:
        if self.num_timesteps > 800:  # in the midst of collecting experience
            raise Interruption
        return original(self)

    monkeypatch.setattr(stable_baselines._Callback, "_on_step", interrupted)
    with pytest.raises(Interruption):
        train_agent("ppo", ID, TINY, **arguments)
    monkeypatch.setattr(stable_baselines._Callback, "_on_step", original)
    assert int(read_checkpoint(checkpoint)["steps"]) == 768  # the last update before
    np.random.seed(99)  # noqa: NPY002 - the resumed training must not depend on it
    torch.manual_seed(99)
    continued = train_agent("ppo", ID, TINY, **arguments)
    for name, weight in whole.policy.weights.items():
        assert np.array_equal(weight, continued.policy.weights[name]), name
    assert np.array_equal(whole.log.steps, continued.log.steps)
    assert np.array_equal(whole.log.returns, continued.log.returns)
    assert len(whole.log.returns) > TINY.walkers
    assert continued.policy.card.training["steps"] == TINY.steps


def test_a_training_interrupted_before_its_first_update_resumes_bit_for_bit(tmp_path, monkeypatch):
    whole = train_agent("ppo", ID, TINY, seed=3, options=SHORT, progress=False)
    arguments = {"seed": 3, "options": SHORT, "checkpoint": tmp_path / "c.safetensors", "checkpoint_seconds": 0.0, "progress": False}  # fmt: skip

    def interrupted(self) -> bool:
        raise Interruption

    with monkeypatch.context() as patch:
        patch.setattr(stable_baselines._Callback, "_on_step", interrupted)
        with pytest.raises(Interruption):
            train_agent("ppo", ID, TINY, **arguments)
    continued = train_agent("ppo", ID, TINY, **arguments)
    for name, weight in whole.policy.weights.items():
        assert np.array_equal(weight, continued.policy.weights[name]), name


def test_seeds_decide_a_training_and_different_ones_differ():
    small = PPOSettings(steps=256, walkers=8, steps_per_update=32, batch_size=128, epochs=1)
    one, same, other = (
        train_agent("ppo", ID, small, seed=seed, options=SHORT, progress=False).policy.weights
        for seed in (0, 0, 1)
    )
    assert np.array_equal(one["layers.0.weight"], same["layers.0.weight"])
    assert not np.array_equal(one["layers.0.weight"], other["layers.0.weight"])


def test_pushes_of_the_training_are_no_part_of_what_the_policy_is_for():
    small = PPOSettings(steps=256, walkers=8, steps_per_update=32, batch_size=128, epochs=1)
    pushed = PPOSettings(**vars(small) | {"push_level": 0.5})
    calm, shaken = (
        train_agent("ppo", ID, s, options=SHORT, progress=False).policy for s in (small, pushed)
    )
    assert shaken.card.options == calm.card.options == SHORT
    assert shaken.card.settings["push_level"] == 0.5
    # pushes are seen, so that the statistics of observations differ
    assert not np.array_equal(
        calm.weights["observation_variance"], shaken.weights["observation_variance"]
    )


def test_a_training_of_shorter_episodes_is_for_the_environment_s_own():
    settings = replace(TINY, horizon=6.0)
    trained = train_agent("ppo", ID, settings, progress=False)
    assert trained.policy.card.options == EnvOptions()
    assert trained.log.lengths.max() < 12  # steps of 0.73 or so
    assert trained.log.survived.any()


def test_training_leaves_no_folder_behind(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    train_agent("ppo", ID, replace(TINY, steps=256), progress=False)
    assert not list(tmp_path.iterdir())


def test_training_leaves_torch_s_threads_as_they_were():
    before = torch.get_num_threads()
    small = PPOSettings(steps=64, walkers=4, steps_per_update=16, batch_size=64, epochs=1)
    train_agent("ppo", ID, small, threads=2, progress=False)
    assert torch.get_num_threads() == before


def test_a_checkpoint_of_another_training_or_a_damaged_one_is_refused(tmp_path):
    path = tmp_path / "checkpoint.safetensors"
    train_agent("ppo", ID, TINY, options=SHORT, checkpoint=path, progress=False)
    other = PPOSettings(**vars(TINY) | {"hidden": (16, 16), "steps": 2560})
    with pytest.raises(CheckpointError, match="not of a training with these settings"):
        train_agent("ppo", ID, other, options=SHORT, checkpoint=path, progress=False)
    arrays = read_checkpoint(path)
    del arrays["log"]["returns"]
    write_checkpoint(path, arrays)
    with pytest.raises(CheckpointError, match="holds no log"):
        train_agent("ppo", ID, TINY, options=SHORT, checkpoint=path, progress=False)
    path.write_bytes(b"nothing of the kind")
    with pytest.raises(CheckpointError, match="no checkpoint can be read"):
        train_agent("ppo", ID, TINY, options=SHORT, checkpoint=path, progress=False)


def test_a_checkpoint_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    path = tmp_path / "checkpoint.safetensors"
    write_checkpoint(path, {"a": np.arange(3)})

    def broken(self: Path, data: bytes) -> int:
        raise OSError("no space left")

    monkeypatch.setattr(Path, "write_bytes", broken)
    with pytest.raises(OSError, match="no space left"):
        write_checkpoint(path, {"a": np.arange(4)})
    assert np.array_equal(read_checkpoint(path)["a"], np.arange(3))
    assert list(tmp_path.iterdir()) == [path]


def tiny_training(**changes) -> Training:
    values = {"seed": 0, "settings": TINY, "options": SHORT, "episodes": 4, "checkpoint_seconds": 0.0}  # fmt: skip
    return Training(ID, **values | changes)


def test_a_run_leaves_agent_statistics_settings_pictures_and_judgement(tmp_path):
    folder = new_run(tiny_training(), tmp_path)
    assert read_run(folder) == tiny_training()
    result = run(folder, progress=False)
    names = {path.name for path in folder.iterdir()}
    assert names == {
        "run.json", "checkpoint.safetensors", "policy.json", "policy.safetensors", "episodes.csv",
        "observation_statistics.json", "learning_curve.png", "footprints.png", "evaluation.json",
    }  # fmt: skip
    assert {row.agent for row in result.rows} >= {"random", "fixed", "feedback", "ppo"}
    statistics = json.loads((folder / "observation_statistics.json").read_text())
    assert list(statistics) == list(result.policy.card.layout.names)
    record = json.loads((folder / "run.json").read_text())
    assert record["seed"] == 0
    assert record["settings"]["steps"] == TINY.steps
    observation = np.zeros((1, 7))
    loaded = load(folder, env_id=ID)
    assert np.array_equal(loaded.predict(observation)[0], result.policy.predict(observation)[0])
    lines = (folder / "episodes.csv").read_text().splitlines()
    assert lines[0] == "steps,return,length,survived"
    assert len(lines) > TINY.walkers


def test_finished_runs_are_shipped_and_loaded_by_id_and_others_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(policy_files, "SHIPPED", tmp_path / "trained")
    folder = new_run(tiny_training(options=EnvOptions(), seed=3), tmp_path)
    with pytest.raises(ValueError, match=r"no policy can be loaded"):
        ship(folder)
    result = run(folder, progress=False)
    (shipped,) = ship(folder)
    assert shipped == tmp_path / "trained" / "Heading-v1" / "ppo" / "seed3"
    names = ["evaluation.json", "policy.json", "policy.safetensors"]
    assert sorted(path.name for path in shipped.iterdir()) == names
    assert load(ID, seed=3).card == result.policy.card
    rows = json.loads((shipped / "evaluation.json").read_text())
    assert rows == rows_to_plain([row for row in result.rows if row.agent == "ppo"])
    with pytest.raises(ValueError, match="replace it by --replace"):
        ship(folder)
    assert ship(folder, replace=True) == [shipped]
    (folder / "evaluation.json").unlink()
    with pytest.raises(ValueError, match="is not finished"):
        ship(folder, replace=True)
    other = new_run(tiny_training(), tmp_path)
    (other / "evaluation.json").write_text("[]")
    save(Policy(replace(result.policy.card, options=SHORT), result.policy.weights), other)
    with pytest.raises(ValueError, match="must be the environment's own"):
        ship(other)


def test_finished_runs_are_not_resumed_and_unfinished_ones_are_found(tmp_path):
    with pytest.raises(ValueError, match="no unfinished training of Heading"):
        resumed("Heading", tmp_path)
    folder = new_run(tiny_training(), tmp_path)
    assert resumed("Heading", tmp_path) == folder
    with pytest.raises(ValueError, match="no unfinished training of Walk"):
        resumed("Walk", tmp_path)
    with pytest.raises(ValueError, match="leave out seed"):
        resumed("Heading", tmp_path, None, {"seed": 1})
    for name in ("evaluation.json", "policy.json"):
        (folder / name).write_text("{}")
    with pytest.raises(ValueError, match="is finished"):
        resumed("Heading", tmp_path, folder)


@pytest.mark.parametrize(
    "changes",
    [
        "[]", "3", "{}", {"env_id": "CartPole-v1"}, {"env_id": 3}, {"seed": -1}, {"seed": 0.0}, {"seed": True}, {"seed": 5},
        {"episodes": 0}, {"episodes": "4"}, {"threads": 0}, {"threads": 1.5}, {"checkpoint_seconds": -1.0},
        {"checkpoint_seconds": "soon"}, {"tensorboard": 1}, {"algorithm": "dqn"}, {"algorithm": ["ppo"]}, {"algorithm": "sac"},
        {"options": []}, {"options": {"horizon": -1.0}}, {"options": {"made_up": 1}}, {"settings": []}, {"settings": {}},
        {"walkers_seed": 1}, {"evaluation_seed": None},
    ],
)  # fmt: skip
def test_a_damaged_run_is_refused(tmp_path, changes):
    folder = new_run(tiny_training(), tmp_path)
    file = folder / "run.json"
    text = (
        changes if isinstance(changes, str) else json.dumps(json.loads(file.read_text()) | changes)
    )
    file.write_text(text)
    with pytest.raises(ValueError, match="is not a run's"):
        read_run(folder)


def test_a_run_keeps_its_options_and_its_agent_is_evaluated_under_any_others(tmp_path):
    options = EnvOptions(random_body="training", hidden_rates=True, horizon=15.0)
    arguments = ["--steps", "128", "--episodes", "2", "--out", str(tmp_path)]
    given = ["random_body=training", "hidden_rates=true", "horizon=15"]
    arguments += [word for each in given for word in ("--option", each)]
    result = CliRunner().invoke(train.app, arguments, env={"COLUMNS": "200"})
    assert result.exit_code == 0, result.output
    (folder,) = (path.parent for path in tmp_path.glob("*/run.json"))
    assert read_run(folder).options == options == load(folder).card.options
    returns = []
    for others in ([], ["--option", "sensor_noise=0.2"]):
        command = ["evaluate", "--agent-path", str(folder), "--episodes", "2", "--json", *others]
        evaluated = CliRunner().invoke(agents_app, command)
        assert evaluated.exit_code == 0, evaluated.output
        rows = json.loads(evaluated.stdout)
        returns += [row["mean"] for row in rows if (row["agent"], row["metric"]) == ("ppo", "return")]  # fmt: skip
        # the folder stands for its own algorithm; the others are the package's
        assert {row["agent"]: row["trainings"] for row in rows}.items() >= {
            "ppo": 1,
            "apg": 5,
        }.items()
    assert len(returns) == 2 and returns[0] != returns[1]
    with pytest.raises(ValueError, match="must be the environment's own"):
        ship(folder)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("steps", 0), ("steps", "many"), ("walkers", 1.5), ("learning_rate", None), ("hidden", 8), ("hidden", [8, "8"]),
        ("hidden", [8.5]), ("hidden", [True]), ("batch_size", []), ("gae_lambda", "0.9"), ("push_level", "x"), ("time_constant", -1.0),
        ("made_up", 1), ("typical_discount", 0.5), ("steps.real", 3),
    ],
)  # fmt: skip
def test_a_run_with_damaged_settings_is_refused(tmp_path, name, value):
    folder = new_run(tiny_training(), tmp_path)
    record = json.loads((folder / "run.json").read_text())
    record["settings"][name] = value
    (folder / "run.json").write_text(json.dumps(record))
    with pytest.raises(ValueError, match="is not a run's"):
        read_run(folder)


DAMAGES = {
    "steps beyond the plan": ("steps", lambda a: a + 10**6),
    "steps below zero": ("steps", lambda a: a * 0 - 1),
    "steps that are no number": ("steps", lambda a: np.zeros(2)),
    "NaN weights": ("policy/action_net.bias", lambda a: a * np.nan),
    "NaN memories": ("walkers/episode_returns", lambda a: a * np.nan),
    "weights of another type": ("policy/action_net.bias", lambda a: a.astype(float)),
    "a negative variance": ("observations/var", lambda a: a - 100.0),
    "statistics of another shape": ("observations/mean", lambda a: a[:3]),
    "random numbers of another generator": ("torch", lambda a: a[:100]),
    "a position beyond the generator's": ("numpy/state/pos", lambda a: a + 10**6),
    "observations of another shape": ("last/observations", lambda a: a[:, :3]),
    "an optimiser of another shape": ("adam/0/exp_avg", lambda a: a[:1]),
    "episodes without order": ("log/steps", lambda a: a[::-1].copy()),
    "NaN returns": ("log/returns", lambda a: a * np.nan),
    "episodes of no length": ("log/lengths", lambda a: a * 0),
    "columns of different lengths": ("log/survived", lambda a: a[1:]),
    "negative seconds": ("log/seconds", lambda a: a - 1e9),
    "no steps": ("steps", None),
    "no walkers": ("walkers/episode_lengths", None),
}


def damage(file: Path, name: str, change) -> None:
    arrays = safetensors.numpy.load(file.read_bytes())
    value = arrays.pop(name)
    if change is not None:
        arrays[name] = np.asarray(change(value))
    file.write_bytes(safetensors.numpy.save(arrays))


@pytest.fixture(scope="module")
def half_trained(tmp_path_factory):
    """A run that was interrupted after its third update."""
    folder = new_run(tiny_training(), tmp_path_factory.mktemp("runs"))

    def interrupt(steps: int, recent: float) -> None:
        if steps > 768:
            raise Interruption

    with pytest.raises(Interruption):
        run(folder, progress=False, report=interrupt)
    return folder


@pytest.mark.parametrize("damaged", DAMAGES)
def test_a_damaged_checkpoint_is_refused_whatever_is_damaged(half_trained, damaged):
    file = half_trained / "checkpoint.safetensors"
    sound = file.read_bytes()
    try:
        damage(file, *DAMAGES[damaged])
        with pytest.raises(CheckpointError):
            run(half_trained, progress=False)
    finally:
        file.write_bytes(sound)


def test_one_broken_run_does_not_keep_others_from_being_resumed(tmp_path, capsys):
    broken = new_run(tiny_training(), tmp_path)
    sound = new_run(tiny_training(), tmp_path)
    (broken / "run.json").write_text("[")
    assert resumed("Heading", tmp_path) == sound
    assert "left out" in capsys.readouterr().err


def test_a_run_in_which_another_process_trains_is_refused(tmp_path):
    folder = new_run(tiny_training(), tmp_path)
    with locked(folder), pytest.raises(BusyError, match=f"process {os.getpid()} is at work"):
        run(folder, progress=False)


def test_the_command_line_trains_judges_and_is_found_by_the_evaluator(tmp_path):
    arguments = ["--task", "Walk", "--steps", "16384", "--episodes", "2", "--out", str(tmp_path)]
    result = CliRunner().invoke(train.app, arguments, env={"COLUMNS": "200"})
    assert result.exit_code == 0, result.output
    assert "ppo" in result.output
    again = CliRunner().invoke(train.app, ["--task", "Walk", "--resume", "--out", str(tmp_path)], env={"COLUMNS": "400"})  # fmt: skip
    assert again.exit_code == 2
    assert "no unfinished training" in again.output
    judged = CliRunner().invoke(
        agents_app,
        [
            "evaluate",
            "--task",
            "Walk",
            "--agents",
            "ppo",
            "--episodes",
            "2",
            "--runs",
            str(tmp_path),
            "--json",
        ],
    )
    assert judged.exit_code == 0, judged.output
    assert {row["agent"] for row in json.loads(judged.stdout)} == {"ppo"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--task", "Fly"], "task must be one of"),
        (["--task", "Walk", "--algorithm", "her"], "task of her must be"),
        (["--steps", "0"], "steps must be from"),
        (["--seed", "-1"], "seed must be from"),
        (["--episodes", "0"], "episodes must be from"),
        (["--threads", "0"], "threads must be from"),
        (["--run", "runs/some"], "run must not be given without --resume"),
    ],
)
def test_the_command_line_refuses_bad_values_before_anything_is_written(
    tmp_path, arguments, message
):
    result = CliRunner().invoke(train.app, [*arguments, "--out", str(tmp_path)], env={"COLUMNS": "400"})  # fmt: skip
    assert result.exit_code == 2
    assert message in result.output
    assert not list(tmp_path.iterdir())


def test_every_option_of_the_command_line_is_explained():
    options_of_training = ("--task", "--seed", "--steps", "--out", "--resume", "--run", "--threads")
    for app, command, options in [
        (train.app, [], options_of_training),
        (agents_app, ["train"], options_of_training),
        (agents_app, ["evaluate"], ("--task", "--agents", "--episodes", "--json", "--agent-path")),
        (agents_app, ["tune"], ("--trials", "--storage", "--out", "--episodes", "--repeats")),
        (agents_app, ["ship"], ("--replace",)),
        (agents_app, ["film"], ("--task", "--agent", "--format")),
        (agents_app, ["closed-loop"], ("--task", "--agents", "--out")),
    ]:
        result = CliRunner().invoke(app, [*command, "--help"], env={"COLUMNS": "200"})
        assert result.exit_code == 0
        assert all(option in result.output for option in options)


def test_every_environment_has_settings_and_bad_ones_are_refused():
    for algorithm, entry in ALGORITHMS.items():
        assert set(all_settings().get(algorithm, {})) <= set(entry.tasks)
        for task in entry.tasks:
            assert isinstance(settings_for(algorithm, task), entry.settings)
    with pytest.raises(ValueError, match="task of ppo must be one of"):
        settings_for("ppo", "CartPole")
    for values, message in [
        ({"batch_size": 1000}, "batch_size must divide the 32768 samples"),
        ({"walkers": 0}, "walkers must be from"),
        ({"push_level": -1.0}, "push_level must be in"),
        ({"time_constant": 0.0}, "time_constant must be in"),
        ({"gae_lambda": 1.5}, "gae_lambda must be in"),
        ({"hidden": ()}, "hidden must name one layer"),
        ({"initial_log_std": float("nan")}, "initial_log_std must be in"),
    ]:
        with pytest.raises(ValueError, match=message):
            PPOSettings(**values)
