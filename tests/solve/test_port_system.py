"""The state space of ports that is written down at once answers as that of their netlists."""

from __future__ import annotations

import numpy as np
import pytest
from every_model import MODELS, port_of
from numpy.typing import NDArray

from ilg_circuit.circuit.strip import port_netlist, strip_netlist
from ilg_circuit.solve.port_system import coupling_system, port_system
from ilg_circuit.solve.state_space import StateSpace, state_space
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.models import electrical_model

LINEAR = [m for m in MODELS if electrical_model(m).linear]


def response(system: StateSpace, s: complex, output: str = "current") -> NDArray[np.complex128]:
    row = system.output_names.index(output)
    inner = np.linalg.solve(s * np.eye(system.a.shape[1]) - system.a, system.b[:, :, :1])
    return np.asarray((system.c[:, row : row + 1] @ inner)[:, 0, 0] + system.d[:, row, 0])


@pytest.mark.parametrize("electrode", [0.0, 3.0])
@pytest.mark.parametrize("model", LINEAR)
def test_admittance_is_the_netlists(model: str, electrode: float) -> None:
    ports = [port_of(model, k * electrode) for k in (1, 2)]
    direct, netlists = port_system(ports), state_space([port_netlist(port) for port in ports])
    assert direct.a.shape == netlists.a.shape
    for frequency in np.geomspace(1e-4, 1e4, 9).tolist():
        s = 2j * np.pi * frequency
        assert response(direct, s) == pytest.approx(response(netlists, s), rel=1e-8)


def test_displacement_is_the_netlists() -> None:
    strips = [PAPER.with_(gain=2e-6), PAPER.with_(zero=0.5, damping_ratio=0.2)]
    ratio = lumped_elements(PAPER).bending_ratio
    direct = coupling_system([strip.coupling for strip in strips if strip.coupling], ratio)
    netlists = state_space([strip_netlist(strip, beam="static") for strip in strips])
    for frequency in np.geomspace(1e-4, 1e4, 9).tolist():
        s = 2j * np.pi * frequency
        assert response(direct, s, "displacement") == pytest.approx(response(netlists, s, "displacement"), rel=1e-8)
