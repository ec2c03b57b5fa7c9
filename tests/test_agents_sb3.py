"""The Stable-Baselines3 adapter: it is a ``DummyVecEnv`` of single environments, only faster."""

from __future__ import annotations

import numpy as np
import pytest
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

from lean_yaw_env.envs.info import FallCode
from lean_yaw_env.envs.sb3 import WalkerVecEnv
from lean_yaw_env.envs.walker_env import WalkerEnv

WALKERS = 3
HORIZON = 8.0  # simulated time: some eleven steps, so that episodes end often


def single_environments(task: str = "Heading", **options) -> DummyVecEnv:
    return DummyVecEnv([lambda: Monitor(WalkerEnv(task, **options)) for _ in range(WALKERS)])


def random_actions(seed: int, steps: int) -> np.ndarray:
    # beyond +-1, as a Gaussian policy's are
    return np.random.default_rng(seed).normal(0.0, 1.0, (steps, WALKERS, 2)).astype(np.float32)


def same(one: object, other: object) -> bool:
    if isinstance(one, np.ndarray):
        return np.array_equal(one, np.asarray(other))
    return one == other


def without_clock(info: dict) -> dict:
    """An info without its wall-clock time, and with the return as ``Monitor`` rounds it."""
    info = dict(info)
    if "episode" in info:
        info["episode"] = (round(info["episode"]["r"], 6), info["episode"]["l"])
    return info


def test_adapter_is_a_dummy_vec_env_of_single_environments_bit_for_bit():
    ours: VecEnv = WalkerVecEnv(WALKERS, "Heading", horizon=HORIZON, step_info=True)
    theirs: VecEnv = single_environments(horizon=HORIZON)
    assert ours.seed(5) == theirs.seed(5)
    assert np.array_equal(ours.reset(), theirs.reset())
    for mine, its in zip(ours.reset_infos, theirs.reset_infos, strict=True):
        assert set(mine) == set(its)
        assert all(same(mine[key], its[key]) for key in mine)
    ended = 0
    for actions in random_actions(0, 60):
        # DummyVecEnv's own arrays are reused, so compare before the next step
        mine, its = ours.step(actions), theirs.step(actions)
        for a, b in zip(mine[:3], its[:3], strict=True):
            assert a.dtype == b.dtype
            assert np.array_equal(a, b)
        for a, b in zip(mine[3], its[3], strict=True):
            a, b = without_clock(a), without_clock(b)
            assert set(a) == set(b)
            assert all(same(a[key], b[key]) for key in a)
        ended += int(mine[2].sum())
    assert ended > WALKERS  # the comparison saw ends and restarts


def test_walkers_that_go_on_share_cheap_infos_and_those_that_end_tell_all():
    env = WalkerVecEnv(WALKERS, "Heading", horizon=HORIZON)
    env.seed(1)
    env.reset()
    for actions in random_actions(1, 30):
        _, _, dones, infos = env.step(actions)
        for done, info in zip(dones, infos, strict=True):
            assert ("terminal_observation" in info) == done
            assert ("episode" in info) == done
            if not done:
                assert info == {"TimeLimit.truncated": False}


def test_only_the_horizon_counts_as_truncation():
    env = WalkerVecEnv(64, "Heading", horizon=30.0, max_offset_change=0.1)
    env.seed(0)
    env.reset()
    generator = np.random.default_rng(0)
    fell = survived = 0
    for _ in range(60):
        actions = generator.uniform(-1.0, 1.0, (64, 2)).astype(np.float32)
        _, _, dones, infos = env.step(actions)
        for i in np.flatnonzero(dones):
            info = infos[i]
            assert info["TimeLimit.truncated"] == (info["fall"] == FallCode.NONE)
            assert info["episode"]["l"] == info["steps"]
            fell += info["fall"] != FallCode.NONE
            survived += info["fall"] == FallCode.NONE
    assert fell > 0
    assert survived > 0


def test_step_durations_sum_to_the_simulated_time():
    env = WalkerVecEnv(WALKERS, "Heading", horizon=100.0, step_info=True)
    env.seed(0)
    env.reset()
    total = np.zeros(WALKERS)
    for _ in range(5):
        _, _, dones, infos = env.step(np.zeros((WALKERS, 2), dtype=np.float32))
        assert not dones.any()
        total += env.step_durations()
    # the same sums in the same order
    assert total.tolist() == [info["time"] for info in infos]


def test_a_restored_snapshot_goes_on_as_if_nothing_had_happened():
    first = WalkerVecEnv(WALKERS, "Heading", horizon=HORIZON)
    first.seed(2)
    first.reset()
    actions = random_actions(2, 40)
    for k in range(15):
        first.step(actions[k])
    snapshot = first.snapshot()
    second = WalkerVecEnv(WALKERS, "Heading", horizon=HORIZON)
    second.reset()
    second.restore(snapshot)
    for k in range(15, 40):  # through ends and restarts, which draw
        ours, theirs = first.step(actions[k]), second.step(actions[k])
        assert all(np.array_equal(a, b) for a, b in zip(ours[:3], theirs[:3], strict=True))


def test_a_snapshot_of_other_walkers_is_refused_and_changes_nothing():
    env, other = WalkerVecEnv(WALKERS, "Heading"), WalkerVecEnv(WALKERS + 1, "Heading")
    env.reset()
    other.reset()
    before = env.snapshot()
    with pytest.raises(ValueError, match="snapshot must hold"):
        env.restore(other.snapshot())
    after = env.snapshot()
    assert all(np.array_equal(before[name], after[name]) for name in before)


def test_reset_options_hold_for_each_walker_and_only_once():
    env = WalkerVecEnv(WALKERS, "Heading")
    env.seed(0)
    env.set_options([{"command": 0.1}, {"command": 0.2}, {}])
    env.reset()
    commands = [info["commanded_heading"] for info in env.reset_infos]
    assert commands[:2] == [0.1, 0.2]
    env.seed(0)
    env.set_options({"stance": "right"})
    env.reset()
    assert [info["stance_side"] for info in env.reset_infos] == [-1.0] * WALKERS
    env.seed(0)
    env.reset()
    assert env.reset_infos[0]["commanded_heading"] != 0.1
    assert env.reset_infos[2]["commanded_heading"] == commands[2]


def test_attributes_and_methods_are_the_common_environment_s():
    env = WalkerVecEnv(WALKERS, "Heading")
    assert env.get_attr("num_envs", indices=[0, 1]) == [WALKERS, WALKERS]
    env.set_attr("copy", False)
    assert env.get_attr("copy") == [False] * WALKERS
    assert len(env.env_method("reset", seed=3, indices=0)) == 1
    assert env.env_is_wrapped(Monitor) == [False] * WALKERS
    assert not env.has_attr("no_such_thing")
    with pytest.raises(ValueError, match="all 3 walkers"):
        env.set_attr("copy", True, indices=[0])


def test_stepping_without_actions_is_refused():
    env = WalkerVecEnv(WALKERS, "Heading")
    env.reset()
    with pytest.raises(RuntimeError, match="step_async"):
        env.step_wait()
    with pytest.raises(ValueError, match=r"shape \(3, 2\)"):
        env.step(np.zeros((WALKERS, 3), dtype=np.float32))


def test_it_draws_a_grid_of_walkers() -> None:
    env = WalkerVecEnv(4, "LeanYaw/Heading-v1", render_mode="rgb_array")
    env.seed(1)
    env.reset()
    env.step(np.zeros((4, 2), np.float32))
    picture = env.render()
    assert picture is not None
    assert picture.shape == (720, 960, 3)
    # the four look different
    parts = {picture[y : y + 360, x : x + 480].tobytes() for y in (0, 360) for x in (0, 480)}
    assert len(parts) == 4
