"""Reproduce pieces of the paper into a folder: pictures, numbers, and a report as Markdown and as one HTML page."""

from __future__ import annotations

import base64
import hashlib
import itertools
import re
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from html import escape
from pathlib import Path

import numba
import numpy as np
import scipy

import lean_yaw_env
from lean_yaw_env.errors import LeanYawError
from lean_yaw_env.extras import needs_extra
from lean_yaw_env.files import locked, read_json, write_json, write_text
from lean_yaw_env.paper.checks import VERDICTS, Check, Columns, Result, Section
from lean_yaw_env.paper.registry import CLASSICS, PAPER, Piece, pieces_named
from lean_yaw_env.tables import csv_table, markdown_table

_FINISHED = ".finished"
"""Folder with what is finished, a file for each piece."""
_TITLES = {
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
         border-bottom: 1px solid #e4e0d6; font-variant-numeric: tabular-nums; }
th { background: #efece4; } td:nth-child(8) { min-width: 16rem; }
img { max-width: 100%; background: white; border: 1px solid #e4e0d6; border-radius: 4px; }
p:has(> img) { margin-bottom: .4rem; } p:has(> img) + p { font-size: .87rem; color: #5c5e66; margin-top: 0; }
.verdict { white-space: nowrap; border-radius: 3px; padding: .05rem .4rem; }
.agrees, .agrees-within-rounding { background: #dcefdf; } .differs { background: #f8d9cf; }
.open { background: #f7eabf; } nav a { margin-right: .9rem; white-space: nowrap; }
"""


@dataclass(frozen=True)
class Reproduced:
    """A piece with what came of it; ``picture`` is the PNG file, or None."""

    piece: Piece
    result: Result
    picture: Path | None


@dataclass(frozen=True)
class Reproduction:
    """All pieces asked for, in the paper's order."""

    pieces: tuple[Reproduced, ...]

    @property
    def checks(self) -> tuple[Check, ...]:
        return tuple(check for each in self.pieces for check in each.result.checks)

    def counts(self) -> dict[str, int]:
        """How many checks came to each verdict."""
        return {v: sum(check.verdict == v for check in self.checks) for v in VERDICTS}

    def rows(self) -> list[dict[str, str | float | None]]:
        """One dictionary for each check: its piece, and its attributes."""
        return [
            {"piece": each.piece.name, **asdict(check)}
            for each in self.pieces
            for check in each.result.checks
        ]


def reproduce(names: Sequence[str], folder: Path, *, progress: bool = False) -> Reproduction:
    """Compute pieces of the paper and write their pictures (PNG) and numbers (CSV).

    Each file is written whole or not at all as soon as it is known. What an earlier call with the same code has finished in this folder is
    not computed again, so that an interruption costs only the piece in work.

    Parameters
    ----------
    names : names of pieces, "all" or "classics"
    folder : Path
        Created if it does not exist.
    progress : bool
        Show a progress bar.

    Raises
    ------
    ValueError
        If a name is unknown, or the folder is a file.
    LeanYawError
        If a piece cannot be computed; names it. ``BusyError`` if another process is at work in the folder.
    """
    with needs_extra("analysis"):
        from tqdm.auto import tqdm
    pieces = pieces_named(names)
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"the output folder {str(folder)!r} is a file")
    (folder / _FINISHED).mkdir(parents=True, exist_ok=True)
    code, done = _code_digest(), list[Reproduced]()
    with locked(folder), tqdm(pieces, unit="piece", disable=not progress) as bar:
        for piece in bar:
            bar.set_description(piece.name)
            done.append(_finished(piece, folder, code) or _reproduced(piece, folder, code))
    return Reproduction(tuple(done))


def _reproduced(piece: Piece, folder: Path, code: str) -> Reproduced:
    """Compute a piece, write its files, and note that it is finished."""
    try:
        result = piece.make()
    except LeanYawError as error:
        raise LeanYawError(f"{piece.name}: {error}") from error
    for stem, columns in result.tables.items():
        write_columns(folder / f"{stem}.csv", columns)
    picture = folder / f"{piece.name}.png" if result.picture else None
    if result.picture and picture:
        result.picture(picture)
    record = {
        "code": code,
        "checks": [asdict(check) for check in result.checks],
        "tables": list(result.tables),
        "sections": [asdict(section) for section in result.sections],
        "picture": picture is not None,
    }
    write_json(folder / _FINISHED / f"{piece.name}.json", record)
    return Reproduced(piece, result, picture)


def _finished(piece: Piece, folder: Path, code: str) -> Reproduced | None:
    """A piece that the same code has finished in this folder; None if it has not, or a file is missing or damaged."""
    try:
        record = read_json(folder / _FINISHED / f"{piece.name}.json")
        if record["code"] != code:
            return None
        checks = [Check(**check) for check in record["checks"]]
        sections = tuple(Section(**section) for section in record["sections"])
        result = Result(checks, {stem: {} for stem in record["tables"]}, sections=sections)
        picture = folder / f"{piece.name}.png" if record["picture"] else None
    except (ValueError, KeyError, TypeError):
        return None
    files = [folder / f"{stem}.csv" for stem in result.tables] + ([picture] if picture else [])
    return Reproduced(piece, result, picture) if all(map(Path.is_file, files)) else None


@lru_cache(maxsize=1)
def _code_digest() -> str:
    """A digest of all that the numbers depend on."""
    package = Path(str(lean_yaw_env.__file__)).parent
    digest = hashlib.sha256(f"{np.__version__} {scipy.__version__} {numba.__version__}".encode())
    for file in sorted([*package.rglob("*.py"), *package.rglob("*.csv")]):
        digest.update(file.read_bytes())
    return digest.hexdigest()


def write_columns(path: Path, columns: Columns) -> None:
    """Write equally long columns as CSV, whole or not at all.

    Raises
    ------
    ValueError
        If the columns have different lengths.
    """
    write_text(path, csv_table(columns, zip(*columns.values(), strict=True)))


def write_report(reproduction: Reproduction, folder: Path) -> tuple[Path, Path]:
    """Write ``report.md``, ``report.html`` and ``checks.csv``, each whole or not at all; returns the paths of the first two."""
    markdown, page = folder / "report.md", folder / "report.html"
    rows = reproduction.rows()
    if rows:
        write_columns(folder / "checks.csv", {key: [row[key] for row in rows] for key in rows[0]})
    write_text(markdown, as_markdown(reproduction))
    write_text(page, as_html(reproduction))
    return markdown, page


def as_markdown(reproduction: Reproduction) -> str:
    """The report in Markdown; pictures by their file names beside it."""
    counts = ", ".join(f"{n} {verdict}" for verdict, n in reproduction.counts().items())
    groups = {each.piece.group for each in reproduction.pieces}
    introductions = [text for group, text in _INTRODUCTIONS.items() if group in groups]
    parts = [
        f"# {_title(reproduction)}",
        " ".join([*introductions, _VERDICTS]),
        f"**{len(reproduction.checks)} checks: {counts}.**",
    ]
    disagreeing = [check for check in reproduction.checks if not check.agrees]
    if disagreeing:
        parts += ["## Where they disagree", _checks_table(disagreeing)]
    for each in reproduction.pieces:
        parts.append(f"## {each.piece.title}")
        if each.picture is not None:
            parts += [f"![{each.piece.title}]({each.picture.name})", each.piece.caption]
        if each.result.checks:
            parts.append(_checks_table(each.result.checks))
        for section in each.result.sections:
            parts += [f"### {section.title}", section.text]
            if section.table:
                rows = zip(*section.table.values(), strict=True)
                parts.append(markdown_table(list(section.table), rows))
        if each.result.tables:
            files = ", ".join(f"[{stem}.csv]({stem}.csv)" for stem in each.result.tables)
            parts.append(f"Numbers: {files}")
    return "\n\n".join(parts) + "\n"


def as_html(reproduction: Reproduction) -> str:
    """The report as one page that needs no other file: the Markdown one with its pictures as part of it."""
    with needs_extra("analysis"):
        from markdown_it import MarkdownIt

    parser = MarkdownIt("commonmark", {"html": False, "xhtmlOut": False}).enable("table")
    tokens = parser.parse(as_markdown(reproduction))
    names = {each.piece.title: each.piece.name for each in reproduction.pieces}
    pictures = {each.picture.name: each.picture for each in reproduction.pieces if each.picture}
    for token, following in itertools.pairwise(tokens):
        if token.tag == "h2" and following.content in names:
            token.attrSet("id", names[following.content])
        for child in token.children or ():
            if child.type == "image":
                data = pictures[str(child.attrs["src"])].read_bytes()
                child.attrSet("src", f"data:image/png;base64,{base64.b64encode(data).decode()}")
    body = parser.renderer.render(tokens, parser.options, {})
    links = " ".join(f'<a href="#{name}">{name}</a>' for name in names.values())
    body = body.replace("</h1>", f"</h1>\n<nav>{links}</nav>", 1)
    for verdict in VERDICTS:
        span = f'<span class="verdict {verdict.replace(" ", "-")}">{verdict}</span>'
        body = body.replace(f"<td>{verdict}</td>", f"<td>{span}</td>")
    # Files beside the Markdown report, which this page does without
    body = re.sub(r"<p>Numbers: .*?</p>\n", "", body)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(_title(reproduction))}</title>\n<style>{_STYLE}</style>\n</head>\n"
        f"<body>\n{body}</body>\n</html>\n"
    )


def _title(reproduction: Reproduction) -> str:
    groups = {each.piece.group for each in reproduction.pieces}
    return next((title for group, title in _TITLES.items() if group in groups), _TITLES[PAPER])


def _checks_table(checks: Iterable[Check]) -> str:
    rows = []
    for check in checks:
        difference = "" if check.difference is None else f"{check.difference:+.2g}"
        what = f"{check.name}: {check.statement}"
        both = (what, check.where, check.paper, check.ours, difference)
        rows.append((*both, check.allowed, check.verdict, check.remark))
    return markdown_table(_HEADINGS, rows)
