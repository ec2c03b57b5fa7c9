"""The report on closed loops as a page with numbers and pictures, and as tables for a terminal."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from lean_yaw_env.analysis import Mode
from lean_yaw_env.files import write_text
from lean_yaw_env.tables import csv_table, markdown_table

from .closed_loop_interface import GOAL_AHEAD
from .closed_loop_pictures import save_basins, save_eigenvalues, save_pushes
from .closed_loop_report import LINES, REACHES, STEPS, ZERO, Cell, ClosedLoopReport
from .row_tables import IMAGES

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
    "eigenvalues": (save_eigenvalues, "Eigenvalues of the closed loop in the complex plane"),
    "basins": (save_basins, "Basins of attraction"),
    "pushes": (save_pushes, "Largest push survived in each direction of the two rates"),
}


def write_report(
    reports: Sequence[ClosedLoopReport],
    out: Path,
    command: str,
    notes: Mapping[str, str] | None = None,
) -> Path:
    """Write page, numbers and pictures of all tasks into a folder; return the page's path.

    Parameters
    ----------
    reports : of any tasks
    out : the folder
    command : the command line that renews the page
    notes : by "task: agent", why an agent is left out
    """
    (out / IMAGES).mkdir(parents=True, exist_ok=True)
    reaches = ", ".join(f"{reach:g} {_UNITS[name]} of its {name.replace('_', ' ')}" for name, reach in REACHES.items())  # fmt: skip
    parts = [_HEAD.format(command=command, reaches=reaches, goal=f"{GOAL_AHEAD:g}", steps=STEPS)]
    for task, found in _by_task(reports).items():
        parts.append(f"## {task}\n")
        parts.append(f"{_numbers_table(found)}\n\n{eigenvalue_table(found)}\n")
        for what, (save, words) in _PICTURES.items():
            picture = f"{IMAGES}/closed_loop_{task.lower()}_{what}.png"
            save(found, out / picture)
            parts.append(f"![{words} at {task}]({picture})\n")
    if notes:
        parts.append("Not included:\n")
        parts.append("\n".join(f"- {what}: {why}" for what, why in notes.items()) + "\n")
    page = out / "closed_loop.md"
    write_text(page, "\n".join(parts))
    write_text(out / "closed_loop.csv", csv_text(reports))
    return page


def show(reports: Sequence[ClosedLoopReport], notes: Mapping[str, str]) -> None:
    """Print tables, and what is left out."""
    console = Console()
    for task, found in _by_task(reports).items():
        table = Table(title=f"{task}: walker and agent as one system", box=box.SIMPLE_HEAD)
        table.add_column("")
        for report in found:
            table.add_column(report.agent, justify="right", no_wrap=True)
        for row in _text_rows(found):
            table.add_row(*row)
        console.print(table)
        console.print(eigenvalue_table(found), markup=False, highlight=False, soft_wrap=True)
    for what, why in notes.items():
        console.print(f"left out: {what}: {why}", markup=False, highlight=False)


def csv_text(reports: Sequence[ClosedLoopReport]) -> str:
    """A row for each agent and task, a column for each line, full precision; empty where there is no number."""
    titles = ["task", "agent", *(line.name for line in LINES)]
    rows = ([r.task, r.agent, *(line.value(r) for line in LINES)] for r in reports)
    return csv_table(titles, rows)


def eigenvalue_table(reports: Sequence[ClosedLoopReport]) -> str:
    """The eigenvalues of each agent's gait, in Markdown; or why there is none."""
    return markdown_table(
        ("agent", "eigenvalues of the stride (and their coordinates)"),
        [
            (r.agent, r.why_no_gait if r.gait is None else _eigenvalue_text(r.modes))
            for r in reports
        ],
    )


def _by_task(reports: Sequence[ClosedLoopReport]) -> dict[str, list[ClosedLoopReport]]:
    return {
        task: [report for report in reports if report.task == task]
        for task in dict.fromkeys(report.task for report in reports)
    }


def _text_rows(reports: Sequence[ClosedLoopReport]) -> list[list[str]]:
    """The lines of one task, an agent to a column."""
    return [[line.words, *(_text(line.value(r), line.digits) for r in reports)] for line in LINES]


def _numbers_table(reports: Sequence[ClosedLoopReport]) -> str:
    titles = ["", *(report.agent for report in reports)]
    return markdown_table(titles, _text_rows(reports), align_right=True)


def _text(value: Cell, digits: str) -> str:
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


def _eigenvalue_text(found: Sequence[Mode]) -> str:
    """Eigenvalues with what each is about; a pair once, neutral ones apart, and how many are as good as zero."""
    shown = []
    for mode in found:
        value = mode.eigenvalue
        if abs(value) >= ZERO and not mode.is_neutral and value.imag >= 0.0:
            imaginary = f" ± {value.imag:.3f}i" if value.imag else ""
            shown.append(f"{value.real:.3f}{imaginary} ({mode.about})")
    zeros = sum(abs(mode.eigenvalue) < ZERO for mode in found)
    neutral = [mode.about for mode in found if mode.is_neutral]
    shown += ["0" if zeros == 1 else f"0 ({zeros} times)"] if zeros else []
    shown += [f"neutral: 1 ({', '.join(neutral)})"] if neutral else []
    return "; ".join(shown)
