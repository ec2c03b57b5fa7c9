"""Steps per second of this package and of what its users compare it with, on this machine, in one thread but where it says two.

    python -m benchmarks.compare [--json] [--smallest] [--plot FILE]

A step of the walker is a whole walking step, from heel strike to heel strike, with its end found exactly and its error controlled; the note beside a
peer says what its step is instead.
"""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym

from benchmarks.environments import HEADING, single_steps, vector_steps, walkers
from benchmarks.kernel import all_steps, single_step, two_cores
from benchmarks.measure import FULL, SMALLEST, machine, measure, parser
from benchmarks.populations import perturbed_gait
from benchmarks.scipy_step import ScipyStep
from lean_yaw_env.rendering.figures import new_figure, save_figure
from lean_yaw_env.rendering.palette import BLUE, LIGHT_GREY, unit_colour

OWN, OTHER = unit_colour(BLUE), unit_colour(LIGHT_GREY)
VECTOR = 1024
BATCH = 4096
EULER = "one Euler step of 0.02 s; no contact, no error control"


class Case(NamedTuple):
    """One line of the comparison: ``steps`` steps in a call of ``play``."""

    name: str
    play: Callable[[], object]
    steps: int
    note: str
    ours: bool = False
    threads: int = 1


@dataclass(frozen=True)
class Speed:
    """A case's result."""

    name: str
    steps_per_second: float
    microseconds_per_step: float
    note: str
    ours: bool


def _own_cases(n: int, batch: int, steps: int) -> list[Case]:
    population = perturbed_gait(batch)
    own = "a whole walking step, to 1e-10"
    return [
        Case("kernel, batch, two threads", two_cores(population), batch, own, True, 2),
        Case("kernel, batch", all_steps(population), batch, own, True),
        Case("kernel, single call", single_step(perturbed_gait(1)), 1, own, True),
        Case(f"{HEADING}, vector of {n}", vector_steps(walkers(n), "fixed"), n, "and the task", True),
        Case(f"{HEADING}, vector of {n}, masses moving", vector_steps(walkers(n), "random"), n, "random actions", True),
        Case(HEADING, single_steps(HEADING, steps, "fixed"), steps, "unwrapped, Python", True),
        Case(f"{HEADING}, masses moving", single_steps(HEADING, steps, "random"), steps, "random actions", True),
    ]  # fmt: skip


def _other_cases(n: int, steps: int) -> list[Case]:
    """Peers; MuJoCo and EnvPool are measured where they are installed."""
    cases = []
    for env_id, note in (
        ("CartPole-v1", EULER),
        ("Pendulum-v1", "one Euler step of 0.05 s; no contact, no error control"),
    ):
        sync = gym.make_vec(env_id, num_envs=n, vectorization_mode="sync")
        cases += [
            Case(env_id, single_steps(env_id, steps, "random"), steps, note),
            Case(f"{env_id}, SyncVectorEnv of {n}", vector_steps(sync, "random"), n, note),
        ]
    native = gym.make_vec("CartPole-v1", num_envs=n, vectorization_mode="vector_entry_point")
    name = f"CartPole-v1, native vector of {n}"
    cases.append(Case(name, vector_steps(native, "random"), n, EULER))
    if importlib.util.find_spec("mujoco"):
        note = "4 fixed steps of 0.002 s, soft contact: a walking step takes some hundred"
        play = single_steps("Walker2d-v5", steps, "random")
        cases.append(Case("Walker2d-v5 (MuJoCo)", play, steps, note))
    if importlib.util.find_spec("envpool"):
        import envpool  # pyright: ignore[reportMissingImports]

        pool = envpool.make_gymnasium("CartPole-v1", num_envs=n, num_threads=1)
        cases.append(Case(f"CartPole-v1, EnvPool of {n}", vector_steps(pool, "random"), n, EULER))
    scipy = ScipyStep(perturbed_gait(8))
    note = "the same walking step at the same accuracy, compiled right-hand side"
    scipy_steps = Case(
        "scipy solve_ivp (DOP853)", lambda: [scipy.step(i) for i in range(8)], 8, note
    )
    return [*cases, scipy_steps]


def compare(smallest: bool) -> list[Speed]:
    """All cases, fastest first."""
    n, batch, steps = (4, 16, 4) if smallest else (VECTOR, BATCH, 200)
    effort = SMALLEST if smallest else FULL
    cases = [*_own_cases(n, batch, steps), *_other_cases(n, steps)]
    seconds = {}
    for threads in (1, 2):
        group = {case.name: case.play for case in cases if case.threads == threads}
        times = measure(group, effort, f"{threads} threads", threads=threads)
        seconds |= {name: times.median(name) for name in group}
    speeds = [
        Speed(c.name, c.steps / seconds[c.name], seconds[c.name] / c.steps * 1e6, c.note, c.ours)
        for c in cases
    ]
    return sorted(speeds, key=lambda speed: -speed.steps_per_second)


def as_text(speeds: list[Speed]) -> str:
    """A table, fastest first."""
    width = max(len(speed.name) for speed in speeds)
    lines = [f"{'':<{width}} {'steps/s':>12} {'us/step':>10}"]
    for s in speeds:
        lines.append(
            f"{s.name:<{width}} {s.steps_per_second:>12,.0f} {s.microseconds_per_step:>10,.3g}  {s.note}"
        )
    return "\n".join(lines)


def save_plot(speeds: list[Speed], machine: Mapping[str, Any], path: Path) -> None:
    """Draw steps per second on a logarithmic axis, fastest on top, and write the picture whole."""
    figure = new_figure(9.0, 0.36 * len(speeds) + 1.5)
    axes = figure.add_subplot()
    places = range(len(speeds))
    rates = [speed.steps_per_second for speed in speeds]
    axes.barh(places, rates, color=[OWN if speed.ours else OTHER for speed in speeds])
    for place, speed in zip(places, rates, strict=True):
        axes.text(speed * 1.1, place, _short(speed), va="center", fontsize=9)
    axes.set_yticks(places, [speed.name for speed in speeds])
    for label, speed in zip(axes.get_yticklabels(), speeds, strict=True):
        label.set_color(OWN if speed.ours else "black")
    axes.invert_yaxis()
    axes.set_xscale("log")
    axes.set_xlim(min(rates) * 0.6, max(rates) * 6.0)
    axes.set_xlabel("steps per second; this package (blue): whole walking steps")
    axes.spines[["top", "right"]].set_visible(False)
    units = machine["vector_instructions"].upper().replace("AVX512F", "AVX-512")
    axes.set_title(
        f"{machine['processor']} ({machine['architecture']}, {units}, {machine['cores']} cores), one thread "
        f"unless said, Python {machine['python']}",
        fontsize=9,
        loc="left",
        color="dimgray",
    )
    save_figure(figure, path, dpi=160)


def _short(speed: float) -> str:
    for unit, size in (("M", 1e6), ("k", 1e3)):
        if speed >= size:
            return f"{speed / size:.3g} {unit}"
    return f"{speed:.3g}"


def main() -> None:
    """Run as a program."""
    options = parser(__doc__)
    options.add_argument("--plot", type=Path, help="PNG file for the picture")
    arguments = options.parse_args()
    speeds = compare(arguments.smallest)
    if arguments.plot:
        save_plot(speeds, machine(), arguments.plot)
    if arguments.json:
        print(json.dumps({"speeds": [asdict(s) for s in speeds], "machine": machine()}, indent=2))
    else:
        print(as_text(speeds))


if __name__ == "__main__":
    main()
