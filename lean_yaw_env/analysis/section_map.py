"""Maps of the heel-strike section onto itself, of active and passive walkers, behind one face.

A map takes a number of walking steps and, after an odd one, the mirror image, so that every state
stands on the left foot. A symmetric gait is a fixed point of one mirrored step; a gait that limps,
or stands askew, of two steps. Root finding and continuation know nothing else about a walker.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from lean_yaw_env.analysis.stride import differentiate_step, require_offsets
from lean_yaw_env.errors import FellError, NoGaitError
from lean_yaw_env.kernel.jacobian import INPUTS, step_jacobian
from lean_yaw_env.kernel.passive import INPUTS as PASSIVE_INPUTS
from lean_yaw_env.kernel.passive import passive_jacobian
from lean_yaw_env.kernel.records import STEPPED, Command
from lean_yaw_env.parameters import (
    INTER_LEG_ANGLE,
    MIRROR,
    STATE_FIELDS,
    STATE_SIZE,
    Foot,
    Vector,
    require_inter_leg_angle,
    require_state,
)
from lean_yaw_env.passive import (
    FORE_AFT,
    PASSIVE_MIRROR,
    PASSIVE_STATE_FIELDS,
    PASSIVE_STATE_SIZE,
    PassiveStep,
    PassiveWalker,
    fall_of,
    require_passive_state,
)
from lean_yaw_env.walker import (
    FALL_OF_STATUS,
    OTHER_FOOT,
    SIDE,
    StepResult,
    Walker,
    raise_for_failure,
    require_completed,
)

BODY_PARAMETERS = (
    "hip_width",
    "foot_radius",
    "ankle_tilt",
    "slope",
    "ankle_stiffness",
    "ankle_damping",
)
"""Parameters of any walker by which a step is differentiable."""

COMMAND_PARAMETERS = ("inter_leg_angle", "mass_offset", "alternating_offset")
"""Those of the active walker only.

``mass_offset`` is the mean of both feet's offsets, ``alternating_offset`` what the left foot's has
more than that: positive moves the masses away from the stance foot.
"""

_ARRIVED = 1e-9


class SectionMap(Protocol):
    """What root finding and continuation ask of a walker."""

    @property
    def n_steps(self) -> int:
        """How many steps the map takes."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the section's coordinates."""
        ...

    @property
    def free(self) -> list[int]:
        """Indices of the coordinates that a gait repeats."""
        ...

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters along which the map can be moved."""
        ...

    def image(self, state: Vector) -> Vector:
        """The section state after ``n_steps``, mirrored if they are odd."""
        ...

    def derivative(self, state: Vector) -> tuple[Vector, Vector]:
        """Image and exact Jacobian."""
        ...

    def sensitivity(self, state: Vector, parameter: str) -> tuple[Vector, Vector, Vector]:
        """Image, Jacobian and derivative by a parameter, all exact."""
        ...

    def value(self, parameter: str) -> float:
        """A parameter's value."""
        ...

    def moved(self, parameter: str, value: float) -> SectionMap:
        """The same map at another value of a parameter."""
        ...

    def over(self, n_steps: int) -> SectionMap:
        """The same walker's map over another number of steps."""
        ...


@dataclass(frozen=True)
class ActiveMap:
    """Steps of the active walker at a constant inter-leg angle, with an offset for each foot.

    Attributes
    ----------
    walker : Walker
    inter_leg_angle : float
    mass_offset : (float, float)
        In force while the left and while the right foot stands; the masses move from the one to
        the other at the start of each step.
    n_steps : int
        An odd number needs opposite offsets, which are each other's mirror image.
    """

    walker: Walker
    inter_leg_angle: float = INTER_LEG_ANGLE
    mass_offset: tuple[float, float] = (0.0, 0.0)
    n_steps: int = 2

    def __post_init__(self) -> None:
        require_inter_leg_angle(self.inter_leg_angle)
        require_offsets(self.mass_offset)
        if self.n_steps % 2 and not self.is_symmetric:
            raise ValueError(
                "an odd number of steps needs mass offsets that are opposite for the two feet, "
                f"not {self.mass_offset}"
            )

    @property
    def is_symmetric(self) -> bool:
        """Whether a step on the right foot is the mirror image of one on the left."""
        return self.mass_offset[0] == -self.mass_offset[1]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(field.name for field in STATE_FIELDS)

    @property
    def free(self) -> list[int]:
        # On the level, and where the slope turns with the walker, every heading is like any other
        parameters = self.walker.parameters
        has_downhill = parameters.slope != 0.0 and not parameters.slope_turns
        return [0, 1, 2, 3, 4] if has_downhill else [1, 2, 3, 4]

    @property
    def parameters(self) -> tuple[str, ...]:
        return BODY_PARAMETERS + COMMAND_PARAMETERS

    def results(self, state: Vector) -> list[StepResult]:
        """The steps themselves, the feet alternating from the left one.

        Raises
        ------
        FellError
            If the walker falls.
        NoGaitError
            If a heel strike comes before the masses have arrived at their offset.
        """
        results: list[StepResult] = []
        foot: Foot = "left"
        for k in range(self.n_steps):
            offset, before = self.mass_offset[k % 2], self.mass_offset[(k + 1) % 2]
            result = require_completed(
                self.walker.step(
                    state,
                    stance=foot,
                    inter_leg_angle=self.inter_leg_angle,
                    mass_offset=offset,
                    previous_offset=before,
                ),
                f"step {k + 1} of the gait",
            )
            if abs(result.mass_offset - offset) > _ARRIVED:
                raise NoGaitError(
                    f"the heel strike after {result.duration:.3f} comes before the masses have "
                    f"moved to {offset:g}; a shorter shift_time lets them arrive"
                )
            results.append(result)
            state, foot = result.state, result.stance
        return results

    def image(self, state: Vector) -> Vector:
        end = self.results(state)[-1].state
        return MIRROR * end if self.n_steps % 2 else end

    def derivative(self, state: Vector) -> tuple[Vector, Vector]:
        matrix = np.eye(STATE_SIZE)
        foot: Foot = "left"
        for k in range(self.n_steps):
            step = differentiate_step(self.walker, state, foot, self._command(k))
            state, matrix, foot = step.state, step.by_state @ matrix, OTHER_FOOT[foot]
        return self._mirrored(state, matrix)

    def sensitivity(self, state: Vector, parameter: str) -> tuple[Vector, Vector, Vector]:
        matrix, by_parameter = np.eye(STATE_SIZE), np.zeros(STATE_SIZE)
        foot: Foot = "left"
        for k in range(self.n_steps):
            status, outputs, rows = step_jacobian(
                self.walker.parameters.body(), self._command(k), state, SIDE[foot]
            )
            after, rows = outputs[:STATE_SIZE], rows[:STATE_SIZE]
            raise_for_failure(status, state, self.walker.parameters)
            if status in FALL_OF_STATUS:
                raise FellError(f"the walker fell {FALL_OF_STATUS[status].value} in step {k + 1}")
            by_parameter = rows[:, :5] @ by_parameter + rows[:, 5:] @ self._direction(parameter, k)
            matrix = rows[:, :5] @ matrix
            state, foot = after, OTHER_FOOT[foot]
        state, matrix = self._mirrored(state, matrix)
        return state, matrix, MIRROR * by_parameter if self.n_steps % 2 else by_parameter

    def value(self, parameter: str) -> float:
        left, right = self.mass_offset
        commands = {
            "inter_leg_angle": self.inter_leg_angle,
            "mass_offset": 0.5 * (left + right),
            "alternating_offset": 0.5 * (left - right),
        }
        if parameter in commands:
            return commands[parameter]
        return getattr(self.walker.parameters, _require_parameter(parameter, self.parameters))

    def moved(self, parameter: str, value: float) -> ActiveMap:
        _require_parameter(parameter, self.parameters)
        if parameter == "inter_leg_angle":
            return replace(self, inter_leg_angle=require_inter_leg_angle(value))
        if parameter == "mass_offset":
            apart = self.value("alternating_offset")
            return replace(self, mass_offset=(value + apart, value - apart))
        if parameter == "alternating_offset":
            mean = self.value("mass_offset")
            return replace(self, mass_offset=(mean + value, mean - value))
        changed = replace(self.walker.parameters, **{parameter: value})
        return replace(self, walker=Walker(changed))

    def over(self, n_steps: int) -> ActiveMap:
        return replace(self, n_steps=n_steps)

    def _command(self, k: int) -> Command:
        return Command(self.inter_leg_angle, self.mass_offset[k % 2], self.mass_offset[(k + 1) % 2])

    def _direction(self, parameter: str, k: int) -> Vector:
        """How a parameter enters the inputs of step ``k`` after the state."""
        if parameter in BODY_PARAMETERS:
            return np.eye(len(INPUTS) - 5)[3 + BODY_PARAMETERS.index(parameter)]
        sign = 1.0 if k % 2 == 0 else -1.0
        direction = {
            "inter_leg_angle": (1.0, 0.0, 0.0),
            "mass_offset": (0.0, 1.0, 1.0),
            "alternating_offset": (0.0, sign, -sign),
        }[_require_parameter(parameter, self.parameters)]
        return np.array([*direction, *np.zeros(len(BODY_PARAMETERS))])

    def _mirrored(self, state: Vector, matrix: Vector) -> tuple[Vector, Vector]:
        if self.n_steps % 2:
            return MIRROR * state, MIRROR[:, None] * matrix
        return state, matrix


@dataclass(frozen=True)
class PassiveMap:
    """Steps of a passive walker from both feet on the floor."""

    walker: PassiveWalker
    n_steps: int = 1

    @cached_property
    def _body(self):
        return self.walker.moving_parameters.body()

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(field.name for field in PASSIVE_STATE_FIELDS)

    @property
    def free(self) -> list[int]:
        if self.walker.planar:
            return list(FORE_AFT)
        return list(range(1 if self.walker.parameters.slope_turns else 0, PASSIVE_STATE_SIZE))

    @property
    def parameters(self) -> tuple[str, ...]:
        return BODY_PARAMETERS

    def results(self, state: Vector) -> list[PassiveStep]:
        """The steps themselves, the feet alternating from the left one.

        Raises
        ------
        FellError
            If the walker falls.
        ValueError
            If no trailing foot can be on the floor.
        """
        results: list[PassiveStep] = []
        foot: Foot = "left"
        angle: float | None = None
        for k in range(self.n_steps):
            result = self.walker.step(state, stance=foot, inter_leg_angle=angle)
            if result.fall is not None:
                raise FellError(f"the walker fell {result.fall.value} in step {k + 1} of the gait")
            results.append(result)
            state, foot, angle = result.state, result.stance, result.inter_leg_angle
        return results

    def image(self, state: Vector) -> Vector:
        end = self.results(state)[-1].state
        return PASSIVE_MIRROR * end if self.n_steps % 2 else end

    def derivative(self, state: Vector) -> tuple[Vector, Vector]:
        return self._linearised(state)[:2]

    def sensitivity(self, state: Vector, parameter: str) -> tuple[Vector, Vector, Vector]:
        image, matrix, by_body = self._linearised(state)
        _require_parameter(parameter, self.parameters)
        return image, matrix, by_body[:, BODY_PARAMETERS.index(parameter)]

    def value(self, parameter: str) -> float:
        return getattr(self.walker.parameters, _require_parameter(parameter, self.parameters))

    def moved(self, parameter: str, value: float) -> PassiveMap:
        _require_parameter(parameter, self.parameters)
        changed = replace(self.walker.parameters, **{parameter: value})
        return replace(self, walker=replace(self.walker, parameters=changed))

    def over(self, n_steps: int) -> PassiveMap:
        return replace(self, n_steps=n_steps)

    def _linearised(self, state: Vector) -> tuple[Vector, Vector, Vector]:
        size = PASSIVE_STATE_SIZE
        matrix, by_body = np.eye(size), np.zeros((size, PASSIVE_INPUTS - size))
        rows, after = np.empty((size, PASSIVE_INPUTS)), np.empty(size)
        foot: Foot = "left"
        state = require_passive_state(state, planar=self.walker.planar)
        for k in range(self.n_steps):
            status = passive_jacobian(self._body, state, SIDE[foot], after, rows)
            raise_for_failure(status, state, self.walker.parameters)
            if status != STEPPED:
                fall = fall_of(status, after[1])
                how = f"fell {fall.value}" if fall else "has no trailing foot on the floor"
                raise FellError(f"the walker {how} in step {k + 1}")
            by_body = rows[:, :size] @ by_body + rows[:, size:]
            matrix = rows[:, :size] @ matrix
            state, foot = after.copy(), OTHER_FOOT[foot]
        if self.n_steps % 2:
            sign = PASSIVE_MIRROR[:, None]
            return PASSIVE_MIRROR * state, sign * matrix, sign * by_body
        return state, matrix, by_body


def section_map_of(
    walker: Walker | PassiveWalker,
    *,
    inter_leg_angle: float = INTER_LEG_ANGLE,
    mass_offset: float | tuple[float, float] = 0.0,
    n_steps: int | None = None,
) -> ActiveMap | PassiveMap:
    """A walker's section map, by default over the fewest steps that a simple gait repeats in.

    Raises
    ------
    ValueError
        If an argument is outside its range, or a passive walker is given a command.
    """
    if isinstance(walker, PassiveWalker):
        if inter_leg_angle != INTER_LEG_ANGLE or require_offsets(mass_offset) != (0.0, 0.0):
            raise ValueError(
                "a passive walker takes no inter_leg_angle and no mass_offset, "
                f"not {inter_leg_angle!r} and {mass_offset!r}"
            )
        return PassiveMap(walker, 1 if n_steps is None else n_steps)
    if not isinstance(walker, Walker):
        raise ValueError(f"walker must be a Walker or a PassiveWalker, not {walker!r}")
    offsets = require_offsets(mass_offset)
    angle = require_inter_leg_angle(inter_leg_angle)
    fewest = 1 if offsets[0] == -offsets[1] else 2
    return ActiveMap(walker, angle, offsets, fewest if n_steps is None else n_steps)


def _require_parameter(parameter: str, known: tuple[str, ...]) -> str:
    if parameter not in known:
        raise ValueError(f"parameter must be one of {', '.join(known)}; not {parameter!r}")
    return parameter


def require_left_state(section_map: ActiveMap | PassiveMap, state: Vector) -> Vector:
    """A section state of the map's own kind, or ``ValueError``."""
    if isinstance(section_map, PassiveMap):
        return require_passive_state(state, planar=section_map.walker.planar)
    return require_state(state)
