"""Gives netlists that are handed out an operating point: no node of theirs hangs on capacitors and currents alone.

The netlists that the package solves itself start from rest, and charge the beam's compliance, and the copy of the ion
path that reflects, by currents k s d(s) v. What these charge up to is k d(s) v, which the filter's own nodes tell, so
here voltage sources set it, or hold it:

    beam     F1 = K (y1 - y), where the way y is the charge of 1 F that the tip's velocity feeds
    springs  at the tip, and gravity: a source in proportion to y
    copy     a resistor of `HOLD` times its own leads to what its charge k d(s) F1 makes of it at rest

Direct current through the tip is y/`LEAK`, so that an open tip, where there is none, has not moved. It is so small that
it must not be what is left of forces over the tip's small resistance: that one is a source in proportion to it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from .netlist import GROUND, Element, Netlist, Role, series_sum

#: Resistance [ohm] in parallel with the 1 F of the displacement, i.e. 1e11 s: a run of a day loses 1e-6 of it.
LEAK = 1e11
#: Resistance that holds the copy, over the copy's own: the reflected voltage is accurate to the inverse.
HOLD = 1e8


def with_operating_point(netlist: Netlist) -> Netlist:
    """Return the netlist of a strip with an operating point; its outputs stay.

    The reflected voltage stands above the ion path here: below it, its current would be that of capacitors, whose
    rounding in short steps keeps ngspice from going on from an operating point that is not zero.
    """
    named = {e.name: e for e in netlist.elements}
    if "Cbeam" not in named:
        return netlist
    if any(e.role is Role.REFLECTED_VOLTAGE for e in netlist.elements) and "Eback" not in named:
        return with_operating_point(_unreflected(netlist))
    compliance = named["Cbeam"].value
    free = _charge(named, "v1", "d") if "Ld" in named else dict(netlist.free)
    tip = any(e.role is Role.TIP for e in netlist.elements)
    force = {q: c / compliance for q, c in free.items()} | ({"v(way)": -1 / compliance} if tip else {})
    port = next(e.nodes[0] for e in netlist.elements if e.role is Role.ION_PATH) if "Eback" in named else ""
    found: list[Element] = []
    for element in netlist.elements:
        nodes = tuple(GROUND if n == "back" else n for n in element.nodes)
        if element.name == "Cbeam":
            found += series_sum("beam", list(force.items()))
        elif element.name == "Eback":
            found.append(replace(element, nodes=(port, "top", "copy", GROUND)))
        elif element.role is Role.ION_PATH or element.name in ("Ed", "Exd0"):
            found.append(replace(element, nodes=tuple("top" if n == port else n for n in nodes)))
        elif element.role not in (Role.TIP, Role.LOAD, Role.FREE_VELOCITY):
            found.append(replace(element, nodes=nodes))
    if port:
        found += _held(named)
    if tip:
        starts = _starts(netlist.elements)
        found += _meter(sum(c * starts.get(q[2:-1], 0.0) for q, c in free.items()))
        found += _mesh([e for e in netlist.elements if e.role in (Role.TIP, Role.LOAD)])
    outputs = tuple(replace(o, terms=tuple(t for t in o.terms if t[0] != "v(back)")) for o in netlist.outputs)
    return replace(netlist, elements=tuple(found), outputs=outputs)


def _unreflected(netlist: Netlist) -> Netlist:
    """Return the netlist of a line of cells without what the motion reflects on each of them.

    That is some 1e-11 of the voltage, and would need an operating point in each cell.
    """
    backs = {e.nodes[0]: e.nodes[1] for e in netlist.elements if e.role is Role.REFLECTED_VOLTAGE}
    kept = [e for e in netlist.elements if e.role not in (Role.REFLECTED_VOLTAGE, Role.REFLECTION)]
    elements = tuple(replace(e, nodes=tuple(backs.get(n, n) for n in e.nodes)) for e in kept)
    outputs = []
    for output in netlist.outputs:
        terms: dict[str, float] = {}
        for quantity, c in output.terms:
            node = backs.get(quantity[2:-1], quantity[2:-1])
            if node != GROUND:
                name = f"{quantity[0]}({node})"
                terms[name] = terms.get(name, 0.0) + c
        outputs.append(replace(output, terms=tuple(terms.items())))
    return replace(netlist, elements=elements, outputs=tuple(outputs))


def without_mass(netlist: Netlist, lag: float) -> Netlist:
    """Return the one of a dynamic, undamped beam without mass, and nothing reflected.

    The tip follows in ``lag`` [s], which is to be nothing beside d(s): a mass so small that a dashpot beside it damps.
    """
    compliance = 1 / next(-e.value for e in netlist.elements if e.nodes[2:] == ("way", GROUND))
    port = next(e.nodes[0] for e in netlist.elements if e.role is Role.REFLECTED_VOLTAGE)
    found = []
    for element in netlist.elements:
        nodes = tuple(port if n == "top" else n for n in element.nodes)
        if element.name == "Ltip":
            found.append(replace(element, value=lag**2 / compliance))
            found.append(Element("Rlag", nodes, lag / compliance / 2, role=Role.TIP))
        elif element.role not in (Role.REFLECTION, Role.REFLECTED_VOLTAGE):
            found.append(replace(element, nodes=nodes))
    return replace(netlist, elements=tuple(found))


def _charge(named: dict[str, Element], rate: str, filter_name: str) -> dict[str, float]:
    """Return the charge of the sources of a rate since rest, as coefficients of the filter's node voltages."""
    relaxing = [e for name, e in named.items() if name.startswith(f"G{rate}") and e.nodes[3].startswith("z")]
    if relaxing:
        return {f"v({e.nodes[3]})": e.value * named[f"R{e.nodes[3]}"].value for e in relaxing}
    resistor = named[f"R{filter_name}"].value
    through = named[f"G{rate}a"].value * named[f"L{filter_name}"].value / resistor
    v1, v2, v3 = (f"v({filter_name}{k})" for k in (1, 2, 3))
    return {v3: named[f"G{rate}b"].value * resistor, v1: through, v2: -through}


def _starts(elements: tuple[Element, ...]) -> dict[str, float]:
    """Return the voltages that nodes start from: of capacitors, and of the charge that a coupling follows."""
    starts = {e.nodes[0]: e.start for e in elements if e.kind == "C"}
    x = sum(e.value * starts.get(e.nodes[2], 0.0) for e in elements if e.name.startswith("Exd"))
    bent = next((e for e in elements if e.law == "bent"), None)
    return starts | {"xd": x, "wd": bent.bent(x) if bent else x}


def _held(named: dict[str, Element]) -> list[Element]:
    """Return a resistor, far larger than the copy's, from its voltage in the steady state."""
    ends = [e for name, e in named.items() if e.role is Role.REFLECTION and name[0] == "C" and e.nodes[0][:4] == "ionx"]
    if not ends:
        return []  # nothing is charged by currents where the force's filter gives the voltage itself
    total = sum(e.value for e in ends if e.nodes[1] == GROUND)
    first = next(e for e in named.values() if e.role is Role.REFLECTION and e.nodes[0] == "copy")
    elements = series_sum("held", [(q, c / total) for q, c in _charge(named, "u1", "s").items()])
    elements.append(Element("Rheld", ("held", "copy"), HOLD * first.value))
    return [replace(e, role=Role.REFLECTION) for e in elements]


def _meter(start: float) -> list[Element]:
    """Return the displacement of the tip, as the voltage of node ``way``."""
    return [
        Element("Fway", (GROUND, "way"), 1.0, control="Vway"),
        Element("Cway", ("way", GROUND), 1.0, start=start),
        Element("Rway", ("way", GROUND), LEAK),
    ]


def _mesh(chain: list[Element]) -> Iterator[Element]:
    """Return the tip's mesh: springs follow the displacement, dashpots the velocity, sensed by a source of 0 V."""
    for element in chain:
        nodes = tuple("swing" if n == GROUND else n for n in element.nodes)
        if element.kind == "C":
            yield Element(f"E{element.name[1:]}", (*nodes, "way", GROUND), 1 / element.value, role=element.role)
        elif element.kind == "R":
            yield Element(f"H{element.name[1:]}", nodes, element.value, control="Vway", role=element.role)
        else:
            yield replace(element, nodes=nodes)
    yield Element("Vway", ("swing", GROUND), 0.0)
