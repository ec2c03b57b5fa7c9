"""The walker for people: parameters in, walking steps and walks out. The physics is in ``lean_yaw_env.kernel``."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.errors import FellError, SolverError
from lean_yaw_env.files import json_text, require_ending, write_json
from lean_yaw_env.kernel import records
from lean_yaw_env.kernel.records import Body, Command, Outcome
from lean_yaw_env.kernel.step import step as step_kernel
from lean_yaw_env.kernel.trace import COLUMNS, trace
from lean_yaw_env.parameters import (
    INTER_LEG_ANGLE,
    STATE_SIZE,
    Foot,
    Vector,
    WalkerParameters,
    require_foot,
    require_inter_leg_angle,
    require_mass_offset,
    require_state,
)
from lean_yaw_env.validation import (
    require_count,
    require_instance,
    require_number,
    require_one_or_each,
)

if TYPE_CHECKING:
    from lean_yaw_env.viewer import PageDisplay

SIDE: dict[Foot, float] = {"left": 1.0, "right": -1.0}
OTHER_FOOT: dict[Foot, Foot] = {"left": "right", "right": "left"}


class Fall(str, Enum):
    """The ways to fall, each by a physical criterion; members compare equal to their names."""

    BACKWARD = "backward"
    """The stance leg moves backward, faster than 0.1 rad per unit of time (a passive walker's at any rate), and speeds up: it does not
    pass mid-stance."""
    FORWARD = "forward"
    """Of passive walkers: the leg tips over forward, the swing foot not down, until it is level or the floor no longer holds it."""
    SIDEWAYS = "sideways"
    """An ankle, of the stance foot or of the swing foot to be laid flat, would have to turn past a right angle, or the walker
    comes down on its swing foot without moving forward onto it, or (next to no hip width) foot and ankle come to move the masses
    alike, so that nothing holds them up."""
    TRIP = "trip"
    """The swing foot, put in front, is at or below the floor when the step starts."""
    LIFT_OFF = "lift-off"
    """The normal force of the floor on the stance foot vanishes."""
    SLIP = "slip"
    """The step demands more friction than ``friction_limit``."""
    NO_HEEL_STRIKE = "no-heel-strike"
    """The swing foot does not come down within ``max_step_duration``."""


FALL_OF_STATUS: dict[float, Fall] = {
    records.BACKWARD: Fall.BACKWARD,
    records.SIDEWAYS: Fall.SIDEWAYS,
    records.TRIP: Fall.TRIP,
    records.LIFT_OFF: Fall.LIFT_OFF,
    records.SLIP: Fall.SLIP,
    records.NO_STRIKE: Fall.NO_HEEL_STRIKE,
}


class EnergyLedger(NamedTuple):
    """Where a step's energy came from and went, in weight times leg length.

    The kinetic energy just after heel strike changes from step to step by ``gravity_work + shift_work - impact_loss - ankle_loss``.
    """

    gravity_work: float
    """Work of gravity on the way to the heel strike: on a walk down a slope, what the slope gives."""
    shift_work: float
    """Work put in by moving the masses along the axle."""
    impact_loss: float
    """Kinetic energy lost at heel strike."""
    ankle_loss: float
    """Energy that went into the stance ankle's spring and damper."""


@dataclass(frozen=True)
class StepResult:
    """One walking step."""

    state: Vector
    """Section state (5,), or (6,) of a passive walker, just after the heel strike, or where the walker was when it fell."""
    stance: Foot
    """The foot that stands in ``state``."""
    duration: float
    """From heel strike to heel strike, in units of sqrt(leg length / gravity)."""
    displacement: Vector
    """From the old to the new contact reference point (2,): downhill (x) and to the right of someone facing downhill (z)."""
    heading_change: float
    """Of the stance foot's heading, rad, positive to the left."""
    mass_offset: float
    """Offset in force at the end; a heel strike in mid-shift locks the masses where they are."""
    fall: Fall | None
    least_normal_force: float
    """In weights, among the instants at which the integrator looked."""
    greatest_friction: float
    """Greatest ratio of tangential to normal force among the same instants."""
    energy: EnergyLedger
    evaluations: int
    """How often the equations of motion were evaluated."""


@dataclass(frozen=True)
class BaseWalk:
    """A sequence of walking steps; ``n`` of them were completed."""

    states: Vector
    """Section states (n + 1, 5), or (n + 1, 6) of a passive walker, the first being the start."""
    stances: tuple[Foot, ...]
    """n + 1 feet."""
    footprints: Vector
    """Contact reference points on the floor (n + 1, 2): downhill, right, the first at the origin."""
    durations: Vector
    """Of the steps, shape (n,)."""
    fall: Fall | None
    """How the walk ended, if not by its number of steps."""

    @property
    def headings(self) -> Vector:
        """Heading of each footprint, rad; shape (n + 1,)."""
        return self.states[:, 0]

    @property
    def n_steps(self) -> int:
        return len(self.durations)

    @property
    def distance(self) -> float:
        """Straight-line distance between the first and the last footprint, in leg lengths."""
        return float(np.linalg.norm(self.footprints[-1] - self.footprints[0]))


@dataclass(frozen=True)
class Walk(BaseWalk):
    """A walk of the active walker."""

    mass_offsets: Vector
    """Offsets in force at each heel strike, shape (n + 1,)."""
    commands: Vector
    """Inter-leg angle and mass offset commanded for each step begun, shape (m, 2): m is ``n``, or one more after a fall."""
    energies: tuple[EnergyLedger, ...]
    """n ledgers."""
    path: Vector
    """Time, and the centre of mass downhill, up and right, sampled within the steps, shape (k, 4); empty unless asked for."""
    parameters: WalkerParameters
    """Of the walker."""

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the walk to a .json file that the web page opens: ``lean-yaw view --walk FILE``.

        The file holds every step's start and command; the page computes the motion within the steps anew, with the same bits.

        Raises
        ------
        ValueError
            If the path has another ending, or its folder does not exist.
        """
        write_json(require_ending(path, (".json",)), self._saved())

    def show(self, height: int = 620) -> PageDisplay:
        """The walk on the web page, for a notebook, which shows what a cell's last line returns; ``height`` is in pixels."""
        from lean_yaw_env.viewer.notebook import PageDisplay  # few programs need it

        require_count("height", height, 100, 10_000)
        return PageDisplay(json_text(self._saved()), height)

    def _saved(self) -> dict[str, Any]:
        return {
            "format": "lean-yaw-walk",
            "version": 1,
            "parameters": asdict(self.parameters),
            "stances": self.stances,
            "states": self.states.tolist(),
            "inter_leg_angles": self.commands[:, 0].tolist(),
            "commanded_offsets": self.commands[:, 1].tolist(),
            "mass_offsets": self.mass_offsets.tolist(),
        }


@dataclass(frozen=True)
class Walker:
    """The active three-dimensional walker of the paper (Figure 6 C and E): exact steps from heel strike to heel strike."""

    parameters: WalkerParameters = field(default_factory=WalkerParameters)

    def __post_init__(self) -> None:
        require_instance("parameters", self.parameters, WalkerParameters)

    def step(
        self,
        state: ArrayLike,
        *,
        stance: Foot = "left",
        inter_leg_angle: float = INTER_LEG_ANGLE,
        mass_offset: float = 0.0,
        previous_offset: float | None = None,
    ) -> StepResult:
        """Walk one step.

        Parameters
        ----------
        state : shape (5,)
            Section state just after heel strike, in the order and units of ``STATE_FIELDS``.
        stance : "left" or "right"
        inter_leg_angle : (0, pi/2)
            Swing leg's pitch in front of the stance leg's, rad.
        mass_offset : [-1, 1]
            Offset of both hip masses along the axle, positive to the right, in leg lengths.
        previous_offset : [-1, 1], optional
            Where the masses are when the step starts; they move to ``mass_offset`` in ``shift_time``. By default they are there already.

        Raises
        ------
        ValueError
            If an argument is outside its range.
        SolverError
            If the integrator fails; never for a fall, which is a result.
        """
        command = require_command(inter_leg_angle, mass_offset, previous_offset)
        return self._step(require_state(state), require_foot(stance), command)

    def walk(
        self,
        n_steps: int,
        *,
        state: ArrayLike,
        stance: Foot = "left",
        inter_leg_angle: float | Sequence[float] | NDArray[np.float64] = INTER_LEG_ANGLE,
        mass_offset: float | Sequence[float] | NDArray[np.float64] = 0.0,
        previous_offset: float | None = None,
        samples_per_step: int = 0,
    ) -> Walk:
        """Walk ``n_steps`` steps, or until a fall.

        Parameters
        ----------
        n_steps : int >= 1
        state, stance : see ``step``
            The start; ``find_limit_cycle(walker).state`` is the gait.
        inter_leg_angle, mass_offset : float, or one per step
        previous_offset : see ``step``
            For the first step.
        samples_per_step : 0 or >= 2
            Instants per step at which ``Walk.path`` holds the centre of mass.

        Raises
        ------
        ValueError, SolverError
            As ``step``.
        """
        n_steps = require_count("n_steps", n_steps)
        samples = require_count("samples_per_step", samples_per_step, 0, 10_000)
        if samples == 1:
            raise ValueError("samples_per_step must be 0 or from 2 to 10000, got 1")
        start, first = require_state(state), require_foot(stance)
        angles = require_one_or_each("inter_leg_angle", inter_leg_angle, n_steps).tolist()
        offsets = require_one_or_each("mass_offset", mass_offset, n_steps).tolist()
        commands = [require_command(a, m, None) for a, m in zip(angles, offsets, strict=True)]
        in_force = [require_command(angles[0], offsets[0], previous_offset).previous_offset]
        results: list[StepResult] = []
        current, foot = start, first
        for k in range(n_steps):
            commands[k] = commands[k]._replace(previous_offset=in_force[-1])
            results.append(self._step(current, foot, commands[k]))
            if results[-1].fall is not None:
                break
            current, foot = results[-1].state, results[-1].stance
            in_force.append(results[-1].mass_offset)
        begun = commands[: len(results)]
        walk = Walk(
            **walk_arrays(start, first, results),
            mass_offsets=np.array(in_force),
            commands=np.array(begun)[:, :2],
            energies=tuple(result.energy for result in results if result.fall is None),
            path=np.empty((0, 4)),
            parameters=self.parameters,
        )
        if not samples:
            return walk
        times = np.cumsum([0.0, *walk.durations])
        starts = zip(walk.states, walk.stances, walk.footprints, times, strict=True)
        paths = [
            _centre_path(self._trace(state, foot, command, result.duration, samples), state[0], *at)
            for (state, foot, *at), command, result in zip(starts, begun, results, strict=False)
        ]
        return replace(walk, path=np.concatenate(paths))

    def stance_motion(
        self,
        state: ArrayLike,
        *,
        duration: float,
        samples: int = 50,
        stance: Foot = "left",
        inter_leg_angle: float = INTER_LEG_ANGLE,
        mass_offset: float = 0.0,
        previous_offset: float | None = None,
    ) -> dict[str, Vector]:
        """The motion within a step at uniform times: coordinates, centre of mass, contact force, energy.

        Parameters
        ----------
        state, stance, inter_leg_angle, mass_offset, previous_offset : see ``step``
        duration : (0, 100]
            How far to follow the stance phase, usually ``StepResult.duration``; the floor under the swing foot is not looked at.
        samples : int >= 2

        Returns
        -------
        dict
            One array of shape (samples,) for each of ``lean_yaw_env.kernel.trace.COLUMNS``.

        Raises
        ------
        ValueError
            If an argument is outside its range.
        """
        duration = require_number("duration", duration, 0.0, 100.0, "(]")
        samples = require_count("samples", samples, 2, 1_000_000)
        command = require_command(inter_leg_angle, mass_offset, previous_offset)
        rows = self._trace(require_state(state), require_foot(stance), command, duration, samples)
        return {name: rows[:, i].copy() for i, name in enumerate(COLUMNS)}

    @cached_property
    def _body(self) -> Vector:
        """The parameters as the kernel's row."""
        return np.array(self.parameters.body())

    def _step(self, state: Vector, foot: Foot, command: Command) -> StepResult:
        row = np.empty(len(Outcome._fields))
        step_kernel(self._body, np.array(command), state, SIDE[foot], row)
        outcome = Outcome._make(row.tolist())
        if outcome.status == records.FAILED:
            raise failure_of(self.parameters.body(), command, state, SIDE[foot])
        fall = FALL_OF_STATUS.get(outcome.status)
        return StepResult(
            state=np.array(outcome[:STATE_SIZE]),
            stance=foot if fall else OTHER_FOOT[foot],
            duration=outcome.duration,
            displacement=np.array([outcome.displacement_x, outcome.displacement_z]),
            heading_change=outcome.heading_change,
            mass_offset=outcome.mass_offset,
            fall=fall,
            least_normal_force=outcome.least_normal_force,
            greatest_friction=outcome.greatest_friction,
            energy=EnergyLedger(
                outcome.gravity_work, outcome.shift_work, outcome.impact_loss, outcome.ankle_loss
            ),
            evaluations=int(outcome.evaluations),
        )

    def _trace(
        self, state: Vector, stance: Foot, command: Command, duration: float, samples: int
    ) -> Vector:
        rows = np.zeros((samples, len(COLUMNS)))
        trace(self.parameters.body(), command, *state.tolist(), SIDE[stance], duration, rows)
        return rows


def require_command(
    inter_leg_angle: float, mass_offset: float, previous_offset: float | None
) -> Command:
    """A step's command as the kernels take it, or ``ValueError``."""
    offset = require_mass_offset(mass_offset)
    before = (
        offset
        if previous_offset is None
        else require_mass_offset(previous_offset, "previous_offset")
    )
    return Command(require_inter_leg_angle(inter_leg_angle), offset, before)


def require_completed(result: StepResult, what: str) -> StepResult:
    """Return a completed step, or raise ``FellError`` saying how the walker fell in ``what``."""
    if result.fall is not None:
        raise FellError(f"the walker fell {result.fall.value} in {what}")
    return result


def raise_for_failure(
    status: float,
    body: Body,
    command: Sequence[float],
    state: Sequence[float] | Vector,
    side: float,
) -> None:
    """Raise ``SolverError`` if a kernel gave up."""
    if status == records.FAILED:
        raise failure_of(body, command, state, side)


def failure_of(
    body: Body, command: Sequence[float], state: Sequence[float] | Vector, side: float
) -> SolverError:
    """The error that says which step a kernel gave up on, with all that the step starts from."""
    start = [float(value) for value in state]
    row = (*body, *command, *start, side)
    return SolverError(
        f"the step on the {'left' if side > 0.0 else 'right'} foot from {start} did not converge; "
        f"{body}, {command}; all of it as hexadecimal floats: {' '.join(float(x).hex() for x in row)}"
    )


def walk_arrays(start: Vector, foot: Foot, results: Sequence[StepResult]) -> dict[str, Any]:
    """The fields of ``BaseWalk`` from the steps begun, of which the last may be a fall."""
    completed = [result for result in results if result.fall is None]
    return {
        "states": np.array([start, *(result.state for result in completed)]),
        "stances": (foot, *(result.stance for result in completed)),
        "footprints": np.cumsum([np.zeros(2), *(r.displacement for r in completed)], axis=0),
        "durations": np.array([result.duration for result in completed]),
        "fall": results[-1].fall,
    }


def _centre_path(rows: Vector, heading: float, footprint: Vector, time: float) -> Vector:
    """Times and positions of the centre of mass in the floor frame from a trace in the stance frame."""
    cosine, sine = np.cos(heading), np.sin(heading)
    ahead, up, right = (rows[:, COLUMNS.index(f"centre_{axis}")] for axis in "xyz")
    downhill = footprint[0] + cosine * ahead + sine * right
    aside = footprint[1] - sine * ahead + cosine * right
    return np.column_stack([rows[:, 0] + time, downhill, up, aside])
