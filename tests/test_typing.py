"""The package's types: a user's script is clean under pyright's strict rules."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import lean_yaw_env

ROOT = Path(lean_yaw_env.__file__).parents[1]

SCRIPT = """
import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from lean_yaw_env import Walker, WalkerParameters, find_limit_cycle
from lean_yaw_env.envs import EnvOptions, FallCode, WalkerEnv, WalkerVectorEnv

parameters = WalkerParameters(slope=0.01)
walker = Walker(parameters)
gait = find_limit_cycle(walker)
step = walker.step(gait.state, mass_offset=0.02)
print(step.state.shape, step.fall, gait.speed)

env = WalkerEnv("Heading", horizon=30.0, parameters=parameters)
wrapped: gym.Env[NDArray[np.float32], NDArray[np.float32]] = gym.wrappers.TimeLimit(env, 100)
observation, info = wrapped.reset(seed=1)
total = 0.0
for _ in range(10):
    action = 0.1 * wrapped.action_space.sample()
    observation, reward, terminated, truncated, info = wrapped.step(action)
    total += float(reward)
    if terminated or truncated:
        print(FallCode(info["fall"]).word, observation.mean())
        observation, info = wrapped.reset()
state = env.get_state()
env.set_state(state)

many = WalkerVectorEnv(8, "LeanYaw/Walk-v1", step_info=False)
observations, _ = many.reset(seed=1, options={"stance": "left"})
actions = np.zeros((8, 2), dtype=np.float32)
observations, rewards, terminations, truncations, _ = many.step(actions)
ended: NDArray[np.bool_] = terminations | truncations
print(observations.shape, rewards.sum(), ended.any(), EnvOptions(mirror=False).mirror)
"""


def test_a_script_is_clean_under_strict_rules(tmp_path: Path) -> None:
    pyright = shutil.which("pyright") or shutil.which("pyright", path=Path(sys.executable).parent)
    if pyright is None:
        pytest.skip("pyright is not installed")
    (tmp_path / "script.py").write_text(SCRIPT)
    # and a mistake, so that silence means something
    mistake = "\nwrong: str = walker.step(gait.state).duration\n"
    (tmp_path / "mistaken.py").write_text(SCRIPT + mistake)
    settings = {
        "include": ["script.py", "mistaken.py"],
        "typeCheckingMode": "strict",
        "extraPaths": [str(ROOT)],
        # of other packages, not of this one
        "reportMissingTypeStubs": False,
    }
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings))
    done = subprocess.run(
        [pyright, "--outputjson", "--pythonpath", sys.executable, "-p", str(tmp_path)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    if not done.stdout.startswith("{"):
        pytest.skip(f"pyright does not run: {done.stderr[:200]}")
    found = json.loads(done.stdout)["generalDiagnostics"]
    wrong = {"script.py": [], "mistaken.py": []}
    for each in found:
        wrong[Path(each["file"]).name].append(each["message"])
    assert wrong["script.py"] == []
    assert len(wrong["mistaken.py"]) == 1
    assert '"float" is not assignable to "str"' in wrong["mistaken.py"][0]
    assert (ROOT / "lean_yaw_env" / "py.typed").is_file()
