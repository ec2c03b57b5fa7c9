"""Tables as text: CSV and Markdown."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path


def csv_table(titles: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A table as CSV; None is an empty cell."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([titles, *rows])
    return text.getvalue()


def read_csv(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV file, each by the titles of its columns."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def markdown_table(
    titles: Sequence[str], rows: Iterable[Iterable[object]], *, align_right: bool = False
) -> str:
    """A table in Markdown; with ``align_right``, all columns but the first are aligned to the right."""
    rule = ["---", *(["---:" if align_right else "---"] * (len(titles) - 1))]
    lines = ([str(cell).replace("|", "\\|") for cell in row] for row in (titles, *rows))
    head, *body = (f"| {' | '.join(line)} |" for line in lines)
    return "\n".join([head, f"| {' | '.join(rule)} |", *body])
