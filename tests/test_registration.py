"""Environment ids: registered once, found without an import, named and versioned."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import gymnasium as gym
import pytest
from gymnasium.envs.registration import EnvSpec

import lean_yaw_env
from lean_yaw_env import WalkerParameters, register_envs
from lean_yaw_env.envs import Field, Metric, WalkerEnv, WalkerVectorEnv, register_task, task_named
from lean_yaw_env.envs.sb3 import WalkerVecEnv
from lean_yaw_env.registration import ENV_IDS, NAMESPACE, TASK_VERSIONS

ROOT = Path(lean_yaw_env.__file__).parents[1]


def test_every_task_has_an_id_in_the_namespace() -> None:
    assert {"LeanYaw/Heading-v1", "LeanYaw/Walk-v1"} <= set(ENV_IDS)
    for name, version in TASK_VERSIONS.items():
        spec = gym.spec(f"{NAMESPACE}/{name}-v{version}")
        assert (spec.namespace, spec.name, spec.version) == (NAMESPACE, name, version)
        assert spec.make().unwrapped.task.name == name
        assert spec.reward_threshold is None or task_named(name).headline == "return"


def test_registering_again_changes_nothing() -> None:
    before = {env_id: gym.registry[env_id] for env_id in ENV_IDS}
    register_envs()
    assert all(gym.registry[env_id] is spec for env_id, spec in before.items())


def test_gymnasium_imports_the_package_named_before_the_id() -> None:
    # Gymnasium 1.0 gave up its plugins: this is what is left for those who do not import the package
    code = (
        "import gymnasium, sys; assert 'lean_yaw_env' not in sys.modules; "
        "env = gymnasium.make('lean_yaw_env:LeanYaw/Walk-v1'); "
        "print(env.spec.id, env.unwrapped.task.name)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["LeanYaw/Walk-v1", "Walk"]


def test_gymnasium_s_own_way_to_name_an_imported_package_keeps_it() -> None:
    gym.register_envs(lean_yaw_env)
    assert set(ENV_IDS) <= set(gym.registry)


def test_an_unknown_version_is_refused_by_gymnasium() -> None:
    with pytest.raises(gym.error.VersionNotFound):
        gym.make("LeanYaw/Walk-v99")


@pytest.mark.parametrize("make", [gym.make, lambda *a, **k: gym.make_vec(*a, num_envs=2, **k)])
def test_an_id_s_task_cannot_be_changed(make) -> None:
    with pytest.raises(ValueError, match="task is fixed by the id to 'Heading', got 'Waypoint'"):
        make("LeanYaw/Heading-v1", task="Waypoint")


@pytest.mark.parametrize("kind", [WalkerEnv, partial(WalkerVectorEnv, 2), partial(WalkerVecEnv, 2)])
def test_environments_take_the_ids_that_gymnasium_takes(kind) -> None:
    for name in ("Metastable", "LeanYaw/Metastable-v1", "lean_yaw_env:LeanYaw/Metastable-v1"):
        made = kind(task=name)
        assert getattr(made, "walkers", made).task.name == "Metastable"
    with pytest.raises(
        ValueError, match=r"task must be one of .*, got 'Headin'; did you mean 'Heading'"
    ):
        kind(task="Headin")


def test_a_misspelt_option_names_its_neighbour() -> None:
    with pytest.raises(TypeError, match="unexpected keyword argument 'slop'; did you mean 'slope'"):
        gym.make("LeanYaw/Heading-v1", slop=0.01)
    with pytest.raises(TypeError, match="argument 'step_inf'; did you mean 'step_info'"):
        gym.make_vec("LeanYaw/Heading-v1", num_envs=2, step_inf=False)


def test_a_spec_survives_json_with_the_walker_s_parameters() -> None:
    made = gym.make("LeanYaw/Walk-v1", parameters={"slope": 0.02, "hip_width": 0.2}, horizon=20.0)
    assert made.spec is not None
    again = EnvSpec.from_json(made.spec.to_json()).make()
    assert again.unwrapped.options == made.unwrapped.options
    assert again.unwrapped.options.parameters == WalkerParameters(slope=0.02, hip_width=0.2)


_OWN_TASK = """
from lean_yaw_env.envs import Feature, Field, Metric, Task, formula, register_task, uniform

@formula
def start(walker, task):
    task.wanted = uniform(walker, 0.3, 0.5)

@formula
def reward(walker, task):
    return BONUS * walker.duration - abs(walker.speed - task.wanted)

@formula
def features(walker, task):
    return (task.wanted,)

BONUS = 1.0
TASK = Task(
    name="Pace", fields=(Field("wanted", "", "speed"),), start=start, reward=reward, features=features,
    observed=(Feature("wanted", 0.1, "", "speed", 0.4),),
    metrics={"wanted": Metric("wanted", None, "speed")},
    summary="Walk at a pace.", reward_text="1 - speed error", history=("0: the first.",),
)
register_task(TASK, "Mine/Pace-v0")
"""

_USE_IT = """
import pickle
import gymnasium as gym, numpy as np
from lean_yaw_env.envs.outputs import outputs_of
env = gym.make("own_task:Mine/Pace-v0")
seen, info = env.reset(seed=3)
first = env.step(np.zeros(2, np.float32))
many = gym.make_vec("own_task:Mine/Pace-v0", num_envs=2)
many.reset(seed=3)
both = many.step(np.zeros((2, 2), np.float32))
assert (both[0][0] == first[0]).all() and both[1][0] == first[1]
assert pickle.loads(pickle.dumps(env.unwrapped)).task.name == "Pace"
outputs = outputs_of(env.unwrapped.task)
print(seen.shape, float(first[1]), 0.3 <= info["wanted"] <= 0.5, sum(outputs.stats.cache_hits.values()))
"""


def test_a_task_of_another_package_is_one_file_and_is_kept_compiled(tmp_path: Path) -> None:
    own = tmp_path / "own_task.py"
    bonus = 1.0 + 1e-12 * (time.time_ns() % 10**9)  # a formula that was never compiled before

    def use() -> list[str]:
        done = subprocess.run(
            [sys.executable, "-c", _USE_IT],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": f"{tmp_path}:{ROOT}"},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.split()

    own.write_text(_OWN_TASK.replace("BONUS = 1.0", f"BONUS = {bonus!r}"))
    *first, hits = use()
    assert first[0] == "(7,)"
    assert (first[-1], hits) == ("True", "0")
    assert use() == [*first, "1"]
    # its formulas are part of what the machine code is kept by
    own.write_text(_OWN_TASK.replace("BONUS = 1.0", f"BONUS = {bonus + 1.0!r}"))
    *other, hits = use()
    assert hits == "0"
    assert float(other[1]) > float(first[1])


def test_a_task_cannot_take_another_s_name_or_a_field_of_the_walker() -> None:
    task = task_named("Walk")
    with pytest.raises(ValueError, match="name must be a task's own, got 'Walk'"):
        register_task(replace(task, summary="Walk away."), "Mine/Walk-v0")
    with pytest.raises(
        ValueError, match="fields must not have names of the walker's record, got time"
    ):
        replace(task, fields=(Field("time", "", "of day"),))
    with pytest.raises(ValueError, match=r"must name fields of the task .*, got 'pace'"):
        replace(task, metrics={"pace": Metric("pace")})
