"""Waypoint for learners that relabel goals."""

from __future__ import annotations

import pickle
import warnings

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import SyncVectorEnv
from stable_baselines3 import SAC, HerReplayBuffer
from stable_baselines3.common.env_checker import check_env as sb3_check_env
from stable_baselines3.common.vec_env import DummyVecEnv

import lean_yaw_env  # noqa: F401  registers the environments
from lean_yaw_env.envs.goal_env import (
    GOAL_SCALE,
    WaypointGoalEnv,
    WaypointGoalVectorEnv,
    seen_from_walker,
)
from lean_yaw_env.envs.hindsight import GoalFromWalker, HindsightReplay
from lean_yaw_env.envs.sb3 import WalkerVecEnv
from lean_yaw_env.envs.tasks.waypoints import RADIUS
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.registration import GOAL_ENV_ID

KEYS = ("observation", "achieved_goal", "desired_goal")
FALLING = [0.0, 0.15, 0.0, 0.1, 0.0]
"""A section state that rolls back."""
ROUNDING = 1e-5
"""Single precision, of numbers up to 10 that come from a sum of a few terms."""
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


@pytest.mark.parametrize("goal", [(10.0, 0.0), (0.0, 0.0)])
def test_a_fall_is_no_success_wherever_it_happens(goal: tuple[float, float]) -> None:
    env = WaypointGoalEnv()
    env.reset(seed=0, options={"state": FALLING, "stance": "left", "goal": goal})
    observation, reward, terminated, truncated, info = env.step(ZERO)
    places = observation["achieved_goal"], observation["desired_goal"]
    assert terminated and not truncated
    assert reward == info["is_success"] == 0.0
    assert env.compute_reward(*places, info) == 0.0
    assert env.compute_terminated(*places, info)
    assert not env.compute_truncated(*places, info)
    # told of no fall, the place alone decides
    assert env.compute_reward(*places, {}) == (goal == (0.0, 0.0))


def test_the_rules_give_back_what_steps_returned() -> None:
    env = WaypointGoalVectorEnv(40, horizon=12.0, max_episode_steps=14, start_disturbance=5.0)
    goals = env.reset(seed=0)[0]["desired_goal"]
    env.simulation.tasks["goal_x"][::4] = 2.0  # some near ones, so that there are all kinds of ends
    env.simulation.tasks["goal_z"][::4] = 0.0
    random = np.random.default_rng(0)
    kinds = {"reached": 0, "fell": 0, "cut": 0}
    for _ in range(14):
        actions = random.uniform(-1.0, 1.0, (40, 2)).astype(np.float32)
        walks = ~env._ended
        observations, rewards, terminated, truncated, info = env.step(actions)
        achieved, goals = observations["achieved_goal"], observations["desired_goal"]
        told = [{key: info[key][i] for key in ("fall", "time", "steps")} for i in range(40)]
        for infos in (info, told):
            assert (env.compute_reward(achieved, goals, infos) == rewards)[walks].all()
            assert (env.compute_terminated(achieved, goals, infos) == terminated)[walks].all()
            assert (env.compute_truncated(achieved, goals, infos) == truncated)[walks].all()
        kinds["reached"] += int((rewards > 0.0).sum())
        kinds["fell"] += int((terminated & (rewards == 0.0)).sum())
        kinds["cut"] += int(truncated.sum())
    assert min(kinds.values()) > 0, kinds


@pytest.mark.parametrize("mirror", [True, False])
def test_the_goal_seen_from_the_walker_is_what_the_plain_environment_observes(mirror: bool) -> None:
    goal_env, plain_env = WaypointGoalEnv(mirror=mirror), WalkerEnv("WaypointGoal", mirror=mirror)
    features = GoalFromWalker(goal_env.observation_space, mirror)  # type: ignore[arg-type]
    assert features.features_dim == len(plain_env.task.observed) + (6 if mirror else 7)
    random = np.random.default_rng(0)
    observation, _ = goal_env.reset(seed=1)
    plain, _ = plain_env.reset(seed=1)
    for _ in range(40):
        np.testing.assert_allclose(
            seen_from_walker(observation, mirror=mirror), plain, rtol=0.0, atol=ROUNDING
        )
        tensors = {key: torch.as_tensor(value)[None].float() for key, value in observation.items()}
        np.testing.assert_allclose(features(tensors)[0].numpy(), plain, rtol=0.0, atol=ROUNDING)
        action = random.uniform(-0.5, 0.5, 2).astype(np.float32)
        observation, *results = goal_env.step(action)
        plain, *plain_results = plain_env.step(action)
        assert results[:3] == plain_results[:3]


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
        for key in KEYS:
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
    env = pickle.loads(pickle.dumps(WaypointGoalEnv(sensor_noise=0.1, mirror=False)))
    assert (env.options.sensor_noise, env.options.mirror) == (0.1, False)


def test_walkers_for_stable_baselines_are_single_ones_bit_for_bit() -> None:
    ours = WalkerVecEnv(3, GOAL_ENV_ID, horizon=6.0)
    theirs = DummyVecEnv([lambda: gym.make(GOAL_ENV_ID, horizon=6.0)] * 3)
    for env in (ours, theirs):
        env.seed(5)
    random = np.random.default_rng(2)
    shown = [(ours.reset(), theirs.reset())]
    for _ in range(12):
        actions = random.uniform(-1.0, 1.0, (3, 2)).astype(np.float32)
        our_step, their_step = ours.step(actions), theirs.step(actions)
        shown.append((our_step[0], their_step[0]))
        assert (our_step[2] == their_step[2]).all()
        for i in np.flatnonzero(our_step[2]):
            last = [step[3][i]["terminal_observation"] for step in (our_step, their_step)]
            assert all((last[0][key] == last[1][key]).all() for key in KEYS)
    for a, b in shown:
        assert all(a[key].dtype == b[key].dtype and (a[key] == b[key]).all() for key in KEYS)


@pytest.mark.parametrize("buffer_class", [HerReplayBuffer, HindsightReplay])
def test_hindsight_relabels_goals_and_rewards_alike(buffer_class: type[HerReplayBuffer]) -> None:
    env = gym.make(GOAL_ENV_ID, horizon=10.0)
    model = SAC(
        "MultiInputPolicy",
        env,
        replay_buffer_class=buffer_class,
        replay_buffer_kwargs={"n_sampled_goal": 4, "goal_selection_strategy": "future"},
        policy_kwargs={"net_arch": [8], "features_extractor_class": GoalFromWalker},
        learning_starts=100,
        batch_size=32,
        buffer_size=1000,
        seed=0,
        device="cpu",
    )
    model.learn(120)
    buffer = model.replay_buffer
    assert isinstance(buffer, buffer_class)
    sample = buffer.sample(500)
    achieved = sample.next_observations["achieved_goal"].numpy()
    desired = sample.next_observations["desired_goal"].numpy()
    rewards = sample.rewards.numpy()[:, 0]
    assert np.array_equal(rewards, WaypointGoalEnv().compute_reward(achieved, desired, {}))
    # goals are at least 8 away and ten units of time walk half of that: only relabelled ones are reached
    assert rewards.sum() > 0.0


def test_relabelled_steps_end_where_their_goal_is_reached_or_the_walker_fell() -> None:
    env = WalkerVecEnv(1, GOAL_ENV_ID)
    buffer = HindsightReplay(15, env.observation_space, env.action_space, env, device="cpu")
    cut, fallen, arrived = 0.0, 1.0, 2.0
    action, steps = np.zeros((1, 2)), 5
    for kind in (cut, fallen, arrived):
        goal = 1.0 if kind == arrived else 9.0
        for step in range(steps):
            ends = step == steps - 1
            buffer.add(
                _on_a_line(kind, step / steps, goal), _on_a_line(kind, (step + 1) / steps, goal),
                action, np.array([float(ends and kind == arrived)]), np.array([ends]),
                [{"TimeLimit.truncated": ends and kind == cut}],
            )  # fmt: skip
    sample = buffer.sample(2000)
    kind = sample.observations["observation"][:, 0].numpy()
    place = sample.next_observations["achieved_goal"][:, 0].numpy()
    goal = sample.next_observations["desired_goal"][:, 0].numpy()
    rewards, ends = sample.rewards[:, 0].numpy(), sample.dones[:, 0].numpy()
    fell = (kind == fallen) & (place == 1.0)
    assert fell.any() and (place[fell] == goal[fell]).any()
    assert (rewards == ((place == goal) & ~fell)).all()
    assert (ends == ((place == goal) | fell)).all()


def _on_a_line(kind: float, place: float, goal: float) -> dict[str, np.ndarray]:
    own = np.zeros((1, 9), dtype=np.float32)
    own[0, 0] = kind
    return {
        "observation": own,
        "achieved_goal": np.array([[place, 0.0]]),
        "desired_goal": np.array([[goal, 0.0]]),
    }
