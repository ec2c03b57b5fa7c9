"""Section 2.1: eqs. (1) to (3) and what the paper says of the skateboard, on a board of our own numbers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from lean_yaw_env.paper.checks import Check, judge
from lean_yaw_env.paper.numbers import statement
from lean_yaw_env.vehicles import Skateboard

_TILTS = (0.3, 0.6, 0.9, 1.2)
_SMALL_LEAN = 1e-3
_FAST = np.linspace(0.0, 10.0, 20)
"""m/s."""


def truck_turn(lean: float, steering_tilt: float) -> float:
    """Angle by which an axle turns about its steering axis to stay level under a leaning board, rad.

    The axle (0, 1, 0), turned by b about the axis (-sin α, 0, -cos α) of the board and leant by θ about the x-axis, has the height
    cos(b) sin(θ) - sin(α) sin(b) cos(θ), which is zero where tan(b) = tan(θ) / sin(α).
    """
    return math.atan(math.tan(lean) / math.sin(steering_tilt))


def turning_circle(board: Skateboard, lean: float) -> float:
    """Radius on which a leaning board runs, m, from where its axles point, front and rear opposite."""
    turn = truck_turn(lean, board.steering_tilt)
    steer = math.atan(math.cos(board.steering_tilt) * math.tan(turn) * math.cos(lean))
    return 0.5 * board.wheelbase / math.tan(steer)


def skateboard_checks() -> tuple[Check, ...]:
    """Eqs. (1) to (3) and the statements."""
    board = Skateboard()
    return (*_equation_checks(board), *_statement_checks(board))


def _equation_checks(board: Skateboard) -> tuple[Check, ...]:
    boards = [replace(board, steering_tilt=tilt) for tilt in _TILTS]
    off = max(
        abs(
            float(each.lateral_acceleration(_SMALL_LEAN, 1.0)) * turning_circle(each, _SMALL_LEAN)
            - 1.0
        )
        for each in boards
    )
    # Newton's law of the lean: gravity, the floor that accelerates sideways, the springs
    fall = board.mass * board.gravity * board.rider_height - 2.0 * board.spring_stiffness
    push = board.mass * board.rider_height * board.lateral_acceleration(1.0, _FAST)
    squared = (fall - push) / (board.mass * board.rider_height**2)
    apart = float(np.abs(board.eigenvalues(_FAST)[:, 0] ** 2 - squared).max())
    speed = board.critical_speed()
    below, above = board.eigenvalues([0.999 * speed, 1.001 * speed])
    turns = bool(below.real.max() > 0.0 and abs(above.real).max() == 0.0)
    stiffness = [2.0 * (truck_turn(_SMALL_LEAN, tilt) / _SMALL_LEAN) ** 2 for tilt in _TILTS]
    return (
        judge(
            statement("eq. (1)"),
            off < 1e-6,
            ours=f"largest relative difference {off:.1e} at α = {', '.join(map(str, _TILTS))}",
            remark="Exactly, the circle's radius is w tan α / (2 sin θ).",
        ),
        judge(
            statement("eq. (2), motion"),
            apart < 1e-12 * float(np.abs(squared).max()),
            ours=f"largest difference {apart:.0e} 1/s²",
            remark="It takes the springs as the paper does; see the next row.",
        ),
        judge(
            statement("eq. (2), springs"),
            max(stiffness) < 2.0 * (1.0 + 1e-6),
            ours=f"at α = {', '.join(map(str, _TILTS))}: "
            + ", ".join(f"{value:.2f} k" for value in stiffness),
            remark="By eq. (1) the axes turn by θ / sin α, so that both springs together store "
            "k θ² / sin²α: a stiffness of 2 k / sin²α. A projection of the springs' torques leaves out "
            "the moments that the bearings of the axes carry. Eqs. (2) and (3) stand where 2 k is read "
            "as the stiffness against lean, as our skateboard does.",
        ),
        judge(
            statement("eq. (3)"),
            turns,
            ours=f"{speed:.4f} m/s for the default board, both ways",
            unless="It does not hold.",
        ),
    )


def _statement_checks(board: Skateboard) -> list[Check]:
    stiff = replace(
        board, spring_stiffness=1.01 * board.mass * board.gravity * board.rider_height / 2.0
    )
    never = bool((stiff.eigenvalues(np.linspace(0.0, 10.0, 50)).real <= 0.0).all())
    speeds = [replace(board, steering_tilt=tilt).critical_speed() for tilt in _TILTS]
    fast = 2.0 * board.critical_speed()
    damped = replace(board, damping=5.0).eigenvalues(fast).real
    marginal = board.eigenvalues(fast).real
    rows = (
        (statement("stiff springs"), never, "no growing eigenvalue from 0 to 10 m/s"),
        (
            statement("tilt"),
            bool(np.all(np.diff(speeds) > 0.0)),
            f"α = {', '.join(map(str, _TILTS))}: " + ", ".join(f"{v:.2f}" for v in speeds) + " m/s",
        ),
        (statement("undamped"), bool((marginal == 0.0).all()), "an imaginary pair"),
        (
            statement("damping"),
            bool((damped < 0.0).all()),
            f"real parts {damped.max():.3f} 1/s",
        ),
    )
    return [
        judge(statement, holds, ours=ours, unless="It does not hold.")
        for statement, holds, ours in rows
    ]
