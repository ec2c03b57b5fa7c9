"""A number or statement of the paper set beside ours, with a verdict."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from lean_yaw_env.paper.numbers import PaperNumber, Statement

Verdict = Literal["agrees", "agrees within rounding", "differs", "open"]
VERDICTS: tuple[Verdict, ...] = ("agrees", "agrees within rounding", "differs", "open")
"""What a check can come to.

``agrees``: the statement holds, or the number is within a tolerance that is named with its reason.
``agrees within rounding``: ours, rounded to the printed digits, is the printed number.
``differs``: it is not, and the remark says why, or what both are. ``open``: it is not, and nobody
knows why.
"""

_ROUND_OFF = 1e-9


@dataclass(frozen=True)
class Check:
    """One row of the report.

    Attributes
    ----------
    name : str
        Unique within its piece.
    where : str
        The place in the paper.
    statement : str
        What the number is, or what the paper says.
    paper, ours : str
        As printed; ours with more digits.
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


def compare(
    number: PaperNumber, ours: float, *, remark: str = "", unless: str = "", is_open: bool = False
) -> Check:
    """Compare a number with the printed one.

    Parameters
    ----------
    number : PaperNumber
    ours : float
        In the paper's unit; nan where we find none.
    remark : str
        Said in any case.
    unless : str
        Said if the two disagree; the fallback names both numbers only.
    is_open : bool
        Whether a disagreement is unexplained.
    """
    difference = ours - number.value
    if abs(difference) <= number.room * (1.0 + _ROUND_OFF) + _ROUND_OFF**2:
        verdict: Verdict = "agrees within rounding" if number.tolerance is None else "agrees"
    else:
        verdict = "open" if is_open else "differs"
    sentences = [remark] if remark else []
    if verdict in ("differs", "open"):
        sentences.append(unless or f"The paper has {number.printed}, we find {ours:.5g}.")
    return Check(
        name=number.name,
        where=number.where,
        statement=number.meaning,
        paper=number.printed,
        ours="none found" if math.isnan(ours) else significant(ours, number),
        difference=None if math.isnan(ours) else difference,
        allowed=number.allowed,
        verdict=verdict,
        remark=" ".join(sentences),
    )


def judge(
    statement: Statement, holds: bool, *, ours: str, remark: str = "", unless: str = ""
) -> Check:
    """Judge a statement that is not one number.

    Parameters
    ----------
    statement : Statement
    holds : bool
    ours : str
        What we find, with its numbers.
    remark : str
        Said in any case.
    unless : str
        Said if it does not hold; one of the two is needed then.
    """
    return Check(
        name=statement.name,
        where=statement.where,
        statement=statement.meaning,
        paper=statement.printed,
        ours=ours,
        difference=None,
        allowed=statement.criterion,
        verdict="agrees" if holds else "differs",
        remark=" ".join(filter(None, [remark, "" if holds else unless])),
    )


def significant(ours: float, number: PaperNumber) -> str:
    """Ours with two digits more than are printed; a zero but for round-off as such."""
    if abs(ours) < _ROUND_OFF:
        return "0"
    text = f"{ours:.{number.decimals + 2}f}"
    return text if float(text) != 0.0 else f"{ours:.1e}"
