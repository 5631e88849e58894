"""Magnitudes that no strip has are warned of with column and unit; magnitudes of strips are not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from synthetic import record, spectrum, step, write_spectrum

from ilg_circuit.findings import Finding, codes
from ilg_circuit.identification import identify
from ilg_circuit.measurements.proportion import proportion_findings
from ilg_circuit.measurements.read import read_record, read_spectrum
from ilg_circuit.measurements.record import Record
from ilg_circuit.strip.actuator import PAPER

AREA, LENGTH = 1.75e-4, 35e-3
PORT = "port-out-of-proportion"


def written(folder: Path, time: str = "s", voltage: str = "V", current: str = "mA", displacement: str = "mm") -> Record:
    """The paper's step with numbers of s, V, mA, mm under other units."""
    r = record(step(), 100.0, 101, rest=10, displacement=True, noise=1e-3, seed=5).columns
    columns = (r["time"], r["voltage"], 1e3 * r["current"], 1e3 * r["displacement"])
    lines = [f"time_{time},U / {voltage},current [{current}],Tip deflection ({displacement})"]
    lines += [",".join(map(repr, row)) for row in zip(*(c.tolist() for c in columns), strict=True)]
    path = folder / "step.csv"
    path.write_text("\n".join(lines))
    return read_record(path)


def found_of(data: Record) -> tuple[Finding, ...]:
    found = identify(data, base=PAPER, model="rc", engine="exact").findings
    return tuple(f for f in found if f.code.endswith("out-of-proportion"))


def test_what_a_strip_does_is_in_proportion(tmp_path: Path) -> None:
    assert found_of(written(tmp_path)) == ()


@pytest.mark.parametrize(
    ("changed", "code", "named"),
    [
        ({"current": "MA"}, PORT, "'current [MA]' (unit MA)"),
        ({"current": "A"}, PORT, "'current [A]' (unit A)"),
        ({"current": "pA"}, PORT, "'current [pA]' (unit pA)"),
        ({"time": "d"}, PORT, "'time_d' (unit d)"),
        ({"voltage": "uV"}, PORT, "'U / uV' (unit uV)"),
        ({"displacement": "m"}, "displacement-out-of-proportion", "'Tip deflection (m)' (unit m)"),
        ({"displacement": "inch"}, "displacement-out-of-proportion", "'Tip deflection (inch)' (unit inch)"),
    ],
)
def test_a_unit_out_of_all_proportion_is_named(changed: dict[str, str], code: str, named: str, tmp_path: Path) -> None:
    (finding,) = found_of(written(tmp_path, **changed))
    assert finding.code == code
    assert named in finding.values["columns"]
    assert named in str(finding)


def test_a_voltage_out_of_proportion_is_named(tmp_path: Path) -> None:
    found = found_of(written(tmp_path, voltage="kV"))
    assert codes(found) == {"voltage-out-of-proportion"}
    assert "'U / kV' (unit kV)" in str(found[0])


def test_a_current_out_of_proportion_is_named_where_the_port_is_not(tmp_path: Path) -> None:
    data = written(tmp_path, current="A")
    (finding,) = proportion_findings([data], (20.0, 0.35), AREA, LENGTH)
    assert (finding.code, finding.subject) == ("current-out-of-proportion", "step.csv")
    assert finding.values["columns"] == ["'current [A]' (unit A)"]


@pytest.mark.parametrize(
    ("resistance", "capacitance", "area", "out"),
    [
        (1.01e-3, 1.0, 1.0, False),
        (0.99e-3, 1.0, 1.0, True),
        (1.0, 0.99e4, 1.0, False),
        (1.0, 1.01e4, 1.0, True),
        (1.0, 731.0, 3e-4, True),
        (20.0, 50.0, 3e-4, False),
        (20.0, 1e-9, 3e-4, True),
    ],
)
def test_bounds_of_the_port(resistance: float, capacitance: float, area: float, out: bool) -> None:
    assert codes(proportion_findings([], (resistance, capacitance), area, LENGTH)) == ({PORT} if out else set())


def test_a_spectrum_names_its_columns(tmp_path: Path) -> None:
    path = tmp_path / "z.csv"
    write_spectrum(spectrum(PAPER, 1e-3, 1e2), path)
    lines = path.read_text().splitlines()
    path.write_text("\n".join(["frequency_Hz,Re(Z) [nohm],Im(Z) [nohm]", *lines[1:]]))
    found = identify(read_spectrum(path), base=PAPER, model="rc").findings
    (finding,) = (f for f in found if f.code == PORT)
    assert "'Re(Z) [nohm]' (unit nohm)" in finding.values["columns"]


def test_data_without_headers_name_the_quantity() -> None:
    t = np.linspace(0, 1, 11)
    assert "the current" in str(proportion_findings([], (float(t[1]) * 1e-5, 1.0), AREA, LENGTH)[0])
