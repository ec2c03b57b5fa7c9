"""The active walker's section map at a constant command, and where its gaits are looked for."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from lean_yaw_env.analysis.fixed_point import follow_fixed_point, side_of_folds, solve_fixed_point
from lean_yaw_env.analysis.section_map import (
    BODY_PARAMETERS,
    FEET_IN_TURN,
    CommandArguments,
    CycleStep,
    Linearised,
    SectionMap,
    cycle_step,
    require_offsets,
    section_map_of,
)
from lean_yaw_env.analysis.step_derivatives import BY_BODY, BY_STATE, differentiate_step
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.kernel.batch import step_batch
from lean_yaw_env.kernel.jacobian import INPUTS
from lean_yaw_env.kernel.records import Command, Outcome
from lean_yaw_env.parameters import (
    INTER_LEG_ANGLE,
    MIRROR,
    STATE_FIELDS,
    STATE_SIZE,
    Foot,
    Vector,
    WalkerParameters,
    require_inter_leg_angle,
    require_state,
)
from lean_yaw_env.validation import require_choice, require_count, require_finite, require_instance
from lean_yaw_env.walker import Fall, StepResult, Walker, require_completed

if TYPE_CHECKING:
    from typing_extensions import Self, Unpack

COMMAND_PARAMETERS = ("inter_leg_angle", "mass_offset", "alternating_offset")
"""Parameters of the active walker only.

``mass_offset`` is the mean of both feet's offsets, ``alternating_offset`` what the left foot's has more than that: positive moves the
masses away from the stance foot.
"""

_ARRIVED = 1e-9
_HELPING_SLOPES = (0.01, 0.02)
"""Where to start from a gait that a slope drives, on the way to one that pumping drives."""
_STATUS = Outcome._fields.index("status")
_OFFSET = Outcome._fields.index("mass_offset")

Path: TypeAlias = "Callable[[float], ActiveMap]"
"""Maps from a simpler one at 0 to the wanted one at 1."""


@dataclass(frozen=True)
class ActiveMap(SectionMap):
    """Steps of the active walker at a constant inter-leg angle, with an offset for each foot.

    Attributes
    ----------
    mass_offset : (float, float)
        In force while the left and while the right foot stands; the masses move from the one to the other at the start of each step.
    n_steps : int
        An odd number needs opposite offsets, which are each other's mirror image.
    """

    walker: Walker
    inter_leg_angle: float = INTER_LEG_ANGLE
    mass_offset: tuple[float, float] = (0.0, 0.0)
    n_steps: int = 2

    parameters = BODY_PARAMETERS + COMMAND_PARAMETERS
    names = tuple(field.name for field in STATE_FIELDS)
    mirror = MIRROR
    zero_explanation = (
        "section: the swing leg is held at a fixed angle, and two legs at a fixed angle with both feet on the floor determine the stance pitch "
        "from the ankle angle, so that the state after a strike has one freedom less than the section"
    )

    def __post_init__(self) -> None:
        require_instance("walker", self.walker, Walker)
        require_inter_leg_angle(self.inter_leg_angle)
        require_offsets(self.mass_offset)
        require_count("n_steps", self.n_steps)
        if self.n_steps % 2 and not self.is_symmetric:
            raise ValueError(
                "an odd number of steps needs mass offsets that are opposite for the two feet, "
                f"got {self.mass_offset}"
            )

    @property
    def is_symmetric(self) -> bool:
        """Whether a step on the right foot is the mirror image of one on the left."""
        return self.mass_offset[0] == -self.mass_offset[1]

    @property
    def free(self) -> list[int]:
        return [0, 1, 2, 3, 4] if has_downhill(self.walker.parameters) else [1, 2, 3, 4]

    @property
    def carried(self) -> float:
        """The offset that the step before has left."""
        return self.mass_offset[1]

    def require_state(self, state: ArrayLike) -> Vector:
        return require_state(state)

    def results(self, state: Vector) -> list[CycleStep]:
        """The steps themselves; ``NoGaitError`` if a heel strike comes before the masses have arrived at their offset."""
        steps: list[CycleStep] = []
        for k in range(self.n_steps):
            command, foot = self._command(k), FEET_IN_TURN[k % 2]
            result = completed_step(self.walker, state, foot, command, k)
            if abs(result.mass_offset - command[1]) > _ARRIVED:
                raise NoGaitError(
                    f"the heel strike after {result.duration:.3f} comes before the masses have "
                    f"moved to {command[1]:g}; a shorter shift_time lets them arrive"
                )
            steps.append(cycle_step(state, result.state, foot, command, result))
            state = result.state
        return steps

    def linear_step(self, state: Vector, k: int, parameter: str | None) -> Linearised:
        inputs = BY_STATE if parameter is None else BY_BODY
        foot, command = FEET_IN_TURN[k % 2], self._command(k)
        step = differentiate_step(self.walker, state, foot, command, inputs=inputs)
        by_parameter, exact = np.zeros(STATE_SIZE), np.zeros((STATE_SIZE, STATE_SIZE))
        if parameter is not None:
            by_inputs = step.jacobian[:STATE_SIZE, STATE_SIZE:]
            by_parameter = by_inputs @ self._direction(parameter, k)
        return Linearised(step.state, step.by_state, by_parameter, exact)

    def step_many(
        self, states: Vector, carried: Vector, foot: int
    ) -> tuple[Vector, Vector, Vector]:
        command = np.array([[self.inter_leg_angle, self.mass_offset[foot]]])
        return self.step_commanded(states, carried, command, foot)

    def step_commanded(
        self, states: Vector, carried: Vector, commands: Vector, foot: int
    ) -> tuple[Vector, Vector, Vector]:
        whole = np.column_stack([np.broadcast_to(commands, (len(states), 2)), carried])
        rows = step_rows(self._bodies, whole, states, foot)
        return rows[:, :STATE_SIZE], rows[:, _OFFSET], rows[:, _STATUS]

    def search(self) -> Iterator[Vector]:
        yield search_active(self, exact=True)

    def value(self, parameter: str) -> float:
        require_choice("parameter", parameter, self.parameters)
        left, right = self.mass_offset
        commands = {
            "inter_leg_angle": self.inter_leg_angle,
            "mass_offset": 0.5 * (left + right),
            "alternating_offset": 0.5 * (left - right),
        }
        return commands[parameter] if parameter in commands else super().value(parameter)

    def moved(self, parameter: str, value: float) -> Self:
        if not isinstance(parameter, str) or parameter not in COMMAND_PARAMETERS:
            return super().moved(parameter, value)
        commands = {name: self.value(name) for name in COMMAND_PARAMETERS}
        angle, mean, apart = {**commands, parameter: value}.values()
        return replace(self, inter_leg_angle=angle, mass_offset=(mean + apart, mean - apart))

    def along(self, parameter: str) -> Self:
        require_choice("parameter", parameter, self.parameters)
        # the same offset for both feet, but for none, is no mirror image of itself
        return self.over(2) if parameter == "mass_offset" and self.n_steps == 1 else self

    def question(self) -> dict[str, Any]:
        command = [self.inter_leg_angle, *self.mass_offset]
        return {**super().question(), "command": command}

    @cached_property
    def _bodies(self) -> Vector:
        return np.array([self.walker.parameters.body()])

    def _command(self, k: int) -> Command:
        return Command(self.inter_leg_angle, self.mass_offset[k % 2], self.mass_offset[(k + 1) % 2])

    def _direction(self, parameter: str, k: int) -> Vector:
        """How a parameter enters the inputs of step ``k`` after the state: the command, then the body."""
        require_choice("parameter", parameter, self.parameters)
        sign = 1.0 if k % 2 == 0 else -1.0
        shares = {"mass_offset": {"mass_offset": 1.0, "previous_offset": 1.0},
                  "alternating_offset": {"mass_offset": sign, "previous_offset": -sign}}.get(parameter, {parameter: 1.0})  # fmt: skip
        return np.array([shares.get(name, 0.0) for name in INPUTS[STATE_SIZE:]])


def has_downhill(parameters: WalkerParameters) -> bool:
    """Whether headings differ: not on the level, nor where the slope turns with the walker."""
    return parameters.slope != 0.0 and not parameters.slope_turns


def completed_step(
    walker: Walker, state: Vector, foot: Foot, command: Command, k: int
) -> StepResult:
    """Step ``k`` of a gait, or ``FellError``."""
    result = walker.step(state, stance=foot, **command._asdict())
    return require_completed(result, f"step {k + 1} of the gait")


def step_rows(bodies: Vector, commands: Vector, states: Vector, foot: int) -> Vector:
    """Step many walkers on the left (0) or right (1) foot, unchecked; rows (n, 18) in the order of ``kernel.records.Outcome``."""
    rows = np.empty((len(states), len(Outcome._fields)))
    sides = np.full(len(states), 1.0 - 2.0 * foot)
    step_batch(bodies, commands, np.ascontiguousarray(states), sides, rows, 0, len(states))
    return rows


@section_map_of.register(Walker)
def _(walker: Walker, **command: Unpack[CommandArguments]) -> ActiveMap:
    offsets = require_offsets(command.get("mass_offset", 0.0))
    angle = command.get("inter_leg_angle", INTER_LEG_ANGLE)
    return ActiveMap(walker, angle, offsets, 1 if offsets[0] == -offsets[1] else 2)


def planar_gait_rate(walker: Walker, inter_leg_angle: float, heading: float = 0.0) -> float:
    """Stance pitch rate just after heel strike of the planar active walker, in closed form.

    Without hip width, one step multiplies the squared rate by k^2, k the planar impact's ratio, after gravity has added the slope's work.
    Returns nan where the slope gives no energy, or no impact takes any.
    """
    require_finite("heading", heading)
    require_inter_leg_angle(inter_leg_angle)
    parameters = require_instance("walker", walker, Walker).parameters
    return planar_rate(parameters.foot_radius, parameters.slope, inter_leg_angle, heading)


def planar_rate(foot_radius: float, slope: float, inter_leg_angle: float, heading: float) -> float:
    """``planar_gait_rate`` of a walker given by its numbers."""
    half = 0.5 * inter_leg_angle
    level = foot_radius + (1.0 - foot_radius) * math.cos(half)
    lift = (1.0 - foot_radius) * math.sin(half)
    inertia = level**2 + lift**2
    kept = (level**2 - lift**2) / inertia
    step_length = 2.0 * (foot_radius * half + lift)
    gained = 2.0 * step_length * math.sin(slope) * math.cos(heading) / inertia
    if gained <= 0.0 or kept**2 >= 1.0:
        return math.nan
    return -math.sqrt(gained * kept**2 / (1.0 - kept**2))


def search_active(section_map: ActiveMap, *, exact: bool) -> Vector:
    """The state of the gait: solved from the planar gait's closed form; failing that, followed from a simpler one.

    Where a fast and a slow gait exist, which meet at a fold, it is the one that the planar gait leads to. Without the Jacobian (not ``exact``,
    see ``solve_fixed_point``) the two gaits are not told apart.

    Raises
    ------
    NoGaitError
        If no gait was found; says what was tried.
    """
    tried: list[str] = []
    ways: dict[str, Callable[[], Vector]] = {}
    try:
        guess = _planar_guess(section_map)
        path = _raising(section_map, "hip_width", 0.0)
        planar = _planar_guess(path(0.0))
        ways["from the planar gait"] = lambda: _solved(section_map, guess, path, planar, exact)
        ways["following the gait from no hip width and no offset"] = lambda: follow_fixed_point(
            path, planar, exact=exact
        )
    except NoGaitError as error:
        tried.append(str(error))
    if section_map.value("alternating_offset") != 0.0:
        for slope in _HELPING_SLOPES:
            name = f"following the gait from slope {slope:g} without pumping"
            ways[name] = partial(_pumped, section_map, slope, exact)
    for name, way in ways.items():
        try:
            return way()
        except NoGaitError as error:
            tried.append(f"{name}: {error}")
    left, right = section_map.mass_offset
    offsets = f"{left:g}" if left == right else f"({left:g}, {right:g})"
    raise NoGaitError(
        f"no gait found for {section_map.walker.parameters} with inter-leg angle "
        f"{section_map.inter_leg_angle:g} and mass offset {offsets}; tried: {'; '.join(tried)}. "
        f"{_advice(section_map, tried)}"
    )


def _advice(section_map: ActiveMap, tried: list[str]) -> str:
    """What to change where no gait was found."""
    if any(Fall.LIFT_OFF.value in each for each in tried):
        return "Try a gentler slope, smaller feet or a smaller inter-leg angle: so fast, the foot lifts off"
    slope, offset = section_map.value("slope"), section_map.value("mass_offset")
    if slope <= 0.0 and section_map.value("alternating_offset") == 0.0:
        return "Try a positive slope, or pump: an alternating offset near 0.03 drives the walker"
    most = math.tan(slope)
    if abs(offset) >= most > 0.0 and not section_map.walker.parameters.slope_turns:
        return f"Try a mass offset well within ±{most:.3g}, the most that this slope can balance, or a steeper slope"
    return "Try a steeper slope, a smaller inter-leg angle or mass offset, narrower hips, or an ankle tilt near 0.5"


def _planar_guess(section_map: ActiveMap) -> Vector:
    heading, offset = 0.0, section_map.value("mass_offset")
    parameters = section_map.walker.parameters
    if offset != 0.0 and not parameters.slope_turns:
        sine = -offset / math.tan(parameters.slope or math.inf)
        heading = math.asin(sine) if abs(sine) < 1.0 else math.nan
    rate = planar_rate(
        parameters.foot_radius, parameters.slope, section_map.inter_leg_angle, heading
    )
    if math.isnan(rate):
        raise NoGaitError(
            "the planar gait has no closed form here: the slope gives no energy along any heading "
            "that balances the offset"
        )
    return np.array([heading, 0.5 * section_map.inter_leg_angle, 0.0, rate, 0.0])


def _solved(
    section_map: ActiveMap, guess: Vector, path: Path, planar: Vector, exact: bool
) -> Vector:
    """Solve at once; a gait past a fold only counts where none on the planar gait's side can be followed."""
    state = solve_fixed_point(section_map, guess, exact=exact)
    if exact and side_of_folds(section_map, state) != (side := side_of_folds(path(0.0), planar)):
        with suppress(NoGaitError):
            return follow_fixed_point(path, planar, side=side)
    return state


def _pumped(section_map: ActiveMap, slope: float, exact: bool) -> Vector:
    """Followed from a slope that drives the gait without pumping."""
    path = _raising(section_map, "slope", slope)
    return follow_fixed_point(path, search_active(path(0.0), exact=exact), exact=exact)


def _raising(section_map: ActiveMap, parameter: str, start: float) -> Path:
    """The path on which the offsets grow from zero as a parameter goes from a start to the map's own value."""
    target, (left, right) = section_map.value(parameter), section_map.mass_offset

    def path(share: float) -> ActiveMap:
        moved = section_map.moved(parameter, start + share * (target - start))
        return replace(moved, mass_offset=(share * left, share * right))

    return path
