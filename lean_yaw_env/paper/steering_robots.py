"""Single-motor walkers that steer, built since the paper: what is known of them, beside the paper's walker."""

from __future__ import annotations

from lean_yaw_env.paper.results import Result, Section
from lean_yaw_env.paper.steering import circling_gait
from lean_yaw_env.paper.walkers import table_1_gait

_GRAVITY = 9.81
"""m / s^2."""
_ZIPPY_SPEED, _ZIPPY_LEGS = 0.25, 10.0
"""m/s, and leg lengths a second; arXiv 2505.05686, abstract."""


def froude_number(speed: float, leg_length: float, gravity: float = _GRAVITY) -> float:
    """v² / (g l)."""
    return speed**2 / (gravity * leg_length)


def steering_robots() -> Result:
    """Context without verdicts."""
    leg = _ZIPPY_SPEED / _ZIPPY_LEGS
    speed = table_1_gait().speed
    unread = "could not be read"
    rows = (
        (
            "this walker, Table 1 (simulated)",
            f"{speed:.2f} (gl)^(1/2)",
            f"{froude_number(speed, 1.0, 1.0):.2f}",
            f"{circling_gait().turning_radius:.1f} (μ = 0.05)",
        ),
        ("Mugatu (2023, arXiv 2308.08401)", unread, unread, unread),
        (
            f"Zippy (2025, arXiv 2505.05686), leg {100 * leg:.1f} cm",
            f"{_ZIPPY_SPEED} m/s",
            f"{froude_number(_ZIPPY_SPEED, leg):.2f}",
            unread,
        ),
    )
    return Result(
        sections=(
            Section(
                "Steering walkers with a single motor",
                "Mugatu and Zippy each have one motor at the hip and round feet, and steer by a swing of the "
                "legs that is not the same to both sides. Froude number v² / (g l); turning radius in leg "
                "lengths. Only the abstracts could be read: Zippy's gives its speed, from which the leg's length "
                "and the Froude number follow. The full texts, and so the turning radii, could not be read.",
                dict(
                    zip(
                        ("walker", "speed", "Froude number", "turning radius"),
                        zip(*rows, strict=True),
                        strict=True,
                    )
                ),
            ),
        )
    )
