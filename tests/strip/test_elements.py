"""Strip -> lumped elements, EC (10)-(16), by hand and by their laws of scaling."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import strips

from ilg_circuit.strip import elements
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.elements import lumped_elements

PAPER_PORT = {
    "dc_resistance": 4 / 0.0060,
    "dynamic_resistance": 4 / 0.2058,
    "capacitance": 0.35,
    "electrode_resistance": 0.0,
}
PAPER_ELEMENTS = {
    "stiffness": 7600 * 5e-3 * 0.5e-3**3 / (4 * 30e-3**3),
    "mass": 3 * 30e-3 * 1250 * 5e-3 * 0.5e-3 / 1.8751040687**4,
    "bending_ratio": 3 * 60**2,
}


@pytest.mark.parametrize(("name", "value"), PAPER_PORT.items())
def test_of_the_papers_port(name: str, value: float) -> None:
    assert getattr(lumped_elements(PAPER).port, name) == pytest.approx(value, rel=1e-10, abs=0)


@pytest.mark.parametrize(("name", "value"), PAPER_ELEMENTS.items())
def test_of_the_papers_strip(name: str, value: float) -> None:
    assert getattr(lumped_elements(PAPER), name) == pytest.approx(value, rel=1e-10, abs=0)


def test_golden_numbers_of_the_papers_strip() -> None:
    lumped = lumped_elements(PAPER)
    assert lumped.stiffness == pytest.approx(4.398e-5, rel=1e-4)
    assert math.sqrt(lumped.stiffness / lumped.mass) == pytest.approx(1.39, rel=1e-3)
    assert lumped.coupling_factor(0).real == pytest.approx(2.8432e-3, rel=1e-5)
    assert lumped.damping == pytest.approx(2 * 0.3 * math.sqrt(lumped.stiffness * lumped.mass))


@pytest.mark.parametrize(
    ("function", "arguments", "value"),
    [
        ("resistance", (2.0, 5.0, 3.0, 30.0), 4.0),
        ("capacitance", (2.0, 5.0, 3.0, 30.0), 1.0),
        ("tip_stiffness", (4.0, 3.0, 2.0, 0.5), 192.0),
        ("tip_damping", (0.5, 4.0, 9.0), 6.0),
    ],
)
def test_by_hand(function: str, arguments: tuple[float, ...], value: float) -> None:
    assert getattr(elements, function)(*arguments) == pytest.approx(value, rel=1e-15)


def test_tip_mass_is_that_of_the_first_bending_mode() -> None:
    """K/m with the load at the free end is the square of Euler-Bernoulli's first angular frequency."""
    e, rho, length, w, b = 7600.0, 1250.0, 0.03, 0.005, 0.0005
    stiffness = elements.tip_stiffness(e, w, b, length)
    mass = elements.tip_mass(rho, length, w, b, length)
    euler = 1.8751040687119611**2 * math.sqrt(e * (w * b**3 / 12) / (rho * w * b)) / length**2
    assert math.sqrt(stiffness / mass) == pytest.approx(euler, rel=1e-12)


@given(strips(most_branches=3), st.floats(0.5, 2.0))
def test_a_wider_strip_is_strips_side_by_side(strip: Actuator, factor: float) -> None:
    wide = replace(strip, geometry=replace(strip.geometry, width=factor * strip.geometry.width))
    one, many = lumped_elements(strip), lumped_elements(wide)
    assert many.port.dc_resistance == pytest.approx(one.port.dc_resistance / factor)
    assert many.port.electrode_resistance == pytest.approx(one.port.electrode_resistance / factor)
    assert many.port.capacitance == pytest.approx(one.port.capacitance * factor)
    assert many.stiffness == pytest.approx(one.stiffness * factor)
    assert many.mass == pytest.approx(one.mass * factor)
    assert many.damping == pytest.approx(one.damping * factor)
    assert many.bending_ratio == one.bending_ratio
    for (r1, c1), (r2, c2) in zip(one.port.branches, many.port.branches, strict=True):
        assert r1 * c1 == pytest.approx(r2 * c2)


def test_both_electrodes_are_in_series(strips: dict[str, Actuator]) -> None:
    m = replace(
        PAPER.material,
        electrode_resistivity_1=100.0,
        electrode_thickness_1=2e-6,
        electrode_resistivity_2=300.0,
        electrode_thickness_2=1e-6,
    )
    lumped = lumped_elements(replace(PAPER, material=m))
    assert lumped.port.electrode_resistance == pytest.approx(5e-4 / (35e-3 * 5e-3))
    assert lumped_elements(strips["electrodes"]).port.electrode_resistance == pytest.approx(2.0)


@given(strips(most_branches=1), st.floats(-4, 3))
def test_one_branch_has_the_papers_impedance_and_factor(strip: Actuator, decade: float) -> None:
    lumped, s = lumped_elements(strip), 2j * np.pi * 10**decade
    k = strip.coupling
    assert k is not None
    rd, c = lumped.port.branches[0]
    d = k.gain * (s + k.zero) / (s**2 + 2 * k.damping_ratio * k.natural_frequency * s + k.natural_frequency**2)
    ratio = 3 * strip.geometry.load_distance**2 / strip.geometry.thickness**2
    assert lumped.ion_impedance(s) == pytest.approx(rd + 1 / (c * s), rel=1e-12, abs=0)
    assert lumped.coupling_factor(s) == pytest.approx(ratio * d * (1 + rd * c * s) / c, rel=1e-12, abs=0)


@given(strips(most_branches=3), st.floats(-4, 3))
def test_factor_is_the_ratio_of_free_velocity_and_ionic_current(strip: Actuator, decade: float) -> None:
    """N = k s d Zp, whatever the number of branches."""
    lumped, s = lumped_elements(strip), 2j * np.pi * 10**decade
    k = strip.coupling
    assert k is not None
    d = k.gain * (s + k.zero) / (s**2 + 2 * k.damping_ratio * k.natural_frequency * s + k.natural_frequency**2)
    expected = lumped.bending_ratio * d * s * lumped.ion_impedance(s)
    assert lumped.coupling_factor(s) == pytest.approx(expected, rel=1e-12, abs=0)


def test_without_coupling_the_factor_is_zero(strips: dict[str, Actuator]) -> None:
    assert lumped_elements(strips["no coupling"]).coupling_factor(1j) == 0
    assert lumped_elements(strips["no coupling"]).coupling is None


def test_several_branches_add_up(strips: dict[str, Actuator]) -> None:
    lumped = lumped_elements(strips["rc2"])
    assert len(lumped.port.branches) == 2
    assert lumped.port.capacitance == pytest.approx(0.35 + 0.14)
    s = 0.3j
    admittance = sum(1 / (r + 1 / (c * s)) for r, c in lumped.port.branches)
    assert lumped.ion_impedance(s) == pytest.approx(1 / admittance)
