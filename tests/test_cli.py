"""The command line: what it prints, and how it refuses."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from lean_yaw_env import Walker, WalkerParameters, find_limit_cycle
from lean_yaw_env.analysis import basin, stability_map
from lean_yaw_env.cli.app import app
from lean_yaw_env.cli.commands import parse_axes, parse_range
from lean_yaw_env.cli.records import as_json, text_of
from lean_yaw_env.plots import basin_figure, gait_figure, map_figure
from lean_yaw_env.vehicles import BENCHMARK_2007, benchmark_bicycle

COMMANDS = ("gait", "map", "basin", "atlas", "bicycle", "skateboard", "reproduce", "play", "view")
runner = CliRunner()


def _table(*arguments: str) -> str:
    result = runner.invoke(app, [*arguments], env={"COLUMNS": "200"})
    assert result.exit_code == 0, result.output
    return result.stdout


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


def test_gait_takes_the_ankle_spring_and_damper_that_map_takes() -> None:
    options = ("--ankle-stiffness", "0.001", "--ankle-damping", "0.002")
    record = _json("gait", *options)
    cycle = find_limit_cycle(Walker(WalkerParameters(ankle_stiffness=0.001, ankle_damping=0.002)))
    assert record["speed"] == cycle.speed
    (point,) = _json("map", "ankle-stiffness=0.001", "--ankle-damping", "0.002")["points"]
    # The map solves for the gait in another way, to the same residual
    assert point["speed"] == pytest.approx(cycle.speed, rel=1e-9)


def test_gait_of_a_passive_walker_says_which_of_several_it_is() -> None:
    options = ("gait", "--passive", "--planar", "--foot-radius", "0", "--slope", "0.009")
    gaits = _json(*options)["gaits"]
    # Garcia et al. 1998: a long and a short gait, of which the long one alone is stable
    assert [gait["described"] for gait in gaits] == [True, False]
    assert [gait["is_stable"] for gait in gaits] == [True, False]
    assert gaits[0]["stride_period"] > gaits[1]["stride_period"]
    assert "this walker has 2 gaits; the one described is the slowest" in _table(*options)
    assert "gaits" not in _json("gait")


@pytest.mark.parametrize(
    ("options", "advice"),
    [
        (("--slope", "-0.01"), "alternating offset"),
        (("--mass-offset", "0.02"), "well within ±0.01"),
        (("--hip-width", "1.5"), "narrower hips"),
        (("--passive", "--slope", "0.3"), "below 0.05"),
    ],
)
def test_where_there_is_no_gait_the_error_says_what_to_change(
    options: tuple[str, ...], advice: str
) -> None:
    result = runner.invoke(app, ["gait", *options])
    assert result.exit_code == 1
    assert advice in result.stderr.split(". Try ")[1]


def test_the_advice_against_no_gait_helps() -> None:
    _json("gait", "--slope", "-0.001", "--alternating-offset", "0.03")
    _json("gait", "--mass-offset", "0.008")


def test_long_tables_show_a_summary_and_the_first_rows() -> None:
    text = _table("map", "slope=0.001:0.03:30")
    assert "30 points by gait" in text
    assert "from least to greatest" in text
    assert "and 18 more: ask for --json, --out or --plot" in text
    # 12 points with their borders, the summary and the headings
    assert len(text.splitlines()) < 30
    assert "more" not in _table("map", "slope=0.01:0.03:3")


def test_map_says_null_where_there_is_no_gait() -> None:
    record = _json("map", "slope=-0.01:0.01:2")
    assert record["points"][0]["speed"] is None
    assert record["points"][0]["gait"] == "none found"


def test_basin_counts_endings() -> None:
    record = _json("basin", "stance_pitch=0.1:0.2:2", "stance_pitch_rate=-0.5:0.5:2")
    assert sum(record["counts"].values()) == 4
    assert {start["ending"] for start in record["starts"]} >= {"walked to the end"}


@pytest.mark.parametrize(
    "arguments",
    [
        ("gait",),
        ("gait", "--passive", "--hip-width", "0", "--ankle-tilt", "0.15", "--slope", "0.00058"),
        ("map", "slope=-0.01:0.03:5"),
        ("map", "hip-width=0:0.4:3", "ankle-tilt=0.2:1:3"),
        ("map", "slope=0.01:0.02:2", "hip-width=0:0.4:2", "ankle-tilt=0.2:1:2"),
        ("basin", "stance_pitch=-0.3:0.6:4", "stance_pitch_rate=-1:0:3"),
        ("bicycle",),
        ("skateboard",),
    ],
)
def test_a_picture_is_drawn_beside_the_json(arguments: tuple[str, ...], tmp_path: Path) -> None:
    picture = tmp_path / "picture.png"
    _json(*arguments, "--plot", str(picture))
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert list(tmp_path.iterdir()) == [picture]


def test_a_picture_of_a_gait_has_its_motion_and_its_multipliers() -> None:
    cycle = find_limit_cycle(Walker())
    angles, force, plane = gait_figure(cycle).axes
    # A cycle's mean of two steps, each from one pitch to the opposite one
    highest = max(np.max(np.asarray(line.get_ydata())) for line in angles.lines[::3])
    assert highest == pytest.approx(cycle.state[1], abs=1e-3)
    least = min(np.min(np.asarray(line.get_ydata())) for line in force.lines[::2])
    assert least == pytest.approx(cycle.least_normal_force, abs=1e-3)
    drawn = np.concatenate(
        [np.array(line.get_xdata()) + 1j * np.array(line.get_ydata()) for line in plane.lines[1:3]]
    )
    np.testing.assert_allclose(np.sort_complex(drawn), np.sort_complex(cycle.eigenvalues))


def test_pictures_have_the_first_axis_across_and_mark_what_is_stable() -> None:
    widths, tilts = np.array([0.0, 0.2, 0.3]), np.array([0.3, 0.9])
    data = stability_map(Walker(), {"hip_width": widths, "ankle_tilt": tilts})
    (axes,) = map_figure(data).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("hip width", "ankle tilt")
    unstable = np.asarray(axes.collections[0].get_array())
    np.testing.assert_array_equal(unstable, data["spectral_radius"].to_numpy().T >= 1.0)
    assert unstable.any() and not unstable.all()
    starts = basin(
        Walker(), ("stance_pitch", [-0.3, 0.155]), ("ankle_rate", [-0.1, 0.0, 0.1]), n_steps=20
    )
    (axes,) = basin_figure(starts).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("stance pitch", "ankle rate")
    # Of the endings found the walk to the end is the first
    drawn = np.asarray(axes.collections[0].get_array())
    np.testing.assert_array_equal(drawn == 0, starts["ending"].to_numpy().T == 0.0)


def test_bicycle_takes_parameters_from_a_file(tmp_path: Path) -> None:
    file = tmp_path / "bicycle.json"
    file.write_text('{"trail": 0.02, "front_wheel": {"mass": 1.5}}')
    record = _json("bicycle", "--parameters", str(file))
    wheel = replace(BENCHMARK_2007.front_wheel, mass=1.5)
    own = benchmark_bicycle(replace(BENCHMARK_2007, trail=0.02, front_wheel=wheel))
    assert record["weave_speed"] == own.weave_speed()
    file.write_text("{}")
    record = _json("bicycle", "--parameters", str(file))
    assert record["weave_speed"] == benchmark_bicycle().weave_speed()


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ('{"trial": 0.02}', "trial"),
        ('{"front_wheel": {"weight": 1}}', "weight"),
        ('{"front_wheel": 3}', "front_wheel"),
        ('{"trail": "long"}', "trail"),
        ('{"rear_wheel": {"mass": -1}}', "mass"),
        ("[1]", "object"),
        ("{", "JSON"),
    ],
)
def test_a_wrong_file_of_parameters_is_refused_by_name(
    text: str, named: str, tmp_path: Path
) -> None:
    file = tmp_path / "bicycle.json"
    file.write_text(text)
    result = runner.invoke(app, ["bicycle", "--parameters", str(file)])
    assert result.exit_code == 2, result.output
    assert named in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


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
    result = runner.invoke(app, ["play", "LeanYaw/Heading-v1", "--seed", "1"])
    assert result.exit_code == 0, result.output
    assert len(set(pictures)) == 6
    assert not pygame.display.get_init()


@pytest.mark.parametrize("env_id", ["LeanYaw/Nowhere-v1", "CartPole-v1"])
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
        (["gait", "--plot", "gait.txt"], ".png"),
        (["bicycle", "--speeds", "5", "--plot", "bicycle.png"], "low:high:count"),
        (["bicycle", "--benchmark", "--parameters", "bicycle.json"], "not both"),
        (["bicycle", "--parameters", "nowhere.json"], "nowhere.json"),
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


def test_a_large_map_says_what_it_costs_and_one_beyond_memory_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("lean_yaw_env.cli.app._MANY_POINTS", 3)
    result = runner.invoke(app, ["map", "slope=0.005:0.05:4"])
    assert result.exit_code == 0
    assert "4 points: about" in result.output and "minutes of one core" in result.output
    result = runner.invoke(app, ["map", "slope=0.005:0.05:4", "--threads", "0"])
    assert result.exit_code == 2
    assert "threads must be from 1 to 1024, got 0" in result.output
    result = runner.invoke(app, ["map", "slope=0.005:0.05:100000", "hip_width=0.1:0.5:100000"])
    assert result.exit_code == 2
    said = result.output.replace("\n", " ")
    cost = re.search(r"10,000,000,000 points: about (\S+) GB and (\S+) minutes of one core", said)
    assert cost is not None
    assert float(cost[1]) > 1e3 and float(cost[2]) > 1e3
    assert "10,000,000,000, which take about" in said and ".zarr" in said
