"""What every analysis asks of a walker: a map from one heel strike to a later one.

A map takes a number of walking steps and, after an odd number, the mirror image, so that every state stands on the left foot. A symmetric
gait is a fixed point of one mirrored step. A gait that limps, or walks across the slope, is one of two steps. The analyses use nothing
else of a walker. So they work on every kind of map: a walker at a constant command, a passive walker, and a walker that a controller steers.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from functools import singledispatch
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple, TypeAlias, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from lean_yaw_env.kernel.records import BODY_INPUTS, Command
from lean_yaw_env.parameters import INTER_LEG_ANGLE, Foot, Vector, require_mass_offset
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.validation import require_choice
from lean_yaw_env.walker import StepResult, Walker

if TYPE_CHECKING:
    from typing_extensions import Self, Unpack

RESIDUAL_LIMIT = 1e-12
"""Largest change of any coordinate over an exact map that still counts as a fixed point."""

BODY_PARAMETERS = BODY_INPUTS
"""Parameters of any walker by which a step is differentiable."""
FEET_IN_TURN: tuple[Foot, Foot] = ("left", "right")
"""The stance feet of the steps of a map, by turns."""
Motion = Literal["heading", "lean", "pitch", "masses"]
"""What a coordinate of a state belongs to; "pitch" is the fore-aft motion of stance leg and swing leg."""
MOTIONS: dict[str, Motion] = {
    "heading": "heading",
    "stance_pitch": "pitch",
    "ankle_angle": "lean",
    "stance_pitch_rate": "pitch",
    "ankle_rate": "lean",
    "inter_leg_rate": "pitch",
    "mass_offset": "masses",
}
"""The motion that each coordinate of a walker belongs to."""


@dataclass(frozen=True)
class CycleStep:
    """One completed step of a gait, in the same terms for every kind of map.

    Attributes
    ----------
    start, state : shape (k,)
        The map's state just after the heel strikes that begin and end the step.
    foot : "left" or "right"
        The foot that stands during the step.
    command : Command
        What was commanded; a passive walker's is empty of meaning.
    duration : float
    displacement : shape (2,)
        Between contact reference points: downhill (x) and to the right (z), leg lengths.
    least_normal_force, greatest_friction : float
        Least normal force (in weights) and greatest ratio of tangential to normal force.
    gravity_work, shift_work : float
        Work of gravity, and of moving the masses, in weight times leg length.
    """

    start: Vector
    state: Vector
    foot: Foot
    command: Command
    duration: float
    displacement: Vector
    least_normal_force: float
    greatest_friction: float
    gravity_work: float
    shift_work: float


def cycle_step(
    start: Vector, end: Vector, foot: Foot, command: Command, result: StepResult
) -> CycleStep:
    """A walker's completed step between two states of its map."""
    return CycleStep(
        start=start, state=end, foot=foot, command=command, duration=result.duration, displacement=result.displacement,
        least_normal_force=result.least_normal_force, greatest_friction=result.greatest_friction,
        gravity_work=result.energy.gravity_work, shift_work=result.energy.shift_work,
    )  # fmt: skip


class Linearised(NamedTuple):
    """A map, or one of its steps, at a state: ``image`` (k,), ``matrix`` (k, k) by the state, ``by_parameter`` (k,), and ``error`` (k, k).

    The error is a bound of that of ``matrix``, zero where derivatives are exact.
    """

    image: Vector
    matrix: Vector
    by_parameter: Vector
    error: Vector


class SectionMap(ABC):
    """A walker's map of the heel-strike section onto itself; states have ``k`` coordinates.

    A subclass is a frozen dataclass. It gives the walking step (``results``, ``step_many``, ``linear_step``), says what its states are and where its gaits are looked for.

    Attributes
    ----------
    walker : Walker or PassiveWalker
    n_steps : int
        How many steps the map takes.
    names : tuple of str
        Of the state's coordinates.
    mirror : shape (k,)
        Signs that turn a state into its mirror image on the other foot.
    carried : float
        What the first step finds of an earlier one beside the state; ``step_many`` hands it on.
    precision : float
        The largest change of a coordinate over the map that still counts as a fixed point.
    neutral_within : float
        A multiplier this near to one counts as neutral: nothing brings back what it multiplies, and nothing drives it away.
    parameters : tuple of str
        Names of the parameters along which the map can be moved.
    zero_explanation : str
        Why the map has a multiplier of zero.
    is_threadsafe : bool
        Whether several threads may ask it at once.
    """

    walker: Walker | PassiveWalker
    n_steps: int
    names: tuple[str, ...]
    mirror: Vector
    carried: float = 0.0
    precision: ClassVar[float] = RESIDUAL_LIMIT
    neutral_within: ClassVar[float] = 0.0
    parameters: ClassVar[tuple[str, ...]] = BODY_PARAMETERS
    zero_explanation: ClassVar[str] = ""
    is_threadsafe: ClassVar[bool] = True

    @property
    def motions(self) -> tuple[Motion, ...]:
        """The motion that each coordinate belongs to."""
        return tuple(MOTIONS[name] for name in self.names)

    @property
    @abstractmethod
    def free(self) -> list[int]:
        """Indices of the coordinates that a gait repeats."""

    @property
    def stander(self) -> Walker:
        """The walker whose stance phase a step of the map has."""
        return Walker(self.walker.parameters)

    @abstractmethod
    def require_state(self, state: ArrayLike) -> Vector:
        """Return a state of this map as a float array (k,), or raise ``ValueError``."""

    @abstractmethod
    def results(self, state: Vector) -> list[CycleStep]:
        """The ``n_steps`` steps from a state on the left foot.

        Raises
        ------
        FellError
            If the walker falls.
        SolverError
            If the integrator fails.
        ValueError
            If the state is outside its range.
        """

    @abstractmethod
    def linear_step(self, state: Vector, k: int, parameter: str | None) -> Linearised:
        """Step ``k`` with its derivatives, not mirrored; those by a parameter are zero if none is named. Raises as ``results``."""

    @abstractmethod
    def step_many(
        self, states: Vector, carried: Vector, foot: int
    ) -> tuple[Vector, Vector, Vector]:
        """One step of n walkers on the left (0) or right (1) foot, from states (n, k) and what they carry (n,).

        Returns states (n, k), what is carried on (n,) and the statuses (n,) of ``kernel.records``.
        """

    def step_commanded(
        self, states: Vector, carried: Vector, commands: Vector, foot: int
    ) -> tuple[Vector, Vector, Vector]:
        """``step_many`` at inter-leg angles and mass offsets (n, 2) of one's own choice, or ``ValueError`` where the walker takes none."""
        raise ValueError(f"a walker that takes commands is needed, got {self.walker!r}")

    @abstractmethod
    def search(self) -> Iterator[Vector]:
        """States of the gaits that the map is known to have, the best first, or ``NoGaitError`` saying what was tried."""

    def main_gait(self) -> Vector:
        """State of the gait that a map over parameters shows, or ``NoGaitError``."""
        return next(self.search())

    def value(self, parameter: str) -> float:
        """A parameter's value, or ``ValueError`` for an unknown one."""
        require_choice("parameter", parameter, self.parameters)
        return getattr(self.walker.parameters, parameter)

    def moved(self, parameter: str, value: float) -> Self:
        """The same map at another value of a parameter."""
        require_choice("parameter", parameter, self.parameters)
        changed = replace(self.walker.parameters, **{parameter: value})
        return self._with(walker=replace(self.walker, parameters=changed))

    def over(self, n_steps: int) -> Self:
        """The same walker's map over another number of steps."""
        return self._with(n_steps=n_steps)

    def _with(self, **changes: Any) -> Self:
        return replace(self, **changes)  # pyright: ignore[reportArgumentType]  # every map is a dataclass

    def along(self, parameter: str) -> Self:
        """The map over as many steps as its gaits repeat in at every value of a parameter."""
        require_choice("parameter", parameter, self.parameters)
        return self

    def question(self) -> dict[str, Any]:
        """What identifies the map in a stored result, as plain values."""
        return {"map": type(self).__name__, "parameters": asdict(self.walker.parameters)}

    def image(self, state: Vector) -> Vector:
        """The state after ``n_steps``, mirrored if they are odd."""
        end = self.results(state)[-1].state
        return self.mirror * end if self.n_steps % 2 else end

    def linearise(self, state: Vector, parameter: str | None = None) -> Linearised:
        """The map with its derivatives by the state and, if one is named, by a parameter. Raises as ``results``."""
        state = self.require_state(state)
        size = len(state)
        matrix, by_parameter, error = np.eye(size), np.zeros(size), np.zeros((size, size))
        for k in range(self.n_steps):
            step = self.linear_step(state, k, parameter)
            by_parameter = step.matrix @ by_parameter + step.by_parameter
            error = np.abs(step.matrix) @ error + step.error @ np.abs(matrix)
            matrix = step.matrix @ matrix
            state = step.image
        if self.n_steps % 2:
            sign = self.mirror
            return Linearised(sign * state, sign[:, None] * matrix, sign * by_parameter, error)
        return Linearised(state, matrix, by_parameter, error)

    def derivative(self, state: Vector) -> tuple[Vector, Vector]:
        """Image and Jacobian."""
        return self.linearise(state)[:2]

    def sensitivity(self, state: Vector, parameter: str) -> tuple[Vector, Vector, Vector]:
        """Image, Jacobian and derivative by a parameter."""
        return self.linearise(state, parameter)[:3]


WalkerOrMap: TypeAlias = "Walker | PassiveWalker | SectionMap"
"""What the analyses take: a walker, or any map, which holds its own command."""


class CommandArguments(TypedDict, total=False):
    """Keywords of every analysis of an active ``Walker`` at a constant command; see ``find_limit_cycle``."""

    inter_leg_angle: float
    mass_offset: float | tuple[float, float]


@singledispatch
def section_map_of(walker: Any, **command: Unpack[CommandArguments]) -> SectionMap:
    """A walker's section map over the fewest steps that a simple gait repeats in; a map is returned as it is.

    Raises
    ------
    ValueError
        If an argument is outside its range, or a command is given to what takes none.
    """
    raise ValueError(f"walker must be a Walker, a PassiveWalker or a SectionMap, got {walker!r}")


@section_map_of.register(SectionMap)
def _(walker: SectionMap, **command: Unpack[CommandArguments]) -> SectionMap:
    require_no_command("a map, which holds its own command,", **command)
    return walker


def require_offsets(mass_offset: float | tuple[float, float]) -> tuple[float, float]:
    """Offsets in force while the left and while the right foot stands, or ``ValueError``."""
    if not isinstance(mass_offset, (tuple, list, np.ndarray)):
        both = require_mass_offset(mass_offset)
        return both, both
    if len(mass_offset) != 2:
        raise ValueError(
            f"mass_offset must be a number or a pair (left foot's, right foot's), got {mass_offset!r}"
        )
    left, right = mass_offset
    return (
        require_mass_offset(left, "left mass_offset"), require_mass_offset(right, "right mass_offset")
    )  # fmt: skip


def require_no_command(
    what: str,
    *,
    inter_leg_angle: float = INTER_LEG_ANGLE,
    mass_offset: float | tuple[float, float] = 0.0,
) -> None:
    """Raise ``ValueError`` if a command is given."""
    if inter_leg_angle != INTER_LEG_ANGLE or require_offsets(mass_offset) != (0.0, 0.0):
        raise ValueError(
            f"{what} takes no inter_leg_angle and no mass_offset, "
            f"got {inter_leg_angle!r} and {mass_offset!r}"
        )
