"""From one heel strike towards the next: error-controlled steps of the stance phase that aim at the landing.

The gap under the swing foot has closed-form first and second derivatives. They predict the landing time, the integrator's steps are chosen to
end there, and after each step the quintic through the gap's values at both ends improves the prediction. A step that has gone past the
landing by more than ``LANDING_WINDOW`` is taken again with the length that the quintic says.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lean_yaw_env.kernel import verner
from lean_yaw_env.kernel.compilation import fused
from lean_yaw_env.kernel.contact import worst_contact
from lean_yaw_env.kernel.elementary import sine_cosine
from lean_yaw_env.kernel.lanes import chooser, replacer
from lean_yaw_env.kernel.records import (
    BACKWARD,
    FAILED,
    FLYING,
    LANDING,
    LIFT_OFF,
    NO_STRIKE,
    SIDEWAYS,
    SLIP,
    Flight,
)
from lean_yaw_env.kernel.stance import (
    accelerations_and_forces,
    accelerations_in,
    forces_in,
    mass_matrix,
    mass_offset,
    middle_of_masses,
    pose_of,
)
from lean_yaw_env.kernel.swing import foot_gap

# Largest estimated error of a step in any coordinate: keeps a walking step's state within 1e-10 of the exact one (measured over thousands
# around Table 1's gait: 2e-11 with the masses at rest, 4e-11 while they move by up to 0.06).
STEP_TOLERANCE = 2e-10
_PER_TOLERANCE = 1.0 / STEP_TOLERANCE
# While the masses move, more and shorter steps add up their errors: the tolerance is halved, and divided by 1 + this times the shift.
SHIFT_CAUTION = 100.0
# Estimated error of a step over the first third of a shift, by the shift and its square (measured around Table 1's gait).
SHIFT_ERROR, SHIFT_ERROR_BY_SHIFT = 5e-9, 3.5e-6
LONGEST_STEP = 0.6
FIRST_STEP = 0.45
# A landing closer than this is reached by one classical fourth-order step, whose error is then below 1e-12.
LANDING_WINDOW = 0.01
SHIFTING_LANDING_WINDOW = 0.002  # the moving masses' path has larger derivatives
# The same, in steps that the error control allows: a walker that collapses moves on a shorter time scale.
LANDING_WINDOW_SHARE = 0.04
# A walking step takes two to ten attempts, one with a stiff ankle some hundreds; ``careful`` takes over from a solver that needs this many.
MOST_ATTEMPTS = 4000.0
# A walker that all but stops short of mid-stance may creep back, lean, and yet come down in front. Of 3,000 walkers disturbed around
# Table 1's gait that moved back at this rate and sped up, none did; of those that moved back at all, up to a third.
BACKWARD_RATE = 0.1
# Without hip width foot and ankle can come to move the masses alike: accelerations then grow without bound and nothing holds the walker.
# This is the least of 1 - m12^2 / (m11 m22) that is walked through; ordinary steps stay above 0.5.
LEAST_INDEPENDENCE = 1e-3
_UNKNOWN = 1e9
_FAR = 10.0
_SAME_TIME = 1e-9
_THIRD = 1.0 / 3.0


@fused
def time_to_touch(gap, gap_rate, gap_acceleration):
    """When a gap of constant acceleration closes next; ``_UNKNOWN`` if it does not."""
    discriminant = gap_rate * gap_rate - 2.0 * gap * gap_acceleration
    root = np.sqrt(discriminant if discriminant > 0.0 else 0.0)
    closing = root - gap_rate
    return (
        2.0 * gap / (closing if closing > 1e-9 else 1.0)
        if (discriminant >= 0.0) & (closing > 1e-9)
        else _UNKNOWN
    )


@fused
def predict_landing(h, gap0, rate0, acceleration0, gap1, rate1, acceleration1):
    """Landing time after the end of a step of length ``h``, from the quintic through both ends; negative if within it.

    Returns the time (``_UNKNOWN`` if none is in sight) and whether the landing, or a dip through the floor, lies within the step.
    """
    a1 = rate0 * h
    a2 = 0.5 * acceleration0 * h * h
    d0 = gap1 - gap0 - a1 - a2
    d1 = rate1 * h - a1 - 2.0 * a2
    d2 = acceleration1 * h * h - 2.0 * a2
    a3 = 10.0 * d0 - 4.0 * d1 + 0.5 * d2
    a4 = 7.0 * d1 - 15.0 * d0 - d2
    a5 = 6.0 * d0 - 3.0 * d1 + 0.5 * d2

    # A gap that closes and opens again within the step: where it is least
    turns = (rate0 < 0.0) & (rate1 > 0.0)
    lowest = rate0 / (rate0 - rate1 if turns else 1.0)
    for _ in range(2):
        slope = a1 + lowest * (
            2.0 * a2 + lowest * (3.0 * a3 + lowest * (4.0 * a4 + lowest * 5.0 * a5))
        )
        curvature = 2.0 * a2 + lowest * (6.0 * a3 + lowest * (12.0 * a4 + lowest * 20.0 * a5))
        lowest = lowest - slope / (curvature if curvature > 1e-12 else 1e12)
        lowest = min(max(lowest, 0.0), 1.0)
    least = gap0 + lowest * (a1 + lowest * (a2 + lowest * (a3 + lowest * (a4 + lowest * a5))))
    passed = (gap1 <= 0.0) | (turns & (least <= 0.0))

    ahead = time_to_touch(gap1, rate1, acceleration1)
    guess = 1.0 + ahead / h
    # Within the step: where a straight line through its ends, or a parabola down to the least gap, comes down through zero
    dips = turns & (least <= 0.0)
    end = least if dips else gap1
    share = (-least if dips else gap0) / (gap0 - end if end <= 0.0 else 1.0)
    dipping = lowest * (1.0 - np.sqrt(share if dips else 0.0))
    s = (dipping if dips else share) if passed else guess
    # Halley's method: two of its steps do what three or four of Newton's do, with as many divisions as steps
    for _ in range(2):
        value = gap0 + s * (a1 + s * (a2 + s * (a3 + s * (a4 + s * a5))))
        slope = a1 + s * (2.0 * a2 + s * (3.0 * a3 + s * (4.0 * a4 + s * 5.0 * a5)))
        half_curvature = a2 + s * (3.0 * a3 + s * (6.0 * a4 + s * 10.0 * a5))
        bend = slope * slope - value * half_curvature
        usable = (slope < -1e-12) & (bend > 1e-12)
        s = s - (value * slope if usable else 0.0) / (bend if usable else 1.0)
        s = min(max(s, 0.0), 1.0) if passed else s
    # The quintic is trusted ahead only as far as it has been seen behind
    trusted = passed | ((s > 1.0) & (s < 2.5) & (abs(s - guess) < 0.5))
    return ((s - 1.0) * h if trusted else ahead), passed


@fused
def next_step_length(controlled, landing, time, shift_end):
    """Divide the time to the landing evenly, or to the end of the masses' shift: their path is not smooth there."""
    rest = shift_end - time
    shifting = rest > _SAME_TIME
    controlled = FIRST_STEP if abs(rest) <= _SAME_TIME else min(controlled, LONGEST_STEP)
    until = min(landing, rest) if shifting else landing
    return until / np.ceil(until / controlled) if until < _FAR else controlled


@fused
def shift_caution(change):
    """What a step's error counts more than at rest, while the masses move by ``change``."""
    return 2.0 + 2.0 * SHIFT_CAUTION * abs(change)


@fused
def eighth_root(x):
    return np.sqrt(np.sqrt(np.sqrt(x)))


@fused
def first_step_length(landing, shift_end, change):
    """A third of the shift, or what of it the error control is expected to accept."""
    shift = abs(change)
    error = shift * (SHIFT_ERROR + SHIFT_ERROR_BY_SHIFT * shift) * shift_caution(change)
    part = 0.95 / eighth_root(max(error * _PER_TOLERANCE, 0.66))
    third = shift_end * (part * _THIRD)
    return next_step_length(third if shift_end > 0.0 else FIRST_STEP, landing, 0.0, shift_end)


@fused
def shift_end_of(stance):
    """When the masses stop, or zero if they do not move.

    Masses that move only in a derivative's imaginary part count: the error control does not see them, the shift's end must be met.
    """
    return 1.0 / stance.shift_rate if stance.offset_change != 0.0 else 0.0


@fused
def is_shifting(stance, time):
    """Whether the masses move on at this time."""
    return time.real < shift_end_of(stance) - _SAME_TIME


@fused
def is_rolling_back(pitch_rate, pitch_acceleration):
    """Whether the stance leg has turned back; asked of walkers whose masses are at rest, as a shift pushes the leg about."""
    return (pitch_rate.real >= BACKWARD_RATE) & (pitch_acceleration.real >= 0.0)


@fused
def is_collapsing(stance, time, sin_a, cos_a, sin_twist, cos_twist, upright):
    """Whether an ankle is past a right angle (``upright``: the swing foot's), or foot and ankle no longer move the masses apart."""
    z, q, dq = middle_of_masses(stance, sin_twist, cos_twist, mass_offset(stance, time)[0])
    _, _, m11, m12, m22 = mass_matrix(stance, sin_a, cos_a, sin_twist, z, q, dq)
    independent = (m11 * m22 - m12 * m12).real > LEAST_INDEPENDENCE * (m11 * m22).real
    return (cos_twist.real <= 0.0) | (upright.real <= 0.0) | (not independent)


_integrate = verner.stepper(2, pose_of, accelerations_in, look=forces_in, looks=(7, 6, 9))


@fused
def stance_step(c, t, x, b, w, v, dw, dv, h):
    """One step of Verner's pair for pitch x, twist b and their rates w, v.

    Returns the new coordinates and rates, the largest error estimate, the damping's loss, and, at stages 7, 6 and 9, the normal force and
    the square of the tangential one.
    """
    x, b, w, v, error, rates, (seen_7, seen_6, seen_9) = _integrate(c, t, x, b, w, v, dw, dv, h)
    v1, v6, v7, v8, v9, v10, v11, v12 = rates
    loss = c.ankle_damping * verner.integral(
        h, v1 * v1, v6 * v6, v7 * v7, v8 * v8, v9 * v9, v10 * v10, v11 * v11, v12 * v12
    )
    normals = (seen_7[2].real, seen_6[2].real, seen_9[2].real)
    squares = (seen_7[3].real, seen_6[3].real, seen_9[3].real)
    return x, b, w, v, error, loss, normals, squares


class Trial(NamedTuple):
    """Where an integrator step would end, and what it has seen on the way."""

    time: float
    pitch: float
    twist: float
    pitch_rate: float
    twist_rate: float
    pitch_acceleration: float
    twist_acceleration: float
    gap: float
    gap_rate: float
    gap_acceleration: float
    error: float  # in tolerances
    loss: float  # in the ankle's damper
    normal_force: float
    tangential_squared: float
    least_normal_force: float
    friction_squared: float
    collapses: bool


_reached = chooser(Flight, Trial)
_onward = replacer(Flight, "next_step", "damping_loss", "evaluations", "attempts", "status")


@fused
def trial(stance, flight, h):
    """An integrator step of length ``h``."""
    pitch, twist, pitch_rate, twist_rate, error, loss, normals, squares = stance_step(
        stance, flight.time, flight.pitch, flight.twist, flight.pitch_rate, flight.twist_rate,
        flight.pitch_acceleration, flight.twist_acceleration, h,
    )  # fmt: skip
    time = flight.time + h
    pitch_acceleration, twist_acceleration, normal, square = accelerations_and_forces(
        stance, time, pitch, twist, pitch_rate, twist_rate
    )
    sin_a, cos_a = sine_cosine(pitch + stance.tilt)
    sin_twist, cos_twist = sine_cosine(twist)
    gap, gap_rate, gap_acceleration, upright = foot_gap(
        stance, sin_a, cos_a, sin_twist, cos_twist,
        pitch_rate, twist_rate, pitch_acceleration, twist_acceleration,
    )  # fmt: skip
    begins_shifting = is_shifting(stance, flight.time)
    caution = shift_caution(stance.offset_change.real) if begins_shifting else 1.0
    least, most = worst_contact(
        (flight.normal_force, normals[0], normals[1], normals[2], normal.real),
        (flight.tangential_squared, squares[0], squares[1], squares[2], square.real),
    )
    return Trial(
        time, pitch, twist, pitch_rate, twist_rate, pitch_acceleration, twist_acceleration,
        gap, gap_rate, gap_acceleration, error * caution * _PER_TOLERANCE, loss,
        normal.real, square.real, min(flight.least_normal_force, least), max(flight.friction_squared, most),
        is_collapsing(stance, time, sin_a, cos_a, sin_twist, cos_twist, upright),
    )  # fmt: skip


@fused
def controlled_lengths(h, error):
    """How long a step the error control allows after one of this error (in tolerances), and for trying that one again."""
    factor = 0.9 / eighth_root(max(error, 1e-8))
    longer = h * min(max(factor, 0.5), 4.0)
    shorter = h * min(max(factor, 0.2), 0.9) if error > 1.0 else 0.2 * h
    return longer, shorter


@fused
def taken(stance, flight, tried, accepted, landed, next_step, most_attempts):
    """The flight after an integrator step was tried: whether the walker lands or falls there, if it was accepted."""
    attempts = flight.attempts + 1.0
    rolls_back = is_rolling_back(tried.pitch_rate, tried.pitch_acceleration) & (
        not is_shifting(stance, tried.time)
    )
    status = FAILED if attempts >= most_attempts else FLYING
    if accepted:
        status = NO_STRIKE if tried.time.real >= stance.max_duration.real else status
        status = BACKWARD if rolls_back else status
        status = LANDING if landed else status
        status = SIDEWAYS if tried.collapses else status
        status = SLIP if tried.friction_squared > stance.friction_limit_squared.real else status
        status = LIFT_OFF if tried.least_normal_force <= 0.0 else status

    loss = flight.damping_loss + tried.loss if accepted else flight.damping_loss
    evaluations = flight.evaluations + 13.0
    onward = _reached(accepted, tried, flight)
    return _onward(onward, next_step, loss, evaluations, attempts, status)


@fused
def advance(stance, flight):
    """Try one integrator step; accept, shorten or repeat it, and say whether the walker lands or falls."""
    h = flight.next_step
    tried = trial(stance, flight, h)
    now = tried.time.real
    landing, passed = predict_landing(
        h, flight.gap.real, flight.gap_rate.real, flight.gap_acceleration.real,
        tried.gap.real, tried.gap_rate.real, tried.gap_acceleration.real,
    )  # fmt: skip
    shift_end = shift_end_of(stance)
    shifting = is_shifting(stance, tried.time)
    accurate = tried.error <= 1.0  # a NaN is not
    longer, shorter = controlled_lengths(h, tried.error)
    window = SHIFTING_LANDING_WINDOW if shifting else LANDING_WINDOW
    window = min(window, LANDING_WINDOW_SHARE * longer)
    repeat = passed & (landing < -window)
    accepted = accurate & (not repeat)
    landed = accepted & (abs(landing) <= window) & ((not shifting) | (now + landing <= shift_end))

    shorter = h + landing if accurate else shorter
    ahead = landing if landing > 0.0 else _UNKNOWN
    onward = next_step_length(longer, ahead, now, shift_end)
    onward = landing if landed else onward
    next_step = onward if accepted else shorter
    return taken(stance, flight, tried, accepted, landed, next_step, MOST_ATTEMPTS)
