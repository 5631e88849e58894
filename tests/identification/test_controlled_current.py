"""Records whose current was controlled: recognised, fitted by the voltage's residuals, compared, and told."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import ilg_circuit as ilg
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.identification import Identification
from ilg_circuit.identification.modal import modal_voltages
from ilg_circuit.identification.voltage import record_data
from ilg_circuit.measurements.forced import as_set, forces_current
from ilg_circuit.measurements.table import Table
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.elements import lumped_elements

Array = NDArray[np.float64]
REST, T = 20, np.arange(0.0, 301.0)
CLOCK = np.arange(REST + len(T), dtype=float)
TRUTH = {"dc_resistance": 666.6667, "dynamic_resistance": 19.43635, "capacitance": 0.35}


def readings(drive: str, noise: float = 1e-3, seed: int = 1) -> dict[str, Array]:
    """Time, voltage, current and displacement of the paper's strip, ``noise`` relative to the largest of each."""
    run = simulate(PAPER, parse_drive(drive, 300.0), T, engine="exact", beam="static")
    random = np.random.default_rng(seed)
    columns = {"time_s": CLOCK}
    for header, values in (
        ("voltage_V", run.voltage),
        ("current_A", run.current),
        ("displacement_m", run.displacement),
    ):
        whole = np.concatenate([np.zeros(REST), values])
        columns[header] = whole + noise * np.abs(values).max() * random.standard_normal(len(whole))
    columns["current_A"] = columns["current_A"].round(6)
    return columns


def fitted(columns: dict[str, Array], **how: object) -> Identification:
    return ilg.identify(columns, PAPER, model="rc", engine="exact", onset=float(REST), **how)  # type: ignore[arg-type]


@pytest.mark.parametrize("drive", ["current:10mA", "current:square:-10mA..10mA,100s"])
def test_parameters_of_the_papers_strip_lie_within_their_intervals(drive: str) -> None:
    columns = readings(drive)
    del columns["displacement_m"]
    fit = fitted(columns)
    assert "current-controlled" in {finding.code for finding in fit.findings}
    assert fit.success
    for name, truth in TRUTH.items():
        low, high = fit[name].interval
        assert low <= truth <= high, (name, fit[name])
        assert fit[name].stderr < 0.01 * truth
    (row,) = fit.observations
    assert (row.quantity, row.unit) == ("voltage", "V")
    assert fit.derived["voltage_offset"].unit == "V"
    # the residuals are the voltage's noise
    assert row.rms_joint == pytest.approx(1e-3 * np.abs(columns["voltage_V"]).max(), rel=0.15)


def test_coupling_is_fitted_under_the_voltage_that_answered() -> None:
    fit = fitted({name: values[: REST + 121] for name, values in readings("current:10mA", 3e-4).items()})
    assert PAPER.coupling is not None
    low, high = fit["coupling_gain"].interval
    assert low <= PAPER.coupling.gain <= high
    assert fit["capacitance"].value == pytest.approx(0.35, rel=2e-3)


def test_recognition() -> None:
    """A current of levels under a curved voltage is controlled; a voltage of levels or lines always is."""
    random = np.random.default_rng(5)

    def table(drive: str) -> Table:
        columns = readings(drive, 1e-3)
        return Table({name.partition("_")[0]: values for name, values in columns.items()}, "made.csv")

    assert forces_current(table("current:10mA"))
    assert forces_current(table("current:square:-10mA..10mA,100s"))
    for drive in (
        "step:4V",
        "square:-4V..4V,100s",
        "triangle:-2V..2V,100s",
        "sine:2V,0.01Hz",
        "current:sine:5mA,0.01Hz",
    ):
        assert not forces_current(table(drive)), drive
    # a resistor's readings are levels of both, and a capacitor's under a triangle a line
    level = np.repeat([0.0, 1.0], 50) + 1e-3 * random.standard_normal(100)
    assert not forces_current(Table({"time": CLOCK[:100], "voltage": level, "current": level}, "resistor.csv"))
    line = np.concatenate([np.zeros(50), np.linspace(0, 1, 50)])
    assert not forces_current(Table({"time": CLOCK[:100], "voltage": line, "current": level}, "capacitor.csv"))


def test_levels_of_one_size_are_set_alike() -> None:
    read = PiecewiseLinear(np.array([0.0, 1, 1, 2, 2, 3]), np.array([1.001, 1.001, -0.999, -0.999, 0.5, 0.5]))
    made = as_set(read, noise=2e-3)
    assert made.values.tolist() == [1.0, 1.0, -1.0, -1.0, 0.5, 0.5]
    assert as_set(read, noise=1e-5).values == pytest.approx(read.values)


def test_modal_voltages_are_the_solvers() -> None:
    port = lumped_elements(PAPER).port
    drive = PiecewiseLinear.square(-0.01, 0.01, 70.0, 300.0, unit="A")
    run = simulate(PAPER, drive, T, engine="exact", beam="static")
    assert modal_voltages([port], drive, T)[0] == pytest.approx(run.voltage, rel=1e-9, abs=1e-12)
    rested = modal_voltages([port], PiecewiseLinear(np.array([0.0]), np.array([0.01]), rest=0.01, unit="A"), T)[0]
    assert rested == pytest.approx(0.01 * port.steady_resistance, rel=1e-12)


def test_engine_solves_what_the_modes_do_and_nonlinear_models() -> None:
    columns = readings("current:10mA", 1e-4)
    record = ilg.read({name: values[:60] for name, values in columns.items()}, onset=float(REST))
    data = record_data(record, "exact", "made")
    port = lumped_elements(PAPER).port
    t = data.since
    rest, waves = data.response.at_rest([port]), data.response.answers([port], t[t >= 0])
    assert data._solved([port], t)[0, t >= 0] == pytest.approx(waves[0], rel=1e-6, abs=1e-9)
    assert rest[0] == pytest.approx(0.0, abs=1e-12)
    strip = PAPER.with_(emission_voltage="0.3 V")
    nonlinear = replace(data, engine="ngspice")._solved([lumped_elements(strip).port], t)
    run = simulate(strip, data.drive, t[t >= 0])
    assert nonlinear[0, t >= 0] == pytest.approx(run.voltage, rel=1e-5)
    assert (nonlinear[0, t < 0] == 0).all()
    with pytest.raises(ilg.InputError, match="is too large: the largest voltage of"):
        data.require_electrode_resistance(1e4)


def test_a_record_is_compared_with_the_prediction_of_its_voltage(tmp_path: Path) -> None:
    columns = readings("current:10mA")
    path = tmp_path / "galvanostat.csv"
    head = ",".join(columns)
    np.savetxt(path, np.column_stack(list(columns.values())), delimiter=",", header=head, comments="")
    record = ilg.read(path)
    assert record.forced is not None
    assert record.drive.unit == "V"
    run = ilg.simulate("paper", f"current:{path}", "320 s", engine="exact", compare=True)
    assert [part.quantity for part in run.compared] == ["voltage", "displacement"]
    assert run.compared[0].rms < 0.01
