"""Records printed for people."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console
from rich.table import Table

from lean_yaw_env.cli.rows import Record

if TYPE_CHECKING:
    from lean_yaw_env.paper import Reproduction

_MOST_ROWS = 60


def text_of(value: Any) -> str:
    """A number with six digits, a complex one by its parts."""
    if value is None:
        return "none"
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    if isinstance(value, (complex, np.complexfloating)):
        if abs(value.imag) == 0.0:
            return text_of(float(value.real))
        sign = "+" if value.imag > 0.0 else "-"
        return f"{value.real:.6g} {sign} {abs(value.imag):.6g}i"
    if isinstance(value, (float, np.floating)):
        return f"{value:.6g}"
    if isinstance(value, (list, tuple)):
        return " to ".join(text_of(each) for each in value)
    return str(value)


def show_pairs(title: str, record: Record) -> None:
    """Names and values, a line each; what is a list or a mapping of its own is left out."""
    table = Table(title=title, title_justify="left", min_width=60, show_header=False, box=None)
    for name, value in record.items():
        nested = isinstance(value, dict) or (
            isinstance(value, list) and bool(value) and isinstance(value[0], dict)
        )
        if not nested:
            table.add_row(name.replace("_", " "), text_of(value))
    Console().print(table)


def show_records(title: str, records: Sequence[Record]) -> None:
    """A table of records that have the same keys; of a long one the beginning."""
    if not records:
        return
    table = Table(title=title, title_justify="left")
    for name in records[0]:
        table.add_column(name.replace("_", " "))
    for record in records[:_MOST_ROWS]:
        table.add_row(*(text_of(value) for value in record.values()))
    console = Console()
    console.print(table)
    if len(records) > _MOST_ROWS:
        console.print(f"... and {len(records) - _MOST_ROWS} more: ask for --json or --out")


def show_gait(record: Record) -> None:
    """A gait's record: state, numbers, multipliers, and why some of them are zero."""
    show_pairs("section state just after heel strike, left foot", record["state"])
    show_pairs("gait", record)
    modes = record["modes"]
    shown = [{key: mode[key] for key in ("eigenvalue", "magnitude", "kind")} for mode in modes]
    show_records("multipliers of the stride", shown)
    for reason in sorted({mode["why_zero"] for mode in modes} - {""}):
        Console().print(f"zero: {reason}")


def show_reproduction(reproduction: Reproduction) -> None:
    """How many checks came to which verdict, and those that disagree."""
    show_pairs("checks", dict(reproduction.counts()))
    show_records(
        "where they disagree",
        [
            {"what": check.name, "paper": check.paper, "ours": check.ours, "verdict": check.verdict}
            for check in reproduction.checks
            if not check.agrees
        ],
    )
