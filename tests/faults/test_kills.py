"""Work that is killed at random moments and begun again comes to what it would have come to, and leaves nothing else behind."""

from __future__ import annotations

import json
import os
import random
import signal
import time
from pathlib import Path

import optuna
import pytest
from optuna.trial import TrialState

from tests.faults import work
from tests.faults.processes import start

pytestmark = pytest.mark.skipif(os.name == "nt", reason="there is no SIGKILL")
KILLS = 20


def killed(kind: str, folder: Path) -> int:
    """Begin the work and kill it, ``KILLS`` times, at moments over all that it takes; how often it was killed before its end."""
    moments = random.Random(kind)
    start(
        work.go_on, kind, folder / "warm"
    ).join()  # begins the server, which imports everything, and compiles
    began = time.monotonic()
    whole = start(work.go_on, kind, folder / "whole", log=folder / "log")
    whole.join()
    assert whole.exitcode == 0, (folder / "log").read_text()
    duration = time.monotonic() - began
    kills = 0
    for _ in range(KILLS):
        process = start(work.go_on, kind, folder / "killed", log=folder / "log")
        process.join(moments.uniform(0.0, 0.25 * duration))
        process.kill()
        process.join()
        kills += process.exitcode == -signal.SIGKILL
    last = start(work.go_on, kind, folder / "killed", log=folder / "log")
    last.join()
    assert last.exitcode == 0, (folder / "log").read_text()
    return kills


@pytest.fixture
def folder(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    for name in ("warm", "whole", "killed"):
        (tmp_path / name).mkdir()
        work.begin(request.node.callspec.params["kind"], tmp_path / name)
    return tmp_path


@pytest.mark.parametrize("kind", work.COMPARED)
def test_work_killed_twenty_times_gives_the_same_bits_as_work_left_alone(
    folder: Path, kind: str
) -> None:
    assert killed(kind, folder) >= 2
    assert work.result(kind, folder / "killed") == work.result(kind, folder / "whole")
    assert not work.leftovers(folder / "killed")


@pytest.mark.parametrize("kind", ["tune"])
def test_a_study_killed_twenty_times_completes_its_trials_and_leaves_none_running(
    folder: Path, kind: str
) -> None:
    assert killed(kind, folder) >= 2
    file = folder / "killed" / "study.db"
    study = optuna.load_study(study_name="feedback Heading", storage=f"sqlite:///{file}")
    states = [trial.state for trial in study.trials]
    assert states.count(TrialState.COMPLETE) == 6
    assert TrialState.RUNNING not in states
    tried = [trial.params for trial in study.trials if trial.state is TrialState.COMPLETE]
    for trial in study.trials:
        if trial.state is TrialState.FAIL and trial.number < max(
            each.number for each in study.trials if each.state is TrialState.COMPLETE
        ):
            retried = [
                each for each in study.trials if each.user_attrs.get("again") == trial.number
            ]
            # a trial killed before it asked for its values holds them as given all the same
            assert retried
            given = {**retried[0].system_attrs.get("fixed_params", {}), **retried[0].params}
            assert trial.params.items() <= given.items()
    assert len({tuple(sorted(params.items())) for params in tried}) == 6
    best = json.loads((folder / "killed" / "best.json").read_text())
    assert best["score"] == study.best_value
    assert not work.leftovers(folder / "killed")
