"""What Metastable, Energy, UnknownBody, Race and Hills promise of their own; ``test_tasks.py`` has what every task keeps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from lean_yaw_env import Walker, WalkerParameters
from lean_yaw_env.envs.formulas import place
from lean_yaw_env.envs.info import FallCode
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.reset import HELD_OUT_REACH
from lean_yaw_env.envs.state import BODY_NAMES
from lean_yaw_env.envs.tasks import energy, hills, race, task_named
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.envs.walker_env import WalkerEnv

ZERO = np.zeros(2, dtype=np.float32)


def started(task: str, n: int, seed: int = 0, **options: Any) -> WalkerVectorEnv:
    envs = WalkerVectorEnv(n, task, autoreset_mode="Disabled", **options)
    envs.reset(seed=seed)
    return envs


def seen(env: WalkerEnv, observation: np.ndarray) -> dict[str, float]:
    names = env.options.observation_names(env.task)
    return dict(zip(names, observation.tolist(), strict=True))


# --- Metastable


def test_metastable_falls_terminate_and_its_horizon_truncates() -> None:
    pushed = WalkerEnv("Metastable", push_level=3.0)
    pushed.reset(seed=0)
    terminated = truncated = False
    while not (terminated or truncated):
        *_, terminated, truncated, info = pushed.step(ZERO)
    assert terminated
    assert info["fall"] != FallCode.NONE
    assert info["time_walked"] == info["time"] < 100.0
    quiet = WalkerEnv("Metastable", push_level=0.0, horizon=20.0)
    quiet.reset(seed=0)
    terminated = truncated = False
    total = 0.0
    while not (terminated or truncated):
        _, reward, terminated, truncated, info = quiet.step(ZERO)
        total += reward
    assert truncated
    assert info["time_walked"] == 20.0
    assert total == pytest.approx(20.0, rel=1e-12)  # a reward of 1 per unit of time, summed up


# --- Energy


def test_every_speed_of_energy_has_a_gait_that_does_not_slip() -> None:
    envs = started("Energy", 2, start_disturbance=0.0, horizon=1e3)
    # inter-leg angles 0.275 and 0.2, offsets 0.006 and 0.022, instead of 0.3 and 0.03 at the start
    wanted = np.array([[-1.0 / 6.0, 0.12], [-2.0 / 3.0, 0.44]])
    for step in range(300):
        share = min(step / 100.0, 1.0)
        actions = share * wanted + (1.0 - share) * np.array([0.0, 0.6])
        _, _, terminated, _, info = envs.step(actions.astype(np.float32))
        assert not terminated.any()
    assert info["speed"][0] < energy.LEAST_SPEED < energy.GREATEST_SPEED < info["speed"][1]


def test_energy_pays_closeness_less_the_cost_of_transport() -> None:
    env = WalkerEnv("Energy", start_disturbance=0.0)
    observation, _ = env.reset(seed=0, options={"speed": 0.5})
    assert seen(env, observation)["commanded_speed"] == pytest.approx(-0.25, abs=1e-6)
    for _ in range(10):
        observation, reward, _, _, info = env.step(np.array([0.0, 0.5], dtype=np.float32))
        assert info["commanded_heading"] == 0.0
        heading_error = 0.6 * seen(env, observation)["heading_error"]
        speed_error = info["speed"] - 0.5
        rate = 0.2 + 0.4 / (1 + (heading_error / 0.2) ** 2) + 0.4 / (1 + (speed_error / 0.05) ** 2)
        cost = 20.0 * max(info["shift_work"], 0.0) / 0.5
        assert reward == pytest.approx(rate * info["duration"] - cost, abs=1e-6)  # float32 errors


# --- UnknownBody


def test_an_oracle_sees_the_body_and_others_neither_it_nor_the_rates() -> None:
    n = 500
    blind, oracle = (started("UnknownBody", n, show_body=each) for each in (False, True))
    observations = oracle.simulation.observations
    assert observations.shape == (n, blind.simulation.observations.shape[1] + 4)
    assert np.array_equal(observations[:, :-4], blind.simulation.observations)
    assert np.all(observations[:, 3:5] == 0.0)
    middle, reach = task_named("UnknownBody").parameters, (0.12, 0.10, 0.10, 0.004)
    for k, name in enumerate(BODY_NAMES):
        own = oracle.simulation.walkers[name]
        expected = (own - getattr(middle, name)) / reach[k]
        assert observations[:, k - 4] == pytest.approx(expected, abs=1e-6)
        assert 0.95 < np.abs(expected).max() <= 1.0  # the box is filled
    held_out = started("UnknownBody", n, show_body=True, random_body="held-out").simulation
    largest = np.abs(held_out.observations[:, -4:]).max(axis=1)
    assert np.all((largest > 1.0) & (largest <= HELD_OUT_REACH))


def test_options_replace_a_task_s_own_body_and_rates() -> None:
    own = EnvOptions(random_body="nominal", hidden_rates=False).for_task(task_named("UnknownBody"))
    assert (own.random_body, own.hidden_rates) == ("nominal", False)
    default = EnvOptions().for_task(task_named("UnknownBody"))
    assert (default.random_body, default.hidden_rates) == ("training", True)
    simulation = started("UnknownBody", 3, random_body="nominal").simulation
    assert len(simulation.bodies) == 1
    assert np.all(simulation.walkers["hip_width"] == 0.3)


# --- Race


def test_gates_are_counted_once_and_a_missed_one_costs() -> None:
    envs = started("Race", 32)
    simulation = envs.simulation
    crossed = np.zeros(32)
    for _ in range(200):
        before = [simulation.tasks[name].copy() for name in ("downhill", "goal_x", "goal_z")]
        count = simulation.tasks["passed"] + simulation.tasks["missed"]
        missed = simulation.tasks["missed"].copy()
        _, rewards, _, _, info = envs.step(np.zeros((32, 2), np.float32))
        x, z = place(simulation.walkers.view(np.recarray))
        beyond = x >= before[1]
        crossed += beyond
        assert np.array_equal(info["gates_passed"] + info["gates_missed"], count + beyond)
        is_missed = beyond & (np.abs(z - before[2]) > race.HALF_WIDTH)
        assert np.array_equal(info["gates_missed"], missed + is_missed)
        assert rewards == pytest.approx(x - before[0] - race.MISS_PRICE * is_missed, abs=1e-12)
        assert np.all(simulation.tasks["goal_x"] > x)
    assert crossed.min() >= 3  # of gates at most 12 apart, on 200 steps of 0.3


def test_gates_of_a_race_do_not_depend_on_how_it_is_run() -> None:
    gates = []
    for angle in (0.0, -1.0):
        env = WalkerEnv("Race", start_disturbance=0.0)
        env.reset(seed=3, options={"stance": "left"})
        places = []
        while len(places) < 4:
            env.step(np.array([angle, 0.0], dtype=np.float32))
            task = env.simulation.tasks[0]
            if not places or places[-1] != (task["goal_x"], task["goal_z"]):
                places.append((task["goal_x"], task["goal_z"]))
        gates.append(places)
    assert gates[0] == gates[1]


# --- Hills


def test_a_step_on_hills_is_that_of_a_walker_on_its_slope() -> None:
    env = WalkerEnv("Hills", mirror=False)
    _, info = env.reset(seed=4)
    slopes = []
    for step in range(40):
        slope, stance = info["slope"], "left" if info["stance_side"] > 0.0 else "right"
        walker = Walker(WalkerParameters(slope=float(slope), friction_limit=0.6))
        before = info["mass_offset"]
        expected = walker.step(info["state"], stance=stance, previous_offset=float(before))
        observation, _, _, _, info = env.step(ZERO)
        assert np.array_equal(info["state"], expected.state), step
        assert info["gravity_work"] == expected.energy.gravity_work
        x, _ = place(env.simulation.records(0)[0])
        here = hills.slope_at(env.simulation.tasks.view(np.recarray)[0], x)
        assert info["slope"] == here
        assert seen(env, observation)["slope_0"] == pytest.approx((here - 0.01) / 0.01, abs=1e-5)
        slopes.append(float(slope))
    assert len(set(slopes)) == 40


def test_hills_end_with_their_episode() -> None:
    """A new episode's hills are around the parameters' slope, not the last one's."""
    envs = started("Hills", 4, slope=0.02)
    for _ in range(20):
        envs.step(np.zeros((4, 2), np.float32))
    envs.reset()
    assert np.all(envs.simulation.tasks["mean_slope"] == 0.02)


def test_slopes_ahead_are_those_that_come() -> None:
    env = WalkerEnv("Hills", start_disturbance=0.0)
    observation, _ = env.reset(seed=1, options={"command": 0.0})
    task = env.simulation.tasks.view(np.recarray)[0]
    x, _ = place(env.simulation.records(0)[0])
    for ahead in (1.0, 2.0, 4.0):
        shown = 0.01 + 0.01 * seen(env, observation)[f"slope_{ahead:g}"]
        assert shown == pytest.approx(float(hills.slope_at(task, x + ahead)), abs=1e-8)
    heights = started("Hills", 2000).simulation.tasks["heights"].sum(axis=1)
    assert heights.min() >= hills.LEAST_HEIGHT and heights.max() <= hills.GREATEST_HEIGHT
    assert math.isclose(heights.mean(), 0.012, rel_tol=0.02)


def test_pictures_move_a_walker_on_the_slope_of_each_step() -> None:
    from lean_yaw_env.envs.pictures import Footage

    env = WalkerEnv("Hills")
    env.reset(seed=2)
    footage, ends = Footage(env.simulation), []
    for _ in range(5):
        env.step(ZERO)
        footage.extend()
        path = footage.motion.path()
        # the centre of mass goes on where it was before the heel strike; on the slope of another step it does not
        if ends:
            assert path[0] == pytest.approx(ends[-1], abs=1e-6)
        ends.append(path[-1])
