"""A strip's elements wired up: electrical port, coupling d(s), transformer, beam and load. EC (10)-(19), Figure 5.

The mechanical side uses the impedance analogy (force = voltage, velocity = current) in units of its own, because its
numbers are far below SPICE's tolerances: 1 V is 1 uN, 1 A is 1 mm/s, so 1 C is 1 mm. Signs are positive towards the
anode, the opposite of EC's axis.

``d(s)`` is a series R-L-C with C = 1 F: driven by a voltage v, d(s) v = d0 [v_C + i/(Zd C)], and s d(s) v is
d0 [v_L/(Zd L C) + i/C], so nothing is ever differentiated. The transformer is then

    free velocity      v1 = N i1 = k s d(s) v_p             v_p across the ionic branches, k = 3 L_F^2/b^2
    reflected voltage  u1 = N F1 = Zp k s d(s) F1           a current k s d(s) F1 through a copy of the branches
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, cast

from ..errors import InputError
from ..strip.actuator import Actuator, Coupling
from ..strip.elements import Elements, hanging_stiffness, lumped_elements
from ..strip.ladder import LADDER_BAND
from ..strip.port import Port
from .netlist import GROUND, Element, Netlist, Output

#: Newtons per mechanical volt and metres per second per mechanical ampere.
FORCE_SCALE = 1e-6
VELOCITY_SCALE = 1e-3
IMPEDANCE_SCALE = VELOCITY_SCALE / FORCE_SCALE

SCALE_NOTE = "mechanical side: 1 V = 1 uN, 1 A = 1 mm/s, 1 C = 1 mm; positive towards the anode"

#: Up to this ratio of gravity's to the strip's stiffness the tip spring of a hanging strip holds within 7 %.
LARGEST_GRAVITY_RATIO = 1.0

Tip = Literal["free", "clamped"]
Beam = Literal["dynamic", "static"]


@dataclass(frozen=True)
class Load:
    """What hangs on the strip at L_F: mass [kg], spring [N/m] and dashpot [N s/m] to ground, each zero or more."""

    mass: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0

    def __post_init__(self) -> None:
        for name, unit in (("mass", "kg"), ("stiffness", "N/m"), ("damping", "N s/m")):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise InputError(f"load {name} is {value:g} {unit}; it must be zero or more")

    def __bool__(self) -> bool:
        return bool(self.mass or self.stiffness or self.damping)


def parse_load(text: str | None) -> Load | None:
    """The load that a text such as ``mass=1g,stiffness=1mN/m,damping=1uN*s/m`` names. Raises InputError otherwise."""
    from ..units import parse

    if not text:
        return None
    units = {"mass": "kg", "stiffness": "N/m", "damping": "N*s/m"}
    values: dict[str, float] = {}
    for part in text.split(","):
        key, _, value = (p.strip() for p in part.partition("="))
        if key not in units or not value or key in values:
            raise InputError(f"load '{text}' is not understood; write mass=1g,stiffness=1mN/m,damping=1uN*s/m")
        values[key] = parse(value, units[key], f"load {key}")
    return Load(**values)


def electrical_netlist(
    dc_resistance: float,
    branches: tuple[tuple[float, float], ...],
    electrode_resistance: float = 0.0,
    title: str = "ILG strip, electrical port",
) -> Netlist:
    """The port alone: Re in series with Rdc parallel to R-C branches, Figure 4; outputs current [A] and charge [C].

    ``branches`` are (resistance [ohm], capacitance [F]) pairs.
    """
    return port_netlist(Port(dc_resistance, tuple(branches), electrode_resistance), title)


def port_netlist(port: Port, title: str = "ILG strip, electrical port") -> Netlist:
    """The electrical port alone, of any model; outputs current [A] and charge [C] on the ion path."""
    elements, outputs = _port(port, GROUND)
    return Netlist(title, tuple(elements), tuple(outputs))


def strip_netlist(
    actuator: Actuator,
    *,
    tip: str = "free",
    beam: str = "dynamic",
    load: Load | None = None,
    band: tuple[float, float] = LADDER_BAND,
) -> Netlist:
    """The whole strip, with outputs current [A], charge [C], displacement [m] and force [N] (at L_F, on the load).

    ``beam`` "dynamic" is the port EC (17) without simplification: beam compliance and mass, voltage reflected onto the
    electrical side. "static" is EC (26), (29): no mass, nothing reflected. ``tip`` "clamped" holds the point L_F.
    ``band`` [Hz] is that of a Warburg or CPE ladder where the strip gives none.
    Raises InputError for an unknown word, a load where there can be none, or a hanging strip too soft to hold itself.
    """
    load = load or Load()
    if tip not in ("free", "clamped"):
        raise InputError(f"tip is '{tip}'; choose free or clamped")
    if beam not in ("dynamic", "static"):
        raise InputError(f"beam is '{beam}'; choose dynamic or static")
    if load and (tip == "clamped" or beam == "static"):
        raise InputError("a load moves with the tip: it needs --tip free and --beam dynamic")
    lumped = lumped_elements(actuator, band)
    title = f"ILG strip {actuator.name}, {beam} beam, {tip} tip"
    if lumped.coupling is None:
        if load:
            raise InputError(f"actuator '{actuator.name}' has no [coupling]; a load needs one")
        return port_netlist(lumped.port, title)
    if beam == "static":
        elements, outputs = _static(lumped, lumped.coupling, cast(Tip, tip))
    else:
        elements, outputs = _dynamic(actuator, lumped, lumped.coupling, cast(Tip, tip), load)
    return Netlist(title, tuple(elements), tuple(outputs), comments=(SCALE_NOTE,))


_DRIVE = Element("Vdrive", ("drive", GROUND), 0.0)


def _port(port: Port, end: str, source: Element | None = _DRIVE) -> tuple[list[Element], list[Output]]:
    """A voltage source (or none), Re, the electron path and the ion path from the port's node to ``end``."""
    elements = [source] if source else []
    node = _port_node(port)
    if port.electrode_resistance:
        elements.append(Element("Re", ("drive", node), port.electrode_resistance))
    if port.emission_voltage is None:
        elements.append(Element("Rdc", (node, GROUND), port.dc_resistance))
    else:
        elements.append(
            Element("Bdc", (node, GROUND), port.saturation_current, law="sinh", scale=port.emission_voltage)
        )
    ions, charge = _ion_path(port, node, end, "")
    outputs = [
        *([Output("current", "A", ((f"i({source.name})", -1.0),))] if source else []),
        Output("charge", "C", tuple(charge.items())),
    ]
    return elements + ions, outputs


def _port_node(port: Port) -> str:
    return "port" if port.electrode_resistance else "drive"


def _ion_path(port: Port, top: str, end: str, suffix: str) -> tuple[list[Element], dict[str, float]]:
    """The ion path from ``top`` to ``end``, and its charge [C] as coefficients of node voltages."""
    if port.ladder is not None:
        return _ladder(port, top, end, suffix)
    elements: list[Element] = []
    charge: dict[str, float] = {}
    for k, (r, c) in enumerate(port.branches, 1):
        node = f"ion{suffix}{k}"
        elements.append(Element(f"Rd{suffix}{k}", (top, node), r))
        if port.capacitance_slope:
            elements += _growing_capacitor(c, port.capacitance_slope, node, end, f"{suffix}{k}")
            charge[f"v(q{suffix}{k})"] = 1.0
            continue
        elements.append(Element(f"C{suffix}{k}", (node, end), c))
        _add_charge(charge, c, node, end)
    return elements, charge


def _growing_capacitor(capacitance: float, slope: float, node: str, end: str, name: str) -> list[Element]:
    """A capacitance that grows with voltage: its charge is the voltage on 1 F that its own current feeds."""
    charge, sense = f"q{name}", f"sense{name}"
    return [
        Element(f"Bq{name}", (node, sense, charge), capacitance, law="charge", scale=slope),
        Element(f"Vq{name}", (sense, end), 0.0),
        Element(f"Fq{name}", (GROUND, charge), 1.0, control=f"Vq{name}"),
        Element(f"Cq{name}", (charge, GROUND), 1.0),
    ]


def _ladder(port: Port, top: str, end: str, suffix: str) -> tuple[list[Element], dict[str, float]]:
    """Rs, then R parallel C sections in series, then the capacitor that alone has the whole charge."""
    ladder = port.ladder
    assert ladder is not None
    nodes = [f"ion{suffix}{k}" for k in range(1, len(ladder.sections) + 2)]
    elements = [Element(f"Rion{suffix}", (top, nodes[0]), port.series_resistance + ladder.resistance)]
    for k, (r, c) in enumerate(ladder.sections, 1):
        ends = (nodes[k - 1], nodes[k])
        elements += [Element(f"Rd{suffix}{k}", ends, r), Element(f"C{suffix}{k}", ends, c)]
    elements.append(Element(f"Cion{suffix}", (nodes[-1], end), ladder.capacitance))
    charge: dict[str, float] = {}
    _add_charge(charge, ladder.capacitance, nodes[-1], end)
    return elements, charge


def _add_charge(charge: dict[str, float], capacitance: float, node: str, end: str) -> None:
    charge[f"v({node})"] = capacitance
    if end != GROUND:
        charge[f"v({end})"] = charge.get(f"v({end})", 0.0) - capacitance


def _filter(coupling: Coupling, plus: str, minus: str, name: str) -> list[Element]:
    """The series R-L-C of d(s) behind a source that does not load (plus, minus); nodes name1, name2, name3."""
    wn = coupling.natural_frequency
    return [
        Element(f"E{name}", (f"{name}1", GROUND, plus, minus), 1.0),
        Element(f"R{name}", (f"{name}1", f"{name}2"), 2 * coupling.damping_ratio / wn),
        Element(f"L{name}", (f"{name}2", f"{name}3"), 1 / wn**2),
        Element(f"C{name}", (f"{name}3", GROUND), 1.0),
    ]


def _filter_rate(coupling: Coupling, name: str, filter_name: str, out: tuple[str, str], gain: float) -> list[Element]:
    """Two current sources whose sum is gain s d(s) v, from the filter's inductor voltage and its current."""
    wn, d0 = coupling.natural_frequency, coupling.static
    resistor = 2 * coupling.damping_ratio / wn
    n1, n2, n3 = (f"{filter_name}{k}" for k in (1, 2, 3))
    return [
        Element(f"G{name}a", (*out, n2, n3), gain * d0 * wn**2 / coupling.zero),
        Element(f"G{name}b", (*out, n1, n2), gain * d0 / resistor),
    ]


def _free_displacement(coupling: Coupling, ratio: float, name: str) -> dict[str, float]:
    """y1 = k d(s) v as coefficients of the filter's node voltages: k d0 [v_C + (v1 - v2)/(R Zd C)]."""
    static = ratio * coupling.static
    through = static / (2 * coupling.damping_ratio / coupling.natural_frequency * coupling.zero)
    return {f"v({name}3)": static, f"v({name}1)": through, f"v({name}2)": -through}


def _static(lumped: Elements, coupling: Coupling, tip: Tip) -> tuple[list[Element], list[Output]]:
    elements, outputs = _port(lumped.port, GROUND)
    port = _port_node(lumped.port)
    elements += _filter(coupling, port, GROUND, "d")
    free = _free_displacement(coupling, lumped.bending_ratio, "d")
    still = dict.fromkeys(free, 0.0)
    force = {q: c * lumped.stiffness for q, c in free.items()}
    return elements, [
        *outputs,
        Output("displacement", "m", tuple((free if tip == "free" else still).items())),
        Output("force", "N", tuple((force if tip == "clamped" else still).items())),
    ]


def _dynamic(
    actuator: Actuator, lumped: Elements, coupling: Coupling, tip: Tip, load: Load
) -> tuple[list[Element], list[Output]]:
    elements, outputs = _port(lumped.port, "back")
    port = _port_node(lumped.port)
    ratio = lumped.bending_ratio
    # electrical -> mechanical: v1 = k s d(s) v_p flows into the beam's compliance
    elements += _filter(coupling, port, "back", "d")
    elements += _filter_rate(coupling, "v1", "d", (GROUND, "beam"), ratio / VELOCITY_SCALE)
    elements.append(Element("Cbeam", ("beam", GROUND), 1 / (lumped.stiffness * IMPEDANCE_SCALE)))
    elements += _reflection(lumped, coupling)
    # the tip moves by what the strip wants less what its compliance takes up: y = y1 - F1/K
    moved = _free_displacement(coupling, ratio, "d") | {"v(beam)": -FORCE_SCALE / lumped.stiffness}
    if tip == "clamped":
        still = Output("displacement", "m", (("v(beam)", 0.0),))
        return elements, [*outputs, still, Output("force", "N", (("v(beam)", FORCE_SCALE),))]
    tip_elements, force = _tip(actuator, lumped, load)
    elements += tip_elements
    return elements, [
        *outputs,
        Output("displacement", "m", tuple(moved.items())),
        Output("force", "N", tuple(force.items())),
    ]


def _reflection(lumped: Elements, coupling: Coupling) -> list[Element]:
    """Mechanical -> electrical: the current k s d(s) F1 through a copy of Zp is u1, set against the port.

    F1 is the voltage of node ``beam``. Of a nonlinear ion path the copy is that of small signals near 0 V.
    """
    return [
        *_filter(coupling, "beam", GROUND, "s"),
        *_filter_rate(coupling, "u1", "s", (GROUND, "copy"), lumped.bending_ratio * FORCE_SCALE),
        *_ion_path(lumped.port.linearised(), "copy", GROUND, "x")[0],
        Element("Eback", ("back", GROUND, "copy", GROUND), 1.0),
    ]


def sensor_netlist(actuator: Actuator, *, terminals: str = "open", band: tuple[float, float] = LADDER_BAND) -> Netlist:
    """The strip as a sensor: the point L_F is moved, EC (17) read backwards; ``terminals`` are "open" or "short".

    The drive is the displacement y of L_F in metres (1 V = 1 m). Outputs: voltage [V] at open terminals or current [A]
    into the strip's plus pin at shorted ones, charge [C], displacement [m], and the elastic force [N] of the strip at
    L_F, K (y1 - y); its own mass is the mover's affair. Raises InputError for an unknown word, or a strip without
    coupling.
    """
    if terminals not in ("open", "short"):
        raise InputError(f"terminals are '{terminals}'; choose open or short")
    lumped = lumped_elements(actuator, band)
    coupling = lumped.coupling
    if coupling is None:
        raise InputError(f"actuator '{actuator.name}' has no [coupling]; it cannot sense")
    node = _port_node(lumped.port)
    shorted = Element("Vshort", ("drive", GROUND), 0.0) if terminals == "short" else None
    elements, outputs = _port(lumped.port, "back", shorted)
    elements.insert(0, Element("Vmotion", ("motion", GROUND), 0.0))
    elements += _filter(coupling, node, "back", "d")
    # the force on a beam whose tip is held at y: F1 = K (y1 - y), a sum of sources in series
    elastic = {q: c * lumped.stiffness for q, c in _free_displacement(coupling, lumped.bending_ratio, "d").items()}
    elastic["v(motion)"] = -lumped.stiffness
    nodes = ["beam", *(f"beam{k}" for k in range(1, len(elastic))), GROUND]
    for k, (quantity, gain) in enumerate(elastic.items()):
        elements.append(Element(f"Ebeam{k}", (nodes[k], nodes[k + 1], quantity[2:-1], GROUND), gain / FORCE_SCALE))
    elements += _reflection(lumped, coupling)
    if terminals == "open":
        # without a source nothing ties the terminal down but the strip itself
        outputs.insert(0, Output("voltage", "V", ((f"v({node})", 1.0),)))
    outputs += [
        Output("displacement", "m", (("v(motion)", 1.0),)),
        Output("force", "N", (("v(beam)", FORCE_SCALE),)),
    ]
    title = f"ILG strip {actuator.name}, sensor, {terminals} terminals"
    return Netlist(title, tuple(_without_dangling(elements)), tuple(outputs), drive="Vmotion", comments=(SCALE_NOTE,))


def _without_dangling(elements: list[Element]) -> list[Element]:
    """Elements but for an Re that ends in the air at open terminals."""
    ends = [n for e in elements for n in e.nodes]
    return [e for e in elements if e.name != "Re" or ends.count("drive") > 1]


def _tip(actuator: Actuator, lumped: Elements, load: Load) -> tuple[list[Element], dict[str, float]]:
    """The tip's mesh from node ``beam`` to ground: mass, damping, gravity, load; and the force on the load."""
    g, m = actuator.geometry, actuator.material
    mass = lumped.mass + load.mass
    chain: list[tuple[str, float]] = [("Ltip", mass * IMPEDANCE_SCALE)]
    if lumped.damping:
        chain.append(("Rtip", lumped.damping * IMPEDANCE_SCALE))
    if actuator.mounting.orientation == "hanging":
        gravity = hanging_stiffness(m.density, g.width, g.thickness)
        if gravity > LARGEST_GRAVITY_RATIO * lumped.stiffness:
            raise InputError(
                f"mounting.orientation is 'hanging', but gravity is {gravity / lumped.stiffness:.3g} times as stiff as "
                f"the strip (allowed: {LARGEST_GRAVITY_RATIO:g}); a coupling fitted with gravity in it is 'weightless'"
            )
        chain.append(("Cgravity", 1 / (gravity * IMPEDANCE_SCALE)))
    # horizontal: the weight is a constant force; displacement counts from the sagged rest, so it drops out
    start_of_load = len(chain)
    if load.damping:
        chain.append(("Rload", load.damping * IMPEDANCE_SCALE))
    if load.stiffness:
        chain.append(("Cload", 1 / (load.stiffness * IMPEDANCE_SCALE)))
    nodes = ["beam", *(f"tip{k}" for k in range(1, len(chain))), GROUND]
    elements = [Element(name, (nodes[k], nodes[k + 1]), value) for k, (name, value) in enumerate(chain)]
    force: dict[str, float] = {"v(beam)": 0.0}
    if nodes[start_of_load] != GROUND:
        force[f"v({nodes[start_of_load]})"] = FORCE_SCALE
    if load.mass:  # the load's share of the voltage across the joint inductor
        share = FORCE_SCALE * load.mass / mass
        force["v(beam)"] += share
        if nodes[1] != GROUND:
            force[f"v({nodes[1]})"] = force.get(f"v({nodes[1]})", 0.0) - share
    return elements, force
