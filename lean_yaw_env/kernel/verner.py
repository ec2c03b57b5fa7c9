"""Verner's "efficient" Runge-Kutta pair of order 8(7): its thirteen stages as a table, and the steps that are generated from it.

The coefficients are those of J. H. Verner, "Numerically optimal Runge-Kutta pairs with interpolants", Numerical Algorithms 53 (2010)
383-396, as published on his web site and used by other ODE suites under the name Vern8. Those with short fractions are
written as such, the others are the doubles nearest to their exact fractions. Zero coefficients are left out: the second and third stage
serve only the fourth and fifth.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import reduce
from typing import Any

from lean_yaw_env.kernel.compilation import fused, generated

STAGES = 13

# fmt: off
NODES = {1: 0.0, 2: 1 / 20, 3: 341 / 3200, 4: 1023 / 6400, 5: 39 / 100, 6: 93 / 200,
        7: 31 / 200, 8: 943 / 1000, 9: 7067558016280 / 7837150160667, 10: 909 / 1000,
        11: 47 / 50, 12: 1.0, 13: 1.0}
"""When each stage is taken, as a share of the step."""

COEFFICIENTS = {
    2: {1: 1 / 20},
    3: {1: -7161 / 1024000, 2: 116281 / 1024000},
    4: {1: 1023 / 25600, 3: 3069 / 25600},
    5: {1: 4202367 / 11628100, 3: -3899844 / 2907025, 4: 3982992 / 2907025},
    6: {1: 5611 / 114400, 4: 31744 / 135025, 5: 923521 / 5106400},
    7: {1: 21173 / 343200, 4: 8602624 / 76559175, 5: -26782109 / 689364000, 6: 5611 / 283500},
    8: {1: -1221101821869329 / 690812928000000, 4: -125 / 2,
        5: -1024030607959889 / 168929280000000, 6: 1501408353528689 / 265697280000000,
        7: 6070139212132283 / 92502016000000},
    9: {1: -1.1809450665549708, 4: -41.50473441114321, 5: -4.434438319103725,
        6: 4.260408188586133, 7: 43.75364022446172, 8: 0.00787142548991231},
    10: {1: -1.2814059994414884, 4: -45.047139960139866, 5: -4.731362069449577,
        6: 4.514967016593808, 7: 47.44909557172985, 8: 0.010592282971116612,
        9: -0.0057468422638446166},
    11: {1: -1.7244701342624853, 4: -60.92349008483054, 5: -5.951518376222393,
        6: 5.556523730698456, 7: 63.98301198033305, 8: 0.014642028250414961,
        9: 0.06460408772358203, 10: -0.0793032316900888},
    12: {1: -3.301622667747079, 4: -118.01127235975251, 5: -10.141422388456112,
        6: 9.139311332232058, 7: 123.37594282840426, 8: 4.62324437887458,
        9: -3.3832777380682018, 10: 4.527592100324618, 11: -5.828495485811623},
    13: {1: -3.039515033766309, 4: -109.26086808941763, 5: -9.290642497400293,
        6: 8.43050498176491, 7: 114.20100103783314, 8: -0.9637271342145479,
        9: -5.0348840888021895, 10: 5.958130824002923},
}
"""How much of each earlier stage's derivative a stage is taken with."""

WEIGHTS = {1: 0.04427989419007951, 6: 0.3541049391724449, 7: 0.2479692154956438,
        8: -15.694202038838084, 9: 25.084064965558564, 10: -31.738367786260277,
        11: 22.938283273988784, 12: -0.2361324633071542}
"""Of the eighth-order result."""

ERROR_WEIGHTS = {1: -3.2721039010281375e-05, 6: -0.0005046250618777704,
        7: 0.0001211723589784759, 8: -20.142336771313868, 9: 5.2371785994398286,
        10: -8.156744408794658, 11: 22.938283273988784, 12: -0.2361324633071542,
        13: 0.36016794372897754}
"""The weights of the eighth-order result minus those of the embedded seventh-order one."""
# fmt: on


def _sum(weights: Mapping[int, float], derivative: str) -> str:
    """A weighted sum of a derivative's values at the stages, as source text."""
    return " + ".join(f"{weight!r} * {derivative}_{stage}" for stage, weight in weights.items())


def stepper(
    coordinates: int,
    pose: Callable[..., Any],
    accelerations: Callable[..., Any],
    look: Callable[..., Any] | None = None,
    looks: Collection[int] = (),
) -> Any:
    """A step of the pair for second-order equations of motion, in straight lines that a compiler can vectorise over walkers.

    Parameters
    ----------
    coordinates : int
        Number of coordinates ``x1``, ``x2``, ...; ``v1``, ... are their rates and ``a1``, ... their accelerations.
    pose : formula
        ``pose(c, t, x1, ...)`` holds all that the equations of motion take from time and coordinates; ``c`` is constant in the step.
    accelerations : formula
        ``accelerations(c, pose, v1, ...)`` returns ``a1``, ...
    look : formula
        In place of ``accelerations`` at some stages; it returns what else is wanted there behind them.
    looks : stages at which to look

    Returns
    -------
    formula
        ``step(c, t, x1, ..., v1, ..., a1, ..., h)``, with the accelerations at the start, returns coordinates and rates at the end, the largest
        error estimated of any of them, the last coordinate's rates at the stages that have weights, and what ``look`` returned at ``looks``.
    """

    def each(pattern: str, **names: Any) -> str:
        return ", ".join(pattern.format(i=i, **names) for i in range(1, coordinates + 1))

    def equations_of_motion(stage: int) -> str:
        if stage in looks:
            seen = f"seen_{stage} = look(c, pose_{stage}, {each('v{i}_{s}', s=stage)})"
            taken = (f"a{i}_{stage} = seen_{stage}[{i - 1}]" for i in range(1, coordinates + 1))
            return "; ".join((seen, *taken))
        return f"{each('a{i}_{s}', s=stage)}, = accelerations(c, pose_{stage}, {each('v{i}_{s}', s=stage)})"

    numbers = range(1, coordinates + 1)
    lines = [f"def step(c, t, {each('x{i}')}, {each('v{i}_1')}, {each('a{i}_1')}, h):"]
    for stage, weights in COEFFICIENTS.items():
        # A pose does not depend on the accelerations of the stage before: ahead of them, a processor does both at a time
        places = ", ".join(f"x{i} + h * ({_sum(weights, f'v{i}')})" for i in numbers)
        lines.append(f"pose_{stage} = pose(c, t + {NODES[stage]!r} * h, {places})")
        if stage > 2:
            lines.append(equations_of_motion(stage - 1))
        lines += [f"v{i}_{stage} = v{i}_1 + h * ({_sum(weights, f'a{i}')})" for i in numbers]
    lines.append(equations_of_motion(STAGES))
    errors = [f"abs((h * ({_sum(ERROR_WEIGHTS, f'{k}{i}')})).real)" for k in "va" for i in numbers]
    pairs = [
        f"max({first}, {second})" for first, second in zip(errors[::2], errors[1::2], strict=True)
    ]
    lines.append(f"error = {reduce('max({}, {})'.format, pairs)}")
    ends = [f"x{i} + h * ({_sum(WEIGHTS, f'v{i}')})" for i in numbers]
    ends += [f"v{i}_1 + h * ({_sum(WEIGHTS, f'a{i}')})" for i in numbers]
    rates = ", ".join(f"v{coordinates}_{stage}" for stage in WEIGHTS)
    seen = "".join(f"seen_{stage}, " for stage in looks)
    lines.append(f"return {', '.join(ends)}, error, ({rates}), ({seen})")
    names = {"pose": pose, "accelerations": accelerations, "look": look}
    return fused(generated("\n    ".join(lines), **names))


integral: Any = fused(
    generated(
        f"def integral(h, {', '.join(f'k_{stage}' for stage in WEIGHTS)}):\n"
        f"    return h * ({_sum(WEIGHTS, 'k')})"
    )
)
"""Integral over a step of what is known at the stages that have weights: ``integral(h, k_1, k_6, ...)``."""
