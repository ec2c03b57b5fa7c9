"""The walker that a command's options describe."""

from __future__ import annotations

from typing import Annotated

import typer

from lean_yaw_env.parameters import WalkerParameters
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.walker import Walker


def walker_of(
    hip_width: Annotated[float, typer.Option(help="Distance between the hips, [0, 2].")] = 0.3,
    foot_radius: Annotated[float, typer.Option(help="Of the cylinder feet, [0, 1).")] = 0.5,
    ankle_tilt: Annotated[
        float, typer.Option(help="Angle of the ankle axis from the leg, (0, pi/2].")
    ] = 0.55,
    slope: Annotated[float, typer.Option(help="Slope angle, [-0.5, 0.5].")] = 0.01,
    passive: Annotated[
        bool, typer.Option("--passive", help="Let the swing leg swing freely.")
    ] = False,
    planar: Annotated[
        bool, typer.Option("--planar", help="Passive walker in the plane: no heading, no ankle.")
    ] = False,
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
