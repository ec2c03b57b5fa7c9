"""What an environment remembers of each walker: records with named fields, one record a walker.

``WALKER`` is the record of every task, ``SETTINGS`` what an environment's options come to. A task declares a record of its own beside them.
Every field takes eight bytes. Compiled formulas read and write fields as attributes, ``walker.heading``; NumPy reads them by name,
``walkers["heading"]``, of shape (n,).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.parameters import PARAMETER_NAMES, STATE_FIELDS, STATE_SIZE, Vector

Records = NDArray[np.void]
"""An array of records, shape (n,)."""
BODY_SIZE = 4
BODY_NAMES = PARAMETER_NAMES[:BODY_SIZE]
"""What a random body draws."""
SLOPE = BODY_NAMES.index("slope")
"""The column of bodies that follows the walker's record from step to step."""


class Field(NamedTuple):
    """One field of a record."""

    name: str
    unit: str
    meaning: str
    kind: Literal["f8", "i8", "u8"] = "f8"
    """ "f8" for a number, "i8" for a count, a code or a flag, "u8" for what random numbers are made of. Derivatives lead through numbers alone."""
    size: int = 1
    """How many numbers it holds: an array if more than one."""
    initial: float = 0.0
    """Its value at the start of an episode."""
    is_odd: bool = False
    """It changes sign in a mirror image of the world."""
    is_followed: bool = False
    """``Task.refresh`` sets it and the next step's reward reads it: derivatives lead through it from step to step."""


_WORK = "weight times leg length"
_ODD_STATE = (True, False, True, False, True)

WALKER_FIELDS = (
    *(
        Field(field.name, field.unit, field.description, is_odd=odd)
        for field, odd in zip(STATE_FIELDS, _ODD_STATE, strict=True)
    ),
    Field("side", "", "+1 while the left foot stands, -1 the right", is_odd=True),
    Field("mass_offset", "leg lengths", "offset in force, positive to the right", is_odd=True),
    Field("previous_heading", "rad", "heading of the footprint before", is_odd=True),
    Field("place_x", "leg lengths", "contact reference point of the stance foot, downhill"),
    Field("place_z", "leg lengths", "the same to the right", is_odd=True),
    Field("time", "time units", "since the start of the episode, to the horizon"),
    Field("steps", "", "since the start of the episode", "i8"),
    Field(
        "distance",
        "leg lengths",
        "sum of the steps' advances along the mean heading of their two footprints, to the horizon",
    ),
    Field("work", _WORK, "sum of the steps' positive work of moving the masses, to the horizon"),
    # --- the last step
    Field("inter_leg_angle", "rad", "commanded in the last step"),
    Field("commanded_offset", "leg lengths", "commanded in the last step", is_odd=True),
    Field("effort", "", "mean square of the last action's two numbers, each within [-1, 1]"),
    Field("fall", "", "how the last step ended, a ``FallCode``; 0 if it was completed", "i8"),
    Field("duration", "time units", "of the last step"),
    Field(
        "share", "", "of the last step's duration, before the horizon: 1 but in the step across it"
    ),
    Field(
        "advance",
        "leg lengths",
        "of the last step, along the mean heading of its two footprints",
    ),
    Field("speed", "", "advance over duration of the last completed step"),
    Field("least_normal_force", "weights", "on the stance foot in the last step"),
    Field("greatest_friction", "", "tangential over normal force in the last step"),
    Field("gravity_work", _WORK, "work of gravity in the last step"),
    Field("shift_work", _WORK, "work of moving the masses in the last step"),
    Field("impact_loss", _WORK, "kinetic energy lost at the last heel strike"),
    Field("ankle_loss", _WORK, "into the ankle's spring and damper in the last step"),
    Field("pitch_push", "rad / time unit", "the last push on the pitch rate"),
    Field("ankle_push", "rad / time unit", "the last push on the ankle rate", is_odd=True),
    # --- what lasts
    *(
        Field(name, unit, "of this walker's body" if name != "slope" else "under this walker")
        for name, unit in zip(BODY_NAMES, ("leg lengths", "leg lengths", "rad", "rad"), strict=True)
    ),
    Field("pending_angle", "rad", "inter-leg angle on its way, where actions are delayed"),
    Field("pending_offset", "leg lengths", "mass offset on its way", is_odd=True),
    Field("key", "", "of the walker's random numbers", "u8"),
    Field("counter", "", "how many of them are drawn", "u8"),
)
"""The record of each walker, whatever its task."""

SETTINGS_FIELDS = (
    Field("inter_leg_angle", "rad", "what an action of 0 commands"),
    Field("inter_leg_angle_range", "rad", "what an action of 1 adds"),
    Field("mass_offset_range", "leg lengths", "what an action of 1 commands"),
    Field("max_offset_change", "leg lengths", "largest change in a step"),
    Field("horizon", "time units", "when an episode is truncated"),
    Field("max_episode_steps", "", "when an episode is truncated", "i8"),
    Field("mirror", "", "whether a right stance is shown as its mirror image", "i8"),
    Field("action_delay", "", "whether an action waits for a step", "i8"),
    Field("sensor_noise", "", "standard deviation, in units of the observation"),
    Field("hidden_rates", "", "whether both rates are shown as zero", "i8"),
    Field("hidden_heading", "", "whether the heading is shown as zero", "i8"),
    Field("pitch_push", "rad / time unit", "standard deviation of pushes on the pitch rate"),
    Field("ankle_push", "rad / time unit", "standard deviation of pushes on the ankle rate"),
    Field("start_disturbance", "", "scale of the start's random deviations"),
    Field("gait", "", "section state that episodes start near, on the left foot", size=STATE_SIZE),
    Field("gait_offset", "leg lengths", "mass offset in force in that state"),
    Field("show_body", "", "whether the body is appended to the observation", "i8"),
    Field("random_body", "", "which bodies are drawn: a ``BodyDraw``", "i8"),
    Field("body_centre", "", "middle of the box of random bodies", size=BODY_SIZE),
    Field("body_reach", "", "half-widths of that box", size=BODY_SIZE),
)
"""What is fixed for an environment: its options, made into numbers."""


def record_type(fields: Sequence[Field], number: Literal["f8", "c16"] = "f8") -> np.dtype[np.void]:
    """The type of a record with these fields; "c16" for complex numbers, whose imaginary parts carry a derivative."""
    kinds = [number if field.kind == "f8" else field.kind for field in fields]
    entries: list[Any] = [
        (field.name, kind) if field.size == 1 else (field.name, kind, (field.size,))
        for field, kind in zip(fields, kinds, strict=True)
    ]
    return np.dtype(entries or [("unused", number)])


WALKER = record_type(WALKER_FIELDS)
SETTINGS = record_type(SETTINGS_FIELDS)


def states_of(walkers: Records) -> Vector:
    """The section states of walkers, a view (n, 5)."""
    return walkers.view(np.float64).reshape(len(walkers), -1)[:, :STATE_SIZE]


def as_records(array: Records) -> Any:
    """The same records for formulas called from Python, which read fields as attributes."""
    return array.view(np.recarray)


def mirror(records: Records, fields: Sequence[Field]) -> None:
    """Turn records into those of the mirror image of the world, in place."""
    for field in fields:
        if field.is_odd:
            records[field.name] *= -1.0
