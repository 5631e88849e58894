"""The electrical port of a strip as elements: leads, electron path and ion path of any model."""

from __future__ import annotations

from ..errors import InputError
from ..strip.charge_laws import CHARGE_LAWS, ChargeLaw
from ..strip.port import Port
from .netlist import GROUND, Element, Output, Role

#: The source of voltage that drives a port.
DRIVE = Element("Vdrive", ("drive", GROUND), 0.0, role=Role.SOURCE)
#: A source of current into node drive: 1 A per volt of node set, which the drive sets.
_BY_CURRENT = (
    Element("Vdrive", ("set", GROUND), 0.0, role=Role.SOURCE),
    Element("Gdrive", (GROUND, "drive", "set", GROUND), 1.0, role=Role.SOURCE),
)


def port_elements(
    port: Port, end: str, source: Element | None = DRIVE, inner: float = 0.0
) -> tuple[list[Element], list[Output]]:
    """Return a voltage source (or none), the leads, the electron path and the ion path from the port's node to ``end``.

    The ion path starts at rest under ``inner`` [V].
    """
    node = port_node(port)
    leads = [("Lseries", port.inductance), ("Re", port.electrode_resistance)]
    leads = [(name, value) for name, value in leads if value]
    ends = ["drive", *(f"lead{k}" for k in range(1, len(leads))), node]
    elements = [source] if source else []
    elements += [Element(n, (ends[k], ends[k + 1]), v, role=Role.LEAD) for k, (n, v) in enumerate(leads)]
    elements.append(electron_path(port, node, GROUND))
    ions, charge = ion_path(port, node, end, "", inner=inner)
    outputs = [
        *([Output("current", "A", ((f"i({source.name})", -1.0),))] if source else []),
        Output("charge", "C", tuple(charge.items())),
    ]
    return elements + ions, outputs


def driven_port(
    port: Port, end: str, inner: float = 0.0, *, by_current: bool = False
) -> tuple[list[Element], list[Output]]:
    """Return `port_elements` with a source of voltage or, ``by_current``, of current; then the voltage is an output.

    Raises InputError for an inductance, through which no current can be made to jump.
    """
    if not by_current:
        return port_elements(port, end, inner=inner)
    if port.inductance:
        raise InputError("a current cannot be forced through leads with an inductance; leave the inductance out")
    elements, outputs = port_elements(port, end, None, inner)
    own = [Output("current", "A", (("v(set)", 1.0),)), Output("voltage", "V", (("v(drive)", 1.0),))]
    return [*_BY_CURRENT, *elements], [own[0], *outputs, own[1]]


def port_node(port: Port) -> str:
    return "port" if port.electrode_resistance or port.inductance else "drive"


def electron_path(port: Port, top: str, end: str, suffix: str = "") -> Element:
    """Return the electron path from ``top`` to ``end``."""
    role = Role.ELECTRON_PATH
    if port.emission_voltage is None:
        return Element(f"Rdc{suffix}", (top, end), port.dc_resistance, role=role)
    current, scale = port.saturation_current, port.emission_voltage
    return Element(f"Bdc{suffix}", (top, end), current, law="sinh", scale=scale, role=role)


def stores(port: Port, suffix: str = "") -> list[tuple[str, float]]:
    """Return the nodes of an ion path with a ``suffix`` whose voltages tell its charge, with coefficients [F].

    Those of an ion path, ``ion...``, are against its end; those of charge meters, ``q...``, are charges to ground.
    """
    if port.ladder is not None:
        return [(f"ion{suffix}{len(port.ladder.sections) + 1}", port.ladder.capacitance)]
    if port.charge_law is not None:
        return [(f"q{suffix}{k}", 1.0) for k in range(1, len(port.branches) + 1)]
    return [(f"ion{suffix}{k}", c) for k, (_, c) in enumerate(port.branches, 1)]


def ion_path(
    port: Port, top: str, end: str, suffix: str, role: Role = Role.ION_PATH, inner: float = 0.0
) -> tuple[list[Element], dict[str, float]]:
    """Return the ion path from ``top`` to ``end``, and its charge [C] as coefficients of node voltages."""
    elements: list[Element] = []
    charge: dict[str, float] = {}

    def add(name: str, plus: str, minus: str, value: float, start: float = 0.0) -> None:
        elements.append(Element(name, (plus, minus), value, role=role, start=start))

    if port.ladder is not None:
        # Rs, then R parallel C sections in series, then the capacitor that alone has the whole charge
        ladder = port.ladder
        nodes = [f"ion{suffix}{k}" for k in range(1, len(ladder.sections) + 2)]
        add(f"Rion{suffix}", top, nodes[0], port.series_resistance + ladder.resistance)
        for k, (r, c) in enumerate(ladder.sections, 1):
            add(f"Rd{suffix}{k}", nodes[k - 1], nodes[k], r)
            add(f"C{suffix}{k}", nodes[k - 1], nodes[k], c)
        add(f"Cion{suffix}", nodes[-1], end, ladder.capacitance, inner)
        _add_charge(charge, ladder.capacitance, nodes[-1], end)
    for k, (r, c) in enumerate(port.branches, 1):
        node = f"ion{suffix}{k}"
        add(f"Rd{suffix}{k}", top, node, r)
        if port.charge_law is not None:
            elements += _lawful_capacitor(c, port.charge_law, node, end, f"{suffix}{k}", role, inner)
            charge[f"v(q{suffix}{k})"] = 1.0
        else:
            add(f"C{suffix}{k}", node, end, c, inner)
            _add_charge(charge, c, node, end)
    return elements, charge


def _lawful_capacitor(
    capacitance: float, law: ChargeLaw, node: str, end: str, name: str, role: Role, inner: float
) -> list[Element]:
    """Return a capacitance with a law: its charge is the voltage on 1 F that its own current feeds."""
    charge, sense = f"q{name}", f"sense{name}"
    start = capacitance * float(law.charge(inner))
    named = next(word for word, kind in CHARGE_LAWS.items() if isinstance(law, kind))
    return [
        Element(f"Bq{name}", (node, sense, charge), capacitance, law=named, scale=law.constant, role=role),
        Element(f"Vq{name}", (sense, end), 0.0, role=Role.SOURCE),
        Element(f"Fq{name}", (GROUND, charge), 1.0, control=f"Vq{name}", role=Role.CHARGE_METER),
        Element(f"Cq{name}", (charge, GROUND), 1.0, role=Role.CHARGE_METER, start=start),
    ]


def _add_charge(charge: dict[str, float], capacitance: float, node: str, end: str) -> None:
    charge[f"v({node})"] = capacitance
    if end != GROUND:
        charge[f"v({end})"] = charge.get(f"v({end})", 0.0) - capacitance
