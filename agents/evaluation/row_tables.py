"""Rows of an evaluation as JSON, as CSV and as tables to read."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, fields
from typing import TypeVar

from rich import box
from rich.console import Console
from rich.table import Table

from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.tables import csv_table

from .episodes import SURVIVAL, Row, words
from .intervals import Estimate

Value = TypeVar("Value")
IMAGES = "images"
"""Folder of a page's pictures, beside it."""
_WIDTH = 5  # agents in a table: so many fit a terminal of 80 columns


def rows_to_plain(rows: Sequence[Row]) -> list[dict[str, str | int | float | None]]:
    """Rows as plain values; what is undefined is null."""
    return [{key: plain_number(value) for key, value in asdict(row).items()} for row in rows]


def plain_number(value: Value) -> Value | None:
    """The value; None for NaN."""
    return None if isinstance(value, float) and math.isnan(value) else value


def rows_to_json(rows: Sequence[Row]) -> str:
    """A list of objects with the fields of ``Row``."""
    return json.dumps(rows_to_plain(rows), indent=2, allow_nan=False)


def rows_to_csv(rows: Sequence[Row]) -> str:
    """A line for each row under the names of its fields; what is undefined is empty."""
    titles = [field.name for field in fields(Row)]
    return csv_table(titles, (each.values() for each in rows_to_plain(rows)))


def results_table(rows: Sequence[Row]) -> Table:
    """A table of one task: a metric to a row, an agent to a column, each mean over its 95 % interval; the main metric, survival and the main
    metric's interquartile mean come first.

    Below: what each agent is against the best feedback controller.
    """
    agents = list(dict.fromkeys(row.agent for row in rows))
    cells = {(row.agent, row.metric): row for row in rows}
    counts = sorted({row.episodes for row in rows}, reverse=True)
    task = rows[0].task
    table = Table(
        title=f"{task}, {' or '.join(map(str, counts))} episodes: means, 95 % intervals",
        box=box.SIMPLE_HEAD,
        padding=(0, 0),
        pad_edge=False,
    )
    table.add_column("metric", width=16)  # five agents and it fit a terminal of 80 columns
    for agent in agents:
        table.add_column(agent, justify="right", no_wrap=True)

    def add(metric: str, of: Callable[[Row], Estimate], title: str) -> None:
        found = [cells.get((agent, metric)) for agent in agents]
        table.add_row(title, *("" if row is None else _over_interval(of(row)) for row in found))

    headline = task_named(task).headline
    metrics = dict.fromkeys([headline, SURVIVAL, *(row.metric for row in rows)])
    for metric in metrics:
        add(metric, mean, words(metric))
        if metric == SURVIVAL and any(
            math.isfinite(row.iqm) for row in rows if row.metric == headline
        ):
            add(headline, iqm, f"{words(headline)}, iqm")
    rival = next((row.against for row in rows if row.verdict), None)
    if rival is not None:
        table.add_section()
        verdicts = {row.agent: row.verdict for row in rows if row.verdict}
        table.add_row(f"against {rival}", *(verdicts.get(agent, "") for agent in agents))
    return table


def mean(row: Row) -> Estimate:
    """A row's mean with its interval."""
    return Estimate(row.mean, row.low, row.high)


def iqm(row: Row) -> Estimate:
    """A row's interquartile mean with its interval; undefined for a share."""
    return Estimate(row.iqm, row.iqm_low, row.iqm_high)


def _over_interval(found: Estimate) -> str:
    value, low, high = found
    if math.isnan(value):
        return "undefined" if math.isnan(low) else f"≥ {number(low)}"
    return f"{number(value)}\n{number(low)}–{number(high)}"


def bracketed(found: Estimate, *, signed: bool = False) -> str:
    """A value with its interval in brackets, or what it is at least; nothing if it is undefined."""
    if math.isnan(found.value):
        return "" if math.isnan(found.low) else f"≥ {number(found.low)}"
    plus = "+" if signed and found.value > 0.0 else ""
    return f"{plus}{number(found.value)} [{number(found.low)}, {number(found.high)}]"


def number(value: float) -> str:
    """As many digits as intervals of some thousand episodes leave."""
    return f"{value:.1f}" if abs(value) >= 10.0 else f"{value:.3f}"


def show(rows: Sequence[Row], console: Console, *, as_json: bool = False) -> None:
    """Print rows, as JSON or as tables of each task with a few agents each."""
    if as_json:
        console.print(rows_to_json(rows), soft_wrap=True, highlight=False, markup=False)
        return
    for task in dict.fromkeys(row.task for row in rows):
        of_task = [row for row in rows if row.task == task]
        agents = list(dict.fromkeys(row.agent for row in of_task))
        for start in range(0, len(agents), _WIDTH):
            shown = agents[start : start + _WIDTH]
            console.print(results_table([row for row in of_task if row.agent in shown]))
