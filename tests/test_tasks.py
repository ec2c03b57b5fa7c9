"""Every task keeps one contract, whatever its options; then what each task promises of its own."""

from __future__ import annotations

import math
import pickle
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import lean_yaw_env  # noqa: F401  registers the environments
from lean_yaw_env import Walker, WalkerParameters, find_limit_cycle
from lean_yaw_env.envs.describe import renewed
from lean_yaw_env.envs.dynamics import ANKLE_PUSH, PITCH_PUSH
from lean_yaw_env.envs.formulas import mean_heading, place
from lean_yaw_env.envs.info import INFOS, OPTIONAL_INFOS, FallCode
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.reset import BODY_DEVIATIONS, HELD_OUT_REACH
from lean_yaw_env.envs.state import WALKER_FIELDS, as_records, mirror
from lean_yaw_env.envs.tasks import headings, slalom, task_named, waypoints
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.registration import ENV_IDS, TASK_VERSIONS

TASKS = tuple(TASK_VERSIONS)
COMMANDED = [name for name in TASKS if "command_left" in task_named(name).initial.dtype.names]
BODY = ("hip_width", "foot_radius", "ankle_tilt", "slope")
HARD = {
    "none": {},
    "noise and pushes, not mirrored": {"mirror": False, "sensor_noise": 0.1, "push_level": 0.3},
    "delay, hidden rates, bodies": {
        "action_delay": True,
        "hidden_rates": True,
        "random_body": "training",
    },
    "held-out bodies, friction limit": {"random_body": "held-out", "friction_limit": 0.4},
}
ZERO = np.zeros(2, dtype=np.float32)


def assert_same(a: Any, b: Any, where: str) -> None:
    """Bit for bit, types included."""
    assert type(a) is type(b), where
    if isinstance(a, dict):
        assert a.keys() == b.keys(), where
        for key in a:
            assert_same(a[key], b[key], f"{where} {key}")
    elif isinstance(a, np.ndarray) and a.dtype != object:
        assert a.dtype == b.dtype, where
        assert np.array_equal(a, b), (where, a, b)
    else:
        assert list(a) == list(b), where


def started(task: str, n: int = 1, seed: int = 0, **options: Any) -> WalkerVectorEnv:
    envs = WalkerVectorEnv(n, task, autoreset_mode=AutoresetMode.SAME_STEP, **options)
    envs.reset(seed=seed)
    return envs


# --- the contract


@pytest.mark.parametrize("options", HARD.values(), ids=HARD)
@pytest.mark.parametrize("env_id", ENV_IDS)
def test_one_walker_and_many_agree_bit_for_bit(env_id: str, options: dict[str, Any]) -> None:
    n = 3
    many = gym.make_vec(env_id, num_envs=n, **options)
    singles = SyncVectorEnv([lambda: gym.make(env_id, disable_env_checker=True, **options)] * n)
    random = np.random.default_rng(1)
    for x, y in zip(many.reset(seed=5), singles.reset(seed=5), strict=True):
        assert_same(x, y, "reset")
    for step in range(60):
        actions = random.uniform(-1.0, 1.0, (n, 2)).astype(np.float32)
        for x, y in zip(many.step(actions), singles.step(actions), strict=True):
            assert_same(x, y, f"step {step}")


@pytest.mark.parametrize("task", TASKS)
def test_checkers_find_nothing_to_warn_of(task: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(WalkerEnv(task, **HARD["delay, hidden rates, bodies"]), skip_render_check=True)


@pytest.mark.parametrize("task", TASKS)
def test_episodes_repeat_with_their_seed_and_survive_pickling(task: str) -> None:
    env = WalkerEnv(task, sensor_noise=0.1, random_body="training", push_level=0.1)
    copy = pickle.loads(pickle.dumps(env))
    actions = np.random.default_rng(2).uniform(-1.0, 1.0, (20, 2)).astype(np.float32)
    runs = []
    for each in (env, env, copy):
        each.reset(seed=9)
        steps = []
        for action in actions:
            steps.append(each.step(action))
            if steps[-1][2]:
                break
        runs.append(steps)
    for other in runs[1:]:
        for a, b in zip(runs[0], other, strict=True):
            assert np.array_equal(a[0], b[0])
            assert a[1:4] == b[1:4]


@pytest.mark.parametrize("task", TASKS)
def test_a_fall_terminates_and_pays_nothing(task: str) -> None:
    env = WalkerEnv(task, push_level=0.0)
    # moving backward from the start
    env.reset(seed=0, options={"state": [0.0, 0.15, 0.0, 0.1, 0.0], "stance": "left"})
    _, reward, terminated, truncated, info = env.step(ZERO)
    assert terminated
    assert not truncated
    assert reward == 0.0
    assert info["fall"] == FallCode.BACKWARD


@pytest.mark.parametrize("task", TASKS)
def test_a_step_that_takes_no_time_leaves_numbers_numbers(task: str) -> None:
    env = WalkerEnv(task, parameters={"early_contact": "strike"}, push_level=0.0)
    # the swing foot, put in front, is below the floor at once
    env.reset(seed=0, options={"state": [0.0, -0.3, 0.0, -0.5, 0.0], "stance": "left"})
    observation, reward, terminated, _, info = env.step([1.0, 0.0])
    assert not terminated
    assert info["duration"] == 0.0
    assert np.isfinite(observation).all()
    assert all(np.isfinite(number).all() for number in info.values())
    assert math.isfinite(reward)
    assert info["speed"] == 0.0  # of no step yet


@pytest.mark.parametrize("task", TASKS)
def test_rewards_and_sums_count_to_the_horizon_and_no_further(task: str) -> None:
    env, longer = (
        WalkerEnv(task, horizon=horizon, push_level=0.0, start_disturbance=0.0)
        for horizon in (3.0, 300.0)
    )
    for each in (env, longer):
        each.reset(seed=0)
    truncated = terminated = False
    while not (truncated or terminated):
        before = env.simulation.walkers[0].copy()
        _, reward, terminated, truncated, info = env.step(ZERO)
        _, whole, _, _, onward = longer.step(ZERO)
    assert truncated and not terminated
    assert before["time"] < 3.0 < onward["time"]
    assert info["time"] == 3.0
    assert info["duration"] == onward["duration"]
    share = (3.0 - before["time"]) / info["duration"]
    assert reward == pytest.approx(share * whole, abs=1e-15)
    advance = onward["distance"] - before["distance"]
    assert info["distance"] == pytest.approx(before["distance"] + share * advance, abs=1e-12)


@pytest.mark.parametrize("task", COMMANDED)
def test_commands_come_at_times_that_do_not_depend_on_the_steps(task: str) -> None:
    schedules = []
    for angle in (-0.3, 0.3):  # short and long steps
        env = WalkerEnv(task, push_level=0.0, start_disturbance=0.0, random_body="nominal")
        env.reset(seed=0)
        record, schedule, due = env.simulation.tasks, [], 0.0
        if "heights" in env.task.record.names:
            record["heights"] = 0.0  # constant commands fall on hills
        action = np.array([angle, 0.6 if env.task.pumping else 0.0], dtype=np.float32)
        truncated = terminated = False
        time = before = 0.0
        while not (truncated or terminated):
            if record["since_command"][0] == 0.0:
                assert before <= due <= time
                due = time + float(record["command_left"][0])
                schedule.append((due, float(record["command"][0])))
            before = time
            *_, terminated, truncated, info = env.step(action)
            time = info["time"]
        assert truncated
        schedules.append(schedule)
    # sums of about 200 steps' durations
    np.testing.assert_allclose(*schedules, rtol=0.0, atol=1e-11)
    assert len(schedules[0]) > 3


@pytest.mark.parametrize("task", TASKS)
def test_observations_and_metrics_are_what_the_task_names(task: str) -> None:
    env = WalkerEnv(task)
    observation, info = env.reset(seed=0)
    names = env.options.observation_names(env.task)
    assert len(set(names)) == len(names)
    assert observation.shape == (len(names),)
    assert all(math.isfinite(info[name]) for name in env.task.metrics)
    always, described = ({each.key for each in some} for some in (INFOS, (*INFOS, *OPTIONAL_INFOS)))
    assert set(info) - set(env.task.metrics) <= described
    assert set(info) >= always


@pytest.mark.parametrize("task", TASKS)
def test_a_mirrored_world_looks_and_pays_the_same(task: str) -> None:
    env, mirrored = (WalkerEnv(task, push_level=0.0) for _ in range(2))
    for each in (env, mirrored):
        each.reset(seed=3)
    mirror(mirrored.simulation.walkers, WALKER_FIELDS)
    mirror(mirrored.simulation.tasks, env.task.fields)
    actions = np.random.default_rng(3).uniform(-0.5, 0.5, (30, 2)).astype(np.float32)
    for action in actions:
        a, b = env.step(action), mirrored.step(action)
        # every formula is odd or even, so that only the last bits may differ
        np.testing.assert_allclose(a[0], b[0], rtol=0.0, atol=1e-6)
        assert a[1] == pytest.approx(b[1], abs=1e-9)
        assert a[2:4] == b[2:4]
        if a[2] or a[3]:
            break


def test_the_page_of_environments_says_what_the_code_does() -> None:
    page = (Path(__file__).parents[1] / "docs" / "environments.md").read_text(encoding="utf-8")
    assert renewed(page) == page


def test_a_page_without_its_marks_is_refused() -> None:
    with pytest.raises(ValueError, match="must mark each of"):
        renewed("<!-- action -->\n<!-- end -->\n")


# --- options


def test_noise_has_its_standard_deviation_and_spares_the_stance_foot() -> None:
    n, size = 4000, 0.5
    options = {"mirror": False, "start_disturbance": 0.0}
    clean, noisy = (started("Walk", n, **options, sensor_noise=each) for each in (0.0, size))
    noise = (noisy.simulation.observations - clean.simulation.observations).astype(float)
    foot = 6
    assert np.all(noise[:, foot] == 0.0)
    rest = np.delete(noise, foot, axis=1)
    # six standard errors of a mean and of a standard deviation of n numbers
    assert np.abs(rest.mean(axis=0)).max() < 6.0 * size / math.sqrt(n)
    assert np.abs(rest.std(axis=0) / size - 1.0).max() < 6.0 / math.sqrt(2.0 * n)
    correlations = np.corrcoef(rest.T) - np.eye(rest.shape[1])
    assert np.abs(correlations).max() < 6.0 / math.sqrt(n)


def test_hidden_rates_show_zero_and_change_nothing_else() -> None:
    shown, hidden = (started("Heading", hidden_rates=each) for each in (False, True))
    for _ in range(5):
        shown.step(ZERO[None])
        hidden.step(ZERO[None])
    a, b = shown.simulation.observations[0], hidden.simulation.observations[0]
    assert np.all(b[3:5] == 0.0)
    assert np.all(a[3:5] != 0.0)
    assert np.array_equal(np.delete(a, (3, 4)), np.delete(b, (3, 4)))


def test_a_delayed_action_walks_the_step_after() -> None:
    prompt = WalkerEnv("Walk", mirror=False)
    late = WalkerEnv("Walk", mirror=False, action_delay=True)
    actions = np.random.default_rng(4).uniform(-0.5, 0.5, (15, 2)).astype(np.float32)
    prompt.reset(seed=1)
    late.reset(seed=1)
    for before, action in zip([ZERO, *actions], actions, strict=False):
        a = prompt.step(before)
        b = late.step(action)
        assert np.array_equal(a[0], b[0])


def test_a_delayed_offset_keeps_its_side_of_the_walker() -> None:
    env = WalkerEnv("Walk", action_delay=True, start_disturbance=0.0)
    env.reset(seed=0, options={"stance": "left"})
    env.step(np.array([0.0, 1.0], dtype=np.float32))  # to the right, of a left stance
    *_, info = env.step(ZERO)
    assert info["commanded_offset"] == 0.005


@pytest.mark.parametrize(("kind", "reach"), [("training", 1.0), ("held-out", HELD_OUT_REACH)])
def test_random_bodies_fill_their_box(kind: str, reach: float) -> None:
    envs = started("Walk", 2000, random_body=kind)
    own = envs.simulation.bodies[:, : len(BODY)]
    nominal = np.array([getattr(WalkerParameters(), name) for name in BODY])
    deviations = (own - nominal) / np.array(BODY_DEVIATIONS)
    largest = np.abs(deviations).max(axis=1)
    # of 2000 uniform draws some come within a hundredth of every wall
    assert np.all(np.abs(np.abs(deviations).max(axis=0) - reach) < 0.01 * reach)
    assert largest.max() <= reach
    if kind == "held-out":
        assert largest.min() > 1.0
    else:
        assert np.abs(deviations.mean(axis=0)).max() < 6.0 / math.sqrt(3 * 2000)
    assert len(np.unique(own[:, 0])) == 2000


@pytest.mark.parametrize("env_class", [WalkerEnv, WalkerVectorEnv])
def test_each_walker_walks_with_the_body_that_info_tells(env_class: Any) -> None:
    kwargs = {"random_body": "held-out", "start_disturbance": 0.0, "mirror": False}
    env = WalkerEnv("Walk", **kwargs) if env_class is WalkerEnv else started("Walk", 4, **kwargs)
    _, start = env.reset(seed=2)
    actions = ZERO if env_class is WalkerEnv else np.zeros((4, 2), np.float32)
    *_, info = env.step(actions)
    for i in range(1 if env_class is WalkerEnv else 4):
        body = {name: float(np.atleast_1d(info[name])[i]) for name in BODY}
        walker = Walker(replace(WalkerParameters(), **body))
        stance = "left" if np.atleast_1d(start["stance_side"])[i] > 0.0 else "right"
        result = walker.step(np.atleast_2d(start["state"])[i], stance=stance)
        assert np.array_equal(np.atleast_2d(info["state"])[i], result.state)


def test_a_new_episode_has_a_new_body() -> None:
    env = WalkerEnv("Walk", random_body="training")
    first = env.reset(seed=0)[1]["hip_width"]
    assert env.reset()[1]["hip_width"] != first


def test_pushes_have_their_size_and_are_part_of_the_state() -> None:
    n, level = 4000, 0.3
    envs = started("Walk", n, push_level=level, start_disturbance=0.0)
    start = envs.simulation.states.copy()
    sides = envs.simulation.walkers["side"].copy()
    *_, info = envs.step(np.zeros((n, 2), np.float32))
    for name, size in (("pitch_push", PITCH_PUSH), ("ankle_push", ANKLE_PUSH)):
        pushes = info[name]
        assert pushes.std() == pytest.approx(level * size, rel=6.0 / math.sqrt(2.0 * n))
        assert abs(pushes.mean()) < 6.0 * level * size / math.sqrt(n)
    landed = Walker().step(start[0], stance="left" if sides[0] > 0.0 else "right").state
    landed[3] += info["pitch_push"][0]
    landed[4] += info["ankle_push"][0]
    assert np.array_equal(info["state"][0], landed)


def test_a_friction_limit_makes_walkers_slip() -> None:
    env = WalkerEnv("Level", friction_limit=0.3)
    env.reset(seed=0)
    for _ in range(5):
        *_, terminated, _, info = env.step(np.array([0.0, 1.0], dtype=np.float32))
        if terminated:
            break
    assert info["fall"] == FallCode.SLIP


def test_slope_and_friction_replace_the_parameters() -> None:
    options = EnvOptions(
        slope=-0.005, friction_limit=0.5, parameters=WalkerParameters(hip_width=0.2)
    )
    own = options.walker_parameters(task_named("Level"))
    assert (own.slope, own.friction_limit, own.hip_width) == (-0.005, 0.5, 0.2)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"sensor_noise": -0.1}, r"sensor_noise must be in \[0, 10\], got -0.1"),
        ({"push_level": 11.0}, r"push_level must be in \[0, 10\], got 11"),
        ({"action_delay": 1}, "action_delay must be True or False, got 1"),
        ({"hidden_rates": 1}, "hidden_rates must be True or False"),
        (
            {"random_body": "test"},
            "random_body must be one of nominal, training, held-out, got 'test'",
        ),
        ({"random_body": ["training"]}, "random_body must be one of"),
        ({"slope": 1.0}, r"slope must be in \[-0.5, 0.5\], got 1.0"),
        ({"friction_limit": 0.0}, r"friction_limit must be in \(0, inf\], got 0.0"),
    ],
)
def test_bad_options_are_named(options: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        WalkerEnv("Walk", **options)


def test_a_box_of_impossible_bodies_is_refused() -> None:
    with pytest.raises(ValueError, match=r"random_body: foot_radius within 0\.075 of 0 leaves"):
        WalkerEnv("Walk", random_body="training", parameters=WalkerParameters(foot_radius=0.0))


@pytest.mark.parametrize(
    ("task", "options", "words"),
    [
        ("Walk", {"command": 0.1}, r"'command' is not one of state, stance \(task Walk"),
        ("Waypoint", {"goal": (1.0,)}, r"goal must have shape \(2,\), got \(1,\)"),
        ("SpeedHeading", {"speed": 0.9}, r"speed must be in \[0.3, 0.55\], got 0.9"),
        ("Heading", {"command": "left"}, "command must be a number"),
    ],
)
def test_bad_commands_are_named(task: str, options: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        WalkerEnv(task).reset(options=options)


# --- each task's own


def test_walking_pays_by_the_time_it_takes() -> None:
    env = WalkerEnv("Walk")
    env.reset(seed=0)
    _, reward, _, _, info = env.step(ZERO)
    assert reward == info["duration"]


@pytest.mark.parametrize(
    ("task", "largest"), [("Heading", 0.6), ("UTurn", math.pi), ("Level", 0.6)]
)
def test_commands_fill_their_range(task: str, largest: float) -> None:
    commands = started(task, 2000).simulation.tasks["command"]
    assert np.abs(commands).max() <= largest
    # the largest of 2000 uniform draws is within a hundredth of the bound but for e^-20
    assert commands.max() > 0.99 * largest
    assert commands.min() < -0.99 * largest


@pytest.mark.parametrize("heading", [0.0, 0.6])
def test_every_commanded_speed_is_within_reach(heading: float) -> None:
    reach = EnvOptions().inter_leg_angle_range
    offset = -math.sin(heading) * math.tan(0.01)
    speeds = [
        find_limit_cycle(Walker(), inter_leg_angle=angle, mass_offset=offset).speed
        for angle in (0.3 + reach, 0.3 - reach)
    ]
    assert speeds[0] < headings.LEAST_SPEED < headings.GREATEST_SPEED < speeds[1]


def test_speed_heading_reports_both_errors() -> None:
    env = WalkerEnv("SpeedHeading", start_disturbance=0.0)
    observation, _ = env.reset(seed=0, options={"command": 0.2, "speed": 0.5})
    names = env.options.observation_names(env.task)
    shown = dict(zip(names, observation.tolist(), strict=True))
    assert shown["commanded_speed"] == pytest.approx(0.8, abs=1e-6)  # (0.5 - 0.42) / 0.1
    assert shown["speed_error"] == 0.0
    heading = speed = time = 0.0
    for _ in range(10):
        observation, reward, _, _, info = env.step(ZERO)
        shown = dict(zip(names, observation.tolist(), strict=True))
        heading_error = 0.6 * shown["heading_error"] * info["stance_side"]
        speed_error = 0.5 - info["speed"]
        assert shown["speed_error"] == pytest.approx(speed_error / 0.1, abs=1e-5)
        heading += abs(heading_error) * info["duration"]
        speed += abs(speed_error) * info["duration"]
        time += info["duration"]
        rate = 0.2 + 0.4 / (1 + (heading_error / 0.2) ** 2) + 0.4 / (1 + (speed_error / 0.05) ** 2)
        assert reward == pytest.approx(rate * info["duration"], abs=1e-6)  # float32 observations
    assert info["mean_absolute_heading_error"] == pytest.approx(heading / time, abs=1e-6)
    assert info["mean_absolute_speed_error"] == pytest.approx(speed / time, abs=1e-12)


@pytest.mark.parametrize(
    ("task", "nearest", "farthest"), [("Waypoint", 4.0, 8.0), ("WaypointGoal", 8.0, 16.0)]
)
def test_goals_are_set_all_round_and_at_their_distance(
    task: str, nearest: float, farthest: float
) -> None:
    simulation = started(task, 2000, start_disturbance=0.0).simulation
    aside = 0.5 * 0.3 * simulation.walkers["side"]  # the walker's middle, at heading ~ 0
    x = simulation.tasks["goal_x"]
    z = simulation.tasks["goal_z"] - aside
    distance = np.hypot(x, z)
    # the gait's footprints head 0.0015 rad to one side, which moves the middle by 0.0003
    assert nearest - 1e-3 < distance.min() < nearest + 0.1
    assert farthest - 0.1 < distance.max() < farthest + 1e-3
    quarters = np.histogram(np.arctan2(z, x), bins=4, range=(-np.pi, np.pi))[0]
    assert np.all(np.abs(quarters - 500) < 6 * math.sqrt(500))


def test_a_goal_on_the_left_is_seen_on_the_left() -> None:
    env = WalkerEnv("Waypoint", start_disturbance=0.0)
    for stance, sign in (("left", 1.0), ("right", -1.0)):
        observation, _ = env.reset(seed=0, options={"goal": (0.0, -10.0), "stance": stance})
        assert sign * 0.6 * observation[-2] == pytest.approx(0.5 * math.pi, abs=0.05)
        assert 8.0 * observation[-1] == pytest.approx(10.0, abs=0.2)


def test_approaching_pays_and_reaching_sets_another_goal() -> None:
    env = WalkerEnv("Waypoint", start_disturbance=0.0)
    _, info = env.reset(seed=0, options={"goal": (3.0, 0.0)})
    while info["goals"] == 0.0:
        before = info["goal_distance"]
        _, reward, terminated, _, info = env.step(ZERO)
        assert not terminated
        if info["goals"] == 0.0:
            nearer = before - info["goal_distance"]
            assert reward == pytest.approx(0.5 * info["duration"] + nearer, abs=1e-12)
            assert info["goal_distance"] > waypoints.RADIUS
    # at most 3 - 0.5 away, in steps of 0.3
    assert 8 <= info["steps"] <= 10
    assert 4.0 <= info["goal_distance"] <= 8.0


def test_where_the_slope_turns_the_heading_is_not_shown() -> None:
    env = WalkerEnv("Waypoint")
    env.reset(seed=0)
    for _ in range(20):
        observation, _, _, _, info = env.step(np.array([0.0, 0.5], dtype=np.float32))
        assert observation[0] == 0.0
    assert info["state"][0] != 0.0


def test_slalom_paths_keep_to_their_limits() -> None:
    simulation = started("Slalom", 1000).simulation
    numbers, heights = simulation.tasks["wave_numbers"], simulation.tasks["heights"]
    lengths = 2.0 * np.pi / numbers
    assert 12.0 <= lengths.min() < 12.2
    assert 79.0 < lengths.max() <= 80.0
    steepest = np.abs(heights * numbers).sum(axis=1)
    assert steepest.max() <= 0.8 + 1e-12  # round-off of a sum of three
    assert steepest.max() > 0.7
    assert np.abs(heights * numbers**2).sum(axis=1).max() <= 0.08 + 1e-12
    assert np.all(slalom.reference_path(*simulation.records(0))[0] == 0.0)


def test_slalom_shows_the_path_where_it_is_drawn() -> None:
    env = WalkerEnv("Slalom", mirror=False, push_level=0.0)
    env.reset(seed=5)
    for _ in range(10):
        observation, _, _, _, info = env.step(ZERO)
    walker, task = env.simulation.records(0)
    path = slalom.reference_path(walker, task)
    heading = 0.5 * (walker.heading + walker.previous_heading)
    aside = 0.15 * walker.side
    own = np.array([walker.place_x, walker.place_z]) + aside * np.array(
        [math.sin(walker.heading), math.cos(walker.heading)]
    )
    # the two formulas that everyone shares say the same, of one walker and of many
    assert place(walker) == tuple(own)
    assert mean_heading(walker) == heading
    assert place(as_records(env.simulation.walkers))[0] == own[0]
    left = np.array([-math.sin(heading), -math.cos(heading)])
    for k, ahead in enumerate(slalom.PREVIEWS):
        x = own[0] + ahead
        point = np.array([x, np.interp(x, path[:, 0], path[:, 1])])
        # linear between points 0.25 apart, at a curvature to 0.08: 0.08 * 0.25^2 / 8 = 6e-4
        assert ahead * observation[-3 + k] == pytest.approx((point - own) @ left, abs=1e-3)
    nearest = np.linalg.norm(path - own, axis=1).min()
    # points 0.25 apart miss the nearest one by at most 0.125
    assert abs(info["cross_track_error"]) <= nearest + 1e-3
    assert nearest < math.hypot(info["cross_track_error"], 0.13) + 1e-3


def test_slalom_ends_three_leg_lengths_off_the_path_without_reward() -> None:
    env = WalkerEnv("Slalom", push_level=0.0)
    env.reset(seed=0)
    squares = time = 0.0
    terminated = truncated = False
    while not (terminated or truncated):
        _, reward, terminated, truncated, info = env.step(ZERO)
        squares += info["cross_track_error"] ** 2 * info["duration"]
        time += info["duration"]
    assert terminated
    assert info["fall"] == FallCode.NONE
    assert reward == 0.0
    assert 3.0 < abs(info["cross_track_error"]) < 3.5  # a step is 0.3 long
    assert info["rms_cross_track_error"] == pytest.approx(math.sqrt(squares / time), abs=1e-9)


def test_harder_pushes_end_walks_sooner() -> None:
    steps = []
    for level in (0.2, 0.4, 0.8):
        envs = started("Metastable", 64, push_level=level)
        walked = np.zeros(64)
        alive = np.ones(64, dtype=bool)
        for _ in range(100):
            _, _, terminated, _, _ = envs.step(np.zeros((64, 2), np.float32))
            alive &= ~terminated
            walked += alive
        steps.append(walked.mean())
    assert steps[0] > steps[1] + 10.0 > steps[2] + 20.0


@pytest.mark.parametrize("task", ["Level", "LevelUphill"])
def test_level_starts_in_the_gait_of_pumping(task: str) -> None:
    env = WalkerEnv(task, start_disturbance=0.0, push_level=0.0)
    first, _ = env.reset(seed=0)
    for _ in range(6):
        observation, _, _, _, info = env.step(np.array([0.0, 0.6], dtype=np.float32))
        assert abs(info["mass_offset"]) == pytest.approx(0.03, abs=1e-8)  # an action in float32
        # up the slope the gait falls off by 0.8 % a stride, from 1e-8; on the level any heading is a gait's, and the mean one not just zero
        np.testing.assert_allclose(observation[1:6], first[1:6], rtol=0.0, atol=1e-5)
        assert observation[0] == pytest.approx(first[0], abs=0.003)


def pumping(observations: np.ndarray, steering: float) -> np.ndarray:
    """Alternate the offset away from the stance foot, more or less of it by the heading error."""
    actions = np.zeros((len(observations), 2), np.float32)
    actions[:, 1] = 0.4 - steering * observations[:, -1]
    return actions


@pytest.mark.parametrize("task", ["Level", "LevelUphill"])
def test_level_is_walked_and_steered_by_pumping_alone(task: str) -> None:
    n = 32
    errors = []
    for steering in (0.0, 0.2):
        envs = started(task, n, push_level=0.0)
        for _ in range(180):  # of 0.5 to 1 units of time, within the horizon
            _, _, terminated, truncated, info = envs.step(
                pumping(envs.simulation.observations, steering)
            )
            assert not terminated.any()
            assert not truncated.any()
        errors.append(info["mean_absolute_heading_error"].mean())
    # measured: 0.33 straight on and 0.23 steered on the level, 0.42 and 0.25 uphill
    assert errors[1] < 0.75 * errors[0]


def test_level_without_pumping_falls_and_pumping_costs_what_the_gait_takes() -> None:
    env = WalkerEnv("Level", start_disturbance=0.0, push_level=0.0)
    env.reset(seed=0)
    for _ in range(50):
        *_, info = env.step(np.array([0.0, 0.6], dtype=np.float32))
    gait = find_limit_cycle(Walker(WalkerParameters(slope=0.0)), mass_offset=(0.03, -0.03))
    # distances differ: along the headings, which alternate by 0.016 rad, or from print to print
    assert info["cost_of_transport"] == pytest.approx(gait.shift_work, rel=2e-3)
    assert info["mean_speed"] == pytest.approx(gait.speed, rel=2e-3)
    env.reset(seed=0)
    terminated = truncated = False
    while not (terminated or truncated):
        *_, terminated, truncated, info = env.step(ZERO)
    assert info["fall"] != FallCode.NONE


def test_pictures_show_goals_and_the_path() -> None:
    from lean_yaw_env.envs.pictures import Footage

    env = WalkerEnv("Waypoint", start_disturbance=0.0)
    env.reset(seed=0, options={"goal": (1.5, 0.0)})
    footage = Footage(env.simulation)
    for _ in range(6):
        env.step(ZERO)
        footage.extend()
    goals = footage.scene().goals
    assert [goal.reached for goal in goals] == [True, False]
    assert goals[0][:3] == (1.5, 0.0, waypoints.RADIUS)
    env = WalkerEnv("Slalom")
    env.reset(seed=0)
    scene = Footage(env.simulation).scene()
    assert scene.reference_path is not None
    assert np.array_equal(scene.reference_path, slalom.reference_path(*env.simulation.records(0)))
