"""Tasks on many processes: one a core by loky, on any `concurrent.futures` executor, or on a dask cluster.

Electrical models registered from outside the package travel with the tasks.

Workers may die: from lack of memory, from a crash in ngspice, or because they are killed. loky then fails all submitted
tasks and accepts no more, so few are submitted at a time; these are solved again, one by one, on a new executor. A
design that kills its worker twice when solved alone is a failed design; the digits of all others stay the same.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np

from .. import __version__
from ..errors import InputError, SolveError, argument
from ..strip.models import registry
from .evaluate import Evaluation, evaluate
from .spec import Task, solve_task

#: Tasks submitted for each worker: one in work, one waiting, so that none is idle.
_AHEAD = 2
#: Times that a task may kill its worker when solved alone, whole and as a part, before it is (further) divided.
_DEATHS_WHOLE, _DEATHS = 4, 2
KILLED = "its solve killed the worker process, twice: too little memory, or a crash of ngspice"
#: Modules that a worker can import: everything else is pickled by value.
_IMPORTABLE = ("ilg_circuit", "numpy", "scipy", "builtins")
_CLUSTERS = "tcp://HOST:PORT of a dask scheduler, or local:4 for four workers on this machine"
#: Longest wait [s] for a cluster's scheduler and its first worker.
_PATIENCE = 30


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
            f"workers; use {argument('jobs', 1)}"
        )


class GivenPool:
    """Workers that solve tasks, here of an ``executor`` made elsewhere.

    ``width()`` is their present number; ``deaths`` are the errors raised when a worker died with a task; ``solve`` is
    the function that solves one task.
    """

    def __init__(self, executor: Executor, width: Callable[[], int], deaths: tuple[type[BaseException], ...]) -> None:
        self._executor: Any = executor
        self.width, self.deaths = width, deaths
        self.solve: Callable[[Any], Any] = solve_task
        self._models = packed_models()

    def submit(self, task: Any) -> Future[Any]:
        """Submit a task."""
        return self._executor.submit(_solve, task, self._models, self.solve)

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

    def submit(self, task: Any) -> Future[Any]:
        with _uninterrupted():  # the first tasks start the processes
            return super().submit(task)

    def renew(self) -> None:
        self.close()
        self._executor = _processes(self.width())

    def close(self) -> None:
        """End the workers at once."""
        self._executor.shutdown(wait=True, kill_workers=True)


def _processes(workers: int) -> Any:
    from loky import ProcessPoolExecutor

    return ProcessPoolExecutor(max_workers=workers, initializer=_end_with, initargs=(os.getpid(),))


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Start threads and processes that ignore Ctrl-C; this process ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _solve(task: Any, models: bytes, solve: Callable[[Any], Any]) -> Any:
    """Solve a task in a worker, with the ``models`` of `packed_models`."""
    unpack_models(models)
    return solve(task)


def local_pool(tasks: int, jobs: int | None, solve: Callable[[Any], Any] = solve_task) -> LokyPool | None:
    """Return processes of this machine for so many tasks: ``jobs``, or one a core.

    None where this process is enough, or others are impossible.
    """
    from loky import cpu_count

    workers = jobs or (min(cpu_count(), tasks) if tasks > 1 and processes_possible() else 1)
    if workers == 1:
        return None
    pool = LokyPool(workers)
    pool.solve = solve
    return pool


def _end_with(parent: int) -> None:
    """Exit, in a worker, when the parent process was killed, since nothing would fetch the results."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def solve_on(
    pool: GivenPool,
    numbers: Iterable[int],
    make: Callable[[int], Any],
    save: Callable[[int, Any], None],
    alone: Callable[[GivenPool, Any], Any] | None = None,
) -> None:
    """Solve the tasks ``make(number)`` on ``pool``; ``save(number, result)`` is called as each result arrives.

    ``alone`` solves a task that may have killed a worker, by default as one of a sweep.
    Raises SolveError where the pool cannot be renewed after a worker died.
    """
    waiting = deque(numbers)
    running: dict[Future[Any], tuple[int, Any]] = {}
    suspects: list[tuple[int, Any]] = []

    def collect(done: Iterable[Future[Any]]) -> None:
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
            if suspects:  # any submitted task may have killed the worker: all are tried again, one at a time
                collect(wait(running).done)
                pool.renew()
                while suspects:
                    number, task = suspects.pop(0)
                    save(number, (alone or _alone)(pool, task))
    finally:
        for future in running:
            future.cancel()


def _alone(pool: GivenPool, task: Task) -> Evaluation:
    """Solve a task alone and whole, because the digits of a design depend on the designs solved with it.

    If the whole task kills its workers, it is divided to find the designs that do, and solved without them.
    """
    whole: Evaluation | None = tried(pool, task, _DEATHS_WHOLE)
    if whole is not None:
        return whole
    divided = _divided(pool, task)
    killers = {k: reason for k, reason in divided.failures.items() if reason == KILLED}
    whole = tried(pool, replace(task, impossible=killers), _DEATHS)
    return divided if whole is None else whole  # too large for the memory as a whole


def tried(pool: GivenPool, task: Any, times: int = _DEATHS) -> Any:
    """Solve a task alone, up to so many times; None where it killed its worker each time."""
    for _ in range(times):
        try:
            return pool.submit(task).result()
        except pool.deaths:
            pool.renew()
    return None


def _divided(pool: GivenPool, task: Task) -> Evaluation:
    """Solve a task in ever smaller parts, until the design that kills the workers is isolated."""
    if len(task) == 1:
        return evaluate([KILLED], **task.how)
    middle = len(task) // 2
    parts = [task.part(0, middle), task.part(middle, len(task))]
    first, second = (tried(pool, part) or _divided(pool, part) for part in parts)
    return replace(
        first,
        values=np.concatenate([first.values, second.values]),
        errors=np.concatenate([first.errors, second.errors]),
        failures=first.failures | {middle + k: reason for k, reason in second.failures.items()},
        waveforms={name: np.concatenate([waves, second.waveforms[name]]) for name, waves in first.waveforms.items()},
    )


def packed_models() -> bytes:
    """Return the outside models, pickled by value with the modules that define them; empty where there are none."""
    models = tuple(registry.registered())
    if not models:
        return b""
    cloudpickle: Any = import_module("cloudpickle")  # untyped
    parts = [part for model in models for part in (type(model), *vars(model).values()) if hasattr(part, "__module__")]
    names = {str(part.__module__) for part in parts}
    modules = [sys.modules[n] for n in names if n in sys.modules and n.partition(".")[0] not in _IMPORTABLE]
    for module in modules:
        cloudpickle.register_pickle_by_value(module)
    try:
        return bytes(cloudpickle.dumps(models))
    finally:
        for module in modules:
            cloudpickle.unregister_pickle_by_value(module)


def unpack_models(packed: bytes) -> None:
    """Register, in a worker, the models of `packed_models` that are not there yet."""
    known = {model.name for model in registry.registered()}
    for model in pickle.loads(packed) if packed else ():
        if model.name not in known:
            registry.register(model)


@contextmanager
def cluster_pool(address: str) -> Iterator[GivenPool]:
    """Yield the workers at ``address``: ``tcp://host:port``, or ``local:N``.

    Raises InputError where there are none, or of another version of this package.
    """
    library: Any = import_module("distributed")  # most of it is untyped
    kind, _, number = address.partition(":")
    local = kind == "local" and number.isdecimal() and 1 <= int(number) <= 1024
    if not local and kind not in ("tcp", "tls", "ucx", "ws", "wss"):
        raise InputError(f"cluster '{address}' is not understood; write {_CLUSTERS}")
    with ExitStack() as stack:
        scheduler: Any = address
        if local:
            require_processes()
            # no dashboard: it would need a port and a web server
            with _uninterrupted():
                scheduler = library.LocalCluster(n_workers=int(number), threads_per_worker=1, dashboard_address=None)
            stack.enter_context(scheduler)
        try:
            client = stack.enter_context(library.Client(scheduler, timeout=_PATIENCE))
            client.wait_for_workers(1, timeout=_PATIENCE)
        except (OSError, ValueError) as error:  # TimeoutError is an OSError
            reason = " ".join(str(error).split())[:120]
            raise InputError(f"no cluster with workers at '{address}' within {_PATIENCE} s: {reason}") from None
        _require_same_version(client)
        deaths = (library.scheduler.KilledWorker,)
        yield GivenPool(client.get_executor(pure=False), lambda: sum(client.ncores().values()), deaths)


def _require_same_version(client: Any) -> None:
    """Raise InputError for a cluster whose scheduler or workers lack this package, or have another version of it.

    The scheduler unpickles tasks, too, and other versions may give other results.
    """
    answers = {f"worker {name}": answer for name, answer in client.run(_version, on_error="return").items()}
    try:
        answers["the scheduler"] = client.run_on_scheduler(_version)
    except Exception as error:  # unpickling a function of a missing package may raise anything
        answers["the scheduler"] = error
    for place, answer in answers.items():
        if answer != __version__:
            found = f"version {answer}" if isinstance(answer, str) else f"none of use: {str(answer)[:80]}"
            raise InputError(
                f"{place} of the cluster needs ilg_circuit {__version__} with its extra 'cluster', and has {found}"
            )


def _version() -> str:
    return __version__
