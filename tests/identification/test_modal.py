"""The sum of modes against the exact engine and the closed form."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ilg_circuit.circuit.strip import strip_netlist
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.identification.modal import (
    modal_current_slopes,
    modal_currents,
    modal_displacement_slopes,
    modal_displacements,
    perturbed,
)
from ilg_circuit.identification.port_response import engine_currents
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.solve.transient import transient
from ilg_circuit.strip.actuator import PAPER, Actuator, Coupling
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.models import electrical_model
from ilg_circuit.strip.port import Port

VALUES = {
    "rc": (233.0, 20.0, 0.2),
    "rc2": (400.0, 40.0, 0.02, 100.0, 0.1),
    "rc3": (1000.0, 60.0, 0.004, 100.0, 0.02, 150.0, 0.15),
    "warburg": (300.0, 10.0, 50.0, 8.0),
    "cpe": (1000.0, 10.0, 0.02, 0.8),
}
DRIVES = {
    "step": PiecewiseLinear.step(2.0),
    "square": PiecewiseLinear.square(-1.0, 2.0, 7.0, 60.0),
    "bends": PiecewiseLinear(np.array([0.0, 3.0, 3.0, 11.0, 40.0]), np.array([0.0, 1.0, -0.5, 2.0, 2.0])),
}


@pytest.mark.parametrize("resistance", [0.0, 2.0])
@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("model", VALUES)
def test_modes_are_the_exact_engine_s(model: str, drive: str, resistance: float) -> None:
    kind = electrical_model(model)
    ports = [kind.port([v * factor if v != 0.8 else v for v in VALUES[model]], resistance) for factor in (1.0, 1.3)]
    t = np.sort(np.concatenate([np.linspace(0.0, 60.0, 41), np.geomspace(1e-3, 50.0, 20)]))
    exact = engine_currents(ports, DRIVES[drive], t, "exact")
    found = modal_currents(ports, DRIVES[drive], t)
    assert found == pytest.approx(exact, abs=1e-8 * np.abs(exact).max())


@pytest.mark.parametrize("samples", [41, 2300])
@pytest.mark.parametrize("resistance", [0.0, 2.0])
@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("model", VALUES)
def test_slopes_of_a_current_are_its_differences(model: str, drive: str, resistance: float, samples: int) -> None:
    kind, t = electrical_model(model), np.linspace(0.0, 60.0, samples)
    ladders = kind.ladders(np.array(VALUES[model]), (1e-3, 10.0))

    def ports(values: NDArray[np.float64]) -> list[Port]:
        return [kind.port(v, resistance, ladders) for v in values.tolist()]

    values = np.array(VALUES[model])
    found = modal_current_slopes(ports(perturbed(values)), DRIVES[drive], t)
    assert found is not None
    assert found[0] == pytest.approx(modal_currents(ports(values[None]), DRIVES[drive], t)[0], rel=1e-12, abs=1e-14)
    step = 1e-4 * np.eye(len(values))
    above, below = (modal_currents(ports(values * np.exp(sign * step)), DRIVES[drive], t) for sign in (1.0, -1.0))
    expected = (above - below).T / 2e-4
    assert np.abs(found[1] - expected).max() < 1e-7 * np.abs(expected).max()


def test_slopes_are_left_to_differences_where_modes_cancel() -> None:
    values = np.array([400.0, 50.0, 0.02, 50.0, 0.02])  # two branches alike
    ports = [electrical_model("rc2").port(v) for v in perturbed(values).tolist()]
    assert modal_current_slopes(ports, DRIVES["step"], np.linspace(0.0, 60.0, 41)) is None


def test_a_long_record_goes_in_blocks() -> None:
    t = np.linspace(0.0, 60.0, 5003)
    found = modal_currents([electrical_model("rc").port(VALUES["rc"], 2.0)], DRIVES["step"], t)[0]
    assert found == pytest.approx(
        2 * formulas.current_step(t, *formulas.current_constants(*VALUES["rc"], 2.0)), rel=1e-9
    )


@pytest.mark.parametrize("samples", [600, 2100])
def test_a_drive_of_many_knots_goes_in_blocks(samples: int) -> None:
    random = np.random.default_rng(4)
    drive = PiecewiseLinear(np.linspace(0.0, 60.0, 4100), np.append(0.0, random.standard_normal(4099)))
    t, ports = np.linspace(0.0, 60.0, samples), [electrical_model("rc2").port(VALUES["rc2"], 2.0)]
    exact = engine_currents(ports, drive, t, "exact")
    found = modal_currents(ports, drive, t)
    assert found == pytest.approx(exact, abs=1e-9 * np.abs(exact).max())
    values = np.array(VALUES["rc2"])
    slopes = modal_current_slopes([electrical_model("rc2").port(v, 2.0) for v in perturbed(values).tolist()], drive, t)
    assert slopes is not None
    assert slopes[0] == pytest.approx(exact[0], abs=1e-9 * np.abs(exact).max())
    finer = modal_currents(ports, drive, np.linspace(0.0, 60.0, 14 * (samples - 1) + 1))  # more samples than knots
    assert finer[:, ::14] == pytest.approx(exact, abs=1e-9 * np.abs(exact).max())


# -- the whole strip ---------------------------------------------------------------------------------------------------

TIMES = {
    "even": np.linspace(0.0, 200.0, 301),
    "uneven": np.sort(np.concatenate([[0.0], np.random.default_rng(1).uniform(0.0, 200.0, 150)])),
}
MEASURED = PiecewiseLinear(
    np.linspace(0.0, 250.0, 120), 4 + 0.02 * np.random.default_rng(2).standard_normal(120) + np.linspace(0.0, 0.4, 120)
)


def both(strip: Actuator, beam: str, drive: PiecewiseLinear, t: NDArray[np.float64]) -> tuple[Any, Any]:
    """The displacement by modes and by the exact engine."""
    netlists = [strip_netlist(strip, beam=beam)]
    exact = transient(netlists, drive, t, engine="exact")
    return modal_displacements(netlists, drive, t)[0], exact.output("displacement")


@pytest.mark.parametrize("times", TIMES)
@pytest.mark.parametrize("damping", [0.05, 0.6212, 1 - 1e-12, 1.0, 1 + 1e-9, 1 + 1e-5, 2.3, 40.0])
@pytest.mark.parametrize(("beam", "modulus"), [("static", 7600.0), ("dynamic", 7600.0), ("dynamic", 1e8)])
def test_displacements_through_critical_damping(beam: str, modulus: float, damping: float, times: str) -> None:
    """Two poles that become one have eigenvectors that become one; the answer must not notice."""
    k = PAPER.coupling
    assert k is not None
    strip = replace(
        PAPER,
        material=replace(PAPER.material, youngs_modulus=modulus),
        coupling=Coupling(k.gain, k.zero, damping, k.natural_frequency),
    )
    drive = PiecewiseLinear.step(4.0) if times == "uneven" else MEASURED
    found, exact = both(strip, beam, drive, TIMES[times])
    assert found == pytest.approx(exact, abs=1e-9 * float(np.abs(exact).max()))


@pytest.mark.parametrize("beam", ["static", "dynamic"])
def test_displacements_behind_an_electrode_resistance(beam: str) -> None:
    m = PAPER.material
    strip = replace(PAPER, material=replace(m, electrode_resistivity_1=350.0, electrode_thickness_1=1e-6))
    assert lumped_elements(strip).port.electrode_resistance > 0
    found, exact = both(strip, beam, MEASURED, TIMES["even"])
    assert found == pytest.approx(exact, abs=1e-9 * float(np.abs(exact).max()))


def test_a_mode_that_hardly_moves_follows_a_ramp() -> None:
    """The response to a ramp of a mode slower than the record by 1e6: no digits are lost to (e^z - 1 - z)/z^2."""
    port = electrical_model("rc").port((1e3, 20.0, 1e7), 0.0)
    ramp, t = PiecewiseLinear.ramp(0.1, 50.0), np.linspace(0.0, 40.0, 101)
    current = modal_currents([port], ramp, t)[0]
    rate = 1 / (20.0 * 1e7)
    by_hand = 0.1 * t / 1e3 + 0.1 * 1e7 * -np.expm1(-rate * t)
    assert current == pytest.approx(by_hand, rel=1e-12)


@pytest.mark.parametrize("beam", ["static", "dynamic"])
@pytest.mark.parametrize("damping_ratio", [0.3, 2.0])
def test_slopes_of_a_displacement_are_its_differences(damping_ratio: float, beam: str) -> None:
    assert PAPER.coupling is not None
    values = np.array([PAPER.coupling.gain, PAPER.coupling.zero, damping_ratio, PAPER.coupling.natural_frequency])
    drive, t = DRIVES["bends"], TIMES["uneven"]

    def netlists(sets: NDArray[np.float64]) -> list[Any]:
        return [strip_netlist(replace(PAPER, coupling=Coupling(*v)), beam=beam) for v in sets.tolist()]

    found = modal_displacement_slopes(netlists(perturbed(values)), drive, t)
    assert found is not None
    step = 1e-4 * np.eye(4)
    above, below = (modal_displacements(netlists(values * np.exp(sign * step)), drive, t) for sign in (1.0, -1.0))
    expected = (above - below).T / 2e-4
    assert np.abs(found[1] - expected).max() < 1e-7 * np.abs(expected).max()


def test_one_exponential_for_each_pair_of_conjugate_poles() -> None:
    from ilg_circuit.solve.modes import fallen

    pair = np.array([-0.05 + 0.06j, -0.05 - 0.06j, -0.1, -1.0])
    times = np.linspace(0.0, 100.0, 50)
    for poles in (np.stack([pair, 1.1 * pair]), np.stack([pair, pair.conj()]), np.stack([pair, pair[[0, 0, 2, 3]]])):
        assert np.abs(fallen(poles, times) - np.expm1(poles * times[:, None, None])).max() < 1e-15
    real = pair[None, 2:].real
    assert np.array_equal(fallen(real, times), np.expm1(real * times[:, None, None]))
