"""What stops a command from outside: Ctrl-C, a signal to end, its time limit. One line, an exit code, no leftovers."""

from __future__ import annotations

import atexit
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, NoReturn

import click

#: Signal -> message, and its usual exit code.
_SIGNALS = {"SIGINT": ("interrupted", 130), "SIGTERM": ("terminated", 143), "SIGHUP": ("terminal closed", 129)}
#: Seconds in which a command must clean up after itself; then the process ends without it.
_PATIENCE = 0.8


class Stopped(BaseException):
    """A command was stopped; ``message`` is for the user. No handler of errors takes it for one."""

    def __init__(self, message: str, exit_code: int) -> None:
        super().__init__(message)
        self.message, self.exit_code = message, exit_code


@contextmanager
def stoppable() -> Iterator[None]:
    """Have signals raise, within the block, `Stopped` in the main thread, once; signals that are ignored stay so.

    The block ends with it even where code that was interrupted swallowed it: in a destructor, where Python drops it,
    it is raised again. Where the block has not ended soon after, the process does. Handlers are afterwards what they
    were.
    """
    stops: list[tuple[Stopped, threading.Timer]] = []
    ended = threading.Event()

    def stop(message: str, exit_code: int) -> None:
        if stops or ended.is_set():
            return
        watch = threading.Timer(_PATIENCE, lambda: None if ended.is_set() else _end_process(message, exit_code))
        watch.daemon = True
        stops.append((Stopped(message, exit_code), watch))
        watch.start()
        raise stops[0][0]

    def on_signal(number: int, _frame: FrameType | None) -> None:
        stop(*_SIGNALS[signal.Signals(number).name])

    def on_time(_number: int, _frame: FrameType | None) -> None:
        if stops and not ended.is_set():  # once more
            raise stops[0][0]
        stop(f"stopped by --time-limit after {_limit}; give it more time, or ask for less", 1)

    def on_lost(lost: sys.UnraisableHookArgs) -> None:
        if not isinstance(lost.exc_value, Stopped):
            tell_lost(lost)
        elif hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0.01)

    handlers: dict[Any, Any] = {getattr(signal, name): on_signal for name in _SIGNALS if hasattr(signal, name)}
    if hasattr(signal, "SIGALRM"):
        handlers[signal.SIGALRM] = on_time
    before: dict[Any, Any] = {}
    tell_lost, sys.unraisablehook = sys.unraisablehook, on_lost
    try:
        if threading.current_thread() is threading.main_thread():
            for number, handler in handlers.items():
                if signal.getsignal(number) is not signal.SIG_IGN:
                    before[number] = signal.signal(number, handler)
        yield
    finally:
        ended.set()
        sys.unraisablehook = tell_lost
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0)
        for number, handler in before.items():
            signal.signal(number, handler)
        if stops:
            stops[0][1].cancel()
            raise stops[0][0]


_limit = ""


def start_limit(_context: click.Context, _option: click.Parameter, text: str | None) -> None:
    """Have the command stopped after the time that the option was given, if any."""
    global _limit
    if text is None:
        return
    from ..units import parse

    seconds = parse(text, "s", "--time-limit")
    if not 0 < seconds < 1e8:
        raise click.BadParameter(f"{text}: give a time above zero, such as 30s")
    if not hasattr(signal, "setitimer") or signal.getsignal(signal.SIGALRM) is signal.SIG_DFL:
        raise click.BadParameter("there is no timer for it here; leave it out")
    _limit = text
    signal.setitimer(signal.ITIMER_REAL, seconds)


def _end_process(message: str, exit_code: int) -> NoReturn:
    """End at once, from any thread: nothing runs any more but this."""
    if files := sys.modules.get("ilg_circuit.files"):
        files.remove_temporaries()
    with suppress(OSError):
        os.write(2, f"ilg-circuit: {message}\n".encode())
    os._exit(exit_code)


def leave(exit_code: int) -> NoReturn:
    """End the process without taking down what is loaded, which takes as long as loading it did."""
    watch = threading.Timer(_PATIENCE / 2, lambda: os._exit(exit_code))
    watch.daemon = True
    watch.start()
    with suppress(BaseException):
        atexit._run_exitfuncs()
        sys.stdout.flush()
    os._exit(exit_code)


def drop_output() -> None:
    """Let what is still to be written to stdout go nowhere, so that the end of the process does not fail with it."""
    with suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
