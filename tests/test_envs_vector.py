"""Many walkers as a vector environment: step for step what Gymnasium's own makes of single ones; threads, copies, workers, bad input."""

from __future__ import annotations

import copy
import math
import multiprocessing
import pickle
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ResetNeeded
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from numpy.typing import NDArray

from lean_yaw_env import WalkerParameters
from lean_yaw_env.envs.info import FallCode
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.envs.walker_env import WalkerEnv

N = 5
MODES = (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP, AutoresetMode.DISABLED)
RESTLESS: dict[str, Any] = {
    "start_disturbance": 3.0,
    "max_offset_change": 0.1,
    "horizon": 12.0,
    "friction_limit": math.inf,
}
"""Some episodes fall within a few steps, the others are truncated after some fifteen."""


def _make(task: str, options: dict[str, Any]) -> WalkerEnv:
    return WalkerEnv(task, **options)


def _pair(task: str, mode: AutoresetMode, **options: Any) -> tuple[WalkerVectorEnv, SyncVectorEnv]:
    functions = [partial(_make, task, options)] * N
    return (
        WalkerVectorEnv(N, task, autoreset_mode=mode, **options),
        SyncVectorEnv(functions, autoreset_mode=mode),
    )


def _differences(ours: Any, theirs: Any, path: str = "") -> list[str]:
    """Where two results are not the same in keys, kinds, shapes or bits."""
    if isinstance(theirs, (tuple, list)):
        if len(ours) != len(theirs):
            return [f"{path}: {len(ours)} and {len(theirs)} long"]
        pairs = [(f"{path}[{k}]", a, b) for k, (a, b) in enumerate(zip(ours, theirs, strict=True))]
    elif isinstance(theirs, dict):
        if ours.keys() != theirs.keys():
            return [f"{path}: only one has {sorted(ours.keys() ^ theirs.keys())}"]
        pairs = [(f"{path}.{key}", ours[key], theirs[key]) for key in theirs]
    elif isinstance(theirs, np.ndarray):
        if ours.dtype != theirs.dtype or ours.shape != theirs.shape:
            return [f"{path}: {ours.dtype}{ours.shape} and {theirs.dtype}{theirs.shape}"]
        if theirs.dtype == object:
            pairs = [
                (f"{path}[{k}]", a, b) for k, (a, b) in enumerate(zip(ours, theirs, strict=True))
            ]
        else:
            return [] if np.array_equal(ours, theirs) else [f"{path}: {ours} and {theirs}"]
    else:
        return (
            [] if type(ours) is type(theirs) and ours == theirs else [f"{path}: {ours}, {theirs}"]
        )
    return [line for name, a, b in pairs for line in _differences(a, b, name)]


def test_the_comparison_sees_every_kind_of_difference() -> None:
    one = (np.zeros(2, np.float32), {"a": np.zeros(2), "b": np.array(["x", None], object)})
    assert _differences(one, one) == []
    for other in (
        (np.zeros(2), one[1]),
        (np.zeros(3, np.float32), one[1]),
        (np.ones(2, np.float32), one[1]),
        (one[0], {"a": np.zeros(2)}),
        (one[0], {"a": np.zeros(2), "b": np.array(["x", "y"], object)}),
        one[:1],
    ):
        assert len(_differences(other, one)) == 1


# --- against Gymnasium's own


@pytest.mark.parametrize("options", [{}, {"mirror": False}], ids=["mirrored", "raw"])
@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.value)
@pytest.mark.parametrize("task", ["Heading", "Walk"])
def test_it_is_gymnasium_s_vector_of_single_walkers_to_the_last_bit(
    task: str, mode: AutoresetMode, options: dict[str, Any]
) -> None:
    ours, theirs = _pair(task, mode, **RESTLESS, **options)
    assert _differences(ours.reset(seed=11), theirs.reset(seed=11)) == []
    rng = np.random.default_rng(1)
    falls = truncations = 0
    for _ in range(120):
        actions = rng.uniform(-1.2, 1.2, (N, 2)).astype(np.float32)
        results = ours.step(actions), theirs.step(actions)
        assert _differences(*results) == []
        terminated, truncated = results[0][2:4]
        falls, truncations = falls + terminated.sum(), truncations + truncated.sum()
        if mode is AutoresetMode.DISABLED and (terminated | truncated).any():
            again = {"reset_mask": terminated | truncated}
            assert _differences(ours.reset(options=dict(again)), theirs.reset(options=again)) == []
    assert falls > 5
    assert truncations > 5


def test_reset_options_and_seeds_by_walker_are_gymnasium_s() -> None:
    ours, theirs = _pair("Heading", AutoresetMode.NEXT_STEP, **RESTLESS)
    options = {"stance": "right", "command": 0.2}
    seeds = [3, 1, 4, 1, 5]
    results = [env.reset(seed=seeds, options=dict(options)) for env in (ours, theirs)]
    assert _differences(*results) == []
    assert (results[0][0][1] == results[0][0][3]).all()  # the same seed twice
    actions = np.zeros((N, 2), np.float32)
    assert _differences(ours.step(actions), theirs.step(actions)) == []
    # without a seed the generators go on
    assert _differences(ours.reset(), theirs.reset()) == []


def test_spaces_are_gymnasium_s() -> None:
    ours, theirs = _pair("Heading", AutoresetMode.NEXT_STEP)
    for name in (
        "observation_space", "action_space", "single_observation_space", "single_action_space"
    ):  # fmt: skip
        assert getattr(ours, name) == getattr(theirs, name)
    assert ours.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert ours.num_envs == N


def test_make_vec_makes_it() -> None:
    env = gym.make_vec("LeanYaw/Walk-v1", num_envs=3, vectorization_mode="vector_entry_point")
    assert isinstance(env.unwrapped, WalkerVectorEnv)
    observations, _ = env.reset(seed=1)
    assert observations.shape == (3, 6)
    wrapped = gym.wrappers.vector.RecordEpisodeStatistics(env)
    wrapped.reset(seed=1)
    for _ in range(3):
        _, rewards, *_ = wrapped.step(np.zeros((3, 2), np.float32))
    assert rewards.dtype == np.float64
    env.close()


# --- options of its own


def _run(**options: Any) -> list[Any]:
    env = WalkerVectorEnv(64, "Heading", **RESTLESS, **options)
    rng = np.random.default_rng(2)
    seen: list[Any] = [env.reset(seed=0)]
    for _ in range(30):
        seen.append(env.step(rng.uniform(-1, 1, (64, 2)).astype(np.float32)))
    env.close()
    return seen


@pytest.mark.parametrize("mode", ["next_step", "same_step"])
def test_threads_change_no_bit(mode: str) -> None:
    assert (
        _differences(_run(threads=3, autoreset_mode=_mode(mode)), _run(autoreset_mode=_mode(mode)))
        == []
    )


def _mode(name: str) -> AutoresetMode:
    return {"next_step": AutoresetMode.NEXT_STEP, "same_step": AutoresetMode.SAME_STEP}[name]


@pytest.mark.parametrize("mode", ["next_step", "same_step"])
def test_without_step_info_only_the_infos_are_missing(mode: str) -> None:
    with_info = _run(autoreset_mode=_mode(mode))
    without = _run(autoreset_mode=_mode(mode), step_info=False)
    assert without[0][1] == {}  # neither at resets
    for full, short in zip(with_info[1:], without[1:], strict=True):
        assert _differences(short[:4], full[:4]) == []
        final = {key: full[4][key] for key in full[4] if "final_obs" in key}
        assert _differences(short[4], final) == []


def test_the_info_of_an_ended_episode_has_the_keys_of_any_other() -> None:
    seen = _run(autoreset_mode=AutoresetMode.SAME_STEP)
    keys = set(seen[0][1])
    finals = [info for *_, info in seen[1:] if "final_info" in info]
    assert len(finals) > 5
    for info in finals:
        mask = info["_final_info"]
        assert set(info) == keys | {"final_obs", "_final_obs", "final_info", "_final_info"}
        assert set(info["final_info"]) == keys
        assert (info["final_info"]["steps"][mask] > 0).all()
        assert (info["steps"][mask] == 0).all()


def test_infos_that_someone_keeps_are_not_overwritten() -> None:
    env = WalkerVectorEnv(8, "Heading")
    env.reset(seed=1)
    actions = np.zeros((8, 2), np.float32)
    times, slices, whole = [], [], []
    for _ in range(20):
        *_, info = env.step(actions)
        times.append(info["time"])  # an array of it
        slices.append(info["state"][2:, 1])  # a view of one
        whole.append(info)
        del info
    expected = np.cumsum([info["duration"] for info in whole], axis=0)
    assert np.allclose(times, expected, rtol=0.0, atol=1e-12)
    assert len({part.tobytes() for part in slices}) == 20
    assert [float(info["steps"][0]) for info in whole] == list(range(1, 21))


def test_a_solver_s_failure_ends_one_walker_s_episode_and_changes_no_other() -> None:
    env, untouched = (WalkerVectorEnv(N, "Heading", **RESTLESS) for _ in range(2))
    for each in (env, untouched):
        each.reset(seed=4)
    rng = np.random.default_rng(0)
    others = np.arange(N) != 2
    for step in range(20):
        actions = rng.uniform(-1, 1, (N, 2)).astype(np.float32)
        if step == 1:
            # no valid state makes the solver fail: a record that is not a number does
            env.simulation.walkers["stance_pitch_rate"][2] = np.nan
        ours, theirs = env.step(actions), untouched.step(actions)
        if step == 1:
            assert (ours[1][2], ours[2][2], ours[3][2]) == (0.0, True, False)
            assert ours[4]["fall"][2] == FallCode.SOLVER
        for a, b in zip(ours[:4], theirs[:4], strict=True):
            assert (a[others] == b[others]).all()
        for key in ours[4]:
            assert (ours[4][key][others] == theirs[4][key][others]).all()
    assert env.simulation.solver_failures == 1
    assert np.isfinite(ours[0]).all()  # it has begun another episode


@pytest.mark.parametrize("mode", ["next_step", "same_step"])
@pytest.mark.parametrize("how", ["deepcopy", "pickle", "set_state", "another's set_state"])
def test_copied_episodes_go_on_bit_for_bit(how: str, mode: str) -> None:
    options = {**RESTLESS, "sensor_noise": 0.1, "random_body": "training", "push_level": 0.2}
    env = WalkerVectorEnv(16, "Slalom", autoreset_mode=_mode(mode), **options)
    env.reset(seed=5)
    actions = np.random.default_rng(1).uniform(-0.5, 0.5, (103, 16, 2)).astype(np.float32)
    for action in actions[:3]:
        env.step(action)
    state, other = env.get_state(), env
    if how == "another's set_state":
        other = WalkerVectorEnv(16, "Slalom", autoreset_mode=_mode(mode), **options)
    elif how != "set_state":
        ways = {"deepcopy": copy.deepcopy}
        other = ways.get(how, lambda each: pickle.loads(pickle.dumps(each)))(env)
    expected = [env.step(action) for action in actions[3:]]
    if "set_state" in how:
        other.set_state(state)
    assert _differences([other.step(action) for action in actions[3:]], expected) == []


def test_steps_are_limited_as_gymnasium_limits_them() -> None:
    ours = gym.make_vec("LeanYaw/Walk-v1", num_envs=2, max_episode_steps=5)
    theirs = SyncVectorEnv([lambda: gym.make("LeanYaw/Walk-v1", max_episode_steps=5)] * 2)
    assert _differences(ours.reset(seed=1), theirs.reset(seed=1)) == []
    actions = np.zeros((2, 2), np.float32)
    for _ in range(12):
        assert _differences(ours.step(actions), theirs.step(actions)) == []
    with pytest.raises(ValueError, match="max_episode_steps must be from 1"):
        gym.make_vec("LeanYaw/Walk-v1", num_envs=2, max_episode_steps=0)


@pytest.mark.parametrize("env_id", ["LeanYaw/Walk-v1", "LeanYaw/WaypointGoal-v1"])
def test_a_spec_carries_the_largest_number_of_steps_and_makes_the_same_again(env_id: str) -> None:
    assert gym.spec(env_id).max_episode_steps is None
    env = gym.make_vec(env_id, num_envs=2, max_episode_steps=5)
    assert env.spec is not None and env.spec.max_episode_steps == 5
    for spec in (env.spec, EnvSpec.from_json(env.spec.to_json())):
        again = gym.make_vec(spec)
        assert again.num_envs == 2
        assert again.spec is not None and again.spec.max_episode_steps == 5
        again.reset(seed=1)
        ends = [again.step(np.zeros((2, 2), np.float32))[3].tolist() for _ in range(5)]
        assert ends == [[False, False]] * 4 + [[True, True]]
    assert gym.make_vec(env_id, num_envs=2).spec.max_episode_steps is None  # type: ignore[union-attr]


def test_observations_are_fresh_unless_asked_not_to_be() -> None:
    actions = np.zeros((4, 2), np.float32)
    env = WalkerVectorEnv(4, "Walk")
    first, _ = env.reset(seed=1)
    kept = first.copy()
    results = env.step(actions)
    assert (first == kept).all()
    copies = [np.copy(part) for part in results[:4]]
    env.step(actions)
    assert all(np.array_equal(a, b) for a, b in zip(results[:4], copies, strict=True))
    lean = WalkerVectorEnv(4, "Walk", copy=False)
    first, _ = lean.reset(seed=1)
    second, rewards, terminated, _, info = lean.step(actions)
    assert second is first
    kept_rewards, kept_state = rewards.copy(), info["state"].copy()
    third, more_rewards, _, _, _ = lean.step(actions)
    assert third is first
    assert more_rewards is not rewards
    assert (rewards == kept_rewards).all()
    assert (info["state"] == kept_state).all()
    assert terminated.dtype == np.bool_


def test_a_walker_s_episode_does_not_depend_on_how_many_walk_beside_it() -> None:
    many, few = (
        WalkerVectorEnv(130, "Heading", **RESTLESS),
        WalkerVectorEnv(3, "Heading", **RESTLESS),
    )
    actions = np.random.default_rng(3).uniform(-1, 1, (20, 130, 2)).astype(np.float32)
    assert (many.reset(seed=5)[0][:3] == few.reset(seed=5)[0]).all()
    for action in actions:
        ours, theirs = many.step(action), few.step(action[:3])
        for a, b in zip(ours[:4], theirs[:4], strict=True):
            assert np.array_equal(a[:3], b)


def test_pickling_keeps_the_options() -> None:
    env = WalkerVectorEnv(3, "Walk", parameters=WalkerParameters(slope=0.02), copy=False)
    env.reset(seed=1)
    restored = pickle.loads(pickle.dumps(env))
    assert restored.options == env.options
    assert (restored.num_envs, restored.copy) == (3, False)
    assert (restored.reset(seed=1)[0] == env.reset(seed=1)[0]).all()


@pytest.mark.parametrize("context", ["fork", "spawn"])
def test_single_walkers_work_in_worker_processes(context: str) -> None:
    functions: list[Callable[[], WalkerEnv]] = [partial(_make, "Heading", RESTLESS)] * 2
    # the parent has stepped already, with threads too: a forked child must not wait for them
    parent = WalkerVectorEnv(600, "Heading", threads=2)
    parent.reset(seed=1)
    parent.step(np.zeros((600, 2), np.float32))
    workers = AsyncVectorEnv(functions, context=context)
    ours = WalkerVectorEnv(2, "Heading", **RESTLESS)
    try:
        assert _differences(ours.reset(seed=2), workers.reset(seed=2)) == []
        rng = np.random.default_rng(4)
        for _ in range(10):
            actions = rng.uniform(-1, 1, (2, 2)).astype(np.float32)
            assert _differences(ours.step(actions), workers.step(actions)) == []
    finally:
        workers.close(terminate=True)


def _step_threads() -> NDArray[np.float32]:
    env = WalkerVectorEnv(600, "Walk", threads=2)
    env.reset(seed=1)
    return env.step(np.zeros((600, 2), np.float32))[0]


def test_a_threaded_batch_works_in_a_forked_child() -> None:
    expected = _step_threads()
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert (pool.apply_async(_step_threads).get(timeout=60) == expected).all()


# --- bad input


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"num_envs": 0}, "num_envs must be from 1 to 10000000, got 0"),
        ({"threads": 0}, "threads must be from 1 to 1024, got 0"),
        ({"render_mode": "human"}, "render_mode must be one of rgb_array, got 'human'"),
        ({"autoreset_mode": "never"}, "autoreset_mode must be one of .*, got 'never'"),
        ({"task": "Swim"}, "task must be one of"),
        ({"mirror": 1}, "mirror must be True or False, got 1"),
    ],
)
def test_a_bad_option_is_refused_by_name(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        WalkerVectorEnv(**options)


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        (np.zeros((3, 2)), r"actions must have shape \(4, 2\), got \(3, 2\)"),
        (np.zeros((4, 3)), r"actions must have shape \(4, 2\), got \(4, 3\)"),
        (np.zeros(8), r"got \(8,\)"),
        (np.full((4, 2), np.nan), r"actions must be numbers in \[-1, 1\], got \[nan, nan\]"),
    ],
)
def test_bad_actions_are_refused_and_change_nothing(actions: Any, message: str) -> None:
    env, untouched = (WalkerVectorEnv(4, "Heading") for _ in range(2))
    env.reset(seed=1)
    untouched.reset(seed=1)
    with pytest.raises(ValueError, match=message):
        env.step(actions)
    good = np.zeros((4, 2), np.float32)
    assert _differences(env.step(good), untouched.step(good)) == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"seed": [1, 2]}, "seed must be one number or 4 of them, got 2"),
        (
            {"options": {"reset_mask": [True] * 4}},
            r"reset_mask must be a bool array of shape \(4,\)",
        ),
        ({"options": {"reset_mask": np.ones(3, bool)}}, "reset_mask must be a bool array"),
        ({"options": {"reset_mask": np.zeros(4, bool)}}, "true for at least one walker"),
        ({"options": {"speed": 1}}, "reset option 'speed' is not one of"),
    ],
)
def test_a_bad_reset_is_refused_and_changes_nothing(
    arguments: dict[str, Any], message: str
) -> None:
    env, untouched = (WalkerVectorEnv(4, "Heading") for _ in range(2))
    env.reset(seed=1)
    untouched.reset(seed=1)
    with pytest.raises(ValueError, match=message):
        env.reset(**arguments)
    good = np.zeros((4, 2), np.float32)
    assert _differences(env.step(good), untouched.step(good)) == []
    assert _differences(env.reset(), untouched.reset()) == []


def test_stepping_what_is_not_reset_is_refused() -> None:
    actions = np.zeros((4, 2), np.float32)
    with pytest.raises(ResetNeeded, match="call reset"):
        WalkerVectorEnv(4, "Walk").step(actions)
    env = WalkerVectorEnv(4, "Walk", autoreset_mode=AutoresetMode.DISABLED, horizon=1.0)
    env.reset(seed=1)
    while not env.step(actions)[3].any():
        pass
    with pytest.raises(ResetNeeded, match=r"walkers \[.*\] have ended"):
        env.step(actions)


# --- pictures


def test_pictures_of_many_walkers_are_those_of_single_ones_in_small() -> None:
    env = WalkerVectorEnv(3, "Waypoint", render_mode="rgb_array", horizon=3.0)
    with pytest.raises(ResetNeeded, match="reset"):
        env.render()
    env.reset(seed=1)
    frames = []
    for _ in range(8):  # over an end and a start
        env.step(np.zeros((3, 2), np.float32))
        rendered = env.render()
        assert rendered is not None
        frames.append(rendered)
    assert all(frame.shape == (360, 480, 3) for frame in frames[0])
    assert all(frame.dtype == np.uint8 for frame in frames[0])
    assert all((frame != other).any() for frame, other in zip(frames[0], frames[1], strict=True))
    assert (frames[0][0] != frames[0][1]).any()


def test_gymnasium_records_a_video_of_many_walkers(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the encoder's own
        env = gym.wrappers.vector.RecordVideo(
            gym.make_vec("LeanYaw/Heading-v1", num_envs=4, render_mode="rgb_array"),
            str(tmp_path),
            video_length=3,
        )
        env.reset(seed=1)
        for _ in range(4):
            env.step(np.zeros((4, 2), np.float32))
        env.close()
    (video,) = tmp_path.glob("*.mp4")
    assert video.stat().st_size > 5_000


def test_too_many_walkers_to_draw_are_refused() -> None:
    with pytest.raises(
        ValueError, match="num_envs with a render_mode must be from 1 to 64, got 65"
    ):
        WalkerVectorEnv(65, render_mode="rgb_array")
    env = WalkerVectorEnv(2)
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="make the environment with a render_mode"):
        assert env.render() is None


# --- Gymnasium's wrappers


def test_tensors_share_the_arrays_memory() -> None:
    env = gym.wrappers.vector.NumpyToTorch(gym.make_vec("LeanYaw/Metastable-v1", num_envs=4))
    observations, info = env.reset(seed=1)
    assert observations.dtype == torch.float32
    for _ in range(20):
        observations, rewards, terminated, _, info = env.step(torch.zeros((4, 2)))
    assert info["fall"].dtype == torch.int64
    assert info["state"].shape == (4, 5)
    assert rewards.dtype == torch.float64
    assert terminated.dtype == torch.bool
    lean = gym.wrappers.vector.NumpyToTorch(
        gym.make_vec("LeanYaw/Metastable-v1", num_envs=4, copy=False, step_info=False)
    )
    observations, _ = lean.reset(seed=1)
    own = lean.unwrapped
    assert isinstance(own, WalkerVectorEnv)
    assert observations.data_ptr() == own.simulation.observations.ctypes.data


def test_arguments_for_other_vector_environments_are_refused_by_gymnasium_with_the_way_to_write_them() -> (
    None
):
    with pytest.raises(gym.error.Error, match="only through kwargs"):
        gym.make_vec("LeanYaw/Walk-v1", num_envs=2, vector_kwargs={"copy": False})
    made = gym.make_vec("LeanYaw/Walk-v1", num_envs=2, copy=False).unwrapped
    assert isinstance(made, WalkerVectorEnv)
    assert made.copy is False
