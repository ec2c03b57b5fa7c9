"""Push at other levels: how many walkers are still on their feet after 200 steps, against how hard they are pushed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from agents.evaluation.agenda import Entrant, Walked
from agents.evaluation.results import Row, metric_row
from lean_yaw_env.envs.tasks import task_named

TASK = "Push"
METRIC = "survived_200_steps"
LEVELS = (0.2, 0.4, 0.6, 0.8, 1.0)


@dataclass(frozen=True)
class LevelRow:
    """An agent's share of survived trials at a push level."""

    level: float
    row: Row


def level_entrants(entrants: Sequence[Entrant], levels: Sequence[float] = LEVELS) -> list[Entrant]:
    """The agents of Push once for each level."""
    return [
        replace(entrant, options=replace(entrant.options, push_level=level))
        for entrant in entrants
        if entrant.task == TASK
        for level in levels
    ]


def level_rows(walked: Sequence[Walked]) -> list[LevelRow]:
    """A row for each agent of Push and level, the task's own level among them."""
    rows: list[LevelRow] = []
    for each in walked:
        if each.entrant.task == TASK:
            level = each.entrant.options.push_level
            own = task_named(TASK).push_level if level is None else level
            rows.append(LevelRow(own, metric_row(each.results, METRIC)))
    return rows
