"""The element list: what it refuses, and its text as a PySpice circuit."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ilg_circuit.circuit import Element, Netlist, Output, electrical_netlist, strip_netlist
from ilg_circuit.circuit.netlist import copies
from ilg_circuit.errors import InputError
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.strip.actuator import PAPER, Actuator

DRIVE = Element("Vdrive", ("in", "0"), 0.0)
CURRENT = Output("current", "A", (("i(Vdrive)", -1.0),))


def netlist(*elements: Element) -> Netlist:
    return Netlist("test", (DRIVE, *elements), (CURRENT,))


@pytest.mark.parametrize("kind", ["R", "L", "C"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_values_that_ngspice_would_take_without_a_word(kind: str, value: float) -> None:
    with pytest.raises(InputError, match=f"element {kind}1 has value .* it must be positive and finite"):
        netlist(Element(f"{kind}1", ("in", "0"), value))


@pytest.mark.parametrize(
    "element",
    [
        Element("V1", ("a", "0"), float("nan")),
        Element("I1", ("a", "0"), float("inf")),
        Element("E1", ("a", "0", "in", "0"), float("nan")),
        Element("G1", ("a", "0", "in", "0"), float("-inf")),
        Element("F1", ("a", "0"), float("nan"), "Vdrive"),
        Element("H1", ("a", "0"), float("nan"), "Vdrive"),
    ],
    ids=lambda e: e.kind,
)
def test_source_values_are_finite(element: Element) -> None:
    with pytest.raises(InputError, match="must be finite"):
        netlist(element)


@pytest.mark.parametrize(
    ("element", "hint"),
    [
        (Element("Q1", ("a", "b", "c"), 1.0), "kind Q is not one of"),
        (Element("R1", ("in",), 1.0), "has 1 nodes; kind R takes 2"),
        (Element("E1", ("a", "0"), 1.0), "has 2 nodes; kind E takes 4"),
        (Element("F1", ("a", "0"), 1.0), "controlling source '' is not in the netlist"),
        (Element("H1", ("a", "0"), 1.0, "Vother"), "controlling source 'Vother' is not in the netlist"),
        (Element("R1", ("in", "0"), 1.0, "Vdrive"), "controlling source"),
        (Element("VDRIVE", ("a", "0"), 1.0), "appears twice"),
    ],
)
def test_malformed_elements(element: Element, hint: str) -> None:
    with pytest.raises(InputError, match=hint):
        netlist(element)


def test_names_are_case_blind() -> None:
    with pytest.raises(InputError, match="appears twice"):
        netlist(Element("Rd", ("in", "0"), 1.0), Element("RD", ("in", "0"), 1.0))


def test_the_drive_must_exist() -> None:
    with pytest.raises(InputError, match="no voltage source Vother"):
        Netlist("test", (DRIVE,), (CURRENT,), drive="Vother")


def test_topology_is_everything_but_the_values(strips: dict[str, Actuator]) -> None:
    other = replace(PAPER, material=replace(PAPER.material, youngs_modulus=1e5))
    assert strip_netlist(other).topology == strip_netlist(PAPER).topology
    assert strip_netlist(other).values != strip_netlist(PAPER).values
    shapes = {strip_netlist(strips[n]).topology for n in ("paper", "electrodes", "rc2", "undamped", "no coupling")}
    assert len(shapes) == 5


def test_quantities_once_each() -> None:
    n = strip_netlist(PAPER)
    assert len(n.quantities) == len(set(n.quantities))
    assert set(n.quantities) == {q for o in n.outputs for q, _ in o.terms}


# -- PySpice text ------------------------------------------------------------------------------------------------------

ALL_KINDS = Netlist(
    "all kinds",
    (
        DRIVE,
        Element("R1", ("in", "a"), 1 / 3),
        Element("L1", ("a", "b"), 1e-30),
        Element("C1", ("b", "0"), 1.0),
        Element("V1", ("c", "0"), -2e25),
        Element("I1", ("b", "0"), 1e-15),
        Element("E1", ("d", "0", "a", "b"), 2 / 3),
        Element("G1", ("b", "0", "a", "0"), -1e3),
        Element("F1", ("b", "0"), 1e6, "V1"),
        Element("H1", ("e", "0"), 1e9, "Vdrive"),
    ),
    (CURRENT,),
)


def test_every_kind_is_written_with_full_numbers() -> None:
    lines = str(ALL_KINDS.to_pyspice()).splitlines()
    assert lines[0] == ".title all kinds"
    assert set(lines[1:]) == {
        "R1 in a 0.3333333333333333",
        "L1 a b 1e-30 ic=0.0",
        "C1 b 0 1.0 ic=0.0",
        "V1 c 0 -2e+25",
        "I1 b 0 1e-15",
        "E1 d 0 a b 0.6666666666666666",
        "G1 b 0 a 0 -1000.0",
        "F1 b 0 V1 1000000.0",
        "H1 e 0 Vdrive 1000000000.0",
        "Vdrive in 0 0.0",
    }


@pytest.mark.parametrize("value", ["1.0", "0.35", "4"])
def test_numbers_carry_no_unit_suffix(value: str) -> None:
    """SPICE reads F as femto, A as atto, M as milli: no letter may follow a number."""
    text = str(electrical_netlist(float(value), ((2.0, 1.0),), 3.0).to_pyspice(parse_drive("step:4V", 10), 10))
    assert not re.search(r"\d[a-df-zA-DF-Z]", re.sub(r"\w*[a-z]\w*", "", text.partition("\n")[2]))
    assert f"Rdc port 0 {float(value)!r}" in text


@given(st.floats(min_value=1e-300, max_value=1e300))
def test_the_text_holds_every_bit(value: float) -> None:
    text = str(netlist(Element("R1", ("in", "0"), value)).to_pyspice())
    line = next(line for line in text.splitlines() if line.startswith("R1"))
    assert float(line.split()[-1]) == value


@pytest.mark.parametrize(
    ("drive", "waveform"),
    [
        ("step:4V", "PWL(0.0 4.0 20.0 4.0)"),
        ("ramp:0.5V/s", "PWL(0.0 0.0 20.0 10.0)"),
        ("sine:2V,0.1Hz", "SIN(0.0 2.0 0.1)"),
    ],
)
def test_the_drive_is_in_its_source(drive: str, waveform: str) -> None:
    text = str(strip_netlist(PAPER).to_pyspice(parse_drive(drive, 10.0), 10.0))
    assert f"Vdrive drive 0 {waveform}" in text


# -- copies ------------------------------------------------------------------------------------------------------------


def test_copies_share_nothing_but_the_drive() -> None:
    count = 3
    nets = [electrical_netlist(100.0 + k, ((10.0, 1.0 + k),), 1.0 + k) for k in range(count)]
    circuit, vectors = copies(nets)
    lines = circuit.splitlines()[1:]
    nodes: list[set[str]] = [set() for _ in range(count)]
    for line in lines:
        name, plus, minus, *_ = line.split()
        nodes[int(name.rpartition("_")[2])] |= {plus, minus}
    for a in range(count):
        for b in range(a):
            assert nodes[a] & nodes[b] == {"0", "drive"}
    assert len(lines) == count * len(nets[0].elements)
    for k, of_copy in enumerate(vectors):
        assert of_copy["i(Vdrive)"] == f"vdrive_{k}#branch"
        assert of_copy["v(ion1)"] == f"ion1_{k}"
        assert f"Rdc_{k} port_{k} 0 {100.0 + k!r}" in lines


def test_copies_rename_controlling_sources_and_ground_stays() -> None:
    circuit, _ = copies([ALL_KINDS, ALL_KINDS])
    lines = circuit.splitlines()
    assert "F1_1 b_1 0 V1_1 1000000.0" in lines
    assert "H1_1 e_1 0 Vdrive_1 1000000000.0" in lines
    assert "E1_0 d_0 0 a_0 b_0 0.6666666666666666" in lines


def test_a_copy_is_written_as_pyspice_writes_the_circuit() -> None:
    for netlist in (ALL_KINDS, strip_netlist(PAPER)):
        circuit, _ = copies([netlist])
        ours = sorted(line.replace("_0", "") for line in circuit.splitlines()[1:])
        theirs = sorted(str(netlist.to_pyspice()).split("\n")[1:])
        drive = next(e for e in netlist.elements if e.name == netlist.drive)
        common = f"{drive.name} {drive.nodes[0]} {drive.nodes[0]} 0.0"
        assert [line for line in ours if line != common] == [
            line for line in theirs if line and line.split()[0] != drive.name
        ]


# -- names come from files, files come from strangers ------------------------------------------------------------------


@pytest.mark.parametrize("name", ["x\n.control\nshell true\n.endc", "x\r.end", "x\n+ y", "x\x0b.end", "x\u2028.end"])
def test_a_name_cannot_smuggle_lines_into_a_circuit(name: str) -> None:
    clean, odd = (str(strip_netlist(replace(PAPER, name=n)).to_pyspice()) for n in ("x", name))
    assert odd.splitlines()[1:] == clean.splitlines()[1:]
