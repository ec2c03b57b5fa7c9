"""The walker that options describe."""

from __future__ import annotations

from lean_yaw_env.parameters import WalkerParameters
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.walker import Walker


def walker_of(
    hip_width: float,
    foot_radius: float,
    ankle_tilt: float,
    slope: float,
    *,
    passive: bool,
    planar: bool,
) -> Walker | PassiveWalker:
    """An active walker, or a passive one in space or in the plane.

    Raises
    ------
    ValueError
        If a parameter is outside its range, or an active walker is to be planar.
    """
    parameters = WalkerParameters(
        hip_width=hip_width, foot_radius=foot_radius, ankle_tilt=ankle_tilt, slope=slope
    )
    if passive:
        return PassiveWalker(parameters, planar=planar)
    if planar:
        raise ValueError("--planar needs --passive: the active walker walks in space")
    return Walker(parameters)
