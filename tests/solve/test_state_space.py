"""Netlist -> state space: poles of known circuits, every kind of element, and circuits that have none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from strategies import strips as random_strips

from ilg_circuit.circuit import Element, Netlist, Output, electrical_netlist, strip_netlist
from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.solve.state_space import StateSpace, state_space
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.elements import lumped_elements

DRIVE = Element("Vdrive", ("in", "0"), 0.0)


def of(*elements: Element, quantities: tuple[str, ...] = ("i(Vdrive)",)) -> StateSpace:
    outputs = tuple(Output(q, "", ((q, 1.0),)) for q in quantities)
    return state_space([Netlist("test", (DRIVE, *elements), outputs)])


def test_rc() -> None:
    system = of(Element("R1", ("in", "a"), 2.0), Element("C1", ("a", "0"), 0.5), quantities=("i(Vdrive)", "v(a)"))
    assert system.a[0] == pytest.approx(np.array([[-1.0]]))
    assert system.b[0] == pytest.approx(np.array([[1.0, 0.0]]))
    assert system.c[0] == pytest.approx(np.array([[0.5], [1.0]]))
    assert system.d[0] == pytest.approx(np.array([[-0.5, 0.0], [0.0, 0.0]]))
    assert system.output_names == ("i(Vdrive)", "v(a)")


def test_rlc_poles() -> None:
    r, inductance, c = 0.3, 2.0, 0.125
    system = of(Element("R1", ("in", "a"), r), Element("L1", ("a", "b"), inductance), Element("C1", ("b", "0"), c))
    expected = np.roots([inductance * c, r * c, 1.0])
    assert np.sort_complex(system.poles()[0]) == pytest.approx(np.sort_complex(expected))


@pytest.mark.parametrize(
    ("element", "quantity", "gain", "constant"),
    [
        (Element("R1", ("a", "0"), 3.0), "v(a)", 0.75, 0.0),
        (Element("E1", ("a", "0", "in", "0"), 5.0), "v(a)", 5.0, 0.0),
        (Element("G1", ("0", "a", "in", "0"), 5.0), "v(a)", 1.0 + 5.0, 0.0),
        (Element("I1", ("0", "a"), 2.0), "v(a)", 1.0, 2.0),
        (Element("V1", ("a", "0"), 2.0), "v(a)", 0.0, 2.0),
        (Element("V1", ("a", "0"), 2.0), "i(V1)", 1.0, -2.0),
        (Element("F1", ("0", "a"), 2.0, "Vdrive"), "v(a)", 1.0, 0.0),  # the current it senses is then -2 i - i: none
        (Element("H1", ("a", "0"), 4.0, "Vdrive"), "v(a)", 4.0 / 3.0, 0.0),
    ],
    ids=lambda x: getattr(x, "name", None),
)
def test_every_kind(element: Element, quantity: str, gain: float, constant: float) -> None:
    """Beside 1 ohm from the drive to node a."""
    system = of(Element("R9", ("in", "a"), 1.0), element, quantities=(quantity,))
    assert system.d[0, 0] == pytest.approx(np.array([gain, constant]))


def test_inductor_current_is_a_quantity() -> None:
    system = of(Element("R1", ("in", "a"), 2.0), Element("L1", ("a", "0"), 4.0), quantities=("i(L1)",))
    assert system.c[0] == pytest.approx(np.array([[1.0]]))
    assert system.a[0] == pytest.approx(np.array([[-0.5]]))


def test_signs_follow_spice() -> None:
    """A source's current flows from its plus node through it: a loaded drive has a negative one."""
    assert of(Element("R1", ("in", "0"), 2.0)).d[0, 0, 0] == -0.5


def test_no_states_at_all() -> None:
    system = of(Element("R1", ("in", "0"), 2.0))
    assert system.a.shape == (1, 0, 0)
    assert system.poles().shape == (1, 0)


def test_names_are_case_blind() -> None:
    n = Netlist(
        "test",
        (DRIVE, Element("R1", ("in", "a"), 1.0), Element("H1", ("a", "0"), 4.0, "VDRIVE")),
        (Output("x", "", (("i(vdrive)", 1.0),)),),
        drive="VDRIVE",
    )
    assert state_space([n]).d[0, 0, 0] == pytest.approx(1 / 3)


@pytest.mark.parametrize(
    "elements",
    [
        (Element("C1", ("in", "0"), 1.0), Element("C2", ("in", "0"), 1.0)),
        (Element("R1", ("in", "a"), 1.0), Element("C1", ("a", "0"), 1.0), Element("C2", ("a", "0"), 1.0)),
        (Element("R1", ("in", "a"), 1.0), Element("L1", ("a", "b"), 1.0), Element("L2", ("b", "0"), 1.0)),
        (Element("R1", ("in", "0"), 1.0), Element("R2", ("x", "y"), 1.0)),
        (Element("V1", ("in", "0"), 1.0),),
    ],
    ids=["capacitor on the drive", "capacitor loop", "inductor cut", "island", "two sources in parallel"],
)
def test_circuits_without_a_state_space(elements: tuple[Element, ...]) -> None:
    with pytest.raises(SolveError, match=r"cannot solve 'test'.*use the ngspice engine"):
        of(*elements)


def test_one_topology_at_a_time(strips: dict[str, Actuator]) -> None:
    with pytest.raises(InputError, match="share one topology"):
        state_space([strip_netlist(strips["paper"]), strip_netlist(strips["rc2"])])


def test_many_at_once_are_each_alone() -> None:
    nets = [strip_netlist(replace(PAPER, material=replace(PAPER.material, youngs_modulus=e))) for e in (1e3, 1e5, 1e7)]
    together = state_space(nets)
    for k, net in enumerate(nets):
        alone = state_space([net])
        for name in ("a", "b", "c", "d"):
            assert getattr(together, name)[k] == pytest.approx(getattr(alone, name)[0], rel=1e-12, abs=0)


def test_coefficients_of_outputs_may_differ() -> None:
    """The displacement's coefficients hold the strip's sizes; copies share only the quantities."""
    wide = replace(PAPER, geometry=replace(PAPER.geometry, thickness=1e-3))
    nets = [strip_netlist(PAPER), strip_netlist(wide)]
    together = state_space(nets)
    for k, net in enumerate(nets):
        assert together.c[k] == pytest.approx(state_space([net]).c[0], rel=1e-12, abs=1e-18)


def test_poles_of_the_papers_strip() -> None:
    """The ionic branch, the two coupling filters and the tip: what EC (17) says they are without reflection."""
    lumped, k = lumped_elements(PAPER), PAPER.coupling
    assert k is not None
    (rd, c), wn = lumped.port.branches[0], k.natural_frequency
    # the copy of the ionic branch is fed by a current, so its pole is at 0 (Rd + C end open)
    branch = [-1 / (rd * c), 0.0]
    coupling = [*np.roots([1, 2 * k.damping_ratio * wn, wn**2])] * 2
    tip = np.roots([lumped.mass, lumped.damping, lumped.stiffness])
    expected = np.array([*branch, *coupling, *tip])
    found = state_space([strip_netlist(PAPER)]).poles()[0]
    assert len(found) == len(expected)
    for pole in expected:
        # double poles split by the square root of rounding and of the reflection
        assert np.abs(found - pole).min() < 1e-5 * max(abs(pole), wn)


@pytest.mark.parametrize("tip", ["free", "clamped"])
@pytest.mark.parametrize("beam", ["static", "dynamic"])
@given(strip=random_strips())
def test_no_random_strip_runs_away(tip: str, beam: str, strip: Actuator) -> None:
    lumped = lumped_elements(strip)
    # with a complex N the port need not be passive; where it reflects little, it is stable
    n = abs(lumped.coupling_factor(0))
    poles = state_space([strip_netlist(strip, tip=tip, beam=beam)]).poles()
    if beam == "static" or n**2 * lumped.stiffness * lumped.port.capacitance < 1e-6:
        assert (poles.real <= 1e-6 * np.abs(poles).max()).all()


def test_port_has_the_pole_of_ec_5() -> None:
    r1, r2, c, re = 600.0, 20.0, 0.35, 5.0
    poles = state_space([electrical_netlist(r1, ((r2, c),), re)]).poles()
    assert poles[0] == pytest.approx(np.array([-(r1 + re) / ((r1 * r2 + re * (r1 + r2)) * c)]))
