"""Learners from sb3-contrib and policies that remember: exact resumption, and a policy that acts as the trained network."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from sb3_contrib.common.recurrent.type_aliases import RNNStates

from agents import load, save
from agents.learning import stable_baselines
from agents.learning.algorithms import ALGORITHMS, train
from agents.learning.ppo import FramesSettings
from agents.learning.recurrent import RecurrentSettings
from agents.learning.runs import Training, make_run, run
from agents.learning.tqc import TQCSettings
from agents.observations import ObservationLayout
from agents.policies.policy import Policy, PolicyCard
from agents.registry import AGENTS, agent_entry
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.files import read_json

ID = "LeanYaw/UnknownBody-v1"
ON_POLICY = {"steps": 768, "walkers": 8, "steps_per_update": 32, "batch_size": 128, "epochs": 1}
TINY = {
    "frames": FramesSettings(**ON_POLICY, hidden=(8, 6), frames=3),
    "recurrent": RecurrentSettings(**ON_POLICY, hidden=(6,), memory=5),
    "tqc": TQCSettings(
        steps=400, walkers=8, gradient_steps=1, batch_size=32, buffer_size=400, random_steps=64, hidden=(8, 6), quantiles=5
    ),
}  # fmt: skip
SHORT = EnvOptions(horizon=15.0)  # some twenty steps, so that training sees ends and restarts


class Interruption(Exception):
    """In place of a key pressed or a power cut."""


@pytest.mark.parametrize("algorithm", TINY)
def test_an_interrupted_training_resumes_bit_for_bit(tmp_path, monkeypatch, algorithm):
    settings = TINY[algorithm]
    arguments = {"seed": 3, "options": SHORT, "progress": False}
    whole = train(algorithm, ID, settings, **arguments)
    original = stable_baselines._Callback._on_step

    def interrupted(self) -> bool:
        if self.num_timesteps > 0.8 * settings.steps:
            raise Interruption
        return original(self)

    arguments |= {"checkpoint": tmp_path / "c.safetensors", "checkpoint_seconds": 0.0}
    with monkeypatch.context() as patch:
        patch.setattr(stable_baselines._Callback, "_on_step", interrupted)
        with pytest.raises(Interruption):
            train(algorithm, ID, settings, **arguments)
    np.random.seed(99)  # noqa: NPY002 - the resumed training must not depend on it
    torch.manual_seed(99)
    resumed = train(algorithm, ID, settings, **arguments)
    for name, weight in whole.policy.weights.items():
        assert np.array_equal(weight, resumed.policy.weights[name]), name
    assert len(whole.log.returns) > settings.walkers
    save(whole.policy, tmp_path / "saved")
    loaded = load(tmp_path / "saved", env_id=ID, algorithm=algorithm)
    seen = np.random.default_rng(0).normal(size=(4, 7)).astype(np.float32)
    first, state = loaded.predict(seen)
    assert np.array_equal(first, whole.policy.predict(seen)[0])
    assert np.array_equal(first, loaded.predict(seen)[0])  # nothing is kept but what is given
    assert (state is None) == (algorithm == "tqc")


def test_a_long_short_term_memory_is_that_of_torch_and_begins_anew_with_an_episode():
    learner = ALGORITHMS["recurrent"].make(ID, TINY["recurrent"], 0, SHORT, 1, None)
    policy = Policy(PolicyCard(ID, SHORT, ObservationLayout.of("UnknownBody", SHORT)), learner.weights())  # fmt: skip
    network, n = learner.model.policy, 6
    generator = np.random.default_rng(1)
    zero = torch.zeros(1, n, 5)
    theirs, ours = RNNStates((zero, zero), (zero, zero)), None
    alone = None
    for step in range(12):
        seen = generator.normal(size=(n, 7)).astype(np.float32)
        starts = generator.random(n) < (1.0 if step == 0 else 0.3)
        normal = np.clip(seen / np.sqrt(1.0 + 1e-8), -10.0, 10.0).astype(np.float32)
        with torch.no_grad():
            expected, _, _, theirs = network.forward(
                torch.from_numpy(normal), theirs, torch.from_numpy(starts).float(), deterministic=True
            )  # fmt: skip
        actions, ours = policy.predict(seen, ours, starts)
        # float32, in another order of summation
        assert actions == pytest.approx(np.clip(expected.numpy(), -1.0, 1.0), abs=2e-6)
        single, alone = policy.predict(seen[2], alone, starts[2])
        assert single == pytest.approx(actions[2], abs=2e-6)
    with pytest.raises(ValueError, match="state must be what predict returned"):
        policy.predict(seen[:3], ours)


def test_frames_are_the_latest_observations_of_the_episode():
    policy = train("frames", ID, TINY["frames"], options=SHORT, progress=False).policy
    seen = np.random.default_rng(0).normal(size=(5, 7)).astype(np.float32)
    state = None
    for k in range(5):
        actions, state = policy.predict(seen[k], state, np.array(k in (0, 2)))
    assert state is not None and np.array_equal(state[0], seen[3:].ravel())
    # what was before the start plays no part
    again, state = policy.predict(seen[2], None)
    for k in (3, 4):
        again, state = policy.predict(seen[k], state, np.array(False))
    assert np.array_equal(actions, again)


@pytest.mark.parametrize("algorithm", ["frames", "recurrent"])
def test_a_run_of_a_policy_that_remembers_is_evaluated(tmp_path, algorithm):
    options = EnvOptions(horizon=15.0)
    training = Training(ID, 0, TINY[algorithm], options, episodes=4, algorithm=algorithm, is_compared=False)  # fmt: skip
    make_run(training, tmp_path / "run")
    rows = run(tmp_path / "run", progress=False).rows
    assert {row.agent for row in rows} == {algorithm}
    statistics = read_json(tmp_path / "run" / "observation_statistics.json")
    assert tuple(statistics) == ObservationLayout.of("UnknownBody", options).names


def test_the_oracle_sees_the_body_and_every_algorithm_has_an_agent():
    training = Training.of_task("UnknownBody", algorithm="oracle", steps=1000)
    assert training.options == EnvOptions(show_body=True)
    assert agent_entry("oracle").needed_options(SHORT) == EnvOptions(horizon=15.0, show_body=True)
    assert set(ALGORITHMS) <= set(AGENTS)
    assert all(set(entry.shipped) <= set(entry.tasks) for entry in ALGORITHMS.values())
