"""Sweeps: `sweep` solves the designs of a grid, a sample or a list into one netCDF file, in parallel and resumably."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, ClassVar

from ..circuit.strip import Load
from ..drive import Drive
from ..errors import InputError, SolveError
from ..files import require_writable
from ..findings import Finding, Warned
from ..provenance import Provenance
from ..result import Result
from ..strip.actuator import Actuator
from .dataset import SweepTotals, read_sweep, write_dataset
from .evaluate import STUDY_ACCURACY, Evaluation, Progress
from .parameters import scenario_template
from .spec import SweepSpec, solve_task, sweep_spec
from .store import Store
from .validity import deflection_findings
from .workers import GivenPool, LokyPool, Pool, processes_possible, solve_on

if TYPE_CHECKING:
    from xarray import Dataset


@dataclass(frozen=True, eq=False)
class SweepResult(Result, Warned):
    """Result of a sweep: its specification, its file (None: kept in memory) and its totals.

    ``resumed`` designs had been solved by an earlier run. ``leftover`` is a folder with finished tasks of another sweep
    into the same file, None if there is none.
    """

    presenter: ClassVar[str] = "sweep"

    spec: SweepSpec
    totals: SweepTotals
    path: Path | None = None
    resumed: int = 0
    leftover: Path | None = None
    data: Dataset | None = field(default=None, repr=False)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """The finding that designs exceed the small-deflection limit, if any do."""
        return tuple(deflection_findings(self.totals.bent))

    def to_xarray(self) -> Dataset:
        """Return the designs and their outputs with units; from a file it is opened and not loaded yet."""
        if self.data is not None:
            return self.data
        assert self.path is not None
        return read_sweep(self.path)

    def to_dict(self) -> dict[str, Any]:
        """Return the totals as JSON-ready values, SI units; ``lowest`` and ``highest`` name the design's number."""
        totals = self.totals
        ends = {"lowest": totals.lowest, "highest": totals.highest}
        return {
            "designs": self.spec.plan.text,
            "count": totals.count,
            "failed": totals.failed,
            "resumed": self.resumed,
            "estimated_error": totals.worst_error,
            **{
                which: {name: {"value": value, "design": number} for name, (value, number) in table.items()}
                for which, table in ends.items()
            },
            "warnings": list(self.warnings),
        }


def sweep(
    actuator: str | Path | Actuator,
    drive: str | Drive,
    duration: str | float,
    *,
    vary: Sequence[str] = (),
    random: int | None = None,
    method: str | None = None,
    seed: int | None = None,
    designs: Path | None = None,
    outputs: Sequence[str] | None = None,
    waveforms: Sequence[str] = (),
    samples: int | None = None,
    tip: str = "free",
    beam: str | None = None,
    load: str | Load | None = None,
    engine: str = "ngspice",
    accuracy: float = STUDY_ACCURACY,
    out: str | Path | None = None,
    jobs: int | None = None,
    cluster: str | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    provenance: Provenance | None = None,
) -> SweepResult:
    """Solve many designs of one strip: strip and run as in `parameters.scenario_template`, designs as in `sweep_spec`.

    ``out`` and the arguments after it are those of `solve_sweep`. Raises InputError and SolveError.
    """
    spec = sweep_spec(
        scenario_template(actuator, drive, duration, tip=tip, beam=beam, load=load),
        vary,
        random=random,
        method=method,
        seed=seed,
        designs=designs,
        outputs=outputs,
        waveforms=waveforms,
        samples=samples,
        engine=engine,
        accuracy=accuracy,
    )
    where: dict[str, Any] = {"jobs": jobs, "cluster": cluster, "executor": executor}
    return solve_sweep(spec, out, progress=progress, provenance=provenance or Provenance(seed=seed), **where)


def solve_sweep(
    spec: SweepSpec,
    out: str | Path | None = None,
    *,
    jobs: int | None = None,
    cluster: str | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    provenance: Provenance | None = None,
) -> SweepResult:
    """Solve ``spec`` into the netCDF file ``out``, or in memory without one.

    Solved by ``jobs`` processes (default: one a core; this one alone for a single task, or where processes cannot share
    locks), on a dask ``cluster`` (see `study.cluster`), or on an ``executor`` like those of `concurrent.futures`; the
    result is the same. Finished tasks are kept beside ``out`` until all are, so that an interrupted sweep is resumed.
    ``progress(done, total)`` counts designs, first called before any is solved. Raises InputError where the file cannot
    be written, SolveError where every design fails.
    """
    if out is None:
        with TemporaryDirectory() as folder:
            where: dict[str, Any] = {"jobs": jobs, "cluster": cluster, "executor": executor}
            result = solve_sweep(spec, Path(folder) / "sweep.nc", progress=progress, provenance=provenance, **where)
            with result.to_xarray() as data:
                return replace(result, path=None, leftover=None, data=data.load())
    path = Path(out)
    require_writable(path)
    if sum(x is not None for x in (jobs, cluster, executor)) > 1:
        raise InputError("give one of jobs, cluster and executor")
    if jobs is not None and not 1 <= jobs <= 1024:
        raise InputError(f"{jobs} jobs: give 1 to 1024")
    made_by = provenance or Provenance()
    store = Store(path, spec)
    try:
        finished = store.finished()
        resumed = sum(stop - start for start, stop in map(spec.bounds, finished))
        missing = [k for k in range(spec.task_count) if k not in finished]
        _solve(spec, missing, store, jobs or _usual_jobs(len(missing)), cluster, executor, progress)
        try:
            totals = write_dataset(path, spec, store, made_by)
        except SolveError:  # nothing is worth keeping where every design failed
            store.remove()
            raise
        store.remove()
    finally:
        store.remove_if_empty()  # a failed start, such as a wrong address, leaves nothing behind
    leftover = store.parent if store.parent.exists() else None
    return SweepResult(spec, totals, path, resumed, leftover, provenance=made_by)


def _solve(
    spec: SweepSpec,
    missing: list[int],
    store: Store,
    workers: int,
    cluster: str | None,
    executor: Executor | None,
    progress: Progress | None,
) -> None:
    """Solve the ``missing`` tasks into the store."""
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
    """Return the progress of one task as progress of the whole sweep."""
    return None if progress is None else lambda done, _: progress(before + done, total)


def _usual_jobs(tasks: int) -> int:
    """Return one process a core; one for a single task, or where more are impossible."""
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
