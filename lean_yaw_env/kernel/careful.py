"""The walking step once more, for the rare one whose landing the fast way has not found: slow, and deciding every case.

``flight`` predicts a landing from the gap's quintic and corrects it; where the swing foot all but grazes the floor, its gap is next to flat, and
the prediction or the correction may miss. Here steps are short, and a landing is bracketed: between a time at which the foot is above the floor
and one at which it is not, by bisection of integrator steps, down to neighbouring numbers.

What a graze is: a foot that comes down, turns at its lowest point and rises again has touched the floor if its gap there is zero or less. A
tie, a least gap of exactly zero, is a touch. In numbers: here the gap at the lowest point is that of the integrator's step to there, which is
the exact one's to 1e-10. The fast way judges a dip within an integrator step by the gap's quintic, which is right to some 1e-7.
"""

from __future__ import annotations

from lean_yaw_env.kernel.compilation import called
from lean_yaw_env.kernel.elementary import quotient
from lean_yaw_env.kernel.flight import (
    controlled_lengths,
    next_step_length,
    shift_end_of,
    taken,
    trial,
)
from lean_yaw_env.kernel.lanes import replacer
from lean_yaw_env.kernel.records import FLYING, LANDED, LANDING, Flight

LONGEST_STEP = 0.03
# An ankle whose spring or damper moves it 2,000 times faster than it walks gets through the longest step with as many.
MOST_ATTEMPTS = 50_000.0
# Halvings of a step that leave neighbouring numbers
_HALVINGS = 60
_NONE_IN_SIGHT = 1e9

_late = replacer(
    Flight, "time", "pitch", "twist", "pitch_rate", "twist_rate", "damping_loss", "status"
)


@called
def _tried(stance, flight, h):
    return trial(stance, flight, h)


@called
def lowest_point(stance, flight, h):
    """When within a step the gap, which falls at its start and rises at its end, is least."""
    falls, rises = 0.0, h
    for _ in range(_HALVINGS):
        middle = 0.5 * (falls + rises)
        if _tried(stance, flight, middle).gap_rate.real < 0.0:
            falls = middle
        else:
            rises = middle
    return rises


@called
def touch_time(stance, flight, h):
    """When within a step that begins above the floor and ends on or below it the foot touches down."""
    above, below = 0.0, h
    for _ in range(_HALVINGS):
        middle = 0.5 * (above + below)
        if _tried(stance, flight, middle).gap.real > 0.0:
            above = middle
        else:
            below = middle
    return below


@called
def advance_carefully(stance, flight):
    """Try one short integrator step; where the foot touches down within it, go no further."""
    h = min(flight.next_step, LONGEST_STEP)
    tried = _tried(stance, flight, h)
    accurate = tried.error <= 1.0  # a NaN is not
    longer, shorter = controlled_lengths(h, tried.error)
    if not accurate:
        return taken(stance, flight, tried, False, False, shorter, MOST_ATTEMPTS)
    if tried.gap.real > 0.0 and flight.gap_rate.real < 0.0 and tried.gap_rate.real > 0.0:
        h = lowest_point(stance, flight, h)
    if _tried(stance, flight, h).gap.real > 0.0:
        onward = next_step_length(longer, _NONE_IN_SIGHT, tried.time.real, shift_end_of(stance))
        return taken(stance, flight, tried, True, False, onward, MOST_ATTEMPTS)
    tried = _tried(stance, flight, touch_time(stance, flight, h))
    return taken(stance, flight, tried, True, True, 0.0, MOST_ATTEMPTS)


@called
def fly_carefully(stance, flight):
    """Follow a flight to its end; one that lands is on the floor, with nothing left to correct."""
    while flight.status == FLYING:
        flight = advance_carefully(stance, flight)
    # the landing time's derivative, which moves no real part
    rate = flight.gap_rate
    late = quotient(flight.gap.real - flight.gap, rate if rate.real != 0.0 else 1.0 + 0.0 * rate)
    return _late(
        flight,
        flight.time + late,
        flight.pitch + late * flight.pitch_rate,
        flight.twist + late * flight.twist_rate,
        flight.pitch_rate + late * flight.pitch_acceleration,
        flight.twist_rate + late * flight.twist_acceleration,
        flight.damping_loss + late * stance.ankle_damping * flight.twist_rate * flight.twist_rate,
        LANDED if flight.status == LANDING else flight.status,
    )
