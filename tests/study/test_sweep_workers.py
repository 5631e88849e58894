"""Sweeps by many workers: executors, processes and clusters, some of which die."""

import os
import signal
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sweeps import equal, spec_of

from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.study import spec as questions
from ilg_circuit.study import workers
from ilg_circuit.study.evaluate import Evaluation
from ilg_circuit.study.sweep import solve_sweep
from ilg_circuit.study.workers import GivenPool, LokyPool, processes_possible, solve_on

pytest.importorskip("h5netcdf", reason="netCDF files are an extra")


class _Dying(Executor):
    """An executor whose worker dies of a design, and at first for no reason; as loky does, it then is of no use."""

    def __init__(self, poison: float, accidents: int = 1) -> None:
        self.poison, self.accidents, self.broken = poison, accidents, False

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        if self.broken:
            raise BrokenProcessPool("of no use any more")
        task = args[0]
        deadly = np.delete(task.columns["thickness"], list(task.impossible)) == self.poison
        if deadly.any() or self.accidents:
            self.accidents, self.broken = max(self.accidents - 1, 0), True
            future.set_exception(BrokenProcessPool("a worker died"))
        else:
            future.set_result(fn(*args))
        return future


class _Renewable(GivenPool):
    def __init__(self, executor: _Dying) -> None:
        super().__init__(executor, lambda: 2, (BrokenProcessPool,))
        self.executor = executor

    def renew(self) -> None:
        self.executor.broken = False


@pytest.mark.parametrize("poisoned", [None, 5, 21])
def test_workers_that_die_cost_time_and_at_most_the_design_that_kills_them(
    poisoned: int | None, small_tasks: None
) -> None:
    spec = spec_of()
    b = spec.plan.columns["thickness"]
    poison = -1.0 if poisoned is None else float(b[poisoned])
    found: dict[int, Evaluation] = {}
    pool = _Renewable(_Dying(poison))
    solve_on(pool, range(spec.task_count), spec.task, found.__setitem__)
    assert sorted(found) == list(range(6))
    values = np.concatenate([found[k].values[:, 0] for k in range(6)])
    expected = formulas.steady_displacement(4.0, PAPER.coupling.static, spec.plan.columns["free_length"], b)
    lost = [] if poisoned is None else [poisoned]
    assert np.flatnonzero(np.isnan(values)).tolist() == lost
    assert np.delete(values, lost) == pytest.approx(np.delete(expected, lost), rel=1e-6)
    reasons = {4 * k + j: r for k, result in found.items() for j, r in result.failures.items()}
    assert list(reasons) == lost
    assert all("killed the worker process" in reason for reason in reasons.values())


@pytest.mark.parametrize("poisoned", [None, 6])
def test_no_death_changes_a_digit(poisoned: int | None, small_tasks: None) -> None:
    """Designs solved by ngspice share their time points; a part of them has others, and other last digits."""
    spec = spec_of(engine="ngspice")
    task = spec.task(1)
    first, _ = spec.bounds(1)
    killers = {} if poisoned is None else {poisoned - first: workers.KILLED}
    expected = questions.solve_task(replace(task, impossible=killers))
    assert (questions.solve_task(task.part(0, 2)).values != expected.values[:2]).any()
    poison = -1.0 if poisoned is None else float(spec.plan.columns["thickness"][poisoned])
    for accidents in range(1, 6):
        found: dict[int, Evaluation] = {}
        solve_on(_Renewable(_Dying(poison, accidents)), [1], spec.task, found.__setitem__)
        assert found[1].failures == expected.failures
        assert np.array_equal(found[1].values, expected.values, equal_nan=True)
        assert np.array_equal(found[1].errors, expected.errors, equal_nan=True)


def test_any_executor_will_do(tmp_path: Path, small_tasks: None) -> None:
    spec = spec_of()
    solve_sweep(spec, tmp_path / "serial.nc", jobs=1)
    with ThreadPoolExecutor(2) as executor:
        solve_sweep(spec, tmp_path / "threads.nc", executor=executor)
    assert equal(tmp_path / "serial.nc", tmp_path / "threads.nc")
    with pytest.raises(SolveError, match="lost a worker"):
        solve_sweep(spec, tmp_path / "dead.nc", executor=_Dying(-1.0))
    with pytest.raises(InputError, match="give one of"):
        solve_sweep(spec, tmp_path / "x.nc", jobs=2, cluster="local:2")
    with pytest.raises(InputError, match="give 1 to"):
        solve_sweep(spec, tmp_path / "x.nc", jobs=0)


with_processes = pytest.mark.skipif(
    not processes_possible(), reason="this machine lets processes share no locks, so there are no workers"
)


@with_processes
def test_processes_of_which_one_is_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(questions, "_DESIGNS", 20)
    spec = spec_of(count=100)
    solve_sweep(spec, tmp_path / "serial.nc", jobs=1)
    pools: list[LokyPool] = []
    killed: list[int] = []

    class Watched(LokyPool):
        def __init__(self, workers: int) -> None:
            super().__init__(workers)
            pools.append(self)

    def kill_one(done: int, _: int) -> None:
        if done and not killed:
            killed.append(next(iter(pools[0]._executor._processes)))
            os.kill(killed[0], signal.SIGKILL)

    monkeypatch.setattr(workers, "LokyPool", Watched)
    done = solve_sweep(spec, tmp_path / "two.nc", jobs=2, progress=kill_one)
    assert len(killed) == 1
    assert done.totals.failed == 0
    assert equal(tmp_path / "serial.nc", tmp_path / "two.nc")


def test_a_machine_without_shared_locks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small_tasks: None) -> None:
    """One process is what there is without being asked; more are refused in one line."""

    class Closed:
        def Lock(self) -> None:
            raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(workers.multiprocessing, "get_context", lambda _: Closed())
    done = solve_sweep(spec_of(), tmp_path / "s.nc")
    assert done.totals.failed == 0
    for how in ({"jobs": 2}, {"cluster": "local:2"}):
        with pytest.raises(SolveError, match=r"share no locks.*jobs=1"):
            solve_sweep(spec_of(), tmp_path / "t.nc", **how)


@with_processes
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_a_cluster_that_loses_a_worker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three workers on loopback, one of them killed while it works: the file is complete and equal."""
    distributed = pytest.importorskip("distributed", reason="dask.distributed is an extra")
    monkeypatch.setattr(questions, "_DESIGNS", 20)
    spec = spec_of(count=100, engine="ngspice")
    solve_sweep(spec, tmp_path / "serial.nc", jobs=1)
    with (
        distributed.LocalCluster(n_workers=3, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        victims = [w["pid"] for w in client.run(lambda: {"pid": os.getpid()}).values()]

        def kill_one(done: int, _: int) -> None:
            if done and victims:
                os.kill(victims[0], signal.SIGKILL)
                victims.clear()

        done = solve_sweep(spec, tmp_path / "cluster.nc", cluster=cluster.scheduler_address, progress=kill_one)
    assert not victims
    assert done.totals.failed == 0
    assert equal(tmp_path / "serial.nc", tmp_path / "cluster.nc")


def test_clusters_that_are_none(tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="dask.distributed is an extra")
    for address in ("local:", "local:0", "localhost", "udp://x:1"):
        with pytest.raises(InputError, match="local:4 for four workers"):
            solve_sweep(spec_of(), tmp_path / "x.nc", cluster=address)
    assert not list(tmp_path.iterdir())
