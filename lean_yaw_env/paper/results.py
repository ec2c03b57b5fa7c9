"""What one table, figure or group of claims comes to: checks, columns of numbers, a picture."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lean_yaw_env.paper.checks import Check

PAPER, CLASSICS = "paper", "classics"
"""Groups of pieces: what the paper has, and what other publications have."""

Columns = Mapping[str, Iterable[Any]]
"""Equally long columns by their headings."""


@dataclass(frozen=True)
class Section:
    """A part of the report that no verdict sums up: what was tried, or a number of ours alone.

    Attributes
    ----------
    title : str
    text : str
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
    checks : tuple of Check
    tables : mapping of file stems to columns
        Written as one CSV file each.
    picture : function or None
        Writes the picture into a PNG file of the given path, whole or not at all.
    caption : str
        What the picture shows and what in it is our choice.
    sections : tuple of Section
    """

    checks: tuple[Check, ...] = ()
    tables: Mapping[str, Columns] = field(default_factory=dict)
    picture: Callable[[Path], None] | None = None
    caption: str = ""
    sections: tuple[Section, ...] = ()


@dataclass(frozen=True)
class Piece:
    """A table, figure or group of claims that can be reproduced.

    Attributes
    ----------
    name : str
        As given to ``lean-yaw reproduce``.
    title : str
    make : function
        Computes it.
    group : PAPER or CLASSICS
    """

    name: str
    title: str
    make: Callable[[], Result]
    group: str = PAPER
