"""The paper's numbers and statements, each once, with the place where it stands.

M. Wisse and A. L. Schwab, "Skateboards, Bicycles, and Three-dimensional Biped Walking Machines:
Velocity-dependent Stability by Means of Lean-to-yaw Coupling", Int. J. Robotics Research 24 (2005)
417-429. Dimensionless but for the bicycle, which is in SI units.
"""

from __future__ import annotations

import math

from lean_yaw_env.paper.printed import PaperNumber, Statement

_TABLE_2 = "Table 2"
_TABLE_3 = "Table 3"
_LAMBDAS = tuple(f"λ{i}" for i in range(1, 7))

_EXACT = (0.0, "a parameter, taken as printed")
_TWO_DECIMALS = (0.005, "the other values of the table have two decimals")
_READ_OFF = (0.084, "the paper's own two readings of Figure 13 are 8.3 % off")

TABLE_1 = {
    name: PaperNumber(name.replace("_", " "), printed, "Table 1", f"default {symbol}", *_EXACT)
    for name, printed, symbol in (
        ("hip_width", "0.3", "hip width d"),
        ("foot_radius", "0.5", "foot radius r"),
        ("ankle_tilt", "0.55", "ankle mounting angle α"),
        ("slope", "0.01", "slope angle γ"),
    )
}

TABLE_2 = {
    "heading": PaperNumber("heading", "0.0016", _TABLE_2, "foot heading φ of the gait"),
    "leg_pitch": PaperNumber("leg pitch", "0.155", _TABLE_2, "stance leg angle u4"),
    "ankle_angle": PaperNumber("ankle angle", "-0.0041", _TABLE_2, "stance ankle angle u6"),
    "leg_pitch_rate": PaperNumber("leg pitch rate", "-0.42", _TABLE_2, "stance leg's rate u4'"),
    "ankle_rate": PaperNumber("ankle rate", "-0.070", _TABLE_2, "stance ankle's rate u6'"),
    "swing_rate": PaperNumber("swing leg rate", "-0.42", _TABLE_2, "swing leg's rate u3'"),
}

TABLE_3_A, TABLE_3_B, TABLE_3_C = (
    tuple(
        PaperNumber(f"{model}: {name}", printed, _TABLE_3, meaning, *_TWO_DECIMALS)
        for name, printed in values
    )
    for model, meaning, values in (
        (
            "A",
            "point feet, γ = 0.004",
            (("λ1, λ2, real part", "-0.3"), ("λ1, imaginary part", "0.27"), ("λ3", "0")),
        ),
        (
            "B",
            "arc feet in the plane, γ = 0.00058",
            (("λ1", "0.69"), ("λ2", "0.12"), ("λ3", "0")),
        ),
        (
            "C",
            "arc feet in space, d = 0, α = 0.15, γ = 0.00058",
            tuple(zip(_LAMBDAS, ("0.69", "0.12", "0", "0.72", "0.51", "0"), strict=True)),
        ),
    )
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
    "all real, two of each sign, at 20 speeds below the double root",
)
BICYCLE_FREQUENCY = Statement(
    "weave frequency",
    "almost proportional to the forward speed",
    "section 2.2",
    "frequency of the stable weave",
    "frequency over speed changes by less than a tenth from 5 to 10 m/s",
)
BICYCLE_HIGH_SPEED = Statement(
    "high speed",
    "approaches zero",
    "section 2.2",
    "capsize eigenvalue with further speed",
    "at most a fifth of itself when the speed grows tenfold, from 10 to 1000 m/s",
)
EQUATION_5 = Statement(
    "eq. (5)",
    "M, C1, K0, K2 to five digits",
    "section 2.2",
    "the benchmark's algorithm on the parameters of Schwab, Meijaard and Papadopoulos (2005)",
    "every entry to half of its last printed digit",
)

EQUATION_1 = Statement(
    "eq. (1)",
    "v² / r_c = 2 v² θ / (w tan α)",
    "section 2.1",
    "turning circle of two axles that are turned about tilted axes until their wheels are level",
    "relative difference below 1e-6 at a lean of 0.001",
)
EQUATION_2_SPRINGS = Statement(
    "eq. (2), springs",
    "in their projected torques the tilt cancels: 2 k",
    "section 2.1",
    "stiffness against lean of springs k in two axes tilted by α, by virtual work",
    "2 k at every tilt",
)
EQUATION_2 = Statement(
    "eq. (2), motion",
    "m h² θ'' + (2 k - m g h + 2 m h v² / (w tan α)) θ = 0",
    "section 2.1",
    "lean of a rider on a path that eq. (1) bends, from Newton's law, springs taken as 2 k",
    "the model's eigenvalues squared to 1e-12, at 20 speeds",
)
EQUATION_3 = Statement(
    "eq. (3)",
    "v_min = sqrt((m g h - 2 k) w tan α / (2 m h))",
    "section 2.1",
    "speed at which the skateboard's eigenvalue passes zero",
    "unstable 0.1 % below, not above",
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
    "efficiency",
    "7",
    "section 4.1",
    "slope of A, 0.004, over the slope at which B has the same stance leg angle",
)
SAME_VELOCITY = Statement(
    "velocity of A and B",
    "approximately the same",
    "section 4.1, Figure 7",
    "speed of both gaits",
    "the same to two decimals, which the paper prints of velocities",
)
SLOPE_LIMIT_A = PaperNumber(
    "slope limit, A", "0.015", "section 4.1", "slope up to which the point-foot walker is stable"
)
BASINS = tuple(
    Statement(
        f"basin, {model}",
        f"{percent} %",
        "section 4.1",
        "deviation of one initial condition that the walker can handle",
        f"survives {percent} % of each one, both ways, and not {percent + 1} % of all",
    )
    for model, percent in (("A", 2), ("B", 8))
)
MODES_C = Statement(
    "modes, C",
    "three fore-aft only, three three-dimensional",
    "section 4.1",
    "kinds of the six modes of the flat walker",
)
STABLE_TILT_PASSIVE = Statement(
    "stable tilt, passive",
    "around 0.15",
    "section 4.1, Figure 8",
    "stable ankle tilts of C at γ = 0.00058",
    "0.15 is stable, and no tilt that rounds to another second decimal",
)
WIDEST_STABLE_HIP = PaperNumber(
    "hip width limit, D", "0.05", "section 4.1, Figure 9", "widest hip with a stable passive gait"
)
NARROWS = Statement(
    "stable region, D",
    "narrows with an increasing d up to d ≈ 0.05",
    "section 4.1, Figure 9",
    "width of the stable interval of α",
    "each computed interval up to d = 0.05 is narrower than the one before",
)
NO_STABLE_HIP = Statement(
    "no stable gait, D",
    "ever increasing eigenvalues in a search up to d = 0.2",
    "section 4.1, Figure 9",
    "passive gaits with wider hips",
    "a gait exists up to d = 0.2, and its least greatest |λ| grows with d",
)
MAXIMAL_SLOPE = PaperNumber(
    "maximal slope, C", "0.046", "section 4.1", "slope beyond which no stable passive gait exists"
)
PITCH_AT_0004 = PaperNumber(
    "stance leg angle at γ = 0.004", "0.29", "section 4.1", "initial stance leg angle, C, γ = 0.004"
)
TILT_AT_0004 = Statement(
    "stable tilt at γ = 0.004",
    "around 0.29",
    "section 4.1",
    "stable ankle tilts of C at γ = 0.004",
    "0.29 is stable, and no tilt that rounds to another second decimal",
)

STABLE_TILT_LOW = PaperNumber(
    "least stable tilt", "0.15", "section 4.2, Figure 10", "active C at γ = 0.01"
)
STABLE_TILT_HIGH = PaperNumber(
    "greatest stable tilt", "0.55", "section 4.2, Figure 10", "active C at γ = 0.01"
)
STABLE_SLOPE = PaperNumber(
    "least stable slope",
    "0.01",
    "section 4.2, Figure 11",
    "active C at α = 0.55",
    0.0002,
    "what half of the last digit of α = 0.55 moves it by",
)
SAME_AS_PASSIVE = Statement(
    "active beside passive",
    "little difference at γ = 0.00058",
    "section 4.2, Figure 10 (left)",
    "stable region of α",
    "both ends the same to two decimals, which the paper prints of tilts",
)
SWING_ZERO = Statement(
    "held swing leg",
    "one of the eigenvalues becomes zero",
    "section 4.2",
    "what the swing leg controller does to the multipliers",
    "below 1e-9",
)
ANY_SLOPE = Statement(
    "steep slopes",
    "any arbitrarily steep slope can be used",
    "section 4.2",
    "active C, α = 0.55: slope at which the gait's foot lifts off",
    "no such slope",
)
TABLE_1_STABLE = Statement(
    "asterisk", "stable", "Figure 12, Table 1", "the gait at Table 1's parameters"
)
WIDER_HELPS = Statement(
    "wider hips",
    "beneficial to the stability",
    "section 4.2, Figure 12",
    "hip width, active",
    "each wider hip has a wider stable interval of α, at both ends",
)

CRITICAL_SPEED_PI_8, CRITICAL_SPEED_PI_4 = (
    PaperNumber(
        f"critical speed, {tilt}",
        printed,
        "section 4.3, Figure 13",
        f"speed on the boundary for α = {tilt}, r = 0.5",
    )
    for tilt, printed in (("π/8", "0.36"), ("π/4", "0.72"))
)
ONE_SPEED = tuple(
    Statement(
        f"boundary is a velocity contour, {tilt}",
        "almost exactly",
        "section 4.3, Figure 13",
        "speed along the stability boundary, r from 0.1 to 0.8",
        "within 0.005, half of the printed digit, of its mean",
    )
    for tilt in ("π/8", "π/4")
)
EQUATION_8, EQUATION_8_SLIGHTLY = (
    Statement(
        f"eq. (8), {name}",
        printed,
        "section 4.3",
        "v ≈ sqrt(γ / θ) / (1 - r) against the gait's speed",
        criterion,
    )
    for name, printed, criterion in (
        ("sign", "overestimates the velocity", "at every r from 0 to 0.7, γ = 0.01 and 0.04"),
        (
            "size",
            "slightly overestimates the velocity",
            "by less than 5 % at the paper's slopes, 0.01 and 0.00058, r = 0.5",
        ),
    )
)
SPEED_IS_TILT = tuple(
    PaperNumber(
        f"v_min over α, {name}",
        "1",
        "section 4.3",
        "critical speed over ankle tilt, one of four data points",
        *_READ_OFF,
    )
    for name in ("Figure 10 left", "Figure 10 right", "Figure 13, π/8", "Figure 13, π/4")
)
SPEED_PER_TILT = PaperNumber(
    "one-to-one",
    "1",
    "section 4.3",
    "slope of the straight line through the four data points of v_min over α",
    *_READ_OFF,
)
SPEED_IS_LINEAR = Statement(
    "linear",
    "almost linear",
    "section 4.3",
    "share of the four speeds' variance that a straight line explains",
    "at least 99 %",
)
TILT_INDEPENDENT = Statement(
    "velocity and tilt",
    "independent of α",
    "Figure 13",
    "speed of the flat active walker",
    "the same to 1e-9 at three tilts",
)

STEP_LENGTH = PaperNumber(
    "step length",
    "0.3",
    "section 4.4, Figure 14",
    "Table 1's gait",
    0.005,
    "the paper prints two decimals of quantities of this size (0.15, 0.55)",
)
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
DRAWN_RADIUS = PaperNumber(
    "turning radius, as drawn",
    "8",
    "section 4.4, Figure 15",
    "circle through the dashed line's first 90°, μ = 0.05, leg lengths",
)
TURNING_RADIUS = PaperNumber(
    "turning radius",
    "8",
    "section 4.4",
    "circle of the centre of mass, μ = 0.05, on a slope that turns along",
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
    "its gait is stable, and 20 circles are walked",
)
LIMP = Statement(
    "limp",
    "somewhat limping",
    "section 4.4",
    "steps of the left and the right foot, μ = 0.05, on a slope that turns along",
    "their durations differ by more than 1 %",
)
SELF_STEERING = Statement(
    "self-steering",
    "will automatically steer toward steepest descent",
    "section 4.4",
    "Table 1's gait, started in another direction",
    "from every direction that leads downhill, to 1°",
)
ASYMMETRY = Statement(
    "asymmetry",
    "in any of the parameters results in a curved path",
    "section 6",
    "turn per stride on a slope that turns along, one foot's parameter another than the other's",
    "more than 1e-9 rad",
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
DISTURBANCE_RATE = Statement(
    "stance leg's rate",
    "can only be decreased with 50 %",
    "section 4.4",
    "lowest change of the stance leg's rate that it recovers from",
    "recovers from -50 %, falls at -60 %, the next of a search in tens",
)
FALLS_BACKWARD = Statement(
    "beyond -50 %",
    "otherwise the model falls backward",
    "section 4.4",
    "stance leg's rate lowered further",
    "every fall from a whole percent down to -99 % is backward",
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
