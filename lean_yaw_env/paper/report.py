"""The report: number by number the paper's, ours, the difference, a verdict and why; as Markdown
and as one self-contained HTML page."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape
from pathlib import Path

from lean_yaw_env.files import write_text
from lean_yaw_env.paper.checks import Check
from lean_yaw_env.paper.reproduction import Reproduced, Reproduction, write_columns
from lean_yaw_env.paper.results import CLASSICS, PAPER, Columns, Section

TITLES = {
    PAPER: "Skateboards, bicycles and three-dimensional walkers: the paper beside ours",
    CLASSICS: "The classics of passive walking and of bicycles: their numbers beside ours",
}
_INTRODUCTIONS = {
    PAPER: (
        "Wisse and Schwab, “Skateboards, Bicycles, and Three-dimensional Biped Walking Machines: "
        "Velocity-dependent Stability by Means of Lean-to-yaw Coupling” (2005), computed anew from "
        "scratch."
    ),
    CLASSICS: (
        "Published numbers of the field that these models can be held against, computed anew. "
        "Where the publication itself could not be read, the source of its number is marked "
        "“secondary”; numbers for which no source could be read are left out, and said to be."
    ),
}
_VERDICTS = (
    "Walkers are dimensionless: leg length, gravity and total mass are one. Each row says what "
    "difference is allowed, and why. A number “agrees within rounding” if ours rounds to the "
    "printed digits; “agrees” if it is within another tolerance, or if a statement meets its "
    "criterion; it “differs” if not, and the remark says why; “open” means that the reason for a "
    "difference is not known, and a section says what was tried."
)
_HEADINGS = ("what", "where", "paper", "ours", "difference", "allowed", "verdict", "remark")
_STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, sans-serif; color: #23252b; background: #fbfaf7;
       max-width: 68rem; margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.7rem; line-height: 1.25; } h2 { margin-top: 2.6rem; font-size: 1.25rem;
     border-bottom: 1px solid #d8d4c8; padding-bottom: .2rem; }
table { border-collapse: collapse; width: 100%; margin: 1rem 0; font-size: .87rem; }
th, td { text-align: left; vertical-align: top; padding: .35rem .6rem;
         border-bottom: 1px solid #e4e0d6; }
th { background: #efece4; } td.number { font-variant-numeric: tabular-nums; }
img { max-width: 100%; background: white; border: 1px solid #e4e0d6; border-radius: 4px; }
figure { margin: 1rem 0; } figcaption { font-size: .87rem; color: #5c5e66; margin-top: .4rem; }
.verdict { white-space: nowrap; border-radius: 3px; padding: .05rem .4rem; }
.agrees, .agrees-within-rounding { background: #dcefdf; } .differs { background: #f8d9cf; }
.open { background: #f7eabf; } nav a { margin-right: .9rem; white-space: nowrap; }
"""


def write_report(reproduction: Reproduction, folder: Path) -> tuple[Path, Path]:
    """Write ``report.md``, ``report.html`` and ``checks.csv``, each whole or not at all.

    Returns
    -------
    markdown, html : Path
    """
    markdown, page = folder / "report.md", folder / "report.html"
    rows = reproduction.rows()
    if rows:
        write_columns(folder / "checks.csv", {key: [row[key] for row in rows] for key in rows[0]})
    write_text(markdown, as_markdown(reproduction))
    write_text(page, as_html(reproduction))
    return markdown, page


def cells(check: Check) -> tuple[str, ...]:
    """A check as the report's row, under ``_HEADINGS``."""
    difference = "" if check.difference is None else f"{check.difference:+.2g}"
    what = f"{check.name}: {check.statement}"
    return (
        what, check.where, check.paper, check.ours, difference, check.allowed, check.verdict,
        check.remark,
    )  # fmt: skip


def _heading(reproduction: Reproduction) -> tuple[str, str]:
    """Title and introduction for the publications that were reproduced."""
    found = [name for name in TITLES if any(e.piece.group == name for e in reproduction.pieces)]
    introductions = [_INTRODUCTIONS[name] for name in found]
    return TITLES[found[0] if found else PAPER], " ".join([*introductions, _VERDICTS])


def _rows(columns: Columns) -> list[tuple[str, ...]]:
    """The rows of a section's table as they are read."""
    return list(zip(*([str(cell) for cell in column] for column in columns.values()), strict=True))


def as_markdown(reproduction: Reproduction) -> str:
    """The report in Markdown; pictures by their file names beside it."""
    title, introduction = _heading(reproduction)
    parts = [f"# {title}", introduction, _counts_text(reproduction)]
    disagreeing = [check for check in reproduction.checks if not check.agrees]
    if disagreeing:
        rows = [cells(check) for check in disagreeing]
        parts += ["## Where they disagree", _markdown_table(_HEADINGS, rows)]
    for each in reproduction.pieces:
        parts.append(f"## {each.piece.title}")
        if each.picture is not None:
            parts += [f"![{each.piece.title}]({each.picture.name})", each.result.caption]
        if each.result.checks:
            rows = [cells(check) for check in each.result.checks]
            parts.append(_markdown_table(_HEADINGS, rows))
        for section in each.result.sections:
            parts += [f"### {section.title}", section.text]
            if section.table:
                parts.append(_markdown_table(tuple(section.table), _rows(section.table)))
        if each.result.tables:
            files = ", ".join(f"[{stem}.csv]({stem}.csv)" for stem in each.result.tables)
            parts.append(f"Numbers: {files}")
    return "\n\n".join(parts) + "\n"


def as_html(reproduction: Reproduction) -> str:
    """The report as one page that needs no other file: pictures are part of it."""
    disagreeing = [check for check in reproduction.checks if not check.agrees]
    links = "".join(
        f'<a href="#{each.piece.name}">{escape(each.piece.name)}</a>'
        for each in reproduction.pieces
    )
    title, introduction = _heading(reproduction)
    parts = [
        f"<h1>{escape(title)}</h1>",
        f"<p>{escape(introduction)}</p>",
        f"<p><strong>{escape(_counts_text(reproduction))}</strong></p>",
        f"<nav>{links}</nav>",
    ]
    if disagreeing:
        parts += ["<h2>Where they disagree</h2>", _html_checks(disagreeing)]
    parts += [_html_piece(each) for each in reproduction.pieces]
    body = "\n".join(parts)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{_STYLE}</style>\n</head>\n"
        f"<body>\n{body}\n</body>\n</html>\n"
    )


def _counts_text(reproduction: Reproduction) -> str:
    counts = ", ".join(f"{n} {verdict}" for verdict, n in reproduction.counts().items())
    return f"{len(reproduction.checks)} checks: {counts}."


def _markdown_table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(headings) + " |", "|" + "---|" * len(headings)]
    for row in rows:
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |")
    return "\n".join(lines)


def _html_checks(checks: Sequence[Check]) -> str:
    return _html_table(_HEADINGS, [_html_row(check) for check in checks])


def _html_section(section: Section) -> str:
    text = f"<h3>{escape(section.title)}</h3>\n<p>{escape(section.text)}</p>"
    if not section.table:
        return text
    rows = [
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>"
        for row in _rows(section.table)
    ]
    return text + "\n" + _html_table(tuple(section.table), rows)


def _html_table(headings: Sequence[str], rows: Sequence[str]) -> str:
    head = "".join(f"<th>{escape(heading)}</th>" for heading in headings)
    body = "\n".join(rows)
    return f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table>"


def _html_row(check: Check) -> str:
    kind = check.verdict.replace(" ", "-")
    columns = []
    for heading, cell in zip(_HEADINGS, cells(check), strict=True):
        text = escape(cell)
        if heading == "verdict":
            text = f'<span class="verdict {kind}">{text}</span>'
        number = ' class="number"' if heading in ("paper", "ours", "difference") else ""
        columns.append(f"<td{number}>{text}</td>")
    return f"<tr>{''.join(columns)}</tr>"


def _html_piece(each: Reproduced) -> str:
    parts = [f'<h2 id="{each.piece.name}">{escape(each.piece.title)}</h2>']
    if each.picture is not None:
        data = base64.b64encode(each.picture.read_bytes()).decode("ascii")
        parts.append(
            f'<figure><img alt="{escape(each.piece.title)}" src="data:image/png;base64,{data}">'
            f"<figcaption>{escape(each.result.caption)}</figcaption></figure>"
        )
    if each.result.checks:
        parts.append(_html_checks(each.result.checks))
    parts += [_html_section(section) for section in each.result.sections]
    return "\n".join(parts)
