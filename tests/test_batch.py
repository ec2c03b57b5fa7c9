"""Many walkers at once: bit for bit as one by one, in any number, order, split and number of threads; bad input."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from lean_yaw_env import Walker, WalkerParameters
from lean_yaw_env.batch import BatchResult, bodies_of, step_batch
from lean_yaw_env.errors import SolverError
from lean_yaw_env.kernel import records
from lean_yaw_env.kernel.records import Body, Outcome
from lean_yaw_env.kernel.step import step as step_kernel
from lean_yaw_env.parameters import Vector
from tests.test_kernel_falls import _random_walkers


def _single(bodies: Vector, states: Vector, sides: Vector, commands: dict[str, Vector]) -> Vector:
    outcomes = np.empty((len(states), len(Outcome._fields)))
    for i in range(len(states)):
        command = np.array(
            [commands[k][i] for k in ("inter_leg_angles", "mass_offsets", "previous_offsets")]
        )
        step_kernel(bodies[i], command, states[i], sides[i], outcomes[i])
    return outcomes


def _same_bits(a: Vector, b: Vector) -> bool:
    return bool((a.view(np.uint64) == b.view(np.uint64)).all())


def test_a_batch_has_the_bits_of_its_walkers_one_by_one() -> None:
    bodies, states, sides, commands = _random_walkers(6_001, 3)
    result = step_batch(bodies, states, sides, **commands)
    assert len(set(result.status)) == 7  # every end is among them
    assert _same_bits(result.outcomes, _single(bodies, states, sides, commands))


def test_a_batch_around_the_gait_has_the_bits_of_its_walkers_one_by_one(gait: Vector) -> None:
    rng = np.random.default_rng(4)
    n = 2_000
    bodies = np.tile(np.array(WalkerParameters().body()), (n, 1))
    states = gait * rng.uniform(0.5, 1.5, (n, 5))
    sides = np.where(rng.random(n) < 0.5, 1.0, -1.0)
    before = rng.uniform(-0.05, 0.05, n)
    commands = {
        "inter_leg_angles": rng.uniform(0.15, 0.45, n),
        "previous_offsets": before,
        "mass_offsets": before + rng.uniform(-0.005, 0.005, n) * (rng.random(n) < 0.5),
    }
    result = step_batch(bodies, states, sides, **commands)
    assert _same_bits(result.outcomes, _single(bodies, states, sides, commands))
    one_body = step_batch(WalkerParameters(), states, sides, **commands)
    assert _same_bits(result.outcomes, one_body.outcomes)


@pytest.mark.parametrize("n", [1, 2, 7, 8, 9, 63, 64, 65, 129])
def test_no_walker_depends_on_how_many_others_there_are(n: int) -> None:
    bodies, states, sides, commands = _random_walkers(200, 5)
    whole = step_batch(bodies, states, sides, **commands)
    part = step_batch(
        bodies[:n], states[:n], sides[:n], **{k: v[:n] for k, v in commands.items()}
    )  # fmt: skip
    assert _same_bits(part.outcomes, whole.outcomes[:n])


@pytest.mark.parametrize("threads", [2, 3, 5])
def test_threads_change_no_bit(threads: int) -> None:
    bodies, states, sides, commands = _random_walkers(3_001, 6)
    one = step_batch(bodies, states, sides, **commands)
    many = step_batch(bodies, states, sides, threads=threads, **commands)
    assert _same_bits(one.outcomes, many.outcomes)


def test_no_walkers_give_no_outcomes() -> None:
    result = step_batch(WalkerParameters(), np.empty((0, 5)), 1.0)
    assert result.states.shape == (0, 5)
    assert not result.stepped.any()


def test_the_friendly_single_step_says_the_same(gait: Vector) -> None:
    result = step_batch(WalkerParameters(), [gait], -1.0, mass_offsets=0.02, previous_offsets=0.01)
    single = Walker().step(gait, stance="right", mass_offset=0.02, previous_offset=0.01)
    assert (result.states[0] == single.state).all()
    assert result.duration[0] == single.duration
    assert result.least_normal_force[0] == single.least_normal_force
    assert (result.displacement_x[0], result.displacement_z[0]) == tuple(single.displacement)
    assert result.stepped[0]


def test_arguments_are_not_changed() -> None:
    bodies, states, sides, commands = _random_walkers(50, 7)
    copies = [bodies.copy(), states.copy(), sides.copy()]
    step_batch(bodies, states, sides, **commands)
    assert all((a == b).all() for a, b in zip((bodies, states, sides), copies, strict=True))


def test_bodies_come_from_parameters_one_or_many() -> None:
    assert bodies_of(WalkerParameters()).shape == (1, len(Body._fields))
    many = bodies_of([WalkerParameters(), WalkerParameters(slope=0.02)])
    assert (many[:, 3] == [0.01, 0.02]).all()
    assert len(fields(WalkerParameters)) == len(Body._fields)


def test_every_field_of_an_outcome_is_an_attribute_of_a_batch_s() -> None:
    bodies, states, sides, commands = _random_walkers(50, 8)
    result = step_batch(bodies, states, sides, **commands)
    assert set(Outcome._fields) == set(BatchResult.__annotations__)
    for k, name in enumerate(Outcome._fields):
        assert (getattr(result, name) == result.outcomes[:, k]).all()


GOOD = np.tile([0.0, 0.155, 0.0, -0.4, 0.0], (3, 1))
BODIES = np.tile(np.array(WalkerParameters(friction_limit=1.0).body()), (3, 1))
NAN_WIDTH = np.where(np.arange(11) == 0, np.nan, 1.0)
ZERO_TILT = np.where(np.arange(11) == 2, 0.0, 1.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"states": GOOD[0]}, r"states must have shape \(n, 5\), got \(5,\)"),
        ({"states": GOOD[:, :4]}, r"states must have shape \(n, 5\), got \(3, 4\)"),
        (
            {"states": GOOD * np.nan},
            r"states\[0\]: heading must be in \(-1e\+06, 1e\+06\), got nan",
        ),
        (
            {"states": GOOD * [0, 11, 0, 0, 0]},
            r"states\[0\]: stance_pitch must be in \(-1.5708, 1.5708\), got 1.705",
        ),
        ({"sides": 0.5}, r"sides must be \+1 \(left\) or -1 \(right\)"),
        ({"sides": [1.0, -1.0]}, "sides must be one number or 3 of them, got 2"),
        ({"sides": np.nan}, "sides"),
        ({"inter_leg_angles": -0.1}, r"inter_leg_angles\[0\] must be in \(0, 1.5708\), got -0.1"),
        ({"inter_leg_angles": [0.3, 0.3, np.nan]}, r"inter_leg_angles\[2\] must be in .*, got nan"),
        ({"mass_offsets": [0.0, 2.0, 0.0]}, r"mass_offsets\[1\] must be in \[-1, 1\], got 2.0"),
        ({"previous_offsets": -3.0}, r"previous_offsets\[0\] must be in"),
        ({"parameters": [WalkerParameters()] * 2}, "parameters must be of one or 3 walkers, got 2"),
        ({"parameters": np.zeros((3, 4))}, r"parameters must have shape \(n, 11\), got \(3, 4\)"),
        ({"threads": 0}, "threads must be from 1 to 1024, got 0"),
        ({"threads": 1.7}, "threads must be a whole number from 1 to 1024, got 1.7"),
        # what ``Walker.step`` refuses too
        (
            {"states": np.add(GOOD, [0, 0, 0, 1e300, 0])},
            r"states\[0\]: stance_pitch_rate must be in",
        ),
        ({"states": GOOD.astype(complex)}, "states must hold numbers"),
        ({"states": [[0.0], [0.0, 1.0]]}, "states must hold numbers"),
        ({"inter_leg_angles": 0.0}, r"inter_leg_angles\[0\] must be in \(0, 1.5708\), got 0.0"),
        ({"inter_leg_angles": [0.3, 0.3, math.pi / 2]}, r"inter_leg_angles\[2\] must be in"),
        ({"inter_leg_angles": None}, "inter_leg_angles must be a number, got None"),
        ({"mass_offsets": True}, "mass_offsets must be a number, got True"),
        (
            {"parameters": BODIES * NAN_WIDTH},
            r"parameters\[0\]: hip_width must be in \[0, 2\], got nan",
        ),
        (
            {"parameters": BODIES * ZERO_TILT},
            r"parameters\[0\]: ankle_tilt must be in \(0, 1.5708\], got 0.0",
        ),
        (
            {"parameters": [WalkerParameters(), None]},
            r"parameters\[1\] must be WalkerParameters, got None",
        ),
        ({"parameters": None}, "parameters must be WalkerParameters, or n of them, got None"),
    ],
)
def test_bad_input_is_refused_by_name(arguments: dict[str, Any], message: str) -> None:
    good: dict[str, Any] = {"parameters": WalkerParameters(), "states": GOOD, "sides": 1.0}
    with pytest.raises(ValueError, match=message):
        step_batch(**(good | arguments))


def test_a_solver_s_failure_raises_and_is_no_fall() -> None:
    # An ankle next to without inertia on a damper a million times stiffer: no explicit integrator gets through
    body = WalkerParameters(hip_width=0.0, ankle_tilt=1e-3, ankle_damping=50.0)
    state = [0.0, 0.1, 0.1, -0.4, 0.1]
    with pytest.raises(SolverError, match=r"walker 0: the step .* did not converge"):
        step_batch(body, [state], 1.0)
    with pytest.raises(SolverError, match="did not converge"):
        Walker(body).step(state)


def test_a_solver_s_failure_says_all_that_reproduces_it() -> None:
    body = WalkerParameters(hip_width=0.0, ankle_tilt=1e-3, ankle_damping=50.0)
    state = [1.0 / 3.0, 0.1, 0.1, -0.4, 0.1]
    command = {"inter_leg_angle": 0.2, "mass_offset": 0.03, "previous_offset": 0.1 / 3.0}
    with pytest.raises(SolverError) as caught:
        Walker(body).step(state, stance="right", **command)
    numbers = str(caught.value).rsplit(": ", 1)[1].split()
    given = [*body.body(), *command.values(), *state, -1.0]
    # in the order of a command's fields
    given[11:14] = [0.2, 0.03, 0.1 / 3.0]
    assert [float.fromhex(number) for number in numbers] == given
    assert records.FAILED not in (records.STEPPED, records.BACKWARD)
