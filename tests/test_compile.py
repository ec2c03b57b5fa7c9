"""Compiling beforehand, and the line that says that something compiles."""

from __future__ import annotations

import io
import sys
import time
from types import SimpleNamespace

import pytest

from lean_yaw_env import compile as compiling
from lean_yaw_env.kernel import notice
from lean_yaw_env.kernel.notice import MESSAGE, NOTICE, CompileNotice
from lean_yaw_env.registration import TASK_VERSIONS


def test_the_command_compiles_every_function_that_python_calls() -> None:
    said: list[str] = []
    compiling.compile_all(report=said.append)
    assert {line.split()[1] for line in said if line.startswith("task")} == set(TASK_VERSIONS)
    # also those of other test modules, if they ran in this process: what is theirs is not the package's
    own = [each for each in NOTICE.watched if each.__module__.startswith("lean_yaw_env.")]
    missing = [f"{each.__module__}.{each.__name__}" for each in own if not each.signatures]
    assert len(own) > 20
    assert missing == []


def test_an_unknown_task_is_refused_by_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        compiling.main(["Walkk"])
    told = capsys.readouterr().err
    assert "task must be one of Heading, Walk" in told
    assert "did you mean 'Walk'" in told


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def _compiled(listener: CompileNotice, dispatcher: object, seconds: float) -> None:
    event = SimpleNamespace(data={"dispatcher": dispatcher})
    listener.on_start(event)
    listener.on_start(event)  # one that it calls
    time.sleep(seconds)
    listener.on_end(event)
    listener.on_end(event)


def test_long_compiling_is_announced_once_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notice, "PATIENCE", 0.05)
    watched, other = object(), object()
    listener = CompileNotice()
    listener.watch(watched)
    screen = _Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    _compiled(listener, watched, 0.0)  # quickly done
    _compiled(listener, other, 0.2)  # of another package
    assert screen.getvalue() == ""
    _compiled(listener, watched, 0.2)
    _compiled(listener, watched, 0.2)
    assert screen.getvalue() == MESSAGE + "\n"


def test_nothing_is_announced_where_nobody_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notice, "PATIENCE", 0.05)
    listener, watched = CompileNotice(), object()
    listener.watch(watched)
    file = io.StringIO()
    monkeypatch.setattr(sys, "stderr", file)
    _compiled(listener, watched, 0.2)
    assert file.getvalue() == ""
