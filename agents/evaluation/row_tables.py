"""Rows of an evaluation as JSON, as CSV and as tables to read."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Sequence
from dataclasses import asdict, fields

from rich import box
from rich.console import Console
from rich.table import Table

from .episodes import RETURN, Row, is_share

_WIDTH = 5  # agents in a table: so many fit a terminal of 80 columns


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
    """A list of objects with the fields of ``Row``: task, agent, metric, mean, low, high, survival, episodes, iqm, ...; low and high are the
    mean's."""
    return json.dumps(rows_to_plain(rows), indent=2, allow_nan=False)


def rows_to_csv(rows: Sequence[Row]) -> str:
    """A line for each row under the names of its fields; what is undefined is empty."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [field.name for field in fields(Row)], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows_to_plain(rows))
    return text.getvalue()


def results_tables(rows: Sequence[Row]) -> list[Table]:
    """Tables of each task, as ``results_table``, of a few agents each."""
    tables: list[Table] = []
    for task in dict.fromkeys(row.task for row in rows):
        of_task = [row for row in rows if row.task == task]
        agents = list(dict.fromkeys(row.agent for row in of_task))
        for start in range(0, len(agents), _WIDTH):
            shown = agents[start : start + _WIDTH]
            tables.append(results_table([row for row in of_task if row.agent in shown]))
    return tables


def results_table(rows: Sequence[Row]) -> Table:
    """A table of one task: a metric to a row, an agent to a column, each interquartile mean, or share, over its 95 % interval.

    Of the return the mean stands beside it. Below: what each agent is against the best feedback controller, by its means.
    """
    metrics = list(dict.fromkeys(row.metric for row in rows))
    agents = list(dict.fromkeys(row.agent for row in rows))
    cells = {(row.agent, row.metric): row for row in rows}
    task = rows[0].task
    counts = sorted({row.episodes for row in rows}, reverse=True)
    table = Table(
        title=f"{task}, {' or '.join(map(str, counts))} episodes: interquartile means, 95 % intervals",
        box=box.SIMPLE_HEAD,
        padding=(0, 0),
        pad_edge=False,
    )
    table.add_column("metric", width=16)  # five agents and it fit a terminal of 80 columns
    for agent in agents:
        table.add_column(agent, justify="right", no_wrap=True)
    for metric in metrics:
        found = [cells.get((agent, metric)) for agent in agents]
        whole = is_share(task, metric)
        table.add_row(
            metric.replace("_", " "),
            *("" if row is None else cell(row, mean=whole) for row in found),
        )
        if metric == RETURN:
            means = ("" if row is None else cell(row, mean=True) for row in found)
            table.add_row("return, mean", *means)
    compared = [row for row in rows if row.against is not None]
    if compared:
        table.add_section()
    for metric in dict.fromkeys(row.metric for row in compared):
        found = [cells.get((agent, metric)) for agent in agents]
        table.add_row(
            f"{metric.replace('_', ' ')}\nagainst {compared[0].against}",
            *((row.verdict or "") if row is not None else "" for row in found),
        )
    return table


def cell(row: Row, *, mean: bool) -> str:
    """The mean, or the interquartile mean, over its interval."""
    value, low, high = estimate(row, mean=mean)
    if math.isnan(value):
        return "undefined"
    return f"{number(value)}\n{number(low)}–{number(high)}"


def estimate(row: Row, *, mean: bool) -> tuple[float, float, float]:
    """The mean, or the interquartile mean, with its interval."""
    return (row.mean, row.low, row.high) if mean else (row.iqm, row.iqm_low, row.iqm_high)


def number(value: float) -> str:
    """As many digits as intervals of some thousand episodes leave."""
    return f"{value:.1f}" if abs(value) >= 10.0 else f"{value:.3f}"


def show(rows: Sequence[Row], console: Console, *, as_json: bool = False) -> None:
    """Print rows, as tables or as JSON."""
    if as_json:
        console.print(rows_to_json(rows), soft_wrap=True, highlight=False, markup=False)
        return
    for table in results_tables(rows):
        console.print(table)
