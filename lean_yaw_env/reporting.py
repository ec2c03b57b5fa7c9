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
from types import FrameType
from typing import Any, NoReturn

from lean_yaw_env.errors import LeanYawError

WRONG_INPUT, NO_RESULT = 2, 1
"""Exit statuses for a bad value or file, and for work without a result."""
NOTHING = "nothing is kept"
_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_PATIENCE = 0.8  # seconds from a signal to the end of child processes that do not end by themselves
_LAST = 0.4  # seconds from there to the end of this process


class _State:
    """Of the running command: the signal that has interrupted it, what it says then, and whether it has."""

    number: int | None = None
    kept = NOTHING
    is_said = False


def keep(words: str) -> None:
    """Set what the running command says if it is interrupted: what is kept, and how to continue."""
    _State.kept = words


@contextlib.contextmanager
def reporting(program: str) -> Iterator[None]:
    """Report errors and interruptions within the block in a line that begins with ``program``, and exit.

    A process that does not end soon after Ctrl-C or SIGTERM, because compiled code or another process is at work, is ended by
    force, with its child processes. Only the main thread can see to that; a block within a block adds nothing.
    """
    try:
        with _watched(program):
            yield
    except (KeyboardInterrupt, SystemExit) as end:  # a library may have made one of the other
        if _State.number is None and isinstance(end, SystemExit):
            raise
        _say_interrupted(program)
        # Python exits otherwise than asked if the signal came while it executed text, as namedtuple does, until it executes some again
        exec("")
        raise SystemExit(128 + (_State.number or signal.SIGINT)) from end
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
        print(f"{program}: interrupted; {_State.kept}", file=sys.stderr, flush=True)


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold back Ctrl-C while the block runs; processes begun in it never get it, and their parent decides what becomes of them."""
    if os.name == "nt":  # where only the parent may answer: see the processes' own initialisation
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _watched(program: str) -> Iterator[None]:
    """Raise ``KeyboardInterrupt`` at a signal, and end the process if that does not."""
    is_main = threading.current_thread() is threading.main_thread()
    if not is_main or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return
    _State.number, _State.kept, _State.is_said = None, NOTHING, False
    reader, writer = socket.socketpair()
    writer.setblocking(False)
    before = {number: signal.signal(number, _interrupt) for number in _SIGNALS}
    hook, sys.unraisablehook = sys.unraisablehook, unraisable_hook(KeyboardInterrupt)
    wakeup = signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
    threading.Thread(target=_end_after_signal, args=(reader, program), daemon=True).start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(wakeup)
        sys.unraisablehook = hook
        writer.close()
        if signal.getsignal(signal.SIGTERM) is _interrupt:
            for number, handler in before.items():
                signal.signal(number, handler)


def unraisable_hook(silent: type[BaseException]) -> Callable[[Any], None]:
    """A ``sys.unraisablehook`` that reports errors where Python cannot raise them, as in a callback of a C library, but for the one that a signal raised:
    the process is ended soon."""

    def report(unraisable: Any) -> None:
        if not issubclass(unraisable.exc_type, silent):
            sys.__unraisablehook__(unraisable)

    return report


def _interrupt(number: int, frame: FrameType | None) -> NoReturn:
    for each in _SIGNALS:
        signal.signal(each, signal.SIG_IGN)  # one is enough
    _State.number = number
    raise KeyboardInterrupt


def _end_after_signal(reader: socket.socket, program: str) -> None:
    """Wait for a signal's number, which arrives while compiled code runs too, and for the process to end; then end it."""
    with reader:
        number = reader.recv(1)
    if number and number[0] in _SIGNALS:
        time.sleep(_PATIENCE)
        for child in multiprocessing.active_children():
            child.kill()
        time.sleep(_LAST)  # what waited for them ends now
        _say_interrupted(program)
        os._exit(128 + number[0])
