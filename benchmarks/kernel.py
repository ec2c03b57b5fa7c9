"""The step itself: batches against single steps, threads, scipy, derivatives, and calls from Python.

Of ``--json``: rates are walking steps per second, ``max_abs_error`` is the largest difference of any coordinate of the section state from
a reference at a tolerance of 1e-13, and ``*_over_*`` are ratios of times within one run.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.loops import step_each
from benchmarks.measure import FULL, SMALLEST, Measurement, command_line, measure
from benchmarks.populations import Population, perturbed_gait, slow_near_falls
from benchmarks.scipy_step import ScipyStep
from lean_yaw_env import Walker
from lean_yaw_env.analysis.limit_cycle import find_gait
from lean_yaw_env.kernel.batch import step_batch
from lean_yaw_env.kernel.jacobian import step_jacobian
from lean_yaw_env.kernel.records import Body, Command, Outcome
from lean_yaw_env.kernel.step import step
from lean_yaw_env.threads import share_out

WALKERS = 4096
SMALLEST_WALKERS = 32
EVALUATIONS = Outcome._fields.index("evaluations")
COMPARED = 20  # walkers that scipy steps
ACCURATE = 1e-10


def all_steps(population: Population) -> Callable[[], None]:
    """The batch kernel on one core."""
    return lambda: step_batch(*population, 0, population.size)


def two_cores(population: Population) -> Callable[[], object]:
    """The batch kernel on two."""
    return lambda: share_out(
        lambda first, last: step_batch(*population, first, last), population.size, 2
    )


def single_step(population: Population) -> Callable[[], None]:
    """A call of the scalar kernel from Python: the gait, with the first walker's body and command."""
    body, command, outcome = population.bodies[0], population.commands[0], population.outcomes[0]
    gait = find_gait(Walker())
    return lambda: step(body, command, gait, 1.0, outcome)


def single_jacobian(population: Population) -> Callable[[], object]:
    """A call for the exact derivatives of the same step."""
    body = Body(*population.bodies[0].tolist())
    command = Command(*population.commands[0].tolist())
    gait = find_gait(Walker())
    return lambda: step_jacobian(body, command, gait, 1.0, inputs=8)


def largest_error(population: Population, walkers: int) -> float:
    """Largest difference of a section state's coordinate from the reference, over the first walkers of a population."""
    step_batch(*population, 0, walkers)
    reference = ScipyStep(population, 1e-13, 1e-13)
    return max(
        float(np.abs(reference.polished_step(i) - population.outcomes[i, :5]).max())
        for i in range(walkers)
    )


def mean_evaluations(population: Population) -> float:
    """Right-hand sides per step."""
    step_batch(*population, 0, population.size)
    return float(population.outcomes[:, EVALUATIONS].mean())


def run(smallest: bool) -> list[Measurement]:
    """All measurements of the kernel."""
    n, effort = (SMALLEST_WALKERS, SMALLEST) if smallest else (WALKERS, FULL)
    compared = 2 if smallest else COMPARED
    resting, moving = perturbed_gait(n), perturbed_gait(n, moving=True)
    scipy = ScipyStep(resting)
    cases: dict[str, Callable[[], object]] = {
        "scalar": lambda: step_each(*resting),
        "batch": all_steps(resting),
        "moving_scalar": lambda: step_each(*moving),
        "moving_batch": all_steps(moving),
        "single": single_step(resting),
        "jacobian": single_jacobian(resting),
        "scipy": lambda: [scipy.step(i) for i in range(compared)],
    }
    times = measure(cases, effort, "kernel")
    shared = measure(
        {"one": all_steps(resting), "two": two_cores(resting)}, effort, "two cores", threads=2
    )
    over_scipy = times.ratio("scipy", "batch") * n / compared
    return [
        *(Measurement(f"{name}_steps_per_second", n / times.median(name), "1/s") for name in list(cases)[:4]),
        Measurement("solve_ivp_steps_per_second", compared / times.median("scipy"), "1/s"),
        Measurement("single_call", times.median("single") * 1e6, "us", "<=", 3.0, "from Python"),
        Measurement("jacobian_call", times.median("jacobian") * 1e6, "us", note="state and command"),
        Measurement("batch_two_cores_steps_per_second", n / shared.median("two"), "1/s"),
        Measurement("batch_over_scalar", times.ratio("scalar", "batch"), "x", ">=", 4.0, "one core"),
        Measurement("moving_batch_over_scalar", times.ratio("moving_scalar", "moving_batch"), "x", ">=", 3.0),
        Measurement("batch_over_solve_ivp", over_scipy, "x", ">=", 2000.0, "DOP853, also within 1e-10"),
        Measurement("jacobian_over_single_call", times.ratio("jacobian", "single"), "x", "<=", 14.0),
        Measurement("two_cores_over_one", shared.ratio("one", "two"), "x", ">=", 1.8),
        Measurement("max_abs_error", largest_error(resting, compared), "", "<=", ACCURATE, "masses at rest"),
        Measurement("moving_max_abs_error", largest_error(moving, compared), "", "<=", ACCURATE, "moving"),
        Measurement("evaluations", mean_evaluations(resting), "a step", "<=", 40.0, "gait perturbed"),
        Measurement("near_fall_evaluations", mean_evaluations(slow_near_falls(n)), "a step", "<=", 75.0, "slow near-falls"),
        Measurement("moving_evaluations", mean_evaluations(moving), "a step", note="masses moving"),
    ]  # fmt: skip


if __name__ == "__main__":
    command_line(run, __doc__)
