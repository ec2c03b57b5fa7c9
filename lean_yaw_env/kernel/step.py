"""One walking step: from a section state just after heel strike to the next one. Everything in the package calls this.

A section state is (heading, stance pitch, ankle angle, stance pitch rate, ankle rate) with the side of the foot that stands.
"""

from __future__ import annotations

import numpy as np

from lean_yaw_env.kernel.blocks import Model, block_of
from lean_yaw_env.kernel.careful import fly_carefully
from lean_yaw_env.kernel.compilation import called, compiled_apart, entry_point, fused, inlined
from lean_yaw_env.kernel.elementary import quotient, sine_cosine, within_half_turn
from lean_yaw_env.kernel.flight import (
    advance,
    first_step_length,
    is_collapsing,
    is_rolling_back,
    shift_end_of,
    time_to_touch,
)
from lean_yaw_env.kernel.heel_strike import impact, landing_place, landing_pose
from lean_yaw_env.kernel.lanes import row_reader, row_writer
from lean_yaw_env.kernel.records import (
    BACKWARD,
    BODY_INPUTS,
    FAILED,
    FLYING,
    LANDED,
    LANDING,
    LIFT_OFF,
    SIDEWAYS,
    SLIP,
    STEPPED,
    TRIP,
    Body,
    Command,
    Flight,
    Outcome,
    SectionState,
    Stance,
)
from lean_yaw_env.kernel.stance import (
    accelerations,
    accelerations_and_forces,
    kinetic_energy,
    mass_matrix,
    mass_offset,
    middle_of_masses,
    middle_position,
)
from lean_yaw_env.kernel.swing import foot_gap

# The gap before the last correction, which squares it: above this, the landing was not found.
LANDING_RESIDUAL = 1e-7
_SIXTH = 1.0 / 6.0


@fused
def stance_of(body, command, heading, side):
    """Constants of a step. On a slope that turns with the walker, downhill is where the stance foot heads."""
    sin_tilt, cos_tilt = sine_cosine(body.ankle_tilt)
    sin_slope, cos_slope = sine_cosine(body.slope)
    sin_heading, cos_heading = sine_cosine(within_half_turn(heading))
    turns = body.slope_turns.real != 0.0
    sin_inter_leg, cos_inter_leg = sine_cosine(command.inter_leg_angle)
    return Stance(
        body.foot_radius, body.ankle_tilt, sin_tilt, cos_tilt, 0.5 * side * body.hip_width,
        0.25 * body.hip_width * body.hip_width, sin_slope if turns else sin_slope * cos_heading, -cos_slope,
        0.0 * sin_slope if turns else sin_slope * sin_heading, sin_inter_leg, cos_inter_leg,
        body.ankle_stiffness, body.ankle_damping, command.previous_offset,
        command.mass_offset - command.previous_offset, 1.0 / body.shift_time,
        body.friction_limit * body.friction_limit, body.max_step_duration, heading,
    )  # fmt: skip


@fused
def begin(body, command, state, side):
    """Stance and flight just after heel strike: it may be a fall already, or (as an option) an immediate heel strike."""
    stance = stance_of(body, command, state.heading, side)
    pitch, twist = state.stance_pitch, -state.ankle_angle
    pitch_rate, twist_rate = state.stance_pitch_rate, -state.ankle_rate
    sin_a, cos_a = sine_cosine(pitch + stance.tilt)
    sin_twist, cos_twist = sine_cosine(twist)
    time = 0.0 * pitch
    dw, dv, normal, square = accelerations_and_forces(
        stance, time, pitch, twist, pitch_rate, twist_rate
    )
    friction = quotient(square, normal * normal)
    gap, gap_rate, gap_acceleration, upright = foot_gap(
        stance, sin_a, cos_a, sin_twist, cos_twist, pitch_rate, twist_rate, dw, dv
    )
    z, q, dq = middle_of_masses(stance, sin_twist, cos_twist, stance.previous_offset)
    _, _, m11, m12, m22 = mass_matrix(stance, sin_a, cos_a, sin_twist, z, q, dq)

    first = first_step_length(
        time_to_touch(gap.real, gap_rate.real, gap_acceleration.real),
        shift_end_of(stance).real,
        stance.offset_change.real,
    )
    buried = gap.real <= 0.0
    strikes = buried & (body.strike_at_start.real != 0.0)
    rolls_back = is_rolling_back(pitch_rate, dw) & (shift_end_of(stance).real <= 0.0)
    status = BACKWARD if rolls_back else FLYING
    status = TRIP if buried else status
    status = LANDED if strikes else status
    collapses = is_collapsing(stance, time, sin_a, cos_a, sin_twist, cos_twist, upright)
    status = SIDEWAYS if collapses else status
    status = SLIP if friction.real > stance.friction_limit_squared.real else status
    status = LIFT_OFF if normal.real <= 0.0 else status
    flight = Flight(
        time, pitch, twist, pitch_rate, twist_rate, dw, dv, gap, gap_rate, gap_acceleration,
        0.0 if strikes else first, normal.real, square.real, normal.real, friction.real, time, 1.0, 0.0, status,
        pitch, twist, kinetic_energy(m11, m12, m22, pitch_rate, twist_rate),
    )  # fmt: skip
    return stance, flight


@fused
def short_step(c, t, x, b, w, v, dw1, dv1, h):
    """One classical Runge-Kutta step of fourth order, for the last stretch to the landing; also the damping's loss."""
    half = 0.5 * h
    w2 = w + half * dw1
    v2 = v + half * dv1
    dw2, dv2 = accelerations(c, t + half, x + half * w, b + half * v, w2, v2)
    w3 = w + half * dw2
    v3 = v + half * dv2
    dw3, dv3 = accelerations(c, t + half, x + half * w2, b + half * v2, w3, v3)
    w4 = w + h * dw3
    v4 = v + h * dv3
    dw4, dv4 = accelerations(c, t + h, x + h * w3, b + h * v3, w4, v4)
    sixth = h * _SIXTH
    return (
        x + sixth * (w + 2.0 * (w2 + w3) + w4),
        b + sixth * (v + 2.0 * (v2 + v3) + v4),
        w + sixth * (dw1 + 2.0 * (dw2 + dw3) + dw4),
        v + sixth * (dv1 + 2.0 * (dv2 + dv3) + dv4),
        sixth * c.ankle_damping * (v * v + 2.0 * (v2 * v2 + v3 * v3) + v4 * v4),
    )


@fused
def correct_landing(stance, time, x, b, w, v, dw, dv, jerk_w, jerk_v, loss):
    """One Newton correction of the time at which the gap is zero, and the motion by its Taylor series; also the gap before it.

    The correction carries a complex part, so that the landing time has its derivatives.
    """
    sin_a, cos_a = sine_cosine(x + stance.tilt)
    sin_twist, cos_twist = sine_cosine(b)
    gap, gap_rate, _, _ = foot_gap(stance, sin_a, cos_a, sin_twist, cos_twist, w, v, dw, dv)
    correction = quotient(-gap, gap_rate)
    x = x + correction * (w + correction * (0.5 * dw + _SIXTH * correction * jerk_w))
    b = b + correction * (v + correction * (0.5 * dv + _SIXTH * correction * jerk_v))
    w = w + correction * (dw + 0.5 * correction * jerk_w)
    v = v + correction * (dv + 0.5 * correction * jerk_v)
    dw = dw + correction * jerk_w
    dv = dv + correction * jerk_v
    loss = loss + correction * stance.ankle_damping * v * v
    return time + correction, x, b, w, v, dw, dv, loss, gap


@fused
def touch_down(stance, flight):
    """Follow a landing flight to where the gap is zero, to round-off: a short step, then two Newton corrections in time."""
    h = flight.next_step
    x, b, w, v, loss = short_step(
        stance, flight.time, flight.pitch, flight.twist, flight.pitch_rate, flight.twist_rate,
        flight.pitch_acceleration, flight.twist_acceleration, h,
    )  # fmt: skip
    time = flight.time + h
    dw, dv = accelerations(stance, time, x, b, w, v)
    per_step = 1.0 / h if h != 0.0 else 0.0
    jerk_w = (dw - flight.pitch_acceleration) * per_step
    jerk_v = (dv - flight.twist_acceleration) * per_step
    # twice in line: a loop of as much is not unrolled, and then the one over walkers not vectorised
    time, x, b, w, v, dw, dv, loss, gap = correct_landing(
        stance, time, x, b, w, v, dw, dv, jerk_w, jerk_v, loss
    )
    time, x, b, w, v, dw, dv, loss, gap = correct_landing(
        stance, time, x, b, w, v, dw, dv, jerk_w, jerk_v, loss
    )
    return time, x, b, w, v, gap, flight.damping_loss + loss


@fused
def finish(stance, flight):
    """The outcome of a flight that has ended: the heel strike of one that lands, the last state of one that fell."""
    moves = flight.status == LANDING
    landing = moves | (flight.status == LANDED)
    moved_time, moved_x, moved_b, moved_w, moved_v, gap, moved_loss = touch_down(stance, flight)
    time = moved_time if moves else flight.time
    x = moved_x if moves else flight.pitch
    b = moved_b if moves else flight.twist
    w = moved_w if moves else flight.pitch_rate
    v = moved_v if moves else flight.twist_rate
    loss = moved_loss if moves else flight.damping_loss

    sin_a, cos_a = sine_cosine(x + stance.tilt)
    sin_twist, cos_twist = sine_cosine(b)
    offset, offset_rate, _ = mass_offset(stance, time)
    turn, sin_turn, cos_turn, new_x, new_sin_a, new_cos_a, new_b, new_sin_twist, new_cos_twist = (
        landing_pose(stance, sin_a, cos_a, sin_twist, cos_twist)
    )
    ahead, aside = landing_place(
        stance, x, sin_a, cos_a, sin_twist, cos_twist, new_x, new_sin_a, new_cos_a, sin_turn, cos_turn,
    )  # fmt: skip
    new_w, new_v, before, after = impact(
        stance, sin_a, cos_a, sin_twist, cos_twist, w, v, offset, offset_rate,
        new_sin_a, new_cos_a, new_sin_twist, new_cos_twist,
    )  # fmt: skip

    found = (not moves) | (abs(gap.real) <= LANDING_RESIDUAL)
    # A walker that collapses onto its swing foot closes the gap as well: a step goes forward, onto a foot in front
    forward = (w.real < 0.0) & (ahead.real > 0.0) & (cos_turn.real > 0.0)
    status = flight.status
    if landing:
        status = STEPPED if forward else SIDEWAYS
        status = status if found else FAILED
    stepped = status == STEPPED

    start_sin_a, start_cos_a = sine_cosine(flight.start_pitch + stance.tilt)
    start_sin_twist, start_cos_twist = sine_cosine(flight.start_twist)
    _, q, dq = middle_of_masses(stance, start_sin_twist, start_cos_twist, stance.previous_offset)
    x0, y0, z0 = middle_position(stance, flight.start_pitch, start_sin_a, start_cos_a, q, dq)
    _, q, dq = middle_of_masses(stance, sin_twist, cos_twist, offset)
    x1, y1, z1 = middle_position(stance, x, sin_a, cos_a, q, dq)
    gravity_work = (
        stance.gravity_x * (x1 - x0) + stance.gravity_y * (y1 - y0) + stance.gravity_z * (z1 - z0)
    )
    ankle_loss = loss + 0.5 * stance.ankle_stiffness * (
        b * b - flight.start_twist * flight.start_twist
    )
    shifts = stance.offset_change.real != 0.0
    shift_work = before - flight.start_kinetic - gravity_work + ankle_loss
    sin_heading, cos_heading = sine_cosine(within_half_turn(stance.heading))
    nothing = 0.0 * x
    return Outcome(
        stance.heading + turn if stepped else stance.heading + nothing,
        new_x if stepped else x,
        -new_b if stepped else -b,
        new_w if stepped else w,
        -new_v if stepped else -v,
        status,
        time,
        ahead * cos_heading + aside * sin_heading if stepped else nothing,
        aside * cos_heading - ahead * sin_heading if stepped else nothing,
        turn if stepped else nothing,
        offset,
        flight.least_normal_force,
        np.sqrt(flight.friction_squared),
        gravity_work,
        shift_work if shifts else nothing,
        before - after if stepped else nothing,
        ankle_loss,
        flight.evaluations + (4.0 if moves else 0.0),
    )


@called
def walk_carefully(body, command, state, side):
    """A walking step whose landing ``advance`` has not found."""
    stance, flight = begin(body, command, state, side)
    return finish(stance, fly_carefully(stance, flight))


ACTIVE = Model(
    command=Command,
    state=SectionState,
    stance=Stance,
    flight=Flight,
    outcome=Outcome,
    inputs=(*SectionState._fields, *Command._fields, *BODY_INPUTS),
    outputs=(
        *SectionState._fields,
        "duration",
        "displacement_x",
        "displacement_z",
        "mass_offset",
        "shift_work",
    ),
    begin=begin,
    advance=advance,
    finish=finish,
    carefully=walk_carefully,
    name="lean_yaw_careful_step",
)
"""The walker whose swing leg is held in front."""

BLOCK = block_of(ACTIVE)
_carefully, _walk_carefully = BLOCK.carefully, BLOCK.walk_carefully


@compiled_apart(BLOCK.name, BLOCK.size, BLOCK.ended, FAILED)
def careful_step(work, i):
    """The step in lane ``i`` of a block's work array, whose landing ``advance`` has not found."""
    _carefully(work, i)


@inlined
def quick_step(body, command, state, side):
    """One walking step; ``FAILED`` if its landing is not found."""
    stance, flight = begin(body, command, state, side)
    while flight.status == FLYING:
        flight = advance(stance, flight)
    return finish(stance, flight)


@inlined
def walking_step(body, command, heading, pitch, ankle, pitch_rate, ankle_rate, side):
    """One walking step; numbers may be complex to carry a derivative, every decision looks at real parts."""
    state = SectionState(heading, pitch, ankle, pitch_rate, ankle_rate)
    outcome = quick_step(body, command, state, side)
    if outcome.status == FAILED:
        outcome = _walk_carefully(body, command, state, side)
    return outcome


body_of = row_reader(Body)
command_of = row_reader(Command)
write_outcome = row_writer(Outcome)


@entry_point()
def step(body, command, state, side, outcome):
    """One walking step on rows of floats, as those of a batch: ``Body`` (11,), ``Command`` (3,), section state (5,), side.

    The result is written to ``outcome`` (18,), in the order of ``Outcome``: passing arrays takes a third of the time of boxed tuples.
    """
    s = state
    result = walking_step(body_of(body), command_of(command), s[0], s[1], s[2], s[3], s[4], side)
    write_outcome(result, outcome)
