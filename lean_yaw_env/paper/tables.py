"""Tables 1 to 3."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from lean_yaw_env.analysis import find_limit_cycle, modes
from lean_yaw_env.paper.checks import Check, compare
from lean_yaw_env.paper.numbers import PaperNumber, number, numbers_of
from lean_yaw_env.paper.open_points import heading_section, lateral_pair_section
from lean_yaw_env.paper.results import Columns, Result
from lean_yaw_env.paper.walkers import (
    LATERAL,
    arc_foot_walker,
    flat_passive_walker,
    passive_gait,
    point_foot_walker,
    table_1_gait,
)
from lean_yaw_env.parameters import Vector, WalkerParameters
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.rendering.geometry import Pose, walker_shape

_PARAMETERS = ("hip_width", "foot_radius", "ankle_tilt", "slope")
_PAIR = "The pair is very sensitive there; the section below says what was tried."


def _columns(checks: Sequence[Check]) -> Columns:
    return {
        "quantity": [check.name for check in checks],
        "paper": [check.paper for check in checks],
        "ours": [check.ours for check in checks],
    }


def table_1() -> Result:
    """Table 1: the package's defaults are the paper's."""
    defaults = WalkerParameters()
    checks = tuple(
        compare(number(name.replace("_", " ")), getattr(defaults, name)) for name in _PARAMETERS
    )
    return Result(checks, {"table1": _columns(checks)})


def leg_pitch(state: Vector, parameters: WalkerParameters) -> float:
    """The paper's stance leg angle u4 of a section state on the left foot.

    Its leg frame is turned by yaw, then lean, then u4 about the axle; here that third turn is read
    from the leg's own direction and the axle's.
    """
    leg = walker_shape(parameters, Pose(state, "left", 0.3)).stance_leg
    up = (leg.hip - leg.ankle) / np.linalg.norm(leg.hip - leg.ankle)
    axle = _axle(state, parameters)
    # Yaw and lean bring the vertical to the direction square to the axle that has no forward part
    flat = np.array([0.0, 1.0, 0.0]) - axle[1] * axle
    flat /= np.linalg.norm(flat)
    return float(math.atan2(np.cross(flat, up) @ axle, flat @ up))


def _axle(state: Vector, parameters: WalkerParameters) -> Vector:
    shape = walker_shape(parameters, Pose(state, "left", 0.3))
    along = shape.swing_leg.hip - shape.stance_leg.hip
    return along / np.linalg.norm(along)


def _leg_pitch_rate(state: Vector, parameters: WalkerParameters) -> float:
    """Its rate at the section state's rates: geometry only, so a central difference is exact enough."""
    width = 1e-6
    motion = np.array([0.0, state[3], state[4], 0.0, 0.0])
    ahead, behind = (leg_pitch(state + sign * width * motion, parameters) for sign in (1.0, -1.0))
    return (ahead - behind) / (2.0 * width)


def table_2() -> Result:
    """Table 2: the fixed point of Table 1's walker."""
    state, parameters = table_1_gait().state, WalkerParameters()
    rate = _leg_pitch_rate(state, parameters)
    checks = (
        compare(
            number("heading"),
            float(state[0]),
            unless="Figure 14 has 0.00155, which we miss by 1 %; this table's 0.0016 is that "
            "rounded up. The section below says what was tried.",
            is_open=True,
        ),
        compare(number("leg pitch"), leg_pitch(state, parameters)),
        compare(number("ankle angle"), float(state[2])),
        compare(number("leg pitch rate"), rate),
        compare(number("ankle rate"), float(state[4])),
        compare(
            number("swing leg rate"), rate, remark="The held swing leg turns with the stance leg."
        ),
    )
    return Result(checks, {"table2": _columns(checks)}, sections=(heading_section(),))


def table_3() -> Result:
    """Table 3: multipliers of models A, B and C."""
    first = _fore_aft(point_foot_walker())
    parts = (first[0].real, first[0].imag, abs(first[2]))
    checks = [
        compare(printed, float(ours))
        for printed, ours in zip(numbers_of("A: λ"), parts, strict=True)
    ]
    checks += _compare_all(numbers_of("B: λ"), _fore_aft(arc_foot_walker()))
    gait = passive_gait(flat_passive_walker())
    matrix = gait.jacobian
    fore_aft = [i for i in range(matrix.shape[0]) if i not in LATERAL]
    checks += _compare_all(numbers_of("C: λ")[:3], _eigenvalues(matrix, fore_aft))
    checks += _compare_all(numbers_of("C: λ")[3:], _eigenvalues(matrix, LATERAL), _PAIR)
    return Result(
        tuple(checks),
        {"table3": _columns(checks), "table3_modes": _mode_columns()},
        sections=(lateral_pair_section(),),
    )


def _fore_aft(walker: PassiveWalker) -> np.ndarray:
    values = passive_gait(walker).eigenvalues
    return values[np.lexsort((-values.imag, -np.abs(values)))]


def _eigenvalues(matrix: Vector, index: list[int]) -> np.ndarray:
    values = np.linalg.eigvals(matrix[np.ix_(index, index)])
    return values[np.argsort(-np.abs(values))]


def _compare_all(paper: Sequence[PaperNumber], ours: np.ndarray, unless: str = "") -> list[Check]:
    return [
        compare(printed, float(value.real), unless=unless, is_open=bool(unless))
        for printed, value in zip(paper, ours, strict=True)
    ]


def _mode_columns() -> Columns:
    """Modes of the flat walker by kind, and of Table 1's."""
    rows = [
        (label, mode)
        for label, gait in (
            ("C, passive", find_limit_cycle(flat_passive_walker())),
            ("E, Table 1", table_1_gait()),
        )
        for mode in modes(gait)
    ]
    return {
        "gait": [label for label, _ in rows],
        "multiplier_real": [mode.eigenvalue.real for _, mode in rows],
        "multiplier_imag": [mode.eigenvalue.imag for _, mode in rows],
        "kind": [mode.name for _, mode in rows],
        "lateral_share": [mode.lateral_share for _, mode in rows],
        "why_zero": [mode.explanation for _, mode in rows],
    }
