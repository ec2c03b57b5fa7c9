"""SAC: discounts in time, exact resumption, and a policy that acts as the trained network."""

from __future__ import annotations

import numpy as np
import pytest
import safetensors.numpy
import torch
from gymnasium import spaces

from agents import load, save
from agents.learning import stable_baselines
from agents.learning.algorithms import ALGORITHMS, settings_for, train
from agents.learning.experience import TimeDiscountedReplay
from agents.learning.learner import settings_to_plain
from agents.learning.recorder import CheckpointError, read_checkpoint
from agents.learning.runs import Training, make_run, run
from agents.learning.sac import SACSettings
from agents.settings import with_values
from lean_yaw_env.envs.options import EnvOptions

ID = "LeanYaw/Heading-v1"
TINY = SACSettings(
    steps=640, walkers=8, gradient_steps=1, batch_size=32, buffer_size=400, random_steps=64, hidden=(8, 6)
)  # fmt: skip
SHORT = EnvOptions(horizon=15.0)  # some twenty steps, so that training sees ends and restarts
FEATURES = 7


def filled_replay(
    rate: float, durations: np.ndarray, constant: float, *, done: bool, timeout: bool
):
    """A buffer of one walker whose every step earns ``rate`` times its duration."""
    space = spaces.Box(-1.0, 1.0, (1,), np.float32)
    replay = TimeDiscountedReplay(
        len(durations), space, space, torch.device("cpu"), time_constant=constant, typical_duration=0.73
    )  # fmt: skip
    for duration in durations:
        replay.durations[replay.pos] = 0.0 if done else duration
        replay.add(
            np.zeros((1, 1)), np.zeros((1, 1)), np.zeros((1, 1)), np.array([rate * duration]),
            np.array([done]), [{"TimeLimit.truncated": timeout}],
        )  # fmt: skip
    return replay


@pytest.mark.parametrize("step", [0.2, 0.73, 3.0])
def test_a_steady_rate_is_worth_the_same_whatever_the_steps_length(step):
    rate, constant = 0.8, 24.0
    worth = rate * constant  # the integral of rate exp(-t / constant)
    sample = filled_replay(rate, np.full(5, step), constant, done=False, timeout=False).sample(16)
    target = sample.rewards + (1.0 - sample.dones) * worth
    assert target.numpy() == pytest.approx(np.full((16, 1), worth), rel=1e-6)  # float32


def test_only_a_fall_is_worth_nothing_afterwards():
    fell = filled_replay(1.0, np.full(5, 0.7), 24.0, done=True, timeout=False).sample(4)
    assert (fell.dones == 1.0).all()
    stopped = filled_replay(1.0, np.full(5, 0.7), 24.0, done=True, timeout=True).sample(4)
    expected = 1.0 - np.exp(-0.73 / 24.0)  # a typical step's, as the last one's is not told
    assert stopped.dones.numpy() == pytest.approx(np.full((4, 1), expected), rel=1e-5)  # float32


class Interruption(Exception):
    """In place of a key pressed or a power cut."""


# in the random actions at the start, while the buffer fills, and when it is full and goes round
@pytest.mark.parametrize("moment", [40, 304, 560])
def test_an_interrupted_training_resumes_bit_for_bit(tmp_path, monkeypatch, moment):
    whole = train("sac", ID, TINY, seed=3, options=SHORT, progress=False)
    checkpoint = tmp_path / "checkpoint.safetensors"
    arguments = {"seed": 3, "options": SHORT, "checkpoint": checkpoint, "checkpoint_seconds": 0.0, "progress": False}  # fmt: skip
    original = stable_baselines._Callback._on_step

    def interrupted(self) -> bool:
        if self.num_timesteps > moment:
            raise Interruption
        return original(self)

    monkeypatch.setattr(stable_baselines._Callback, "_on_step", interrupted)
    with pytest.raises(Interruption):
        train("sac", ID, TINY, **arguments)
    monkeypatch.setattr(stable_baselines._Callback, "_on_step", original)
    assert int(read_checkpoint(checkpoint)["steps"]) == moment
    np.random.seed(99)  # noqa: NPY002 - the resumed training must not depend on it
    torch.manual_seed(99)
    resumed = train("sac", ID, TINY, **arguments)
    for name, weight in whole.policy.weights.items():
        assert np.array_equal(weight, resumed.policy.weights[name]), name
    assert np.array_equal(whole.log.returns, resumed.log.returns)
    assert len(whole.log.returns) > TINY.walkers


def test_the_policy_acts_and_draws_as_the_trained_network(tmp_path):
    trained = train("sac", ID, TINY, seed=1, options=SHORT, checkpoint=tmp_path / "c.safetensors", progress=False)  # fmt: skip
    arrays = safetensors.numpy.load((tmp_path / "c.safetensors").read_bytes())
    observation = np.random.default_rng(0).normal(size=(20, FEATURES)).astype(np.float32)
    normal = (observation - arrays["observations/mean"]) / np.sqrt(
        arrays["observations/var"] + 1e-8
    )
    signal = np.clip(normal, -10.0, 10.0)
    for k in (0, 2):
        name = f"policy/actor.latent_pi.{k}"
        signal = np.maximum(signal @ arrays[f"{name}.weight"].T + arrays[f"{name}.bias"], 0.0)
    mean, log_std = (
        signal @ arrays[f"policy/actor.{name}.weight"].T + arrays[f"policy/actor.{name}.bias"]
        for name in ("mu", "log_std")
    )
    save(trained.policy, tmp_path / "saved")
    policy = load(tmp_path / "saved", env_id=ID, algorithm="sac")
    # float32 against float64
    assert policy.predict(observation)[0] == pytest.approx(np.tanh(mean), abs=1e-5)
    many = np.repeat(observation[:1], 4000, axis=0)
    drawn = np.arctanh(policy.predict(many, deterministic=False)[0].astype(float))
    deviation = np.exp(log_std[0])
    # standard errors of mean and deviation of 4000 draws, five of them
    assert (np.abs(drawn.mean(axis=0) - mean[0]) < 5 * deviation / np.sqrt(4000)).all()
    assert (np.abs(drawn.std(axis=0) - deviation) < 5 * deviation / np.sqrt(8000)).all()


def test_a_run_of_sac_is_judged_under_its_own_name(tmp_path):
    folder = tmp_path / "run"
    make_run(Training(ID, 0, TINY, SHORT, episodes=2, algorithm="sac"), folder)
    result = run(folder, progress=False)
    assert {row.agent for row in result.rows} >= {"fixed", "sac"}
    assert "ppo" not in {row.agent for row in result.rows}
    assert load(folder, algorithm="sac").card == result.policy.card


def test_a_checkpoint_of_other_settings_is_refused(tmp_path):
    path = tmp_path / "c.safetensors"
    train("sac", ID, TINY, options=SHORT, checkpoint=path, progress=False)
    for changes in ({"buffer_size": 320, "steps": 1280}, {"hidden": (6, 8)}):
        with pytest.raises(CheckpointError, match="not of a training with these settings"):
            train("sac", ID, SACSettings(**vars(TINY) | changes), options=SHORT, checkpoint=path, progress=False)  # fmt: skip


def test_settings_of_every_algorithm_survive_json():
    for name, entry in ALGORITHMS.items():
        settings = settings_for(name, entry.tasks[0])
        assert with_values(entry.settings(), settings_to_plain(settings)) == settings


def test_bad_settings_are_refused():
    for values, message in [
        ({"walkers": 0}, "walkers must be from"),
        ({"buffer_size": 10}, "buffer_size must be from"),
        ({"target_rate": 0.0}, "target_rate must be in"),
        ({"push_level": -1.0}, "push_level must be in"),
        ({"target_entropy": float("nan")}, "target_entropy must be in"),
        ({"hidden": (0,)}, "units of each layer in hidden must be from 1"),
    ]:
        with pytest.raises(ValueError, match=message):
            SACSettings(**values)
