"""What was tried on the numbers whose difference has no known reason, one section each."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from scipy.optimize import fsolve

from lean_yaw_env.analysis import PassiveMap, continue_gait, find_limit_cycle, find_periodic_gait
from lean_yaw_env.multibody import MultibodyWalker, table3_c_eigenvalues
from lean_yaw_env.paper.numbers import FLAT_TILT, PASSIVE_SLOPE, number, numbers_of
from lean_yaw_env.paper.results import Columns, Section
from lean_yaw_env.paper.slope_limits import doubling_slope, lateral_limit_slope
from lean_yaw_env.paper.walkers import (
    LATERAL,
    FlatGait,
    arc_foot_walker,
    flat_passive_walker,
    passive_gait,
    table_1_gait,
)
from lean_yaw_env.parameters import MIRROR, Vector, WalkerParameters
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.walker import Walker

_LEFT_RESIDUAL = 1.5e-7
"""What a root finder of the time may leave; MATLAB's fsolve stopped at 1e-6 unless told otherwise."""
_FOOT_MASS = 0.001


def _table(headings: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> Columns:
    return dict(zip(headings, zip(*rows, strict=True), strict=True))


def lateral_pair(walker: PassiveWalker) -> np.ndarray:
    """The two greatest lateral multipliers of a flat passive walker's stride, by falling magnitude."""
    matrix = passive_gait(walker).jacobian[np.ix_(LATERAL, LATERAL)]
    return _pair(matrix)


def _pair(matrix: Vector) -> np.ndarray:
    values = np.linalg.eigvals(matrix)
    return values[np.argsort(-np.abs(values))][:2]


def forward_difference_pair(width: float) -> np.ndarray:
    """The pair as the paper found it: one simulation for each deviation of an initial condition."""
    stride, state = PassiveMap(flat_passive_walker(), 2), passive_gait(flat_passive_walker()).state
    columns = [
        (stride.image(state + width * unit) - stride.image(state))[LATERAL] / width
        for unit in np.eye(state.size)[LATERAL]
    ]
    return _pair(np.array(columns).T)


def nearest_pair(points: int = 21) -> tuple[float, np.ndarray]:
    """The pair nearest the paper's over all tilts and slopes that round to its own, and how near."""
    slopes = PASSIVE_SLOPE + np.linspace(-5e-6, 5e-6, 5)
    pairs = []
    for slope in slopes:
        gait = FlatGait.of(flat_passive_walker(slope))
        for tilt in FLAT_TILT + np.linspace(-0.005, 0.005, points * 10):
            matrix = gait.section_map.moved("ankle_tilt", tilt).derivative(gait.cycle.state)[1]
            pairs.append(_pair(matrix[np.ix_(LATERAL, LATERAL)]))
    paper = np.array([printed.value for printed in numbers_of("C: λ")[3:5]])
    apart = np.abs(np.array(pairs) - paper).max(axis=1)
    return float(apart.min()), pairs[int(apart.argmin())]


def lateral_pair_section() -> Section:
    """Table 3, C."""
    paper = np.array([printed.value for printed in numbers_of("C: λ")[3:5]])
    ours = lateral_pair(flat_passive_walker())
    usual = flat_passive_walker().parameters
    tried: list[tuple[str, np.ndarray]] = [("the paper", paper), ("ours", ours)]
    for name, values in (
        ("ankle_tilt", (0.1499, 0.1501)),
        ("slope", (0.000575, 0.000585)),
        ("foot_radius", (0.499, 0.501)),
    ):
        for value in values:
            changed = PassiveWalker(replace(usual, **{name: value}))
            tried.append((f"{name.replace('_', ' ')} {value:g}", lateral_pair(changed)))
    for width in (0.001, 0.002):
        tried.append((f"forward differences of {width:g}", forward_difference_pair(width)))
    for mass in (_FOOT_MASS, 0.0042):
        tried.append((f"foot mass {mass:g} each", table3_c_eigenvalues(mass).lateral[:2]))
    apart, near = nearest_pair()
    tried.append(("nearest, any tilt and slope that round to 0.15 and 0.00058", near))
    total, needed = float(ours.sum().real), float(paper.sum() - ours.sum().real)
    # At a constant product p, a sum s moves λ by λ / (2 λ - s)
    moves = [abs(float((value / (2.0 * value - total)).real)) for value in ours]
    jacobian = passive_gait(flat_passive_walker()).jacobian[np.ix_(LATERAL, LATERAL)]
    greatest, allowed = float(np.abs(jacobian).max()), 0.005 / max(moves)
    return Section(
        "What was tried: the lateral pair of Table 3, C",
        f"The product of the paper's pair is ours to 1 %; the sums differ by {needed:+.3f}. The two values "
        f"lie so close together that a change of the sum moves them by {moves[0]:.1f} and "
        f"{moves[1]:.1f} times as much. To be right to half of the last digit, the paper's Jacobian "
        f"would have to have its trace to {allowed:.3f}, which is {allowed / greatest:.0e} of its greatest "
        f"entry ({greatest:.1f}). The tilt and the slope have so much effect that their printed digits leave "
        "the second value undetermined, but along all of them the first value stays too great: the nearest "
        f"pair misses by {apart:.3f}. Neither the radius, nor a foot mass, nor differences as wide as the "
        "basin allows bring both values together.",
        _table(
            ("tried", "λ4", "λ5", "sum", "product"),
            (
                (name, *(f"{_shown(v)}" for v in (*pair, pair.sum(), pair.prod())))
                for name, pair in tried
            ),
        ),
    )


def _shown(value: complex) -> str:
    return f"{value.real:.3f}" if abs(value.imag) < 1e-9 else f"{value:.3f}"


def maximal_slope_section() -> Section:
    """Section 4.1's 0.046."""
    walker = arc_foot_walker()
    limping = find_periodic_gait(arc_foot_walker(0.048), n_steps=2)
    branch = continue_gait(
        arc_foot_walker(0.048), "slope", (0.048, 0.08), state=limping.state, n_steps=2
    )
    leaving = [event.value for event in branch.events if event.is_leaving]
    wider = replace(walker, parameters=replace(walker.parameters, foot_radius=0.5045))
    rows = (
        ("the paper", number("maximal slope, C").printed),
        (
            "the gait's period doubles, which ends its stability",
            f"{doubling_slope(walker, (0.0003, 0.08)):.4f}",
        ),
        ("the same with foot radius 0.5045", f"{doubling_slope(wider, (0.0003, 0.08)):.4f}"),
        (
            "the limping gait of two steps, born there, doubles in its turn",
            f"{min(leaving):.4f}" if leaving else "not below 0.08",
        ),
        ("no ankle tilt keeps the walker upright sideways beyond", f"{lateral_limit_slope():.4f}"),
    )
    return Section(
        "What was tried: the maximal slope",
        "The paper's limit lies between two of ours: where the symmetric gait stops being stable, and where "
        "the gait that limps, which the paper's map of two steps also takes for a fixed point, does. A foot "
        "radius of 0.5045 would give the paper's number, but its digits say 0.5. Sideways the walker is lost "
        "on a gentler slope than any of these.",
        _table(("what", "slope"), rows),
    )


_ROUNDED = {
    "hip_width": 0.05,
    "foot_radius": 0.05,
    "ankle_tilt": 0.005,
    "slope": 0.005,
}
"""Half of the last digit of each parameter of Table 1."""


def _heading(name: str, value: float) -> float:
    return float(find_limit_cycle(Walker(replace(WalkerParameters(), **{name: value}))).state[0])


def finite_mass_heading(foot_mass: float = _FOOT_MASS) -> float:
    """Heading of Table 1's gait with heavy feet, from the nine-coordinate model."""
    p = WalkerParameters()
    walker = MultibodyWalker(
        p.hip_width, p.foot_radius, p.ankle_tilt, p.slope, foot_mass, tolerance=1e-9
    )
    gait = table_1_gait().state

    def excess(change: Vector) -> Vector:
        return MIRROR * walker.step(gait + change).state[:5] - gait - change

    change = np.asarray(fsolve(excess, np.zeros(5), epsfcn=1e-10))
    return float((gait + change)[0])


def heading_section() -> Section:
    """Table 2's and Figure 14's heading."""
    gait, paper = table_1_gait(), number("footprint angle")
    heading = float(gait.state[0])
    missing = paper.value - heading
    slowest = float(gait.eigenvalues[0].real)
    rows = [
        ("the paper", paper.printed, ""),
        ("ours", f"{heading:.6f}", ""),
        (
            f"a stride that closes to {_LEFT_RESIDUAL:g} only",
            f"up to {heading + _LEFT_RESIDUAL / (1.0 - slowest):.6f}",
            f"the slowest mode has {slowest:.4f} a stride",
        ),
        (f"foot mass {_FOOT_MASS:g} each", f"{finite_mass_heading():.6f}", ""),
    ]
    for name, half in _ROUNDED.items():
        value = getattr(WalkerParameters(), name)
        slope = (_heading(name, value * 1.001) - _heading(name, value * 0.999)) / (0.002 * value)
        needed = value + missing / slope
        rows.append(
            (
                f"{name.replace('_', ' ')} {needed:.4g} instead of {value:g}",
                f"{_heading(name, needed):.6f}",
                f"its printed digits leave ± {half:g}",
            )
        )
    return Section(
        "What was tried: the heading of Table 2 and Figure 14",
        f"Ours is {-missing / paper.value:.1%} from Figure 14's 0.00155; the table's 0.0016 is that "
        "rounded once more. Heavy feet move it the other way. Two things would give it: any parameter "
        "changed within what its printed digits hide, or a fixed point left at a residual of 1.5e-7, since "
        "the slowest mode is the heading's own and multiplies what is left by 70. Which of them it was "
        "cannot be told from the paper.",
        _table(("tried", "φ", "note"), rows),
    )
