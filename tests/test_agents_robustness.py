"""Zero-shot robustness: what is varied, for whom agents are made, and what is written."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from agents import AgentRequest, make_agent
from agents.command_line import app
from agents.evaluation.episodes import RETURN
from agents.evaluation.plan import Candidate, Evaluation
from agents.evaluation.robustness import (
    NOMINAL,
    VARIATIONS,
    collapses,
    robustness_rows,
    varied,
)
from agents.evaluation.scoring import run_episodes
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.registration import TASK_VERSIONS

SHORT = EnvOptions(horizon=8.0)


@pytest.mark.parametrize("task", TASK_VERSIONS)
def test_every_variation_but_the_first_changes_one_option_of_every_task(task: str):
    for name in VARIATIONS:
        candidate = varied(Candidate(task, "fixed", 1, SHORT), name)
        changed = {k for k, v in vars(candidate.options).items() if v != getattr(SHORT, k)}
        assert len(changed) == (0 if name == NOMINAL else 1)
        observations, _ = WalkerVectorEnv(2, task, **vars(candidate.options)).reset(seed=0)
        assert np.isfinite(observations).all()


def test_an_agent_is_made_for_the_task_as_it_is_and_a_planner_for_what_it_plans_on():
    steeper = varied(Candidate("Heading", "lqr", 3, SHORT), "steeper")
    (found,) = Evaluation(progress=False).run([steeper])
    unaware = make_agent("lqr", AgentRequest("LeanYaw/Heading-v1", SHORT))
    own = run_episodes(unaware, "Heading", episodes=3, options=steeper.options)
    assert np.array_equal(found.values(RETURN)[0], own.metrics[RETURN])
    aware = make_agent("lqr", AgentRequest("LeanYaw/Heading-v1", steeper.options))
    other = run_episodes(aware, "Heading", episodes=3, options=steeper.options)
    assert not np.array_equal(other.metrics[RETURN], own.metrics[RETURN])
    assert varied(Candidate("Heading", "mpc", 1, SHORT), "steeper").made_for is None


def test_noise_costs_return():
    evaluation = Evaluation(episodes=8, options=SHORT, progress=False)
    candidates = evaluation.candidates(["Heading"], ["feedback"])
    rows = robustness_rows(candidates, evaluation, (NOMINAL, "noise 0.3"))
    assert [each.variation for each in rows] == [NOMINAL, "noise 0.3"]
    assert rows[1].row.mean < rows[0].row.mean


def test_the_command_writes_page_numbers_and_picture(tmp_path: Path):
    arguments = ["robustness", "--task", "Walk", "--agents", "random,fixed", "--episodes", "2", "--processes", "1"]  # fmt: skip
    result = CliRunner().invoke(app, [*arguments, "--runs", str(tmp_path), "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    rows = list(csv.DictReader((tmp_path / "robustness.csv").open()))
    assert len(rows) == 2 * len(VARIATIONS)
    assert [row["options"] for row in rows[:2]] == ["{}", '{"sensor_noise": 0.1}']
    assert all(line[0] == "Walk" for line in collapses(tmp_path / "robustness.csv"))
    page = (tmp_path / "robustness.md").read_text()
    assert "| agent | as it is | noise 0.1 |" in page
    assert (tmp_path / "images" / "robustness.png").read_bytes().startswith(b"\x89PNG")


def test_a_collapse_is_half_of_the_mean_or_nine_tenths_of_the_time_to_a_fall(tmp_path: Path):
    lines = [
        "task,agent,variation,mean,low",
        f"Heading,ppo,{NOMINAL},180,179", "Heading,ppo,delay,91,90", "Heading,ppo,noise 0.3,70,69", "Heading,ppo,steeper,80,79",
        f"Heading,lqr,{NOMINAL},180,179", "Heading,lqr,delay,170,169",
        f"Metastable,ppo,{NOMINAL},,5.5", "Metastable,ppo,delay,4.6,4.5", "Metastable,ppo,more pushes,2.1,2.0",
    ]  # fmt: skip
    (tmp_path / "robustness.csv").write_text("\n".join(lines))
    assert collapses(tmp_path / "robustness.csv") == [
        ["Heading", "ppo", "180.0", "noise 0.3 (70.0), steeper (80.0)"],
        ["Metastable", "ppo", "5.500", "more pushes (2.100)"],
    ]
