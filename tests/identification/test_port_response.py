"""Ports are answered without an engine as the engine does, and as their derivatives say."""

from __future__ import annotations

import numpy as np
import pytest
from every_model import port_of, strip_of, values_of

from ilg_circuit.circuit.strip import port_netlist, strip_netlist
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.identification.modal import perturbed
from ilg_circuit.identification.motion import Motion
from ilg_circuit.identification.port_model import PortModel
from ilg_circuit.identification.port_response import (
    closed,
    current_slopes,
    currents_of,
    engine_currents,
    voltage_slopes,
    voltages_of,
)
from ilg_circuit.solve import transient
from ilg_circuit.strip.actuator import Coupling
from ilg_circuit.strip.models import Ladders, electrical_model

T = np.linspace(0.0, 30.0, 31)
DRIVE = PiecewiseLinear(np.array([0.0, 10, 10, 20, 30]), np.array([1.0, 3, -2, 3, 0]), rest=1.0)
CURRENT = PiecewiseLinear(np.array([0.0, 10, 10, 30]), np.array([0.01, 0.01, -0.01, -0.01]), unit="A")
LADDERS = Ladders(band=(1e-3, 20.0), sections=12)
NONLINEAR = ("rc+growing", "rc+saturating", "rc+steric", "rc+sinh", "rc2+growing+sinh")


@pytest.mark.parametrize(
    ("model", "electrodes"), [*((m, e) for m in NONLINEAR for e in (0.0, 5.0)), ("warburg+sinh", 0.0)]
)
def test_currents_are_the_engines(model: str, electrodes: float) -> None:
    kind, values = electrical_model(model), np.array(values_of(model))
    assert closed(PortModel(kind, electrodes))
    ports = [kind.port(v.tolist(), electrodes, LADDERS) for v in perturbed(values)]
    expected = engine_currents(ports[:1], DRIVE, T, "ngspice", 1e-7)[0]
    found = currents_of(ports[:1], DRIVE, T)[0]
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()
    slopes = current_slopes(ports, DRIVE, T)
    assert slopes is not None
    assert slopes[0] == pytest.approx(found, rel=1e-9, abs=1e-12)
    assert slopes[1].shape == (len(T), len(values))


@pytest.mark.parametrize("model", ["rc+sinh", "rc2+sinh", "warburg+sinh"])
def test_an_electron_path_solved_by_itself_takes_its_share_of_the_whole(model: str) -> None:
    """Straight across the voltage it knows nothing of the ions: the whole circuit in one run gives the same current."""
    values = np.array(values_of(model))
    ports = [electrical_model(model).port((f * values).tolist(), 0.0, LADDERS) for f in (1.0, 1.3)]
    parted = engine_currents(ports, DRIVE, T, "ngspice", 1e-7)
    whole = transient([port_netlist(port, rest=DRIVE.rest) for port in ports], DRIVE, T, accuracy=1e-7)
    np.testing.assert_allclose(parted, whole.values[:, 0], rtol=0, atol=4e-7 * np.abs(parted).max())


@pytest.mark.parametrize("model", ["rc+growing", "rc2+growing+sinh"])
def test_voltages_are_the_engines(model: str) -> None:
    port = port_of(model, 5.0)
    assert closed(PortModel(electrical_model(model), 5.0), by_current=True)
    run = transient([port_netlist(port, by_current=True)], CURRENT, T)
    expected = run.output("voltage")
    assert np.abs(voltages_of([port], CURRENT, T)[0] - expected).max() < 1e-6 * np.abs(expected).max()
    ports = [electrical_model(model).port(v.tolist(), 5.0) for v in perturbed(np.array(values_of(model)))]
    slopes = voltage_slopes(ports, CURRENT, T)
    assert slopes is not None
    assert slopes[0] == pytest.approx(expected, rel=1e-5, abs=1e-6)


def test_a_displacement_does_not_know_a_nonlinear_circuit_straight_across_the_voltage() -> None:
    strip = strip_of("rc+growing+sinh")
    motion = Motion(strip, "dynamic", "ngspice")
    assert motion.linear
    coupling = strip.coupling
    assert isinstance(coupling, Coupling)
    values = np.array([[coupling.gain, coupling.zero, coupling.damping_ratio, coupling.natural_frequency]])
    drive = DRIVE.from_rest()
    run = transient([strip_netlist(strip, beam="dynamic")], drive, T)
    expected = run.output("displacement")
    assert np.abs(motion.displacements(drive, T, values)[0] - expected).max() < 1e-6 * np.abs(expected).max()


def test_a_ladder_beside_a_sinh_path_needs_the_engine_behind_electrodes_and_under_a_current() -> None:
    kind = electrical_model("warburg+sinh")
    assert not closed(PortModel(kind, 5.0))
    assert not closed(PortModel(kind, 0.0), by_current=True)
