"""Agents held against what an exhaustive search over chosen steps can save."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from typer.testing import CliRunner

from agents.command_line import app
from agents.evaluation.capture import (
    COLUMNS,
    MOST_STEPS,
    SETTLE_STEPS,
    CaptureReport,
    examine_capture,
    write_captures,
)
from agents.evaluation.closed_loop_interface import closed_loop
from agents.evaluation.closed_loop_report import box_starts
from agents.registry import AgentRequest, env_id_of, make_agent
from lean_yaw_env.analysis.many_walks import walk_many
from lean_yaw_env.envs.options import EnvOptions

STARTS, POINTS = 60, 7


def report_of(name: str, task: str = "Metastable", **settings: float) -> CaptureReport:
    agent = make_agent(name, AgentRequest(env_id_of(task), EnvOptions()))
    return examine_capture(name, agent, task, starts=STARTS, points=POINTS, **settings)  # pyright: ignore[reportArgumentType]


@pytest.fixture(scope="module")
def reports() -> tuple[CaptureReport, CaptureReport]:
    return report_of("fixed"), report_of("ppo")


def test_the_papers_controller_saves_what_needs_no_chosen_step_and_nothing_else(reports) -> None:
    fixed = reports[0]
    assert np.array_equal(fixed.is_saved, fixed.least_steps == 0)
    assert np.array_equal(fixed.plane_is_saved, fixed.plane_least_steps == 0)
    assert fixed.share(0) == 1.0
    assert fixed.saved_beyond == 0.0
    assert fixed.share(MOST_STEPS) == fixed.can_be_saved(0) / fixed.can_be_saved(MOST_STEPS)


def test_agents_of_a_task_are_held_against_the_same_sets(reports) -> None:
    fixed, ppo = reports
    assert np.array_equal(fixed.least_steps, ppo.least_steps)
    assert np.array_equal(fixed.plane_least_steps, ppo.plane_least_steps)
    shares = [ppo.can_be_saved(n) for n in range(MOST_STEPS + 1)]
    assert shares == sorted(shares)
    assert ppo.share() > fixed.share()  # PPO was trained to survive pushes


def test_what_an_agent_saves_is_what_it_walks_on_from(reports) -> None:
    agent = make_agent("ppo", AgentRequest(env_id_of("Metastable"), EnvOptions()))
    loop = closed_loop(agent, "Metastable", EnvOptions(friction_limit=float("inf")))
    walks = walk_many(loop, box_starts(loop, STARTS), MOST_STEPS + SETTLE_STEPS)
    assert np.array_equal(walks.survived, reports[1].is_saved)


def test_the_offset_changes_by_no_more_than_the_task_lets_an_agent_change_it() -> None:
    # Heading allows 0.005 a step, Metastable 0.1; their walkers and starts are the same but for that
    assert report_of("fixed", "Heading").can_be_saved(2) < report_of("fixed").can_be_saved(2)


def test_a_slippery_floor_leaves_less_to_be_saved(reports) -> None:
    slippery = report_of("fixed", friction_limit=0.3)
    assert np.all(slippery.least_steps >= reports[0].least_steps)


def test_numbers_and_pictures_are_written(tmp_path, reports) -> None:
    table, picture = write_captures(reports, tmp_path)
    with table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == COLUMNS
    assert len(rows) == 2 * (MOST_STEPS + 1)
    assert float(rows[2]["saved_of_these"]) == reports[0].share(2)
    assert picture.stat().st_size > 10_000


def test_the_command_prints_a_table_and_leaves_out_what_cannot_be_examined() -> None:
    arguments = ["capture", "--task", "Metastable,Level", "--agents", "fixed,mpc", "--starts", "8", "--points", "3"]  # fmt: skip
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    assert (
        "left out: Metastable: mpc: agent must answer from its observation alone" in result.output
    )
    assert "Level" in result.output
    alone = CliRunner().invoke(app, [*arguments[:2], "Metastable", "--agents", "mpc"])
    assert alone.exit_code != 0
