"""Rows of an evaluation as JSON and as a table to read."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict

from rich import box
from rich.table import Table

from agents.evaluation.scoring import Row


def rows_to_plain(rows: Sequence[Row]) -> list[dict[str, str | int | float | None]]:
    """Rows as plain values; what is undefined is null."""
    return [
        {
            key: None if isinstance(value, float) and math.isnan(value) else value
            for key, value in asdict(row).items()
        }
        for row in rows
    ]


def rows_to_json(rows: Sequence[Row]) -> str:
    """A list of objects: task, agent, metric, mean, low, high, survival, episodes."""
    return json.dumps(rows_to_plain(rows), indent=2, allow_nan=False)


def results_table(rows: Sequence[Row]) -> Table:
    """A table of one task: a metric to a row, an agent to a column, each mean over its 95 % interval."""
    metrics = list(dict.fromkeys(row.metric for row in rows))
    agents = list(dict.fromkeys(row.agent for row in rows))
    cells = {(row.agent, row.metric): row for row in rows}
    first = rows[0]
    table = Table(
        title=f"{first.task}: means of {first.episodes} episodes not trained on, 95 % intervals",
        box=box.SIMPLE_HEAD,
        padding=(0, 0),
        pad_edge=False,
    )
    table.add_column("metric", min_width=16)  # five agents and it fit a terminal of 80 columns
    for agent in agents:
        table.add_column(agent, justify="right", no_wrap=True)
    for metric in metrics:
        found = [cells.get((agent, metric)) for agent in agents]
        table.add_row(
            metric.replace("_", " "), *("" if row is None else _cell(row) for row in found)
        )
    return table


def _cell(row: Row) -> str:
    if math.isnan(row.mean):
        return "undefined"
    return f"{_number(row.mean)}\n{_number(row.low)}–{_number(row.high)}"


def _number(value: float) -> str:
    return f"{value:.1f}" if abs(value) >= 20.0 else f"{value:.3f}"
