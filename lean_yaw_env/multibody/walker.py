"""Steps of the nine-coordinate walker: integrate to heel strike, then the impact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, inf, nan, pi, sin
from typing import Any, Literal

import numpy as np

from lean_yaw_env.multibody.dynamics import (
    Body,
    ContactForces,
    Offset,
    Shift,
    Stance,
    exchange_roles,
)
from lean_yaw_env.multibody.kinematics import (
    CONTACT,
    LEAN,
    N_COORDINATES,
    PITCH,
    STANCE_ANKLE,
    STANCE_LEG,
    SWING_LEG,
    Vector,
)
from lean_yaw_env.multibody.phase import PhaseEnd, integrate
from lean_yaw_env.validation import (
    require_array,
    require_choice,
    require_finite,
    require_flag,
    require_number,
)

SwingMode = Literal["held", "passive"]


@dataclass(frozen=True)
class ForceExtremes:
    """Extremes over a step, on the samples of the integration; units as in ``ContactForces``."""

    least_normal_force: float
    greatest_friction: float
    greatest_yaw_torque: float
    greatest_hip_torque: float


@dataclass(frozen=True)
class Trajectory:
    """A stance phase on the samples of its integration.

    Attributes
    ----------
    time : shape (n,)
        Since the start of the step.
    coordinates : shape (n, 9)
        x_h, y_h, z_h, u1 to u6 in the paper's order: centre of the axle, yaw, lean, right and left leg pitch, right and left ankle. The swing
        ankle is the one that keeps its foot flat; while the swing ankle's axis is vertical that angle is ill-defined.
    rates : shape (n, 8)
        Of all coordinates but the swing ankle, which has no inertia, in the same order.
    forces : tuple of ContactForces
        At each sample.
    energies : shape (n, 2)
        Kinetic and potential.
    """

    time: Vector
    coordinates: Vector
    rates: Vector
    forces: tuple[ContactForces, ...]
    energies: Vector


@dataclass(frozen=True)
class MultibodyStep:
    """One step, from just after a heel strike to just after the next.

    Attributes
    ----------
    state : tuple of 5 or 6 floats
        Section state after the impact (see ``MultibodyWalker.step``); after a fall, the state in which it was noticed.
    stance : "left" or "right"
        The foot that stands now.
    duration : float
        Of the stance phase.
    displacement : tuple of 2 floats
        From the old contact reference point to the new one, x and z; zero after a fall.
    mass_offset : float
        Offset in force at the end of the step; differs from the commanded one if heel strike came in mid-shift.
    inter_leg_angle, inter_leg_rate : float
        Swing minus stance leg pitch just after the impact (the new swing leg is behind) and its rate.
    fall : str or None
        One of ``FALLS``.
    forces : ForceExtremes
        Over the stance phase.
    impulse : ContactForces or None
        Impulses on the new stance foot; None after a fall.
    energies : tuple of 3 floats
        Kinetic plus potential: at the start, at the end before the impact and just after it (nan after a fall).
    constraint_residual : float
        Largest violation of a contact constraint, or of its rate, that has built up by the end of the phase.
    trajectory : Trajectory or None
        On request.
    """

    state: tuple[float, ...]
    stance: str
    duration: float
    displacement: tuple[float, float]
    mass_offset: float
    inter_leg_angle: float
    inter_leg_rate: float
    fall: str | None
    forces: ForceExtremes
    impulse: ContactForces | None
    energies: tuple[float, float, float]
    constraint_residual: float
    trajectory: Trajectory | None = None


@dataclass(frozen=True)
class MultibodyWalker(Body):
    """The paper's walker with feet of finite mass, a second opinion on the massless-foot walker; about 20 ms a step.

    Parameters
    ----------
    hip_width, foot_radius, ankle_tilt, slope : float
        As in the paper's Table 1.
    foot_mass : float
        Of each foot, a point at the leg's end, in units of the two hip masses together.
    shift_time : float
        Time in which the hip masses move to a new offset.
    tolerance : float
        Relative tolerance of the integration; the absolute one is a tenth of it.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    foot_mass: float = 1e-3
    shift_time: float = 0.35
    tolerance: float = 1e-11

    def __post_init__(self) -> None:
        super().__post_init__()
        require_number("shift_time", self.shift_time, 0.0, inf, "()")
        require_number("tolerance", self.tolerance, 1e-13, 1e-3)

    def step(
        self,
        state: Sequence[float] | Vector,
        *,
        stance: str = "left",
        inter_leg_angle: float = 0.3,
        mass_offset: float = 0.0,
        previous_offset: float | None = None,
        swing: SwingMode = "held",
        swing_rate: float | None = None,
        trajectory: bool = False,
    ) -> MultibodyStep:
        """Walk from just after one heel strike to just after the next.

        Parameters
        ----------
        state : 5 or 6 floats
            Heading, stance pitch, ankle angle, stance pitch rate, ankle rate just after heel strike; for a passive swing leg the inter-leg
            rate may follow. The new state has as many entries as the swing mode needs: 5 when held, 6 when passive.
        stance : "left" or "right"
            The foot that stands.
        inter_leg_angle : float
            Held swing leg: the angle at which it is held from the start. Passive: the angle at which it starts, negative as it is behind
            (``MultibodyStep.inter_leg_angle`` of the step before).
        mass_offset : float
            Offset of the hip masses along the axle, positive to the right.
        previous_offset : float, optional
            Offset at the start, if different; the masses then move smoothly in ``shift_time``.
        swing : "held" or "passive"
            Whether a torque at the hip holds the inter-leg angle or none acts.
        swing_rate : float, optional
            Inter-leg rate at the start of a passive step, when ``state`` has five entries.
        trajectory : bool
            Keep the samples of the stance phase.

        Raises
        ------
        ValueError
            If an argument is out of range or missing.
        SolverError
            If the integrator fails.
        """
        require_flag("trajectory", trajectory)
        phase, start = self._start(
            state, stance, inter_leg_angle, mass_offset, previous_offset, swing, swing_rate
        )
        end = integrate(phase, start, self.tolerance)
        return _result(phase, start, end, _trajectory(phase, end) if trajectory else None)

    def stance_accelerations(
        self, state: Sequence[float] | Vector, **options: Any
    ) -> tuple[float, ...]:
        """Second derivatives of stance pitch and ankle, and of the inter-leg angle if passive, at the start of a step. Arguments as for ``step``."""
        phase, y = self._start(state, **options)
        second, _, here = phase.accelerations(0.0, y)
        pitch = float(here.jacobian[PITCH, :N_COORDINATES] @ second + here.bias[PITCH])
        swing = () if phase.is_held else (float(second[SWING_LEG] - second[STANCE_LEG]),)
        return (pitch, float(second[STANCE_ANKLE]), *swing)

    def contact_forces(self, state: Sequence[float] | Vector, **options: Any) -> ContactForces:
        """Contact forces at the start of a step. Arguments as for ``step``."""
        phase, y = self._start(state, **options)
        return phase.forces(0.0, y)

    def _start(
        self,
        state: Sequence[float] | Vector,
        stance: str = "left",
        inter_leg_angle: float = 0.3,
        mass_offset: float = 0.0,
        previous_offset: float | None = None,
        swing: SwingMode = "held",
        swing_rate: float | None = None,
    ) -> tuple[Stance, Vector]:
        require_choice("stance", stance, ("left", "right"))
        is_held = require_choice("swing", swing, ("held", "passive")) == "held"
        numbers = tuple(require_array("state", state, (None,)).tolist())
        inter_leg_rate = _inter_leg_rate(numbers, is_held, swing_rate)
        before = mass_offset if previous_offset is None else previous_offset
        angle = "inter_leg_angle of a held leg" if is_held else "inter_leg_angle"
        limits = (0.0, pi) if is_held else (-inf, inf)
        require_number(angle, inter_leg_angle, *limits, "()")
        require_finite("mass_offset", mass_offset)
        require_finite("previous_offset", before)
        shift = Shift(before, mass_offset, self.shift_time)
        side = 1.0 if stance == "left" else -1.0
        phase = Stance(self, side, numbers[0], shift=shift, is_held=is_held)
        return phase, phase.placed(numbers[1:5], inter_leg_angle, inter_leg_rate)


def _inter_leg_rate(state: tuple[float, ...], is_held: bool, swing_rate: float | None) -> float:
    if is_held:
        if len(state) != 5:
            raise ValueError(f"state of a held step must have 5 entries, got {len(state)}")
        if swing_rate is not None:
            raise ValueError(f"swing_rate is for a passive leg, got {swing_rate!r} for a held one")
        return 0.0
    if len(state) == 6 and swing_rate is None:
        return state[5]
    if len(state) == 5 and swing_rate is not None:
        return require_finite("swing_rate", swing_rate)
    raise ValueError(
        "a passive step needs a state of 6 entries, or 5 entries and swing_rate; "
        f"got {len(state)} entries and swing_rate={swing_rate!r}"
    )


def _result(
    phase: Stance, start: Vector, end: PhaseEnd, trajectory: Trajectory | None
) -> MultibodyStep:
    offset = phase.shift.at(end.time)
    stance, y, impulse, after = phase, end.y, None, nan
    if end.fall is None:
        foot = phase.swing_foot(end.y)
        roll = phase.body.foot_radius * foot.pitch
        x, _, z = foot.centre.tolist()
        contact = (x + roll * cos(foot.heading), z - roll * sin(foot.heading))
        stance = Stance(phase.body, -phase.side, foot.heading, contact)
        y, impulse = stance.impact(exchange_roles(end.y, foot.ankle), offset)
        after = sum(stance.energies(y, Offset(offset.value)))
    pitch, pitch_rate = stance.pitch(y)
    angles, rates = y[:N_COORDINATES], y[N_COORDINATES:]
    inter_leg_rate = float(rates[SWING_LEG] - rates[STANCE_LEG])
    ankle, ankle_rate = float(angles[STANCE_ANKLE]), float(rates[STANCE_ANKLE])
    swing = () if phase.is_held else (inter_leg_rate,)
    here = phase.kinematics(end.y)
    drift = here.jacobian[CONTACT, :N_COORDINATES] @ end.y[N_COORDINATES:]
    return MultibodyStep(
        state=(stance.heading, pitch, ankle, pitch_rate, ankle_rate, *swing),
        stance="left" if stance.side > 0.0 else "right",
        duration=end.time,
        displacement=stance.contact,
        mass_offset=offset.value,
        inter_leg_angle=float(angles[SWING_LEG] - angles[STANCE_LEG]),
        inter_leg_rate=inter_leg_rate,
        fall=end.fall,
        forces=ForceExtremes(
            least_normal_force=min(force.normal for force in end.forces),
            greatest_friction=max(force.friction_demand for force in end.forces),
            greatest_yaw_torque=max(abs(force.yaw_torque) for force in end.forces),
            greatest_hip_torque=max(abs(force.hip_torque) for force in end.forces),
        ),
        impulse=impulse,
        energies=(
            sum(phase.energies(start, phase.shift.at(0.0))),
            sum(phase.energies(end.y, offset)),
            after,
        ),
        constraint_residual=float(np.abs([here.values[CONTACT], drift]).max()),
        trajectory=trajectory,
    )


def _trajectory(phase: Stance, end: PhaseEnd) -> Trajectory:
    coordinates, rates = np.split(np.array(end.samples), 2, axis=1)
    legs = [SWING_LEG, STANCE_LEG]
    ahead = np.sin(coordinates[:, SWING_LEG] + phase.body.ankle_tilt)
    sign = np.copysign(1.0, ahead)
    swing_ankle = np.arctan2(sign * np.tan(coordinates[:, LEAN]), np.abs(ahead))
    ankles = np.column_stack([swing_ankle, coordinates[:, STANCE_ANKLE]])
    if phase.side < 0.0:
        legs, ankles = legs[::-1], ankles[:, ::-1]
    times = zip(end.times, end.samples, strict=True)
    return Trajectory(
        time=np.array(end.times),
        coordinates=np.hstack([coordinates[:, :5], coordinates[:, legs], ankles]),
        rates=rates[:, [*range(5), *legs, STANCE_ANKLE]],
        forces=end.forces,
        energies=np.array([phase.energies(y, phase.shift.at(time)) for time, y in times]),
    )
