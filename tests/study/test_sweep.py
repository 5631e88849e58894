"""Sweeps as files: closed forms over grids, interruption, workers that die, clusters, and failures."""

import os
import signal
import subprocess
import sys
import time
import tracemalloc
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import Run

from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.study import ScenarioTemplate, workers
from ilg_circuit.study import spec as questions
from ilg_circuit.study import sweep as sweeps
from ilg_circuit.study.evaluate import Evaluation
from ilg_circuit.study.plan import Plan, grid_plan, random_plan
from ilg_circuit.study.spec import SweepSpec, Task, solve_task
from ilg_circuit.study.store import Store
from ilg_circuit.study.sweep import solve_sweep, sweep
from ilg_circuit.study.workers import GivenPool, LokyPool, processes_possible, solve_on

pytest.importorskip("h5netcdf", reason="netCDF files are an extra")
from ilg_circuit.provenance import Provenance
from ilg_circuit.study.dataset import read_sweep

STEP = ScenarioTemplate(PAPER, "step:4V", 300.0)
STATIC = replace(STEP, beam="static")


@pytest.fixture
def small_tasks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tasks of four designs, so that few designs make several."""
    monkeypatch.setattr(questions, "_DESIGNS", 4)


def _spec(count: int = 22, engine: str = "exact", **more: Any) -> SweepSpec:
    texts = ["thickness=0.3mm:1mm", "free_length=15mm:40mm"]
    return SweepSpec(STATIC, random_plan(texts, count), ("displacement_final", "settling_time"), engine, **more)


def _equal(first: Path, second: Path) -> bool:
    with read_sweep(first) as a, read_sweep(second) as b:
        return bool(a.load().equals(b.load()))


@pytest.mark.parametrize("engine", ["exact", "ngspice"])
@pytest.mark.parametrize("beam", ["static", "dynamic"])
def test_displacement_over_length_thickness_and_width_is_ec_37(tmp_path: Path, engine: str, beam: str) -> None:
    plan = grid_plan(["free_length=15mm:40mm:4", "thickness=0.2mm:1mm:4", "width=2mm,10mm"])
    template = replace(STEP, beam=beam, duration=600.0)
    solve_sweep(SweepSpec(template, plan, ("displacement_final",), engine, 1e-6), tmp_path / "s.nc", jobs=1)
    with read_sweep(tmp_path / "s.nc") as data:
        expected = 3 * 4 * PAPER.coupling.static * data.free_length**2 / data.thickness**2
        assert np.abs(data.displacement_final / expected - 1).max() < 1e-5
        assert data.displacement_final.attrs == {"units": "m", "long_name": "displacement of L_F at the end"}
        assert data.free_length.attrs["units"] == "m"
        across = data.displacement_final
        assert np.abs(across.isel(width=0) / across.isel(width=1) - 1).max() < 1e-6


@pytest.mark.parametrize("engine", ["exact", "ngspice"])
def test_force_over_thickness_width_and_length_is_ec_39(tmp_path: Path, engine: str) -> None:
    plan = grid_plan(["thickness=0.2mm:1mm:3", "width=2mm:10mm:3", "free_length=15mm:40mm:3"])
    clamped = replace(STEP, tip="clamped", duration=600.0)
    spec = SweepSpec(clamped, plan, ("force_final", "force_blocked"), engine, 1e-6)
    solve_sweep(spec, tmp_path / "s.nc", jobs=1)
    with read_sweep(tmp_path / "s.nc") as data:
        expected = formulas.steady_force(
            4.0, PAPER.coupling.static, 7600.0, data.width, data.thickness, data.free_length
        )
        for name in spec.outputs:
            assert np.abs(data[name] / expected - 1).max() < 1e-5


def test_what_the_file_says(tmp_path: Path, small_tasks: None) -> None:
    plan = grid_plan(["orientation=weightless,horizontal", "thickness=0.4mm:0.6mm:3", "voltage=1V,4V"])
    spec = SweepSpec(STATIC, plan, ("displacement_final", "energy"), "exact", waveforms=("current",), samples=31)
    told: list[tuple[int, int]] = []
    done = solve_sweep(
        spec,
        tmp_path / "s.nc",
        jobs=1,
        progress=lambda *x: told.append(x),
        provenance=Provenance(call="ilg-circuit sweep ..."),
    )
    assert told[0] == (0, 12)
    assert told[-1] == (12, 12)
    assert (done.totals.count, done.totals.failed, done.resumed) == (12, 0, 0)
    assert list(tmp_path.iterdir()) == [tmp_path / "s.nc"]
    with read_sweep(tmp_path / "s.nc") as data:
        assert dict(data.sizes) == {"orientation": 2, "thickness": 3, "voltage": 2, "time": 31}
        assert data.orientation.values.tolist() == ["weightless", "horizontal"]
        assert data.current.sel(voltage=4.0, orientation="horizontal").isel(time=0).values == pytest.approx(
            4 * (1 / 666.6667 + 1 / 19.43635) * 0.5e-3 / data.thickness.values, rel=1e-6
        )
        assert (data.failure == "").all()
        assert data.attrs["command"] == "ilg-circuit sweep ..."
        assert data.attrs["duration_s"] == 300.0
        assert 'name = "paper"' in data.attrs["actuator"]
        assert "exact" in data.attrs["engine"]
    low, number = done.totals.lowest["displacement_final"]
    assert plan.designs(number, number + 1)["voltage"] == [1.0]
    assert low == pytest.approx(formulas.steady_displacement(1.0, PAPER.coupling.static, 30e-3, 0.6e-3), rel=1e-6)


def test_designs_that_cannot_be_are_rows_with_reasons(tmp_path: Path) -> None:
    plan = Plan(
        {"thickness": np.array([0.5e-3, np.nan, 0.4e-3]), "length": np.array([35e-3, 35e-3, 10e-3])}, False, "x"
    )
    done = solve_sweep(SweepSpec(STATIC, plan, ("displacement_final",), "exact"), tmp_path / "s.nc", jobs=1)
    assert done.totals.failed == 2
    with read_sweep(tmp_path / "s.nc") as data:
        assert data.sizes == {"design": 3}
        assert set(data.coords) == {"thickness", "length"}
        assert np.isfinite(data.displacement_final.values).tolist() == [True, False, False]
        assert [text[:12] for text in data.failure.values.tolist()] == ["", "thickness is", "geometry.fre"]


def test_a_sweep_without_any_success_is_an_error(tmp_path: Path) -> None:
    plan = Plan({"thickness": np.array([-1.0, np.nan])}, False, "x")
    with pytest.raises(SolveError, match=r"all 2 designs failed, design 0 because: .*thickness is -1"):
        solve_sweep(SweepSpec(STATIC, plan, ("displacement_final",), "exact"), tmp_path / "s.nc", jobs=1)
    assert not list(tmp_path.iterdir())


class _Interrupted(Exception):
    pass


def test_an_interrupted_sweep_goes_on_and_another_question_does_not(
    tmp_path: Path, small_tasks: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec, path = _spec(), tmp_path / "s.nc"
    solve_sweep(spec, tmp_path / "whole.nc", jobs=1)

    def interrupt(done: int, total: int) -> None:
        if done >= 12:
            raise _Interrupted

    with pytest.raises(_Interrupted):
        solve_sweep(spec, path, jobs=1, progress=interrupt)
    kept = Store(path, spec)
    assert kept.finished() == {0, 1}
    assert not path.exists()
    solved: list[Task] = []

    def counting(task: Task, progress: Any = None) -> Evaluation:
        solved.append(task)
        return solve_task(task, progress)

    monkeypatch.setattr("ilg_circuit.study.sweep.solve_task", counting)
    other = solve_sweep(_spec(count=21), path, jobs=1)
    assert other.resumed == 0
    assert other.leftover == tmp_path / "s.nc.part"
    assert len(solved) == 6
    assert kept.finished() == {0, 1}
    solved.clear()
    done = solve_sweep(spec, path, jobs=1)
    assert (done.resumed, done.leftover) == (8, None)
    assert len(solved) == 4
    assert _equal(path, tmp_path / "whole.nc")
    assert not path.with_name("s.nc.part").exists()


@pytest.mark.parametrize(
    "change",
    [
        {"outputs": ("displacement_final",)},
        {"engine": "ngspice"},
        {"accuracy": 1e-5},
        {"waveforms": ("current",)},
        {"template": replace(STATIC, duration=301.0)},
        {"template": replace(STATIC, drive="step:3V")},
        {"template": replace(STATIC, actuator=replace(PAPER, name="other"))},
        {"plan": random_plan(["thickness=0.3mm:1mm", "free_length=15mm:40mm"], 22, seed=1)},
    ],
)
def test_every_part_of_a_question_is_in_its_key(change: dict[str, Any]) -> None:
    spec = _spec()
    parts = {n: getattr(spec, n) for n in ("template", "plan", "outputs", "engine", "accuracy", "waveforms", "samples")}
    assert SweepSpec(**parts).key == spec.key
    assert SweepSpec(**(parts | change)).key != spec.key


def test_a_file_may_be_larger_than_the_memory_that_makes_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(questions, "_MOST_BYTES", 1e6)
    spec = _spec(count=128, waveforms=("displacement",), samples=30_001)
    solve_sweep(_spec(count=1), tmp_path / "first.nc", jobs=1)  # what is imported on the way is not of the sweep
    tracemalloc.start()
    try:
        solve_sweep(spec, tmp_path / "s.nc", jobs=1)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert (tmp_path / "s.nc").stat().st_size > 30e6
    assert peak < 8e6


def test_a_measured_drive_is_read_once(tmp_path: Path) -> None:
    """Where tasks are solved there may be no such file; and it is in the key by what it holds."""
    path = tmp_path / "drive.csv"
    path.write_text("time_s,voltage_V\n0,0\n10,4\n300,4\n")
    template = replace(STATIC, drive=f"file:{path}")
    plan = grid_plan(["voltage=2V,4V"])
    spec = SweepSpec(template, plan, ("displacement_final",), "exact")
    path.write_text("time_s,voltage_V\n0,0\n10,3\n300,4\n")
    assert SweepSpec(template, plan, ("displacement_final",), "exact").key != spec.key
    path.unlink()
    solve_sweep(spec, tmp_path / "s.nc", jobs=1)
    with read_sweep(tmp_path / "s.nc") as data:
        assert data.attrs["drive"] == "file drive.csv"
        steady = formulas.steady_displacement(4.0, PAPER.coupling.static, 30e-3, 0.5e-3)
        assert data.displacement_final.values == pytest.approx([steady / 2, steady], rel=1e-5)


def test_a_damaged_part_is_named_and_removed(tmp_path: Path, small_tasks: None) -> None:
    spec, path = _spec(), tmp_path / "s.nc"
    store = Store(path, spec)
    (store.folder / "000001.npz").write_bytes(b"not a result")
    with pytest.raises(InputError, match=r"000001\.npz' was damaged"):
        solve_sweep(spec, path, jobs=1)
    assert solve_sweep(spec, path, jobs=1).resumed == 18


def test_killed_and_started_again(tmp_path: Path, run: Run) -> None:
    """The program itself, killed without a word in the middle."""
    command = [
        "sweep", "paper", "--vary", "emission_voltage=5V:10V", "--random", "64",
        "--drive", "step:1V", "--duration", "20s", "--beam", "static", "--jobs", "1", "--accuracy", "1e-4",
    ]  # fmt: skip
    parts = tmp_path / "s.nc.part"
    program = [sys.executable, "-m", "ilg_circuit", *command, "--out", str(tmp_path / "s.nc")]
    with subprocess.Popen(program, stdout=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + 60
        while not list(parts.glob("*/000001.npz")):
            assert time.monotonic() < deadline
            assert process.poll() is None, "it was done before it could be killed"
            time.sleep(0.02)
        os.kill(process.pid, signal.SIGKILL)
    finished = {p.name: p.stat().st_mtime_ns for p in parts.glob("*/0*.npz")}
    assert 2 <= len(finished) < 4
    again = run(*command, "--out", str(tmp_path / "s.nc"))
    assert f"{16 * len(finished)} of them by an earlier run" in again.out
    assert run(*command, "--out", str(tmp_path / "t.nc")).code == 0
    assert _equal(tmp_path / "s.nc", tmp_path / "t.nc")


class _Dying(Executor):
    """An executor whose worker dies of certain designs, and once for no reason; as loky does, it then is of no use."""

    def __init__(self, poison: float) -> None:
        self.poison, self.accidents, self.broken = poison, 1, False

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        if self.broken:
            raise BrokenProcessPool("of no use any more")
        if self.poison in args[0].columns["thickness"] or self.accidents:
            self.accidents, self.broken = 0, True
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
    spec = _spec()
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


def test_without_a_file_the_sweep_is_in_memory(tmp_path: Path) -> None:
    kept = sweep("paper", "step:4V", "300s", vary=["thickness=0.4mm,0.8mm"], engine="exact", out=tmp_path / "s.nc")
    done = sweep(PAPER, "step:4V", 300.0, vary=["thickness=0.4mm,0.8mm"], engine="exact")
    assert done.path is None
    assert done.to_xarray().displacement_final.dims == ("thickness",)
    with kept.to_xarray() as data:
        assert data.equals(done.to_xarray())
    assert done.to_dict()["highest"]["displacement_final"]["design"] == 0
    assert done.summary().startswith("grid of thickness=0.4mm,0.8mm: 2 of 2 designs solved\n")
    assert "relative_deflection" in done.warnings[0]


def test_any_executor_will_do(tmp_path: Path, small_tasks: None) -> None:
    spec = _spec()
    solve_sweep(spec, tmp_path / "serial.nc", jobs=1)
    with ThreadPoolExecutor(2) as executor:
        solve_sweep(spec, tmp_path / "threads.nc", executor=executor)
    assert _equal(tmp_path / "serial.nc", tmp_path / "threads.nc")
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
    spec = _spec(count=200)
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

    monkeypatch.setattr(sweeps, "LokyPool", Watched)
    done = solve_sweep(spec, tmp_path / "two.nc", jobs=2, progress=kill_one)
    assert len(killed) == 1
    assert done.totals.failed == 0
    assert _equal(tmp_path / "serial.nc", tmp_path / "two.nc")


def test_a_machine_without_shared_locks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small_tasks: None) -> None:
    """One process is what there is without being asked; more are refused in one line."""

    class Closed:
        def Lock(self) -> None:
            raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(workers.multiprocessing, "get_context", lambda _: Closed())
    done = solve_sweep(_spec(), tmp_path / "s.nc")
    assert done.totals.failed == 0
    for how in ({"jobs": 2}, {"cluster": "local:2"}):
        with pytest.raises(SolveError, match=r"share no locks.*--jobs 1"):
            solve_sweep(_spec(), tmp_path / "t.nc", **how)


@with_processes
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_a_cluster_that_loses_a_worker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three workers on loopback, one of them killed while it works: the file is complete and equal."""
    distributed = pytest.importorskip("distributed", reason="dask.distributed is an extra")
    monkeypatch.setattr(questions, "_DESIGNS", 20)
    spec = _spec(count=200, engine="ngspice")
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
    assert _equal(tmp_path / "serial.nc", tmp_path / "cluster.nc")


def test_clusters_that_are_none(tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="dask.distributed is an extra")
    for address in ("local:", "local:0", "localhost", "udp://x:1"):
        with pytest.raises(InputError, match="local:4 for four workers"):
            solve_sweep(_spec(), tmp_path / "x.nc", cluster=address)
    assert not list(tmp_path.iterdir())
