"""Random walking steps for as long as told: each must end as a step or as a fall, and with finite numbers.

``python -m benchmarks.fuzz --seconds 60`` goes through rounds of about a million steps. A round has three parts:

* walkers of any body on slopes to 0.5 either way, with springs, dampers and masses that move, in states around gaits and far from them;
* the next task's vector environment, with random options, bodies and actions;
* places where failures are likely: between two walkers next to each other, of which one steps and the other falls or steps later, the
  states are bisected down to neighbouring numbers. On the way a swing foot grazes the floor, or a fall is next to none.

Walkers are pushed after every step, at levels to 10. A round depends on ``--seed`` and its number alone. Each failure is printed as a
command that reproduces it, and the exit status is 1 then.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Iterable
from itertools import count
from pathlib import Path

import gymnasium as gym
import numpy as np

from benchmarks.measure import machine
from lean_yaw_env.envs.dynamics import ANKLE_PUSH, PITCH_PUSH
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.files import write_json
from lean_yaw_env.kernel import records
from lean_yaw_env.kernel.batch import step_batch
from lean_yaw_env.kernel.records import Body, Command, Outcome
from lean_yaw_env.parameters import QUARTER_TURN, STATE_FIELDS, STATE_SIZE, Vector, WalkerParameters
from lean_yaw_env.registration import ALL_ENV_IDS
from lean_yaw_env.validation import require_count, require_number

WALKERS, WALKER_STEPS = 8192, 64
PLAYERS, PLAYER_STEPS = 2048, 384
PAIRS = 8192  # of walkers next to each other; a few in a hundred end differently
HALVINGS = 54  # leave neighbouring numbers
GREATEST_LEVEL = 10.0
SPRUNG = 0.04  # of all walkers: steps with springs or dampers take several times as long as others
FASTEST_ANKLE = 300.0  # times as fast as it walks; ``errors.SolverError`` says why no faster
LEAST, GREATEST = np.array([[0.0, 0.0, 0.01, -0.5], [2.0, 0.99, QUARTER_TURN, 0.5]])
GAIT = np.array([0.0, 0.155, -0.004, -0.415, -0.07])
STATUS, DURATION, OFFSET = map(Outcome._fields.index, ("status", "duration", "mass_offset"))
NAMES = {
    int(getattr(records, name)): name.lower().replace("_", " ")
    for name in ("STEPPED", "BACKWARD", "SIDEWAYS", "TRIP", "LIFT_OFF", "SLIP", "NO_STRIKE", "FAILED")
}  # fmt: skip


_START = (
    "inter_leg_angle", "commanded_offset", "mass_offset",
    *(field.name for field in STATE_FIELDS), "side",
)  # fmt: skip
"""Fields of a walker's record from which its step starts."""


def draw_bodies(rng: np.random.Generator, n: int) -> Vector:
    """Rows of ``Body``: around the paper's, with some or all of the first four numbers drawn from their whole ranges."""
    bodies = np.tile(np.array(WalkerParameters().body()), (n, 1))
    around = bodies[:, :4] * (1.0 + 0.5 * rng.random((n, 1)) * rng.uniform(-1.0, 1.0, (n, 4)))
    # some of these are at an end
    anything = rng.uniform(LEAST - 0.05, GREATEST + 0.05, (n, 4))
    is_wild = rng.random((n, 4)) < rng.random((n, 1)) ** 2
    bodies[:, :4] = np.clip(np.where(is_wild, anything, around), LEAST, GREATEST)
    # the first rows, so that others do not wait for them
    few = bodies[: round(SPRUNG * n)]
    inertia = np.sin(few[:, 2]) ** 2 + 0.25 * few[:, 0] ** 2
    spring, damper = FASTEST_ANKLE * 10.0 ** rng.uniform(-4.0, 0.0, (2, len(few)))
    has = rng.random((len(few), 2)) < 0.6
    few[:, 4:6] = has * np.minimum(100.0, inertia * [spring**2, damper]).T
    for name, share, values in (
        ("shift_time", 0.3, 10.0 ** rng.uniform(-2.0, 1.0, n)),
        ("friction_limit", 0.1, rng.uniform(0.05, 1.0, n)),
        ("max_step_duration", 0.1, rng.uniform(0.1, 5.0, n)),
        ("slope_turns", 0.2, 1.0),
        ("strike_at_start", 0.3, 1.0),
    ):
        column = bodies[:, Body._fields.index(name)]
        column[:] = np.where(rng.random(n) < share, values, column)
    return bodies


def draw_commands(rng: np.random.Generator, before: Vector) -> Vector:
    """Rows of ``Command`` of walkers whose masses are at ``before`` (n,): the first half leave them there, of the others some move them far."""
    n = len(before)
    angles = np.where(rng.random(n) < 0.8, rng.uniform(0.15, 0.45, n), rng.uniform(0.005, 1.565, n))
    reach = rng.choice([0.0, 0.005, 0.05, 1.0], n)
    reach[: n // 2] = 0.0
    offsets = np.clip(before + reach * rng.uniform(-1.0, 1.0, n), -1.0, 1.0)
    return np.column_stack([angles, offsets, before])


def draw_walkers(rng: np.random.Generator, n: int) -> tuple[Vector, Vector, Vector, Vector]:
    """Bodies, commands, section states near the paper's gait and far from it, and sides (n,)."""
    states = GAIT * (1.0 + rng.choice([0.05, 0.5, 2.0], (n, 1)) * rng.uniform(-1.0, 1.0, (n, 5)))
    states[:, 0] = rng.uniform(-np.pi, np.pi, n) * rng.choice([0.1, 1.0], n)
    anything = [1.55, 1.55, 5.0, 5.0] * rng.uniform(-1.0, 1.0, (n, 4)) * rng.random((n, 4))
    states[:, 1:] = np.where(rng.random((n, 1)) < 0.1, anything, states[:, 1:])
    before = rng.choice([0.0, 0.05, 1.0], n) * rng.uniform(-1.0, 1.0, n)
    sides = rng.choice([-1.0, 1.0], n)
    return draw_bodies(rng, n), draw_commands(rng, before), states, sides


class Round:
    """A round.

    Attributes
    ----------
    counts : how many steps ended how, by status
    failures : what reproduces each
    """

    def __init__(self, seed: int, number: int) -> None:
        self._rng = np.random.Generator(np.random.SFC64([seed, number]))
        self._command = f"--seed {seed} --first {number} --steps 1"
        self.counts: Counter[int] = Counter()
        self.failures: list[str] = []

    def walk(self, n: int = WALKERS, steps: int = WALKER_STEPS) -> None:
        """Steps of walkers; those that fall, and a few others, are drawn anew."""
        rng = self._rng
        walkers = _, commands, states, sides = draw_walkers(rng, n)
        levels = GREATEST_LEVEL * rng.random((n, 1)) ** 4
        for _ in range(steps):
            outcomes = self._outcomes(*walkers)
            states[:] = outcomes[:, :STATE_SIZE]
            states[:, 3:] += levels * rng.standard_normal((n, 2)) * [PITCH_PUSH, ANKLE_PUSH]
            sides *= -1.0
            commands[:] = draw_commands(rng, outcomes[:, OFFSET])
            gone = (outcomes[:, STATUS] != records.STEPPED) | (rng.random(n) < 0.03)
            gone |= (np.abs(states[:, 1:3]) >= QUARTER_TURN).any(axis=1)
            for rows, new in zip(walkers, draw_walkers(rng, gone.sum()), strict=True):
                rows[gone] = new

    def play(self, env_id: str, n: int = PLAYERS, steps: int = PLAYER_STEPS) -> None:
        """Steps of a task's walkers."""
        rng = self._rng
        options = {
            "push_level": GREATEST_LEVEL * rng.random() ** 4,
            "random_body": str(rng.choice(["training", "held-out"])),
            "mirror": bool(rng.random() < 0.5),
            "action_delay": bool(rng.random() < 0.5),
            "max_offset_change": float(rng.choice([0.005, 0.1])),
        }
        envs = gym.make_vec(env_id, num_envs=n, step_info=False, copy=False, **options)
        assert isinstance(envs.unwrapped, WalkerVectorEnv)
        simulation = envs.unwrapped.simulation
        envs.reset(seed=int(rng.integers(2**31)))
        # until their first falls the walkers have bodies far from those that the options allow
        simulation.bodies[:] = draw_bodies(rng, n)
        reach, ended = rng.random((n, 2)), np.zeros(n, dtype=bool)
        reach[: n // 2, 1] = 0.0  # masses at rest, whose steps are shorter work
        for _ in range(steps):
            _, rewards, *ends, _ = envs.step(reach * rng.uniform(-1.0, 1.0, (n, 2)))
            if not (np.isfinite(rewards).all() and np.isfinite(simulation.observations).all()):
                self.failures.append(f"{self._command}  # {env_id} with {options}: NaN")
            statuses = simulation.falls + int(records.STEPPED)
            self._count(statuses[~ended])
            # a walker whose step failed stands where it was
            for i in np.flatnonzero(statuses == records.FAILED):
                start = (simulation.walkers[name][i] for name in _START)
                self._note(*simulation.bodies[i], *start)
            ended = np.logical_or(*ends)

    def bisect(self, n: int = PAIRS) -> int:
        """Bisect between walkers and others next to them whose steps end otherwise; return between how many."""
        bodies, commands, near, sides = draw_walkers(self._rng, n)
        share = 10.0 ** self._rng.uniform(-1.0, 0.0, (n, 1))
        far = near * (1.0 + 0.3 * share * self._rng.uniform(-1.0, 1.0, near.shape))

        def ends(states: Vector) -> Vector:
            return self._outcomes(bodies, commands, states, sides)[:, [STATUS, DURATION]]

        at_near, at_far = ends(near), ends(far)
        steps = ((at_near == records.STEPPED) | (at_far == records.STEPPED))[:, 0]
        is_edge = steps & (np.abs(at_near - at_far) > 0.3).any(axis=1)
        bodies, commands, near, sides, far, at_near, at_far = (
            rows[is_edge] for rows in (bodies, commands, near, sides, far, at_near, at_far)
        )
        for _ in range(HALVINGS):
            middle = 0.5 * (near + far)
            at_middle = ends(middle)
            # by the status, or by the duration where both have the same
            apart = np.abs(at_middle - at_near) - np.abs(at_middle - at_far)
            same = at_near[:, 0] == at_far[:, 0]
            as_near = np.where(same, apart[:, 1] <= 0.0, at_middle[:, 0] == at_near[:, 0])[:, None]
            near, far = np.where(as_near, middle, near), np.where(as_near, far, middle)
            at_near, at_far = (
                np.where(as_near, at_middle, at_near), np.where(as_near, at_far, at_middle),
            )  # fmt: skip
        return len(near)

    def _outcomes(self, bodies: Vector, commands: Vector, states: Vector, sides: Vector) -> Vector:
        """Step walkers, and count how the steps end."""
        outcomes = np.empty((len(states), len(Outcome._fields)))
        step_batch(bodies, commands, states, sides, outcomes, 0, len(states))
        self._count(outcomes[:, STATUS])
        is_wrong = outcomes[:, STATUS] == records.FAILED
        is_wrong |= ~np.isfinite(outcomes).all(axis=1)
        for i in np.flatnonzero(is_wrong):
            self._note(*bodies[i], *commands[i], *states[i], sides[i])
        return outcomes

    def _count(self, statuses: Vector) -> None:
        counts = np.bincount(statuses.astype(np.int64))
        self.counts.update({i: int(counts[i]) for i in np.flatnonzero(counts).tolist()})

    def _note(self, *row: float) -> None:
        self.failures.append(f"--reproduce {as_hex(row)}")


def as_hex(row: Iterable[float]) -> str:
    """Numbers that ``--reproduce`` takes."""
    return " ".join(float(value).hex() for value in row)


def reproduce(row: Vector) -> Outcome:
    """The outcome of one step from a row of body, command, state and side."""
    ends = np.cumsum([len(Body._fields), len(Command._fields), STATE_SIZE])
    body, command, state, side = (part.copy() for part in np.split(row, ends))
    outcome = np.empty((1, len(Outcome._fields)))
    step_batch(body[None], command[None], state[None], side, outcome, 0, 1)
    return Outcome(*outcome[0].tolist())


def main() -> int:
    """Fuzz, and say what came of it."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fuzz", description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="begin no round later")
    parser.add_argument("--steps", type=float, help="go on until so many, whatever the time")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first round")
    parser.add_argument("--out", type=Path, help="JSON of the result, written after every round")
    parser.add_argument(
        "--reproduce", metavar="NUMBER", nargs="+", help="a failure's numbers: step them once"
    )
    given = parser.parse_args()
    if given.reproduce:
        print(reproduce(np.array([float.fromhex(number) for number in given.reproduce])))
        return 0
    seconds = require_number("--seconds", given.seconds, 0.0, 1e7, "(]")
    seed, first = require_count("--seed", given.seed, 0), require_count("--first", given.first, 0)
    if given.steps is not None:
        require_number("--steps", given.steps, 1.0, 1e12)
    total = Round(seed, first)
    total.walk(1, 1)  # compiles, as the next lines do
    for env_id in ALL_ENV_IDS:
        total.play(env_id, 1, 1)
    edges, began, spent = 0, time.perf_counter(), 0.0
    for number in count(first):
        before, each = time.process_time(), Round(seed, number)
        each.walk()
        each.play(ALL_ENV_IDS[number % len(ALL_ENV_IDS)])
        edges += each.bisect()
        total.counts += each.counts
        total.failures += each.failures
        spent += time.process_time() - before
        steps = sum(total.counts.values())
        if given.out is not None:
            result = {
                "steps": steps,
                "steps_per_processor_second": steps / spent,
                "edges": edges,
                "ends": {NAMES[status]: n for status, n in sorted(total.counts.items())},
                "failures": total.failures,
                "seed": seed,
                "rounds": [first, number],
                "environments": ALL_ENV_IDS,
                "machine": machine(),
            }
            write_json(given.out, result)
        is_late = time.perf_counter() - began >= seconds
        if is_late if given.steps is None else steps >= given.steps:
            break
    print(f"{steps:,} steps, {steps / spent:,.0f} in a second of processor time")
    print(f"{edges:,} edges, each bisected to neighbouring numbers")
    for status, ended in sorted(total.counts.items()):
        print(f"{NAMES[status]:>15} {ended:>14,}")
    for failure in total.failures[:100]:
        print("python -m benchmarks.fuzz", failure)
    return 1 if total.failures else 0


if __name__ == "__main__":
    sys.exit(main())
