"""Numbers and statements of other publications, each with its source.

“secondary” marks a number that was read elsewhere than in the publication itself: in a program of its author, or in
somebody's transcription.
"""

from __future__ import annotations

from lean_yaw_env.paper.printed import PaperNumber, Statement

_GARCIA = "Garcia, Chatterjee, Ruina and Coleman 1998"
_ABSTRACT = f"{_GARCIA}, abstract"
_TEXT = f"{_GARCIA}, section 5 (secondary: a transcription)"
_PROGRAM = f"{_GARCIA} (secondary: M. Garcia's program of 1998 for that paper)"
_APPENDIX = f"{_GARCIA}, appendix A.2 (secondary: A. D. Horchler's simpwm.m, and a transcription)"
_BHOUNSULE = "Bhounsule 2014 (secondary: P. A. Bhounsule's program of 2013 for that paper)"
_MEIJAARD = "Meijaard, Papadopoulos, Ruina and Schwab 2007"

SLOPE = 0.009
"""Slope of the published gaits of the simplest walker."""
_STEP_ERROR = (4e-10, "his integrator's tolerance is 1e-10, and a step takes four units of time")
_LOCATED = (1e-10, "fifteen digits are printed of a root whose heel strike is interpolated")

GARCIA_GAITS = tuple(
    PaperNumber(f"{gait} gait, {name}", printed, _PROGRAM, f"γ = {SLOPE}, {meaning}", *_STEP_ERROR)
    for gait, values in (
        ("long", ("0.20031090049483", "-0.19983247291764")),
        ("short", ("0.19393736960624", "-0.20386692731962")),
    )
    for name, meaning, printed in zip(
        ("θ", "θ'"), ("stance angle after the strike", "its rate"), values, strict=True
    )
)
GARCIA_MULTIPLIERS = tuple(
    PaperNumber(name, printed, _PROGRAM, f"γ = {SLOPE}, multipliers of a step")
    for name, printed in (
        ("long gait, Re λ", "-0.19120868949940"),
        ("long gait, Im λ", "0.55633363687106"),
        ("short gait, λ1", "4.000"),
        ("short gait, λ2", "0.459"),
    )
)
BHOUNSULE_GAITS = tuple(
    PaperNumber(f"{gait} gait again, {name}", printed, _BHOUNSULE, f"γ = {SLOPE}", *_LOCATED)
    for gait, values in (
        ("long", ("0.200310900563820", "-0.199832473025474", "-0.015822999949030")),
        ("short", ("0.193937369810188", "-0.203866927442012", "-0.015144260853193")),
    )
    for name, printed in zip(("θ", "θ'", "φ'"), values, strict=True)
)
BHOUNSULE_TIMES = tuple(
    PaperNumber(f"{gait} gait, step time", printed, _BHOUNSULE, f"γ = {SLOPE}")
    for gait, printed in (("long", "3.882"), ("short", "3.096"))
)
GARCIA_SERIES = tuple(
    PaperNumber(f"{gait} gait, {name}", printed, _APPENDIX, meaning)
    for gait, values in (
        ("long", ("3.812092", "0.970956", "-0.270837", "-1.045203", "1.062895")),
        ("short", ("3.141593", "0.943976", "-0.264561", "-1.090331", "0.866610")),
    )
    for name, meaning, printed in zip(
        ("τ0", "Θ0", "Θ1", "α", "c1"),
        (
            "step time as γ vanishes",
            "θ = Θ0 γ^(1/3) + Θ1 γ + ...",
            "θ = Θ0 γ^(1/3) + Θ1 γ + ...",
            "θ' = α θ + c1 γ + ...",
            "θ' = α θ + c1 γ + ...",
        ),
        values,
        strict=True,
    )
)
STABLE_BELOW = PaperNumber(
    "stable below", "0.0151", _TEXT, "slope at which the long gait stops being stable"
)
ONE_STABLE = Statement(
    "two gaits",
    "two period-one gaits, one stable for 0 < γ < 0.015",
    _ABSTRACT,
    "gaits of one step",
    "two at γ = 0.001, 0.005, 0.01 and 0.0149, the longer one stable, the other one not",
)
CUBE_ROOT = Statement(
    "scaling",
    "stance angle proportional to γ^(1/3), power to v^4",
    _ABSTRACT,
    "exponents between γ = 1e-5 and 2e-5",
    "1/3 and 4 to 0.01",
)
TO_CHAOS = Statement(
    "to chaos",
    "apparently chaotic through a sequence of period doublings",
    _ABSTRACT,
    "slopes at which a stable gait of 1, 2, 4, 8 steps doubles",
    "the last ratio of distances is Feigenbaum's 4.669 to 1 %",
)
WALKING_ENDS = PaperNumber(
    "end of walking", "0.019", _TEXT, "slope beyond which no walk of 1000 steps is found"
)

RIMLESS_RATE = Statement(
    "rimless wheel, rate",
    "ω² = 4 sin(α) sin(γ) cos²(2α) / (1 - cos²(2α))",
    "McGeer 1990; Coleman, Chatterjee and Ruina 1997 (closed form, derived here)",
    "rate after an impact of a wheel whose spokes are 2α apart, on the slope γ",
    "relative 1e-10, to which steps are integrated",
)
RIMLESS_MULTIPLIER = Statement(
    "rimless wheel, multiplier",
    "cos⁴(2α) for two impacts",
    "McGeer 1990; Coleman, Chatterjee and Ruina 1997 (closed form, derived here)",
    "multiplier of the rate over two steps",
    "1e-10",
)
RIMLESS_SLOPE = Statement(
    "rimless wheel, least slope",
    "where ω² = 2 - 2 cos(γ - α)",
    "Coleman, Chatterjee and Ruina 1997 (closed form, derived here)",
    "slope below which the wheel does not get over the top of a spoke",
    "a gait 0.1 % above it, none 0.1 % below",
)
ROLLING_RATE = Statement(
    "wheel with round feet",
    "one impact multiplies ω by (a² - b²) / (a² + b²), a = r + (1 - r) cos α, b = (1 - r) sin α",
    "McGeer 1990 (closed form, derived here)",
    "rate after an impact with feet of radius r = 0.2, 0.5, 0.8",
    "relative 1e-10, to which steps are integrated",
)
SYNTHETIC_WHEEL = Statement(
    "synthetic wheel",
    "1 + cos τ + 2 sin(τ) / τ = 0",
    "McGeer 1990 (equation derived here; his text could not be read)",
    "step time on the level as the foot radius goes to the leg's length, small steps",
    "relative 1e-4 at a radius of 0.9999, step angle 0.01",
)
LATERAL_MODE = Statement(
    "rocking sideways",
    "planar stability is kept; one unstable mode, as of an inverted pendulum, negative",
    "Kuo 1999 (secondary: the author's web page)",
    "mirrored step of a passive walker with a fore-aft ankle axis, which lean does not steer",
    "one multiplier beyond -1.01, the fore-aft ones as in the plane",
)

_ENTRIES = {
    "M": ("80.81722", "2.31941332208709", "2.31941332208709", "0.29784188199686"),
    "C1": ("0", "33.86641391492494", "-0.85035641456978", "1.68540397397560"),
    "K0": ("-80.95", "-2.59951685249872", "-2.59951685249872", "-0.80329488458618"),
    "K2": ("0", "76.59734589573222", "0", "2.65431523794604"),
}
_DIGITS = (6e-14, "half of the fourteenth decimal, and round-off")
BICYCLE_EIGENVALUES = tuple(
    PaperNumber(name, printed, _MEIJAARD, "eigenvalue at 5 m/s, 1/s", *_DIGITS)
    for name, printed in (
        ("caster", "-14.07838969279822"),
        ("capsize", "-0.32286642900409"),
        ("weave, real part", "-0.77534188219585"),
        ("weave, imaginary part", "4.46486771378823"),
    )
)
BICYCLE_MATRICES = tuple(
    PaperNumber(
        f"{name}, {place}", printed, _MEIJAARD, "benchmark bicycle", *_DIGITS
    )
    for name, entries in _ENTRIES.items()
    for place, printed in zip(("1 1", "1 2", "2 1", "2 2"), entries, strict=True)
)
CARVALLO_WHIPPLE = Statement(
    "Carvallo-Whipple, BicycleParameters",
    "eigenvalues of its Meijaard2007Model",
    "the package BicycleParameters, run as a program",
    "benchmark bicycle, 0 to 10 m/s",
    "all within 1e-9 1/s",
)
