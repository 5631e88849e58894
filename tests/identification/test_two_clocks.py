"""A camera beside a potentiostat: its clock's delay and rate are found, and the coupling is as sure as it says."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from command import Run, assert_one_line

import ilg_circuit as ilg
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.findings import codes
from ilg_circuit.simulation.response import simulate

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def intervals(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(BENCHMARKS)
    return importlib.import_module("intervals")


def test_a_camera_that_is_late_is_in_the_intervals(intervals: ModuleType) -> None:
    """0.37 s late at 25 Hz beside 10 Hz. Of 2 sets an honest interval misses both with a chance of 0.3 %."""
    group = intervals.GROUPS["camera"]
    found = intervals.coverage(group.trial("step"), group.truth("step"), range(2))
    assert found.failed == []
    assert found.part("displacement_delay") == 1
    assert {name: part for name in found.truth if (part := found.part(name)) < 1 / 2} == {}


def film(late: float, rate: float = 1.0, begin: float = -3.0) -> tuple[np.ndarray, np.ndarray]:
    """Times on a clock of its own and displacements under a square wave that begins at 5 s of the voltage's clock."""
    t = np.arange(begin, 40.0, 0.08)
    moved = np.zeros(len(t))
    moved[t >= 0] = simulate(ilg.PAPER, SQUARE, t[t >= 0], engine="exact", beam="static").displacement
    noisy = moved + 2e-3 * np.ptp(moved) * np.random.default_rng(4).standard_normal(len(t))
    return 5.05 + late + rate * t, noisy


SQUARE = PiecewiseLinear.square(0.0, 4.0, 16.0, 45.0)
TIME = np.arange(0.0, 45.0, 0.1)
_AFTER = TIME > 5.05
_RUN = simulate(ilg.PAPER, SQUARE, TIME[_AFTER] - 5.05, engine="exact", beam="static")
VOLTAGE, CURRENT = np.zeros(len(TIME)), np.zeros(len(TIME))
VOLTAGE[_AFTER], CURRENT[_AFTER] = _RUN.voltage, _RUN.current
CURRENT += 4e-4 * np.random.default_rng(5).standard_normal(len(TIME))
RECORD = {"time_s": TIME, "voltage_V": VOLTAGE, "current_A": CURRENT}


def test_zero_and_rate_of_a_clock_are_found_by_the_edges_of_the_drive() -> None:
    found = ilg.identify(RECORD, "paper", displacement=film(-812.4, 1.01), model="rc", engine="exact")
    for name, truth in (("displacement_delay", -812.4), ("displacement_clock_rate", 1.01)):
        low, high = found.derived[name].reported[1]
        assert low <= truth <= high, name
        assert high - low < 0.3
    assert "clock-rate-assumed" not in codes(found.findings)
    assert found.coupling is not None
    assert found.parameters["coupling_gain"].value == pytest.approx(found.coupling.coupling.gain)
    assert found.parameters["coupling_gain"].value == pytest.approx(ilg.PAPER.coupling.gain, rel=0.05)  # type: ignore[union-attr]


def test_a_delay_that_is_stated_is_taken_of_another_file_too(run: Run, tmp_path: Path) -> None:
    time, moved = film(0.37)
    np.savetxt("tip.csv", np.column_stack([time, moved / 42e-6]), delimiter=",", header="time_s,x_px", comments="")
    columns = np.column_stack([TIME, VOLTAGE, CURRENT])
    np.savetxt("current.csv", columns, delimiter=",", header="time_s,voltage_V,current_A", comments="")
    how = ("identify", "current.csv", "--displacement", "tip.csv", "--model", "rc", "--engine", "exact")
    done = run(*how, "--scale", "0.042mm/px", "--displacement-delay", "0.37s", "--json", "fit.json")
    assert done.code == 0, done.err
    assert "coupling_gain" in done.out
    assert "displacement_delay" not in done.out
    assert "the displacement's clock is assumed to run at the same rate as the voltage's" in done.err
    refused = run(*how)
    assert_one_line(refused, "column 'x_px' is in pixels; say the size of one: --scale 0.042mm/px")
    assert_one_line(run("identify", "current.csv", "--scale", "1mm/px"), "no column is in pixels", "leave it out")
