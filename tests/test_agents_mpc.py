"""Predictive control: plans are judged by the environment itself, nothing that has yet to be drawn is foreseen, and planning pays."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from agents import AgentRequest, make_agent
from agents.controllers.mpc import MpcController
from agents.controllers.mpc_rollouts import Rollouts
from agents.controllers.mpc_settings import MpcSettings, PlanSpread
from agents.controllers.simple import FixedController
from agents.evaluation.recording import record_episode
from agents.evaluation.scoring import run_seeds
from agents.seeds import first_seed
from agents.settings import tuned
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.registration import TASK_VERSIONS

VALIDATION = first_seed("validation")
TINY = MpcSettings(horizon=8, knots=(0, 3, 6), samples=12, iterations=2, elites=4)
WALKERS = 3


def started(task, n=WALKERS, seed=VALIDATION, steps=5, **options):
    """A vector environment some random steps into its episodes."""
    env = WalkerVectorEnv(n, task, **options)
    env.reset(seed=seed)
    generator = np.random.default_rng(0)
    for _ in range(steps):
        env.step(generator.uniform(-0.3, 0.3, (n, 2)))
    return env


def decide(env, task, settings=TINY, seed=0, **options):
    agent = MpcController(task, EnvOptions(**options), settings, seed, FixedController())
    agent.attach(env)
    return agent.predict(env.simulation.observations)[0]


@pytest.mark.parametrize("body", [None, "training"])
def test_a_plan_is_worth_the_reward_that_the_environment_gives_for_it(body):
    options = {"push_level": 0.0, "random_body": body}
    env = started("Slalom", **options)
    settings = replace(TINY, window=30.0)
    plans = np.random.default_rng(1).uniform(-0.4, 0.4, (WALKERS, 1, 8, 2))
    rollouts = Rollouts(env.simulation, settings, FixedController(), 0)
    worth = rollouts.worth(plans, np.arange(WALKERS))[:, 0]
    rewards, times = [], [env.simulation.walkers["time"].copy()]
    for step in range(8):
        actions = plans[:, 0, step].astype(np.float32)
        actions[:, 1] *= env.simulation.walkers["side"]
        rewards.append(env.step(actions)[1])
        times.append(env.simulation.walkers["time"].copy())
    rate = (rewards[-1] + rewards[-2]) / (times[-1] - times[-3])
    expected = sum(rewards) + rate * (30.0 - (times[-1] - times[0]))
    # the same steps from the same numbers; only the sums are in another order
    np.testing.assert_allclose(worth, expected, rtol=1e-12)


def test_nothing_of_the_environment_changes_by_planning():
    env = started("Waypoint")
    arrays = ("walkers", "tasks", "observations", "actions", "rewards", "ends")
    before = {name: getattr(env.simulation, name).copy() for name in arrays}
    decide(env, "Waypoint")
    for name in arrays:
        np.testing.assert_array_equal(getattr(env.simulation, name), before[name])


@pytest.mark.parametrize("task", ["Heading", "Waypoint", "Slalom", "Metastable"])
def test_decisions_do_not_depend_on_what_the_episode_will_draw(task):
    env = started(task)
    settings = replace(TINY, scenarios=2) if task == "Metastable" else TINY
    before = decide(env, task, settings)
    env.simulation.walkers["key"] = np.random.default_rng(2).integers(2**60, size=WALKERS)
    np.testing.assert_array_equal(decide(env, task, settings), before)


def test_a_walker_decides_alone_as_among_others_and_the_same_for_a_seed():
    env = started("Slalom")
    together = decide(env, "Slalom", seed=3)
    np.testing.assert_array_equal(decide(env, "Slalom", seed=3), together)
    assert np.any(decide(env, "Slalom", seed=4) != together)
    alone = WalkerEnv("Slalom")
    alone.reset(seed=0)
    alone.simulation.take_over(env.simulation, np.array([1]))
    agent = MpcController("Slalom", settings=TINY, seed=3, base=FixedController())
    agent.attach(alone)
    action, _ = agent.predict(alone.simulation.observations[0])
    assert action.shape == (2,)
    np.testing.assert_array_equal(action, together[1])


def test_decisions_are_the_same_in_space_whether_observations_are_mirrored_or_not():
    mirrored, raw = started("Heading", steps=0), started("Heading", steps=0, mirror=False)
    actions = decide(mirrored, "Heading")
    actions[:, 1] *= mirrored.simulation.walkers["side"].astype(np.float32)
    # single precision: an action is rounded before or after its sign is turned, which is exact
    np.testing.assert_array_equal(decide(raw, "Heading", mirror=False), actions)


def test_the_true_state_is_seen_through_noise_and_hidden_rates():
    clear = started("Heading", steps=0)
    veiled = {"sensor_noise": 0.5, "hidden_rates": True}
    hidden = started("Heading", steps=0, **veiled)
    np.testing.assert_array_equal(decide(clear, "Heading"), decide(hidden, "Heading", **veiled))


def test_the_base_acts_where_no_plan_is_better_by_the_margin():
    env = started("Slalom")
    # no plan is better by more than a walker earns
    actions = decide(env, "Slalom", replace(TINY, margin=1e6))
    np.testing.assert_array_equal(
        actions, FixedController().predict(env.simulation.observations)[0]
    )
    assert np.all(decide(env, "Slalom", replace(TINY, margin=0.0)) != actions)


def test_planning_alone_steers():
    # the base controller never acts, so that all of the steering is planned
    options = EnvOptions(horizon=50.0)
    settings = replace(TINY, horizon=14, knots=(0, 4, 9), samples=24)
    planner = MpcController("Heading", options, settings, base=FixedController())
    seeds = range(VALIDATION, VALIDATION + 8)
    planned = run_seeds(planner, "Heading", seeds, options=options)
    fixed = run_seeds(FixedController(), "Heading", seeds, options=options)
    assert planned.survived.all()
    # the walking rate is paid to both; of the tracking rate the fixed controller gets near a third
    assert planned.metrics["return"].mean() > 1.3 * fixed.metrics["return"].mean()


def test_fewer_scenarios_than_kept_already_stay_up_longer_under_pushes_than_the_fixed_controller():
    options = EnvOptions(horizon=60.0, friction_limit=math.inf)
    planner = MpcController(
        "Metastable", options, replace(tuned("mpc", "Metastable", MpcSettings()), scenarios=4)
    )
    seeds = range(VALIDATION, VALIDATION + 8)
    planned = run_seeds(planner, "Metastable", seeds, options=options)
    fixed = run_seeds(FixedController(), "Metastable", seeds, options=options)
    # of 1,000 episodes the fixed controller is still up after 60 in one of eight; as many are enough to tell that from most
    assert planned.survived.mean() >= 0.75 > fixed.survived.mean()


@pytest.mark.parametrize("task", list(TASK_VERSIONS))
def test_every_task_has_settings_and_a_planner_that_walks(task):
    options = EnvOptions(horizon=3.0)
    # the regulators would take most of the time: their gaits are found at first use
    planner = MpcController(task, options, base=FixedController())
    results = run_seeds(planner, task, range(VALIDATION, VALIDATION + 2), options=options)
    assert results.survived.all()


def test_the_planner_of_that_name_plans_around_the_regulator():
    options = EnvOptions(horizon=3.0)
    planner = make_agent("mpc", AgentRequest("LeanYaw/Metastable-v1", options))
    regulator = make_agent("lqr", AgentRequest("LeanYaw/Metastable-v1", options))
    env = started("Metastable", steps=0, horizon=3.0)
    assert isinstance(planner, MpcController)
    named = MpcController("Metastable", options, base=regulator)
    for each in (planner, named):
        each.attach(env)
    actions = [each.predict(env.simulation.observations)[0] for each in (planner, named)]
    np.testing.assert_array_equal(actions[0], actions[1])


def test_planners_work_for_recording_and_delayed_actions_and_bodies_unknown():
    options = EnvOptions(action_delay=True, random_body="held-out", horizon=10.0)
    planner = MpcController("Heading", options, TINY)
    assert record_episode(planner, "Heading", seed=VALIDATION, options=options).fall is None


@pytest.mark.parametrize(
    "bad",
    [
        {"horizon": 0},
        {"horizon": 2.5},
        {"tail": -1},
        {"knots": ()},
        {"knots": (1, 2)},
        {"knots": (0, 2, 2)},
        {"knots": (0, 16)},
        {"samples": 3},
        {"iterations": 0},
        {"elites": 47},
        {"window": 0.0},
        {"fall": -1.0},
        {"step_price": np.nan},
        {"trust": np.inf},
        {"margin": -0.1},
        {"scenarios": 65},
        {"push_scale": 11.0},
    ],
)
def test_bad_settings_are_refused_by_name(bad):
    with pytest.raises(ValueError, match=next(iter(bad))):
        MpcSettings(**bad)


@pytest.mark.parametrize("bad", [{"angle": -0.1}, {"steady": 3.0}, {"angle": 0.0, "steady": 0.0}])
def test_bad_spreads_are_refused(bad):
    with pytest.raises(ValueError, match="spread"):
        PlanSpread(**bad)


def test_planning_needs_the_environment_that_it_is_for():
    planner = MpcController("Heading", settings=TINY, base=FixedController())
    env = started("Heading", steps=0)
    with pytest.raises(RuntimeError, match="attach"):
        planner.predict(env.simulation.observations)
    with pytest.raises(ValueError, match="task"):
        planner.attach(started("Walk", steps=0))
    with pytest.raises(ValueError, match="options"):
        planner.attach(started("Heading", steps=0, action_delay=True))
    planner.attach(env)
    with pytest.raises(ValueError, match="3 walkers"):
        planner.predict(env.simulation.observations[:2])
    with pytest.raises(ValueError, match="seed"):
        MpcController("Heading", seed=-1)
