"""Every element of a strip says what it is there for, and nobody asks how it is spelled."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from every_model import MODELS, strip_of

from ilg_circuit.circuit import Load, strip_netlist
from ilg_circuit.circuit.netlist import Netlist, Role
from ilg_circuit.simulation.energy import probes
from ilg_circuit.strip.actuator import Actuator, Mounting

LOAD = Load(mass=1e-6, stiffness=1e-5, damping=1e-6)


def strip(model: str) -> Actuator:
    made = strip_of(model, 5.0, band=(1e-3, 10.0), sections=4)
    return replace(made, mounting=Mounting("hanging"), material=replace(made.material, bending_stiffness=1e-6))


@pytest.mark.parametrize("model", MODELS)
def test_every_element_has_a_role(model: str) -> None:
    elements = strip_netlist(strip(model), load=LOAD).elements
    assert all(e.role is not Role.OTHER for e in elements)
    assert {e.role for e in elements} >= set(Role) - {Role.OTHER, Role.CHARGE_METER}
    stores = [e for e in elements if e.role is Role.ION_PATH and (e.kind == "C" or e.law)]
    losses = [e for e in elements if e.role is Role.ION_PATH and e.kind == "R"]
    assert len(stores) == len(losses) > 0


@pytest.mark.parametrize("model", ["rc", "rc2+growing+sinh", "randles+inductance"])
def test_names_do_not_matter_to_the_account(model: str) -> None:
    """Other names, the same probes: of roles, not of spelling."""
    netlist = strip_netlist(strip(model), load=LOAD)
    names = {e.name: f"{e.name[0]}zz{k}" for k, e in enumerate(netlist.elements)}
    other = replace(
        netlist,
        elements=tuple(replace(e, name=names[e.name], control=names.get(e.control, "")) for e in netlist.elements),
        drive=names[netlist.drive],
        outputs=(),
    )
    assert isinstance(other, Netlist)
    before, after = probes(netlist), probes(other)
    assert len(before) == len(after) > 5
    for a, b in zip(before, after, strict=True):
        assert np.array([c for _, c in a.terms]) == pytest.approx(np.array([c for _, c in b.terms]))
