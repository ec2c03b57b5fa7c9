"""Compiled loops that only benchmarks need, over the package's own formulas."""

from __future__ import annotations

from lean_yaw_env.kernel.compilation import borrowed, entry_point
from lean_yaw_env.kernel.elementary import sine_cosine
from lean_yaw_env.kernel.records import LANDING, Command, Flight
from lean_yaw_env.kernel.stance import accelerations, kinetic_energy, mass_matrix, middle_of_masses
from lean_yaw_env.kernel.step import body_of, finish, stance_of, walking_step, write_outcome
from lean_yaw_env.kernel.swing import foot_gap


@entry_point()
def step_each(bodies, commands, states, sides, outcomes):
    """The scalar kernel on a batch, one walker after the other."""
    bodies, commands, states = borrowed(bodies), borrowed(commands), borrowed(states)
    outcomes = borrowed(outcomes)
    for i in range(states.shape[0]):
        b = i if bodies.shape[0] > 1 else 0
        outcome = walking_step(
            body_of(bodies[b]),
            Command(commands[i, 0], commands[i, 1], commands[i, 2]),
            states[i, 0],
            states[i, 1],
            states[i, 2],
            states[i, 3],
            states[i, 4],
            sides[i],
        )
        write_outcome(outcome, outcomes[i])


@entry_point()
def motion(time, y, body, command, heading, side, dy):
    """Rates ``dy`` of (pitch, twist, pitch rate, twist rate), for solvers that take a right-hand side."""
    stance = stance_of(body_of(body), Command(command[0], command[1], command[2]), heading, side)
    dw, dv = accelerations(stance, time, y[0], y[1], y[2], y[3])
    dy[0] = y[2]
    dy[1] = y[3]
    dy[2] = dw
    dy[3] = dv


@entry_point()
def gap_and_rate(time, y, body, command, heading, side):
    """Height of the swing foot over the floor, and its rate."""
    stance = stance_of(body_of(body), Command(command[0], command[1], command[2]), heading, side)
    dw, dv = accelerations(stance, time, y[0], y[1], y[2], y[3])
    sin_a, cos_a = sine_cosine(y[0] + stance.tilt)
    sin_twist, cos_twist = sine_cosine(y[1])
    gap, rate, _, _ = foot_gap(stance, sin_a, cos_a, sin_twist, cos_twist, y[2], y[3], dw, dv)
    return gap, rate


@entry_point()
def strike(time, y, body, command, heading, side, outcome):
    """The outcome of a heel strike at this very instant, whose start was as it is: only state and places mean anything."""
    stance = stance_of(body_of(body), Command(command[0], command[1], command[2]), heading, side)
    sin_a, cos_a = sine_cosine(y[0] + stance.tilt)
    sin_twist, cos_twist = sine_cosine(y[1])
    z, q, dq = middle_of_masses(stance, sin_twist, cos_twist, stance.previous_offset)
    _, _, m11, m12, m22 = mass_matrix(stance, sin_a, cos_a, sin_twist, z, q, dq)
    energy = kinetic_energy(m11, m12, m22, y[2], y[3])
    flight = Flight(
        time, y[0], y[1], y[2], y[3], 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0,
        LANDING, y[0], y[1], energy,
    )  # fmt: skip
    write_outcome(finish(stance, flight), outcome)
