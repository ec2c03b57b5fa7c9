"""SAC with hindsight: what it learns from, exact resumption, and an agent that reaches goals."""

from __future__ import annotations

from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
import torch

import agents
from agents.evaluation.scoring import run_episodes
from agents.learning import stable_baselines
from agents.learning.algorithms import Trained, settings_for, train
from agents.learning.experience import TimeDiscountedHindsight
from agents.learning.her import HERSettings
from agents.learning.recorder import read_checkpoint
from agents.learning.runs import Training, make_run, run
from agents.registry import AgentRequest, env_id_of, make_agent, names_for
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.sb3 import WalkerVecEnv
from lean_yaw_env.registration import GOAL_ENV_ID, GOAL_TASK

TINY = HERSettings(
    steps=640, walkers=8, gradient_steps=1, batch_size=32, buffer_size=480, random_steps=240, hidden=(8, 6)
)  # fmt: skip
SHORT = EnvOptions(horizon=15.0)  # some twenty steps, so that training sees ends and restarts
CONSTANT = 24.0


def test_a_goal_is_worth_what_the_time_until_then_leaves_of_one() -> None:
    env = WalkerVecEnv(1, GOAL_ENV_ID, horizon=30.0)
    replay = TimeDiscountedHindsight(
        200, env.observation_space, env.action_space, env, device="cpu",
        time_constant=CONSTANT, typical_duration=0.73,
    )  # fmt: skip
    env.seed(0)
    before, action = env.reset(), np.zeros((1, 2))
    for _ in range(150):
        after, reward, done, infos = env.step(action)
        replay.durations[replay.pos] = env.step_durations()
        replay.add(before, after, action, reward, done, infos)
        before = after
    sample = replay.sample(1000)
    # the worth of the next place is one step's discount away, whichever goal is meant
    walks = ~sample.dones.isclose(torch.ones(()))
    discounts = (1.0 - sample.dones[walks]).numpy()
    assert (discounts >= np.exp(-1.2 / CONSTANT)).all() and (discounts < 1.0).all()
    paid = sample.rewards[~walks].numpy()
    assert len(paid) > 0
    assert ((paid >= np.exp(-1.2 / CONSTANT)) & (paid < 1.0)).all()
    assert (sample.rewards[walks] == 0.0).all()


class Interruption(Exception):
    """In place of a key pressed or a power cut."""


# in the random actions at the start, while the buffer fills, and when it is full and goes round
@pytest.mark.parametrize("moment", [40, 304, 560])
def test_an_interrupted_training_resumes_bit_for_bit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moment: int
) -> None:
    whole = train("her", GOAL_ENV_ID, TINY, seed=3, options=SHORT, progress=False)
    checkpoint = tmp_path / "checkpoint.safetensors"
    original = stable_baselines._Callback._on_step

    def begin() -> Trained:
        return train(
            "her", GOAL_ENV_ID, TINY, seed=3, options=SHORT, checkpoint=checkpoint, checkpoint_seconds=0.0,
            progress=False,
        )  # fmt: skip

    def interrupted(self: stable_baselines._Callback) -> bool:
        if self.num_timesteps > moment:
            raise Interruption
        return original(self)

    monkeypatch.setattr(stable_baselines._Callback, "_on_step", interrupted)
    with pytest.raises(Interruption):
        begin()
    monkeypatch.setattr(stable_baselines._Callback, "_on_step", original)
    assert int(read_checkpoint(checkpoint)["steps"]) == moment
    np.random.seed(99)  # noqa: NPY002 - the resumed training must not depend on it
    torch.manual_seed(99)
    resumed = begin()
    for name, weight in whole.policy.weights.items():
        assert np.array_equal(weight, resumed.policy.weights[name]), name
    assert np.array_equal(whole.log.lengths, resumed.log.lengths)
    assert len(whole.log.lengths) > TINY.walkers


def test_a_run_is_judged_beside_the_other_agents_of_its_task(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    make_run(Training(GOAL_ENV_ID, 0, TINY, SHORT, episodes=2, algorithm="her"), folder)
    result = run(folder, progress=False)
    assert {row.agent for row in result.rows} == {"random", "fixed", "lqr", "her"}
    assert agents.load(folder, algorithm="her").card == result.policy.card


@pytest.mark.parametrize(
    ("algorithm", "task"), [("her", "Waypoint"), ("her", "Heading"), ("apg", GOAL_TASK)]
)
def test_an_algorithm_refuses_tasks_that_it_cannot_learn(algorithm: str, task: str) -> None:
    with pytest.raises(ValueError, match=f"task of {algorithm} must be one of"):
        settings_for(algorithm, task)


def test_the_shipped_agent_reaches_goals_it_was_not_trained_on() -> None:
    request = AgentRequest(env_id_of(GOAL_TASK), EnvOptions(), runs=None)
    assert set(names_for(request)) == {"random", "fixed", "lqr", "her"}
    results = {
        name: run_episodes(make_agent(name, request), GOAL_TASK, episodes=64)
        for name in ("fixed", "her")
    }
    reached = {name: each.metrics["is_success"] for name, each in results.items()}
    # 1000 episodes: see its evaluation.json; here room for one in 64
    assert reached["her"].mean() >= 0.98
    assert reached["fixed"].mean() < 0.1
    # to reach the goal ends the episode, and is no fall
    assert (results["her"].survived >= (reached["her"] > 0.0)).all()


@pytest.mark.parametrize("name", ["random", "fixed", "lqr", "her"])
def test_agents_of_the_task_act_on_dictionaries_too(name: str) -> None:
    agent = make_agent(name, AgentRequest(GOAL_ENV_ID, EnvOptions(), runs=None))
    many = gym.make_vec(GOAL_ENV_ID, num_envs=3)
    observations, _ = many.reset(seed=0)
    assert agent.predict(observations)[0].shape == (3, 2)  # type: ignore[arg-type]
    env = gym.make(GOAL_ENV_ID)
    observation, _ = env.reset(seed=0, options={"goal": (9.0, 3.0)})
    ends = False
    while not ends:
        action, _ = agent.predict(observation, deterministic=True)  # type: ignore[arg-type]
        observation, reward, terminated, truncated, _ = env.step(action)
        ends = terminated or truncated
    assert (reward == 1.0) == (name in ("lqr", "her"))


def test_the_package_s_agent_of_the_goal_environment_is_loaded_by_its_id_alone():
    assert agents.load("LeanYaw/WaypointGoal-v1").card.algorithm == "her"
