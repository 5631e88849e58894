"""The sweep: what is not yet solved of a spec is solved, and its answer put into one file."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Executor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ..errors import InputError, SolveError
from ..files import require_writable
from .dataset import Summary, write_dataset
from .evaluate import Evaluation, Progress
from .spec import SweepSpec, solve_task
from .store import Store
from .workers import GivenPool, LokyPool, Pool, processes_possible, solve_on


@dataclass(frozen=True)
class Swept:
    """A finished sweep: its file, its summary, and how many designs had been solved by a run before this one.

    ``leftover`` is a folder where finished tasks of another spec for the same file still lie, if there is one.
    """

    path: Path
    summary: Summary
    resumed: int
    leftover: Path | None


def sweep(
    spec: SweepSpec,
    out: str | Path,
    *,
    jobs: int | None = None,
    cluster: str | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    command: str = "",
) -> Swept:
    """Answer ``spec`` into the netCDF file ``out`` (read it with `ilg_circuit.study.read_sweep`).

    Solved by ``jobs`` processes (by default one a core, none beside this one for a single task or where a machine lets
    processes share no locks), on a dask ``cluster``
    (see `ilg_circuit.study.cluster`), or on an ``executor`` like those of `concurrent.futures`; the result is the same.
    Finished tasks are kept beside ``out`` until all are, so a sweep that was interrupted goes on where it was.
    ``progress(done, total)`` counts designs, for the first time before any is solved. Raises InputError for what cannot
    be written, SolveError when every design fails.
    """
    path = Path(out)
    require_writable(path)
    if sum(x is not None for x in (jobs, cluster, executor)) > 1:
        raise InputError("give one of jobs, cluster and executor")
    if jobs is not None and not 1 <= jobs <= 1024:
        raise InputError(f"{jobs} jobs: give 1 to 1024")
    store = Store(path, spec)
    try:
        finished = store.finished()
        resumed = sum(stop - start for start, stop in map(spec.bounds, finished))
        missing = [k for k in range(spec.task_count) if k not in finished]
        _solve(spec, missing, store, jobs or _usual_jobs(len(missing)), cluster, executor, progress)
        try:
            summary = write_dataset(path, spec, store, command)
        except SolveError:  # nothing is worth keeping where every design failed
            store.remove()
            raise
        store.remove()
    finally:
        store.remove_if_empty()  # an address that is none, say, leaves nothing behind
    return Swept(path, summary, resumed, store.parent if store.parent.exists() else None)


def _solve(
    spec: SweepSpec,
    missing: list[int],
    store: Store,
    workers: int,
    cluster: str | None,
    executor: Executor | None,
    progress: Progress | None,
) -> None:
    """Solve the tasks that are ``missing`` into the store."""
    total = spec.plan.count
    done = total - sum(stop - start for start, stop in map(spec.bounds, missing))
    if progress:
        progress(done, total)

    def save(number: int, result: Evaluation) -> None:
        nonlocal done
        store.write(number, result)
        done += len(result.values)
        if progress:
            progress(done, total)

    if missing and cluster is None and executor is None and workers == 1:
        for number in missing:
            save(number, solve_task(spec.task(number), _within(progress, done, total)))
    elif missing:
        with _pool(workers, cluster, executor) as pool:
            solve_on(pool, missing, spec.task, save)


def _within(progress: Progress | None, before: int, total: int) -> Progress | None:
    """Progress of the whole for a task that tells its own."""
    return None if progress is None else lambda done, _: progress(before + done, total)


def _usual_jobs(tasks: int) -> int:
    """A process a core, one where there is one task only or where there can be no more."""
    return min(_cores(), tasks) if tasks > 1 and processes_possible() else 1


def _cores() -> int:
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


@contextmanager
def _pool(workers: int, cluster: str | None, executor: Executor | None) -> Iterator[Pool]:
    if cluster is not None:
        from .cluster import cluster_pool

        with cluster_pool(cluster) as pool:
            yield pool
    elif executor is not None:
        width = int(getattr(executor, "_max_workers", 1))
        yield GivenPool(executor, lambda: width, (BrokenExecutor,))
    else:
        own = LokyPool(workers)
        try:
            yield own
        finally:
            own.close()
