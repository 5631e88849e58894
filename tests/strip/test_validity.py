"""Where the model holds: the numbers of the paper's strip, and what is warned of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER, Actuator, Mounting
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.validity import Assumption, assumptions


def row(start: str, actuator: Actuator = PAPER, **how: object) -> Assumption:
    found = [a for a in assumptions(actuator, **how) if a.name.startswith(start)]
    assert len(found) == 1
    return found[0]


def test_reflected_impedance() -> None:
    reflected = row("reflected")
    assert reflected.number == pytest.approx(1e-10, rel=0.5)
    assert reflected.holds


@pytest.mark.parametrize(("frequency", "number"), [(0.1, 0.03), (1e-3, 0.68), (1e-4, 6.8)])
def test_ionic_over_electron_impedance(frequency: float, number: float) -> None:
    """It falls with frequency, so the low end of the band decides; fails on the scale of 300 s."""
    ratio = row("abs(Zp/Rdc)", band=(frequency, 10.0))
    assert ratio.number == pytest.approx(number, rel=0.02)
    assert ratio.holds == (frequency == 0.1)


def test_deflection_of_the_measured_peak() -> None:
    assert row("deflection", displacement=3.98e-3).number == pytest.approx(0.13, abs=0.005)
    assert row("deflection", displacement=-3.98e-3).number == pytest.approx(0.13, abs=0.005)
    assert not row("deflection", displacement=10e-3).holds


def test_slenderness() -> None:
    assert 1 / row("thickness over free length").number == pytest.approx(60)
    assert row("thickness over free length").holds


@pytest.mark.parametrize("orientation", ["weightless", "hanging", "horizontal"])
def test_gravity(orientation: str) -> None:
    gravity = row("gravity", replace(PAPER, mounting=Mounting(orientation)))
    assert gravity.number == pytest.approx(261, abs=0.5)
    assert not gravity.holds
    assert gravity.harmless == (orientation == "weightless")
    assert ("fitted coupling" in gravity.consequence) == (orientation == "weightless")


def test_electrochemical_window() -> None:
    assert row("abs(u)", voltage=4.0).number == 1.0
    assert row("abs(u)", voltage=4.0).holds  # at its edge
    assert not row("abs(u)", voltage=-4.1).holds


def test_what_is_not_known_is_not_listed(strips: dict[str, Actuator]) -> None:
    names = " ".join(a.name for a in assumptions(strips["no coupling"]))
    assert "reflected" not in names
    assert "deflection" not in names
    assert "window" not in names


def test_reflection_of_a_strong_coupling_fails() -> None:
    k = PAPER.coupling
    assert k is not None
    strong = replace(PAPER, coupling=replace(k, gain=1e5 * k.gain))
    assert row("reflected", strong).number == pytest.approx(1e10 * row("reflected").number)
    assert not row("reflected", strong).holds


def test_numbers_follow_their_definitions(strips: dict[str, Actuator]) -> None:
    lumped = lumped_elements(strips["rc2"])
    s = 2j * np.pi * 1e-3
    assert row("abs(Zp/Rdc)", strips["rc2"], band=(1e-3, 10.0)).number == pytest.approx(
        abs(lumped.ion_impedance(s)) / lumped.port.dc_resistance
    )


def test_a_warning_says_number_limit_and_consequence() -> None:
    text = Assumption("slenderness", 0.25, 0.1, "shear matters").warning()
    assert text == "slenderness: 0.25 exceeds 0.1; shear matters"


def warned(drive: str, actuator: Actuator = PAPER, **how: object) -> str:
    duration = 100.0
    times = np.linspace(0, duration, 101)
    return "\n".join(simulate(actuator, parse_drive(drive, duration), times, engine="exact", **how).warnings)


def test_warnings_of_a_response() -> None:
    assert "electrochemical" not in warned("step:4V")
    assert "electrochemical window" in warned("step:5V")
    assert "deflection" not in warned("step:4V")
    assert "deflection y/L_F" in warned("step:-8V")
    assert "gravity" not in warned("step:1V")  # the coupling has it in it
    for orientation in ("hanging", "horizontal"):
        assert f"gravity, {orientation}" in warned("step:1V", replace(PAPER, mounting=Mounting(orientation)))
    assert "EC (23)" not in warned("step:1V")  # the drive is a voltage


def test_warnings_without_motion(strips: dict[str, Actuator]) -> None:
    assert "deflection" not in warned("step:8V", strips["no coupling"])
    assert "deflection" not in warned("step:8V", tip="clamped")


@pytest.mark.parametrize("times", [[0.0, 1.0], [50.0], [0.0]])
def test_warnings_of_few_samples(times: list[float]) -> None:
    response = simulate(PAPER, parse_drive("step:5V", 50.0), times, engine="exact")
    assert any("electrochemical" in line for line in response.warnings)
