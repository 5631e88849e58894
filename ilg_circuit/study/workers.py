"""Tasks on many processes: one a core by loky, on any `concurrent.futures` executor, or on a dask cluster.

Workers die: of too little memory, of a crash in ngspice, or because they are killed. loky then fails all submitted
tasks and accepts no more, so few are submitted at a time; these are solved again, one by one, on a new executor. A
design that kills its worker twice when solved alone is a failed design.
"""

from __future__ import annotations

import multiprocessing
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import SolveError
from .evaluate import Evaluation, evaluate
from .spec import Task, solve_task
from .travelling import packed_models, unpack_models

#: Tasks submitted for each worker: one in work, one waiting, so that none is idle.
_AHEAD = 2
#: Times that a task may kill its worker when solved alone before it is divided.
_DEATHS = 2


def processes_possible() -> bool:
    """Return True if processes can share locks here; they cannot where /dev/shm is missing or not accessible."""
    try:
        multiprocessing.get_context("spawn").Lock()
    except (OSError, ImportError):
        return False
    return True


def require_processes() -> None:
    """Raise SolveError where worker processes are impossible."""
    if not processes_possible():
        raise SolveError(
            "this machine lets processes share no locks (is /dev/shm missing, or closed to you?), so there can be no "
            "workers; use --jobs 1"
        )


class GivenPool:
    """Workers that solve tasks, here of an ``executor`` made elsewhere.

    ``width()`` is their present number; ``deaths`` are the errors raised when a worker died with a task.
    """

    def __init__(self, executor: Executor, width: Callable[[], int], deaths: tuple[type[BaseException], ...]) -> None:
        self._executor: Any = executor
        self.width, self.deaths = width, deaths
        self._models = packed_models()

    def submit(self, task: Task) -> Future[Evaluation]:
        """Submit a task."""
        future: Future[Evaluation] = self._executor.submit(_solve, task, self._models)
        return future

    def renew(self) -> None:
        """Make the pool usable again after a death. Raises SolveError where that is impossible."""
        if BrokenExecutor in self.deaths:
            raise SolveError(
                "the executor lost a worker and takes no more work; start again with a new one to continue"
            )


class LokyPool(GivenPool):
    """Processes of this machine, started afresh (ngspice does not survive a fork)."""

    def __init__(self, workers: int) -> None:
        require_processes()
        super().__init__(_processes(workers), lambda: workers, (BrokenExecutor,))

    def renew(self) -> None:
        self.close()
        self._executor = _processes(self.width())

    def close(self) -> None:
        """End the workers, whatever they are doing."""
        self._executor.shutdown(wait=True, kill_workers=True)


def _processes(workers: int) -> Any:
    from loky import ProcessPoolExecutor

    return ProcessPoolExecutor(max_workers=workers, initializer=_end_with, initargs=(os.getpid(),))


def _solve(task: Task, models: bytes) -> Evaluation:
    """In a worker: solve a task, with the ``models`` of `travelling.packed_models`."""
    unpack_models(models)
    return solve_task(task)


def _end_with(parent: int) -> None:
    """In a worker: exit when the parent process was killed, since nothing would fetch the results."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def solve_on(
    pool: GivenPool, numbers: Iterable[int], make: Callable[[int], Task], save: Callable[[int, Evaluation], None]
) -> None:
    """Solve the tasks ``make(number)`` on ``pool``; ``save(number, result)`` is called as each result arrives.

    Raises SolveError where the pool cannot be renewed after a worker died.
    """
    waiting = deque(numbers)
    running: dict[Future[Evaluation], tuple[int, Task]] = {}
    suspects: list[tuple[int, Task]] = []

    def collect(done: Iterable[Future[Evaluation]]) -> None:
        for future in done:
            number, task = running.pop(future)
            try:
                save(number, future.result())
            except pool.deaths:
                suspects.append((number, task))

    try:
        while waiting or running:
            while waiting and not suspects and len(running) < _AHEAD * max(pool.width(), 1):
                number = waiting.popleft()
                task = make(number)
                try:
                    running[pool.submit(task)] = number, task
                except pool.deaths:  # the pool broke while nobody was waiting for it
                    suspects.append((number, task))
            if running and not suspects:
                wait(running, return_when=FIRST_COMPLETED)
            collect([f for f in running if f.done()])
            if suspects:  # the culprit is unknown: all submitted tasks are tried again, one at a time
                collect(wait(running).done)
                pool.renew()
                while suspects:
                    number, task = suspects.pop(0)
                    save(number, _alone(pool, task))
    finally:
        for future in running:
            future.cancel()


def _alone(pool: GivenPool, task: Task) -> Evaluation:
    """Solve a task alone; divide it where it kills its worker repeatedly, until the culprit is a single design."""
    for _ in range(_DEATHS):
        try:
            return pool.submit(task).result()
        except pool.deaths:
            pool.renew()
    if len(task) == 1:
        reason = "its solve killed the worker process, twice: too little memory, or a crash of ngspice"
        return evaluate([reason], **task.how)
    middle = len(task) // 2
    first, second = _alone(pool, task.part(0, middle)), _alone(pool, task.part(middle, len(task)))
    return replace(
        first,
        values=np.concatenate([first.values, second.values]),
        errors=np.concatenate([first.errors, second.errors]),
        failures=first.failures | {middle + k: reason for k, reason in second.failures.items()},
        waveforms={name: np.concatenate([waves, second.waveforms[name]]) for name, waves in first.waveforms.items()},
    )
