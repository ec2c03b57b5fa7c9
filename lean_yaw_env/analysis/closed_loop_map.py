"""A walker and its controller as one dynamical system: the section map of both together.

The state is all that the next step depends on: the section state, the mass offset in force, and what else an observation shows. Derivatives
are the exact ones of the walking step, composed with differences of the controller's commands: a learned policy computes in single
precision, in which a difference over a small step is noise. So multipliers come with bounds of their errors.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.analysis.active_map import completed_step, has_downhill, step_rows
from lean_yaw_env.analysis.fixed_point import solve_fixed_point
from lean_yaw_env.analysis.many_walks import walk_many
from lean_yaw_env.analysis.section_map import (
    BODY_PARAMETERS,
    FEET_IN_TURN,
    MOTIONS,
    CycleStep,
    Linearised,
    Motion,
    SectionMap,
    cycle_step,
)
from lean_yaw_env.analysis.step_derivatives import BY_BODY, BY_COMMAND, differentiate_step
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.kernel.jacobian import OUTPUTS
from lean_yaw_env.kernel.records import STEPPED, Command, Outcome
from lean_yaw_env.parameters import STATE_FIELDS, STATE_SIZE, Foot, Vector, require_state
from lean_yaw_env.validation import require_array, require_choice, require_count
from lean_yaw_env.walker import Walker

OFFSET, MEMORY = STATE_SIZE, STATE_SIZE + 1
"""Where a state holds the mass offset in force, and the first coordinate of what else it remembers."""
SETTLING_STEPS = 400
"""Walked from the start before Newton's method takes over; even, to end on the left foot."""

_TINY = 1e-30
_COARSEST, _SIZES = 0.25, 14
"""The largest step of differences, in units of the scales, and how many there are, each half the one before."""
_ROUNDING = 2.0**-24
"""Of a number between a half and one in single precision."""
_STATUS = Outcome._fields.index("status")
_OFFSET_OUT = Outcome._fields.index("mass_offset")

Numbers = NDArray[Any]
"""Real numbers, or complex ones whose imaginary parts carry a derivative."""
Predict = Callable[[NDArray[np.float32]], ArrayLike]
"""A controller: from observations (n, m) to actions (n, 2). It answers the same observation always the same."""


class ControlInterface(Protocol):
    """What stands between a walker and its controller: what is observed, what an action commands, and what is remembered.

    ``n`` walkers stand on the same foot; a state has ``k`` coordinates: the section state, the mass offset in force, and the remembered ones.

    Attributes
    ----------
    remembered : by name, the motion that each coordinate belongs to which a step leaves behind, beside section state and offset
    headings : names of the coordinates that make no difference where every heading is like any other
    scales : shape (k,)
        What an observation shows as a change of about one.
    reach : shape (2,)
        How far inter-leg angle and mass offset go.
    """

    remembered: Mapping[str, Motion]
    headings: tuple[str, ...]
    scales: Vector
    reach: Vector

    def observe(self, states: Vector, foot: Foot) -> NDArray[np.float32]:
        """Observations (n, m) of states (n, k)."""
        ...

    def command(self, states: Vector, foot: Foot, actions: NDArray[np.float32]) -> Vector:
        """Inter-leg angles and mass offsets (n, 2), in space, that actions (n, 2) in these states mean."""
        ...

    def remember(self, states: Numbers, outputs: Mapping[str, Numbers]) -> Numbers:
        """What steps leave behind, (n, len(remembered)).

        ``outputs`` holds arrays (n,) by the names of ``kernel.jacobian.OUTPUTS``. Both may be complex numbers, which carry derivatives.
        """
        ...


class Slopes(NamedTuple):
    """A function's ``values`` (m,) at a place, its ``slopes`` (m, k), and bounds of their ``errors`` (m, k)."""

    values: Vector
    slopes: Vector
    errors: Vector


def slopes_of(
    function: Callable[[Vector], Vector], place: Vector, scales: Vector, reach: Vector
) -> Slopes:
    """Derivatives of a function that computes in single precision, from places (n, k) to values (n, m), by central differences.

    Each derivative is extrapolated from two step sizes, at the size where those beside it agree best: larger ones see the function's curve
    and its limits, smaller ones its rounding, which is relative to ``reach`` (m,). How far they agree, and the rounding, is the error. A change
    by ``scales`` (k,) is one that the function sees as about one.
    """
    size = len(place)
    steps = _COARSEST * 0.5 ** np.arange(_SIZES)[:, None] * scales
    offsets = steps[:, :, None] * np.eye(size)  # (sizes, k, k)
    both = np.concatenate([offsets, -offsets]).reshape(-1, size)
    found = function(np.vstack([place, place + both]))
    sides = found[1:].reshape(2, _SIZES, size, len(reach))
    central = (sides[0] - sides[1]) / (2.0 * steps[:, :, None])
    better = (4.0 * central[1:] - central[:-1]) / 3.0
    apart = np.abs(np.diff(better, axis=0))
    spread = np.maximum(apart[:-1], apart[1:]) + _ROUNDING * reach / steps[2:-1, :, None]
    best = spread.argmin(axis=0)[None]
    slopes = np.take_along_axis(better[1:-1], best, axis=0)[0]
    errors = np.take_along_axis(spread, best, axis=0)[0]
    return Slopes(found[0], slopes.T, errors.T)


@dataclass(frozen=True)
class ClosedLoopMap(SectionMap):
    """Steps of a walker that a controller steers: ``predict`` maps observations (n, m) to actions (n, 2).

    ``start`` (k,) is a state on the left foot to walk from, where the gait is looked for. ``n_steps`` is even.
    """

    walker: Walker
    interface: ControlInterface
    predict: Predict
    start: Vector
    n_steps: int = 2

    is_threadsafe = False  # a controller need not be able to answer two questions at once
    precision = 1e-6  # actions are rounded to some 1e-8
    neutral_within = 1e-5
    zero_explanation = (
        "section, or memory: two legs at a fixed angle with both feet on the floor determine the stance pitch from the ankle angle, and what is "
        "left of an earlier offset or footprint is gone after the cycle"
    )

    def __post_init__(self) -> None:
        if require_count("n_steps", self.n_steps, 2) % 2:
            raise ValueError(f"n_steps must be even, got {self.n_steps}")
        object.__setattr__(self, "start", self.require_state(self.start))

    @property
    def names(self) -> tuple[str, ...]:
        return (*(each.name for each in STATE_FIELDS), "mass_offset", *self.interface.remembered)

    @property
    def motions(self) -> tuple[Motion, ...]:
        known: dict[str, Motion] = {**MOTIONS, **self.interface.remembered}
        return tuple(known[name] for name in self.names)

    @property
    def free(self) -> list[int]:
        alike = () if has_downhill(self.walker.parameters) else self.interface.headings
        return [k for k, name in enumerate(self.names) if name not in alike]

    @property
    def mirror(self) -> Vector:
        raise ValueError("a closed loop's steps have no mirror image: n_steps must be even")

    def require_state(self, state: ArrayLike) -> Vector:
        array = require_array("state", state, (len(self.names),))
        require_state(array[:STATE_SIZE])
        return array

    def results(self, state: Vector) -> list[CycleStep]:
        steps: list[CycleStep] = []
        for k in range(self.n_steps):
            foot = FEET_IN_TURN[k % 2]
            command = self._command(state, self.commands(state[None], foot)[0])
            result = completed_step(self.walker, state[:STATE_SIZE], foot, command, k)
            values = [*result.state, result.duration, *result.displacement, result.mass_offset, result.energy.shift_work]  # fmt: skip
            outputs = dict(zip(OUTPUTS, np.array(values)[:, None], strict=True))
            left = self.interface.remember(state[None], outputs)[0]
            after = np.concatenate([result.state, [result.mass_offset], left])
            steps.append(cycle_step(state, after, foot, command, result))
            state = after
        return steps

    def commands(self, states: Vector, foot: Foot) -> Vector:
        """Inter-leg angles and mass offsets (n, 2) that the controller commands in states (n, k).

        Raises
        ------
        ValueError
            If it answers with anything but finite numbers.
        """
        seen = self.interface.observe(states, foot)
        actions = np.asarray(self.predict(seen))
        require_array("predict's actions", actions, (len(states), 2))
        return self.interface.command(states, foot, actions)

    def slopes(self, state: Vector, foot: Foot) -> Slopes:
        """The commands in a state with their derivatives by it."""
        return slopes_of(
            lambda states: self.commands(states, foot), state, self.interface.scales, self.interface.reach
        )  # fmt: skip

    def linear_step(self, state: Vector, k: int, parameter: str | None) -> Linearised:
        foot = FEET_IN_TURN[k % 2]
        asked = self.slopes(state, foot)
        command = self._command(state, asked.values)
        inputs = BY_COMMAND if parameter is None else BY_BODY
        step = differentiate_step(self.walker, state[:STATE_SIZE], foot, command, inputs=inputs)
        # by the state, the two commands and the parameter
        size, wide = len(state), np.zeros((len(OUTPUTS), len(state) + 3))
        wide[:, :STATE_SIZE] = step.jacobian[:, :STATE_SIZE]
        wide[:, OFFSET] = step.jacobian[:, STATE_SIZE + 2]
        wide[:, size : size + 2] = step.jacobian[:, STATE_SIZE : STATE_SIZE + 2]
        if parameter is not None:
            require_choice("parameter", parameter, self.parameters)
            wide[:, size + 2] = step.jacobian[:, BY_COMMAND + BODY_PARAMETERS.index(parameter)]
        image, found = self._after(state, step.outputs, wide)
        by_command = found[:, size : size + 2]
        return Linearised(
            image,
            found[:, :size] + by_command @ asked.slopes,
            found[:, size + 2],
            np.abs(by_command) @ asked.errors,
        )

    def _after(self, state: Vector, outputs: Vector, wide: Vector) -> tuple[Vector, Vector]:
        """The state after a step with outputs (10,), and its derivatives (k, m) from those of the outputs (10, m)."""
        n = wide.shape[1]
        before = state + 1j * _TINY * np.eye(n, len(state))
        named: dict[str, Numbers] = dict(
            zip(OUTPUTS, outputs[:, None] + 1j * _TINY * wide, strict=True)
        )
        left = self.interface.remember(before, named)
        moved = np.column_stack(
            [*(named[each.name] for each in STATE_FIELDS), named["mass_offset"], left]
        )
        return np.real(moved[0]).copy(), np.imag(moved).T / _TINY

    def step_many(
        self, states: Vector, carried: Vector, foot: int
    ) -> tuple[Vector, Vector, Vector]:
        return self.step_commanded(states, carried, self.commands(states, FEET_IN_TURN[foot]), foot)

    def step_commanded(
        self, states: Vector, carried: Vector, commands: Vector, foot: int
    ) -> tuple[Vector, Vector, Vector]:
        whole = np.column_stack([commands, states[:, OFFSET]])
        rows = step_rows(self._bodies, whole, states[:, :STATE_SIZE], foot)
        after = states.copy()
        after[:, :STATE_SIZE], after[:, OFFSET] = rows[:, :STATE_SIZE], rows[:, _OFFSET_OUT]
        done = rows[:, _STATUS] == STEPPED
        named = {name: rows[done, Outcome._fields.index(name)] for name in OUTPUTS}
        after[done, MEMORY:] = self.interface.remember(states[done], named)
        return after, carried, rows[:, _STATUS]

    def search(self) -> Iterator[Vector]:
        """The gait that the controller keeps, stable or not: by walking from the start, and then by Newton's method."""
        tried: list[str] = []
        walk = walk_many(self, self.start[None], SETTLING_STEPS).require_solved()
        starts = {"the start": self.start}
        if walk.survived[0]:
            starts = {"where the walk settles": walk.states[0], **starts}
        else:
            tried.append("the walk falls")
        for name, start in starts.items():
            try:
                found = solve_fixed_point(self, start)
            except NoGaitError as error:
                tried.append(f"from {name}: {error}")
                continue
            yield found
            return
        raise NoGaitError(
            f"no gait of walker and controller repeats every {self.n_steps} steps; tried: {'; '.join(tried)}"
        )

    def question(self) -> dict[str, Any]:
        return {**super().question(), "controller": self._fingerprint}

    @cached_property
    def _bodies(self) -> Vector:
        return np.array([self.walker.parameters.body()])

    @cached_property
    def _fingerprint(self) -> str:
        """A digest of what the controller commands in some states around the start, which tells controllers apart."""
        places = np.random.default_rng(0).uniform(-1.0, 1.0, (64, len(self.start)))
        asked = self.commands(self.start + 0.3 * places * self.interface.scales, "left")
        return hashlib.sha256(asked.tobytes()).hexdigest()

    def _command(self, state: Vector, asked: Vector) -> Command:
        return Command(float(asked[0]), float(asked[1]), float(state[OFFSET]))
