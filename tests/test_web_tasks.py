"""Tasks and agents on the web page are the package's: the same observations, rewards and actions."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

import agents
from agents import AgentRequest, make_agent
from agents.policies.policy_files import SHIPPED, shipped_folder, shipped_seeds
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.registration import NAMESPACE, TASK_VERSIONS
from lean_yaw_env.viewer import PageServer
from lean_yaw_env.viewer.shipped import agent_index
from tests.browser import PATIENCE, chromium
from tests.test_web_kernel import build_kernel

STEPS = 100
EPISODES = {"Metastable": 150, "Level": 300, "LevelUphill": 200, "Energy": 300}
"""Tasks in which random actions soon end in a fall take more episodes than the 40 of the others for as many steps."""
# WebAssembly orders sums of a reward in another way.
REWARD = 1e-12
# The slope of Hills is a sum of sines, which are another C library's in the page; their rounding grows from step to step. Numbers are in single
# precision; a fall makes them ten times as large, and a hundred times as sensitive.
SLOPE, SLOPE_AT_FALL = 2e-6, 1e-3


# Columns of the rows that are compared
ENDS, REWARDS, FELL, SEEN = [0, 1, 3, 4], 2, 3, slice(5, None)


@pytest.fixture(scope="module")
def page():
    with PageServer() as server, chromium() as browser:
        opened = browser.new_page()
        opened.set_default_timeout(PATIENCE)
        opened.goto(f"{server.address}#quality=4")
        opened.wait_for_selector("html[data-ready=true]")
        opened.keyboard.press("p")
        yield opened


def test_tasks_are_compiled_from_the_sources_as_they_are():
    assert not build_kernel.is_stale(build_kernel.TASKS_PART), (
        "envs have changed: run web/build_kernel.py, then npm run build in web"
    )
    described = json.loads(build_kernel.TASKS.read_text())
    assert described == json.loads(json.dumps(build_kernel.tasks())), (
        "tasks have changed: run web/build_kernel.py, then npm run build in web"
    )


def on_the_page(page, task, keys, actions):
    """Observations, rewards and ends of episodes on the page: rows of (episode, step, reward, terminated, truncated, observation...)."""
    rows = page.evaluate(
        """async ([task, keys, actions]) => {
            const module = await leanYaw.tasks.load();
            const rows = [];
            keys.forEach((key, i) => {
                const episode = module.episode(task, BigInt(key));
                rows.push([i, -1, 0, 0, 0, ...episode.observation]);
                for (let k = 0; k < actions.length && !episode.isOver; k++) {
                    episode.step(actions[k][i]);
                    rows.push([i, k, episode.reward, +episode.terminated, +episode.truncated, ...episode.observation]);
                }
            });
            return rows;
        }""",
        [task, [str(key) for key in keys], actions.tolist()],
    )
    return np.array(rows)


def in_the_package(task, keys, actions):
    simulation = Simulation(task_named(task), EnvOptions(), len(keys))
    draws = [SimpleNamespace(bit_generator=SimpleNamespace(random_raw=lambda key=key: key)) for key in keys]  # fmt: skip
    everyone = np.ones(len(keys), dtype=bool)
    simulation.start(everyone, draws)
    rows = [np.column_stack([np.arange(len(keys)), -everyone.astype(float), *np.zeros((3, len(keys))), simulation.observations])]  # fmt: skip
    over = ~everyone
    for k, action in enumerate(actions):
        simulation.actions[:] = action
        simulation.renew_results()
        simulation.step_many(over, 0, len(keys))
        row = np.column_stack([np.arange(len(keys)), np.full(len(keys), k), simulation.rewards, *simulation.ends, simulation.observations])  # fmt: skip
        rows.append(row[~over])
        over = over | simulation.terminated | simulation.truncated
    found = np.vstack(rows)
    return found[np.lexsort((found[:, 1], found[:, 0]))]


@pytest.mark.parametrize("task", TASK_VERSIONS)
def test_episodes_have_the_packages_observations_and_rewards(page, task):
    rng, n = np.random.default_rng(1), EPISODES.get(task, 40)
    keys = rng.integers(0, 2**64, n, dtype=np.uint64).tolist()
    pump = json.loads(build_kernel.TASKS.read_text())["tasks"][task]["pump"]
    actions = rng.uniform(-1.0, 1.0, (STEPS, n, 2)) * rng.uniform(0.05, 0.5, (1, n, 1))
    actions = np.clip(actions + np.array([0.0, pump]), -1.0, 1.0).astype(np.float32)
    expected, ours = in_the_package(task, keys, actions), on_the_page(page, task, keys, actions)
    assert len(expected) > 1500
    assert np.array_equal(ours[:, ENDS], expected[:, ENDS])
    np.testing.assert_allclose(
        ours[:, REWARDS], expected[:, REWARDS], rtol=0.0, atol=1e-3 if task == "Hills" else REWARD
    )
    if task != "Hills":
        assert np.array_equal(ours[:, SEEN], expected[:, SEEN])
        return
    walks = expected[:, FELL] == 0.0
    for rows, tolerance in ((walks, SLOPE), (~walks, SLOPE_AT_FALL)):
        np.testing.assert_allclose(ours[rows, SEEN], expected[rows, SEEN], rtol=0.0, atol=tolerance)


def shipped():
    """The first seed of every shipped policy that sees what its task shows in the page."""
    for task, version in TASK_VERSIONS.items():
        folder = SHIPPED / f"{task}-v{version}"
        for place in sorted(folder.iterdir()) if folder.is_dir() else []:
            env_id = f"{NAMESPACE}/{task}-v{version}"
            yield env_id, place.name, shipped_seeds(env_id, place.name)[0]


@pytest.mark.parametrize(("env_id", "algorithm", "seed"), list(shipped()))
def test_policies_act_on_the_page_as_in_the_package(page, env_id, algorithm, seed):
    policy = agents.load(env_id, algorithm=algorithm, seed=seed)
    names = list(policy.card.layout.names)
    observations = np.random.default_rng(2).normal(0.0, 0.7, (300, len(names))).astype(np.float32)
    expected, memory = np.empty((300, 2)), None
    for k, observation in enumerate(observations):
        expected[k], memory = policy.predict(observation, memory)
    place = shipped_folder(env_id, algorithm, seed).relative_to(SHIPPED).as_posix()
    ours = page.evaluate(
        """async ([place, names, observations]) => {
            const policy = (await leanYaw.tasks.loadPolicy(place, names)).fresh();
            return observations.map((observation) => policy.act(observation));
        }""",
        [f"agents/{place}/policy", names, observations.tolist()],
    )
    # the package multiplies matrices in single precision, the page sums in double precision: 5e-7 was the largest difference
    np.testing.assert_allclose(np.array(ours), expected, rtol=0.0, atol=5e-6)


def test_a_linear_law_acts_on_the_page_as_in_the_package(page):
    law = make_agent("linear", AgentRequest("LeanYaw/Slalom-v1", EnvOptions()))
    observations = np.random.default_rng(3).normal(0.0, 0.7, (300, 11)).astype(np.float32)
    ours = page.evaluate(
        """async (observations) => {
            const { laws } = await leanYaw.tasks.agentIndex();
            const law = new leanYaw.tasks.LinearAgent(laws.Slalom);
            return observations.map((observation) => law.act(observation));
        }""",
        observations.tolist(),
    )
    assert np.array_equal(np.array(ours, dtype=np.float32), law.predict(observations)[0])


def choose(page, task, walkers):
    """Open a task in the tab for playing, with these walkers."""
    page.locator("#tab-tasks").click()
    page.wait_for_selector("#scores tbody tr")
    page.locator("#task").select_option(task)
    page.wait_for_function("task => leanYaw.active().settings().task === task", arg=task)
    for name in walkers:
        page.locator(f"#walker-{name}").check()
    for box in page.locator("[id^=walker-]").all():
        if box.get_attribute("id").removeprefix("walker-") not in walkers:
            box.uncheck()
    order = "() => Array.from(document.querySelectorAll('#scores tbody tr'), (row) => row.dataset.walker).join()"  # fmt: skip
    page.wait_for_function(f"names => ({order})() === names", arg=",".join(walkers))


def rows(page):
    """Of each walker in the table of scores: how it is, its score, and the mean score beside it."""
    found = page.evaluate(
        """() => Array.from(document.querySelectorAll("#scores tbody tr"), (row) =>
            [row.dataset.walker, row.dataset.state, Number(row.dataset.score), row.cells[3].textContent])"""
    )
    return {name: (state, score, mean) for name, state, score, mean in found}


def steps(page, n):
    page.evaluate("n => { for (let k = 0; k < n; k++) leanYaw.active().stepOnce(); }", n)


def test_an_agent_reaches_a_goal(page):
    choose(page, "Waypoint", ["ppo"])
    for _ in range(20):
        steps(page, 20)
        if rows(page)["ppo"][1] >= 1.0:
            break
    assert rows(page)["ppo"][1] >= 1.0


def test_walkers_that_race_have_the_packages_scores_and_the_agents_means_beside_them(page):
    choose(page, "Slalom", ["you", "fixed", "ppo"])
    seed = page.evaluate("Number(leanYaw.active().settings().seed)")
    steps(page, 60)
    found = rows(page)
    policy, key = agents.load("LeanYaw/Slalom-v1"), seed * 0x9E3779B97F4A7C15 % 2**64
    still = SimpleNamespace(predict=lambda observation: (np.zeros((1, 2)), None))
    for name, agent in (("fixed", still), ("you", still), ("ppo", policy)):
        # an action is good to 1e-6, a hundred of which move a reward by less
        assert abs(found[name][1] - _return(agent, key, 60)) < 1e-3
    assert found["ppo"][1] > found["fixed"][1]
    with_means = agent_index()["agents"]["Slalom-v1"]["ppo"]["means"]["return"]
    assert float(found["ppo"][2]) == pytest.approx(with_means, abs=0.05)


def _return(agent, key, n_steps):
    """The sum of an agent's rewards over the first steps of an episode of Slalom, or until it falls."""
    simulation = Simulation(task_named("Slalom"), EnvOptions(), 1)
    draw = SimpleNamespace(bit_generator=SimpleNamespace(random_raw=lambda: key))
    simulation.start(np.ones(1, dtype=bool), [draw])
    total = 0.0
    for _ in range(n_steps):
        simulation.actions[:] = agent.predict(simulation.observations)[0]
        simulation.renew_results()
        simulation.step_many(np.zeros(1, dtype=bool), 0, 1)
        total += simulation.rewards[0]
        if simulation.ends.any():
            break
    return total


def test_arrow_keys_steer_in_a_task_and_another_episode_is_another(page):
    choose(page, "Heading", ["you"])
    page.locator("#stage").focus()
    page.keyboard.down("ArrowRight")
    steps(page, 6)
    page.keyboard.up("ArrowRight")
    assert page.evaluate("leanYaw.active().runners[0].walk.records.at(-1).commandedOffset") > 0.0
    first = page.evaluate("leanYaw.active().runners[0].walk.records[0].state")
    page.locator("#another").click()
    page.wait_for_function("leanYaw.active().runners[0].walk.records.length === 0")
    assert page.evaluate("leanYaw.active().runners[0].walk.current.state") != first


def test_a_policy_of_ones_own_walks_its_task(page, tmp_path):
    agents.save(agents.load("LeanYaw/Slalom-v1", algorithm="apg"), tmp_path)
    with PageServer(policy=tmp_path, agents=["apg"]) as server:
        own = page.context.browser.new_page()
        own.set_default_timeout(PATIENCE)
        own.goto(f"{server.address}&quality=4")
        own.wait_for_selector("html[data-ready=true]")
        own.wait_for_selector("#scores tbody tr")
        own.keyboard.press("p")
        steps(own, 10)
        found = rows(own)
        own.close()
    assert list(found) == ["apg", "own"]
    assert found["own"][1] == found["apg"][1]
