"""The registry of waveforms: whatever is in it is simulated, written, drawn, checked and given its band."""

from __future__ import annotations

import csv
import pickle
from pathlib import Path

import numpy as np
import pytest

from ilg_circuit.circuit.strip import strip_netlist
from ilg_circuit.report.response import summary
from ilg_circuit.simulation.check import check
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.energy import works
from ilg_circuit.simulation.response import Response, simulate
from ilg_circuit.simulation.waveforms import ANSWERS, WAVEFORMS, Waveform
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.units import parse

T = np.linspace(0, 10, 11)


@pytest.fixture(scope="module")
def response() -> Response:
    return simulate(PAPER, parse_drive("step:4V", 10.0), T, engine="exact")


@pytest.mark.parametrize("waveform", WAVEFORMS.values(), ids=list(WAVEFORMS))
def test_each_waveform_goes_everywhere(response: Response, waveform: Waveform, tmp_path: Path) -> None:
    values = getattr(response, waveform.name)
    assert values.shape == T.shape
    assert values is response.waveforms[waveform.name]
    assert parse(f"1 {waveform.unit}", waveform.unit, waveform.name) == 1.0
    response.write_csv(tmp_path / "run.csv", energy=True)
    with (tmp_path / "run.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row[waveform.column]) for row in rows] == values.tolist()
    assert response.to_dict()["waveforms"][waveform.column] == values.tolist()
    assert waveform.name in summary(response)
    if waveform in ANSWERS:
        assert waveform.name in {d.quantity for d in check(response, tip="free", beam="dynamic")}


@pytest.mark.parametrize("waveform", [w for w in WAVEFORMS.values() if w.compute is None], ids=lambda w: w.name)
def test_each_waveform_that_is_not_computed_is_an_output_or_a_work_of_the_netlist(waveform: Waveform) -> None:
    netlist = strip_netlist(PAPER)
    outputs = {output.name: output.unit for output in netlist.outputs}
    outputs |= {work.name: "J" for work in works(netlist) if not work.probe}
    assert outputs[waveform.name] == waveform.unit


def test_a_new_entry_is_all_that_a_new_waveform_takes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    power = Waveform("power", "W", "energy", compute=lambda s: s.drive.value(s.time) * s.sampled("current"))
    monkeypatch.setitem(WAVEFORMS, "power", power)
    response = simulate(PAPER, parse_drive("step:4V", 10.0), T, engine="exact")
    assert response.power == pytest.approx(4 * response.current)
    assert "power" in summary(response)
    response.write_csv(tmp_path / "run.csv")
    assert (tmp_path / "run.csv").read_text().splitlines()[0].endswith(",power_W")


def test_attributes_are_the_waveforms_and_no_others(response: Response) -> None:
    with pytest.raises(AttributeError, match="no attribute 'curent'; its waveforms are voltage, current"):
        _ = response.curent
    assert not hasattr(response, "__len__")
    again = pickle.loads(pickle.dumps(response.waveforms))
    assert again["current"].tolist() == response.current.tolist()
    half = response.with_waveforms(force=response.force + 1.0)
    assert (half.force == 1.0).all()
    assert (response.force == 0.0).all()
