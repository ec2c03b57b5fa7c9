"""How every command ends: an error or an interruption is one line on standard error and an exit status, and no process is left behind."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from functools import wraps
from types import FrameType
from typing import Any, NoReturn, TypeVar

from lean_yaw_env.errors import LeanYawError

WRONG_INPUT, NO_RESULT = 2, 1
"""Exit statuses for a bad value or file, and for work without a result."""
_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_PATIENCE = 1.0  # seconds from a signal to the end of a process that does not end by itself

Function = TypeVar("Function", bound=Callable[..., Any])


class Interrupted(KeyboardInterrupt):
    """Ctrl-C or SIGTERM; its argument is the signal's number."""


class _State:
    kept = ""
    is_said = False


def keep(words: str) -> None:
    """Set what the running command says if it is interrupted: what is kept, and how to continue."""
    _State.kept = words


def reported(program: str) -> Callable[[Function], Function]:
    """A decorator that runs a function within ``reporting``."""

    def decorate(function: Function) -> Function:
        @wraps(function)
        def command(*arguments: Any, **options: Any) -> Any:
            with reporting(program):
                return function(*arguments, **options)

        return command  # type: ignore[return-value]

    return decorate


@contextlib.contextmanager
def reporting(program: str) -> Iterator[None]:
    """Report errors and interruptions within the block in a line that begins with ``program``, and exit.

    A process that does not end within a second of Ctrl-C or SIGTERM, because compiled code or another process is at work, is ended by
    force, with its child processes. Only the main thread can see to that; a block within a block adds nothing.
    """
    try:
        with _watched(program):
            yield
    except KeyboardInterrupt as interruption:
        number = interruption.args[0] if isinstance(interruption, Interrupted) else signal.SIGINT
        _say_interrupted(program)
        raise SystemExit(128 + number) from interruption
    except BrokenPipeError:
        raise
    except OSError as error:
        place = f"{str(error.filename)!r}: " if error.filename is not None else ""
        _fail(program, f"{place}{error.strerror or error}", WRONG_INPUT, error)
    except (ValueError, OverflowError) as error:
        _fail(program, str(error), WRONG_INPUT, error)
    except (LeanYawError, ImportError, MemoryError) as error:
        _fail(program, str(error) or "there is not enough memory", NO_RESULT, error)


def _fail(program: str, message: str, status: int, error: Exception) -> NoReturn:
    print(f"{program}: {message}", file=sys.stderr)
    raise SystemExit(status) from error


def _say_interrupted(program: str) -> None:
    if not _State.is_said:
        _State.is_said = True
        print(
            f"{program}: interrupted{_State.kept and '; '}{_State.kept}",
            file=sys.stderr,
            flush=True,
        )


@contextlib.contextmanager
def _watched(program: str) -> Iterator[None]:
    """Raise ``Interrupted`` at a signal, and end the process if that does not."""
    is_main = threading.current_thread() is threading.main_thread()
    if not is_main or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return
    _State.kept, _State.is_said = "", False
    reader, writer = socket.socketpair()
    writer.setblocking(False)
    before = {number: signal.signal(number, _interrupt) for number in _SIGNALS}
    wakeup = signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
    threading.Thread(target=_end_after_signal, args=(reader, program), daemon=True).start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(wakeup)
        writer.close()
        if signal.getsignal(signal.SIGTERM) is _interrupt:
            for number, handler in before.items():
                signal.signal(number, handler)


def _interrupt(number: int, frame: FrameType | None) -> NoReturn:
    for each in _SIGNALS:
        signal.signal(each, signal.SIG_IGN)  # one is enough
    raise Interrupted(number)


def _end_after_signal(reader: socket.socket, program: str) -> None:
    """Wait for a signal's number, which arrives while compiled code runs too, and for the process to end; then end it."""
    with reader:
        number = reader.recv(1)
    if number and number[0] in _SIGNALS:
        time.sleep(_PATIENCE)
        for child in multiprocessing.active_children():
            child.kill()
        _say_interrupted(program)
        os._exit(128 + number[0])
