"""The paper's numbers and statements, each once, with the place where it stands.

M. Wisse and A. L. Schwab, "Skateboards, Bicycles, and Three-dimensional Biped Walking Machines:
Velocity-dependent Stability by Means of Lean-to-yaw Coupling", Int. J. Robotics Research 24 (2005)
417-429. Dimensionless but for the bicycle, which is in SI units.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class PaperNumber:
    """A number as printed.

    Attributes
    ----------
    name : str
    printed : str
        The digits; their last place says how far it was rounded.
    where : str
    meaning : str
    about : float
        Relative room where the paper says "about", "almost" or reads a sketch; 0 where it does not.
    is_rounded : bool
        Whether the printed digits are a rounded result, which ours must round to.
    """

    name: str
    printed: str
    where: str
    meaning: str
    about: float = 0.0
    is_rounded: bool = True

    @property
    def value(self) -> float:
        return float(self.printed)

    @property
    def decimals(self) -> int:
        """Digits behind the point."""
        return len(self.printed.partition(".")[2])

    @property
    def half_digit(self) -> float:
        """Half a unit of the last printed place: what rounding may hide; 0 if nothing was rounded."""
        return 0.0 if not self.is_rounded else 0.5 * 10.0**-self.decimals


@dataclass(frozen=True)
class Statement:
    """What the paper says without one number.

    Attributes
    ----------
    name : str
    printed : str
        The paper's words, shortened.
    where : str
    meaning : str
    """

    name: str
    printed: str
    where: str
    meaning: str


_TABLE_2 = "Table 2"
_TABLE_3 = "Table 3"

TABLE_1 = {
    "hip_width": PaperNumber("hip width", "0.3", "Table 1", "default hip width d"),
    "foot_radius": PaperNumber("foot radius", "0.5", "Table 1", "default foot radius r"),
    "ankle_tilt": PaperNumber("ankle tilt", "0.55", "Table 1", "default ankle mounting angle α"),
    "slope": PaperNumber("slope", "0.01", "Table 1", "default slope angle γ"),
}

TABLE_2 = {
    "heading": PaperNumber("heading", "0.0016", _TABLE_2, "foot heading φ of the gait"),
    "leg_pitch": PaperNumber("leg pitch", "0.155", _TABLE_2, "stance leg angle u4"),
    "ankle_angle": PaperNumber("ankle angle", "-0.0041", _TABLE_2, "stance ankle angle u6"),
    "leg_pitch_rate": PaperNumber("leg pitch rate", "-0.42", _TABLE_2, "stance leg's rate u4'"),
    "ankle_rate": PaperNumber("ankle rate", "-0.070", _TABLE_2, "stance ankle's rate u6'"),
    "swing_rate": PaperNumber("swing leg rate", "-0.42", _TABLE_2, "swing leg's rate u3'"),
}

TABLE_3_A = {
    "real": PaperNumber("A: λ1, λ2, real part", "-0.3", _TABLE_3, "point feet, γ = 0.004"),
    "imaginary": PaperNumber("A: λ1, imaginary part", "0.27", _TABLE_3, "point feet, γ = 0.004"),
    "third": PaperNumber("A: λ3", "0", _TABLE_3, "point feet, γ = 0.004"),
}
TABLE_3_B = tuple(
    PaperNumber(f"B: λ{i}", printed, _TABLE_3, "arc feet in the plane, γ = 0.00058")
    for i, printed in enumerate(("0.69", "0.12", "0"), 1)
)
TABLE_3_C = tuple(
    PaperNumber(f"C: λ{i}", printed, _TABLE_3, "arc feet in space, d = 0, α = 0.15, γ = 0.00058")
    for i, printed in enumerate(("0.69", "0.12", "0", "0.72", "0.51", "0"), 1)
)

BICYCLE_DOUBLE_ROOT = PaperNumber(
    "double root", "0.7", "section 2.2, Figure 4", "two real eigenvalues meet, weave emerges, m/s"
)
BICYCLE_WEAVE = PaperNumber("weave speed", "4.3", "Figure 4", "weave becomes stable, m/s")
BICYCLE_CAPSIZE = PaperNumber("capsize speed", "6.1", "Figure 4", "capsize becomes unstable, m/s")
BICYCLE_LOW_SPEED = Statement(
    "low speed",
    "two positive and two negative eigenvalues",
    "section 2.2",
    "eigenvalues for 0 < v < 0.7 m/s",
)
BICYCLE_FREQUENCY = Statement(
    "weave frequency",
    "almost proportional to the forward speed",
    "section 2.2",
    "frequency of the stable weave",
)
BICYCLE_HIGH_SPEED = Statement(
    "high speed", "approaches zero", "section 2.2", "capsize eigenvalue with further speed"
)

SKATEBOARD_SPEED = Statement(
    "eq. (3)",
    "v_min = sqrt((m g h - 2 k) w tan α / (2 m h))",
    "section 2.1",
    "speed at which the skateboard's eigenvalue passes zero",
)
SKATEBOARD_STIFF = Statement(
    "stiff springs", "never unstable", "section 2.1", "skateboard with 2 k > m g h"
)
SKATEBOARD_TILT = Statement(
    "tilt", "the larger α, the higher the required velocity", "section 2.1", "critical velocity"
)
SKATEBOARD_MARGINAL = Statement(
    "undamped", "at best only marginally stable", "section 2.1", "eigenvalues above v_min"
)
SKATEBOARD_DAMPED = Statement(
    "damping", "could make it asymptotically stable", "section 2.1", "damping in the steering axis"
)

POINT_FOOT_PITCH = PaperNumber(
    "stance leg angle, A", "0.15", "section 4.1", "initial stance leg angle, point feet, γ = 0.004"
)
ARC_FOOT_PITCH = PaperNumber(
    "stance leg angle, B", "0.15", "section 4.1", "initial stance leg angle, arc feet, γ = 0.00058"
)
EFFICIENCY = PaperNumber(
    "efficiency", "7", "section 4.1", "slope of A over slope of B at the same step length"
)
SAME_VELOCITY = Statement(
    "velocity of A and B", "approximately the same", "section 4.1, Figure 7", "speed of both gaits"
)
SLOPE_LIMIT_A = PaperNumber(
    "slope limit, A", "0.015", "section 4.1", "slope up to which the point-foot walker is stable"
)
BASIN_A = PaperNumber(
    "basin, A", "2", "section 4.1", "deviation from the initial conditions survived, %"
)
BASIN_B = PaperNumber(
    "basin, B", "8", "section 4.1", "deviation from the initial conditions survived, %", about=0.15
)
MODES_C = Statement(
    "modes, C",
    "three fore-aft only, three three-dimensional",
    "section 4.1",
    "kinds of the six modes of the flat walker",
)
STABLE_TILT_PASSIVE = PaperNumber(
    "stable tilt, passive", "0.15", "section 4.1, Figure 8", "ankle tilt inside the stable region"
)
WIDEST_STABLE_HIP = PaperNumber(
    "hip width limit, D", "0.05", "section 4.1, Figure 9", "widest hip with a stable passive gait"
)
NO_STABLE_HIP = Statement(
    "no stable gait, D",
    "ever increasing eigenvalues in a search up to d = 0.2",
    "section 4.1, Figure 9",
    "passive gaits with wider hips",
)
MAXIMAL_SLOPE = PaperNumber(
    "maximal slope, C", "0.046", "section 4.1", "slope beyond which no stable passive gait exists"
)
PITCH_AT_0004 = PaperNumber(
    "stance leg angle at γ = 0.004", "0.29", "section 4.1", "initial stance leg angle, C, γ = 0.004"
)
TILT_AT_0004 = PaperNumber(
    "stable tilt at γ = 0.004", "0.29", "section 4.1", "stable ankle tilt, C, γ = 0.004"
)

STABLE_TILT_LOW = PaperNumber(
    "least stable tilt", "0.15", "section 4.2, Figure 10", "active C at γ = 0.01"
)
STABLE_TILT_HIGH = PaperNumber(
    "greatest stable tilt", "0.55", "section 4.2, Figure 10", "active C at γ = 0.01"
)
STABLE_SLOPE = PaperNumber(
    "least stable slope", "0.01", "section 4.2, Figure 11", "active C at α = 0.55"
)
SAME_AS_PASSIVE = Statement(
    "active beside passive",
    "little difference at γ = 0.00058",
    "section 4.2, Figure 10 (left)",
    "stable region of α",
)
SWING_ZERO = Statement(
    "held swing leg",
    "one of the eigenvalues becomes zero",
    "section 4.2",
    "what the swing leg controller does to the multipliers",
)
TABLE_1_STABLE = Statement(
    "asterisk", "stable", "Figure 12, Table 1", "the gait at Table 1's parameters"
)
WIDER_HELPS = Statement(
    "wider hips", "beneficial to the stability", "section 4.2, Figure 12", "hip width, active"
)

CRITICAL_SPEED_PI_8 = PaperNumber(
    "critical speed, π/8",
    "0.36",
    "section 4.3, Figure 13",
    "speed on the boundary for α = π/8",
    0.03,
)
CRITICAL_SPEED_PI_4 = PaperNumber(
    "critical speed, π/4",
    "0.72",
    "section 4.3, Figure 13",
    "speed on the boundary for α = π/4",
    0.03,
)
ONE_SPEED = Statement(
    "boundary is a velocity contour",
    "almost exactly",
    "section 4.3, Figure 13",
    "spread of the speed along the stability boundary, r from 0 to 0.8",
)
EQUATION_8 = Statement(
    "eq. (8)",
    "slightly overestimates the velocity",
    "section 4.3",
    "v ≈ sqrt(γ / θ) / (1 - r) against the gait's speed, r from 0 to 0.7",
)
SPEED_IS_TILT = tuple(
    PaperNumber(
        f"v_min over α, {name}",
        "1",
        "section 4.3",
        "critical speed over ankle tilt, one of four data points",
        # Twice what the paper's own pairs (0.36, pi/8) and (0.72, pi/4) are away from one
        about=0.16,
        is_rounded=False,
    )
    for name in ("Figure 10 left", "Figure 10 right", "Figure 13, π/8", "Figure 13, π/4")
)
TILT_INDEPENDENT = Statement(
    "velocity and tilt", "independent of α", "Figure 13", "speed of the flat active walker"
)

STEP_LENGTH = PaperNumber("step length", "0.3", "section 4.4, Figure 14", "Table 1's gait")
EXCURSION = PaperNumber(
    "excursion", "0.008", "section 4.4, Figure 14", "centre of mass to either side, leg lengths"
)
FOOTPRINT_ANGLE = PaperNumber(
    "footprint angle", "0.00155", "Figure 14", "footprint direction φ, rad"
)
OFFSET_HEADING = PaperNumber(
    "heading under an offset",
    "0.64",
    "section 4.4, Figure 15",
    "heading to the right for μ = 0.006",
)
TURNING_RADIUS = PaperNumber(
    "turning radius", "8", "section 4.4, Figure 15", "radius for μ = 0.05, leg lengths"
)
FALLS_PAST_90 = Statement(
    "tight turn's end",
    "stops and falls after more than 90°",
    "section 4.4, Figure 15",
    "walk with μ = 0.05",
)
CIRCLES = Statement(
    "slope that turns",
    "would walk indefinitely in circles",
    "section 4.4",
    "walk with μ = 0.05 on a slope that turns with the walker",
)
DISTURBANCE_UP = Statement(
    "disturbance +200 %", "recovers", "section 4.4", "each initial condition raised by 200 %"
)
DISTURBANCE_DOWN = Statement(
    "disturbance -100 %",
    "recovers, but for the stance leg's rate",
    "section 4.4",
    "each initial condition, but the stance leg's rate, lowered by 100 %",
)
DISTURBANCE_RATE = PaperNumber(
    "stance leg's rate",
    "-50",
    "section 4.4",
    "lowest change of the stance leg's rate that it recovers from, %",
    about=0.1,
    is_rounded=False,
)
FALLS_BACKWARD = Statement(
    "beyond -50 %", "falls backward", "section 4.4", "stance leg's rate lowered further"
)

PASSIVE_SLOPE = 0.00058
"""Slope of the arc-foot walkers, section 4.1."""
POINT_FOOT_SLOPE = 0.004
"""Slope of the point-foot walker, section 4.1."""
FLAT_TILT = 0.15
"""Ankle tilt of Table 3, column C."""
SMALL_OFFSET, LARGE_OFFSET = 0.006, 0.05
"""Mass offsets of Figure 15, to the right."""
CRITICAL_TILTS = (math.pi / 8.0, math.pi / 4.0)
"""Ankle tilts of Figure 13."""
