"""The paper's numbers and statements, each once in ``printed.csv``, with the place where it stands.

M. Wisse and A. L. Schwab, "Skateboards, Bicycles, and Three-dimensional Biped Walking Machines:
Velocity-dependent Stability by Means of Lean-to-yaw Coupling", Int. J. Robotics Research 24 (2005)
417-429. Dimensionless but for the bicycle, which is in SI units.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path


@dataclass(frozen=True)
class PaperNumber:
    """A number as printed.

    Attributes
    ----------
    name : str
    printed : str
        The digits; their last place says how far it was rounded.
    where : str
    meaning : str
    about : float
        Relative room where the paper says "about", "almost" or reads a sketch; 0 where it does not.
    is_rounded : bool
        Whether the printed digits are a rounded result, which ours must round to.
    """

    name: str
    printed: str
    where: str
    meaning: str
    about: float = 0.0
    is_rounded: bool = True

    @property
    def value(self) -> float:
        return float(self.printed)

    @property
    def decimals(self) -> int:
        """Digits behind the point."""
        return len(self.printed.partition(".")[2])

    @property
    def half_digit(self) -> float:
        """Half a unit of the last printed place: what rounding may hide; 0 if nothing was rounded."""
        return 0.0 if not self.is_rounded else 0.5 * 10.0**-self.decimals


@dataclass(frozen=True)
class Statement:
    """What the paper says without one number.

    Attributes
    ----------
    name : str
    printed : str
        The paper's words, shortened.
    where : str
    meaning : str
    """

    name: str
    printed: str
    where: str
    meaning: str


@cache
def _printed() -> dict[str, PaperNumber | Statement]:
    """All rows of ``printed.csv`` by name."""
    found: dict[str, PaperNumber | Statement] = {}
    with Path(__file__).with_name("printed.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            text = (row["name"], row["printed"], row["where"], row["meaning"])
            if row["kind"] == "number":
                about = float(row["about"] or 0.0)
                found[row["name"]] = PaperNumber(*text, about, row["rounded"] != "no")
            else:
                found[row["name"]] = Statement(*text)
    return found


def number(name: str) -> PaperNumber:
    """The paper's number of a name, or ``KeyError``."""
    found = _printed()[name]
    assert isinstance(found, PaperNumber), name
    return found


def numbers_of(beginning: str) -> tuple[PaperNumber, ...]:
    """The paper's numbers whose names begin so, in its order."""
    return tuple(number(name) for name in _printed() if name.startswith(beginning))


def statement(name: str) -> Statement:
    """The paper's statement of a name, or ``KeyError``."""
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
