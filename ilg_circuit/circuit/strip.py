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
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from ..errors import InputError, argument
from ..strip.actuator import Actuator, Coupling
from ..strip.elements import Elements, lumped_elements
from ..strip.ladder import LADDER_BAND
from ..strip.port import Port
from .netlist import GROUND, Element, Netlist, Output, Role, series_sum

#: Newtons per mechanical volt and metres per second per mechanical ampere.
FORCE_SCALE = 1e-6
VELOCITY_SCALE = 1e-3
IMPEDANCE_SCALE = VELOCITY_SCALE / FORCE_SCALE

SCALE_NOTE = "mechanical side: 1 V = 1 uN, 1 A = 1 mm/s, 1 C = 1 mm; positive towards the anode"


@dataclass(frozen=True)
class Load:
    """What hangs on the strip at L_F: mass [kg], spring [N/m] and dashpot [N s/m] to ground, each zero or more.

    On a hanging strip the mass has weight, which pulls at the free end.
    """

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


#: A load: an object, a text such as "mass=1g", or its parts by name, numbers in SI units or texts.
Hung: TypeAlias = "Load | str | Mapping[str, float | str] | None"


def load_of(given: Hung) -> Load | None:
    """Return the load that an object, its parts or a text such as ``mass=1g,stiffness=1mN/m,damping=1uN*s/m`` name.

    Raises InputError for others.
    """
    from ..units import si

    if isinstance(given, Load) or not given:
        return given if isinstance(given, Load) else None
    wrong = InputError(f"load '{str(given)[:60]}' is not understood; write mass=1g,stiffness=1mN/m,damping=1uN*s/m")
    if isinstance(given, str):
        parts: list[Any] = [part.partition("=")[::2] for part in given.split(",")]
    elif isinstance(given, Mapping):
        parts = list(given.items())
    else:
        raise wrong
    units = {"mass": "kg", "stiffness": "N/m", "damping": "N*s/m"}
    values: dict[str, float] = {}
    for name, value in parts:
        if not isinstance(name, str) or not isinstance(value, str | float | int):
            raise wrong
        key = name.strip()
        if key not in units or value == "" or key in values:
            raise wrong
        values[key] = si(value, units[key], f"load {key}")
    return Load(**values)


def electrical_netlist(
    dc_resistance: float,
    branches: tuple[tuple[float, float], ...],
    electrode_resistance: float = 0.0,
    title: str = "ILG strip, electrical port",
) -> Netlist:
    """Return the port alone: Re in series with Rdc parallel to R-C branches, Figure 4; outputs current and charge.

    ``branches`` are (resistance [ohm], capacitance [F]) pairs.
    """
    return port_netlist(Port(dc_resistance, tuple(branches), electrode_resistance), title)


def port_netlist(port: Port, title: str = "ILG strip, electrical port", rest: float = 0.0) -> Netlist:
    """Return the electrical port alone, of any model; outputs current [A] and charge [C] on the ion path.

    A nonlinear one starts at rest under ``rest`` [V].
    """
    rest = 0.0 if port.linear else rest
    elements, outputs = _port(port, GROUND, inner=port.inner_voltage(rest))
    return Netlist(title, tuple(elements), tuple(outputs), rest=rest)


def strip_netlist(
    actuator: Actuator,
    *,
    tip: str = "free",
    beam: str | None = None,
    load: Load | None = None,
    band: tuple[float, float] = LADDER_BAND,
    rest: float = 0.0,
) -> Netlist:
    """Return the whole strip; outputs: current [A], charge [C], displacement [m] and force [N] (at L_F, on the load).

    ``beam`` "dynamic" is the port EC (17) without simplification: beam compliance and mass, voltage reflected onto the
    electrical side. "static" is EC (26), (29): no mass, nothing reflected. None is the strip's own, `Actuator.beam`.
    ``tip`` "clamped" holds the point L_F. ``band`` [Hz] is a ladder's, if the strip gives none. A nonlinear
    strip starts at rest under ``rest`` [V]. Raises InputError for an unknown word, a load where there can be none, or a
    hanging strip that is nothing beside its weight.
    """
    load = load or Load()
    beam = actuator.beam(beam, loaded=bool(load))
    if tip not in ("free", "clamped"):
        raise InputError(f"tip is '{tip}'; choose free or clamped")
    if beam not in ("dynamic", "static"):
        raise InputError(f"beam is '{beam}'; choose dynamic or static")
    if load and (tip == "clamped" or beam == "static"):
        raise InputError(
            f"a load moves with the tip: it needs {argument('tip', 'free')} and {argument('beam', 'dynamic')}"
        )
    lumped = lumped_elements(actuator, band, load.mass)
    title = f"ILG strip {actuator.name}, {beam} beam, {tip} tip"
    coupling, port = lumped.coupling, lumped.port
    if coupling is None:
        if load:
            raise InputError(f"actuator '{actuator.name}' has no [coupling]; a load needs one")
        return port_netlist(port, title, rest)
    rest = 0.0 if port.linear else rest
    if rest and load:
        raise InputError(f"a strip that starts at rest under {rest:g} V has no load; leave one of them out")
    inner = port.inner_voltage(rest)
    back = GROUND if beam == "static" else "back"
    elements, outputs = _port(port, back, inner=inner)
    elements += _filter(coupling, _port_node(port), back, "d", inner)
    displacement = _free_displacement(lumped, coupling)
    force = dict.fromkeys(displacement, 0.0)
    if beam == "dynamic":
        # electrical -> mechanical: v1 = k s d(s) v_p flows into the beam's compliance
        velocity = lumped.bending_ratio / VELOCITY_SCALE
        elements += _filter_rate(coupling, "v1", "d", (GROUND, "beam"), velocity, Role.FREE_VELOCITY)
        elements.append(Element("Cbeam", ("beam", GROUND), 1 / (lumped.stiffness * IMPEDANCE_SCALE), role=Role.BEAM))
        elements += _reflection(lumped, coupling)
        # the tip moves by what the strip wants less what its compliance takes up: y = y1 - F1/K
        displacement["v(beam)"] = -FORCE_SCALE / lumped.stiffness
        force = {"v(beam)": FORCE_SCALE}
        if tip == "free":
            meshed, force = _tip(lumped, load)
            elements += meshed
        else:
            displacement = {"v(beam)": 0.0}
    elif tip == "clamped":
        force = {q: c * lumped.stiffness for q, c in displacement.items()}
        displacement = dict.fromkeys(displacement, 0.0)
    else:
        displacement = {q: c * lumped.hanging_share for q, c in displacement.items()}
    outputs += _motion(displacement, force)
    return Netlist(title, tuple(elements), tuple(outputs), comments=(SCALE_NOTE,), rest=rest)


_DRIVE = Element("Vdrive", ("drive", GROUND), 0.0, role=Role.SOURCE)


def _port(
    port: Port, end: str, source: Element | None = _DRIVE, inner: float = 0.0
) -> tuple[list[Element], list[Output]]:
    """Return a voltage source (or none), the leads, the electron path and the ion path from the port's node to ``end``.

    The ion path starts at rest under ``inner`` [V].
    """
    node = _port_node(port)
    leads = [("Lseries", port.inductance), ("Re", port.electrode_resistance)]
    leads = [(name, value) for name, value in leads if value]
    ends = ["drive", *(f"lead{k}" for k in range(1, len(leads))), node]
    elements = [source] if source else []
    elements += [Element(n, (ends[k], ends[k + 1]), v, role=Role.LEAD) for k, (n, v) in enumerate(leads)]
    if port.emission_voltage is None:
        elements.append(Element("Rdc", (node, GROUND), port.dc_resistance, role=Role.ELECTRON_PATH))
    else:
        current, scale = port.saturation_current, port.emission_voltage
        elements.append(Element("Bdc", (node, GROUND), current, law="sinh", scale=scale, role=Role.ELECTRON_PATH))
    ions, charge = _ion_path(port, node, end, "", inner=inner)
    outputs = [
        *([Output("current", "A", ((f"i({source.name})", -1.0),))] if source else []),
        Output("charge", "C", tuple(charge.items())),
    ]
    return elements + ions, outputs


def _port_node(port: Port) -> str:
    return "port" if port.electrode_resistance or port.inductance else "drive"


def _ion_path(
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
        if port.capacitance_slope:
            elements += _growing_capacitor(c, port.capacitance_slope, node, end, f"{suffix}{k}", role, inner)
            charge[f"v(q{suffix}{k})"] = 1.0
        else:
            add(f"C{suffix}{k}", node, end, c, inner)
            _add_charge(charge, c, node, end)
    return elements, charge


def _growing_capacitor(
    capacitance: float, slope: float, node: str, end: str, name: str, role: Role, inner: float
) -> list[Element]:
    """Return a capacitance that grows with voltage: its charge is the voltage on 1 F that its own current feeds."""
    charge, sense = f"q{name}", f"sense{name}"
    start = capacitance * (inner + slope * inner * abs(inner) / 2)
    return [
        Element(f"Bq{name}", (node, sense, charge), capacitance, law="charge", scale=slope, role=role),
        Element(f"Vq{name}", (sense, end), 0.0, role=Role.SOURCE),
        Element(f"Fq{name}", (GROUND, charge), 1.0, control=f"Vq{name}", role=Role.CHARGE_METER),
        Element(f"Cq{name}", (charge, GROUND), 1.0, role=Role.CHARGE_METER, start=start),
    ]


def _add_charge(charge: dict[str, float], capacitance: float, node: str, end: str) -> None:
    charge[f"v({node})"] = capacitance
    if end != GROUND:
        charge[f"v({end})"] = charge.get(f"v({end})", 0.0) - capacitance


def _filter(coupling: Coupling, plus: str, minus: str, name: str, inner: float = 0.0) -> list[Element]:
    """Return the series R-L-C of d(s) behind a source that does not load (plus, minus); nodes name1, name2, name3."""
    wn = coupling.natural_frequency
    role = Role.COUPLING_FILTER
    return [
        Element(f"E{name}", (f"{name}1", GROUND, plus, minus), 1.0, role=role),
        Element(f"R{name}", (f"{name}1", f"{name}2"), 2 * coupling.damping_ratio / wn, role=role),
        Element(f"L{name}", (f"{name}2", f"{name}3"), 1 / wn**2, role=role),
        Element(f"C{name}", (f"{name}3", GROUND), 1.0, role=role, start=inner),
    ]


def _filter_rate(
    coupling: Coupling, name: str, filter_name: str, out: tuple[str, str], gain: float, role: Role
) -> list[Element]:
    """Return the two current sources whose sum is gain s d(s) v, from the filter's inductor voltage and its current."""
    wn, d0 = coupling.natural_frequency, coupling.static
    resistor = 2 * coupling.damping_ratio / wn
    n1, n2, n3 = (f"{filter_name}{k}" for k in (1, 2, 3))
    return [
        Element(f"G{name}a", (*out, n2, n3), gain * d0 * wn**2 / coupling.zero, role=role),
        Element(f"G{name}b", (*out, n1, n2), gain * d0 / resistor, role=role),
    ]


def _free_displacement(lumped: Elements, coupling: Coupling) -> dict[str, float]:
    """Return y1 = k d(s) v as coefficients of the filter's node voltages: k d0 [v_C + (v1 - v2)/(R Zd C)]."""
    static = lumped.bending_ratio * coupling.static
    through = static / (2 * coupling.damping_ratio / coupling.natural_frequency * coupling.zero)
    return {"v(d3)": static, "v(d1)": through, "v(d2)": -through}


def _motion(displacement: dict[str, float], force: dict[str, float]) -> list[Output]:
    """Return the mechanical outputs, from their terms."""
    return [Output("displacement", "m", tuple(displacement.items())), Output("force", "N", tuple(force.items()))]


def _reflection(lumped: Elements, coupling: Coupling) -> list[Element]:
    """Return the reflection on the electrical side.

    The current k s d(s) F1 through a copy of Zp makes the voltage u1, which is in series with the port. F1 is the
    voltage of node ``beam``. For a nonlinear ion path the copy is linearised near 0 V.
    """
    role, gain = Role.REFLECTION, lumped.bending_ratio * FORCE_SCALE
    return [
        *_filter(coupling, "beam", GROUND, "s"),
        *_filter_rate(coupling, "u1", "s", (GROUND, "copy"), gain, role),
        *_ion_path(lumped.port.linearised(), "copy", GROUND, "x", role)[0],
        Element("Eback", ("back", GROUND, "copy", GROUND), 1.0, role=Role.REFLECTED_VOLTAGE),
    ]


def sensor_netlist(actuator: Actuator, *, terminals: str = "open", band: tuple[float, float] = LADDER_BAND) -> Netlist:
    """Return the strip as a sensor: the point L_F is moved, EC (17) inverted; ``terminals`` are "open" or "short".

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
    shorted = Element("Vshort", ("drive", GROUND), 0.0, role=Role.SOURCE) if terminals == "short" else None
    elements, outputs = _port(lumped.port, "back", shorted)
    elements.insert(0, Element("Vmotion", ("motion", GROUND), 0.0, role=Role.SOURCE))
    elements += _filter(coupling, node, "back", "d")
    # the force on a beam whose tip is held at y: F1 = K (y1 - y), a sum of sources in series
    elastic = {q: c * lumped.stiffness for q, c in _free_displacement(lumped, coupling).items()}
    elastic["v(motion)"] = -lumped.stiffness
    elements += series_sum("beam", [(quantity, gain / FORCE_SCALE) for quantity, gain in elastic.items()])
    elements += _reflection(lumped, coupling)
    if terminals == "open":
        # without a source nothing ties the terminal down but the strip itself
        outputs.insert(0, Output("voltage", "V", ((f"v({node})", 1.0),)))
    outputs += _motion({"v(motion)": 1.0}, {"v(beam)": FORCE_SCALE})
    title = f"ILG strip {actuator.name}, sensor, {terminals} terminals"
    return Netlist(title, tuple(_without_dangling(elements)), tuple(outputs), drive="Vmotion", comments=(SCALE_NOTE,))


def _without_dangling(elements: list[Element]) -> list[Element]:
    """Return the elements without leads that end unconnected at open terminals."""
    ends = [n for e in elements if e.role is not Role.LEAD for n in e.nodes]
    return [e for e in elements if e.role is not Role.LEAD or "drive" in ends]


def _tip(lumped: Elements, load: Load) -> tuple[list[Element], dict[str, float]]:
    """Return the tip's mesh from node ``beam`` to ground: mass, damping, gravity, load; and the force on the load."""
    mass = lumped.mass + load.mass
    chain = [("Ltip", mass * IMPEDANCE_SCALE, Role.TIP)]
    if lumped.damping:
        chain.append(("Rtip", lumped.damping * IMPEDANCE_SCALE, Role.TIP))
    if lumped.gravity:
        chain.append(("Cgravity", 1 / (lumped.gravity * IMPEDANCE_SCALE), Role.TIP))
    # horizontal: the weight is a constant force; displacement counts from the sagged rest, so it drops out
    start_of_load = len(chain)
    if load.damping:
        chain.append(("Rload", load.damping * IMPEDANCE_SCALE, Role.LOAD))
    if load.stiffness:
        chain.append(("Cload", 1 / (load.stiffness * IMPEDANCE_SCALE), Role.LOAD))
    nodes = ["beam", *(f"tip{k}" for k in range(1, len(chain))), GROUND]
    elements = [Element(name, (nodes[k], nodes[k + 1]), x, role=role) for k, (name, x, role) in enumerate(chain)]
    force: dict[str, float] = {"v(beam)": 0.0}
    if nodes[start_of_load] != GROUND:
        force[f"v({nodes[start_of_load]})"] = FORCE_SCALE
    if load.mass:  # the load's share of the voltage across the joint inductor
        share = FORCE_SCALE * load.mass / mass
        force["v(beam)"] += share
        if nodes[1] != GROUND:
            force[f"v({nodes[1]})"] = force.get(f"v({nodes[1]})", 0.0) - share
    return elements, force
