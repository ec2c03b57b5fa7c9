"""Steps of the nine-coordinate walker: integrate to heel strike, then the impact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import copysign, inf, nan, pi, sin, tan
from typing import Any, Literal

import numpy as np

from lean_yaw_env.multibody.dynamics import (
    Body,
    ContactForces,
    Offset,
    Stance,
    energy,
    evaluate,
    exchange_roles,
    forces_from_multipliers,
    impact,
    place,
    rates_from_section,
)
from lean_yaw_env.multibody.kinematics import (
    LEAN,
    N_COORDINATES,
    STANCE_ANKLE,
    STANCE_LEG,
    SWING_LEG,
    Vector,
)
from lean_yaw_env.multibody.phase import Phase, PhaseEnd, integrate
from lean_yaw_env.multibody.results import ForceExtremes, MultibodyStep, Trajectory
from lean_yaw_env.multibody.shift import Shift
from lean_yaw_env.validation import require_array, require_choice, require_finite, require_number

SwingMode = Literal["held", "passive"]


@dataclass(frozen=True)
class MultibodyWalker(Body):
    """The paper's walker with feet of finite mass, a second opinion on the massless-foot walker.

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

    Notes
    -----
    Exact in the model, slow by design: about 20 ms a step.
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
            Heading, stance pitch, ankle angle, stance pitch rate, ankle rate just after heel
            strike; for a passive swing leg the inter-leg rate may follow.
        stance : "left" or "right"
            The foot that stands.
        inter_leg_angle : float
            Held swing leg: the angle at which it is held from the start. Passive: the angle at
            which it starts, negative as it is behind (`MultibodyStep.inter_leg_angle` of the step
            before).
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

        Returns
        -------
        MultibodyStep
            Its state has as many entries as the swing mode needs: 5 when held, 6 when passive.

        Raises
        ------
        ValueError
            If an argument is out of range or missing.
        """
        phase, start = self._start(
            state, stance, inter_leg_angle, mass_offset, previous_offset, swing, swing_rate
        )
        end = integrate(phase, start, self.tolerance)
        kept = _trajectory(phase, end) if trajectory else None
        return _result(phase, start, end, kept)

    def stance_accelerations(
        self, state: Sequence[float] | Vector, **options: Any
    ) -> tuple[float, ...]:
        """Second derivatives of stance pitch and ankle, and of the inter-leg angle if passive.

        Arguments and errors as for `step`; evaluated at the start of the step.
        """
        phase, y = self._start(state, **options)
        second, _, here = phase.accelerations(0.0, y)
        pitch = float(here.pitch_jacobian[:N_COORDINATES] @ second) + here.pitch_bias
        independent = (pitch, float(second[STANCE_ANKLE]))
        if phase.is_held:
            return independent
        return (*independent, float(second[SWING_LEG] - second[STANCE_LEG]))

    def contact_forces(self, state: Sequence[float] | Vector, **options: Any) -> ContactForces:
        """Contact forces at the start of a step. Arguments and errors as for `step`."""
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
    ) -> tuple[Phase, Vector]:
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
        heading, pitch, ankle, pitch_rate, ankle_rate = numbers[:5]
        standing = Stance(1.0 if stance == "left" else -1.0, heading)
        phase = Phase(self, standing, Shift(before, mass_offset, self.shift_time), is_held)
        coordinates = place(self, standing, pitch, ankle, inter_leg_angle)
        rates = rates_from_section(
            self, standing, coordinates, pitch_rate, ankle_rate, inter_leg_rate
        )
        return phase, np.concatenate([coordinates, rates])


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


def _extremes(forces: tuple[ContactForces, ...]) -> ForceExtremes:
    return ForceExtremes(
        least_normal_force=min(force.normal for force in forces),
        greatest_friction=max(force.friction_demand for force in forces),
        greatest_yaw_torque=max(abs(force.yaw_torque) for force in forces),
        greatest_hip_torque=max(abs(force.hip_torque) for force in forces),
    )


def _section(
    body: Body, stance: Stance, y: Vector, *, is_held: bool
) -> tuple[tuple[float, ...], float, float]:
    """Section state, inter-leg angle and its rate at coordinates and rates ``y`` (16,)."""
    coordinates, rates = y[:N_COORDINATES], y[N_COORDINATES:]
    here = evaluate(body, stance, coordinates, rates, Offset())
    inter_leg_rate = float(rates[SWING_LEG] - rates[STANCE_LEG])
    state = (
        stance.heading,
        here.pitch,
        float(coordinates[STANCE_ANKLE]),
        float(here.pitch_jacobian[:N_COORDINATES] @ rates),
        float(rates[STANCE_ANKLE]),
    )
    angle = float(coordinates[SWING_LEG] - coordinates[STANCE_LEG])
    return (state if is_held else (*state, inter_leg_rate)), angle, inter_leg_rate


def _residual(phase: Phase, y: Vector) -> float:
    here = evaluate(phase.body, phase.stance, y[:N_COORDINATES], y[N_COORDINATES:], Offset())
    drift = here.constraint_jacobian[:, :N_COORDINATES] @ y[N_COORDINATES:]
    return float(max(np.abs(here.constraints).max(), np.abs(drift).max()))


def _side(stance: Stance) -> str:
    return "left" if stance.side > 0.0 else "right"


def _result(
    phase: Phase, start: Vector, end: PhaseEnd, trajectory: Trajectory | None
) -> MultibodyStep:
    body, offset = phase.body, phase.shift.at(end.time)
    at_start = sum(phase.energies(0.0, start))
    kinetic, potential = phase.energies(end.time, end.y)
    stance, y, impulse, after = phase.stance, end.y, None, nan
    displacement = (0.0, 0.0)
    if end.fall is None:
        foot = phase.swing_foot(end.y)
        roll = body.foot_radius * foot.pitch
        displacement = (
            float(foot.centre[0] + roll * np.cos(foot.heading)),
            float(foot.centre[2] - roll * np.sin(foot.heading)),
        )
        stance = Stance(-phase.stance.side, foot.heading, displacement)
        coordinates = exchange_roles(end.y[:N_COORDINATES], foot.ankle)
        rates, impulses = impact(
            body, stance, coordinates, exchange_roles(end.y[N_COORDINATES:], 0.0), offset
        )
        y = np.concatenate([coordinates, rates])
        impulse = forces_from_multipliers(body, impulses)
        after = sum(energy(body, stance, coordinates, rates, Offset(offset.value)))
    state, angle, rate = _section(body, stance, y, is_held=phase.is_held)
    return MultibodyStep(
        state=state,
        stance=_side(stance),
        duration=end.time,
        displacement=displacement,
        mass_offset=offset.value,
        inter_leg_angle=angle,
        inter_leg_rate=rate,
        fall=end.fall,
        forces=_extremes(end.forces),
        impulse=impulse,
        energies=(at_start, kinetic + potential, after),
        constraint_residual=_residual(phase, end.y),
        trajectory=trajectory,
    )


def _trajectory(phase: Phase, end: PhaseEnd) -> Trajectory:
    is_left = phase.stance.side > 0.0
    coordinates, rates = [], []
    for y in end.samples:
        role, role_rates = y[:N_COORDINATES], y[N_COORDINATES:]
        ahead = sin(role[SWING_LEG] + phase.body.ankle_tilt)
        swing_ankle = float(np.arctan2(copysign(1.0, ahead) * tan(role[LEAN]), abs(ahead)))
        ankles = (swing_ankle, role[STANCE_ANKLE])
        order = (SWING_LEG, STANCE_LEG) if is_left else (STANCE_LEG, SWING_LEG)
        coordinates.append([*role[:5], *role[list(order)], *(ankles if is_left else ankles[::-1])])
        rates.append([*role_rates[:5], *role_rates[list(order)], role_rates[STANCE_ANKLE]])
    return Trajectory(
        time=np.array(end.times),
        coordinates=np.array(coordinates),
        rates=np.array(rates),
        forces=end.forces,
        energies=np.array(
            [phase.energies(t, y) for t, y in zip(end.times, end.samples, strict=True)]
        ),
    )
