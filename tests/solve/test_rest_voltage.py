"""A circuit that starts at rest under a voltage moves as one that was held there for long."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ilg_circuit.circuit.strip import port_netlist, strip_netlist
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError
from ilg_circuit.solve import transient
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.models import Ladders, electrical_model
from ilg_circuit.strip.port import Port

REST, LONG = 1.2, 400.0
PORTS = {
    "rc": Port(200.0, ((20.0, 0.1),), 2.0),
    "rc2+sinh": Port(200.0, ((20.0, 0.1), (60.0, 0.2)), 3.0, emission_voltage=0.9),
    "rc+growing": Port(200.0, ((20.0, 0.1),), 2.0, capacitance_slope=0.4),
}


def compared(make, drive: PiecewiseLinear, engine: str) -> None:  # type: ignore[no-untyped-def]
    """``make(rest)`` is the circuit that starts under a voltage."""
    t = np.geomspace(0.01, 30.0, 60)
    found = transient(make(drive.rest), drive, t, engine=engine)
    held = PiecewiseLinear(
        np.concatenate([[0.0, LONG], drive.times + LONG]), np.concatenate([[drive.rest] * 2, drive.values])
    )
    expected = transient(make(0.0), held, t + LONG, engine=engine).values
    largest = np.abs(expected).max(axis=-1, keepdims=True)
    assert found.values == pytest.approx(expected, abs=float(2e-6 * largest.max()))
    assert (np.abs(found.values - expected) <= 2e-6 * largest).all()


@pytest.mark.parametrize("rest", [REST, -0.4])
@pytest.mark.parametrize("name", PORTS)
def test_port_starts_in_its_steady_state(name: str, rest: float) -> None:
    drive = PiecewiseLinear(np.array([0.0, 10.0, 10.0, 30.0]), np.array([2.0, 2.0, -1.0, 0.5]), rest=rest)
    for engine in ("ngspice", "exact") if PORTS[name].linear else ("ngspice",):
        compared(lambda level: port_netlist(PORTS[name], rest=level), drive, engine)


@pytest.mark.parametrize("engine", ["ngspice", "exact"])
def test_ladder_starts_charged(engine: str) -> None:
    port = electrical_model("warburg").port([300.0, 5.0, 50.0, 2.0], 1.0, Ladders((1e-2, 1e2)))
    compared(lambda level: port_netlist(port, rest=level), PiecewiseLinear.step(2.0).resting(REST), engine)


@pytest.mark.parametrize("beam", ["static", "dynamic"])
@pytest.mark.parametrize("emission", [None, 0.9])
def test_strip_starts_bent(beam: str, emission: float | None) -> None:
    strip = PAPER
    if emission:
        strip = Actuator.from_port(
            PAPER.geometry, Port(200.0, ((20.0, 0.1),), 2.0, emission_voltage=emission), base=PAPER.material
        )
        strip = replace(strip, coupling=PAPER.coupling)
    drive = PiecewiseLinear.step(2.0).resting(REST)
    compared(lambda level: strip_netlist(strip, beam=beam, rest=level), drive, "ngspice")


def test_nothing_happens_where_the_level_stays() -> None:
    drive = PiecewiseLinear.step(REST).resting(REST)
    for port in PORTS.values():
        current = transient(port_netlist(port, rest=REST), drive, np.linspace(0, 20, 50)).output("current")
        steady = float(port.electron_current(port.inner_voltage(REST)))
        assert current == pytest.approx(steady, rel=1e-7)


def test_circuit_and_drive_must_rest_alike() -> None:
    with pytest.raises(InputError, match=r"at rest under 0 V, the drive from 1\.2 V"):
        transient(port_netlist(PORTS["rc+growing"]), PiecewiseLinear.step(2.0).resting(REST), [1.0])
