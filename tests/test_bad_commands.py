"""Bad options of every command: exit status 2 and a line that names the option or its value, never a traceback."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from agents.command_line import app as agents_app
from lean_yaw_env.cli.app import app as walker_app
from train import app as train_app

APPS: dict[str, typer.Typer] = {"lean-yaw": walker_app, "agents": agents_app, "train.py": train_app}

TEXT = ("", "no-such-name")
SEEDS = ("", "x", "1.5", "-1")
COUNT = (*SEEDS, "0")
NUMBER = ("", "x", "nan", "1,5")
POSITIVE = (*NUMBER, "0", "-1")
PLACE = ("",)
AXIS = (
    "",
    "slope",
    "slope=",
    "slope=x",
    "slope=0.2:0.1:3",
    "slope=0.1:0.2:1",
    "hip=0.1:0.2:3",
    "slope=nan",
)
PLOT = {"--plot": ("", "x.doc", "no/such/x.png")}
OPTIONS = {"--option": ("", "mirror", "mirorr=true", "mirror=maybe", "slope=steep")}
BODY = {
    "--hip-width": (*NUMBER, "-0.1", "3"),
    "--foot-radius": (*NUMBER, "-0.1", "1"),
    "--ankle-tilt": (*NUMBER, "0", "2"),
    "--slope": (*NUMBER, "0.6"),
    **PLOT,
    "--ankle-stiffness": (*NUMBER, "-1"),
    "--ankle-damping": (*NUMBER, "-1"),
}
COMMAND = {"--inter-leg-angle": (*POSITIVE, "2"), "--mass-offset": (*NUMBER, "-1.1", "2")}
ENGINE = {"--threads": COUNT, "--workers": COUNT, "--scheduler": ("", "nowhere")}
SPEEDS = {"--speeds": ("", "x", "1:2", "2:1:3", "1:2:1", "nan")}
TRAIN = {
    **OPTIONS,
    "--task": (*TEXT, "heading"), "--seed": SEEDS, "--seeds": ("x", "4-2", "1.5", "-1", "0"), "--jobs": COUNT,
    "--algorithm": TEXT, "--steps": COUNT, "--episodes": COUNT, "--out": (), "--run": ("no-such-folder",), "--threads": COUNT,
}  # fmt: skip

SMALL = ["--steps", "64", "--episodes", "1", "--out", "made"]

COMMANDS: dict[tuple[str, str], tuple[list[str], dict[str, tuple[str, ...]]]] = {
    ("lean-yaw", "gait"): ([], {**COMMAND, "--alternating-offset": (*NUMBER, "-1.1", "2"), **BODY}),
    ("lean-yaw", "map"): (["slope=0.01"], {"AXIS": AXIS, **COMMAND, **ENGINE, "--out": PLACE, **BODY}),
    ("lean-yaw", "basin"): (
        ["stance_pitch=0.15", "ankle_angle=0", "--steps", "1"],
        {**COMMAND, "--steps": COUNT, **ENGINE, "--out": PLACE, **BODY},
    ),
    ("lean-yaw", "atlas"): (["slope=0.01", "--out", "made"], {"AXIS": AXIS, "--every": COUNT, "--out": PLACE, **ENGINE}),
    ("lean-yaw", "bicycle"): ([], {**SPEEDS, **PLOT, "--parameters": ("no-such-file.json",)}),
    ("lean-yaw", "skateboard"): (
        [],
        {
            **{f"--{name}": POSITIVE for name in ("mass", "rider-height", "wheelbase", "gravity")},
            "--steering-tilt": (*POSITIVE, "2"), "--spring-stiffness": (*NUMBER, "-1"), "--damping": (*NUMBER, "-1"), **SPEEDS, **PLOT,
        },
    ),
    ("lean-yaw", "play"): (["LeanYaw/Level-v1"], {"ENV_ID": ("no-such-name", "LeanYaw/Heading-v7"), "--speed": POSITIVE, "--seed": SEEDS}),
    ("lean-yaw", "view"): (
        ["--task", "Slalom"],
        {
            "--walk": ("no-such-file.json",), "--task": TEXT, "--agent": TEXT, "--agent-path": ("no-such-folder",),
            "--port": (*SEEDS, "99999"),
        },
    ),
    ("lean-yaw", "reproduce"): (["table1"], {"NAMES": TEXT, "--out": ()}),
    ("lean-yaw", "findings"): ([], {"--out": ()}),
    ("agents", "train"): (SMALL, TRAIN),
    ("train.py", ""): (SMALL, TRAIN),
    ("agents", "retrain"): (
        ["--task", "Walk", "--algorithm", "ppo", "--jobs", "1", *SMALL],
        {
            "--task": TEXT, "--algorithm": TEXT, "--jobs": COUNT, "--steps": COUNT, "--episodes": COUNT, "--out": (),
        },
    ),
    ("agents", "reference"): (
        ["--task", "Walk", "--episodes", "1", "--out", "made.json"],
        {"--task": TEXT, "--episodes": COUNT, "--processes": COUNT, "--out": ()},
    ),
    ("agents", "dataset"): (
        ["--task", "Walk", "--kind", "random", "--episodes", "1", "--out", "made"],
        {"--task": TEXT, "--kind": TEXT, "--expert": TEXT, "--episodes": COUNT, "--seed": SEEDS, "--out": ()},
    ),
    ("agents", "tune"): (
        ["feedback", "Heading", "--trials", "1", "--episodes", "1", "--horizon", "1"],
        {
            "AGENT": TEXT, "TASK": TEXT, "--trials": COUNT, "--episodes": COUNT, "--horizon": POSITIVE, "--steps": COUNT,
            "--repeats": COUNT, "--storage": (), "--out": (),
        },
    ),
    ("agents", "robustness"): (
        ["--agents", "fixed", "--task", "Heading", "--episodes", "1"],
        {
            "--task": TEXT, "--agents": TEXT, "--episodes": COUNT, "--costly-episodes": COUNT, "--seed": SEEDS,
            "--agent-path": ("no-such-folder",), "--runs": (), "--processes": COUNT, "--out": (),
        },
    ),
    ("agents", "capture"): (
        ["--agents", "fixed", "--task", "Metastable", "--starts", "1", "--points", "2"],
        {
            "--task": TEXT, "--agents": TEXT, "--out": (), "--agent-path": ("no-such-folder",), "--runs": (), "--starts": COUNT,
            "--points": COUNT, "--friction-limit": POSITIVE,
        },
    ),
    ("agents", "ship"): (["no-such-folder"], {"SOURCES": ("no-such-folder", "")}),
    ("agents", "evaluate"): (
        ["fixed", "--episodes", "1"],
        {
            "AGENT": ("no-such-name",), "--agents": ("no-such-name",), "--task": TEXT, "--episodes": COUNT, "--costly-episodes": COUNT,
            "--seed": SEEDS, "--agent-path": ("no-such-folder",), "--runs": (), "--cache": (), "--processes": COUNT, "--out": (),
            "--pictures": (), **OPTIONS, "--results": (), "--others": ("no-such-file.json",),
        },
    ),
    ("agents", "closed-loop"): (
        ["--agents", "fixed", "--points", "2", "--starts", "2", "--directions", "2"],
        {
            "--task": TEXT, "--agents": TEXT, "--out": (), "--agent-path": ("no-such-folder",), "--runs": (), "--points": COUNT,
            "--starts": COUNT, "--directions": COUNT,
        },
    ),
    ("agents", "film"): (
        ["--agent", "fixed", "--seconds", "1"],
        {
            "--task": TEXT, "--agent": TEXT, "--out": (), "--seed": SEEDS, "--seconds": POSITIVE, "--speed": POSITIVE,
            "--fps": (*POSITIVE, "1000"), "--size": ("x 360", "0 360", "640 1.5"), "--format": TEXT, "--agent-path": ("no-such-folder",),
            "--runs": (),
        },
    ),
}  # fmt: skip
"""Of each command: arguments with which it works, and bad values of each option and argument."""


class EndlessError(Exception):
    """A command went on working with a bad value."""


def end(number: int, frame: Any) -> None:
    raise EndlessError


def commands() -> Iterator[tuple[tuple[str, str], Any]]:
    for program, app in APPS.items():
        command: Any = typer.main.get_command(app)
        for name, each in getattr(command, "commands", {"": command}).items():
            yield (program, name), each


def test_every_option_of_every_command_is_in_the_table() -> None:
    found = dict(commands())
    assert set(found) == set(COMMANDS)
    for key, command in found.items():
        for parameter in command.params:
            if parameter.param_type_name == "option" and not getattr(parameter, "is_flag", False):
                assert set(parameter.opts) & set(COMMANDS[key][1]), (key, parameter.opts)


CASES = [
    pytest.param(key, option, id=" ".join((*key, option)))
    for key, (_, options) in COMMANDS.items()
    for option in options
    if options[option]
]


@pytest.mark.parametrize(("key", "option"), CASES)
def test_a_bad_value_ends_a_command_with_status_2_and_words(
    key: tuple[str, str], option: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    good, options = COMMANDS[key]
    out = ["--out", "made"] if "--out" in options and key[1] in ("reproduce", "film") else []
    wrong = []
    for value in options[option]:
        given = (
            [*good, *out, option, *value.split(" ")]
            if option.startswith("--")
            else [*out, *good[1:], value]
        )
        signal.signal(signal.SIGALRM, end)
        signal.alarm(90)
        result = CliRunner().invoke(APPS[key[0]], [key[1], *given] if key[1] else given)
        signal.alarm(0)
        words = result.output + str(result.stderr)
        named = [
            option,
            option.strip("-").replace("-", "_").lower(),
            repr(value),
            value.split("=")[0],
        ]
        is_clear = any(name and name in words for name in named) or (not value and "'.'" in words)
        if result.exit_code != 2 or not isinstance(result.exception, SystemExit) or not is_clear:
            wrong.append(
                f"{value!r}: status {result.exit_code}, {result.exception!r}: {words[-300:]}"
            )
        if "Traceback" in words:
            wrong.append(f"{value!r}: a traceback")
    assert not wrong, "\n".join(wrong)
