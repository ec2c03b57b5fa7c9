"""Every piece that can be reproduced: the paper's in its order, then those of other publications."""

from __future__ import annotations

from functools import partial

from lean_yaw_env.paper.active_claims import active_claims
from lean_yaw_env.paper.active_figures import figure_10, figure_11
from lean_yaw_env.paper.bicycle_benchmark import bicycle_benchmark
from lean_yaw_env.paper.bicycle_figure import figure_4
from lean_yaw_env.paper.passive_claims import passive_claims
from lean_yaw_env.paper.passive_figures import figure_7, figure_8
from lean_yaw_env.paper.results import CLASSICS, PAPER, Piece, Result
from lean_yaw_env.paper.rolling_wheels import rolling_wheels
from lean_yaw_env.paper.simplest_walker import simplest_walker
from lean_yaw_env.paper.steering_claims import steering_claims
from lean_yaw_env.paper.steering_robots import steering_robots
from lean_yaw_env.paper.surface_figures import figure_9, figure_12
from lean_yaw_env.paper.tables import table_1, table_2, table_3
from lean_yaw_env.paper.uneven_ground import uneven_ground
from lean_yaw_env.paper.vehicle_drawings import figure_3, skateboard_figures
from lean_yaw_env.paper.velocity_figure import figure_13
from lean_yaw_env.paper.walking_figures import figure_14, figure_15
from lean_yaw_env.parameters import WalkerParameters
from lean_yaw_env.rendering import draw_walker

ALL = "all"
GROUPS = {ALL: PAPER, CLASSICS: CLASSICS}
"""Names that stand for every piece of a group."""


def walker_drawing() -> Result:
    """The walker with its parameters; Figures 5 and 6 are geometry."""
    return Result(
        picture=partial(draw_walker, WalkerParameters()),
        caption="The walker and its parameters, in place of Figures 5 and 6.",
    )


PIECES: tuple[Piece, ...] = (
    Piece("skateboard", "Skateboard, eqs. (1) to (3), Figures 1 and 2", skateboard_figures),
    Piece("figure3", "The bicycle (Figure 3)", figure_3),
    Piece("figure4", "Figure 4: the bicycle's eigenvalues", figure_4),
    Piece("walker", "The walker (Figures 5 and 6)", walker_drawing),
    Piece("table1", "Table 1: default parameters", table_1),
    Piece("table2", "Table 2: the fixed point of the walking motion", table_2),
    Piece("table3", "Table 3: multipliers of models A, B, C", table_3),
    Piece("figure7", "Figure 7: leg angles of the passive walkers", figure_7),
    Piece("claims-passive", "Claims about the passive walkers (section 4.1)", passive_claims),
    Piece("figure8", "Figure 8: passive flat walker against ankle tilt", figure_8),
    Piece("figure9", "Figure 9: passive walker against ankle tilt and hip width", figure_9),
    Piece("figure10", "Figure 10: active flat walker against ankle tilt", figure_10),
    Piece("figure11", "Figure 11: active flat walker against slope", figure_11),
    Piece("figure12", "Figure 12: active walker against ankle tilt and hip width", figure_12),
    Piece("figure13", "Figure 13: velocity and stability", figure_13),
    Piece(
        "claims-active", "The critical speed is about the ankle tilt (section 4.3)", active_claims
    ),
    Piece("figure14", "Figure 14: steady walk", figure_14),
    Piece("figure15", "Figure 15: steering", figure_15),
    Piece("claims-steering", "Circles and disturbances (section 4.4)", steering_claims),
    Piece(
        "simplest-walker",
        "The simplest walking model: Garcia et al. 1998, Bhounsule 2014",
        simplest_walker,
        CLASSICS,
    ),
    Piece(
        "rolling-wheels",
        "Rimless, round and synthetic wheels (McGeer 1990), rocking sideways (Kuo 1999)",
        rolling_wheels,
        CLASSICS,
    ),
    Piece(
        "uneven-ground",
        "On uneven ground: Hobbelen and Wisse 2007, Byl and Tedrake 2009",
        uneven_ground,
        CLASSICS,
    ),
    Piece(
        "bicycle-benchmark",
        "The benchmark bicycle: Meijaard et al. 2007, BicycleParameters",
        bicycle_benchmark,
        CLASSICS,
    ),
    Piece("steering-robots", "Steering walkers built since", steering_robots, CLASSICS),
)
NAMES = tuple(piece.name for piece in PIECES)


def pieces_named(names: tuple[str, ...] | list[str]) -> tuple[Piece, ...]:
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
                f"nothing is called {name!r}: name {ALL}, {CLASSICS} or some of {', '.join(NAMES)}"
            )
    wanted = {GROUPS[name] for name in names if name in GROUPS}
    return tuple(piece for piece in PIECES if piece.group in wanted or piece.name in names)
