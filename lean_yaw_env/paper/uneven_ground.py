"""The simplest walker on uneven ground: the gait sensitivity norm and the mean first-passage time."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from lean_yaw_env.kernel.passive import PassiveOutcome, passive_batch
from lean_yaw_env.kernel.records import STEPPED, Body
from lean_yaw_env.paper.checks import Result, Section
from lean_yaw_env.paper.simplest_walker import gaits
from lean_yaw_env.paper.walkers import point_foot_walker
from lean_yaw_env.parameters import Vector

_STATE = [
    PassiveOutcome._fields.index(name)
    for name in ("stance_pitch", "stance_pitch_rate", "inter_leg_rate", "inter_leg_angle")
]
_STATUS, _DURATION = (PassiveOutcome._fields.index(name) for name in ("status", "duration"))
_WIDTH = 1e-5
"""Half-width of central differences; their error is its square."""
_SLOPES = (0.001, 0.002, 0.004, 0.006, 0.008, 0.01, 0.012, 0.014)
_SURVIVED = 100
"""Steps that count as survived."""
_WALKERS, _SETTLING, _COUNTED = 500, 20, 200
_ROUGHNESS = (0.0005, 0.001, 0.0015, 0.002)
"""Standard deviations, rad, of the angle from one foothold to the next."""


def uneven_ground() -> Result:
    """Both measures; no published number of either could be read for a model that ours covers."""
    norms = [gait_sensitivity_norm(slope) for slope in _SLOPES]
    drops = [largest_drop(slope) for slope in _SLOPES]
    correlation = float(np.corrcoef(1.0 / np.array(norms), drops)[0, 1])
    norm_section = Section(
        "Gait sensitivity norm (Hobbelen and Wisse 2007)",
        "How much a small drop of the floor, in leg lengths, changes all later step times, in units of time: the "
        "smaller, the better are disturbances rejected. Beside it the largest single drop that the walker "
        f"survives. Along the slope the two are correlated by {correlation:.2f} (the norm's inverse with the drop); "
        "the paper's abstract has 0.93 on average, for its own models over slope, foot radius and hip "
        "stiffness. Its numbers are in figures that could not be read, so that nothing is compared.",
        {
            "slope": [f"{slope:g}" for slope in _SLOPES],
            "norm": [f"{norm:.1f}" for norm in norms],
            "largest drop survived": [f"{drop:.5f}" for drop in drops],
        },
    )
    table = {"standard deviation (rad)": [f"{rough:g}" for rough in _ROUGHNESS]}
    for slope in (0.004, 0.009):
        times = [first_passage_time(slope, rough) for rough in _ROUGHNESS]
        table[f"steps at slope {slope:g}"] = [f"{time:.3g}" for time in times]
    passage_section = Section(
        "Mean first-passage time (Byl and Tedrake 2009)",
        "Mean number of steps until a fall, where the angle from one foothold to the next is the slope's with a "
        f"normal deviation; from {_WALKERS} walkers over {_COUNTED} steps each. Byl and Tedrake's compass gait "
        "has legs with masses and an actuated hip, which ours has not; the numbers are ours alone.",
        table,
    )
    return Result(sections=(norm_section, passage_section))


class Steps(NamedTuple):
    """Where steps on uneven ground ended.

    ``states`` (n, 4): stance pitch and its rate, inter-leg rate, inter-leg angle; ``durations`` and ``completed`` (n,).
    """

    states: Vector
    durations: Vector
    completed: np.ndarray


def uneven_steps(slope: float, states: Vector, changes: Vector) -> Steps:
    """Step the simplest walker onto footholds that lie off the slope.

    A point foot feels no floor but where it stands. So a foothold that the line from the last one reaches under the angle
    slope + change is a step on a slope as steep as that, from the same legs: their angles to the floor's normal differ by the change.

    Parameters
    ----------
    slope : float
    states : shape (n, 4)
        As in ``Steps``.
    changes : shape (n,)
        rad, positive where the foothold is lower.
    """
    body = point_foot_walker(slope).moving_parameters.body()
    bodies = np.tile(body, (len(states), 1))
    bodies[:, Body._fields.index("slope")] += changes
    start = np.zeros((len(states), 6))
    start[:, [1, 3, 5]] = states[:, :3]
    start[:, 1] += changes
    rows = np.empty((len(states), len(PassiveOutcome._fields)))
    passive_batch(bodies, start, states[:, 3].copy(), np.ones(len(states)), rows, 0, len(states))
    after = rows[:, _STATE]
    after[:, 0] -= changes
    return Steps(after, rows[:, _DURATION], rows[:, _STATUS] == STEPPED)


def gait_state(slope: float) -> Vector:
    """The long gait's state, shape (4,)."""
    state = gaits(slope)[0].state
    return np.array([state[1], state[3], state[5], -2.0 * state[1]])


def gait_sensitivity_norm(slope: float) -> float:
    """How much one drop of the floor changes all later step times: Hobbelen and Wisse's norm.

    The square root of the sum of the squared changes of the step time, over the drop's height in leg lengths, for small drops.
    """
    state = gait_state(slope)
    # Columns: the state's coordinates, then the height of the next foothold below the slope
    scale = 1.0 / (2.0 * math.sin(state[0]))
    shifts = np.vstack([np.eye(5), -np.eye(5)]) * _WIDTH
    ends = uneven_steps(slope, state + shifts[:, :4], shifts[:, 4] * scale)
    both = np.column_stack([ends.states, ends.durations])
    matrix = (both[:5] - both[5:]).T / (2.0 * _WIDTH)
    onward, times = matrix[:4, :4], matrix[4, :4]
    total, change = matrix[4, 4] ** 2, matrix[:4, 4]
    for _ in range(_SURVIVED):
        total += float(times @ change) ** 2
        change = onward @ change
    return math.sqrt(total)


def largest_drop(slope: float, sizes: int = 300, most: float = 0.003) -> float:
    """The largest single drop of the floor, in leg lengths, below which the long gait survives every one tried.

    Of ``sizes`` drops up to ``most``.
    """
    drops = most * np.arange(1, sizes + 1) / sizes
    states = np.tile(gait_state(slope), (sizes, 1))
    changes = drops / (2.0 * math.sin(states[0, 0]))
    walking = np.ones(sizes, dtype=bool)
    for _ in range(_SURVIVED):
        steps = uneven_steps(slope, states[walking], changes[walking])
        states[walking] = steps.states
        walking[walking] = steps.completed
        changes = np.zeros(sizes)
    survived = sizes if walking.all() else int(np.argmin(walking))
    return most * survived / sizes


def first_passage_time(slope: float, roughness: float, *, seed: int = 0) -> float:
    """Mean number of steps until a fall on ground whose footholds lie off the slope at random.

    As Byl and Tedrake have it: many walkers are left to forget their start, and a share of them, always the same, falls at every
    step from then on; its inverse is the mean first-passage time.

    Parameters
    ----------
    slope : float
    roughness : float
        Standard deviation of the angle from foothold to foothold, rad, normally distributed.
    seed : int
    """
    random = np.random.default_rng(seed)
    states = np.tile(gait_state(slope), (_WALKERS, 1))
    walked = fallen = 0
    for k in range(_SETTLING + _COUNTED):
        steps = uneven_steps(slope, states, roughness * random.standard_normal(len(states)))
        states = steps.states
        states[~steps.completed] = states[steps.completed][: int((~steps.completed).sum())]
        if k >= _SETTLING:
            walked += len(states)
            fallen += int((~steps.completed).sum())
    return walked / fallen if fallen else math.inf
