"""Transients of many circuits at once, and of circuits beside strips."""

from __future__ import annotations

import numpy as np
import pytest
from engines import AGREEMENT, assert_engines_agree, material
from every_model import strip_of
from numpy.typing import NDArray

from ilg_circuit.circuit import Element, Netlist, Output, electrical_netlist, strip_netlist
from ilg_circuit.errors import InputError
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.solve import transient
from ilg_circuit.strip.actuator import Actuator

Array = NDArray[np.float64]


# -- many at once ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("engine", ["ngspice", "exact"])
def test_many_at_once_are_each_alone_and_in_order(engine: str) -> None:
    """Time constants over three decades: solved in groups, returned in the order given."""
    moduli = np.random.default_rng(7).permutation(np.geomspace(1e3, 1e9, 9))
    nets = [strip_netlist(material(youngs_modulus=float(e))) for e in moduli]
    drive, t = parse_drive("step:4V", 60.0), np.linspace(0, 60, 61)
    together = transient(nets, drive, t, engine=engine)
    for k, net in enumerate(nets):
        alone = transient(net, drive, t, engine=engine)
        scale = np.abs(alone.values[0]).max(axis=1, keepdims=True) + 1e-300
        assert (np.abs(together.values[k] - alone.values[0]) <= AGREEMENT * scale).all()
        assert together.output("current", k) == pytest.approx(together.values[k, 0], abs=0)


def test_an_error_that_no_grid_shows_is_stated_as_rounding() -> None:
    """A divider's voltage is the same on every grid; thousands of steps round what is computed in them."""
    elements = (
        Element("Vdrive", ("in", "0"), 0.0),
        Element("R1", ("in", "a"), 2.0),
        Element("R2", ("a", "0"), 1.0),
        Element("R3", ("in", "b"), 3.0),
        Element("C3", ("b", "0"), 1.0),
    )
    net = Netlist("divider", elements, (Output("v", "V", (("v(a)", 1.0),)),))
    waves = transient(net, parse_drive("step:1V", 5.0), np.linspace(0, 5, 11))
    assert waves.engine == "ngspice"
    assert waves.output("v") == pytest.approx(np.full(11, 1 / 3), rel=1e-14)
    assert 1e-13 < waves.errors.max() < 1e-11


def test_more_than_one_batch() -> None:
    values = np.linspace(10.0, 30.0, 130)
    nets = [electrical_netlist(600.0, ((float(r), 0.3),), 1.0) for r in values]
    t = np.linspace(0, 30, 31)
    seen: list[tuple[int, int]] = []
    waves = transient(nets, parse_drive("step:1V", 30.0), t, progress=lambda done, total: seen.append((done, total)))
    for k, r in enumerate(values):
        expected = formulas.current_step(t, *formulas.current_constants(600.0, float(r), 0.3, 1.0))
        assert waves.output("current", k) == pytest.approx(expected, abs=AGREEMENT * expected[0])
    assert len(seen) > 1
    assert seen[-1] == (130, 130)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)


def test_only_one_topology_at_once(strips: dict[str, Actuator]) -> None:
    with pytest.raises(InputError, match="one topology"):
        transient(
            [strip_netlist(strips["paper"]), strip_netlist(strips["rc2"])], parse_drive("step:4V", 1.0), [0.0, 1.0]
        )


# -- circuits beside strips --------------------------------------------------------------------------------------------


def test_every_kind_of_element_is_the_same_to_both_engines() -> None:
    elements = (
        Element("Vdrive", ("in", "0"), 0.0),
        Element("R1", ("in", "a"), 2.0),
        Element("L1", ("a", "b"), 0.7),
        Element("C1", ("b", "0"), 0.4),
        Element("Vbias", ("c", "0"), 0.3),
        Element("R2", ("c", "b"), 5.0),
        Element("I1", ("0", "b"), 0.2),
        Element("E1", ("d", "0", "b", "a"), 1.5),
        Element("R3", ("d", "e"), 3.0),
        Element("C2", ("e", "0"), 0.2),
        Element("G1", ("0", "e", "a", "0"), 0.3),
        Element("F1", ("0", "e"), 0.4, "Vbias"),
        Element("H1", ("f", "0"), 0.8, "Vdrive"),
        Element("R4", ("f", "e"), 7.0),
    )
    outputs = (
        Output("current", "A", (("i(Vdrive)", -1.0),)),
        Output("inductor", "A", (("i(L1)", 1.0),)),
        Output("mixed", "V", (("v(e)", 2.0), ("v(b)", -0.5), ("i(Vbias)", 3.0))),
        Output("f", "V", (("v(f)", 1.0),)),
    )
    net = Netlist("all kinds", elements, outputs)
    for drive in ("step:1V", "square:-1V..2V,3s", "sine:1V,0.4Hz"):
        assert_engines_agree(net, parse_drive(drive, 20.0), np.linspace(0, 20, 157))


def test_capital_letters_in_a_netlist_do_not_matter() -> None:
    elements = (
        Element("Vdrive", ("In", "0"), 0.0),
        Element("Rd", ("In", "Mid"), 2.0),
        Element("Ca", ("Mid", "0"), 0.5),
        Element("Hx", ("Out", "0"), 2.0, "VDRIVE"),
        Element("Rx", ("Out", "0"), 2.0),
    )
    net = Netlist("capitals", elements, (Output("x", "V", (("v(Out)", 1.0), ("v(Mid)", 1.0))),))
    assert_engines_agree(net, parse_drive("step:1V", 5.0), np.linspace(0, 5, 31))


@pytest.mark.parametrize("node", ["MID", "gnd"])
def test_nodes_that_spice_takes_for_one_are_one_or_refused(node: str) -> None:
    """ngspice does not tell MID from mid, and gnd is ground to it: the exact solver must not think otherwise."""
    elements = (
        Element("Vdrive", ("in", "0"), 0.0),
        Element("R1", ("in", "mid"), 2.0),
        Element("C1", ("mid", "0"), 0.5),
        Element("R2", (node, "0" if node == "MID" else "in"), 3.0),
        Element("R3", (node, "in" if node == "MID" else "mid"), 3.0),
    )
    try:
        net = Netlist("one node", elements, (Output("current", "A", (("i(Vdrive)", -1.0),)),))
    except InputError:
        return
    assert_engines_agree(net, parse_drive("step:1V", 5.0), np.linspace(0, 5, 31))


@pytest.mark.parametrize("model", ["warburg", "cpe"])
def test_a_ladder_follows_a_square_wave(model: str) -> None:
    """Its fastest modes are far shorter than a jump of a long run may be, and have next to no share in the current."""
    t = np.linspace(0.0, 120.0, 61)
    net = strip_netlist(strip_of(model), beam="static")
    drive = parse_drive("square:-2V..2V,30s", 120.0)
    found = transient(net, drive, t, acceptable=5e-6)
    exact = transient(net, drive, t, engine="exact").values
    for k in (found.names.index(name) for name in ("current", "charge", "displacement")):
        difference = np.abs(found.values[0, k] - exact[0, k]).max() / np.abs(exact[0, k]).max()
        assert difference <= found.errors[0, k] + 1e-7, found.names[k]
