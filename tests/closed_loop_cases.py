"""Closed loops whose results are kept in ``closed_loops.json``; ``python -m tests.closed_loop_cases`` writes them anew, where agents have changed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from agents import AgentRequest, make_agent
from agents.evaluation.closed_loop_report import ClosedLoopReport, examine
from agents.registry import env_id_of
from lean_yaw_env.envs.options import EnvOptions

KEPT = Path(__file__).with_name("closed_loops.json")
CASES = (
    ("Heading", "fixed"),
    ("Heading", "lqr"),
    ("Heading", "ppo"),
    ("Metastable", "lqr"),
    ("Metastable", "ppo"),
    ("Level", "fixed"),
    ("Level", "lqr"),
    ("Level", "ppo"),
    ("SpeedHeading", "ppo"),
    ("Slalom", "ppo"),
    ("Waypoint", "ppo"),
)
NUMBERS = (
    "speed",
    "step_length",
    "stride_period",
    "gravity_work",
    "shift_work",
    "least_normal_force",
    "greatest_friction",
)


def examined(task: str, agent: str) -> ClosedLoopReport:
    """A case's report on small grids, of the agent that comes with the package."""
    request = AgentRequest(env_id_of(task), EnvOptions(), runs=None)
    return examine(agent, make_agent(agent, request), task, points=11, starts=128, directions=4)


def described(report: ClosedLoopReport) -> dict[str, Any]:
    """What is kept of a report: endings as one digit for each start."""
    record: dict[str, Any] = {
        "task": report.task,
        "agent": report.agent,
        "basins": [_digits(found.ending.to_numpy()) for found in report.basins],
        "box": _digits(report.box),
        "gait": None,
    }
    gait, pushes = report.gait, report.pushes
    if gait is not None and pushes is not None:
        record["gait"] = {
            "state": dict(zip(gait.section_map.names, gait.state.tolist(), strict=True)),
            "eigenvalues": [[m.eigenvalue.real, m.eigenvalue.imag] for m in report.modes],
            "errors": [mode.error for mode in report.modes],
            "about": [mode.about for mode in report.modes],
            "neutral": sum(mode.is_neutral for mode in report.modes),
            "commands": [list(step.command[:2]) for step in gait.steps],
            "is_at_limit": report.is_at_limit,
            "pushes": pushes.sizes.tolist(),
            **{name: getattr(gait, name) for name in NUMBERS},
        }
    return record


def _digits(values: np.ndarray) -> str:
    return "".join(str(int(value)) for value in values.ravel())


if __name__ == "__main__":
    lines = [json.dumps(described(examined(*case))) for case in CASES]
    KEPT.write_text("[\n" + ",\n".join(lines) + "\n]\n", encoding="utf-8")
