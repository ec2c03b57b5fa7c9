"""The periodic gait of a walker with its agent: the fixed point of the closed loop's stride map, its eigenvalues, and what it costs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.evaluation.closed_loop_map import PREVIOUS_HEADING, ClosedLoop
from lean_yaw_env.analysis import LimitCycle, modes
from lean_yaw_env.envs import columns as c
from lean_yaw_env.errors import FellError, LeanYawError, NoGaitError
from lean_yaw_env.kernel.records import STEPPED, Outcome
from lean_yaw_env.parameters import Foot, Vector
from lean_yaw_env.walker import FALL_OF_STATUS

RESIDUAL_LIMIT = 1e-6
"""Largest change of a coordinate over the stride that still counts as periodic: agents' actions are rounded to some 1e-8."""
SETTLING_STEPS = 400
"""Walked from the start before Newton's method takes over; even, to end on the left foot."""
NEUTRAL = 1e-5
"""An eigenvalue this near to one is a neutral one."""
ZERO = 1e-3
"""A multiplier below this is as good as zero: what it multiplies is gone within a stride."""
_NEWTON_STEPS = 30
_SINGULAR = 1e-6  # relative: neutral directions are not solved for
_ARRIVED = 1e-9

GROUPS = {
    "heading": ("heading", "previous_heading", "aside"),
    "lean": ("ankle_angle", "ankle_rate"),
    "pitch": ("stance_pitch", "stance_pitch_rate", "last_speed"),
    "masses": ("mass_offset",),
}
"""What a mode is about: coordinates by the motion they belong to."""


@dataclass(frozen=True)
class ClosedMode:
    """One mode of a closed-loop gait.

    Attributes
    ----------
    eigenvalue : complex
        Over the stride.
    error : float
        Of it, to first order, from what the agent's differences leave uncertain; infinite where it is a multiple one.
    name : "fore-aft" or "three-dimensional"
        By the larger share, as ``lean_yaw_env.analysis.modes`` names a walker's own.
    about : the key of ``GROUPS`` that takes the largest part in it
    is_neutral : bool
        One, as nothing answers to what it moves: a heading or a place that the agent does not see or use, or a mean offset between
        changes that are both at their limit.
    """

    eigenvalue: complex
    error: float
    name: str
    about: str
    is_neutral: bool


@dataclass(frozen=True)
class ClosedLoopGait:
    """A gait that the closed loop repeats every stride.

    Attributes
    ----------
    cycle : LimitCycle
        In the closed loop's state: ``state``, ``jacobian`` and ``coordinates`` have its k numbers.
    modes : by falling magnitude
    inter_leg_angles, mass_offsets : (left, right)
        Commanded while either foot stands.
    is_at_limit : bool
        Whether the offset changes by as much as it may, there and back: what the agent asks for beyond makes no difference.
    """

    cycle: LimitCycle
    modes: tuple[ClosedMode, ...]
    inter_leg_angles: tuple[float, float]
    mass_offsets: tuple[float, float]
    is_at_limit: bool

    @property
    def state(self) -> Vector:
        """On the left foot, shape (k,)."""
        return self.cycle.state

    @property
    def spectral_radius(self) -> float:
        """The largest magnitude of the eigenvalues, neutral ones apart."""
        return max(abs(mode.eigenvalue) for mode in self.modes if not mode.is_neutral)

    @property
    def cost_of_transport(self) -> float:
        """Work of gravity and of moving the masses, per weight and distance."""
        return self.cycle.gravity_work + self.cycle.shift_work

    @property
    def is_stable(self) -> bool:
        """Whether small disturbances die out, but for what is neutral."""
        return self.spectral_radius < 1.0

    @property
    def strides_to_halve(self) -> float:
        """Strides in which the slowest disturbance halves; infinite if it does not."""
        radius = self.spectral_radius
        return float(np.log(0.5) / np.log(radius)) if 0.0 < radius < 1.0 else float("inf")

    @property
    def error(self) -> float:
        """The largest error of the eigenvalues that are not as good as zero."""
        return max((m.error for m in self.modes if abs(m.eigenvalue) > ZERO), default=0.0)


def find_closed_loop_gait(loop: ClosedLoop) -> ClosedLoopGait:
    """Find the gait that the agent keeps, by walking and then by Newton's method; stable or not.

    Raises
    ------
    NoGaitError
        If none that repeats every stride is found; says what was tried.
    """
    tried: list[str] = []
    for name, start in (("where the walk settles", _settled(loop)), ("the start", loop.start)):
        if start is None:
            tried.append("the walk falls")
            continue
        try:
            state = _newton(loop, start)
            return _described(loop, state)
        except LeanYawError as error:
            tried.append(f"from {name}: {error}")
    raise NoGaitError(
        f"no gait of walker and agent at {loop.task.name} repeats every stride; tried: "
        + "; ".join(tried)
    )


def _settled(loop: ClosedLoop) -> Vector | None:
    """The state after a long walk from the start, on the left foot; none if it falls."""
    rows = loop.placed(loop.start[None], 1.0)
    walking = np.ones(1, dtype=np.bool_)
    for _ in range(SETTLING_STEPS):
        loop.advance(rows, walking)
        if rows.outcomes[0, c.OUTCOME_STATUS] != STEPPED:
            return None
    return loop.states(rows)[0]


def stride(loop: ClosedLoop, state: Vector) -> tuple[Vector, list[Outcome], Vector]:
    """Two steps of the environment from the left foot: the states (2, k) after each, the outcomes, and the commands (2, 2).

    Raises
    ------
    FellError
        If the walker falls.
    """
    rows = loop.placed(state[None], 1.0)
    states, outcomes, commands = [], [], []
    for k in range(2):
        loop.advance(rows, np.ones(1, dtype=np.bool_))
        outcome = Outcome._make(rows.outcomes[0].tolist())
        if outcome.status != STEPPED:
            fall = FALL_OF_STATUS.get(outcome.status)
            raise FellError(f"the walker fell {fall.value if fall else ''} in step {k + 1}")
        states.append(loop.states(rows)[0])
        outcomes.append(outcome)
        commands.append(
            (float(rows.memory[0, c.INTER_LEG_ANGLE]), float(rows.memory[0, c.COMMANDED_OFFSET]))
        )
    return np.array(states), outcomes, np.array(commands)


def stride_jacobian(loop: ClosedLoop, state: Vector) -> tuple[Vector, Vector]:
    """The closed loop's stride Jacobian (k, k) and a bound of its error, from the left foot.

    Raises
    ------
    FellError
        If the walker does not complete the stride.
    """
    matrix, error = np.eye(len(state)), np.zeros((len(state), len(state)))
    feet: tuple[Foot, Foot] = ("left", "right")
    for foot, before in zip(feet, (state, stride(loop, state)[0][0]), strict=True):
        step = loop.linearise(before, foot)
        error = np.abs(step.matrix) @ error + step.error @ np.abs(matrix)
        matrix = step.matrix @ matrix
    return matrix, error


def _change(loop: ClosedLoop, state: Vector) -> Vector:
    return stride(loop, state)[0][-1] - state


def _newton(loop: ClosedLoop, start: Vector) -> Vector:
    """The fixed point of the stride map, with the smallest residual that rounding allows."""
    state = start.copy()
    change = _change(loop, state)
    for _ in range(_NEWTON_STEPS):
        size = _size(loop, change)
        if size == 0.0:
            break
        slope = stride_jacobian(loop, state)[0] - np.eye(len(state))
        way = np.linalg.lstsq(slope, -change, rcond=_SINGULAR)[0]
        for share in (1.0, 0.5, 0.25, 0.125):
            try:
                trial = _change(loop, state + share * way)
            except LeanYawError:
                continue
            if _size(loop, trial) < size:
                state, change = state + share * way, trial
                break
        else:
            break
    residual = _size(loop, change)
    if not residual <= RESIDUAL_LIMIT:
        raise NoGaitError(f"Newton's method stopped at a residual of {residual:.1e}")
    return state


def _size(loop: ClosedLoop, change: Vector) -> float:
    """The largest change over a stride, headings apart where every heading is like any other."""
    return float(np.abs(change[_repeated(loop, len(change))]).max())


def _repeated(loop: ClosedLoop, size: int) -> list[int]:
    parameters = loop.walker.parameters
    sees_heading = loop.task.command_column is not None or loop.task.goal_columns is not None
    if sees_heading or not (parameters.slope_turns or parameters.slope == 0.0):
        return list(range(size))
    return [k for k in range(size) if k not in (0, PREVIOUS_HEADING)]


def _described(loop: ClosedLoop, state: Vector) -> ClosedLoopGait:
    states, outcomes, commands = stride(loop, state)
    matrix, error = stride_jacobian(loop, state)
    eigenvalues = np.asarray(np.linalg.eigvals(matrix), dtype=complex)
    chord = float(np.hypot(sum(o.displacement_x for o in outcomes), sum(o.displacement_z for o in outcomes)))  # fmt: skip
    duration = sum(outcome.duration for outcome in outcomes)
    cycle = LimitCycle(
        state=state,
        eigenvalues=eigenvalues[np.lexsort((-np.imag(eigenvalues), -np.abs(eigenvalues)))],
        stride_period=duration,
        speed=chord / duration,
        step_length=0.5 * chord,
        turn=0.0 if 0 in _repeated(loop, len(state)) else float(states[-1, 0] - state[0]),
        residual=_size(loop, states[-1] - state),
        n_steps=2,
        jacobian=matrix,
        coordinates=loop.coordinates,
        gravity_work=sum(outcome.gravity_work for outcome in outcomes) / chord,
        shift_work=sum(outcome.shift_work for outcome in outcomes) / chord,
        least_normal_force=min(outcome.least_normal_force for outcome in outcomes),
        greatest_friction=max(outcome.greatest_friction for outcome in outcomes),
    )
    (left_angle, left_offset), (right_angle, right_offset) = commands.tolist()
    limit = loop.largest_change * (1.0 - _ARRIVED)
    at_limit = 0.0 < limit <= abs(right_offset - left_offset)
    return ClosedLoopGait(
        cycle,
        _modes(cycle, error),
        (left_angle, right_angle),
        (left_offset, right_offset),
        at_limit,
    )


def _modes(cycle: LimitCycle, error: Vector) -> tuple[ClosedMode, ...]:
    """The cycle's modes, with first-order bounds of their errors and what they are about."""
    found = []
    for mode in modes(cycle):
        left, right = np.abs(mode.left_vector), np.abs(mode.vector)
        overlap = float(abs(mode.left_vector @ mode.vector))
        bound = float(left @ error @ right)
        taking_part = left * right if (left * right).sum() > _ARRIVED else right**2
        shares = {
            group: sum(taking_part[cycle.coordinates.index(n)] for n in names if n in cycle.coordinates)
            for group, names in GROUPS.items()
        }  # fmt: skip
        about = max(shares, key=lambda group: shares[group])
        is_fore_aft = shares["pitch"] > 0.5 * sum(shares.values())
        found.append(
            ClosedMode(
                eigenvalue=mode.eigenvalue,
                error=0.0 if bound == 0.0 else bound / overlap if overlap > 0.0 else float("inf"),
                name="fore-aft" if is_fore_aft else "three-dimensional",
                about=about,
                is_neutral=abs(mode.eigenvalue - 1.0) < NEUTRAL,
            )
        )
    return tuple(found)
