"""What runs in CUDA's simulator, in a process of its own: ``test_gpu`` starts it. There the formulas are plain Python, on the CPU as well.

``python gpu_simulation.py batch FILE`` writes outcomes of ``step_batch``; ``python gpu_simulation.py envs TASK ...`` compares environments.
"""

from __future__ import annotations

import sys
import warnings
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import lean_yaw_env  # noqa: F401
from lean_yaw_env import WalkerParameters
from lean_yaw_env.batch import step_batch

STEPS = 3
OPTIONS: dict[str, dict[str, Any]] = {
    "Heading": {"sensor_noise": 0.1, "push_level": 0.5, "action_delay": True, "mirror": False},
    "Waypoint": {"random_body": "training", "hidden_rates": True},
}
"""Of some tasks; the others have their own."""


def batch() -> tuple[WalkerParameters, Any, Any, Any]:
    """A walker's parameters, states, sides and mass offsets of a few steps, one of which is a fall."""
    states = np.array([0.0, 0.155, 0.0, -0.42, 0.0]) + np.zeros((5, 1))
    states += np.random.default_rng(0).uniform(-0.01, 0.01, states.shape)
    states[4, 3] = -0.1
    return (
        WalkerParameters(),
        states,
        np.array([1.0, -1.0, 1.0, 1.0, -1.0]),
        np.linspace(0, 0.02, 5),
    )


def step(device: str) -> Any:
    """Outcomes of these steps."""
    parameters, states, sides, offsets = batch()
    return step_batch(
        parameters, states, sides, mass_offsets=offsets, previous_offsets=0.0, device=device
    ).outcomes


def require_equal(name: str, here: Any, there: Any, mask: Any = slice(None)) -> None:
    """The rows of the mask must be equal on the CPU and on the device, bit for bit."""
    np.testing.assert_array_equal(np.asarray(here)[mask], there.copy_to_host()[mask], name)


def compare(task: str, mode: str) -> int:
    """Walk a few steps with both environments, so short that every episode ends; return how many have ended."""
    make = {"num_envs": 2, "autoreset_mode": mode, "max_episode_steps": 2, **OPTIONS.get(task, {})}
    here, there = (
        gym.make_vec(f"LeanYaw/{task}-v1", device=each, **make) for each in ("cpu", "cuda")
    )
    for host, device in zip(here.reset(seed=3), there.reset(seed=3), strict=True):
        for key in host if isinstance(host, dict) else ():
            require_equal(key, host[key], device[key])
    ended = 0
    for actions in np.random.default_rng(1).uniform(-0.3, 0.3, (STEPS, 2, 2)).astype(np.float32):
        *results, info = here.step(actions)
        *others, other = there.step(actions)
        for name, host, device in zip(
            ("observations", "rewards", "terminated", "truncated"), results, others, strict=True
        ):
            require_equal(f"{task} {mode}: {name}", host, device)
        over = results[2] | results[3]
        ended += int(over.sum())
        for key in info:
            if not key.lstrip("_").startswith("final"):
                require_equal(f"{task} {mode}: info {key}", info[key], other[key])
        if "final_obs" in info:
            last = np.stack([each for each in info["final_obs"] if each is not None])
            np.testing.assert_array_equal(last, other["final_obs"].copy_to_host()[over])
            for key, values in info["final_info"].items():
                require_equal(f"final {key}", values, other["final_info"][key], over)
    for name, host in here.get_state().items():
        device = there.get_state()[name]
        assert host.tobytes() == device.tobytes(), f"{task} {mode}: state {name}"
    return ended


def check_input() -> None:
    """Bad actions are refused and change nothing."""
    env = gym.make_vec("LeanYaw/Heading-v1", num_envs=2, device="cuda")
    env.reset(seed=0)
    before = env.get_state()
    for bad in (np.full((2, 2), np.nan), np.zeros((3, 2))):
        with pytest.raises(ValueError, match="actions must "):
            env.step(bad.astype(np.float32))
    after = env.get_state()
    assert all(before[name].tobytes() == after[name].tobytes() for name in before)


if __name__ == "__main__":
    # Python's integers of 64 bits warn when they wrap around, compiled ones do not
    warnings.simplefilter("ignore", RuntimeWarning)
    what, *names = sys.argv[1:]
    if what == "batch":
        np.savez(names[0], here=step("cpu"), there=step("cuda"))
    else:
        for number, task in enumerate(names):
            mode = ("NextStep", "SameStep")[number % 2]
            assert compare(task, mode) >= 2, "no episode has ended"
        check_input()
