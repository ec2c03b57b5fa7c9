"""What is found of walkers and agents as closed loops, and its tables for a terminal, a page and a program."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from rich import box
from rich.table import Table

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
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.parameters import Vector
from lean_yaw_env.validation import require_count

from ..agent import Agent
from .closed_loop_interface import GOAL_AHEAD, closed_loop

if TYPE_CHECKING:
    import xarray

STEPS = 100
"""Walked by what counts as survived: a fall for lack of balance comes within some ten."""
PLANES = (("ankle_angle", "ankle_rate"), ("stance_pitch_rate", "ankle_rate"))
"""Planes of the section in which basins are drawn."""
REACHES = {"ankle_angle": 0.3, "stance_pitch_rate": 0.4, "ankle_rate": 0.8}
"""How far from the start the planes and the box reach, rad and rad / time unit."""
POINTS, STARTS, DIRECTIONS = 81, 4096, 24
"""To a side of a basin's picture, in the box, and of pushes."""
ZERO = 1e-3
"""A multiplier below this is as good as zero: what it multiplies is gone within a stride."""
_ARRIVED = 1e-9

Cell = str | float | bool | None


@dataclass(frozen=True)
class ClosedLoopReport:
    """All that was found of one agent at one task.

    Attributes
    ----------
    task, agent : names
    gait : LimitCycle, or None where there is none that repeats every stride
    why_no_gait : str
    is_at_limit : whether the gait changes the offset by as much as it may, there and back: more asked for would make no difference
    basins : a dataset of ``analysis.basin`` for each plane
    box : bool, shape (starts,)
        Which starts of the box were survived.
    pushes : LargestPushes, or None without a gait to push
    """

    task: str
    agent: str
    gait: LimitCycle | None
    why_no_gait: str
    is_at_limit: bool | None
    basins: tuple[xarray.Dataset, ...]
    box: NDArray[np.bool_]
    pushes: LargestPushes | None

    @property
    def modes(self) -> tuple[Mode, ...]:
        """The gait's modes, by falling magnitude."""
        return () if self.gait is None else modes(self.gait)


def examine(
    name: str,
    agent: Agent,
    task: str,
    options: EnvOptions | None = None,
    *,
    points: int = POINTS,
    starts: int = STARTS,
    directions: int = DIRECTIONS,
) -> ClosedLoopReport:
    """Everything about one agent at one task whose command is held.

    Raises
    ------
    ValueError
        If the agent remembers or draws, or a number is out of its range.
    SolverError
        If the integrator fails.
    """
    require_count("points", points, 2, 2000)
    loop = closed_loop(agent, task, options)
    try:
        gait, why = find_limit_cycle(loop), ""
    except NoGaitError as error:
        gait, why = None, str(error)
    change = (options or EnvOptions()).for_task(task_named(task)).max_offset_change
    return ClosedLoopReport(
        task=task,
        agent=name,
        gait=gait,
        why_no_gait=why,
        is_at_limit=None if gait is None else _is_at_limit(gait, change),
        basins=tuple(basin_around_start(loop, x, y, points) for x, y in PLANES),
        box=box_survival(loop, starts),
        pushes=None if gait is None else largest_pushes(gait, directions=directions, n_steps=STEPS),
    )


def basin_around_start(loop: ClosedLoopMap, x: str, y: str, points: int) -> xarray.Dataset:
    """The basin in a plane through the loop's start, which is the walker's own gait and the same for every agent."""
    axes = [
        (name, loop.start[loop.names.index(name)] + REACHES[name] * np.linspace(-1.0, 1.0, points))
        for name in (x, y)
    ]
    return basin(loop, *axes, centre=loop.start, n_steps=STEPS)


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


def _is_at_limit(gait: LimitCycle, most: float) -> bool:
    left, right = (step.command.mass_offset for step in gait.steps[:2])
    return 0.0 < most * (1.0 - _ARRIVED) <= abs(right - left)


@dataclass(frozen=True)
class Line:
    """One line of the tables: a name for programs, words for people, and where the number comes from."""

    name: str
    words: str
    value: Callable[[ClosedLoopReport], Cell]
    digits: str = ".3f"


def _of_gait(value: Callable[[LimitCycle], Cell]) -> Callable[[ClosedLoopReport], Cell]:
    return lambda report: None if report.gait is None else value(report.gait)


def _of_modes(value: Callable[[tuple[Mode, ...]], Cell]) -> Callable[[ClosedLoopReport], Cell]:
    return lambda report: None if report.gait is None else value(report.modes)


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


def _error(found: tuple[Mode, ...]) -> float:
    return max((mode.error for mode in found if abs(mode.eigenvalue) > ZERO), default=0.0)


def _lateral_radius(found: tuple[Mode, ...]) -> float:
    lateral = [m for m in found if m.name != "fore-aft" and not m.is_neutral]
    return max((abs(mode.eigenvalue) for mode in lateral), default=0.0)


LINES = (
    Line("stable", "stable", _of_gait(lambda g: g.is_stable)),
    Line("spectral_radius", "largest magnitude of an eigenvalue (stride)", _of_gait(lambda g: g.spectral_radius), ".4f"),
    Line("eigenvalue_error", "error bound of the eigenvalues", _of_modes(_error), ".0e"),
    Line("strides_to_halve", "strides until the slowest disturbance is halved", _of_gait(lambda g: g.cycles_to_halve), ".1f"),
    Line("lateral_radius", "largest magnitude without fore-aft modes", _of_modes(_lateral_radius), ".4f"),
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


def text_of(value: Cell, digits: str) -> str:
    """A cell's value to read; a dash where there is none."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "–"
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    if math.isinf(value):
        return "never"
    text = format(value, digits)
    return text.lstrip("-") if float(text) == 0.0 else text


def eigenvalue_text(found: Sequence[Mode]) -> str:
    """Eigenvalues of a gait with what each is about; a pair once, neutral ones apart, and how many are as good as zero."""
    shown = []
    for mode in found:
        value = mode.eigenvalue
        if abs(value) < ZERO or mode.is_neutral or value.imag < 0.0:
            continue
        number = f"{value.real:.3f}" + (f" ± {value.imag:.3f}i" if value.imag else "")
        shown.append(f"{number} ({mode.about})")
    zeros = sum(abs(mode.eigenvalue) < ZERO for mode in found)
    neutral = [mode.about for mode in found if mode.is_neutral]
    shown += ["0" if zeros == 1 else f"0 ({zeros} times)"] if zeros else []
    shown += [f"neutral: 1 ({', '.join(neutral)})"] if neutral else []
    return "; ".join(shown)


def terminal_table(reports: Sequence[ClosedLoopReport]) -> Table:
    """The lines of one task, an agent to a column."""
    table = Table(title=f"{reports[0].task}: walker and agent as one system", box=box.SIMPLE_HEAD)
    table.add_column("")
    for report in reports:
        table.add_column(report.agent, justify="right", no_wrap=True)
    for line in LINES:
        table.add_row(line.words, *(text_of(line.value(report), line.digits) for report in reports))
    return table


def markdown_table(reports: Sequence[ClosedLoopReport]) -> str:
    """The same in Markdown."""
    rows = [["", *(report.agent for report in reports)], ["---", *(["---:"] * len(reports))]]
    rows += [
        [line.words, *(text_of(line.value(report), line.digits) for report in reports)]
        for line in LINES
    ]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def eigenvalue_table(reports: Sequence[ClosedLoopReport]) -> str:
    """The eigenvalues of each agent's gait, in Markdown; or why there is none."""
    rows = ["| agent | eigenvalues of the stride (and their coordinates) |", "| --- | --- |"]
    for report in reports:
        what = report.why_no_gait if report.gait is None else eigenvalue_text(report.modes)
        rows.append(f"| {report.agent} | {what} |")
    return "\n".join(rows)


def csv_text(reports: Sequence[ClosedLoopReport]) -> str:
    """A row for each agent and task, a column for each line, full precision; empty where there is no number."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["task", "agent", *(line.name for line in LINES)])
    for report in reports:
        cells = [line.value(report) for line in LINES]
        writer.writerow([report.task, report.agent, *("" if c is None else c for c in cells)])
    return out.getvalue()


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


_HEAD = """# Walker and agent as one system

The leaderboard says how good an agent is, but not why. With the command held constant, walker and agent together are one dynamical system. From heel strike
to heel strike it is a map that can be computed exactly. This page therefore analyses the pair as the paper analyses the walker alone: its periodic gait, the
eigenvalues of the gait, its basin of attraction, the forces on the floor and the energy that it needs. The tools are those of `lean_yaw_env.analysis`, which
take walker and agent (`analysis.ClosedLoopMap`) as they take a walker.

- **The map** is the environment's step, with its observation, its mirroring and its limits. The state of the map is the section state, the present mass offset
  and the heading of the previous footprint (the observed heading error is that of the mean of two footprints). For SpeedHeading the last speed is added. For
  Slalom the distance from a straight path is added. Pushes and time limit are switched off. The commanded heading is straight downhill. A goal is kept {goal}
  leg lengths ahead.
- **The gait** is a fixed point of the map over two steps. Newton's method finds it, starting from the end of a long walk.
- **The eigenvalues** are those of the Jacobian of two steps. The Jacobian of the walking step is exact. The derivatives of the agent's actions are finite
  differences, because agents compute in single precision; the step size of the differences is adapted. The table contains a bound of the resulting error. Each
  eigenvalue is named by the coordinates with the largest part in its eigenvector. An eigenvalue is *neutral* if nothing reacts to its coordinate: a heading or a
  position that the agent does not use, or the mean offset if both steps change the offset by the largest allowed amount.
- **Basins of attraction**: starts in two planes of the section through the gait of the walker without agent, the same for every agent. A third set is a box of
  all three coordinates, within {reaches}. A start is survived if the walker completes {steps} steps.
- **Pushes** change both rates at the start of a left step of the gait of walker and agent.

Speeds, forces and work are dimensionless: leg length, gravity and mass are one. [closed_loop.csv](closed_loop.csv) contains all numbers.

This command generates the page:

```
{command}
```
"""
_UNITS = {"ankle_angle": "rad", "stance_pitch_rate": "rad / time unit", "ankle_rate": "rad / time unit"}  # fmt: skip
_PICTURES = {
    "eigenvalues": "Eigenvalues of the closed loop in the complex plane",
    "basins": "Basins of attraction",
    "pushes": "Largest push survived in each direction of the two rates",
}


def picture_name(task: str, what: str) -> str:
    """The file of a task's picture, in the folder ``images`` beside the page."""
    return f"closed_loop_{task.lower()}_{what}.png"


def markdown_page(
    by_task: Mapping[str, Sequence[ClosedLoopReport]], command: str, notes: Mapping[str, str]
) -> str:
    """The page.

    Parameters
    ----------
    by_task : reports of each task
    command : the command line that renews it
    notes : by "task: agent", why an agent is left out
    """
    reaches = ", ".join(
        f"{reach:g} {_UNITS[name]} of its {name.replace('_', ' ')}"
        for name, reach in REACHES.items()
    )
    head = _HEAD.format(command=command, reaches=reaches, goal=f"{GOAL_AHEAD:g}", steps=STEPS)
    parts = [head]
    for task, reports in by_task.items():
        parts.append(f"## {task}\n")
        parts.append(f"{markdown_table(reports)}\n\n{eigenvalue_table(reports)}\n")
        parts += [
            f"![{words} at {task}](images/{picture_name(task, what)})\n"
            for what, words in _PICTURES.items()
        ]
    if notes:
        parts.append("Not included:\n")
        parts.append("\n".join(f"- {what}: {why}" for what, why in notes.items()) + "\n")
    return "\n".join(parts)
