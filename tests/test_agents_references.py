"""References: normalised scores, and the search that finds what they are measured by."""

from __future__ import annotations

import math
from dataclasses import asdict, replace

import pytest
from typer.testing import CliRunner

from agents import references as references_module
from agents.command_line import app
from agents.controllers.mpc import MpcSettings
from agents.evaluation import reference_search
from agents.evaluation.episodes import direction
from agents.evaluation.reference_search import find_reference, write_reference
from agents.references import Reference, normalised, read_references, references
from agents.seeds import first_seed
from agents.settings import with_values
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.registration import TASK_VERSIONS

TINY = MpcSettings(steps=4, window=5.0, samples=6, iterations=1, trust=0.0, scenarios=0)


@pytest.fixture
def short(monkeypatch):
    """Searches of a moment."""
    monkeypatch.setattr(reference_search, "SEARCHES", (TINY,))
    monkeypatch.setattr(reference_search, "MEAN_EPISODES", 8)
    monkeypatch.setattr(reference_search, "HORIZONS", {"Heading": 30.0})


def test_references_that_come_with_the_package_are_of_its_tasks():
    for task, found in references().items():
        assert task in TASK_VERSIONS
        assert found.metric == task_named(task).headline
        sign = direction(task, found.metric)
        assert sign * found.fixed < sign * found.base_value <= sign * found.value
        assert found.first_seed >= first_seed("validation")
        for settings in found.searches:
            assert with_values(MpcSettings(), settings).scenarios == 0


def test_normalised_scores_are_0_for_the_fixed_controller_and_1_for_the_reference(
    short, tmp_path, monkeypatch
):
    file = tmp_path / "references.json"
    found = find_reference("Heading", 4, "the command")
    write_reference(file, "Heading", found)
    assert asdict(read_references(file)["Heading"])["value"] == found.value
    monkeypatch.setattr(references_module, "references", lambda: read_references(file))
    assert normalised("Heading", found.fixed) == 0.0
    assert normalised("Heading", found.value) == 1.0
    assert 0.0 < (normalised("Heading", found.base_value) or math.nan) < 1.0
    assert normalised("Walk", 100.0) is None
    # the same search finds the same
    assert replace(find_reference("Heading", 4, "the command"), seconds=found.seconds) == found


def test_the_command_goes_on_with_the_tasks_that_are_missing(short, tmp_path, monkeypatch):
    file = tmp_path / "references.json"
    found = find_reference("Heading", 2)
    write_reference(file, "Heading", found)
    result = CliRunner().invoke(app, ["reference", "--task", "Heading", "--out", str(file)])
    assert result.exit_code == 0, result.output
    assert read_references(file)["Heading"].value == found.value


@pytest.mark.parametrize("words", ['{"Heading": {"value": 1}}', "[1, 2]", '{"Heading": 3}', "dear"])
def test_a_file_of_something_else_is_refused_and_stays(words, tmp_path):
    file = tmp_path / "mine.json"
    file.write_text(words)
    result = CliRunner().invoke(app, ["reference", "--task", "Heading", "--out", str(file)])
    assert result.exit_code == 2
    assert str(file) in result.stderr and len(result.stderr.splitlines()) == 1
    assert file.read_text() == words


def test_a_damaged_number_of_a_reference_is_refused():
    found = asdict(next(iter(references().values())))
    for name, value in {
        "value": None,
        "fixed": "3",
        "standard_error": math.nan,
        "base": "",
    }.items():
        with pytest.raises(ValueError, match=f"{name} must be"):
            Reference(**found | {name: value})


def test_a_place_that_cannot_be_written_is_named_before_the_search(tmp_path, monkeypatch):
    monkeypatch.setattr(reference_search, "find_reference", None)
    (tmp_path / "file").touch()
    file = tmp_path / "file" / "references.json"
    result = CliRunner().invoke(app, ["reference", "--task", "Heading", "--out", str(file)])
    assert result.exit_code == 2 and "file" in result.stderr
