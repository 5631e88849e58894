"""The solver process of one window: it does one task at a time, reports its progress, and can be stopped.

A process, not a thread: only a process can be stopped in the middle of a fit, and ngspice is one to a process.
``python -m ilg_circuit.window.worker`` is that process; it ends when the one that started it does.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue
from typing import Any, BinaryIO

from ..errors import IlgError, first_line, one_line, written

#: Shortest time [s] between two reports of progress.
_APART = 0.15


@dataclass(frozen=True)
class Told:
    """What a worker tells: ``kind`` is ``progress``, ``done``, ``failed`` or ``stopped``.

    ``value`` is (done, total) of the work, total None where it is not known; the answer; the error's line; or nothing.
    """

    kind: str
    value: Any = None


@dataclass(frozen=True)
class Task:
    """Work for the process: a function of ``module``, its ``arguments``; it reports by its argument ``progress``."""

    module: str
    function: str
    arguments: Mapping[str, Any] = field(default_factory=dict)


#: All workers of this process, so that none outlives it.
_ALL: weakref.WeakSet[Worker] = weakref.WeakSet()


class Worker:
    """A solver process, started when it is first needed and again after it was stopped."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._lock = threading.Lock()
        self._busy: Callable[[Told], object] | None = None
        _ALL.add(self)

    @property
    def busy(self) -> bool:
        """True while a task is being worked on."""
        return self._busy is not None

    @property
    def pid(self) -> int | None:
        """Number of the process, None while there is none."""
        return self._process.pid if self._process else None

    def start(self) -> None:
        """Start the process, if there is none, so that the first task need not wait for its imports."""
        with self._lock:
            if self._process is not None:
                return
            root = str(Path(__file__).parents[2])
            paths = os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH", "")]))
            self._process = process = subprocess.Popen(
                [sys.executable, "-m", __name__],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={**os.environ, "PYTHONPATH": paths},
                start_new_session=True,  # Ctrl-C in the terminal is for the server, which ends this one
            )
        threading.Thread(target=self._listen, args=(process,), daemon=True).start()

    def submit(self, task: Task, tell: Callable[[Told], object]) -> None:
        """Have a task done; ``tell`` is called, from another thread, with its progress and once with its end."""
        if self.busy:
            raise RuntimeError("the worker has a task")
        from ..study.workers import packed_models

        models = packed_models()
        self.start()
        process = self._process
        self._busy = tell
        if process is None or process.stdin is None:
            self._end(Told("stopped"))
            return
        try:
            pickle.dump((task, models), process.stdin)
            process.stdin.flush()
        except OSError:
            self._end(Told("failed", "the solver process has ended; try again"))

    def stop(self) -> None:
        """End the process, and with it the task, which is told to have been stopped; a new one starts at once."""
        self._kill()
        self._end(Told("stopped"))
        self.start()

    def close(self) -> None:
        """End the process; nobody is told."""
        self._busy = None
        self._kill()

    def _kill(self) -> None:
        with self._lock:
            process, self._process = self._process, None
        if process is not None:
            process.kill()
            _left(process)

    def _end(self, told: Told) -> None:
        tell, self._busy = self._busy, None
        if tell is not None:
            tell(told)

    def _listen(self, process: subprocess.Popen[bytes]) -> None:
        """Pass on what a process tells, until it ends."""
        assert process.stdout is not None
        with process.stdout:
            while True:
                try:
                    told: Told = pickle.load(process.stdout)
                except (EOFError, OSError, pickle.UnpicklingError):
                    break
                if process is not self._process:
                    continue
                if told.kind != "progress":
                    self._end(told)
                elif (tell := self._busy) is not None:
                    tell(told)
        with self._lock:
            if process is not self._process:  # it was ended on purpose
                return
            self._process = None
        _left(process)
        self._end(Told("failed", "the solver process ended by itself: too little memory, or a crash of ngspice"))


def _left(process: subprocess.Popen[bytes]) -> None:
    """Wait for the end of a process, and close the way to it; whoever listens closes the way from it."""
    process.wait()
    if process.stdin is not None:
        with suppress(OSError):
            process.stdin.close()


def close_all() -> None:
    """End the processes of all workers."""
    for worker in list(_ALL):
        worker.close()


def main() -> None:
    """Work on tasks from stdin, one after another, and tell about them on stdout, until stdin ends."""
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what ngspice prints is no answer
    tasks: SimpleQueue[Any] = SimpleQueue()

    def read(source: BinaryIO) -> None:
        with suppress(EOFError, OSError, pickle.UnpicklingError):
            while True:
                tasks.put(pickle.load(source))
        os._exit(0)  # whoever would hear the answer has gone

    threading.Thread(target=read, args=(sys.stdin.buffer,), daemon=True).start()
    _load()
    while True:
        task, models = tasks.get()
        _tell(answers, _result(task, models, lambda told: _tell(answers, told)))


def _load() -> None:
    """Import what tasks need, while the user still looks around."""
    from . import tasks  # noqa: F401


def _result(task: Task, models: bytes, tell: Callable[[Told], object]) -> Told:
    from importlib import import_module

    from ..study.workers import unpack_models
    from .answers import SPELLING

    last, count = -_APART, 0

    def progress(done: float | None = None, total: float | None = None, *_: Any) -> None:
        nonlocal last, count
        count += 1
        now = time.monotonic()
        if now - last >= _APART:
            last = now
            tell(Told("progress", (count if done is None else done, total)))

    try:
        unpack_models(models)
        with written(SPELLING):
            made = getattr(import_module(task.module), task.function)(**task.arguments, progress=progress)
        pickle.dumps(made)
        return Told("done", made)
    except IlgError as error:
        return Told("failed", str(error))
    except Exception as error:  # a fault of this package: told in one line, and the window stays
        return Told("failed", one_line(f"unexpected {type(error).__name__}: {first_line(error)}"))


def _tell(answers: BinaryIO, told: Told) -> None:
    try:
        pickle.dump(told, answers)
        answers.flush()
    except OSError:
        os._exit(0)


if __name__ == "__main__":
    from ilg_circuit.window.worker import main as run  # the module by its name, so that what it pickles is known there

    run()
