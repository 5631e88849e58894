"""Where the energy goes: balances that close, element by element."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from every_model import MODELS, strip_of

from ilg_circuit.circuit import Load
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER, Actuator, Coupling
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.models import LadderPath, electrical_model

T = np.linspace(0, 60, 31)
#: Few sections: the balance is the same.
SMALL = {"band": (1e-3, 10.0), "sections": 8}


def made(model: str, electrodes: float = 5.0) -> Actuator:
    return strip_of(model, electrodes, **(SMALL if isinstance(electrical_model(model).ions, LadderPath) else {}))


@pytest.mark.parametrize(
    ("model", "drive"),
    [
        *((model, ("square:-2V..3V,34s", "sine:2V,0.05Hz")[k % 2]) for k, model in enumerate(MODELS)),
        ("rc2+growing+sinh", "square:-2V..3V,17s"),
        ("warburg", "sine:2V,0.05Hz"),
    ],
)
def test_both_sides_balance(model: str, drive: str) -> None:
    """Every model under one drive or the other, and a nonlinear and a laddered one under both."""
    found = simulate(made(model), parse_drive(drive, 60.0), T).account
    assert found.electrical_imbalance < 1e-6
    assert found.mechanical_imbalance < 1e-6


@pytest.mark.parametrize("drive", ["step:4V", "ramp:50mV/s", "square:-2V..3V,17s"])
def test_a_strip_that_feels_its_motion(drive: str) -> None:
    """Here the converted energy is a share that a forgotten term would show."""
    k = PAPER.coupling
    assert k is not None
    strip = replace(
        strip_of("rc2", 5.0),
        material=replace(strip_of("rc2", 5.0).material, youngs_modulus=1e5),
        coupling=replace(k, gain=3e3 * k.gain),
    )
    load = Load(mass=1e-4, stiffness=2e-4, damping=3e-5)
    found = simulate(strip, parse_drive(drive, 60.0), T, load=load).account
    assert np.abs(found.converted).max() > 1e-4 * np.abs(found.source).max()
    assert found.electrical_imbalance < 1e-6
    assert found.mechanical_imbalance < 1e-6
    without = replace(found, converted=np.zeros_like(found.converted))
    assert without.electrical_imbalance > 1e-5
    assert found.load[-1] == pytest.approx(found.stored["Cload"][-1] + found.dissipated["Rload"][-1])
    assert found.load[-1] > 0


def test_a_step_s_half_is_lost() -> None:
    """Charging C to U through Rd stores C U^2/2 and dissipates as much, whatever Rd; Rdc takes U^2 t/Rdc."""
    t = np.linspace(0, 500, 26)
    found = simulate(strip_of("rc"), parse_drive("step:2V", 500.0), t).account
    assert found.stored["C1"][-1] == pytest.approx(0.35 * 2**2 / 2, rel=1e-9)
    assert found.dissipated["Rd1"][-1] == pytest.approx(0.35 * 2**2 / 2, rel=1e-8)
    assert found.dissipated["Rdc"][-1] == pytest.approx(2**2 / 600 * 500, rel=1e-9)


def test_a_growing_capacitance_stores_its_cube() -> None:
    t = np.linspace(0, 2000, 11)
    found = simulate(strip_of("rc+growing"), parse_drive("step:-2V", 2000.0), t).account
    assert found.stored["Bq1"][-1] == pytest.approx(0.35 * (2**2 / 2 + 0.3 * 2**3 / 3), rel=1e-5)
    assert "stored electrically" in found.summary()


def test_an_electron_path_of_sinh_takes_its_power() -> None:
    t = np.linspace(0, 100, 11)
    found = simulate(strip_of("rc+sinh"), parse_drive("step:2V", 100.0), t).account
    assert found.dissipated["Bdc"][-1] == pytest.approx(100 * 2 * 0.8 / 600 * np.sinh(2 / 0.8), rel=1e-6)


def test_nothing_moves_nothing_is_given() -> None:
    found = simulate(PAPER, parse_drive("step:4V", 60.0), T, beam="static").account
    assert not found.mechanical.any()
    assert found.efficiency == 0.0
    assert found.mechanical_imbalance == 0.0


@pytest.mark.parametrize("engine", ["ngspice", "exact"])
@pytest.mark.parametrize("text", ["step:4V", "sine:2V,0.02Hz"])
def test_where_n_is_constant_the_transformer_loses_nothing(engine: str, text: str) -> None:
    """d(s) with one pole at -Zd, cancelled, and the other at -1/(Rd C): then N(s) = k Kd Rd, and u1 i1 is F1 v1."""
    lumped = lumped_elements(PAPER)
    zero, rate = 0.3, 1 / (lumped.port.dynamic_resistance * lumped.port.capacitance)
    natural = float(np.sqrt(zero * rate))
    coupling = Coupling(1.2e-7, zero, (zero + rate) / (2 * natural), natural)
    # stiff, so that what is reflected stands out of rounding
    strip = replace(PAPER, coupling=coupling, material=replace(PAPER.material, youngs_modulus=3e8))
    factors = [lumped_elements(strip).coupling_factor(s) for s in (1e-3j, 1j, 100j)]
    assert factors == pytest.approx([factors[0].real] * 3, rel=1e-12)
    times = np.linspace(0.0, 60.0, 121)
    found = simulate(strip, parse_drive(text, 60.0), times, engine=engine, load=Load(damping=1e-3)).account
    assert found.converted == pytest.approx(found.mechanical, abs=1e-6 * float(np.abs(found.mechanical).max()))
    assert float(np.abs(found.mechanical).max()) > 1e-8 * float(found.source[-1])
