"""Which states can still be saved, in how many steps, and by which commands: N-step capturability, by exhaustive search.

A state is captured in N steps if N chosen commands, one for each step, bring the walker to where a nominal controller then walks on without a
fall. Sets that are computed backwards on a grid of states are not exact near their borders. So the search goes forward, from every state
through every sequence of commands, and is exact but for the resolution of the commands. The term is that of Koolen et al. (2012), "Capturability-
based analysis and control of legged locomotion", where the walker comes to a stop; here it comes back to walking.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.analysis.attraction import require_centre, require_plane, states_in
from lean_yaw_env.analysis.filling import Arrays, Box, Columns, Layout, fill_grid, write_box
from lean_yaw_env.analysis.limit_cycle import find_limit_cycle
from lean_yaw_env.analysis.many_walks import raise_for_failures, walk_many
from lean_yaw_env.analysis.section_map import (
    CommandArguments,
    SectionMap,
    WalkerOrMap,
    section_map_of,
)
from lean_yaw_env.engine import ONE_THREAD, Engine
from lean_yaw_env.kernel.records import STEPPED
from lean_yaw_env.parameters import Vector, require_inter_leg_angle, require_mass_offset
from lean_yaw_env.threads import MOST_THREADS, share_out
from lean_yaw_env.validation import (
    require_count,
    require_instance,
    require_mapping,
    require_number,
    require_shape,
    require_vector,
)

if TYPE_CHECKING:
    import xarray
    from typing_extensions import Unpack

MOST_STEPS = 4
"""More chosen steps than these take too long: each multiplies the work by the number of commands."""
_FIRST = ("inter_leg_angle", "mass_offset")
"""Columns of a plan's first command."""
_REGION = 2048
"""Most states of a region of a map: each takes some thousand walks, and many more where two steps are chosen."""
_CHUNK = 512
"""States at a time, so that memory does not grow with their number."""
_LEAVES = 65_536
"""Walks at a time that follow the last chosen step."""


@dataclass(frozen=True)
class Choices:
    """Commands to choose from at every step: each inter-leg angle with each mass offset.

    Attributes
    ----------
    inter_leg_angles : shape (m,)
        In (0, pi/2), growing.
    mass_offsets : shape (k,)
        In [-1, 1], growing, and the same to both sides: what one foot may do, the other may.
    largest_change : float >= 0
        By how much an offset may differ from the one in force; one that is farther away is commanded as far as that.
    """

    inter_leg_angles: Vector = field(default_factory=lambda: np.linspace(0.15, 0.45, 7))
    mass_offsets: Vector = field(default_factory=lambda: np.linspace(-0.05, 0.05, 5))
    largest_change: float = float("inf")

    def __post_init__(self) -> None:
        for name, require in (
            ("inter_leg_angles", require_inter_leg_angle),
            ("mass_offsets", lambda offset: require_mass_offset(offset, "mass_offsets")),
        ):
            values = require_vector(name, getattr(self, name))
            for value in values.tolist():
                require(value)
            if np.any(np.diff(values) <= 0.0):
                raise ValueError(f"{name} must be growing numbers, got {values.tolist()}")
            object.__setattr__(self, name, values)
        if not np.allclose(self.mass_offsets, -self.mass_offsets[::-1], atol=1e-12):
            raise ValueError(
                f"mass_offsets must be the same to both sides, got {self.mass_offsets.tolist()}"
            )
        require_number("largest_change", self.largest_change, 0.0, float("inf"))

    @property
    def commands(self) -> Vector:
        """All commands (m k, 2) of a step on the left foot, the gentlest first: by their distance from the middle one.

        Both ranges count as one there. Of two as near, an offset away from the stance foot comes first. On the right foot offsets are opposite.
        """
        angles, offsets = self.inter_leg_angles, self.mass_offsets
        both = np.array([(angle, offset) for angle in angles for offset in offsets])
        middle = np.array([0.5 * (angles[0] + angles[-1]), 0.0])
        reach = np.array([np.ptp(angles), np.ptp(offsets)])
        away = (both - middle) / np.where(reach > 0.0, reach, 1.0)
        return both[np.lexsort((-both[:, 1], np.hypot(*away.T).round(9)))]

    def finer(self) -> Choices:
        """Commands twice as close, these among them."""
        angles, offsets = (
            np.insert(each, np.arange(1, each.size), 0.5 * (each[:-1] + each[1:]))
            for each in (self.inter_leg_angles, self.mass_offsets)
        )
        return replace(self, inter_leg_angles=angles, mass_offsets=offsets)


ALL_ACTIONS = Choices()
"""What an action of the environments can command."""


@dataclass(frozen=True)
class Capture:
    """How ``n`` states can be saved in at most ``N`` chosen steps.

    Attributes
    ----------
    least_steps : shape (n,)
        Least number of chosen steps after which the nominal controller walks on: 0 where it needs no help, N + 1 where no choice saves the state.
    plans : shape (n, N, 2)
        Inter-leg angle and mass offset, in space, of each of those steps; of several plans the one whose first command is the gentlest,
        then the second one, and so on. nan after them.
    """

    least_steps: NDArray[np.int64]
    plans: Vector

    def share(self, n_steps: int) -> float:
        """The share of the states that so many chosen steps save, or fewer."""
        return float((self.least_steps <= n_steps).mean())


def capture(
    walker: WalkerOrMap,
    states: Vector,
    choices: Choices = ALL_ACTIONS,
    *,
    most_steps: int = 2,
    settle_steps: int = 60,
    threads: int = 1,
    known: Capture | None = None,
    **command: Unpack[CommandArguments],
) -> Capture:
    """Find how few chosen steps save each state, by trying every sequence of commands.

    Parameters
    ----------
    walker : Walker or SectionMap
        The nominal controller with its walker: a constant command, or a map of a walker that a controller steers, such as ``ClosedLoopMap``.
    states : shape (n, k)
        On the left foot.
    choices : Choices
        Commands to choose from.
    most_steps : int from 0 to 4
    settle_steps : int >= 1
        What the nominal controller must walk after the chosen steps.
    threads : int >= 1
        Of a constant command only: other controllers need not be able to answer two questions at once.
    known : Capture, optional
        What was found with coarser choices, all of which are among these, and as many ``most_steps``; only fewer steps are looked for.
    inter_leg_angle, mass_offset : see ``find_limit_cycle``

    Raises
    ------
    ValueError
        If an argument is outside its range.
    SolverError
        If the integrator fails.
    """
    section_map = section_map_of(walker, **command)
    _require_search(choices, most_steps, settle_steps, threads)
    states = require_shape("states", states, (None, len(section_map.names)))
    size = (len(states), most_steps, 2)
    if known is not None and require_instance("known", known, Capture).plans.shape != size:
        raise ValueError(f"known must be of the same states and most_steps, got {known!r}")
    search = _Search(section_map, choices, choices.commands, settle_steps)
    least = np.full(len(states), most_steps + 1)
    plans = np.full(size, np.nan)
    if known is not None:
        least[:], plans[:] = known.least_steps, known.plans
    carried = np.full(len(states), section_map.carried)
    for n in range(0 if known is None else 1, most_steps + 1):
        waiting = np.flatnonzero(least > n)

        def work(first: int, last: int, n: int = n, waiting: NDArray[np.intp] = waiting) -> None:
            for start in range(first, last, _CHUNK):
                some = waiting[start : min(start + _CHUNK, last)]
                saved, found = search.saved(states[some], carried[some], 0, n)
                least[some[saved]] = n
                plans[some[saved], :n], plans[some[saved], n:] = found[saved], np.nan

        share_out(work, waiting.size, threads if section_map.is_threadsafe else 1)
    return Capture(least, plans)


def _require_search(choices: Choices, most_steps: int, settle_steps: int, threads: int) -> None:
    """Raise ``ValueError`` for an argument of ``capture`` and ``capture_map`` that is outside its range."""
    require_instance("choices", choices, Choices)
    require_count("most_steps", most_steps, 0, MOST_STEPS)
    require_count("settle_steps", settle_steps, 1, 1_000_000)
    require_count("threads", threads, 1, MOST_THREADS)


@dataclass(frozen=True)
class _Search:
    """Every sequence of commands that are followed by the nominal controller."""

    section_map: SectionMap
    choices: Choices
    commands: Vector
    settle_steps: int

    def saved(
        self, states: Vector, carried: Vector, foot: int, n: int
    ) -> tuple[NDArray[np.bool_], Vector]:
        """Which of states (m, k) exactly n chosen steps save, and the first plans (m, n, 2) that do."""
        plans = np.full((len(states), n, 2), np.nan)
        if n == 0:
            walks = walk_many(
                self.section_map, states, self.settle_steps, foot=foot, carried=carried
            )
            return walks.require_solved().survived, plans
        # one command for many states at a time or, before the last of them, all commands for some states
        at_once = len(self.commands) if n == 1 else 1
        block = max(1, _LEAVES // at_once)
        saved = np.zeros(len(states), dtype=bool)
        for first in range(0, len(states), block):
            for k in range(0, len(self.commands), at_once):
                waiting = first + np.flatnonzero(~saved[first : first + block])
                if waiting.size:
                    won, found = self._try(states, carried, waiting, foot, n, slice(k, k + at_once))
                    saved[waiting[won]], plans[waiting[won]] = True, found
        return saved, plans

    def _try(
        self,
        states: Vector,
        carried: Vector,
        who: NDArray[np.intp],
        foot: int,
        n: int,
        tried: slice,
    ) -> tuple[NDArray[np.bool_], Vector]:
        """Which of m states some first commands can save, and the first plans that do, of those states alone."""
        commands = self.commands[tried]
        parents = np.repeat(who, len(commands))
        asked = np.tile(commands, (who.size, 1))
        asked[:, 1] *= 1.0 - 2.0 * foot
        names = self.section_map.names
        in_force = states[:, names.index("mass_offset")] if "mass_offset" in names else carried
        change, now = self.choices.largest_change, in_force[parents]
        asked[:, 1] = np.clip(asked[:, 1], now - change, now + change)
        starts = states[parents]
        after, left, status = self.section_map.step_commanded(starts, carried[parents], asked, foot)
        raise_for_failures(status, starts)
        done = np.flatnonzero(status == STEPPED)
        won, rest = self.saved(after[done], left[done], 1 - foot, n - 1)
        is_saved = np.zeros((who.size, len(commands)), dtype=bool)
        is_saved.ravel()[done[won]] = True
        plans = np.full((parents.size, n, 2), np.nan)
        plans[:, 0], plans[done, 1:] = asked, rest
        first, saved = is_saved.argmax(axis=1), np.asarray(is_saved.any(axis=1))
        return saved, plans.reshape(who.size, len(commands), n, 2)[saved, first[saved]]


def refine_capture(
    walker: WalkerOrMap,
    states: Vector,
    choices: Choices = ALL_ACTIONS,
    *,
    tolerance: float = 0.01,
    most_levels: int = 3,
    most_steps: int = 2,
    settle_steps: int = 60,
    threads: int = 1,
    **command: Unpack[CommandArguments],
) -> list[tuple[Choices, Capture]]:
    """Search with ever finer commands until no set of saved states grows by more than a share of all states.

    Parameters
    ----------
    walker, states, most_steps, settle_steps, threads, inter_leg_angle, mass_offset : see ``capture``
    choices : Choices
        The coarsest.
    tolerance : float in [0, 1]
        Largest growth of a set, as a share of the states, that still counts as none.
    most_levels : int >= 1
        Each is twice as fine as the one before.

    Returns
    -------
    The choices and what they save, level by level; the sets have stopped growing unless there are ``most_levels``.
    """
    require_number("tolerance", tolerance, 0.0, 1.0)
    require_count("most_levels", most_levels, 1, 6)
    levels: list[tuple[Choices, Capture]] = []
    known = None
    for _ in range(most_levels):
        found = capture(
            walker, states, choices, most_steps=most_steps, settle_steps=settle_steps, threads=threads, known=known, **command
        )  # fmt: skip
        levels.append((choices, found))
        sizes = range(most_steps + 1)
        if known and max(found.share(n) - known.share(n) for n in sizes) <= tolerance:
            break
        choices, known = choices.finer(), found
    return levels


def capture_map(
    walker: WalkerOrMap,
    axes: Mapping[str, Sequence[float] | Vector],
    choices: Choices = ALL_ACTIONS,
    *,
    centre: Vector | None = None,
    most_steps: int = 2,
    settle_steps: int = 60,
    path: str | Path | None = None,
    engine: Engine = ONE_THREAD,
    progress: bool = False,
    **command: Unpack[CommandArguments],
) -> xarray.Dataset:
    """Find how few chosen steps save each state of a slice or box of the section.

    Parameters
    ----------
    walker, choices, most_steps, settle_steps, inter_leg_angle, mass_offset : see ``capture``
    axes : one or more coordinates of the state, each with its values
    centre : shape (k,), optional
        A state that holds the other coordinates; by default the gait's.
    path, engine, progress : see ``fill_grid``
        Called again with the same path, an interrupted map goes on where it was.

    Returns
    -------
    xarray.Dataset
        Over the axes: ``least_steps`` (``most_steps`` + 1 where nothing saves the state), and the first command of a plan in
        ``inter_leg_angle`` and ``mass_offset``, nan where none is needed or none saves.

    Raises
    ------
    ValueError
        If an argument is outside its range, or the store holds another map.
    NoGaitError
        If there is no gait.
    SolverError
        If the integrator fails.
    """
    section_map = section_map_of(walker, **command)
    _require_search(choices, most_steps, settle_steps, 1)
    if not require_mapping("axes", axes):
        raise ValueError(f"axes must name one or more coordinates, got {axes!r}")
    if centre is None:
        middle = find_limit_cycle(section_map).state
    else:
        middle = require_centre(section_map, centre)
    search = _Captures(section_map, require_plane(section_map, axes), middle, choices, most_steps, settle_steps)  # fmt: skip
    columns = {"least_steps": np.full(1, -1.0), **{name: np.full(1, np.nan) for name in _FIRST}}
    question = {
        **section_map.question(), "inter_leg_angles": choices.inter_leg_angles.tolist(), "mass_offsets": choices.mass_offsets.tolist(),
        "largest_change": choices.largest_change, "most_steps": most_steps, "settle_steps": settle_steps,
    }  # fmt: skip
    named = dict(zip(section_map.names, middle.round(12).tolist(), strict=True))
    attrs = {"centre": json.dumps(named)}
    layout = Layout(
        "capturability", search.axes, columns, question, _REGION, attrs=attrs, is_threadsafe=section_map.is_threadsafe
    )  # fmt: skip
    return fill_grid(layout, search, path, engine, progress)


@dataclass(frozen=True)
class _Captures:
    """Searches from the states of a region."""

    section_map: SectionMap
    axes: dict[str, Vector]
    centre: Vector
    choices: Choices
    most_steps: int
    settle_steps: int

    def __call__(self, arrays: Arrays, region: Box, number: int) -> int:
        states = states_in(self.section_map, self.axes, region, self.centre)
        found = capture(
            self.section_map, states, self.choices, most_steps=self.most_steps, settle_steps=self.settle_steps
        )  # fmt: skip
        columns: Columns = {"least_steps": found.least_steps}
        if self.most_steps:
            columns.update(zip(_FIRST, found.plans[:, 0].T, strict=True))
        write_box(arrays, region, columns)
        return 0
