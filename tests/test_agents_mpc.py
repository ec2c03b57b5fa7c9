"""Predictive control: plans are judged by the environment itself, nothing that has yet to be drawn is foreseen but by references, and planning pays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agents import AgentRequest, make_agent
from agents.controllers.guidance import guided
from agents.controllers.mpc import MpcController, MpcSettings
from agents.controllers.simple import FixedController
from agents.evaluation.recording import record_episode
from agents.evaluation.scoring import run_seeds
from agents.registry import env_id_of, make_base
from agents.seeds import first_seed
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.registration import TASK_VERSIONS

VALIDATION = first_seed("validation")
TINY = MpcSettings(steps=8, samples=12, iterations=2, scenarios=2)
CLAIRVOYANT = replace(TINY, scenarios=0, trust=0.0)
WALKERS = 3


def started(task, n=WALKERS, seed=VALIDATION, steps=5, **options):
    """A vector environment some random steps into its episodes."""
    env = WalkerVectorEnv(n, task, **options)
    env.reset(seed=seed)
    generator = np.random.default_rng(0)
    for _ in range(steps):
        env.step(generator.uniform(-0.3, 0.3, (n, 2)))
    return env


def planner_for(env, task, settings=TINY, seed=0, base=None, **options):
    agent = MpcController(task, EnvOptions(**options), base or FixedController(), settings, seed)
    agent.attach(env)
    return agent


def decide(env, task, settings=TINY, seed=0, **options):
    agent = planner_for(env, task, settings, seed, **options)
    return agent.predict(env.simulation.observations)[0]


@pytest.mark.parametrize("options", [{}, {"random_body": "training"}, {"sensor_noise": 0.1, "mirror": False}])  # fmt: skip
@pytest.mark.parametrize("task", ["Heading", "Waypoint", "Slalom"])
def test_the_planner_that_sees_the_future_walks_the_same_steps_as_the_walker_will(task, options):
    options = options | {"push_level": 0.3}
    env = started(task, **options)
    copies = planner_for(env, task, CLAIRVOYANT, **options).copies(np.arange(WALKERS), 2)
    generator = np.random.default_rng(1)
    for _ in range(100):  # through new commands and goals
        actions = generator.uniform(-0.2, 0.2, (WALKERS, 2)).astype(np.float32)
        observations, rewards, *ends, _ = env.step(actions)
        if np.any(ends):
            break
        copies.actions[:] = np.repeat(actions, 2, axis=0)
        copies.step_many(np.zeros(copies.n, dtype=np.bool_), 0, copies.n)
        for name in ("walkers", "tasks"):
            original = np.repeat(getattr(env.simulation, name), 2)
            np.testing.assert_array_equal(getattr(copies, name), original)
        np.testing.assert_array_equal(copies.observations, np.repeat(observations, 2, axis=0))
        np.testing.assert_array_equal(copies.rewards, np.repeat(rewards, 2))


def test_other_planners_meet_pushes_of_their_own():
    env = started("Slalom")
    agent = planner_for(env, "Slalom")
    copies = agent.copies(np.arange(WALKERS), 2)
    # what has been drawn is known
    np.testing.assert_array_equal(copies.tasks, np.repeat(env.simulation.tasks, 2))
    assert not np.isin(copies.walkers["key"], env.simulation.walkers["key"]).any()
    actions = np.zeros((WALKERS, 2), dtype=np.float32)
    env.step(actions)
    copies.actions[:] = 0.0
    copies.step_many(np.zeros(copies.n, dtype=np.bool_), 0, copies.n)
    pushes = copies.walkers["ankle_push"].reshape(WALKERS, 2)
    assert np.all(pushes != env.simulation.walkers["ankle_push"][:, None])
    assert np.all(pushes[:, 0] != pushes[:, 1])


@pytest.mark.parametrize("body", [None, "training"])
def test_a_plan_is_worth_the_reward_that_the_environment_gives_for_it(body):
    options = {"random_body": body}
    env = started("Slalom", **options)
    settings = replace(CLAIRVOYANT, window=6.0)
    agent = planner_for(env, "Slalom", settings, **options)
    plans = np.zeros((WALKERS, 1, settings.steps, 3))
    plans[:, :, :3] = np.random.default_rng(1).uniform(-0.4, 0.4, (WALKERS, 1, 3, 3))
    worth = agent._worth(plans, np.arange(WALKERS))[:, 0]
    expected = np.zeros(WALKERS)
    end = env.simulation.walkers["time"] + settings.window
    step = 0
    while np.any(env.simulation.walkers["time"] < end):
        left = end - env.simulation.walkers["time"]
        side = env.simulation.walkers["side"]
        angle, steady, alternating = plans[:, 0, min(step, settings.steps - 1)].T
        actions = np.column_stack([angle, side * steady + alternating])
        rewards = env.step(actions.astype(np.float32))[1]
        share = np.clip(left / env.simulation.walkers["duration"], 0.0, 1.0)
        expected += rewards * share
        step += 1
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
    before, foreseen = decide(env, task), decide(env, task, CLAIRVOYANT)
    env.simulation.walkers["key"] = np.random.default_rng(2).integers(2**60, size=WALKERS)
    np.testing.assert_array_equal(decide(env, task), before)
    if task in ("Slalom", "Metastable"):
        assert np.any(decide(env, task, CLAIRVOYANT) != foreseen)


def test_a_walker_decides_alone_as_among_others_and_the_same_for_a_seed():
    env = started("Slalom")
    together = decide(env, "Slalom", seed=3)
    np.testing.assert_array_equal(decide(env, "Slalom", seed=3), together)
    assert np.any(decide(env, "Slalom", seed=4) != together)
    alone = WalkerEnv("Slalom")
    alone.reset(seed=0)
    alone.simulation.take_over(env.simulation, np.array([1]))
    agent = planner_for(alone, "Slalom", seed=3)
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


@pytest.mark.parametrize(
    ("task", "base", "settings"),
    [
        ("Heading", "feedback", TINY),
        ("Heading", "feedback", CLAIRVOYANT),
        ("Slalom", "lqr", CLAIRVOYANT),
    ],
)
def test_planning_is_no_worse_than_the_agent_that_it_deviates_from(task, base, settings):
    options = EnvOptions(horizon=60.0)
    agent = make_agent(base, AgentRequest(env_id_of(task), options))
    seeds = range(VALIDATION, VALIDATION + 8)
    planner = MpcController(task, options, agent, settings)
    alone, planned = (
        run_seeds(each, task, seeds, options=options).metrics["return"] for each in (agent, planner)
    )
    assert planned.mean() > alone.mean()


def test_planning_alone_steers():
    # the base agent never acts, so that all of the steering is planned
    options = EnvOptions(horizon=50.0)
    settings = replace(TINY, steps=14, samples=24, trust=0.0)
    planner = MpcController("Heading", options, FixedController(), settings)
    seeds = range(VALIDATION, VALIDATION + 8)
    planned = run_seeds(planner, "Heading", seeds, options=options)
    fixed = run_seeds(FixedController(), "Heading", seeds, options=options)
    assert planned.survived.all()
    # the walking rate is paid to both; of the tracking rate the fixed controller gets near a third
    assert planned.metrics["return"].mean() > 1.3 * fixed.metrics["return"].mean()


@pytest.mark.parametrize("task", list(TASK_VERSIONS))
def test_every_task_has_settings_and_a_planner_that_walks(task):
    options = EnvOptions(horizon=3.0)
    # the regulators would take most of the time: their gaits are found at first use
    planner = MpcController(task, options, FixedController())
    results = run_seeds(planner, task, range(VALIDATION, VALIDATION + 2), options=options)
    assert results.survived.all()


def test_the_planner_of_that_name_plans_around_the_best_agent_of_the_package():
    request = AgentRequest(env_id_of("Heading"), EnvOptions(mirror=False))
    name, base = make_base(request)
    assert name == "lqr"  # the policies take mirrored observations
    env = started("Heading", steps=0, mirror=False)
    planner = make_agent("mpc", request)
    assert isinstance(planner, MpcController)
    planner.attach(env)
    named = planner_for(env, "Heading", MpcSettings(), base=base, mirror=False)
    seen = env.simulation.observations
    np.testing.assert_array_equal(planner.predict(seen)[0], named.predict(seen)[0])


def test_planners_work_for_recording_and_delayed_actions_and_bodies_unknown():
    options = EnvOptions(action_delay=True, random_body="held-out", horizon=10.0)
    planner = MpcController("Heading", options, guided("Heading", options), TINY)
    assert record_episode(planner, "Heading", seed=VALIDATION, options=options).fall is None


@pytest.mark.parametrize(
    "bad",
    [
        {"steps": 0},
        {"steps": 2.5},
        {"samples": 3},
        {"iterations": 0},
        {"window": 0.0},
        {"fall": -1.0},
        {"trust": np.inf},
        {"scenarios": 65},
        {"spread": (0.1, 0.2)},
        {"spread": (-0.1, 0.2, 0.2)},
        {"spread": (0.0, 0.0, 0.0)},
    ],
)
def test_bad_settings_are_refused_by_name(bad):
    with pytest.raises(ValueError, match=next(iter(bad))):
        MpcSettings(**bad)


def test_planning_needs_the_environment_that_it_is_for():
    planner = MpcController("Heading", EnvOptions(), FixedController(), TINY)
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
        MpcController("Heading", EnvOptions(), FixedController(), seed=-1)
