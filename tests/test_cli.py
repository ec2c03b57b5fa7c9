"""The command line: what it prints, and how it refuses."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from lean_yaw_env import Walker, WalkerParameters, find_limit_cycle
from lean_yaw_env.cli.app import app
from lean_yaw_env.cli.axes import parse_axes, parse_range
from lean_yaw_env.cli.rows import as_json
from lean_yaw_env.cli.screen import text_of

COMMANDS = ("gait", "map", "basin", "bicycle", "skateboard", "reproduce", "play", "view")
runner = CliRunner()


def _json(*arguments: str) -> Any:
    result = runner.invoke(app, [*arguments, "--json"])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def test_an_installation_without_the_extra_is_told_which_one_to_install() -> None:
    script = (
        "import sys\n"
        "sys.modules |= dict.fromkeys(['typer', 'rich', 'rich.console', 'xarray', 'sympy', 'matplotlib'])\n"
        "from lean_yaw_env.cli import main\n"
        "main()\n"
    )
    done = subprocess.run([sys.executable, "-c", script, "gait"], capture_output=True, text=True)
    assert done.returncode == 1
    hint = "lean-yaw: typer is not installed, run `pip install 'lean-yaw-env[analysis]'`"
    assert done.stderr.strip() == hint


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command: str) -> None:
    result = runner.invoke(app, [command, "--help"], env={"COLUMNS": "200"})
    assert result.exit_code == 0
    assert "--json" in result.output


def test_help_names_every_command() -> None:
    output = runner.invoke(app, ["--help"]).output
    assert all(command in output for command in COMMANDS)


def test_gait_prints_the_limit_cycle_of_the_library() -> None:
    record = _json("gait", "--hip-width", "0.2", "--slope", "0.02")
    cycle = find_limit_cycle(Walker(WalkerParameters(hip_width=0.2, slope=0.02)))
    assert list(record["state"].values()) == cycle.state.tolist()
    assert record["speed"] == cycle.speed
    assert record["is_stable"] == cycle.is_stable
    assert [mode["kind"] for mode in record["modes"]].count("fore-aft") == 2


def test_gait_of_a_passive_walker_has_its_swing_rate() -> None:
    record = _json("gait", "--passive", "--planar", "--foot-radius", "0", "--slope", "0.009")
    # Garcia et al. 1998, slope 0.009; their integration is good to some 1e-10
    assert record["state"]["stance_pitch"] == pytest.approx(0.20031090049483, abs=1e-10)
    assert record["state"]["stance_pitch_rate"] == pytest.approx(-0.19983247291764, abs=1e-10)
    assert "inter_leg_rate" in record["state"]


def test_gait_as_a_table_says_why_a_multiplier_is_zero() -> None:
    result = runner.invoke(app, ["gait"])
    assert result.exit_code == 0
    assert "0.415666" in result.output  # Table 1's speed
    assert "zero: section" in result.output


def test_map_reports_each_point_and_keeps_the_whole_in_a_file(tmp_path: Path) -> None:
    out = tmp_path / "map.nc"
    record = _json("map", "ankle-tilt=0.3:0.9:3", "--hip-width", "0", "--out", str(out))
    assert [point["ankle_tilt"] for point in record["points"]] == pytest.approx([0.3, 0.6, 0.9])
    assert [point["gait"] for point in record["points"]] == ["stable", "unstable", "unstable"]
    assert record["counts"] == {"unstable": 2, "stable": 1}
    assert out.is_file()


def test_map_says_null_where_there_is_no_gait() -> None:
    record = _json("map", "slope=-0.01:0.01:2")
    assert record["points"][0]["speed"] is None
    assert record["points"][0]["gait"] == "none found"


def test_basin_counts_endings() -> None:
    record = _json("basin", "stance_pitch=0.1:0.2:2", "stance_pitch_rate=-0.5:0.5:2")
    assert sum(record["counts"].values()) == 4
    assert {start["ending"] for start in record["starts"]} >= {"walked to the end"}


def test_bicycle_prints_the_papers_speeds() -> None:
    record = _json("bicycle", "--speeds", "5")
    assert record["weave_speed"] == pytest.approx(4.3, abs=0.05)  # Figure 4
    assert record["capsize_speed"] == pytest.approx(6.1, abs=0.05)
    assert len(record["eigenvalues"]) == 1


def test_bicycle_benchmark_is_another_bicycle() -> None:
    record = _json("bicycle", "--benchmark", "--speeds", "5")
    assert record["weave_speed"] == pytest.approx(4.29238253634111, abs=1e-9)  # Meijaard 2007


def test_skateboard_prints_equation_3() -> None:
    record = _json("skateboard", "--spring-stiffness", "0", "--steering-tilt", "0.5")
    assert record["critical_speed"] == pytest.approx(np.sqrt(9.81 * 0.4 * np.tan(0.5) / 2.0))


def test_play_opens_a_window_in_which_the_walker_walks(monkeypatch: pytest.MonkeyPatch) -> None:
    import pygame

    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    pictures: list[bytes] = []

    def events() -> list[pygame.event.Event]:
        pictures.append(pygame.image.tobytes(pygame.display.get_surface(), "RGB"))
        return [pygame.event.Event(pygame.QUIT)] if len(pictures) == 6 else []

    monkeypatch.setattr(pygame.event, "get", events)
    result = runner.invoke(app, ["play", "LeanYaw/Heading-v0", "--seed", "1"])
    assert result.exit_code == 0, result.output
    assert len(set(pictures)) == 6
    assert not pygame.display.get_init()


@pytest.mark.parametrize("env_id", ["LeanYaw/Nowhere-v0", "CartPole-v1"])
def test_play_refuses_what_is_no_walker(env_id: str) -> None:
    result = runner.invoke(app, ["play", env_id])
    assert (
        result.exit_code == 2 and "env_id must be an environment of lean_yaw_env" in result.output
    )


def test_reproduce_writes_a_report(tmp_path: Path) -> None:
    record = _json("reproduce", "table1", "--out", str(tmp_path / "new"))
    assert record["counts"]["agrees"] == 4
    assert (tmp_path / "new" / "report.html").is_file()
    assert (tmp_path / "new" / "report.md").is_file()


def test_reproduce_for_people_names_the_files(tmp_path: Path) -> None:
    result = runner.invoke(app, ["reproduce", "skateboard", "--out", str(tmp_path)])
    assert result.exit_code == 0
    assert "report.html" in result.output


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["gait", "--ankle-tilt", "3"], "ankle_tilt must be in (0, 1.5708], got 3.0"),
        (["gait", "--inter-leg-angle", "-1"], "inter_leg_angle"),
        (["gait", "--planar"], "--passive"),
        (["gait", "--passive", "--mass-offset", "0.1"], "mass_offset"),
        (["map", "foo=1:2:3"], "foo"),
        (["map", "slope"], "slope"),
        (["map", "slope=0.01:0.02:2", "slope=0.01:0.02:2"], "twice"),
        (["map", "slope=0.05:0.01:5"], "0.05:0.01:5"),
        (["map", "slope=0:1:1"], "count"),
        (["map", "slope=a:b:c"], "a:b:c"),
        (["map", "slope=0.01:0.02:2", "--threads", "0"], "threads"),
        (["basin", "heading=0:1:2", "lean=0:1:2"], "lean"),
        (["basin", "heading=0:1:2", "ankle_angle=0:0.1:2", "--steps", "0"], "n_steps"),
        (["bicycle", "--speeds", "-1"], "-1"),
        (["skateboard", "--mass", "-1"], "mass must be in (0, inf), got -1.0"),
        (["reproduce", "figure5", "--out", "nowhere"], "figure5"),
    ],
)
def test_a_wrong_value_is_named_in_one_line(arguments: list[str], named: str) -> None:
    result = runner.invoke(app, arguments)
    assert result.exit_code == 2
    assert named in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert "Traceback" not in result.output


def test_no_gait_is_no_wrong_value() -> None:
    result = runner.invoke(app, ["gait", "--slope", "-0.2"])
    assert result.exit_code == 1
    assert "no gait found" in result.stderr


def test_ranges_include_their_ends() -> None:
    np.testing.assert_array_equal(parse_range("0:1:3"), [0.0, 0.5, 1.0])
    np.testing.assert_array_equal(parse_range("0.25"), [0.25])
    assert list(parse_axes(["hip-width=0:1:2"])) == ["hip_width"]


@pytest.mark.parametrize("text", ["", "1:2", "1:2:3:4", "0:inf:3", "0:nan:3", "0:1:2.5"])
def test_other_ranges_are_refused_with_an_example(text: str) -> None:
    with pytest.raises(ValueError, match=r"0\.1:0\.8:15"):
        parse_range(text)


def test_json_has_no_values_that_json_lacks() -> None:
    record = {"a": np.nan, "b": 1.0 + 2.0j, "c": np.arange(2), "d": np.bool_(True), "e": np.inf}
    assert json.loads(as_json(record)) == {
        "a": None,
        "b": {"real": 1.0, "imag": 2.0},
        "c": [0, 1],
        "d": True,
        "e": None,
    }


def test_numbers_on_the_screen_have_six_digits() -> None:
    assert text_of(1.0 / 3.0) == "0.333333"
    assert text_of(1.0 - 2.0j) == "1 - 2i"
    assert text_of(None) == "none"
    assert text_of(True) == "yes"
    assert text_of([1.0, 2.5]) == "1 to 2.5"
