"""Sweeps as files: closed forms over grids, what a file says, interruption, and failures."""

import multiprocessing
import tracemalloc
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sweeps import STATIC, STEP, equal, spec_of

from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.study import spec as questions
from ilg_circuit.study.dataset import Store
from ilg_circuit.study.evaluate import Evaluation
from ilg_circuit.study.plan import Plan, grid_plan, random_plan
from ilg_circuit.study.spec import SweepSpec, Task, solve_task
from ilg_circuit.study.sweep import solve_sweep, sweep

pytest.importorskip("h5netcdf", reason="netCDF files are an extra")
from ilg_circuit.provenance import Provenance
from ilg_circuit.study.dataset import read_sweep


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
    spec, path = spec_of(), tmp_path / "s.nc"
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
    other = solve_sweep(spec_of(count=21), path, jobs=1)
    assert other.resumed == 0
    assert other.leftover == tmp_path / "s.nc.part"
    assert len(solved) == 6
    assert kept.finished() == {0, 1}
    solved.clear()
    done = solve_sweep(spec, path, jobs=1)
    assert (done.resumed, done.leftover) == (8, None)
    assert len(solved) == 4
    assert equal(path, tmp_path / "whole.nc")
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
    spec = spec_of()
    parts = {n: getattr(spec, n) for n in ("template", "plan", "outputs", "engine", "accuracy", "waveforms", "samples")}
    assert SweepSpec(**parts).key == spec.key
    assert SweepSpec(**(parts | change)).key != spec.key


def _peak_of_a_large_sweep(folder: Path) -> int:
    """Return the most memory [B] that a sweep takes whose file is ten times as large, and larger than its bound."""
    questions._MOST_BYTES = 1e6
    spec = spec_of(count=128, waveforms=("displacement",), samples=30_001)
    solve_sweep(spec_of(count=1), folder / "first.nc", jobs=1)  # what is imported on the way is not of the sweep
    tracemalloc.start()
    solve_sweep(spec, folder / "s.nc", jobs=1)
    return tracemalloc.get_traced_memory()[1]


def test_a_file_may_be_larger_than_the_memory_that_makes_it(tmp_path: Path) -> None:
    # in a process of its own: what other tests' threads take is not of the sweep
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as fresh:
        peak = fresh.submit(_peak_of_a_large_sweep, tmp_path).result()
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
    spec, path = spec_of(), tmp_path / "s.nc"
    store = Store(path, spec)
    store.folder.mkdir(parents=True)
    (store.folder / "000001.npz").write_bytes(b"not a result")
    with pytest.raises(InputError, match=r"000001\.npz' was damaged"):
        solve_sweep(spec, path, jobs=1)
    assert solve_sweep(spec, path, jobs=1).resumed == 18


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
