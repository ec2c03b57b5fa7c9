"""Every piece that can be reproduced, as ``pieces.csv`` lists them: the paper's in its order, then those of other publications."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from lean_yaw_env.paper import (
    active,
    passive,
    simplest_walker,
    steering,
    tables,
    uneven_ground,
    vehicles,
    wheels,
    wide_hips,
)
from lean_yaw_env.paper.checks import Result
from lean_yaw_env.parameters import WalkerParameters
from lean_yaw_env.rendering import draw_walker
from lean_yaw_env.tables import read_csv

PAPER, CLASSICS = "paper", "classics"
"""Groups of pieces: what the paper has, and what other publications have."""
GROUPS = {"all": PAPER, CLASSICS: CLASSICS}
"""Names that stand for every piece of a group."""


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
    caption : str
        What the picture shows and what in it is our choice.
    """

    name: str
    title: str
    make: Callable[[], Result]
    group: str = PAPER
    caption: str = ""


def _walker_drawing() -> Result:
    """Figures 5 and 6 are geometry."""
    return Result(picture=partial(draw_walker, WalkerParameters()))


_MAKERS: dict[str, Callable[[], Result]] = {
    "skateboard": vehicles.skateboard,
    "figure3": vehicles.figure_3,
    "figure4": vehicles.figure_4,
    "walker": _walker_drawing,
    "table1": tables.table_1,
    "table2": tables.table_2,
    "table3": tables.table_3,
    "figure7": passive.figure_7,
    "claims-passive": passive.passive_claims,
    "figure8": passive.figure_8,
    "figure9": wide_hips.figure_9,
    "figure10": active.figure_10,
    "figure11": active.figure_11,
    "figure12": wide_hips.figure_12,
    "figure13": active.figure_13,
    "claims-active": active.active_claims,
    "figure14": steering.figure_14,
    "figure15": steering.figure_15,
    "claims-steering": steering.steering_claims,
    "simplest-walker": simplest_walker.simplest_walker,
    "rolling-wheels": wheels.rolling_wheels,
    "uneven-ground": uneven_ground.uneven_ground,
    "bicycle-benchmark": wheels.bicycle_benchmark,
    "steering-robots": steering.steering_robots,
}


def _pieces() -> tuple[Piece, ...]:
    rows = read_csv(Path(__file__).with_name("pieces.csv"))
    return tuple(Piece(make=_MAKERS[row["name"]], **row) for row in rows)


PIECES = _pieces()
NAMES = tuple(piece.name for piece in PIECES)


def pieces_named(names: Sequence[str]) -> tuple[Piece, ...]:
    """Pieces by their names, in the order of ``PIECES``, each once.

    ``all`` names every piece of the paper, ``classics`` every piece of other publications.

    Raises
    ------
    ValueError
        If there is no piece of a name, or no name.
    """
    if not names:
        raise ValueError(f"name at least one of {', '.join((*GROUPS, *NAMES))}")
    for name in names:
        if name not in GROUPS and name not in NAMES:
            raise ValueError(
                f"nothing is called {name!r}: name {', '.join(GROUPS)} or some of {', '.join(NAMES)}"
            )
    wanted = {GROUPS[name] for name in names if name in GROUPS}
    return tuple(piece for piece in PIECES if piece.group in wanted or piece.name in names)
