"""Waypoint for learners that relabel goals."""

from __future__ import annotations

import pickle
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import SyncVectorEnv
from stable_baselines3 import SAC, HerReplayBuffer
from stable_baselines3.common.env_checker import check_env as sb3_check_env

import lean_yaw_env  # noqa: F401  registers the environments
from lean_yaw_env.envs.goal_env import GOAL_SCALE, WaypointGoalEnv, WaypointGoalVectorEnv
from lean_yaw_env.envs.tasks.waypoint import RADIUS
from lean_yaw_env.registration import GOAL_ENV_ID

ZERO = np.zeros(2, dtype=np.float32)


def test_both_checkers_find_nothing_to_warn_of() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(WaypointGoalEnv(), skip_render_check=True)
        sb3_check_env(WaypointGoalEnv(), skip_render_check=True)


def test_reward_is_vectorised_and_steps_agree_with_it() -> None:
    random = np.random.default_rng(0)
    goals = random.normal(size=(4, 5, 2))
    near = goals + 0.99 * RADIUS / GOAL_SCALE * np.array([0.6, 0.8])
    far = goals + 1.01 * RADIUS / GOAL_SCALE * np.array([0.6, 0.8])
    env = WaypointGoalEnv(start_disturbance=0.0)
    assert np.all(env.compute_reward(near, goals, {}) == 1.0)
    assert np.all(env.compute_reward(far, goals, {}) == 0.0)
    assert env.compute_reward(near[0, 0], goals[0, 0], {}).shape == ()

    env.reset(seed=0, options={"goal": (3.0, 0.0)})
    terminated = False
    while not terminated:
        observation, reward, terminated, truncated, info = env.step(ZERO)
        own = env.compute_reward(observation["achieved_goal"], observation["desired_goal"], info)
        assert reward == own
        assert info["is_success"] == (reward == 1.0)
        assert not truncated
    assert reward == 1.0
    with pytest.raises(gym.error.ResetNeeded):
        env.step(ZERO)


def test_the_observation_knows_nothing_of_the_goal() -> None:
    env = WaypointGoalEnv(start_disturbance=0.0)
    first, _ = env.reset(seed=0, options={"goal": (10.0, 3.0)})
    other, _ = env.reset(seed=0, options={"goal": (-5.0, 8.0)})
    assert np.array_equal(first["observation"], other["observation"])
    np.testing.assert_array_equal(first["desired_goal"], [1.25, 0.375])
    np.testing.assert_array_equal(other["desired_goal"], [-0.625, 1.0])


def test_a_fall_is_no_success() -> None:
    env = WaypointGoalEnv()
    env.reset(seed=0, options={"state": [0.0, 0.15, 0.0, 0.1, 0.0], "stance": "left"})
    _, reward, terminated, _, info = env.step(ZERO)
    assert terminated
    assert reward == 0.0
    assert info["is_success"] == 0.0


@pytest.mark.parametrize("far", [80.0, 200.0, 1000.0])
def test_goals_far_away_are_themselves(far: float) -> None:
    env = WaypointGoalEnv(start_disturbance=0.0)
    observation, _ = env.reset(seed=0, options={"goal": (far, 0.0)})
    assert observation["desired_goal"][0] == far / GOAL_SCALE
    assert env.observation_space.contains(observation)
    # where all goals beyond 80 were taken for 80, the walker had reached them all there
    env.simulation.walkers["place_x"] = 80.0
    observation, reward, terminated, _, info = env.step(ZERO)
    is_near = abs(8.0 * observation["achieved_goal"][0] - far) < RADIUS
    assert (reward == 1.0) == terminated == (info["is_success"] == 1.0) == is_near == (far == 80.0)
    ends = env.compute_terminated(observation["achieved_goal"], observation["desired_goal"], info)
    assert ends == terminated


def test_one_walker_and_many_agree_bit_for_bit() -> None:
    many = gym.make_vec(GOAL_ENV_ID, num_envs=3, horizon=8.0)
    singles = SyncVectorEnv([lambda: gym.make(GOAL_ENV_ID, horizon=8.0)] * 3)
    assert isinstance(many.unwrapped, WaypointGoalVectorEnv)
    assert many.observation_space == singles.observation_space
    random = np.random.default_rng(1)
    pairs = [(many.reset(seed=2), singles.reset(seed=2))]
    for _ in range(30):
        actions = random.uniform(-1.0, 1.0, (3, 2)).astype(np.float32)
        pairs.append((many.step(actions), singles.step(actions)))
    for ours, theirs in pairs:
        for key in ("observation", "achieved_goal", "desired_goal"):
            assert ours[0][key].dtype == theirs[0][key].dtype
            assert (ours[0][key] == theirs[0][key]).all()
        assert ours[-1].keys() == theirs[-1].keys()
        assert all((ours[-1][key] == theirs[-1][key]).all() for key in ours[-1])
        for a, b in zip(ours[1:-1], theirs[1:-1], strict=True):
            assert (a == b).all()


def test_a_copied_episode_goes_on() -> None:
    env = WaypointGoalEnv(sensor_noise=0.1)
    env.reset(seed=3)
    other = pickle.loads(pickle.dumps(env))
    for _ in range(20):
        a, b = env.step(ZERO), other.step(ZERO)
        assert all((a[0][key] == b[0][key]).all() for key in a[0])
        assert a[1:4] == b[1:4]


def test_it_pickles_and_takes_the_options_of_the_others() -> None:
    env = pickle.loads(pickle.dumps(WaypointGoalEnv(sensor_noise=0.1, horizon=20.0)))
    assert (env.options.sensor_noise, env.options.horizon, env.options.mirror) == (0.1, 20.0, False)
    with pytest.raises(ValueError, match="mirror must be False"):
        WaypointGoalEnv(mirror=True)


def test_hindsight_relabels_goals_and_rewards_alike() -> None:
    env = gym.make(GOAL_ENV_ID, horizon=10.0)
    model = SAC(
        "MultiInputPolicy",
        env,
        replay_buffer_class=HerReplayBuffer,
        replay_buffer_kwargs={"n_sampled_goal": 4, "goal_selection_strategy": "future"},
        policy_kwargs={"net_arch": [8]},
        learning_starts=100,
        batch_size=32,
        buffer_size=1000,
        seed=0,
        device="cpu",
    )
    model.learn(120)
    buffer = model.replay_buffer
    assert isinstance(buffer, HerReplayBuffer)
    sample = buffer.sample(500)
    achieved = sample.next_observations["achieved_goal"].numpy()
    desired = sample.next_observations["desired_goal"].numpy()
    rewards = sample.rewards.numpy()[:, 0]
    assert np.array_equal(rewards, WaypointGoalEnv().compute_reward(achieved, desired, {}))
    # goals are at least 8 away and ten units of time walk half of that: only relabelled ones are reached
    assert rewards.sum() > 0.0
