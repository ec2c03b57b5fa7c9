"""What is found of walkers and agents as closed loops: gait, eigenvalues, basins of attraction, largest pushes survived, forces and work."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from lean_yaw_env.analysis import (
    ClosedLoopMap,
    LargestPushes,
    LimitCycle,
    Mode,
    basin,
    find_limit_cycle,
    largest_pushes,
    modes,
)
from lean_yaw_env.analysis.many_walks import walk_many
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.errors import LeanYawError, NoGaitError
from lean_yaw_env.parameters import Vector
from lean_yaw_env.validation import require_count

from ..agent import Agent
from ..registry import AgentRequest, env_id_of, make_agent
from .closed_loop_interface import closed_loop

if TYPE_CHECKING:
    import xarray

STEPS = 100
"""Walked by what counts as survived: a fall for lack of balance comes within some ten."""
PLANES = (("ankle_angle", "ankle_rate"), ("stance_pitch_rate", "ankle_rate"))
"""Planes of the section in which basins are drawn."""
REACHES = {"ankle_angle": 0.3, "stance_pitch_rate": 0.4, "ankle_rate": 0.8}
"""How far from the start the planes and the box reach, rad and rad / time unit."""
ZERO = 1e-3
"""A multiplier below this is as good as zero: what it multiplies is gone within a stride."""
_ARRIVED = 1e-9

Cell = str | float | bool | None
Found = TypeVar("Found")


@dataclass(frozen=True)
class ClosedLoopReport:
    """All that was found of one agent at one task; ``gait`` is None where there is none that repeats every stride."""

    task: str
    agent: str
    gait: LimitCycle | None
    why_no_gait: str
    is_at_limit: bool | None
    """Whether the gait changes the offset by as much as it may, there and back: more asked for would make no difference."""
    basins: tuple[xarray.Dataset, ...]
    """Of ``analysis.basin``, one for each plane."""
    box: NDArray[np.bool_]
    """Which starts of the box were survived, shape (starts,)."""
    pushes: LargestPushes | None

    @property
    def modes(self) -> tuple[Mode, ...]:
        """The gait's modes, by falling magnitude."""
        return () if self.gait is None else modes(self.gait)


def examine(
    name: str, agent: Agent, task: str, *, points: int, starts: int, directions: int
) -> ClosedLoopReport:
    """Everything about one agent at one task whose command is held.

    ``points`` (2 to 2000) are those to a side of a basin's plane, ``starts`` (1 to 1,000,000) those in the box, ``directions`` of pushes.

    Raises
    ------
    ValueError
        If the agent remembers or draws, or a number is out of its range.
    SolverError
        If the integrator fails.
    """
    require_count("points", points, 2, 2000)
    loop = closed_loop(agent, task)
    try:
        gait, why = find_limit_cycle(loop), ""
    except NoGaitError as error:
        gait, why = None, str(error)
    return ClosedLoopReport(
        task=task,
        agent=name,
        gait=gait,
        why_no_gait=why,
        is_at_limit=None if gait is None else _is_at_limit(gait, task),
        basins=tuple(basin_around_start(loop, x, y, points) for x, y in PLANES),
        box=box_survival(loop, starts),
        pushes=None if gait is None else largest_pushes(gait, directions=directions, n_steps=STEPS),
    )


def examine_agents(
    tasks: Sequence[str],
    names: Sequence[str],
    examined: Callable[[str, Agent, str], Found],
    *,
    path: Path | None,
    runs: Path,
) -> tuple[list[Found], dict[str, str]]:
    """What is found of each agent at each task, with a progress bar; and by "task: agent" why one is left out.

    ``examined`` gets an agent's name, the agent and the task's name.

    Raises
    ------
    ValueError, LeanYawError
        The last reason if all are left out.
    """
    found: list[Found] = []
    notes: dict[str, str] = {}
    wanted = [(task, name) for task in tasks for name in names]
    for task, name in tqdm(wanted, desc="examining", unit="agent", file=sys.stderr):
        request = AgentRequest(env_id_of(task), EnvOptions(), path=path, runs=runs)
        try:
            found.append(examined(name, make_agent(name, request), task))
        except (ValueError, LeanYawError) as error:
            notes[f"{task}: {name}"] = str(error)
            if len(notes) == len(wanted):
                raise
    return found, notes


def basin_around_start(loop: ClosedLoopMap, x: str, y: str, points: int) -> xarray.Dataset:
    """The basin in a plane through the loop's start, which is the walker's own gait and the same for every agent."""
    axes = axes_around_start(loop, (x, y), points)
    return basin(loop, *axes.items(), centre=loop.start, n_steps=STEPS)


def axes_around_start(loop: ClosedLoopMap, names: Sequence[str], points: int) -> dict[str, Vector]:
    """Values (points,) of some coordinates, ``REACHES`` to either side of the loop's start."""
    steps = np.linspace(-1.0, 1.0, points)
    return {name: loop.start[loop.names.index(name)] + REACHES[name] * steps for name in names}


def share_survived(found: xarray.Dataset) -> float:
    """Share of a basin's starts that are survived."""
    return float((found.ending == 0.0).mean())


def box_starts(loop: ClosedLoopMap, starts: int) -> Vector:
    """States (starts, k) in a box around the loop's start, ``REACHES`` wide to either side; the same starts for every agent.

    They are drawn evenly from a fixed seed, so that agents may be compared start by start.
    """
    require_count("starts", starts, 1, 1_000_000)
    places = np.random.default_rng(0).uniform(-1.0, 1.0, (starts, len(REACHES)))
    states = np.tile(loop.start, (starts, 1))
    for k, (name, reach) in enumerate(REACHES.items()):
        states[:, loop.names.index(name)] += reach * places[:, k]
    return states


def box_survival(loop: ClosedLoopMap, starts: int, n_steps: int = STEPS) -> NDArray[np.bool_]:
    """Which of ``box_starts`` are survived."""
    return walk_many(loop, box_starts(loop, starts), n_steps).require_solved().survived


def _is_at_limit(gait: LimitCycle, task: str) -> bool:
    most = EnvOptions().for_task(task_named(task)).max_offset_change
    left, right = (step.command.mass_offset for step in gait.steps[:2])
    return 0.0 < most * (1.0 - _ARRIVED) <= abs(right - left)


class Line(NamedTuple):
    """One line of the tables: a name for programs, words for people, where the number comes from, and its format."""

    name: str
    words: str
    value: Callable[[ClosedLoopReport], Cell]
    digits: str = ".3f"


def _of_gait(value: Callable[[LimitCycle], Cell]) -> Callable[[ClosedLoopReport], Cell]:
    return lambda report: None if report.gait is None else value(report.gait)


def _of_pushes(value: Callable[[LargestPushes], Cell]) -> Callable[[ClosedLoopReport], Cell]:
    return lambda report: None if report.pushes is None else value(report.pushes)


def _commanded(foot: int, field: str) -> Callable[[ClosedLoopReport], Cell]:
    return _of_gait(lambda gait: getattr(gait.steps[foot].command, field) + 0.0)


def _towards(angle: float) -> Callable[[ClosedLoopReport], Cell]:
    """The push survived in the direction nearest to an angle."""

    def nearest(pushes: LargestPushes) -> float:
        apart = np.abs(np.exp(1j * pushes.angles) - np.exp(1j * angle))
        return float(pushes.sizes[apart.argmin()])

    return _of_pushes(nearest)


def _eigenvalue_error(gait: LimitCycle) -> float:
    return max((mode.error for mode in modes(gait) if abs(mode.eigenvalue) > ZERO), default=0.0)


def _lateral_radius(gait: LimitCycle) -> float:
    lateral = [m for m in modes(gait) if m.name != "fore-aft" and not m.is_neutral]
    return max((abs(mode.eigenvalue) for mode in lateral), default=0.0)


LINES = (
    Line("stable", "stable", _of_gait(lambda g: g.is_stable)),
    Line("spectral_radius", "largest magnitude of an eigenvalue (stride)", _of_gait(lambda g: g.spectral_radius), ".4f"),
    Line("eigenvalue_error", "error bound of the eigenvalues", _of_gait(_eigenvalue_error), ".0e"),
    Line("strides_to_halve", "strides until the slowest disturbance is halved", _of_gait(lambda g: g.cycles_to_halve), ".1f"),
    Line("lateral_radius", "largest magnitude without fore-aft modes", _of_gait(_lateral_radius), ".4f"),
    Line("at_limit", "changes of the offset are at their limit", lambda r: r.is_at_limit),
    Line("inter_leg_angle_left", "commanded inter-leg angle, left stance (rad)", _commanded(0, "inter_leg_angle")),
    Line("inter_leg_angle_right", "right stance", _commanded(1, "inter_leg_angle")),
    Line("mass_offset_left", "commanded mass offset, left stance (leg lengths)", _commanded(0, "mass_offset"), ".4f"),
    Line("mass_offset_right", "right stance", _commanded(1, "mass_offset"), ".4f"),
    Line("speed", "speed", _of_gait(lambda g: g.speed)),
    Line("step_length", "step length (leg lengths)", _of_gait(lambda g: g.step_length)),
    Line("greatest_friction", "friction demand", _of_gait(lambda g: g.greatest_friction)),
    Line("least_normal_force", "least normal force (weights)", _of_gait(lambda g: g.least_normal_force)),
    Line("gravity_work", "work of gravity per weight and distance", _of_gait(lambda g: g.gravity_work), ".5f"),
    Line("shift_work", "work of moving the masses per weight and distance", _of_gait(lambda g: g.shift_work), ".5f"),
    Line("cost_of_transport", "cost of transport (sum of both)", _of_gait(lambda g: g.cost_of_transport), ".5f"),
    Line("basin_ankle", "share of starts survived: plane of ankle angle and ankle rate", lambda r: share_survived(r.basins[0])),
    Line("basin_pitch", "plane of pitch rate and ankle rate", lambda r: share_survived(r.basins[1])),
    Line("box", "box of all three coordinates", lambda r: float(r.box.mean())),
    Line("least_push", "largest push survived in the worst direction (rad / time unit)", _of_pushes(lambda p: float(p.sizes.min()))),
    Line("push_forward", "forward", _towards(math.pi)),
    Line("push_backward", "backward", _towards(0.0)),
    Line("push_ankle_positive", "towards larger ankle rate", _towards(0.5 * math.pi)),
    Line("push_ankle_negative", "towards smaller ankle rate", _towards(1.5 * math.pi)),
)  # fmt: skip
"""Every line of the tables, in order."""


def plain(report: ClosedLoopReport) -> dict[str, Any]:
    """A report's numbers, eigenvalues and pushes as plain values for JSON."""
    gait, pushes = report.gait, report.pushes
    return {
        "task": report.task,
        "agent": report.agent,
        **{line.name: _finite(line.value(report)) for line in LINES},
        "why_no_gait": report.why_no_gait,
        "state": {} if gait is None else dict(zip(gait.section_map.names, gait.state.tolist(), strict=True)),
        "eigenvalues": [
            {
                "real": mode.eigenvalue.real, "imag": mode.eigenvalue.imag, "error": _finite(mode.error),
                "kind": mode.name, "about": mode.about, "is_neutral": mode.is_neutral,
            }
            for mode in report.modes
        ],
        "pushes": [] if pushes is None else [
            {"angle": angle, "size": size, "is_limited": limited}
            for angle, size, limited in zip(
                pushes.angles.tolist(), pushes.sizes.tolist(), pushes.is_limited.tolist(), strict=True
            )
        ],
    }  # fmt: skip


def _finite(value: Cell) -> Cell:
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return bool(value) if isinstance(value, np.bool_) else value
