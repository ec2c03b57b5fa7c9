"""The single environment: Gymnasium's and Stable-Baselines3's contracts, physics in `info`, options, resets, pictures, bad input."""

from __future__ import annotations

import copy
import json
import math
import os
import pickle
import subprocess
import sys
import warnings
from itertools import pairwise
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import RecordVideo
from stable_baselines3.common.env_checker import check_env as check_env_of_sb3

from lean_yaw_env import NoGaitError, Walker, WalkerParameters
from lean_yaw_env.envs import RealTime
from lean_yaw_env.envs.info import FallCode
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.parameters import MIRROR, Vector
from lean_yaw_env.registration import TASK_VERSIONS

ZERO = np.zeros(2, np.float32)
OPTIONS: dict[str, dict[str, Any]] = {
    "defaults": {},
    "unmirrored": {"mirror": False},
    "another walker": {"parameters": WalkerParameters(hip_width=0.2, slope=0.03)},
    "no disturbance": {"start_disturbance": 0.0, "horizon": 5.0},
    "wild": {"start_disturbance": 5.0, "max_offset_change": 2.0, "mass_offset_range": 0.3},
    "turning slope": {"parameters": WalkerParameters(slope_turns=True)},
}


def _episode(env: gym.Env[Any, Any], seed: int, steps: int = 60) -> list[Any]:
    """Everything an episode of random actions returns."""
    rng = np.random.default_rng(seed)
    seen: list[Any] = [env.reset(seed=seed)]
    for _ in range(steps):
        seen.append(env.step(rng.uniform(-1.0, 1.0, 2).astype(np.float32)))
        if seen[-1][2] or seen[-1][3]:
            break
    return seen


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(_same(a[k], b[k]) for k in a)
    if isinstance(a, (tuple, list)):
        return len(a) == len(b) and all(_same(x, y) for x, y in zip(a, b, strict=True))
    return type(a) is type(b) and bool(np.array_equal(a, b))


# --- the contract


@pytest.mark.parametrize("task", ["Heading", "Walk"])
@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
def test_checkers_are_silent(task: str, options: dict[str, Any]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gym.make(f"LeanYaw/{task}-v1", disable_env_checker=True, **options).unwrapped
        check_env(env, skip_render_check=True)
        check_env_of_sb3(env)


def test_checkers_are_silent_with_pictures() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gym.make("LeanYaw/Heading-v1", render_mode="rgb_array", disable_env_checker=True)
        check_env(env.unwrapped, skip_render_check=True)


def test_make_s_own_wrappers_find_nothing_to_warn_of() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gym.make("LeanYaw/Walk-v1")
        env.reset(seed=1)
        env.step(env.action_space.sample())
        env.close()


@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
def test_an_episode_repeats_bit_for_bit_with_its_seed(options: dict[str, Any]) -> None:
    first, second = (WalkerEnv("Heading", **options) for _ in range(2))
    assert _same(_episode(first, 3), _episode(second, 3))
    assert _same(_episode(first, 3), _episode(second, 3))  # and again, on used environments
    assert not _same(_episode(first, 3), _episode(second, 4))


def test_a_reset_without_seed_goes_on_with_the_generator() -> None:
    env, other = WalkerEnv("Heading"), WalkerEnv("Heading")
    starts = []
    for each in (env, other):
        each.reset(seed=8)
        starts.append([each.reset()[0] for _ in range(3)])
    assert _same(starts[0], starts[1])
    assert not _same(starts[0][0], starts[0][1])


def test_pickling_keeps_the_options() -> None:
    env = WalkerEnv("Heading", mirror=False, horizon=30.0)
    restored = pickle.loads(pickle.dumps(env))
    assert restored.options == env.options
    with pytest.raises(ResetNeeded):
        restored.step(ZERO)
    assert _same(_episode(restored, 2), _episode(env, 2))


HARD: dict[str, Any] = {
    "sensor_noise": 0.1, "action_delay": True, "random_body": "training", "push_level": 0.05
}  # fmt: skip


def _walk(env: gym.Env[Any, Any], steps: int = 100) -> list[Any]:
    """All that the next steps return, over ends and resets."""
    rng = np.random.default_rng(8)
    seen: list[Any] = []
    for _ in range(steps):
        seen.append(env.step(rng.uniform(-0.3, 0.3, 2).astype(np.float32)))
        if seen[-1][2] or seen[-1][3]:
            seen.append(env.reset())
    return seen


def test_a_made_environment_is_copied_with_its_wrappers_and_its_spec() -> None:
    env = gym.make("LeanYaw/Heading-v1", max_episode_steps=10)
    env.reset(seed=1)
    env.step(ZERO)
    for other in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        assert other.spec == env.spec
        assert other.unwrapped.spec == env.unwrapped.spec is not None
        assert _same(_walk(other, 20), _walk(copy.deepcopy(env), 20))


@pytest.mark.parametrize("how", ["copy", "deepcopy", "pickle", "set_state", "another's set_state"])
@pytest.mark.parametrize("task", TASK_VERSIONS)
def test_a_copied_episode_goes_on_bit_for_bit(task: str, how: str) -> None:
    env = WalkerEnv(task, horizon=30.0, **HARD)
    env.reset(seed=5)
    for _ in range(3):
        env.step(ZERO)
    if how == "set_state":
        state = env.get_state()
        expected = _walk(env)
        env.set_state(state)
        assert _same(_walk(env), expected)
        return
    if how == "another's set_state":
        other = WalkerEnv(task, horizon=30.0, **HARD)
        other.set_state(env.get_state())
    else:
        ways = {"copy": copy.copy, "deepcopy": copy.deepcopy}
        other = ways.get(how, lambda each: pickle.loads(pickle.dumps(each)))(env)
    expected = _walk(env)  # a copy shares nothing
    assert _same(_walk(other), expected)


def test_a_state_of_another_environment_is_refused_and_changes_nothing() -> None:
    env, untouched = WalkerEnv("Heading"), WalkerEnv("Heading")
    for each in (env, untouched):
        each.reset(seed=1)
    other = WalkerEnv("Walk")
    other.reset(seed=1)
    bad = env.get_state()
    bad["walkers"]["stance_pitch"] = np.nan
    with pytest.raises(ValueError, match=r"finite numbers, got walkers\['stance_pitch'\]"):
        env.set_state(bad)
    with pytest.raises(ValueError, match="state must hold 'tasks'"):
        env.set_state(other.get_state())
    with pytest.raises(ValueError, match="state must hold 'generators'"):
        env.set_state({k: v for k, v in env.get_state().items() if k != "generators"})
    assert _same(env.step(ZERO), untouched.step(ZERO))
    with pytest.raises(ResetNeeded):
        WalkerEnv("Walk").get_state()


def test_observations_stay_in_their_box_whatever_happens() -> None:
    env = WalkerEnv("Heading", start_disturbance=5.0, mass_offset_range=1.0, max_offset_change=2.0)
    for seed in range(40):
        for observation, *_ in _episode(env, seed, 10):
            assert observation.dtype == np.float32
            assert env.observation_space.contains(observation)


def test_what_a_step_returns_is_not_overwritten_by_the_next() -> None:
    env = WalkerEnv("Heading")
    observation, info = env.reset(seed=1)
    kept = observation.copy(), copy.deepcopy(info)
    after, _, _, _, later = env.step(ZERO)
    kept_later = after.copy(), copy.deepcopy(later)
    env.step(ZERO)
    assert _same((observation, info), kept)
    assert _same((after, later), kept_later)


# --- physics


@pytest.mark.parametrize("mirror", [True, False])
def test_a_step_is_the_walker_s_own(mirror: bool) -> None:
    env = WalkerEnv("Walk", mirror=mirror, max_offset_change=0.01, start_disturbance=0.5)
    rng = np.random.default_rng(2)
    _, info = env.reset(seed=3)
    for _ in range(20):
        action = rng.uniform(-0.5, 0.5, 2).astype(np.float32)
        state, side, before = info["state"], info["stance_side"], info["mass_offset"]
        place = info["footprint"]
        sign = side if mirror else 1.0
        wanted = sign * 0.05 * float(action[1])
        commanded = min(max(wanted, before - 0.01), before + 0.01)
        _, _, terminated, _, info = env.step(action)
        result = Walker().step(
            state,
            stance="left" if side > 0 else "right",
            inter_leg_angle=0.3 + 0.15 * float(action[0]),
            mass_offset=commanded,
            previous_offset=before,
        )
        assert not terminated
        assert (info["state"] == result.state).all()
        assert info["stance_side"] == -side
        assert info["commanded_offset"] == commanded
        assert info["mass_offset"] == result.mass_offset
        assert info["inter_leg_angle"] == 0.3 + 0.15 * float(action[0])
        assert info["duration"] == result.duration
        assert (info["footprint"] == place + result.displacement).all()
        ledger = [info[k] for k in ("gravity_work", "shift_work", "impact_loss", "ankle_loss")]
        assert ledger == list(result.energy)
        assert info["least_normal_force"] == result.least_normal_force
        assert info["greatest_friction"] == result.greatest_friction


_WITHOUT_COMPILER = """
import json, warnings
import gymnasium as gym, numpy as np
import lean_yaw_env
warnings.simplefilter("ignore")  # of numbers that are meant to overflow
env = gym.make("LeanYaw/Slalom-v1", sensor_noise=0.1)
seen = [env.reset(seed=1)[0]] + [env.step(np.array([0.1, 0.2], np.float32))[0] for _ in range(3)]
print(json.dumps([list(map(float, each)) for each in seen]))
"""


def test_plain_python_gives_the_compiled_environment_s_numbers() -> None:
    def run(**variables: str) -> Any:
        done = subprocess.run(
            [sys.executable, "-c", _WITHOUT_COMPILER],
            env={**os.environ, **variables},
            cwd=Path(__file__).parents[1],
            capture_output=True,
            text=True,
            check=True,
        )
        return json.loads(done.stdout)

    # single precision: products and sums are not fused there
    np.testing.assert_allclose(run(NUMBA_DISABLE_JIT="1"), run(), rtol=0.0, atol=1e-5)


def test_zero_action_is_the_paper_s_fixed_controller(gait: Vector) -> None:
    env = WalkerEnv("Walk", start_disturbance=0.0)
    env.reset(seed=0, options={"state": gait, "stance": "left"})
    walk = Walker().walk(30, state=gait)
    for k in range(30):
        *_, info = env.step(ZERO)
        assert (info["state"] == walk.states[k + 1]).all()
    assert info["speed"] == pytest.approx(0.41567, abs=1e-5)
    assert info["distance"] == pytest.approx(30 * 0.29803, abs=1e-3)
    assert info["steps"] == 30
    assert info["time"] == pytest.approx(walk.durations.sum(), abs=1e-12)


def test_actions_out_of_range_are_clipped() -> None:
    ends = []
    for action in ([9.0, -7.0], [1.0, -1.0]):
        env = WalkerEnv("Walk", start_disturbance=0.0)
        env.reset(seed=1)
        ends.append(env.step(np.array(action, np.float32)))
    assert _same(ends[0], ends[1])
    assert ends[0][4]["inter_leg_angle"] == pytest.approx(0.45, abs=1e-15)


def test_the_offset_moves_by_no_more_than_its_largest_change() -> None:
    env = WalkerEnv("Walk", start_disturbance=0.0, mirror=False)
    _, info = env.reset(seed=1)
    offsets = [info["mass_offset"]]
    for _ in range(14):
        *_, info = env.step([0.0, 1.0])
        offsets.append(info["mass_offset"])
    assert np.diff(offsets)[:9] == pytest.approx(0.005, abs=1e-15)
    assert offsets[-1] == pytest.approx(0.05, abs=1e-15)


@pytest.mark.parametrize("seed", range(4))
def test_a_mirrored_world_is_observed_and_rewarded_alike(seed: int) -> None:
    env, mirrored = WalkerEnv("Heading"), WalkerEnv("Heading")
    _, info = env.reset(seed=seed)
    start = info["state"]
    first, _ = env.reset(seed=seed, options={"state": start, "stance": "left", "command": 0.4})
    second, _ = mirrored.reset(
        seed=seed, options={"state": start * MIRROR, "stance": "right", "command": -0.4}
    )
    assert _same(first, second)
    rng = np.random.default_rng(seed)
    for _ in range(30):
        action = rng.uniform(-1, 1, 2).astype(np.float32)
        one, other = env.step(action), mirrored.step(action)
        assert _same(one[:4], other[:4])
        assert (one[4]["state"] == other[4]["state"] * MIRROR).all()
        if one[2]:
            break


def test_the_raw_observation_is_the_documented_table() -> None:
    env = WalkerEnv("Heading", mirror=False)
    observation, info = env.reset(seed=7, options={"command": 0.3})
    for _ in range(4):
        previous = info["state"][0]
        observation, _, _, _, info = env.step([0.2, 0.7])
    centres, scales = [0.0, 0.155, 0.0, -0.42, 0.0], [0.6, 0.03, 0.05, 0.1, 0.1]
    error = 0.3 - 0.5 * (info["state"][0] + previous)
    expected = [
        *(info["state"] - centres) / scales,
        info["mass_offset"] / 0.05,
        info["stance_side"],
        error / 0.6,
    ]
    # single precision
    assert observation == pytest.approx(expected, abs=1e-5)


# --- ends


def test_a_fall_terminates_names_itself_and_needs_a_reset(gait: Vector) -> None:
    env = WalkerEnv("Heading")
    env.reset(seed=1, options={"state": gait * [1, 3, 1, 1, 1], "stance": "left"})
    falls, info = [], {}
    for _ in range(5):
        _, reward, terminated, truncated, info = env.step(ZERO)
        falls.append(info["fall"])
        if terminated:
            break
    assert falls == [FallCode.NONE, FallCode.NONE, FallCode.TRIP]
    assert (reward, truncated) == (0.0, False)
    with pytest.raises(ResetNeeded, match="call reset"):
        env.step(ZERO)
    _, info = env.reset()
    assert info["fall"] == FallCode.NONE


def test_the_horizon_of_simulated_time_truncates() -> None:
    env = WalkerEnv("Walk", horizon=3.0, start_disturbance=0.0)
    env.reset(seed=1)
    ends = [env.step(ZERO)[2:4] for _ in range(5)]
    assert ends == [(False, False)] * 4 + [(False, True)]  # steps of 0.717
    with pytest.raises(ResetNeeded):
        env.step(ZERO)


def test_rewards_are_rates_times_the_step_s_duration() -> None:
    env = WalkerEnv("Walk", start_disturbance=0.0)
    env.reset(seed=1)
    for action in ([0.0, 0.0], [1.0, 0.0], [-1.0, 0.5]):
        _, reward, _, _, info = env.step(action)
        effort = 0.5 * (action[0] ** 2 + action[1] ** 2)
        assert reward == pytest.approx(info["duration"] * (1.0 - 0.05 * effort), rel=1e-6)


def test_heading_commands_last_29_to_58_units_of_time() -> None:
    env = WalkerEnv("Heading", start_disturbance=0.0, horizon=math.inf)
    _, info = env.reset(seed=6)
    commands, times = [info["commanded_heading"]], [0.0]
    for _ in range(1_200):
        *_, terminated, _, info = env.step(ZERO)
        assert not terminated
        commands.append(info["commanded_heading"])
        times.append(info["time"])
    changes = np.flatnonzero(np.diff(commands))
    lengths = np.diff(np.array(times)[changes + 1])
    step = 0.73  # each is in force from the first heel strike when it is due or later
    assert len(lengths) > 10
    assert 29.0 - step < lengths.min() < 35.0
    assert 52.0 < lengths.max() < 58.0 + step
    assert np.abs(commands).max() <= 0.6
    assert info["commands"] == len(changes) + 1


def test_a_step_that_the_solver_gives_up_ends_the_episode_as_no_fall(
    recwarn: pytest.WarningsRecorder,
) -> None:
    env = WalkerEnv("Walk")
    env.reset(seed=1)
    env.step(ZERO)
    # no valid state makes it fail: a record that is not a number does
    env.simulation.walkers["stance_pitch_rate"] = np.nan
    before = env.simulation.walkers.copy()
    _, reward, terminated, truncated, info = env.step(ZERO)
    assert (reward, terminated, truncated) == (0.0, True, False)
    assert info["fall"] == FallCode.SOLVER
    assert FallCode(info["fall"]).word == "solver"
    assert info["steps"] == 2
    for name in ("time", "place_x", "heading", "side"):
        assert env.simulation.walkers[name] == before[name]
    assert env.simulation.solver_failures == 1
    with pytest.raises(ResetNeeded):
        env.step(ZERO)
    _, info = env.reset()
    assert info["fall"] == FallCode.NONE
    assert np.isfinite(env.step(ZERO)[0]).all()
    assert not recwarn.list


@pytest.mark.parametrize("task", TASK_VERSIONS)
def test_infos_are_numpy_s_numbers_of_the_same_kind_at_reset_and_steps(task: str) -> None:
    env = WalkerEnv(task, push_level=0.5, random_body="training")
    _, info = env.reset(seed=1)
    kinds = {key: (type(value), np.shape(value), value.dtype) for key, value in info.items()}
    assert all(issubclass(kind[0], (np.number, np.ndarray)) for kind in kinds.values())
    ended = False
    while not ended:
        *_, terminated, truncated, info = env.step(ZERO)
        ended = terminated or truncated
        assert {k: (type(v), np.shape(v), v.dtype) for k, v in info.items()} == kinds


# --- resets


def test_reset_options_set_the_start_exactly(gait: Vector) -> None:
    env = WalkerEnv("Heading")
    state = gait * 1.1
    for stance, side in (("left", 1.0), ("right", -1.0)):
        _, info = env.reset(seed=2, options={"state": state, "stance": stance, "command": -0.5})
        assert (info["state"] == state).all()
        assert info["stance_side"] == side
        assert info["commanded_heading"] == -0.5
        assert (info["time"], info["steps"], info["distance"]) == (0.0, 0.0, 0.0)


def test_a_stance_alone_mirrors_the_drawn_start() -> None:
    env = WalkerEnv("Walk")
    _, left = env.reset(seed=3, options={"stance": "left"})
    _, right = env.reset(seed=3, options={"stance": "right"})
    assert (left["state"] == right["state"] * MIRROR).all()


def test_starts_stray_from_the_gait_as_far_as_documented(gait: Vector) -> None:
    env = WalkerEnv("Walk", start_disturbance=2.0)
    starts, sides = [], []
    for seed in range(200):
        _, info = env.reset(seed=seed)
        sign = MIRROR if info["stance_side"] < 0 else 1.0
        starts.append(info["state"] * sign - gait)
        sides.append(info["stance_side"])
    limits = 2.0 * np.array([0.2, 0.01, 0.005, 0.03, 0.03])
    reach = np.abs(starts).max(axis=0)
    assert (reach <= limits + 1e-12).all()
    assert (reach > 0.95 * limits).all()
    assert 70 < sides.count(1.0) < 130  # either foot: three standard deviations are 21 of 200


# --- pictures


def test_a_video_is_recorded(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the encoder's own
        env = RecordVideo(gym.make("LeanYaw/Heading-v1", render_mode="rgb_array"), str(tmp_path))
        env.reset(seed=1)
        for _ in range(3):
            env.step(ZERO)
        env.close()
    (video,) = tmp_path.glob("*.mp4")
    assert video.stat().st_size > 5_000


def test_frames_are_pictures_that_change_with_the_walk() -> None:
    env = WalkerEnv("Heading", render_mode="rgb_array")
    env.reset(seed=1)
    frames = [env.render()]
    env.step(ZERO)
    frames.append(env.render())
    for frame in frames:
        assert frame is not None
        assert frame.dtype == np.uint8
        assert frame.ndim == 3
        assert frame.shape[2] == 3
        assert len(np.unique(frame.reshape(-1, 3), axis=0)) > 10
    assert not np.array_equal(frames[0], frames[1])
    env.close()


def test_a_list_of_frames_shows_the_motion_within_steps_at_the_rate_it_states() -> None:
    env = gym.make("LeanYaw/Heading-v1", render_mode="rgb_array_list")
    env.reset(seed=1)
    (first,) = env.render()
    for _ in range(4):
        *_, info = env.step(ZERO)
    frames = env.render()
    seconds = info["time"] / math.sqrt(9.81)  # for legs of a metre on earth
    assert len(frames) == math.floor(seconds * env.metadata["render_fps"])
    assert env.metadata["render_fps"] == 30
    shown = [first, *frames]
    assert all((one != other).any() for one, other in pairwise(shown))
    assert env.render() == []
    env.reset(seed=1)
    assert np.array_equal(env.render()[0], first)


def test_pictures_of_a_step_begin_and_end_with_those_of_its_heel_strikes() -> None:
    env = WalkerEnv("Heading", render_mode="rgb_array")
    env.reset(seed=1)
    env.step(ZERO)
    before = env.render()
    env.step(ZERO)
    # The same walker, footprints and path; the words are of the step's start, the new footprint comes with its end
    assert np.mean(env.picture(0.0) != before) < 1e-3
    assert np.mean(env.picture(1.0 - 1e-9) != env.render()) < 0.05
    assert np.array_equal(env.picture(1.0), env.render())
    assert np.mean(env.picture(0.5) != before) > 0.005


def test_a_fall_is_drawn_where_the_walker_fell() -> None:
    env = WalkerEnv("Metastable", render_mode="rgb_array", push_level=5.0)
    env.reset(seed=0)
    terminated = False
    while not terminated:
        *_, terminated, _, info = env.step(ZERO)
    assert info["fall"] != FallCode.NONE
    assert np.mean(env.picture(1.0 - 1e-9) != env.render()) < 0.02  # but for the words


def test_in_real_time_a_step_is_a_frame_and_an_episode_the_same() -> None:
    plain = gym.make("LeanYaw/Heading-v1", horizon=4.0)
    expected = _episode(plain, seed=3)
    env = RealTime(gym.make("LeanYaw/Heading-v1", render_mode="rgb_array", horizon=4.0), fps=20)
    rng = np.random.default_rng(3)
    seen: list[Any] = [env.reset(seed=3)]
    ended, frames, action = False, 0, rng.uniform(-1.0, 1.0, 2).astype(np.float32)
    while not ended:
        result = env.step(action)
        frames += 1
        ended = result[2] or result[3]
        if result[4] is not seen[-1][-1]:  # the walking step is over
            seen.append(result)
            action = rng.uniform(-1.0, 1.0, 2).astype(np.float32)
        else:
            assert result[1:4] == (0.0, False, False) and result[0] is seen[-1][0]
    assert len(seen) == len(expected) > 4
    for ours, theirs in zip(seen, expected, strict=True):
        assert _same(ours[0], theirs[0]) and _same(ours[1:-1], theirs[1:-1])
    # the last step is shown to its end, beyond the horizon
    seconds = sum(float(step[-1]["duration"]) for step in seen) / math.sqrt(9.81)
    assert frames == math.ceil(seconds * 20)


def test_gymnasium_records_films_in_real_time(tmp_path: Path) -> None:
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the encoder's own
        walker = gym.make("LeanYaw/Heading-v1", render_mode="rgb_array")
        env = RecordVideo(RealTime(walker), str(tmp_path))
        env.reset(seed=1)
        for _ in range(40):
            env.step(ZERO)
        env.close()
    (video,) = tmp_path.glob("*.mp4")
    about = next(ffmpeg.read_frames(str(video)))
    assert about["fps"] == 30 and about["size"] == (960, 540)
    # the first picture, and one for each of the forty frames
    assert ffmpeg.count_frames_and_secs(str(video))[0] == 41


def test_gymnasiums_play_steers_by_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    import pygame
    from gymnasium.utils.play import play

    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    headings: list[float] = []

    def after_frame(*seen: Any) -> None:
        headings.append(float(seen[-1]["state"][0]))
        if len(headings) == 1:
            pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_a))
        if len(headings) == 60:
            pygame.event.post(pygame.event.Event(pygame.QUIT))

    walker = gym.make(
        "LeanYaw/Heading-v1", render_mode="rgb_array", mirror=False, start_disturbance=0.0
    )
    play(RealTime(walker, speed=4.0), callback=after_frame, fps=1000, seed=0, noop=ZERO)
    assert len(headings) == 60
    assert headings[-1] > headings[0] + 0.1  # to the left


def test_in_real_time_there_is_nothing_to_draw_before_the_first_episode() -> None:
    env = RealTime(WalkerEnv("Walk", render_mode="rgb_array"))
    with pytest.raises(ResetNeeded):
        env.render()


def test_real_time_is_for_walkers_that_can_be_drawn() -> None:
    with pytest.raises(ValueError, match='render_mode="rgb_array"'):
        RealTime(gym.make("LeanYaw/Walk-v1"))
    with pytest.raises(ValueError, match="must be an environment of lean_yaw_env"):
        RealTime(gym.make("CartPole-v1"))
    drawn = gym.make("LeanYaw/Walk-v1", render_mode="rgb_array")
    for change in ({"fps": 0}, {"speed": 0.0}):
        with pytest.raises(ValueError, match="must be"):
            RealTime(drawn, **change)


def test_an_environment_without_pictures_says_how_to_get_them() -> None:
    env = WalkerEnv("Walk")
    env.reset(seed=1)
    with pytest.warns(UserWarning, match="make the environment with a render_mode"):
        assert env.render() is None
    with pytest.raises(ResetNeeded, match="reset"):
        WalkerEnv("Walk", render_mode="rgb_array").render()


def test_keys_cover_what_can_be_held_and_steer_to_their_side() -> None:
    env = WalkerEnv("Walk", mirror=False, start_disturbance=0.0)
    keys = env.get_keys_to_action()
    assert len(keys) == 2**4  # every way to hold four keys, none among them
    assert all(env.action_space.contains(action) for action in keys.values())
    assert (keys[""] == 0.0).all()
    ends = {}
    for key in ("a", "d", "w", "s"):
        env.reset(seed=0, options={"stance": "left"})
        for _ in range(30):
            *_, info = env.step(keys[key])
        ends[key] = info
    assert ends["a"]["footprint"][1] < 0.0 < ends["d"]["footprint"][1]
    assert ends["w"]["speed"] > ends["s"]["speed"]
    with pytest.raises(ValueError, match="mirror must be False"):
        WalkerEnv("Walk").get_keys_to_action()


@pytest.mark.parametrize(
    "name", ["TimeAwareObservation", "NumpyToTorch", "RecordEpisodeStatistics"]
)
def test_gymnasium_s_wrappers_take_it(name: str) -> None:
    env = getattr(gym.wrappers, name)(gym.make("LeanYaw/Heading-v1", max_episode_steps=5))
    env.reset(seed=1)
    zero = env.unwrapped.action_space.sample() * 0
    if name == "NumpyToTorch":
        zero = torch.from_numpy(zero)
    ends = [tuple(env.step(zero)[2:4]) for _ in range(5)]
    assert ends[-1] == (False, True)


# --- bad input


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"task": "Fly"}, "task must be one of .*Heading.*, got 'Fly'"),
        (
            {"render_mode": "ansi"},
            "render_mode must be one of rgb_array, rgb_array_list, human, got 'ansi'",
        ),
        ({"parameters": 0.1}, "parameters must be WalkerParameters or a mapping .*, got 0.1"),
        ({"parameters": {"slop": 0.1}}, "parameters has no 'slop'; did you mean 'slope'"),
        ({"parameters": {"slope": 1.0}}, r"slope must be in \[-0.5, 0.5\], got 1.0"),
        ({"inter_leg_angle_range": 0.3}, r"inter_leg_angle_range must be in \[0, 0.3\), got 0.3"),
        ({"mass_offset_range": -0.1}, r"mass_offset_range must be in \[0, 1\], got -0.1"),
        ({"max_offset_change": 3.0}, r"max_offset_change must be in \[0, 2\], got 3.0"),
        ({"horizon": 0.0}, r"horizon must be in \(0, inf\], got 0.0"),
        ({"start_disturbance": math.nan}, r"start_disturbance must be in \[0, 5\], got nan"),
        ({"mirror": "yes"}, "mirror must be True or False, got 'yes'"),
    ],
)
def test_a_bad_option_is_refused_by_name(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        WalkerEnv(**options)


def test_an_unknown_option_is_refused() -> None:
    with pytest.raises(TypeError, match="unexpected keyword argument 'wind'"):
        WalkerEnv("Walk", wind=1.0)
    with pytest.raises(TypeError, match="unexpected keyword argument 'slop'; did you mean 'slope'"):
        WalkerEnv("Walk", slop=0.01)


def test_a_walker_without_a_gait_makes_no_environment() -> None:
    with pytest.raises(NoGaitError):
        WalkerEnv("Walk", parameters=WalkerParameters(slope=-0.1))


@pytest.mark.parametrize(
    ("action", "message"),
    [
        ([0.0], r"action must have shape \(2,\), got \(1,\)"),
        ([[0.0, 0.0]], r"action must have shape \(2,\), got \(1, 2\)"),
        (0.0, r"action must have shape \(2,\), got 0.0"),
        ([math.nan, 0.0], r"action must be numbers in \[-1, 1\], got \[nan, 0.0\]"),
        ([0.0, -math.inf], "action must be numbers"),
    ],
)
def test_a_bad_action_is_refused_and_changes_nothing(action: Any, message: str) -> None:
    env, untouched = WalkerEnv("Heading"), WalkerEnv("Heading")
    env.reset(seed=4)
    untouched.reset(seed=4)
    with pytest.raises(ValueError, match=message):
        env.step(action)
    assert _same(env.step(ZERO), untouched.step(ZERO))


@pytest.mark.parametrize(
    ("task", "options", "message"),
    [
        ("Walk", {"speed": 1.0}, "reset option 'speed' is not one of state, stance"),
        ("Walk", {"command": 0.1}, "reset option 'command'"),
        ("Heading", {"command": 4.0}, "command must be in"),
        ("Heading", {"stance": "up"}, "stance must be one of left, right, got 'up'"),
        ("Heading", {"state": [0.0] * 4}, r"state must have shape \(5,\)"),
    ],
)
def test_a_bad_reset_is_refused_and_changes_nothing(
    task: str, options: dict[str, Any], message: str
) -> None:
    env, untouched = WalkerEnv(task), WalkerEnv(task)
    env.reset(seed=4)
    untouched.reset(seed=4)
    with pytest.raises(ValueError, match=message):
        env.reset(seed=9, options=options)
    assert _same(env.step(ZERO), untouched.step(ZERO))
    assert _same(env.reset(), untouched.reset())


def test_a_step_before_the_first_reset_is_refused() -> None:
    with pytest.raises(ResetNeeded, match="call reset"):
        WalkerEnv("Walk").step(ZERO)
