"""Environment ids: registered once, found without an import, named and versioned."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import gymnasium as gym
import pytest

import lean_yaw_env
from lean_yaw_env import register_envs
from lean_yaw_env.registration import ENV_IDS, NAMESPACE, TASK_VERSIONS

ROOT = Path(lean_yaw_env.__file__).parents[1]


def test_every_task_has_an_id_in_the_namespace() -> None:
    assert {"LeanYaw/Heading-v0", "LeanYaw/Walk-v0"} <= set(ENV_IDS)
    for name, version in TASK_VERSIONS.items():
        spec = gym.spec(f"{NAMESPACE}/{name}-v{version}")
        assert (spec.namespace, spec.name, spec.version) == (NAMESPACE, name, version)
        assert spec.kwargs["task"] == name


def test_registering_again_changes_nothing() -> None:
    before = {env_id: gym.registry[env_id] for env_id in ENV_IDS}
    register_envs()
    assert all(gym.registry[env_id] is spec for env_id, spec in before.items())


def test_gymnasium_imports_the_package_named_before_the_id() -> None:
    # Gymnasium 1.0 gave up its plugins: this is what is left for those who do not import the package
    code = (
        "import gymnasium, sys; assert 'lean_yaw_env' not in sys.modules; "
        "env = gymnasium.make('lean_yaw_env:LeanYaw/Walk-v0'); "
        "print(env.spec.id, env.unwrapped.task.name)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["LeanYaw/Walk-v0", "Walk"]


def test_gymnasium_s_own_way_to_name_an_imported_package_keeps_it() -> None:
    gym.register_envs(lean_yaw_env)
    assert set(ENV_IDS) <= set(gym.registry)


def test_an_unknown_version_is_refused_by_gymnasium() -> None:
    with pytest.raises(gym.error.VersionNotFound):
        gym.make("LeanYaw/Walk-v99")
