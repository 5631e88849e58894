"""The state space of ports that is written down at once answers as that of their netlists."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from every_model import MODELS, port_of
from numpy.typing import NDArray

from ilg_circuit.circuit.strip import port_netlist
from ilg_circuit.solve.modes import modes_of
from ilg_circuit.solve.port_system import port_system
from ilg_circuit.solve.state_space import StateSpace, state_space
from ilg_circuit.strip.models import electrical_model

LINEAR = [m for m in MODELS if electrical_model(m).linear]


def admittance(system: StateSpace, s: complex) -> NDArray[np.complex128]:
    row = system.output_names.index("current")
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
        assert admittance(direct, s) == pytest.approx(admittance(netlists, s), rel=1e-8)


def test_branches_without_a_common_resistor_are_modes() -> None:
    """Their matrix is diagonal; a tiny resistor in common takes the general way."""
    alone, common = (port_system([port_of("rc3", electrode)]) for electrode in (0.0, 1e-9))
    assert np.count_nonzero(alone.a) == 3 < np.count_nonzero(common.a)
    found, general = modes_of(alone), modes_of(common)
    assert found is not None
    assert general is not None
    order, other = np.argsort(found.poles[0]), np.argsort(general.poles[0])
    assert found.poles[0][order] == pytest.approx(general.poles[0][other], rel=1e-9)
    share = [m.shown[0, 0] * m.excited[0, :, 0] for m in (found, general)]
    assert share[0][order] == pytest.approx(share[1][other], rel=1e-8)
    broken = replace(alone, a=np.where(alone.a, np.inf, 0.0))
    assert modes_of(broken) is None
