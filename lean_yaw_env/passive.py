"""Passive walkers A to D of the paper (Figure 6), whose swing leg is a pendulum."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from lean_yaw_env.kernel import records
from lean_yaw_env.kernel.passive import PassiveOutcome, passive_batch, passive_trace
from lean_yaw_env.parameters import (
    MIRROR,
    QUARTER_TURN,
    STATE_FIELDS,
    STATE_SIZE,
    Foot,
    StateField,
    Vector,
    WalkerParameters,
    require_foot,
    require_state,
)
from lean_yaw_env.validation import (
    require_count,
    require_flag,
    require_instance,
    require_number,
    require_shape,
)
from lean_yaw_env.walker import (
    FALL_OF_STATUS,
    OTHER_FOOT,
    SIDE,
    BaseWalk,
    EnergyLedger,
    Fall,
    StepResult,
    failure_of,
    walk_arrays,
)

PASSIVE_STATE_FIELDS = (
    *STATE_FIELDS,
    StateField("inter_leg_rate", "Delta'", "rad / time unit", "rate of the inter-leg angle"),
)
"""The passive walker's section state just after heel strike, in the order used everywhere.

The inter-leg angle is not in it: both feet are on the floor, which determines it.
"""

PASSIVE_STATE_SIZE = len(PASSIVE_STATE_FIELDS)
PASSIVE_MIRROR = np.append(MIRROR, 1.0)
"""Signs that turn a passive section state of one stance foot into its mirror image."""
PASSIVE_MIRROR.flags.writeable = False

FORE_AFT = (1, 3, 5)
"""Coordinates of a passive section state that a planar walker moves."""

MOTION_COLUMNS = (
    "time",
    "stance_pitch",
    "ankle_angle",
    "inter_leg_angle",
    "stance_pitch_rate",
    "ankle_rate",
    "inter_leg_rate",
    "swing_foot_height",
)
"""What ``PassiveWalker.motion`` gives; the height is the swing foot's above touching the floor."""


@dataclass(frozen=True)
class PassiveStep(StepResult):
    """One passive step; no mass is moved."""

    inter_leg_angle: float
    """Of ``state``, rad: negative, the new swing leg trails."""
    start_inter_leg_angle: float
    """At the start of the step, rad."""


@dataclass(frozen=True)
class PassiveWalk(BaseWalk):
    """A walk of a passive walker; ``inter_leg_angles`` has shape (n + 1,)."""

    inter_leg_angles: Vector


@dataclass(frozen=True)
class PassiveWalker:
    """A walker whose swing leg swings freely; its foot's mass is in the limit zero.

    Parameters
    ----------
    parameters : WalkerParameters
        Figure 6 A: ``foot_radius=0``, planar. B: a radius, planar. C: ``hip_width=0``. D: a width.
        ``early_contact`` and ``shift_time`` have no meaning here.
    planar : bool
        Heading and ankle locked at zero, as in two dimensions; hip width then plays no part.
        The locked motion is that of the free walker without hip width, started without lean.

    Raises
    ------
    ValueError
        If a planar walker has a spring or a damper in its ankle, which is locked.
    """

    parameters: WalkerParameters
    planar: bool = False

    def __post_init__(self) -> None:
        require_instance("parameters", self.parameters, WalkerParameters)
        if require_flag("planar", self.planar):
            for name in ("ankle_stiffness", "ankle_damping"):
                value = getattr(self.parameters, name)
                if value != 0.0:
                    raise ValueError(
                        f"{name} of a planar walker must be 0, since its ankle is locked, got {value!r}"
                    )

    @property
    def moving_parameters(self) -> WalkerParameters:
        """The parameters that the motion depends on: a planar walker has no hip width."""
        return replace(self.parameters, hip_width=0.0) if self.planar else self.parameters

    def step(
        self, state: ArrayLike, *, stance: Foot = "left", inter_leg_angle: float | None = None
    ) -> PassiveStep:
        """Walk one step. Its energies balance to 1e-9 of weight times leg length.

        Parameters
        ----------
        state : shape (6,)
            Section state just after heel strike, in the order of ``PASSIVE_STATE_FIELDS``.
        stance : "left" or "right"
        inter_leg_angle : (-pi/2, pi/2), optional
            Where the swing leg starts, rad. By default behind, with both feet on the floor.

        Raises
        ------
        ValueError
            If an argument is outside its range, or no trailing foot can be on the floor too.
        SolverError
            If the integrator fails; never for a fall, which is a result.
        """
        start = require_passive_state(state, planar=self.planar)
        foot = require_foot(stance)
        angle = np.nan
        if inter_leg_angle is not None:
            angle = require_number(
                "inter_leg_angle", inter_leg_angle, -QUARTER_TURN, QUARTER_TURN, "()"
            )
        row = step_passive_rows(self, start[None], [SIDE[foot]], [angle])[0]
        outcome = PassiveOutcome(*row.tolist())
        if outcome.status == records.FAILED:
            raise failure_of(self.moving_parameters.body(), (angle,), start, SIDE[foot])
        if outcome.status == records.TRIP:
            raise ValueError(
                f"state {start.tolist()} has no trailing swing foot on the floor: its stance_pitch "
                "must be positive and its lean within what the swing leg reaches"
            )
        fall = fall_of(outcome.status, outcome.stance_pitch)
        return PassiveStep(
            state=np.array(outcome[:PASSIVE_STATE_SIZE]),
            stance=foot if fall else OTHER_FOOT[foot],
            duration=outcome.duration,
            displacement=np.array([outcome.displacement_x, outcome.displacement_z]),
            heading_change=outcome.heading_change,
            mass_offset=0.0,
            fall=fall,
            least_normal_force=outcome.least_normal_force,
            greatest_friction=outcome.greatest_friction,
            energy=EnergyLedger(outcome.gravity_work, 0.0, outcome.impact_loss, outcome.ankle_loss),
            evaluations=int(outcome.evaluations),
            inter_leg_angle=outcome.inter_leg_angle,
            start_inter_leg_angle=outcome.start_inter_leg_angle,
        )

    def walk(self, n_steps: int, *, state: ArrayLike, stance: Foot = "left") -> PassiveWalk:
        """Walk ``n_steps`` steps, or until a fall, from both feet on the floor.

        Raises
        ------
        ValueError, SolverError
            As ``step``.
        """
        n_steps = require_count("n_steps", n_steps)
        start, first = require_passive_state(state, planar=self.planar), require_foot(stance)
        results: list[PassiveStep] = []
        current, foot, angle = start, first, None
        for _ in range(n_steps):
            result = self.step(current, stance=foot, inter_leg_angle=angle)
            results.append(result)
            if result.fall is not None:
                break
            current, foot, angle = result.state, result.stance, result.inter_leg_angle
        angles = [result.start_inter_leg_angle for result in results]
        if results[-1].fall is None:
            angles.append(results[-1].inter_leg_angle)
        return PassiveWalk(**walk_arrays(start, first, results), inter_leg_angles=np.array(angles))

    def motion(
        self,
        state: ArrayLike,
        *,
        duration: float,
        samples: int = 50,
        stance: Foot = "left",
        inter_leg_angle: float | None = None,
    ) -> dict[str, Vector]:
        """The motion within a step at uniform times: both legs and the swing foot's height.

        The stance leg does not feel the swing leg: for the centre of mass and the contact force
        ask ``Walker(parameters).stance_motion`` with the first five coordinates.

        Parameters
        ----------
        state, stance, inter_leg_angle : see ``step``
        duration : (0, 100]
            How far to follow, usually ``PassiveStep.duration``.
        samples : int >= 2

        Returns
        -------
        dict
            One array of shape (samples,) for each of ``MOTION_COLUMNS``.

        Raises
        ------
        ValueError
            If an argument is outside its range.
        """
        duration = require_number("duration", duration, 0.0, 100.0, "(]")
        samples = require_count("samples", samples, 2, 1_000_000)
        start = require_passive_state(state, planar=self.planar)
        first = self.step(start, stance=stance, inter_leg_angle=inter_leg_angle)
        rows = np.zeros((samples, len(MOTION_COLUMNS)))
        passive_trace(
            self.moving_parameters.body(),
            start,
            first.start_inter_leg_angle,
            SIDE[require_foot(stance)],
            duration,
            rows,
        )
        return {name: rows[:, i].copy() for i, name in enumerate(MOTION_COLUMNS)}

    @cached_property
    def _body(self) -> Vector:
        """The parameters that the motion depends on as the kernel's row."""
        return np.array(self.moving_parameters.body())


def require_passive_state(state: ArrayLike, *, planar: bool = False, name: str = "state") -> Vector:
    """Return a passive section state as float array (6,), or raise ``ValueError``."""
    array = require_shape(name, state, (PASSIVE_STATE_SIZE,)).copy()
    require_state(array[:STATE_SIZE], name)
    require_number(f"{name}: inter_leg_rate", float(array[STATE_SIZE]), -1e6, 1e6, "()")
    if planar and np.any(array[[0, 2, 4]] != 0.0):
        raise ValueError(
            f"{name}: a planar walker's heading, ankle_angle and ankle_rate must be 0, "
            f"got {array[[0, 2, 4]].tolist()}"
        )
    return array


def step_passive_rows(
    walker: PassiveWalker, states: Vector, sides: ArrayLike, inter_leg_angles: ArrayLike
) -> Vector:
    """Step many states of one walker, unchecked; rows (n, 19) in the order of ``PassiveOutcome``.

    Parameters
    ----------
    states : shape (n, 6)
    sides : shape (n,)
        +1 on the left foot, -1 on the right.
    inter_leg_angles : shape (n,)
        Where the swing legs start, NaN for both feet on the floor.
    """
    n = len(states)
    results = np.empty((n, len(PassiveOutcome._fields)))
    passive_batch(
        walker._body[None],
        np.ascontiguousarray(states, dtype=float),
        np.asarray(inter_leg_angles, dtype=float),
        np.asarray(sides, dtype=float),
        results,
        0,
        n,
    )
    return results


def fall_of(status: float, stance_pitch: float) -> Fall | None:
    """The way a passive step ended, or None if it was completed."""
    if status == records.LIFT_OFF and stance_pitch < 0.0:
        return Fall.FORWARD
    return None if status == records.TRIP else FALL_OF_STATUS.get(status)
