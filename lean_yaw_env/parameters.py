"""A walker's parameters, its section state and their units: stated here once, used by kernels, environments, plots and documents.

Everything is dimensionless: leg length, gravity and total mass are one, so time is in units of sqrt(leg length / gravity). Angles are in radians.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.kernel.records import Body
from lean_yaw_env.validation import require_choice, require_flag, require_number, require_shape

Foot = Literal["left", "right"]
FEET: tuple[Foot, Foot] = ("left", "right")
EarlyContact = Literal["trip", "strike"]
Vector = NDArray[np.float64]

INTER_LEG_ANGLE = 0.3
"""The paper's inter-leg angle: twice the initial stance leg angle of 0.15 (section 4.2)."""


class StateField(NamedTuple):
    """One coordinate of the section state."""

    name: str
    symbol: str
    unit: str
    description: str


STATE_FIELDS = (
    StateField(
        "heading", "phi", "rad", "direction in which the stance foot rolls; positive turns left"
    ),
    StateField(
        "stance_pitch", "theta", "rad", "pitch of the stance foot, positive ahead of the hip"
    ),
    StateField("ankle_angle", "u6 / u5", "rad", "rotation of the leg against the stance foot"),
    StateField("stance_pitch_rate", "theta'", "rad / time unit", "rate of the stance pitch"),
    StateField("ankle_rate", "u6' / u5'", "rad / time unit", "rate of the ankle angle"),
)
"""The Poincare section's state just after heel strike, in the order used everywhere."""

STATE_SIZE = len(STATE_FIELDS)
MIRROR = np.array([-1.0, 1.0, -1.0, 1.0, -1.0])
"""Signs that turn a section state of one stance foot into its mirror image on the other."""
MIRROR.flags.writeable = False

QUARTER_TURN = 0.5 * math.pi


class Range(NamedTuple):
    """The interval in which a number must be; ``bounds`` are its brackets, "[" and "]" where the end belongs to it."""

    name: str
    low: float
    high: float
    bounds: str = "[]"

    def require(self, value: Any, name: str | None = None) -> float:
        """Return a number of the interval as float, or raise ``ValueError``, which calls it ``name``."""
        return require_number(name or self.name, value, self.low, self.high, self.bounds)


STATE_RANGES = (
    Range("heading", -1e6, 1e6, "()"),
    Range("stance_pitch", -QUARTER_TURN, QUARTER_TURN, "()"),
    Range("ankle_angle", -QUARTER_TURN, QUARTER_TURN, "()"),
    Range("stance_pitch_rate", -1e6, 1e6, "()"),
    Range("ankle_rate", -1e6, 1e6, "()"),
)
"""Of a section state's coordinates, in order. Faster than a million is no walker; the ankle of a leg on the floor stays within a quarter turn."""

COMMAND_RANGES = (
    Range("inter_leg_angle", 0.0, QUARTER_TURN, "()"),
    Range("mass_offset", -1.0, 1.0),
    Range("previous_offset", -1.0, 1.0),
)
"""Of what is commanded for a step, in the order of ``kernel.records.Command``."""

PARAMETER_RANGES = (
    Range("hip_width", 0.0, 2.0),
    Range("foot_radius", 0.0, 1.0, "[)"),
    Range("ankle_tilt", 0.0, QUARTER_TURN, "(]"),
    Range("slope", -0.5, 0.5),
    Range("ankle_stiffness", 0.0, 100.0),
    Range("ankle_damping", 0.0, 100.0),
    Range("shift_time", 0.01, 10.0),
    Range("friction_limit", 0.0, math.inf, "(]"),
    Range("max_step_duration", 0.0, 100.0, "(]"),
)
"""Of a walker's parameters that are numbers, in the order of ``kernel.records.Body``, whose last two fields are 0 or 1."""


@dataclass(frozen=True)
class WalkerParameters:
    """A walker and the slope it walks on; the defaults are Table 1 of the paper.

    Parameters
    ----------
    hip_width : [0, 2]
        Distance d between the two hip masses, in leg lengths.
    foot_radius : [0, 1)
        Radius r of the cylinder feet, in leg lengths.
    ankle_tilt : (0, pi/2]
        Angle alpha of the ankle axis from the leg, forward and down, rad.
    slope : [-0.5, 0.5]
        Slope angle gamma, rad; positive walks downhill at heading zero.
    ankle_stiffness, ankle_damping : [0, 100]
        Torsional spring and damper in the stance ankle, in weight times leg length per rad, and that times the unit of time.
        The paper recommends springs for future research (section 5); it has none.
    slope_turns : bool
        The slope turns with the walker: downhill is always where the stance foot heads (section 4.4, "walk indefinitely in circles").
    early_contact : "trip" or "strike"
        A swing foot that starts the step at or below the floor: a fall named trip, or an immediate heel strike, which is how the paper's
        +200 % disturbance of the stance leg comes out.
    shift_time : [0.01, 10]
        Time in which the masses move to a new offset, from the start of the step.
    friction_limit : (0, inf]
        Coefficient of friction; a step that demands more is a fall named slip. No limit by default.
    max_step_duration : (0, 100]
        A step that takes longer is a fall named no-heel-strike.

    Raises
    ------
    ValueError
        If a value is outside its range; the message names the value and the range.
    """

    hip_width: float = 0.3
    foot_radius: float = 0.5
    ankle_tilt: float = 0.55
    slope: float = 0.01
    ankle_stiffness: float = 0.0
    ankle_damping: float = 0.0
    slope_turns: bool = False
    early_contact: EarlyContact = "trip"
    shift_time: float = 0.35
    friction_limit: float = math.inf
    max_step_duration: float = 10.0

    def __post_init__(self) -> None:
        for limits in PARAMETER_RANGES:
            object.__setattr__(self, limits.name, limits.require(getattr(self, limits.name)))
        require_flag("slope_turns", self.slope_turns)
        require_choice("early_contact", self.early_contact, ("trip", "strike"))

    def body(self) -> Body:
        """The same parameters as the kernels take them."""
        numbers = (getattr(self, limits.name) for limits in PARAMETER_RANGES)
        return Body(
            *numbers,
            slope_turns=1.0 if self.slope_turns else 0.0,
            strike_at_start=1.0 if self.early_contact == "strike" else 0.0,
        )


PARAMETER_NAMES = tuple(field.name for field in fields(WalkerParameters))


def require_state(state: ArrayLike | Sequence[float], name: str = "state") -> Vector:
    """Return a section state as float array of shape (5,), or raise ``ValueError`` naming the coordinate and its range."""
    array = require_shape(name, state, (STATE_SIZE,)).copy()
    for limits, value in zip(STATE_RANGES, array.tolist(), strict=True):
        if not limits.low < value < limits.high:
            limits.require(value, f"{name}: {limits.name}")
    return array


def require_foot(stance: Any) -> Foot:
    """Return "left" or "right", or raise ``ValueError``."""
    return require_choice("stance", stance, FEET)


def require_inter_leg_angle(value: Any) -> float:
    """Return the swing leg's angle in front of the stance leg, (0, pi/2), or raise ``ValueError``."""
    return COMMAND_RANGES[0].require(value)


def require_mass_offset(value: Any, name: str = "mass_offset") -> float:
    """Return the masses' sideways offset along the axle, [-1, 1] leg lengths, or raise ``ValueError``."""
    return COMMAND_RANGES[1].require(value, name)
