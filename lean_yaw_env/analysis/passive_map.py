"""The passive walker's section map, and where its gaits are looked for: many starts in the plane, then the hip width raised."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

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
    require_no_command,
    section_map_of,
)
from lean_yaw_env.errors import FellError, LeanYawError, NoGaitError
from lean_yaw_env.kernel.passive import INPUTS, PassiveOutcome, passive_jacobian
from lean_yaw_env.kernel.records import STEPPED, Command
from lean_yaw_env.parameters import INTER_LEG_ANGLE, Vector, WalkerParameters
from lean_yaw_env.passive import (
    FORE_AFT,
    PASSIVE_MIRROR,
    PASSIVE_STATE_FIELDS,
    PASSIVE_STATE_SIZE,
    PassiveWalker,
    fall_of,
    require_passive_state,
    step_passive_rows,
)
from lean_yaw_env.validation import require_choice, require_count, require_instance
from lean_yaw_env.walker import SIDE, Walker, raise_for_failure, require_completed

if TYPE_CHECKING:
    from typing_extensions import Unpack

_PITCHES, _RATES = np.linspace(0.85, 1.35, 11), np.linspace(0.7, 1.1, 17)
"""Stance pitch over the scaling law's, and rate over pitch: 0.94 to 1.16 and 0.79 to 1.05 in the gaits of point feet and of radius 0.5."""
_SAME_GAIT = 1e-7
_LEAST_PITCH = 1e-3
"""A smaller step is the solution of not walking at all."""
_LONGEST_STEP = 2.0 * np.pi
"""The swing leg's free period: in a longer step it swings to and fro once more, or round."""

_STATUS = PassiveOutcome._fields.index("status")
_ANGLE = PassiveOutcome._fields.index("inter_leg_angle")
_NO_COMMAND = Command(INTER_LEG_ANGLE, 0.0, 0.0)
"""The stance leg does not feel the swing leg, wherever it is held."""


@dataclass(frozen=True)
class PassiveMap(SectionMap):
    """Steps of a passive walker from both feet on the floor."""

    walker: PassiveWalker
    n_steps: int = 1

    names = tuple(field.name for field in PASSIVE_STATE_FIELDS)
    mirror = PASSIVE_MIRROR
    carried = float("nan")  # the first step's swing leg starts where it is on the floor
    zero_explanation = (
        "swing rate: the swing foot's mass acts on nothing, and at heel strike the new swing foot's momentum follows from the stance leg's "
        "pose and rates, so that the state after a strike has one freedom less than the section"
    )

    def __post_init__(self) -> None:
        require_instance("walker", self.walker, PassiveWalker)
        require_count("n_steps", self.n_steps)

    @property
    def free(self) -> list[int]:
        if self.walker.planar:
            return list(FORE_AFT)
        return list(range(1 if self.walker.parameters.slope_turns else 0, PASSIVE_STATE_SIZE))

    @property
    def stander(self) -> Walker:
        return Walker(self.walker.moving_parameters)

    def require_state(self, state: ArrayLike) -> Vector:
        return require_passive_state(state, planar=self.walker.planar)

    def results(self, state: Vector) -> list[CycleStep]:
        """The steps themselves; ``ValueError`` if no trailing foot can be on the floor."""
        steps: list[CycleStep] = []
        angle: float | None = None
        for k in range(self.n_steps):
            foot = FEET_IN_TURN[k % 2]
            result = self.walker.step(state, stance=foot, inter_leg_angle=angle)
            require_completed(result, f"step {k + 1} of the gait")
            steps.append(cycle_step(state, result.state, foot, _NO_COMMAND, result))
            state, angle = result.state, result.inter_leg_angle
        return steps

    def linear_step(self, state: Vector, k: int, parameter: str | None) -> Linearised:
        size, side = PASSIVE_STATE_SIZE, SIDE[FEET_IN_TURN[k % 2]]
        rows, after = np.empty((size, INPUTS)), np.empty(size)
        status = passive_jacobian(self._body, state, side, after, rows)
        raise_for_failure(status, self._body, (np.nan,), state, side)
        if status != STEPPED:
            fall = fall_of(status, after[1])
            how = f"fell {fall.value}" if fall else "has no trailing foot on the floor"
            raise FellError(f"the walker {how} in step {k + 1}")
        by_parameter = np.zeros(size)
        if parameter is not None:
            require_choice("parameter", parameter, self.parameters)
            by_parameter = rows[:, size + BODY_PARAMETERS.index(parameter)]
        return Linearised(after, rows[:, :size], by_parameter, np.zeros((size, size)))

    def step_many(
        self, states: Vector, carried: Vector, foot: int
    ) -> tuple[Vector, Vector, Vector]:
        sides = np.full(len(states), 1.0 - 2.0 * foot)
        rows = step_passive_rows(self.walker, states, sides, carried)
        return rows[:, :PASSIVE_STATE_SIZE], rows[:, _ANGLE], rows[:, _STATUS]

    def search(self) -> Iterator[Vector]:
        """Section states of the symmetric gaits that were found, that of the longest period first."""
        found, reasons = False, set[str]()
        try:
            planar = self._planar_gaits()
        except NoGaitError as error:
            planar = ()
            reasons.add(str(error))
        for state in planar:
            try:
                yield self._widened(state)
                found = True
            except NoGaitError as error:
                reasons.add(f"from no hip width {error}")
        if not found:
            raise NoGaitError(
                f"no gait found for the passive walker of {self.walker.parameters}; tried: "
                f"{_PITCHES.size * _RATES.size} planar starts, following each gait from no hip "
                f"width; reasons: {'; '.join(sorted(reasons))}. Try a positive slope that is gentle (below 0.05), "
                "hips narrower than 0.1, or an ankle tilt near 0.15"
            )

    def main_gait(self) -> Vector:
        """The section state of the gait that the planar one of the longest period leads to, or ``NoGaitError``."""
        return self._widened(self._planar_gaits()[0])

    def question(self) -> dict[str, Any]:
        return {**super().question(), "planar": self.walker.planar}

    @cached_property
    def _body(self):
        return self.walker.moving_parameters.body()

    def _planar_gaits(self) -> tuple[Vector, ...]:
        """``planar_gaits`` of the walker, which depend on these parameters only."""
        names = ("foot_radius", "slope", "friction_limit", "max_step_duration")
        kept = {name: getattr(self.walker.parameters, name) for name in names}
        return planar_gaits(WalkerParameters(hip_width=0.0, **kept))

    def _widened(self, state: Vector) -> Vector:
        """Follow a planar gait to the walker's hip width."""
        width = 0.0 if self.walker.planar else self.value("hip_width")
        if width == 0.0:
            return state.copy()

        def path(share: float) -> PassiveMap:
            return PassiveMap(self.walker).moved("hip_width", share * width)

        return follow_fixed_point(path, state, side=side_of_folds(path(0.0), state))


@section_map_of.register(PassiveWalker)
def _(walker: PassiveWalker, **command: Unpack[CommandArguments]) -> PassiveMap:
    require_no_command("a passive walker", **command)
    return PassiveMap(walker)


@lru_cache(maxsize=4096)
def planar_gaits(parameters: WalkerParameters) -> tuple[Vector, ...]:
    """Section states of the planar walker's symmetric gaits that many starts lead to, that of the longest period first.

    Usually there are two. Those whose swing leg swings to and fro once more within a step are left out.

    Raises
    ------
    NoGaitError
        If there is none; says why.
    """
    section_map = PassiveMap(PassiveWalker(parameters, planar=True))
    found: list[tuple[float, Vector]] = []
    reasons: set[str] = set()
    for start in _planar_starts(parameters):
        try:
            state = solve_fixed_point(section_map, start)
            duration = section_map.over(2).results(state)[0].duration
        except (LeanYawError, ValueError) as error:
            reasons.add(str(error))
            continue
        is_new = all(np.abs(state - other).max() > _SAME_GAIT for _, other in found)
        if is_new and state[1] > _LEAST_PITCH and duration < _LONGEST_STEP:
            found.append((duration, state))
    if not found:
        raise NoGaitError("; ".join(sorted(reasons)[:4]) or "the slope gives no energy")
    return tuple(state for _, state in sorted(found, key=lambda pair: -pair[0]))


def _planar_starts(parameters: WalkerParameters) -> list[Vector]:
    """Guesses of the planar gait, from Garcia's scaling law carried to round feet; empty uphill."""
    slope, radius = parameters.slope, parameters.foot_radius
    if slope <= 0.0:
        return []
    scale = (slope / (1.0 - radius) ** 2) ** (1.0 / 3.0)
    starts = []
    for pitch in scale * _PITCHES:
        for rate in -pitch * _RATES:
            # momentum kept by the trailing foot: exact for point feet, halved for radius 0.5
            swing = -(1.0 - radius) * rate * (1.0 - np.cos(2.0 * pitch))
            starts.append(np.array([0.0, pitch, 0.0, rate, 0.0, swing]))
    return starts
