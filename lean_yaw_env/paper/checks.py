"""Printed numbers and statements set beside ours, with a verdict, and what a piece of the report is made of.

``printed.csv`` has what the paper prints: M. Wisse and A. L. Schwab, "Skateboards, Bicycles, and Three-dimensional
Biped Walking Machines: Velocity-dependent Stability by Means of Lean-to-yaw Coupling", Int. J. Robotics
Research 24 (2005) 417-429. ``classics.csv`` has what other publications print; "secondary" marks a number that
was read elsewhere than in the publication itself. Dimensionless but for skateboard and bicycle, which are
in SI units.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Literal

from lean_yaw_env.tables import read_csv

Verdict = Literal["agrees", "agrees within rounding", "differs", "open"]
VERDICTS: tuple[Verdict, ...] = ("agrees", "agrees within rounding", "differs", "open")
"""What a check can come to.

``agrees``: the statement holds, or the number is within a tolerance that is named with its reason.
``agrees within rounding``: ours, rounded to the printed digits, is the printed number.
``differs``: it is not, and the remark says why, or what both are. ``open``: it is not, and nobody
knows why.
"""

Columns = Mapping[str, Iterable[Any]]
"""Equally long columns by their headings."""

_ROUND_OFF = 1e-9


@dataclass(frozen=True)
class Printed:
    """A number or a statement as printed: a row of the tables.

    Attributes
    ----------
    name : str
        Unique.
    printed : str
        A number's digits, whose last place says how far it was rounded; a statement's words, shortened.
    where : str
        The place where it stands, and the source, if that is not the paper.
    meaning : str
    tolerance : float or None
        Greatest difference of a number that agrees; None for half of the last printed digit.
    allowed : str
        Why a number has another tolerance; what has to hold for a statement to agree, where its words leave room.
    is_open : bool
        Whether a disagreement is unexplained.
    remark, otherwise : str
        What the report says in any case, and if the two disagree.
    """

    name: str
    printed: str
    where: str
    meaning: str
    tolerance: float | None = None
    allowed: str = ""
    is_open: bool = False
    remark: str = ""
    otherwise: str = ""

    @property
    def value(self) -> float:
        return float(self.printed)


@cache
def _rows() -> dict[str, Printed]:
    found: dict[str, Printed] = {}
    for table in ("printed.csv", "classics.csv"):
        for row in read_csv(Path(__file__).with_name(table)):
            is_open, tolerance = bool(row.pop("open")), row.pop("tolerance")
            found[row["name"]] = Printed(
                **row, is_open=is_open, tolerance=float(tolerance) if tolerance else None
            )
    return found


def printed(name: str) -> Printed:
    """What is printed under a name, or ``KeyError``."""
    return _rows()[name]


def names_of(beginning: str) -> list[str]:
    """The names of the tables that begin so, in their order."""
    return [name for name in _rows() if name.startswith(beginning)]


@dataclass(frozen=True)
class Check:
    """One row of the report.

    Attributes
    ----------
    name, where, statement, paper : str
        What is printed, as in ``Printed``; ``statement`` is its meaning.
    ours : str
        What we find; a number with two digits more than the printed one.
    difference : float or None
        Ours less the paper's, where both are numbers.
    allowed : str
        What agrees: the tolerance with its reason, or the criterion.
    verdict : Verdict
    remark : str
        A plain sentence; never empty where the two disagree.
    """

    name: str
    where: str
    statement: str
    paper: str
    ours: str
    difference: float | None
    allowed: str
    verdict: Verdict
    remark: str = ""

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            raise ValueError(f"verdict must be one of {', '.join(VERDICTS)}, got {self.verdict!r}")
        if not self.agrees and not self.remark:
            raise ValueError(f"check {self.name!r} disagrees, which needs a remark that says how")

    @property
    def agrees(self) -> bool:
        """Whether the paper and we say the same."""
        return self.verdict in ("agrees", "agrees within rounding")


def compare(row: Printed | str, ours: float, *, remark: str = "", otherwise: str = "") -> Check:
    """Compare a number, in the paper's unit, with the printed one or that of a name; nan is none found.

    ``remark`` and ``otherwise`` take the place of the row's. Raises ``ValueError`` if the row has a tolerance without a reason, or the
    other way round.
    """
    row = printed(row) if isinstance(row, str) else row
    ours = float(ours)
    if (row.tolerance is None) != (not row.allowed):
        raise ValueError(f"number {row.name!r} needs a reason for its tolerance, and no other")
    decimals = len(row.printed.partition(".")[2])
    room = 0.5 * 10.0**-decimals if row.tolerance is None else row.tolerance
    difference = ours - row.value
    agreed: Verdict | None = None
    if abs(difference) <= room * (1.0 + _ROUND_OFF) + _ROUND_OFF**2:
        agreed = "agrees within rounding" if row.tolerance is None else "agrees"
    allowed = f"± {room:.2g}: {row.allowed or 'half of the last printed digit'}"
    both = f"The paper has {row.printed}, we find {ours:.5g}."
    sentences = (remark or row.remark, otherwise or row.otherwise or both)
    if math.isnan(ours):
        return _check(row, agreed, "none found", None, allowed, *sentences)
    return _check(row, agreed, significant(ours, decimals), difference, allowed, *sentences)


def compare_all(beginning: str, ours: Iterable[float], *, otherwise: str = "") -> list[Check]:
    """Compare numbers with the printed ones whose names begin so, in the tables' order."""
    pairs = zip(names_of(beginning), ours, strict=True)
    return [compare(name, value, otherwise=otherwise) for name, value in pairs]


def assess(
    row: Printed | str, holds: bool, ours: str, *, remark: str = "", otherwise: str = ""
) -> Check:
    """Say whether a printed statement, or that of a name, holds; ``ours`` is what we find, with its numbers.

    ``remark`` and ``otherwise`` take the place of the row's.
    """
    row = printed(row) if isinstance(row, str) else row
    always = remark or row.remark
    fallback = otherwise or row.otherwise or ("" if always else "It does not hold.")
    return _check(row, "agrees" if holds else None, ours, None, row.allowed, always, fallback)


def _check(
    row: Printed, agreed: Verdict | None, ours: str, difference: float | None, allowed: str,
    always: str, otherwise: str,
) -> Check:  # fmt: skip
    verdict: Verdict = agreed or ("open" if row.is_open else "differs")
    remark = " ".join(filter(None, (always, "" if agreed else otherwise)))
    return Check(
        row.name, row.where, row.meaning, row.printed, ours, difference, allowed, verdict, remark
    )


def significant(ours: float, decimals: int) -> str:
    """Ours with two digits more than are printed; a zero but for round-off as such."""
    if abs(ours) < _ROUND_OFF:
        return "0"
    text = f"{ours:.{decimals + 2}f}"
    return text if float(text) != 0.0 else f"{ours:.1e}"


@dataclass(frozen=True)
class Section:
    """A part of the report that no verdict sums up: what was tried, or a number of ours alone.

    Attributes
    ----------
    title, text : str
    table : Columns
        Shown beneath; cells as they are to be read.
    """

    title: str
    text: str
    table: Columns = field(default_factory=dict)


@dataclass(frozen=True)
class Result:
    """The reproduction of one piece of the paper.

    Attributes
    ----------
    checks : sequence of Check
    tables : mapping of file stems to columns
        Written as one CSV file each.
    picture : function or None
        Writes the picture into a PNG file of the given path, whole or not at all.
    sections : sequence of Section
    """

    checks: Sequence[Check] = ()
    tables: Mapping[str, Columns] = field(default_factory=dict)
    picture: Callable[[Path], None] | None = None
    sections: tuple[Section, ...] = ()
