"""What was found of walkers and agents, as tables for a terminal, a page and a program."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich import box
from rich.table import Table

from agents.evaluation.closed_loop_gait import ZERO, ClosedLoopGait, ClosedMode
from agents.evaluation.closed_loop_survival import BasinSlice, LargestPushes

Cell = str | float | bool | None


@dataclass(frozen=True)
class ClosedLoopReport:
    """All that was found of one agent at one task.

    Attributes
    ----------
    task, agent : names
    gait : ClosedLoopGait, or None where there is none that repeats every stride
    why_no_gait : str
    basins : a BasinSlice for each plane
    box : bool, shape (starts,)
        Which starts of the box were survived.
    pushes : LargestPushes, or None without a gait to push
    """

    task: str
    agent: str
    gait: ClosedLoopGait | None
    why_no_gait: str
    basins: tuple[BasinSlice, ...]
    box: NDArray[np.bool_]
    pushes: LargestPushes | None


@dataclass(frozen=True)
class Line:
    """One line of the tables: a name for programs, words for people, and where the number comes from."""

    name: str
    words: str
    value: Callable[[ClosedLoopReport], Cell]
    digits: str = ".3f"


def _of_gait(value: Callable[[ClosedLoopGait], Cell]) -> Callable[[ClosedLoopReport], Cell]:
    return lambda report: None if report.gait is None else value(report.gait)


def _of_pushes(value: Callable[[LargestPushes], Cell]) -> Callable[[ClosedLoopReport], Cell]:
    return lambda report: None if report.pushes is None else value(report.pushes)


def _towards(pushes: LargestPushes, angle: float) -> float:
    """The size in the direction nearest to an angle."""
    apart = np.abs(np.exp(1j * pushes.angles) - np.exp(1j * angle))
    return float(pushes.sizes[apart.argmin()])


LINES = (
    Line("stable", "stable", _of_gait(lambda g: g.is_stable)),
    Line("spectral_radius", "largest eigenvalue of the stride, magnitude", _of_gait(lambda g: g.spectral_radius), ".4f"),
    Line("eigenvalue_error", "bound of the eigenvalues' errors", _of_gait(lambda g: g.error), ".0e"),
    Line("strides_to_halve", "strides in which the slowest disturbance halves", _of_gait(lambda g: g.strides_to_halve), ".1f"),
    Line("lateral_radius", "largest of those that are not fore-aft, magnitude", _of_gait(lambda g: _lateral_radius(g)), ".4f"),
    Line("at_limit", "offset changes at their limit", _of_gait(lambda g: g.is_at_limit)),
    Line("inter_leg_angle_left", "inter-leg angle commanded, left foot (rad)", _of_gait(lambda g: g.inter_leg_angles[0])),
    Line("inter_leg_angle_right", "right foot", _of_gait(lambda g: g.inter_leg_angles[1])),
    Line("mass_offset_left", "mass offset commanded, left foot (leg lengths)", _of_gait(lambda g: g.mass_offsets[0] + 0.0), ".4f"),
    Line("mass_offset_right", "right foot", _of_gait(lambda g: g.mass_offsets[1] + 0.0), ".4f"),
    Line("speed", "speed", _of_gait(lambda g: g.cycle.speed)),
    Line("step_length", "step length (leg lengths)", _of_gait(lambda g: g.cycle.step_length)),
    Line("greatest_friction", "friction demand", _of_gait(lambda g: g.cycle.greatest_friction)),
    Line("least_normal_force", "least normal force (weights)", _of_gait(lambda g: g.cycle.least_normal_force)),
    Line("gravity_work", "gravity's work per weight and distance", _of_gait(lambda g: g.cycle.gravity_work), ".5f"),
    Line("shift_work", "work of moving the masses, the same", _of_gait(lambda g: g.cycle.shift_work), ".5f"),
    Line("cost_of_transport", "cost of transport, both", _of_gait(lambda g: g.cost_of_transport), ".5f"),
    Line("basin_ankle", "starts survived in the plane ankle angle, ankle rate", lambda r: r.basins[0].share),
    Line("basin_pitch", "in the plane pitch rate, ankle rate", lambda r: r.basins[1].share),
    Line("box", "in the box of all three", lambda r: float(r.box.mean())),
    Line("least_push", "largest push survived (rad / time unit), in the worst direction", _of_pushes(lambda p: float(p.sizes.min()))),
    Line("push_forward", "pushed forward", _of_pushes(lambda p: _towards(p, math.pi))),
    Line("push_backward", "pushed backward", _of_pushes(lambda p: _towards(p, 0.0))),
    Line("push_ankle_positive", "ankle rate pushed up", _of_pushes(lambda p: _towards(p, 0.5 * math.pi))),
    Line("push_ankle_negative", "ankle rate pushed down", _of_pushes(lambda p: _towards(p, 1.5 * math.pi))),
)  # fmt: skip
"""Every line of the tables, in order."""


def _lateral_radius(gait: ClosedLoopGait) -> float:
    found = [abs(m.eigenvalue) for m in gait.modes if m.name != "fore-aft" and not m.is_neutral]
    return max(found, default=0.0)


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


def eigenvalue_text(modes: Sequence[ClosedMode]) -> str:
    """Eigenvalues of a gait with what each is about; a pair once, neutral ones apart, and how many are as good as zero."""
    shown = []
    for mode in modes:
        value = mode.eigenvalue
        if abs(value) < ZERO or mode.is_neutral or value.imag < 0.0:
            continue
        number = f"{value.real:.3f}" + (f" ± {value.imag:.3f}i" if value.imag else "")
        shown.append(f"{number} ({mode.about})")
    zeros = sum(abs(mode.eigenvalue) < ZERO for mode in modes)
    neutral = [mode.about for mode in modes if mode.is_neutral]
    shown += [f"0 ({zeros} of them)"] if zeros else []
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
    rows = ["| agent | eigenvalues of the stride (what each is about) |", "| --- | --- |"]
    for report in reports:
        what = report.why_no_gait if report.gait is None else eigenvalue_text(report.gait.modes)
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
        "state": {} if gait is None else dict(zip(gait.cycle.coordinates, gait.state.tolist(), strict=True)),
        "eigenvalues": [] if gait is None else [
            {
                "real": mode.eigenvalue.real, "imag": mode.eigenvalue.imag, "error": _finite(mode.error),
                "kind": mode.name, "about": mode.about, "is_neutral": mode.is_neutral,
            }
            for mode in gait.modes
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
