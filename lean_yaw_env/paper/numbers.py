"""Numbers and statements as printed, each once, with the place where it stands.

``printed.csv`` has the paper's: M. Wisse and A. L. Schwab, "Skateboards, Bicycles, and Three-dimensional
Biped Walking Machines: Velocity-dependent Stability by Means of Lean-to-yaw Coupling", Int. J. Robotics
Research 24 (2005) 417-429. ``classics.csv`` has those of other publications; "secondary" marks one that
was read elsewhere than in the publication itself. Dimensionless but for skateboard and bicycle, which are
in SI units.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

_TABLES = ("printed.csv", "classics.csv")


@dataclass(frozen=True)
class PaperNumber:
    """A number as printed.

    Attributes
    ----------
    name : str
    printed : str
        The digits; their last place says how far it was rounded.
    where : str
        The place where it stands, and the source, if that is not the paper.
    meaning : str
    tolerance : float or None
        Greatest difference that agrees; None for half of the last printed digit.
    reason : str
        Why the tolerance is another one.
    """

    name: str
    printed: str
    where: str
    meaning: str
    tolerance: float | None = None
    reason: str = ""

    def __post_init__(self) -> None:
        if (self.tolerance is None) != (not self.reason):
            raise ValueError(f"number {self.name!r} needs a reason for its tolerance, and no other")

    @property
    def value(self) -> float:
        return float(self.printed)

    @property
    def decimals(self) -> int:
        """Digits behind the point."""
        return len(self.printed.partition(".")[2])

    @property
    def room(self) -> float:
        """Greatest difference that agrees."""
        return 0.5 * 10.0**-self.decimals if self.tolerance is None else self.tolerance

    @property
    def allowed(self) -> str:
        """The room with its reason."""
        return f"± {self.room:.2g}: {self.reason or 'half of the last printed digit'}"


@dataclass(frozen=True)
class Statement:
    """What is printed without one number.

    Attributes
    ----------
    name : str
    printed : str
        The words, shortened.
    where : str
    meaning : str
    criterion : str
        What has to hold for it to agree, where the words leave room.
    """

    name: str
    printed: str
    where: str
    meaning: str
    criterion: str = ""


@cache
def _printed() -> dict[str, PaperNumber | Statement]:
    """All rows of the tables by name."""
    found: dict[str, PaperNumber | Statement] = {}
    for table in _TABLES:
        with Path(__file__).with_name(table).open(encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                text = (row["name"], row["printed"], row["where"], row["meaning"])
                if row["kind"] == "number":
                    tolerance = float(row["tolerance"]) if row["tolerance"] else None
                    found[row["name"]] = PaperNumber(*text, tolerance, row["allowed"])
                else:
                    found[row["name"]] = Statement(*text, row["allowed"])
    return found


def number(name: str) -> PaperNumber:
    """The printed number of a name, or ``KeyError``."""
    found = _printed()[name]
    assert isinstance(found, PaperNumber), name
    return found


def numbers_of(beginning: str) -> tuple[PaperNumber, ...]:
    """The printed numbers whose names begin so, in their order."""
    return tuple(number(name) for name in _printed() if name.startswith(beginning))


def statement(name: str) -> Statement:
    """The printed statement of a name, or ``KeyError``."""
    found = _printed()[name]
    assert isinstance(found, Statement), name
    return found


PASSIVE_SLOPE = 0.00058
"""Slope of the arc-foot walkers, section 4.1."""
POINT_FOOT_SLOPE = 0.004
"""Slope of the point-foot walker, section 4.1."""
FLAT_TILT = 0.15
"""Ankle tilt of Table 3, column C."""
SMALL_OFFSET, LARGE_OFFSET = 0.006, 0.05
"""Mass offsets of Figure 15, to the right."""
CRITICAL_TILTS = (math.pi / 8.0, math.pi / 4.0)
"""Ankle tilts of Figure 13."""
GARCIA_SLOPE = 0.009
"""Slope of the published gaits of the simplest walker."""
