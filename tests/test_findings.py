"""The page of findings: its numbers are those of its files, and its claims are computed anew."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from agents.evaluation.capture import examine_capture
from agents.evaluation.closed_loop_interface import closed_loop
from agents.evaluation.closed_loop_report import box_starts
from agents.registry import AgentRequest, env_id_of, make_agent
from lean_yaw_env.analysis import (
    Choices,
    capture,
    capture_map,
    continue_gait,
    find_limit_cycle,
    modes,
    stability_map,
)
from lean_yaw_env.analysis.many_walks import walk_many
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.kernel.records import SLIP
from lean_yaw_env.paper import findings
from lean_yaw_env.paper.findings import CLIMBER, FRICTION, SAVED
from lean_yaw_env.walker import Walker

DOCS = Path(__file__).parents[1] / "docs"


def rows_of(name: str) -> list[dict[str, str]]:
    with (DOCS / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


VALUES = {row["name"]: float(row["value"]) for row in rows_of("findings.csv")}


def test_the_page_has_the_numbers_of_its_files() -> None:
    assert (DOCS / "findings.md").read_text(encoding="utf-8") == findings.page(DOCS)


def test_a_small_run_writes_page_numbers_and_pictures(tmp_path: Path) -> None:
    page = findings.write_findings(tmp_path, size=0.15)
    text = page.read_text(encoding="utf-8")
    assert "What chosen steps can save" in text
    assert "What learned policies save" not in text  # no agents were examined
    names = {path.name for path in (tmp_path / "images").iterdir()}
    assert names == {f"findings_{name}.png" for name in findings.PICTURES}
    assert len((tmp_path / "findings.csv").read_text().splitlines()) == len(VALUES) + 1


def test_every_number_of_the_page_is_computed_anew() -> None:
    found = findings.numbers(findings.compute())
    # a point of a map at the edge of its region may fall to either side on another processor; the maps have 1,000 points and more
    assert {name: value for name, (value, _) in found.items()} == pytest.approx(
        VALUES, rel=2e-3, abs=2e-3
    )


# --- walking on the level and uphill


def test_the_steepest_climbs_are_those_of_the_page() -> None:
    angles = np.array([0.15, 0.2, 0.25])
    axes = {"inter_leg_angle": angles, "slope": np.linspace(-0.06, 0.01, 71), "alternating_offset": np.linspace(0.002, 0.08, 53)}  # fmt: skip
    for kind, found in findings.climbs(stability_map(CLIMBER, axes)).items():
        assert VALUES[f"climb_{kind}_angle"] == pytest.approx(angles[found.argmax()])
        assert VALUES[f"climb_{kind}"] == pytest.approx(found.max(), abs=1.1e-3)  # the map's step


def test_gaits_on_the_level_end_where_the_foot_lifts_off_or_no_longer_comes_down() -> None:
    level = Walker(replace(CLIMBER.parameters, slope=0.0))
    for upward, name, why in ((False, "least", "no-heel-strike"), (True, "greatest", "lift-off")):
        branch = continue_gait(level, "alternating_offset", (0.001, 0.08), mass_offset=(0.03, -0.03), upward=upward, longest_step=0.01)  # fmt: skip
        assert why in branch.ended
        end = branch.values.max() if upward else branch.values.min()
        assert VALUES[f"level_{name}_offset"] == pytest.approx(end, abs=1.6e-3)  # the map's step


def test_a_climbing_walker_turns_round_by_itself() -> None:
    uphill = Walker(replace(CLIMBER.parameters, slope=-0.005, slope_turns=False))
    gait = find_limit_cycle(uphill, mass_offset=(0.03, -0.03))
    growing = [mode for mode in modes(gait) if abs(mode.eigenvalue) > 1.0]
    assert [mode.about for mode in growing] == ["heading"]
    turning = Walker(replace(uphill.parameters, slope_turns=True))
    assert find_limit_cycle(turning, mass_offset=(0.03, -0.03)).is_stable


# --- stability over body and slope


@pytest.mark.parametrize("slope", findings.STABILITY["slope"])
def test_the_stable_share_of_bodies_is_that_of_the_page(slope: float) -> None:
    axes = {"slope": np.array([slope]), "ankle_tilt": np.linspace(0.05, 1.3, 64), "hip_width": np.linspace(0.0, 0.6, 61)}  # fmt: skip
    stable = findings.is_stable(stability_map(Walker(), axes))
    # a neighbour on another slope may lead to a gait that no neighbour here leads to
    assert float(stable.mean()) == pytest.approx(VALUES[f"stable_share_{slope:g}"], abs=0.005)


def test_the_share_of_stable_bodies_grows_with_the_slope() -> None:
    shares = [VALUES[f"stable_share_{slope:g}"] for slope in findings.STABILITY["slope"]]
    assert shares == sorted(shares)


def test_larger_feet_and_shorter_steps_make_more_bodies_stable_and_the_walk_faster() -> None:
    for name, sign in (("foot_radius", 1.0), ("inter_leg_angle", -1.0)):
        values = findings.STABILITY[name]
        shares = [VALUES[f"stable_share_{name}_{value:g}"] for value in values]
        assert np.all(sign * np.diff(shares) > 0.0)
        speeds = stability_map(
            Walker(), {name: np.array(values), "hip_width": np.array([0.1, 0.2])}
        ).speed
        assert np.all(sign * np.diff(speeds, axis=0) > 0.0)


@pytest.mark.parametrize("slope", findings.STABILITY["slope"])
@pytest.mark.parametrize("tilt", [0.12, 0.14])
def test_below_the_least_tilt_each_step_turns_a_lean_into_a_greater_one_to_the_other_side(
    slope: float, tilt: float
) -> None:
    body = replace(Walker().parameters, hip_width=0.05, ankle_tilt=tilt, slope=slope, slope_turns=True)  # fmt: skip
    walker = Walker(body)
    gait = find_limit_cycle(walker).state
    leaning = gait + 1e-6 * np.eye(5)[2]
    lean = (walker.walk(8, state=leaning).states - walker.walk(8, state=gait).states)[2:, 2]
    assert np.all(lean[1:] / lean[:-1] < -1.05)


# --- what chosen steps can save


def test_the_shares_of_the_slice_are_those_of_the_page_and_of_the_first_brute_force() -> None:
    gait = find_limit_cycle(SAVED).state
    axes = {"ankle_angle": gait[2] + np.linspace(-0.3, 0.3, 41), "ankle_rate": gait[4] + np.linspace(-0.8, 0.8, 41)}  # fmt: skip
    least = capture_map(SAVED, axes, most_steps=2).least_steps
    # an earlier search by another program, on other points of the slice, gave 0.26, 0.54, 0.75 and at least 0.81
    for n, earlier in enumerate((0.26, 0.54, 0.75)):
        assert findings.share_saved(least, n) == VALUES[f"slice_{n}"]
        assert VALUES[f"slice_{n}"] == pytest.approx(earlier, abs=0.01)
    assert VALUES["slice_3"] >= 0.81


def test_a_third_chosen_step_saves_as_many_as_the_page_says() -> None:
    gait = find_limit_cycle(SAVED).state
    states = np.tile(gait, (121, 1))
    states[:, 2] += np.repeat(np.linspace(-0.3, 0.3, 11), 11)
    states[:, 4] += np.tile(np.linspace(-0.8, 0.8, 11), 11)
    found = capture(SAVED, states, most_steps=3)
    assert found.share(3) == pytest.approx(VALUES["slice_3"], abs=0.04)  # 121 points for 1681
    assert np.all(found.share(3) >= found.share(2))


def test_what_two_steps_save_grows_with_the_commands_ever_less() -> None:
    shares = [VALUES[f"resolution_{commands}_2"] for commands in (9, 25, 81)]
    assert shares == sorted(shares)
    assert shares[2] - shares[1] < 0.02 < shares[1] - shares[0]
    assert Choices().commands.shape[0] == 35


def test_what_one_step_saves_still_grows_with_the_commands() -> None:
    shares = [VALUES[f"resolution_{commands}_1"] for commands in (9, 25, 81)]
    assert shares[0] < shares[1] < shares[2]


# --- what learned policies save


def agent_rows(task: str, name: str, limit: str) -> list[dict[str, str]]:
    wanted = (task, name, limit)
    return [row for row in rows_of("capture.csv") if (row["task"], row["agent"], row["friction_limit"]) == wanted]  # fmt: skip


@pytest.mark.parametrize(("task", "name", "limit"), [("Metastable", "ppo", "inf"), ("Heading", "ppo", "inf"), ("Metastable", "ppo", "0.6")])  # fmt: skip
def test_what_an_agent_saves_is_what_the_page_says(task: str, name: str, limit: str) -> None:
    agent = make_agent(name, AgentRequest(env_id_of(task), EnvOptions()))
    report = examine_capture(name, agent, task, friction_limit=float(limit), points=3)
    for row, expected in zip(report.rows(), agent_rows(task, name, limit), strict=True):
        for key in ("can_be_saved", "saved_of_these", "saved_of_all", "saved_beyond"):
            # policies compute in single precision, which machines round differently
            assert float(expected[key]) == pytest.approx(float(row[key]), abs=0.005)


def test_training_against_pushes_doubles_the_basin_and_feedback_saves_more_than_training_for_headings() -> (
    None
):
    def of_all(task: str, name: str) -> float:
        return float(agent_rows(task, name, "inf")[0]["saved_of_all"])

    for name in ("ppo", "sac"):
        assert of_all("Metastable", name) > 2.0 * of_all("Metastable", "fixed")
    assert of_all("Heading", "fixed") < of_all("Heading", "ppo") < of_all("Heading", "feedback")


def test_on_a_floor_with_a_friction_limit_a_policy_trained_without_one_slips() -> None:
    agent = make_agent("sac", AgentRequest(env_id_of("Metastable"), EnvOptions()))
    free, slippery = (closed_loop(agent, "Metastable", EnvOptions(friction_limit=limit)) for limit in (np.inf, FRICTION))  # fmt: skip
    starts = box_starts(free, 300)
    before, after = walk_many(free, starts, 62), walk_many(slippery, starts, 62)
    lost = before.survived & ~after.survived
    assert lost.sum() > 50
    assert np.all(after.endings[lost] == SLIP)
