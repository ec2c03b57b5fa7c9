"""What infos add to the time of a step of a vector environment, with random actions, in one thread."""

from __future__ import annotations

from benchmarks.environments import vector_steps, walkers
from benchmarks.measure import FULL, SMALLEST, Effort, Measurement, command_line, measure

SIZES = (16, 64, 1024, 4096)
SMALLEST_SIZES = (8,)
MANY = 64
"""Walkers from which on infos may cost no more than the target; the work for fewer is mostly Python's."""


def _cost(effort: Effort, n: int) -> Measurement:
    steps = {info: vector_steps(walkers(n, step_info=info), "random") for info in (True, False)}
    times = measure({str(info): step for info, step in steps.items()}, effort, f"{n} walkers")
    cost = 100.0 * (times.ratio("True", "False") - 1.0)
    if n < MANY:
        return Measurement(f"infos_{n}_cost", cost, "%")
    return Measurement(f"infos_{n}_cost", cost, "%", "<=", 10.0)


def run(smallest: bool) -> list[Measurement]:
    """The cost at each size."""
    effort, sizes = (SMALLEST, SMALLEST_SIZES) if smallest else (FULL, SIZES)
    return [_cost(effort, n) for n in sizes]


if __name__ == "__main__":
    command_line(run, __doc__)
