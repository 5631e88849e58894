"""Netlists to hand out: a deck that plain ``ngspice -b`` runs as it is, and a subcircuit library file."""

from __future__ import annotations

import numpy as np

from .. import __version__
from ..actuator import Actuator
from ..solve.state_space import state_space
from ..units import format_quantity
from .drive import Drive
from .netlist import GROUND, Element, Netlist, Output, add_elements, plain
from .strip import SCALE_NOTE, Load, strip_netlist

#: Tolerances with which plain ngspice follows the exact solution within 1e-5 of the maximum on the strips tried.
_OPTIONS = ".options reltol=1e-6 trtol=1 abstol=1e-9 chgtol=1e-6 numdgt=9 method=trap"


def deck(netlist: Netlist, drive: Drive, duration: float, actuator: Actuator, samples: int = 601) -> str:
    """A complete deck: the strip, its drive over ``duration`` [s], a transient from rest, and a printed table.

    The outputs are nodes of their own, in SI units (1 V is one ampere, coulomb, metre, newton).
    """
    poles = state_space([netlist]).poles()
    fastest = float(np.abs(poles).max(initial=1 / duration))
    shown = tuple(o for o in netlist.outputs if any(c for _, c in o.terms))
    circuit = netlist.to_pyspice(drive, duration)
    add_elements(circuit, [e for o in shown for e in _output_elements(o)])
    step = duration / (samples - 1)
    longest = min(step, 0.01 / max(fastest, drive.angular_frequency()), duration / 1000)
    longest = float(f"{longest:.2e}")  # the last digits of an eigenvalue are the machine's
    nodes = " ".join(f"v(out_{o.name})" for o in shown)
    source = next(e for e in netlist.elements if e.name == netlist.drive)
    units = ", ".join(f"out_{o.name} [{o.unit}]" for o in shown)
    header = [*_provenance(netlist.title, actuator), *netlist.comments, f"drive: {drive.text}"]
    header.append(f"outputs in SI units as voltages: {units}")
    header.append("run with: ngspice -b FILE")
    body = str(circuit).partition("\n")[2].rstrip()
    lines = [
        plain(netlist.title),
        *(f"* {plain(line)}" for line in header),
        *_folded(body.splitlines()),
        _OPTIONS,
    ]
    lines.append(f".tran {step!r} {duration!r} 0 {longest!r} uic")
    lines.append(f".print tran v({source.nodes[0]}) {nodes}")
    return "\n".join([*lines, ".end", ""])


def library(actuator: Actuator, name: str = "ilg_strip") -> str:
    """A subcircuit ``name plus minus tip``: electrical pins, and the tip's mechanical pin.

    Across ``tip`` and ground is the force, through it flows the velocity: grounded it is free, open it is clamped, and
    a load is an inductor (mass), resistor (dashpot) or capacitor (spring) from ``tip`` to ground.
    """
    netlist = strip_netlist(actuator, load=Load())
    coupled = actuator.coupling is not None
    elements = []
    for e in netlist.elements:
        if e.name == netlist.drive:
            continue
        nodes = ["plus" if n == "drive" else n for n in e.nodes]
        if e.name in ("Rdc", "Eback") or (not coupled and nodes[1] == GROUND):
            nodes[1] = "minus"
        elements.append(Element(e.name, tuple(nodes), e.value, e.control))
    # the last of the tip's mesh ends at the pin in place of ground
    if coupled:
        elements[-1] = Element(elements[-1].name, (elements[-1].nodes[0], "tip"), elements[-1].value)
    from PySpice.Spice.Netlist import Circuit

    body = Circuit(name)
    add_elements(body, elements)
    pin_list = "plus minus tip" if coupled else "plus minus"
    header = _provenance(f"subcircuit {name}: {netlist.title}", actuator)
    header += [
        f"pins: {pin_list}; plus and minus in volt and ampere",
        *([SCALE_NOTE, "tip: force across, velocity through; to ground: free; open: clamped"] if coupled else []),
        "the transient starts from given states: use .tran ... uic",
    ]
    lines = [f"* {plain(line)}" for line in header]
    return "\n".join([*lines, f".subckt {name} {pin_list}", *str(body).splitlines()[1:], f".ends {name}", ""])


def _provenance(title: str, actuator: Actuator) -> list[str]:
    g = actuator.geometry
    sizes = ", ".join(
        f"{label} {format_quantity(value, 'm', 6)}"
        for label, value in (
            ("L", g.length),
            ("L0", g.free_length),
            ("L_F", g.load_distance),
            ("w", g.width),
            ("b", g.thickness),
        )
    )
    return [title, f"written by ilg_circuit {__version__}; strip {sizes}"]


def _output_elements(output: Output) -> list[Element]:
    """Controlled sources in series whose sum is the output, from node out_NAME to ground."""
    terms = [(q, c) for q, c in output.terms if c]
    nodes = [f"out_{output.name}", *(f"out_{output.name}_{k}" for k in range(1, len(terms))), GROUND]
    elements = []
    for k, (quantity, coefficient) in enumerate(terms):
        kind, inner = quantity[0], quantity[2:-1]
        ends = (nodes[k], nodes[k + 1])
        if kind == "v":
            elements.append(Element(f"Eout_{output.name}{k}", (*ends, inner, GROUND), coefficient))
        else:
            elements.append(Element(f"Hout_{output.name}{k}", ends, coefficient, inner))
    return elements


def _folded(lines: list[str], width: int = 100) -> list[str]:
    """Long lines (a measured PWL) continued with ``+``, as SPICE wants them."""
    result = []
    for line in lines:
        words, current = line.split(" "), ""
        for word in words:
            if current and len(current) + len(word) > width:
                result.append(current)
                current = "+ " + word
            else:
                current = f"{current} {word}" if current else word
        result.append(current)
    return result
