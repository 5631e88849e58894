"""A run beyond the voltages of the fit is told to be an extrapolation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from ilg_circuit.errors import InputError
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER, Uncertainty
from ilg_circuit.strip.file import dumps, load_actuator

FITTED = replace(PAPER, uncertainty=Uncertainty("rc", ("dc_resistance",), ((1e-4,),), 4.0))


@pytest.mark.parametrize(
    ("drive", "told"), [("step:4V", False), ("step:-4.3V", False), ("step:6V", True), ("step:-6V", True)]
)
def test_run_beyond_the_fitted_voltage_is_told(drive: str, told: bool) -> None:
    response = simulate(FITTED, parse_drive(drive, 10.0), [1.0, 10.0], engine="exact")
    assert any("is beyond the 4 V at which the strip was fitted" in w for w in response.warnings) == told


def test_strip_without_a_fit_is_told_nothing() -> None:
    response = simulate(PAPER, parse_drive("step:6V", 10.0), [1.0, 10.0], engine="exact")
    assert not any("the strip was fitted" in w for w in response.warnings)


def test_voltage_of_the_fit_travels_with_the_file(tmp_path: Path) -> None:
    path = tmp_path / "strip.toml"
    path.write_text(dumps(FITTED))
    assert load_actuator(path).uncertainty == FITTED.uncertainty
    path.write_text(dumps(FITTED).replace("voltage = 4.0", 'voltage = "4 V"'))
    with pytest.raises(InputError, match=r"uncertainty\.voltage is '4 V'; give a number of volts"):
        load_actuator(path)
