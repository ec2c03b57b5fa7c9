"""Walking steps a second on a GPU, by the number of walkers, beside one core of the processor. It needs a GPU and the extra ``gpu``.

Kernel: rows that are on the device already. Environment: constant actions, an array on the device, without infos. Times are by the wall clock.
"""

from __future__ import annotations

from collections.abc import Callable

import gymnasium as gym
import numpy as np

import lean_yaw_env  # noqa: F401
from benchmarks.kernel import WALKERS, all_steps
from benchmarks.measure import SMALLEST, Effort, Measurement, command_line, measure
from benchmarks.populations import perturbed_gait
from lean_yaw_env.reporting import reporting

SIZES = tuple(2**power for power in range(8, 23, 2))
SMALLEST_SIZES = (4,)
EFFORT = Effort(rounds=11, seconds=0.1)


def kernel_steps(n: int, *, moving: bool) -> Callable[[], object]:
    """A call that steps ``n`` walkers on the device."""
    from lean_yaw_env.kernel.cuda import cuda, step_all

    walkers = perturbed_gait(n, moving=moving)
    skip = np.zeros(n, dtype=np.bool_)
    rows = [cuda.to_device(each) for each in (*walkers[:4], skip, walkers.outcomes)]

    def call() -> None:
        step_all(*rows)
        cuda.synchronize()

    return call


def environment_steps(n: int) -> Callable[[], object]:
    """A call that steps an environment of ``n`` walkers on the device."""
    from lean_yaw_env.kernel.cuda import cuda

    env = gym.make_vec("LeanYaw/Heading-v1", num_envs=n, device="cuda", copy=False, step_info=False)
    env.reset(seed=0)
    actions = cuda.to_device(np.zeros((n, 2), dtype=np.float32))

    def call() -> None:
        env.step(actions)
        cuda.synchronize()

    return call


def run(smallest: bool) -> list[Measurement]:
    """All measurements; ``MissingLibraryError`` or ``NoGpuError`` where there is nothing to measure."""
    from lean_yaw_env.kernel.cuda import require_gpu

    require_gpu()
    effort = SMALLEST if smallest else EFFORT
    core = measure({"core": all_steps(perturbed_gait(WALKERS))}, effort, "one core")
    found = [
        Measurement("one_core_steps_per_second", WALKERS / core.median("core"), "steps/s")
    ]  # fmt: skip
    for n in SMALLEST_SIZES if smallest else SIZES:
        cases = {
            "resting": kernel_steps(n, moving=False),
            "moving": kernel_steps(n, moving=True),
            "environment": environment_steps(n),
        }
        timings = measure(cases, effort, f"{n} walkers", threads=2)
        found += [
            Measurement(f"{name}_{n}_steps_per_second", n / timings.median(name), "steps/s")
            for name in cases
        ]
    return found


if __name__ == "__main__":
    with reporting("benchmarks.gpu"):
        command_line(run, __doc__)
