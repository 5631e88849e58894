"""What `show` tells: JSON-ready numbers with units, and the same as text."""

from __future__ import annotations

import json

import pytest

from ilg_circuit.report.strip import summary
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.describe import describe
from ilg_circuit.strip.elements import lumped_elements

BAND = (1e-4, 10.0)


def test_elements_are_those_of_the_strip() -> None:
    lumped = lumped_elements(PAPER)
    told = describe(PAPER, band=BAND)["elements"]
    assert told["dc_resistance"]["value"] == lumped.port.dc_resistance
    assert told["dynamic_resistance"]["value"] == lumped.port.dynamic_resistance
    assert told["capacitance"] == {
        "value": lumped.port.capacitance,
        "unit": "F",
        "equation": told["capacitance"]["equation"],
    }
    assert told["time_constant"]["value"] == pytest.approx(6.8027, rel=1e-5)
    assert told["stiffness"]["value"] == lumped.stiffness
    assert told["resonance"]["value"] == pytest.approx(1.39, rel=1e-3)
    assert told["displacement_per_volt"]["value"] == pytest.approx(3.9805e-3 / 4, rel=1e-5)
    assert told["clamped_force_per_volt"]["value"] == pytest.approx(0.1751e-6 / 4, rel=1e-3)
    assert told["coupling_factor_static"]["value"] == pytest.approx(2.8432e-3, rel=1e-5)


@pytest.mark.parametrize("which", ["paper", "electrodes", "rc2", "no coupling", "load inside"])
def test_it_is_json(strips: dict[str, Actuator], which: str) -> None:
    told = describe(strips[which], band=BAND, voltage=4.0)
    assert json.loads(json.dumps(told)) == told
    assert told["name"] == which
    assert (told["coupling"] is None) == (which == "no coupling")
    for entry in told["elements"].values():
        assert set(entry) == {"value", "unit", "equation"}
    for row in told["holds"]:
        assert row["holds"] == (row["number"] <= row["limit"])


def test_branches_are_numbered_where_there_are_several(strips: dict[str, Actuator]) -> None:
    told = describe(strips["rc2"], band=BAND)["elements"]
    for k, (r, c) in enumerate(lumped_elements(strips["rc2"]).port.branches, 1):
        assert told[f"resistance_{k}"]["value"] == r
        assert told[f"capacitance_{k}"]["value"] == c
    assert "dynamic_resistance" not in told


def test_voltage_brings_window_and_deflection() -> None:
    names = {row["assumption"] for row in describe(PAPER, band=BAND, voltage=4.0)["holds"]}
    assert any("window" in name for name in names)
    assert any("deflection" in name for name in names)
    fewer = {row["assumption"] for row in describe(PAPER, band=BAND)["holds"]}
    assert len(fewer) == len(names) - 2


@pytest.mark.parametrize("which", ["paper", "rc2", "no coupling"])
def test_text_has_every_entry(strips: dict[str, Actuator], which: str) -> None:
    told = describe(strips[which], band=BAND, voltage=5.0)
    text = summary(told)
    for section in ("geometry", "material"):
        for name in told[section]:
            assert f"  {name} " in text
    for name, entry in told["elements"].items():
        assert name in text
        assert entry["equation"] in text
    assert "FAILS (limit 1)" in text
    assert ("coupling: not known" in text) == (which == "no coupling")


@pytest.mark.parametrize(
    ("element", "equation"),
    [
        ("dc_resistance", "EC (12)"),
        ("dynamic_resistance", "EC (13)"),
        ("electrode_resistance", "EC (13)"),
        ("capacitance", "EC (14)"),
        ("stiffness", "EC (10)"),
        ("mass", "EC (11)"),
        ("displacement_per_volt", "EC (37)"),
    ],
)
def test_equations_are_numbered_as_in_the_paper(element: str, equation: str) -> None:
    """EC numbers (12) R_dc, (13) R_e1, R_e2 and R_d together, (14) C, (15) and (16) Z_p."""
    assert equation in describe(PAPER, band=BAND)["elements"][element]["equation"]
