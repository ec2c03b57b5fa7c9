"""Random walking steps for as long as told, and a failure of the solver for every one that does not end as a step or a fall.

``python -m benchmarks.fuzz --seconds 60`` draws bodies over the whole of their ranges and around the paper's, springs and dampers, slopes to
0.5 either way, masses that rest or move, states around gaits, far from them, and of walks pushed at levels to 10. It prints how many
steps ended how, and each failure as numbers that reproduce it; it exits with 1 if there was one.

``--edges`` looks where failures are likely: between two walkers next to each other of which one steps and the other falls or steps later, it bisects
the states down to neighbouring numbers. On the way a swing foot grazes the floor, or a fall is next to none.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.kernel import records
from lean_yaw_env.kernel.batch import step_batch
from lean_yaw_env.kernel.records import Body, Command, Outcome
from lean_yaw_env.parameters import QUARTER_TURN, STATE_SIZE, Vector, WalkerParameters
from lean_yaw_env.validation import require_count, require_number

WALKERS = 8192
# The pushes of the tasks at level 1, standard deviations of both rates, and their greatest level
PITCH_PUSH, ANKLE_PUSH, GREATEST_LEVEL = 0.08, 0.15, 10.0
# Springs and dampers may move an ankle this much faster than it walks; ``errors.SolverError`` says why no faster
FASTEST_ANKLE = 300.0
_NAMES = ("stepped", "backward", "sideways", "trip", "lift_off", "slip", "no_strike", "FAILED")
NAMES = {getattr(records, name.upper()): name.replace("_", " ") for name in _NAMES}
_STATUS = Outcome._fields.index("status")
_DURATION = Outcome._fields.index("duration")
_OFFSET = Outcome._fields.index("mass_offset")
_HALVINGS = 54  # leave neighbouring numbers
_GAIT = np.array([0.0, 0.155, -0.004, -0.415, -0.07])


def draw_bodies(rng: np.random.Generator, n: int) -> Vector:
    """Rows of ``Body``: a third are the paper's or near it, the others anything."""
    bodies = np.tile(np.array(WalkerParameters().body()), (n, 1))

    def put(name: str, values: Vector, where: NDArray[np.bool_] | bool = True) -> None:
        column = bodies[:, Body._fields.index(name)]
        column[:] = np.where(where, values, column)

    near, wild = rng.random(n) < 0.5, rng.random(n) < 0.67
    for name, least, greatest in (
        ("hip_width", 0.0, 2.0),
        ("foot_radius", 0.0, 0.99),
        ("ankle_tilt", 0.01, QUARTER_TURN),
        ("slope", -0.5, 0.5),
    ):
        paper = bodies[:, Body._fields.index(name)]
        around = np.clip(paper * (1.0 + rng.uniform(-0.5, 0.5, n)), least, greatest)
        # a tenth of the wild ones are at an end of the range
        anything = np.clip(rng.uniform(least - 0.05, greatest + 0.05, n), least, greatest)
        put(name, around, near)
        put(name, anything, wild)
    width, tilt = bodies[:, 0], bodies[:, 2]
    inertia = np.sin(tilt) ** 2 + 0.25 * width**2
    rate = FASTEST_ANKLE * 10.0 ** rng.uniform(-4.0, 0.0, (2, n))
    sprung = rng.random((2, n)) < 0.1
    put("ankle_stiffness", np.minimum(100.0, inertia * rate[0] ** 2), sprung[0])
    put("ankle_damping", np.minimum(100.0, inertia * rate[1]), sprung[1])
    put("shift_time", 10.0 ** rng.uniform(-2.0, 1.0, n), rng.random(n) < 0.3)
    put("friction_limit", rng.uniform(0.05, 1.0, n), rng.random(n) < 0.1)
    put("max_step_duration", rng.uniform(0.1, 5.0, n), rng.random(n) < 0.1)
    put("slope_turns", np.ones(n), rng.random(n) < 0.2)
    put("strike_at_start", np.ones(n), rng.random(n) < 0.3)
    return bodies


def draw_states(rng: np.random.Generator, n: int) -> Vector:
    """Section states: near the paper's gait, disturbed by up to itself, or anything."""
    spread = rng.choice([0.05, 0.5, 2.0], (n, 1))
    states = _GAIT * (1.0 + spread * rng.uniform(-1.0, 1.0, (n, STATE_SIZE)))
    states[:, 0] = rng.uniform(-np.pi, np.pi, n) * rng.choice([0.1, 1.0], n)
    wild = rng.random(n) < 0.3
    angles = rng.uniform(-1.55, 1.55, (n, 2)) * rng.random((n, 2))
    rates = rng.uniform(-5.0, 5.0, (n, 2)) * rng.random((n, 2)) ** 2
    states[wild, 1:] = np.column_stack([angles, rates])[wild]
    return states


def draw_commands(rng: np.random.Generator, before: Vector) -> Vector:
    """Commands of walkers whose masses are at ``before`` (n,): half leave them there, some move them far."""
    n = len(before)
    angles = np.where(rng.random(n) < 0.7, rng.uniform(0.15, 0.45, n), rng.uniform(0.005, 1.565, n))
    reach = rng.choice([0.0, 0.0, 0.005, 0.05, 1.0], n)
    offsets = np.clip(before + reach * rng.uniform(-1.0, 1.0, n), -1.0, 1.0)
    return np.column_stack([angles, offsets, before])


class Fuzz:
    """Walkers that go on for as long as they walk, pushed after every step; those that fall are drawn anew.

    Attributes
    ----------
    counts : how many steps ended how, by status
    failures : rows of body, command, state and side
    """

    def __init__(self, seed: int, walkers: int = WALKERS) -> None:
        self._rng = np.random.default_rng(seed)
        self._n = walkers
        self._bodies = np.zeros((walkers, len(Body._fields)))
        self._states = np.zeros((walkers, STATE_SIZE))
        self._sides, self._before = np.zeros(walkers), np.zeros(walkers)
        self._levels = np.zeros(walkers)
        self._draw(np.ones(walkers, dtype=bool))
        self.counts: Counter[float] = Counter()
        self.failures: list[Vector] = []

    def _outcomes(self, bodies: Vector, commands: Vector, states: Vector, sides: Vector) -> Vector:
        """Step walkers, and count how the steps end."""
        outcomes = np.empty((len(states), len(Outcome._fields)))
        step_batch(bodies, commands, states, sides, outcomes, 0, len(states))
        status = outcomes[:, _STATUS]
        self.counts.update(dict(zip(*np.unique(status, return_counts=True), strict=True)))
        for i in np.flatnonzero(status == records.FAILED):
            given = (bodies[i], commands[i], states[i], sides[i : i + 1])
            self.failures.append(np.concatenate(given))
        return outcomes

    def visit_edges(self) -> int:
        """Bisect between new walkers and others next to them whose steps end otherwise; return between how many."""
        self._draw(np.ones(self._n, dtype=bool))
        rng, near = self._rng, self._states
        share = rng.uniform(-0.3, 0.3, near.shape) * 10.0 ** rng.uniform(-1.0, 0.0, (self._n, 1))
        far = near * (1.0 + share)
        given = (self._bodies, draw_commands(rng, self._before), self._sides)
        ends = [self._ends(given, states) for states in (near, far)]
        steps = (ends[0][:, 0] == records.STEPPED) | (ends[1][:, 0] == records.STEPPED)
        apart = (ends[0][:, 0] != ends[1][:, 0]) | (np.abs(ends[0][:, 1] - ends[1][:, 1]) > 0.3)
        edges = np.flatnonzero(steps & apart)
        near, far = near[edges], far[edges]
        at_near, at_far = ends[0][edges], ends[1][edges]
        given = (given[0][edges], given[1][edges], given[2][edges])
        for _ in range(_HALVINGS):
            middle = 0.5 * (near + far)
            at_middle = self._ends(given, middle)
            is_nearer = np.abs(at_middle[:, 1] - at_near[:, 1]) <= np.abs(
                at_middle[:, 1] - at_far[:, 1]
            )
            as_near = np.where(
                at_near[:, 0] == at_far[:, 0], is_nearer, at_middle[:, 0] == at_near[:, 0]
            )
            near[as_near], at_near[as_near] = middle[as_near], at_middle[as_near]
            far[~as_near], at_far[~as_near] = middle[~as_near], at_middle[~as_near]
        return len(edges)

    def _ends(self, given: tuple[Vector, Vector, Vector], states: Vector) -> Vector:
        """How steps of walkers (bodies, commands, sides) end, and when (n, 2)."""
        bodies, commands, sides = given
        return self._outcomes(bodies, commands, states, sides)[:, [_STATUS, _DURATION]]

    def step(self) -> None:
        """One step of every walker."""
        rng, n = self._rng, self._n
        commands = draw_commands(rng, self._before)
        outcomes = self._outcomes(self._bodies, commands, self._states, self._sides)
        status = outcomes[:, _STATUS]
        self._states = outcomes[:, :STATE_SIZE].copy()
        pushes = rng.standard_normal((n, 2)) * [PITCH_PUSH, ANKLE_PUSH]
        self._states[:, 3:] += self._levels[:, None] * pushes
        self._sides, self._before = -self._sides, outcomes[:, _OFFSET].copy()
        # a walk is no longer than some steps, so that most are on the way to a fall or from a start
        gone = (status != records.STEPPED) | (rng.random(n) < 0.05)
        self._draw(gone | (np.abs(self._states[:, 1:3]) >= QUARTER_TURN).any(axis=1))

    def _draw(self, which: NDArray[np.bool_]) -> None:
        """Put new walkers in the places of some."""
        rng, n = self._rng, int(which.sum())
        self._bodies[which] = draw_bodies(rng, n)
        self._states[which] = draw_states(rng, n)
        self._sides[which] = rng.choice([-1.0, 1.0], n)
        reach = rng.choice([0.0, 0.05, 1.0], n)
        self._before[which] = reach * rng.uniform(-1.0, 1.0, n)
        self._levels[which] = GREATEST_LEVEL * rng.random(n) ** 3


def as_hex(row: Vector) -> str:
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
    parser.add_argument("--seconds", type=float, default=60.0, help="how long to go on")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--edges", action="store_true", help="bisect between steps that end differently"
    )
    parser.add_argument(
        "--reproduce", metavar="NUMBER", nargs="+", help="a failure's numbers: step them once"
    )
    given = parser.parse_args()
    if given.reproduce:
        print(reproduce(np.array([float.fromhex(number) for number in given.reproduce])))
        return 0
    seconds = require_number("--seconds", given.seconds, 0.0, 1e7, "(]")
    fuzz = Fuzz(require_count("--seed", given.seed, 0))
    work, edges = fuzz.visit_edges if given.edges else fuzz.step, 0
    work()
    began = time.perf_counter()
    before = sum(fuzz.counts.values())
    while time.perf_counter() - began < seconds:
        edges += work() or 0
    spent = time.perf_counter() - began
    total = sum(fuzz.counts.values())
    print(f"{total:,} steps, {(total - before) / spent:,.0f} a second")
    if given.edges:
        print(f"{edges:,} edges, each bisected to neighbouring numbers")
    for status, count in sorted(fuzz.counts.items()):
        print(f"{NAMES[status]:>15} {count:>14,}")
    for row in fuzz.failures[:100]:
        print("python -m benchmarks.fuzz --reproduce", as_hex(row))
    return 1 if fuzz.failures else 0


if __name__ == "__main__":
    sys.exit(main())
