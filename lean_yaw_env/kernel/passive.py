"""The passive walker's step: stance phase with a swinging leg, heel strike, and its derivatives.

As in ``step`` and ``flight``, but for the event: a straight passive leg also meets the floor near
mid-stance, which is ignored. A heel strike is the foot coming down in front: inter-leg angle
positive, the swing foot ahead of its hip and the stance foot behind its own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lean_yaw_env.kernel.compilation import entry_point, inlined
from lean_yaw_env.kernel.elementary import sine_cosine, within_half_turn
from lean_yaw_env.kernel.flight import (
    MOST_ATTEMPTS,
    STEP_TOLERANCE,
    is_collapsing,
    predict_landing,
    time_to_touch,
)
from lean_yaw_env.kernel.heel_strike import impact, landing_place, landing_pose
from lean_yaw_env.kernel.lanes import chooser, replacer, row_writer
from lean_yaw_env.kernel.records import (
    BACKWARD,
    FAILED,
    FLYING,
    LANDING,
    LIFT_OFF,
    NO_STRIKE,
    SIDEWAYS,
    SLIP,
    STEPPED,
    TRIP,
    Body,
    Command,
)
from lean_yaw_env.kernel.stance import (
    accelerations_and_contact,
    kinetic_energy,
    mass_matrix,
    middle_of_masses,
    middle_position,
)
from lean_yaw_env.kernel.step import LANDING_RESIDUAL, body_of, stance_of
from lean_yaw_env.kernel.swinging_leg import (
    along_tangent,
    swing_hip_levers,
    swinging_accelerations,
    swinging_gap,
    swinging_step,
    trailing_angle,
    with_inter_leg_angle,
)

# Steps short enough that the quintic through a gap's ends shows whatever it does between them.
LONGEST_STEP = 0.2
# A landing this near is reached by a Taylor series in time, whose error is then below 1e-17.
LANDING_WINDOW = 1e-5
# Where a scuff and a heel strike cannot be told apart in a step this short, it is a scuff.
SHORTEST_DOUBT = 1e-3
# How far from the floor the trailing foot may be left by the solver of the start.
START_RESIDUAL = 1e-12
# Columns of the derivatives: the section state, then the body's constants that are differentiable.
INPUTS = 12
_TINY = 1e-30
_RIGHT_ANGLE = 0.5 * np.pi


class PassiveFlight(NamedTuple):
    """A passive walker between heel strikes: where the integrator stands, what it tries next."""

    time: float
    pitch: float
    twist: float
    inter_leg: float
    pitch_rate: float
    twist_rate: float
    inter_leg_rate: float
    pitch_acceleration: float
    twist_acceleration: float
    inter_leg_acceleration: float
    gap: float
    gap_rate: float
    gap_acceleration: float
    in_front: float
    next_step: float
    least_normal_force: float
    friction_squared: float
    attempts: float
    status: float
    start_pitch: float
    start_twist: float
    start_inter_leg: float
    start_kinetic: float


_reached = chooser(PassiveFlight, PassiveFlight)
_onward = replacer(PassiveFlight, "next_step", "attempts", "status")


class PassiveOutcome(NamedTuple):
    """One passive step's result, in the order of a row of ``passive_batch``'s results.

    After a fall: where the walker was last, and no displacement.
    """

    heading: float
    stance_pitch: float
    ankle_angle: float
    stance_pitch_rate: float
    ankle_rate: float
    inter_leg_rate: float
    inter_leg_angle: float
    status: float
    duration: float
    displacement_x: float
    displacement_z: float
    heading_change: float
    least_normal_force: float
    greatest_friction: float
    gravity_work: float
    impact_loss: float
    ankle_loss: float
    start_inter_leg_angle: float
    evaluations: float


@inlined
def _is_in_front(inter_leg, pitch, upright, sin_swing_pitch):
    """Whether the swing foot may come down on its sole in front; a leg that has swung over the top may not."""
    front = (inter_leg.real > 0.0) & (inter_leg.real < np.pi) & (pitch.real < 0.0)
    return 1.0 if front & (upright.real > 0.0) & (sin_swing_pitch.real > 0.0) else 0.0


@inlined
def _is_collapsing(c, pitch, twist):
    """Whether the ankle is past a right angle, or foot and ankle no longer move the masses apart."""
    sin_a, cos_a = sine_cosine(pitch + c.tilt)
    sin_b, cos_b = sine_cosine(twist)
    return is_collapsing(c, 0.0 * pitch, sin_a, cos_a, sin_b, cos_b, 1.0)


@inlined
def _start(c, pitch, twist, pitch_rate, twist_rate, inter_leg_rate, given):
    """The flight just after heel strike; ``given`` inter-leg angle, or NaN for both feet down."""
    solved, left = trailing_angle(c, pitch, twist)
    asked = given == given
    inter_leg = given + 0.0 * solved if asked else solved
    on_floor = asked | ((abs(left.real) <= START_RESIDUAL) & (solved.real < 0.0))
    inter_leg = inter_leg if on_floor else 0.0 * pitch
    dw, dv, du = swinging_accelerations(
        c, pitch, twist, inter_leg, pitch_rate, twist_rate, inter_leg_rate
    )
    time = 0.0 * pitch
    _, _, normal, friction = accelerations_and_contact(
        c, time, pitch, twist, pitch_rate, twist_rate
    )
    gap, gap_rate, gap_acceleration, upright, ahead = swinging_gap(
        c, pitch, twist, inter_leg, pitch_rate, twist_rate, inter_leg_rate, dw, dv, du
    )
    sin_a, cos_a = sine_cosine(pitch + c.tilt)
    sin_b, cos_b = sine_cosine(twist)
    z, q, dq = middle_of_masses(c, sin_b, cos_b, c.previous_offset)
    _, _, m11, m12, m22 = mass_matrix(c, sin_a, cos_a, sin_b, z, q, dq)
    rolls_back = (pitch_rate.real >= 0.0) & (dw.real >= 0.0)
    status = BACKWARD if rolls_back else FLYING
    status = SIDEWAYS if _is_collapsing(c, pitch, twist) else status
    status = SLIP if friction.real > c.friction_limit_squared.real else status
    status = LIFT_OFF if normal.real <= 0.0 else status
    status = status if on_floor else TRIP
    return PassiveFlight(
        time, pitch, twist, inter_leg, pitch_rate, twist_rate, inter_leg_rate, dw, dv, du,
        gap, gap_rate, gap_acceleration, _is_in_front(inter_leg, pitch, upright, ahead), LONGEST_STEP,
        normal.real, friction.real, 0.0, status, pitch, twist, inter_leg,
        kinetic_energy(m11, m12, m22, pitch_rate, twist_rate),
    )  # fmt: skip


@inlined
def _advance(c, flight):
    """Try one integrator step; accept, shorten or repeat it, and say whether the walker lands."""
    h = flight.next_step
    x, b, d, w, v, u, error = swinging_step(
        c, flight.pitch, flight.twist, flight.inter_leg,
        flight.pitch_rate, flight.twist_rate, flight.inter_leg_rate,
        flight.pitch_acceleration, flight.twist_acceleration, flight.inter_leg_acceleration, h,
    )  # fmt: skip
    time = flight.time + h
    dw, dv, du = swinging_accelerations(c, x, b, d, w, v, u)
    _, _, normal, friction = accelerations_and_contact(c, time, x, b, w, v)
    gap, gap_rate, gap_acceleration, upright, ahead = swinging_gap(c, x, b, d, w, v, u, dw, dv, du)
    front = _is_in_front(d, x, upright, ahead)
    landing, passed = predict_landing(
        h, flight.gap.real, flight.gap_rate.real, flight.gap_acceleration.real,
        gap.real, gap_rate.real, gap_acceleration.real,
    )  # fmt: skip
    # From below the floor: up through it and down again within the step
    _, emerged = predict_landing(
        h, -flight.gap.real, -flight.gap_rate.real, -flight.gap_acceleration.real,
        -gap.real, -gap_rate.real, -gap_acceleration.real,
    )  # fmt: skip

    ratio = error / STEP_TOLERANCE
    accurate = ratio <= 1.0  # a NaN is not
    above = flight.gap.real > 0.0
    aims = above & (flight.in_front != 0.0)
    overshot = aims & passed & (landing < -LANDING_WINDOW)
    turns = (flight.gap_rate.real > 0.0) & (gap_rate.real < 0.0)
    bounced = (not above) & (gap.real <= 0.0) & turns & emerged & (front != 0.0)
    unclear = above & passed & (flight.in_front == 0.0) & (front != 0.0)
    doubtful = (bounced | unclear) & (h > SHORTEST_DOUBT)
    accepted = accurate & (not overshot) & (not doubtful)
    landed = accepted & aims & (abs(landing) <= LANDING_WINDOW) & (front != 0.0)

    factor = 0.9 / np.sqrt(np.sqrt(np.sqrt(max(ratio, 1e-8))))
    shorter = h * min(max(factor, 0.2), 0.9) if ratio > 1.0 else 0.2 * h
    peak = flight.gap_rate.real / (flight.gap_rate.real - gap_rate.real if turns else 1.0)
    again = h * peak if bounced else 0.5 * h
    again = h + landing if overshot else again
    shorter = again if accurate else shorter
    longer = min(h * min(max(factor, 0.5), 4.0), LONGEST_STEP)
    touch = time_to_touch(gap.real, gap_rate.real, gap_acceleration.real)
    touch = landing if aims & (landing > 0.0) else touch
    coming = (front != 0.0) & (gap.real > 0.0) & (touch < 10.0)
    onward = touch / np.ceil(touch / longer) if coming else longer
    onward = landing if landed else onward
    next_step = onward if accepted else shorter

    least = min(flight.least_normal_force, normal.real)
    most = max(flight.friction_squared, friction.real)
    attempts = flight.attempts + 1.0
    status = FAILED if attempts >= MOST_ATTEMPTS else FLYING
    if accepted:
        status = NO_STRIKE if time.real >= c.max_duration.real else status
        # rolling back with the hip past its foot already is going down on one side
        rolls_back = (w.real >= 0.0) & (dw.real >= 0.0)
        status = (BACKWARD if x.real > 0.0 else SIDEWAYS) if rolls_back else status
        status = LANDING if landed else status
        status = LIFT_OFF if x.real <= -_RIGHT_ANGLE else status
        status = SIDEWAYS if _is_collapsing(c, x, b) else status
        status = SLIP if most > c.friction_limit_squared.real else status
        status = LIFT_OFF if least <= 0.0 else status
    reached = PassiveFlight(
        time, x, b, d, w, v, u, dw, dv, du, gap, gap_rate, gap_acceleration, front, next_step,
        least, most, attempts, status, flight.start_pitch, flight.start_twist, flight.start_inter_leg, flight.start_kinetic,
    )  # fmt: skip
    return _onward(_reached(accepted, reached, flight), next_step, attempts, status)


@inlined
def _touch_down(c, flight):
    """Move a landing flight to where the gap is zero, to round-off, by two corrections in time.

    The corrections carry complex parts, so that the landing time has its derivatives. A correction is a step of the midpoint rule: of first
    order, it would leave the derivatives an error of the window's size.
    """
    time, x, b, d = flight.time, flight.pitch, flight.twist, flight.inter_leg
    w, v, u = flight.pitch_rate, flight.twist_rate, flight.inter_leg_rate
    gap = flight.gap
    for _ in range(2):
        dw, dv, du = swinging_accelerations(c, x, b, d, w, v, u)
        gap, gap_rate, _, _, _ = swinging_gap(c, x, b, d, w, v, u, dw, dv, du)
        correction = -gap / gap_rate
        half = 0.5 * correction
        dw, dv, du = swinging_accelerations(
            c, x + half * w, b + half * v, d + half * u, w + half * dw, v + half * dv, u + half * du
        )
        time = time + correction
        x = x + correction * (w + half * dw)
        b = b + correction * (v + half * dv)
        d = d + correction * (u + half * du)
        w = w + correction * dw
        v = v + correction * dv
        u = u + correction * du
    return time, x, b, d, w, v, gap


@inlined
def _new_inter_leg_rate(c, sin_a, cos_a, sin_b, cos_b, w, new):
    """The new swing leg's rate: its foot keeps its momentum along its path about the hip.

    ``new``: the new foot's sines and cosines of A and twist, and its two rates.
    """
    new_sin_a, new_cos_a, new_sin_b, new_cos_b, new_w, new_v = new
    # velocity of the old leg's end, which its foot rolls with, along the leg's own x axis
    kept = (c.radius * w) * (
        c.cos_tilt * cos_b * (c.cos_tilt - cos_a) + c.sin_tilt * (c.sin_tilt - sin_a)
    )
    q, dq, lever_u, lever_w = swing_hip_levers(
        c, -2.0 * c.half_axle, new_sin_a, new_cos_a, new_sin_b, new_cos_b
    )
    hip = along_tangent(
        c, -c.sin_inter_leg, c.cos_inter_leg, new_sin_b, new_cos_b,
        -lever_u * new_w + dq * new_v, -lever_w * new_w, -q * new_v,
    )  # fmt: skip
    return kept - hip - new_w * new_cos_b


@inlined
def _gravity_work(c, flight, x, b):
    """What gravity has done since the start of the step."""
    sin_a, cos_a = sine_cosine(flight.start_pitch + c.tilt)
    sin_b, cos_b = sine_cosine(flight.start_twist)
    _, q, dq = middle_of_masses(c, sin_b, cos_b, c.previous_offset)
    x0, y0, z0 = middle_position(c, flight.start_pitch, sin_a, cos_a, q, dq)
    sin_a, cos_a = sine_cosine(x + c.tilt)
    sin_b, cos_b = sine_cosine(b)
    _, q, dq = middle_of_masses(c, sin_b, cos_b, c.previous_offset)
    x1, y1, z1 = middle_position(c, x, sin_a, cos_a, q, dq)
    return c.gravity_x * (x1 - x0) + c.gravity_y * (y1 - y0) + c.gravity_z * (z1 - z0)


@inlined
def _strike(c, heading, flight):
    """The outcome of a flight that lands."""
    time, x, b, d, w, v, gap = _touch_down(c, flight)
    held = with_inter_leg_angle(c, d)
    sin_a, cos_a = sine_cosine(x + c.tilt)
    sin_b, cos_b = sine_cosine(b)
    turn, sin_turn, cos_turn, new_x, new_sin_a, new_cos_a, new_b, new_sin_b, new_cos_b = (
        landing_pose(held, sin_a, cos_a, sin_b, cos_b)
    )
    ahead, aside = landing_place(
        held, x, sin_a, cos_a, sin_b, cos_b, new_x, new_sin_a, new_cos_a, sin_turn, cos_turn
    )
    new_w, new_v, before, after = impact(
        held, sin_a, cos_a, sin_b, cos_b, w, v, c.previous_offset, 0.0 * x,
        new_sin_a, new_cos_a, new_sin_b, new_cos_b,
    )  # fmt: skip
    new_u = _new_inter_leg_rate(
        held, sin_a, cos_a, sin_b, cos_b, w,
        (new_sin_a, new_cos_a, new_sin_b, new_cos_b, new_w, new_v),
    )  # fmt: skip
    forward = (w.real < 0.0) & (ahead.real > 0.0) & (cos_turn.real > 0.0)
    status = STEPPED if forward else SIDEWAYS
    status = status if abs(gap.real) <= LANDING_RESIDUAL else FAILED
    gravity_work = _gravity_work(c, flight, x, b)
    sin_heading, cos_heading = sine_cosine(within_half_turn(heading))
    return PassiveOutcome(
        heading + turn, new_x, -new_b, new_w, -new_v, new_u, -d, status, time,
        ahead * cos_heading + aside * sin_heading, aside * cos_heading - ahead * sin_heading, turn,
        flight.least_normal_force, np.sqrt(flight.friction_squared), gravity_work, before - after,
        flight.start_kinetic + gravity_work - before, flight.start_inter_leg, 13.0 * flight.attempts,
    )  # fmt: skip


@inlined
def _fall(c, heading, flight):
    """The outcome of a flight that ended otherwise: where the walker was."""
    nothing = 0.0 * flight.pitch
    return PassiveOutcome(
        heading + nothing, flight.pitch, -flight.twist, flight.pitch_rate, -flight.twist_rate,
        flight.inter_leg_rate, flight.inter_leg, flight.status, flight.time, nothing, nothing, nothing,
        flight.least_normal_force, np.sqrt(flight.friction_squared), _gravity_work(c, flight, flight.pitch, flight.twist),
        nothing, nothing, flight.start_inter_leg, 13.0 * flight.attempts,
    )  # fmt: skip


@inlined
def passive_step(
    body, heading, pitch, ankle, pitch_rate, ankle_rate, inter_leg_rate, inter_leg, side
):
    """One passive step; numbers but ``inter_leg`` (or NaN) may be complex, for a derivative."""
    c = stance_of(body, Command(0.0, 0.0, 0.0), heading, side)
    flight = _start(c, pitch, -ankle, pitch_rate, -ankle_rate, inter_leg_rate, inter_leg)
    while flight.status == FLYING:
        flight = _advance(c, flight)
    return _strike(c, heading, flight) if flight.status == LANDING else _fall(c, heading, flight)


_write_outcome = row_writer(PassiveOutcome)


@entry_point()
def passive_batch(bodies, states, inter_legs, sides, results, first, last):
    """Step walkers ``first`` to ``last`` - 1.

    ``bodies`` (1 or n, 11), ``states`` (n, 6), ``inter_legs`` (n,) of angles or NaN for both feet
    down, ``sides`` (n,), ``results`` (n, 19) in the order of ``PassiveOutcome``.
    """
    for i in range(first, last):
        body = body_of(bodies[i if bodies.shape[0] > 1 else 0])
        s = states[i]
        outcome = passive_step(body, s[0], s[1], s[2], s[3], s[4], s[5], inter_legs[i], sides[i])
        _write_outcome(outcome, results[i])


@entry_point()
def passive_jacobian(body, state, side, after, jacobian):
    """Write the next section state (6,) and its derivatives (6, 12); return how the step ended.

    Columns: the section state, then hip width, foot radius, ankle tilt, slope, ankle stiffness and
    damping. Both feet are on the floor at the start, so the inter-leg angle's share is in.
    """
    status = 0.0
    z = np.empty(INPUTS, np.complex128)
    for column in range(INPUTS):
        for k in range(6):
            z[k], z[6 + k] = state[k], body[k]
        z[column] += 1j * _TINY
        outcome = passive_step(
            Body(
                z[6], z[7], z[8], z[9], z[10], z[11], body.shift_time, body.friction_limit,
                body.max_step_duration, body.slope_turns, body.strike_at_start,
            ),
            z[0], z[1], z[2], z[3], z[4], z[5], np.nan, side,
        )  # fmt: skip
        ends = (
            outcome.heading, outcome.stance_pitch, outcome.ankle_angle, outcome.stance_pitch_rate,
            outcome.ankle_rate, outcome.inter_leg_rate,
        )  # fmt: skip
        for k in range(6):
            after[k], jacobian[k, column] = ends[k].real, ends[k].imag / _TINY
        status = outcome.status
    return status


@entry_point()
def passive_trace(body, state, inter_leg, side, duration, rows):
    """Fill ``rows`` (n, 8), n >= 2, at n uniform times from 0 to ``duration``.

    Columns: time, pitch, ankle angle, inter-leg angle, their three rates, the swing foot's gap.
    """
    c = stance_of(body, Command(0.0, 0.0, 0.0), state[0], side)
    flight = _start(c, state[1], -state[2], state[3], -state[4], state[5], inter_leg)
    n = rows.shape[0]
    t, x, b, d = 0.0, flight.pitch, flight.twist, flight.inter_leg
    w, v, u = flight.pitch_rate, flight.twist_rate, flight.inter_leg_rate
    for i in range(n):
        target = duration * i / (n - 1)
        while t < target - 1e-13:
            h = (target - t) / np.ceil((target - t) / 0.05)
            dw, dv, du = swinging_accelerations(c, x, b, d, w, v, u)
            x, b, d, w, v, u, _ = swinging_step(c, x, b, d, w, v, u, dw, dv, du, h)
            t = t + h
        dw, dv, du = swinging_accelerations(c, x, b, d, w, v, u)
        gap = swinging_gap(c, x, b, d, w, v, u, dw, dv, du)[0]
        for k, value in enumerate((t, x, -b, d, w, -v, u, gap)):
            rows[i, k] = value
