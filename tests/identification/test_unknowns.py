"""What a record does not say exactly is in its intervals: onset, rest level, offset, what was stored, a camera's delay.

Records are made from closed forms with noise; the truth must lie within the intervals that are told.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line
from numpy.typing import NDArray
from synthetic import record, step

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.findings import codes
from ilg_circuit.identification import Identification, identify
from ilg_circuit.identification.port_response import engine_currents
from ilg_circuit.measurements.prepare import prepare
from ilg_circuit.measurements.record import Record
from ilg_circuit.measurements.table import Table
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.models import electrical_model

Array = NDArray[np.float64]

RC = {"dc_resistance": 666.667, "dynamic_resistance": 19.4363, "capacitance": 0.35}
FAST = {
    "dc_resistance": 6022.0,
    **{"resistance_1": 185.1, "capacitance_1": 91.9e-6, "resistance_2": 139.4, "capacitance_2": 1.588e-3},
    **{"resistance_3": 428.7, "capacitance_3": 3.5485e-3},
}
WARBURG = {"dc_resistance": 500.0, "series_resistance": 15.0, "warburg_resistance": 60.0, "diffusion_time": 20.0}


def table(
    model: str,
    truth: Mapping[str, float],
    *,
    onset: float,
    interval: float,
    duration: float,
    level: float = 4.0,
    rest: float = 0.0,
    offset: float = 0.0,
    noise: float = 1e-3,
    seed: int = 2,
) -> Table:
    """A step at ``onset`` [s] read every ``interval`` [s]; a reading at the onset itself is still at rest."""
    port = electrical_model(model).port(list(truth.values()))
    t = np.arange(0, duration, interval)
    after = t > onset + 1e-12
    drive = PiecewiseLinear.step(level).resting(rest)
    current = np.full(len(t), rest / truth["dc_resistance"])
    current[after] = engine_currents([port], drive, t[after] - onset, "exact")[0]
    random = np.random.default_rng(seed)
    current = current + offset + noise * float(np.abs(current).max()) * random.standard_normal(len(t))
    return Table({"time": t, "voltage": np.where(after, level, rest), "current": current}, "step.csv")


def write(made: Table, path: Path) -> Path:
    rows = np.column_stack([made.columns[name] for name in ("time", "voltage", "current")])
    np.savetxt(path, rows, fmt="%.9g", delimiter=",", header="time_s,voltage_V,current_A", comments="")
    return path


def assert_held(found: Identification, truth: Mapping[str, float]) -> None:
    for name, value in truth.items():
        low, high = found.parameters[name].reported[1]
        assert low <= value <= high, (name, value, low, high)


# -- the onset ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("onset", "interval"), [(5.0, 1.0), (5.5, 1.0), (5.999, 1.0), (4.8, 0.25)])
def test_onset_between_readings_is_in_the_intervals(onset: float, interval: float) -> None:
    """R and C are known within exp(h/tau), Rdc and the time constant as well as ever."""
    made = prepare(table("rc", RC, onset=onset, interval=interval, duration=125.0))
    found = identify(made, model="rc", engine="exact")
    assert_held(found, RC)
    tau = RC["dynamic_resistance"] * RC["capacitance"]
    low, high = found.parameters["dynamic_resistance"].reported[1]
    assert np.log(high / low) == pytest.approx(interval / tau, rel=0.1)
    assert found.derived["time_constant"].value == pytest.approx(tau, rel=5e-3)
    before = np.floor(onset / interval + 1e-9) * interval
    assert found.derived["onset"].ci95 == pytest.approx((before, before + interval))
    (told,) = (f for f in found.findings if f.code == "onset-bracketed")
    assert set(told.values["parameters"]) == {"dynamic_resistance", "capacitance"}


@pytest.mark.parametrize("onset", [5.0, 5.37])
def test_onset_that_is_stated_is_exact(onset: float) -> None:
    made = table("rc", RC, onset=onset, interval=1.0, duration=125.0)
    found = identify(prepare(made, "last-rest" if onset == 5.0 else onset), model="rc", engine="exact")
    assert_held(found, RC)
    low, high = found.parameters["dynamic_resistance"].reported[1]
    assert high / low < 1.005
    assert not codes(found.findings) & {"onset-bracketed", "jumps-bracketed", "current-one-row-late"}


@pytest.mark.parametrize("share", [0.05, 0.5, 0.95])
def test_fast_strip_is_known_as_far_as_its_onset(share: float) -> None:
    made = prepare(table("rc3", FAST, onset=2.65 + 0.01 * share, interval=0.01, duration=60.0, level=1.489, noise=2e-3))
    found = identify(made, model="rc3", engine="exact")
    assert_held(found, FAST)


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_diffusion_tells_its_onset(share: float) -> None:
    made = prepare(table("warburg", WARBURG, onset=5.0 + share, interval=1.0, duration=200.0, noise=2e-4))
    found = identify(made, model="warburg", engine="exact")
    low, high = found.derived["onset"].reported[1]
    assert low <= 5.0 + share <= high
    assert high - low < 0.5
    assert_held(found, WARBURG)


def test_current_a_row_late_has_its_own_bracket() -> None:
    """The first reading has the set voltage, but the current of before it."""
    made = table("rc", RC, onset=5.0, interval=0.25, duration=120.0, noise=5e-4)
    rows = slice(20, None)
    columns = {name: column[rows].copy() for name, column in made.columns.items()}
    columns["time"] -= columns["time"][0]
    columns["voltage"][0] = 4.0
    found = identify(prepare(Table(columns, "first.csv")), model="rc", engine="exact")
    assert "current-one-row-late" in codes(found.findings)
    assert_held(found, RC)
    assert found.observations[0].misfit is not None
    assert not found.observations[0].misfit.warn


def test_jumps_of_a_waveform_lie_between_readings_too() -> None:
    port = electrical_model("rc").port(list(RC.values()))
    drive = PiecewiseLinear.square(-2.0, 2.0, 30.0, 120.0)
    t = np.arange(-10.0, 120.0, 0.5)
    for late in (0.01, 0.25, 0.49):
        after = t >= late
        columns = {"time": t + 10, "voltage": np.where(after, drive.value(t - late), 0.0), "current": np.zeros(len(t))}
        columns["current"][after] = engine_currents([port], drive, t[after] - late, "exact")[0]
        columns["current"] += 1e-4 * np.random.default_rng(3).standard_normal(len(t))
        assert_held(identify(prepare(Table(columns, "square.csv")), model="rc", engine="exact"), RC)


def test_onset_outside_its_readings_is_refused(tmp_path: Path, run: Run) -> None:
    path = write(table("rc", RC, onset=5.0, interval=1.0, duration=60.0), tmp_path / "s.csv")
    assert_one_line(run("identify", str(path), "--onset", "9s"), "--onset 9 s is excluded by the readings")
    assert_one_line(run("identify", str(path), "--onset", "other.csv=5s"), "'other.csv' is not one of them")
    assert_one_line(run("identify", str(path), "--onset", "first"), "--onset", "last-rest or first-level")


# -- rest --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("rest", "level"), [(0.02, 4.0), (0.15, 4.0), (1.0, 3.0), (4.0, -4.0), (3.0, 0.0)])
def test_strip_starts_at_rest_under_any_voltage(rest: float, level: float) -> None:
    made = table("rc", RC, onset=5.0, interval=0.25, duration=120.0, rest=rest, level=level, offset=2e-4)
    found = identify(prepare(made, "last-rest"), model="rc", engine="exact")
    assert_held(found, RC)
    assert found.derived["current_offset"].value == pytest.approx(2e-4, abs=2e-4)


@pytest.mark.parametrize("offset", [0.0, 0.1e-3])
def test_small_offset_is_always_fitted(offset: float) -> None:
    """0.4 of the noise's deviation, which a test for it would miss, is in the interval of Rdc."""
    held = 0
    for seed in range(16):
        made = table("rc", RC, onset=5.0, interval=0.1, duration=120.0, level=2.0, offset=offset, noise=0.0)
        made.columns["current"][:] += 0.25e-3 * np.random.default_rng(seed).standard_normal(len(made.time))
        found = identify(prepare(made, "last-rest"), model="rc", engine="exact")
        low, high = found.parameters["dc_resistance"].reported[1]
        held += low <= RC["dc_resistance"] <= high
    assert held >= 14


def test_record_without_rest_says_what_is_assumed() -> None:
    made = table("rc", RC, onset=5.0, interval=0.25, duration=120.0)
    columns = {name: column[21:] for name, column in made.columns.items()}
    found = identify(prepare(Table(columns, "s.csv")), model="rc", engine="exact")
    assert {"offset-assumed", "onset-assumed"} <= codes(found.findings)


# -- a record out of a longer run --------------------------------------------------------------------------------------


@pytest.mark.parametrize("begin", [0.0, 33.0, 47.3])
def test_record_within_a_run_has_free_charges(begin: float) -> None:
    truth = {"dc_resistance": 400.0, "resistance_1": 40.0, "capacitance_1": 0.05, "resistance_2": 100.0}
    truth["capacitance_2"] = 0.2
    port = electrical_model("rc2").port(list(truth.values()))
    t = np.arange(0.0, 180.0, 0.1)
    turns = np.arange(-10.0, 200.0, 10.0)
    knots = PiecewiseLinear(t, np.interp(t, turns, 2 * np.resize([-1.0, 1.0, 0.3, 0.8], len(turns))))
    current = engine_currents([port], knots, t, "exact")[0] + 1e-4 * np.random.default_rng(1).standard_normal(len(t))
    rows = (t >= begin) & (t < begin + 120)
    columns = {"time": t[rows] - begin, "voltage": knots.values[rows], "current": current[rows]}
    found = identify(prepare(Table(columns, "run.csv")), model="rc2", engine="exact")
    assert "begins-within-run" in codes(found.findings)
    assert_held(found, truth)


@pytest.mark.parametrize("seed", [0, 4])
def test_a_displacement_within_a_run_does_not_tell_when_the_voltage_jumps(seed: int) -> None:
    """What moved the strip before is not known; in the second set it left out the place of the jumps."""
    drive = PiecewiseLinear.square(-1.5, 1.5, 30.0, 240.0)
    whole = record(drive, 240.0, 1201, displacement=True, noise=0.005, seed=seed)
    run = whole.rows(whole.columns["time"] >= 7.0)
    found = identify(prepare(Table(run.columns, "run.csv")), base=PAPER, model="rc", engine="exact")
    for name, true in (("dynamic_resistance", 19.43635), ("capacitance", 0.35)):
        interval = found.parameters[name].interval
        assert interval is not None
        assert interval[0] <= true <= interval[1], name


# -- a camera's delay --------------------------------------------------------------------------------------------------


@cache
def filmed(late: float) -> Record:
    r = record(step(), 120.0, 1201, rest=60, displacement=True, noise=2e-3, seed=5)
    t, y = r.columns["time"], r.columns["displacement"]
    return r.changed(displacement=np.interp(t - late, t, y)).measurement()


@pytest.mark.parametrize("late", [0.37, -0.8])
def test_delay_of_a_camera_is_found(late: float) -> None:
    found = identify(filmed(late), base=PAPER, model="rc", engine="exact", displacement_delay="fit")
    low, high = found.derived["displacement_delay"].reported[1]
    assert low <= late <= high
    assert high - low < 0.2
    assert PAPER.coupling is not None
    truth = {f"coupling_{name}": getattr(PAPER.coupling, name) for name in ("gain", "zero", "damping_ratio")}
    assert_held(found, truth)


def test_delay_that_is_stated_is_taken() -> None:
    found = identify(filmed(0.37), base=PAPER, model="rc", engine="exact", displacement_delay=0.37)
    assert PAPER.coupling is not None
    assert found.parameters["coupling_gain"].value == pytest.approx(PAPER.coupling.gain, rel=0.02)


# -- outliers and misfit -----------------------------------------------------------------------------------------------


def test_spikes_are_named_and_left_out() -> None:
    made = table("rc", RC, onset=5.0, interval=0.25, duration=125.0)
    clean = identify(prepare(made, "last-rest"), model="rc", engine="exact")
    rows = {60: 0.5, 200: -0.4, 333: 0.3}
    made.columns["current"][list(rows)] += list(rows.values())
    found = identify(prepare(made, "last-rest"), model="rc", engine="exact")
    (told,) = (f for f in found.findings if f.code == "outliers")
    assert told.values["count"] == 3
    assert [text.split()[0] for text in told.values["readings"]] == ["15", "50", "83.25"]
    for name in RC:
        near = clean.parameters[name]
        assert found.parameters[name].value == pytest.approx(near.value, abs=0.2 * near.reported[0])


def test_misfit_is_no_success(tmp_path: Path, run: Run) -> None:
    """A current that oscillates is no strip's: everything is written, and the exit code tells."""
    made = table("rc", RC, onset=5.0, interval=0.25, duration=125.0)
    after = made.time > 5
    made.columns["current"][after] += 0.06 * np.sin(made.time[after])
    path, out = write(made, tmp_path / "s.csv"), tmp_path / "f.json"
    done = run("identify", str(path), "--model", "rc", "--engine", "exact", "--json", str(out))
    assert done.code == 1
    told = json.loads(out.read_text())
    assert told["success"] is False
    assert told["records"][0]["misfit"]["fail"] is True
    assert "not-a-success" in {f["code"] for f in told["findings"]}


def test_fit_is_judged_by_ngspice() -> None:
    made = prepare(table("rc", RC, onset=5.0, interval=0.25, duration=60.0), "last-rest")
    found = identify(made, model="rc")
    exact = identify(made, model="rc", engine="exact")
    assert found.statistics["judgement"]["largest_move_in_standard_errors"] < 0.02
    assert found.statistics["judgement"]["refitted"] is False
    assert exact.statistics["judgement"] is None
    for name in RC:
        assert found.parameters[name].value == pytest.approx(exact.parameters[name].value, rel=1e-9)


def test_readings_are_not_changed() -> None:
    made = table("rc", RC, onset=5.0, interval=0.25, duration=60.0)
    before = {name: column.copy() for name, column in made.columns.items()}
    prepare(replace(made), "last-rest")
    for name, column in before.items():
        assert np.array_equal(made.columns[name], column)


def test_records_are_fitted_up_to_a_time(tmp_path: Path, run: Run) -> None:
    """What comes later, here a second step that the voltage does not show, is in no residual and no BIC."""
    made = table("rc", RC, onset=5.0, interval=0.25, duration=125.0)
    made.columns["current"][made.time > 65] += 0.05
    found = identify(prepare(made, "last-rest"), model="rc", engine="exact", until=59.9)
    assert_held(found, RC)
    assert found.observations[0].abscissa.max() <= 59.9
    assert found.statistics["n"] == (made.time <= 64.9).sum()
    assert "fitted-until" in codes(found.findings)
    path = write(made, tmp_path / "s.csv")
    assert_one_line(run("identify", str(path), "--until", "1s"), "4 readings of the current up to 1 s", "needs 10")


@pytest.mark.parametrize(("rows", "seed"), [(3, 0), (5, 3)])
def test_a_current_that_is_late_leaves_the_displacement_its_own_time(rows: int, seed: int) -> None:
    """The strip moved before the current's readings came; R and C were 20 standard errors off, and sure."""
    made = record(step(), 120.0, 1201, rest=10, displacement=True, noise=2e-3, seed=seed)
    current = made.columns["current"]
    late = made.changed(current=np.concatenate([current[:rows], current[:-rows]]))
    found = identify(late.measurement(), base=PAPER, model="rc", engine="exact")
    assert "current-late" in codes(found.findings)
    delay = found.derived["displacement_delay"]
    assert delay.stderr is not None
    assert delay.value == pytest.approx(-0.1 * rows, abs=0.1 + 3 * delay.stderr)
    assert PAPER.coupling is not None
    truth = {"dynamic_resistance": 19.43635, "coupling_gain": PAPER.coupling.gain, "coupling_zero": PAPER.coupling.zero}
    truth["coupling_natural_frequency"] = PAPER.coupling.natural_frequency
    assert_held(found, truth)
