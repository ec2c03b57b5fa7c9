"""Tasks and agents on the web page are the package's: the same observations, rewards and actions."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

import agents
from agents.policies.policy_files import SHIPPED, shipped_folder, shipped_seeds
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.registration import NAMESPACE, TASK_VERSIONS
from lean_yaw_env.viewer import PAGE, PageServer
from tests.browser import PATIENCE, chromium
from tests.test_web_kernel import build_kernel

EPISODES, STEPS = 40, 100
# Sines, exponentials and arc tangents are the C library's, in the page another one than here: where they are drawn from or observed, numbers
# differ by their rounding, grown by a hundred steps. Single precision has six times a hundred-millionth of its own.
ROUNDING = 2e-6
LIBRARY = ("Slalom", "Hills", "Waypoint", "Race", "UTurn", "LevelUphill")
"""Tasks with such functions in what they draw or observe; all others have the same bits."""


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
    rng = np.random.default_rng(1)
    keys = rng.integers(0, 2**64, EPISODES, dtype=np.uint64).tolist()
    pump = json.loads(build_kernel.TASKS.read_text())["tasks"][task]["pump"]
    spread = rng.uniform(0.05, 0.5, (1, EPISODES, 1))
    actions = rng.uniform(-1.0, 1.0, (STEPS, EPISODES, 2)) * spread + [0.0, pump]
    actions = np.clip(actions, -1.0, 1.0).astype(np.float32)
    expected, ours = in_the_package(task, keys, actions), on_the_page(page, task, keys, actions)
    print(task, len(expected), np.abs(ours - expected).max() if ours.shape == expected.shape else (ours.shape, expected.shape))
    assert len(expected) > 1000
    if task in LIBRARY:
        np.testing.assert_allclose(ours, expected, rtol=0.0, atol=ROUNDING)
    else:
        assert np.array_equal(ours, expected)


def shipped():
    """The first seed of every shipped policy that sees what its task shows in the page."""
    for task, version in TASK_VERSIONS.items():
        folder = SHIPPED / f"{task}-v{version}"
        for place in sorted(folder.iterdir()) if folder.is_dir() else []:
            env_id = f"{NAMESPACE}/{task}-v{version}"
            yield env_id, place.name, shipped_seeds(env_id, place.name)[0]


@pytest.mark.parametrize(("env_id", "algorithm", "seed"), shipped())
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
    # the package multiplies matrices in single precision, the page sums in double precision
    np.testing.assert_allclose(np.array(ours), expected, rtol=0.0, atol=1e-4)
    print(np.abs(ours - expected).max())
