"""The strip as a parametrised subcircuit for any SPICE: geometry and material in, element values computed inside.

The elements are those of `strip_netlist`; here every value is an expression of the strip's SI parameters, so that a
circuit can hold strips of several sizes from one file. Only what every SPICE reads is used: R, L, C, V, E, F, G, two
diodes for a sinh electron path, and one behavioural source for each capacitance that grows with voltage.

    expressions    + - * / and sqrt, in braces: ngspice, LTspice and gnucap share no sign for a power
    parameters     after ``params:``, which PSpice and Xyce want and the others take
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from ..errors import InputError, argument
from ..strip.actuator import CANTILEVER_EIGENVALUE, Actuator, Material, Quantity, quantities
from ..strip.couplings import RelaxingCoupling
from ..strip.elements import GRAVITY, Elements, gravity_ratio, growth_terms, lumped_elements
from ..strip.models.model import LibraryText
from ..units import format_quantity
from .library_coupling import derived_of_coupling, fastest, fastest_text, filter_values, gains, stored, summed
from .load import FORCE_SCALE, IMPEDANCE_SCALE, SCALE_NOTE
from .netlist import GROUND, Element, Netlist, Role, plain
from .operating_point import HOLD, with_operating_point, without_mass
from .provenance import FIRST_STEP, INDUCTORS, LONGEST_STEP, TIGHT_OPTIONS, folded, provenance
from .relaxing import transducer
from .strip import strip_netlist

#: kT/q [V] at 27 degrees Celsius with the constants that ngspice has (CODATA 2014).
THERMAL_VOLTAGE = 1.38064852e-23 * 300.15 / 1.6021766208e-19
#: Bias of the diodes of a sinh electron path, in units of its Vt.
_BIAS = 4
#: A beam without mass follows within this part of the time that d(s) takes.
_LAG = 1e-8
#: Largest r of the strip, and largest load over the strip's weight, up to which the series of gravity holds.
HEAVIER = 4
#: What `plain` would turn into underscores in units and symbols.
_UNSAFE = str.maketrans("", "", "'^")


def library_parameters(actuator: Actuator, beam: str | None = None) -> list[Quantity]:
    """Return the subcircuit's parameters with their defaults, named as in an actuator's TOML file and a fit's report.

    Fields that the strip leaves out, or that have no influence, are not parameters.
    """
    m = actuator.material
    used = {"length", "width", "thickness", "dc_resistivity", *m.model.ions.library_parameters}
    used |= {addition.parameter.name for addition in m.model.additions}
    if _has_electrodes(m):
        used |= {f"electrode_{what}_{k}" for what in ("resistivity", "thickness") for k in (1, 2)}
    if actuator.coupling is not None:
        used |= {"free_length", "load_position", "density", "beam_damping_ratio"}
        used.add("youngs_modulus" if m.bending_stiffness is None else "bending_stiffness")
        if actuator.beam(beam) == "static":
            used -= {"beam_damping_ratio"} | ({"density"} if actuator.mounting.orientation != "hanging" else set())
    found = [*quantities(actuator.geometry), *quantities(m)]
    for k, branch in enumerate(m.further_branches, 2):
        meaning = f"that of ionic branch {k}"
        found += [replace(q, name=f"{q.name}_{k}", meaning=meaning) for q in quantities(branch)]
    found = [q for q in found if q.name in used]
    if actuator.coupling is not None:
        own = [q for q in quantities(actuator.coupling) if q.name != "fractional_exponent"]  # that of a ladder is fixed
        found += [replace(q, name=f"coupling_{q.name}") for q in own]
        found.append(Quantity("load_stiffness", 0.0, "N/m", "spring from the tip to ground"))
        if actuator.mounting.orientation == "hanging":
            found.append(Quantity("load_mass", 0.0, "kg", "mass that hangs on the tip, for its weight only"))
    if m.emission_voltage is not None:
        meaning = "kT/q of your SPICE; the default is that of ngspice at 27 degrees Celsius"
        found.append(Quantity("thermal_voltage", THERMAL_VOLTAGE, "V", meaning))
    return found


def _has_electrodes(m: Material) -> bool:
    return bool(
        m.electrode_resistivity_1 * m.electrode_thickness_1 + m.electrode_resistivity_2 * m.electrode_thickness_2
    )


def library(actuator: Actuator, name: str = "ilg_strip", beam: str | None = None) -> str:
    """Return a subcircuit ``name plus minus tip``: electrical pins and, with a coupling, the tip's mechanical pin.

    Across ``tip`` and ground is the force, out of it flows the velocity: grounded it is free, open it is clamped, and
    a load is an inductor (mass), resistor (dashpot) or capacitor (spring) from ``tip`` to ground. Nothing leans on
    ground at the electrical pins. ``beam`` as for `strip_netlist`; a static one has no mass under a load either. Raises
    InputError for a name that SPICE would not take.
    """
    return parts(actuator, name, beam).text()


@dataclass(frozen=True)
class Parts:
    """What the text of a subcircuit is made of: ``header`` lines, pins, parameters, derived values, element lines."""

    name: str
    pins: tuple[str, ...]
    header: tuple[str, ...]
    parameters: tuple[Quantity, ...]
    derived: dict[str, str]
    body: tuple[str, ...]
    notes: tuple[str, ...]

    def text(self) -> str:
        """Return the subcircuit as it is handed out."""
        header = [*self.header, *_table(self.parameters), *self.notes]
        lines = [f"* {plain(line)}".rstrip() for line in header]
        lines += [f".subckt {self.name} {' '.join(self.pins)}", "+ params:"]
        lines += [f"+ {p.name}={p.value!r}" for p in self.parameters]
        lines += folded([f".param {key}={{{value}}}" for key, value in self.derived.items()], 150)
        return "\n".join([*lines, *folded(list(self.body)), f".ends {self.name}", ""])


def parts(actuator: Actuator, name: str, beam: str | None = None) -> Parts:
    """Return the parts of the text that `library` writes."""
    if actuator.sensing is not None:
        raise InputError(
            f"actuator '{actuator.name}' has a [sensing] of its own, and a subcircuit's tip is reciprocal; leave that "
            "section out, or take what sense computes"
        )
    beam = actuator.beam(beam)
    netlist, lumped = library_netlist(actuator, beam), lumped_elements(actuator)
    pins, elements = pinned(actuator, name, netlist)
    g = actuator.geometry
    text = actuator.material.model.ions.library(lumped.port, g.length * g.width / g.thickness)
    values = element_values(actuator, lumped, text, beam)
    header = [*provenance(f"subcircuit {name}: {netlist.title}", actuator), *_use(actuator, name, pins, beam)]
    return Parts(
        name,
        pins,
        tuple(header),
        tuple(library_parameters(actuator, beam)),
        derived_values(actuator, text, beam),
        tuple(line for element in elements for line in _lines(element, values)),
        tuple(_notes(actuator, lumped, beam)),
    )


def pinned(actuator: Actuator, name: str, netlist: Netlist) -> tuple[tuple[str, ...], tuple[Element, ...]]:
    """Return the pins of the subcircuit ``name`` and its elements, those of its ``netlist`` between them.

    Raises InputError for a name that SPICE would not take.
    """
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
        raise InputError(f"subcircuit name '{plain(name[:40])}': use letters, digits and _, starting with a letter")
    coupled = actuator.coupling is not None
    return ("plus", "minus", "tip")[: 2 + coupled], tuple(_at_the_pins(netlist.driven, coupled=coupled))


def library_netlist(actuator: Actuator, beam: str | None = None) -> Netlist:
    """Return the netlist that a subcircuit writes, its tip free."""
    given, k = strip_netlist(actuator, beam=beam), actuator.coupling
    if k is None:
        return given
    if actuator.beam(beam) == "dynamic":
        made = with_operating_point(given)
    else:
        undamped = replace(actuator, material=replace(actuator.material, beam_damping_ratio=0.0))
        lag = _LAG * fastest(k, lumped_elements(actuator).port)
        made = without_mass(with_operating_point(strip_netlist(undamped, beam="dynamic")), lag)
    # a load's spring, at the end of the tip's mesh
    *others, meter = made.elements
    end = [Element("Espring", ("swing", "sprung", "way", GROUND), 0.0), replace(meter, nodes=("sprung", GROUND))]
    return replace(made, title=given.title, elements=(*others, *end))


def derived_values(actuator: Actuator, ions: LibraryText, beam: str) -> dict[str, str]:
    """Name -> expression, of parameters and earlier names, of the values that elements share. EC (10)-(16)."""
    m, coupling = actuator.material, actuator.coupling
    derived = {"area": "length*width", "rdc": "dc_resistivity*thickness/area", **ions.derived}
    if _has_electrodes(m):
        first, second = (f"electrode_resistivity_{k}*electrode_thickness_{k}" for k in (1, 2))
        derived["electrodes"] = f"{first}+{second}"
    if m.emission_voltage is not None:
        derived["saturation"] = "emission_voltage/rdc"
    if coupling is None:
        return derived
    at = "free_length" if actuator.geometry.load_position is None else "load_position"
    cube = f"({at}*{at}*{at})"
    if m.bending_stiffness is None:
        derived["stiffness"] = f"youngs_modulus*width*thickness*thickness*thickness/(4*{cube})"
    else:
        derived["stiffness"] = f"3*bending_stiffness/{cube}"
    if beam == "dynamic":
        fourth = "free_length*free_length*free_length*free_length"
        derived["mass"] = f"{3 / CANTILEVER_EIGENVALUE**4!r}*{fourth}*density*width*thickness/{cube}"
        derived["damping"] = "2*beam_damping_ratio*sqrt(stiffness*mass)"
    else:
        derived["lag"] = f"{_LAG!r}*{fastest_text(coupling, ions)}"
    derived["bending"] = f"3*{at}*{at}/(thickness*thickness)"
    if actuator.mounting.orientation == "hanging":
        derived |= _gravity(actuator, at, cube)
    return derived | derived_of_coupling(coupling, ions)


def _gravity(actuator: Actuator, at: str, cube: str) -> dict[str, str]:
    """Return the stiffness of gravity as in `hanging_stiffness`, by series that hold for heavy strips and loads too."""
    derived = {
        "pull": f"{3 * GRAVITY!r}*free_length*free_length/(stiffness*{cube})",
        "hung": "pull*load_mass",
        "own": "pull*density*width*thickness*free_length",
        "part": f"{at}/free_length",
        "held": "(own*(1-part)+hung)*part*part",
        "grown": "own*part*part*part",
    }
    most = HEAVIER * 8 * gravity_ratio(actuator)
    for name, first, square, cubed in (("whole", 0, "hung", "own"), ("bent", 2, "held", "grown")):
        terms = ["1", "0"]
        for n in range(first + 2, first + len(growth_terms(first, most, most, 1e-8))):
            before = f"+{cubed}*{terms[-3]}" if len(terms) > 2 else ""
            terms.append(f"{name}{n}")
            derived[terms[-1]] = f"({square}*{terms[-3]}{before})/{n * (n - 1)}"
        derived[name] = "+ ".join(t for t in terms if t != "0")
    return derived | {"gravity": "stiffness*(whole-bent)/bent"}


def element_values(actuator: Actuator, lumped: Elements, ions: LibraryText, beam: str) -> dict[str, str]:
    """Return the expression of each element's value, by the element's name in `strip_netlist`."""
    port = lumped.port
    values = {"Rdc": "rdc"}
    if port.electrode_resistance:
        values["Re"] = "electrodes/area"
    if port.inductance:
        values["Lseries"] = "inductance"
    for suffix in ("", "x"):
        values |= {f"Rion{suffix}": ions.resistance, f"Cion{suffix}": ions.capacitance}
        for k, (r, c) in enumerate(ions.sections, 1):
            values |= {f"Rd{suffix}{k}": r, f"C{suffix}{k}": c}
    if actuator.coupling is None:
        return values
    wired = transducer(lumped)
    values |= filter_values(wired, ions)
    scale, unit = f"{IMPEDANCE_SCALE:.12g}", f"{1 / FORCE_SCALE:.12g}"
    terms = gains(wired)
    values |= summed("beam", f"{unit}*stiffness", terms) | {f"Ebeam{len(terms)}": f"-{scale}*stiffness"}
    values |= summed("held", f"{FORCE_SCALE!r}/({'+'.join(stored(ions))})", terms)
    values["Rheld"] = f"{HOLD:.12g}*({ions.resistance or ions.sections[0][0]})"
    values |= {"Htip": f"{scale}*damping", "Egravity": f"{scale}*gravity", "Espring": f"{scale}*load_stiffness"}
    if beam == "dynamic":
        return values | {"Ltip": f"{scale}*mass"}
    return values | {"Ltip": f"{scale}*stiffness*lag*lag", "Rlag": f"{scale}*stiffness*lag/2"}


def _at_the_pins(elements: tuple[Element, ...], *, coupled: bool) -> Iterator[Element]:
    """Return the strip's elements without its drive, between the pins plus and minus in place of drive and ground."""
    # role -> place of the node at minus among an element's nodes; a growing capacitance keeps its charge on its own
    leaning = {Role.ELECTRON_PATH: 1, Role.ION_PATH: 1, Role.SOURCE: 1}
    for element in elements:
        nodes = ["plus" if n == "drive" else n for n in element.nodes]
        place = 3 if element.name == "Ed" or element.name.startswith("Exd") else leaning.get(element.role, len(nodes))
        if nodes[place : place + 1] == [GROUND]:
            nodes[place] = "minus"
        if coupled and element is elements[-1]:
            nodes[1] = "tip"  # the last of the tip's mesh
        yield replace(element, nodes=tuple(nodes))


def _lines(element: Element, values: dict[str, str]) -> list[str]:
    """Return an element as SPICE writes it, its value in braces."""
    if element.law == "sinh":
        return _diodes(*element.nodes)
    if element.law == "bent":
        parts = (("odd", element.value), ("even", element.scale))
        odd, even = (f"{{coupling_{part}}}" if value else "0" for part, value in parts)
        return [element.line(f"v(xd)*(1+({odd})*abs(v(xd))+({even})*v(xd))")]
    if (law := element.charge_law) is not None:
        ions = values[f"C{element.name.removeprefix('Bq')}"]
        charge = element.nodes[2]
        if element.law != "charge" or element.scale < 0:
            return [element.line(law.expression(f"v({charge})", f"{{{ions}}}", f"{{{law.field}}}"))]
        root = f"sqrt(1+{{2*capacitance_slope/({ions})}}*abs(v({charge})))"
        return [element.line(f"{{2/({ions})}}*v({charge})/(1+{root})")]
    return [element.line(f"{{{values[element.name]}}}" if element.name in values else "")]


def _diodes(plus: str, minus: str) -> list[str]:
    """Return Is sinh(v/Vt) as two antiparallel diodes of Is/2, each with a bias that the bias of the other cancels.

    Below -3 N kT/q SPICE follows a cube in place of the exponential, up to 2e-3 Is beside it. The bias of 4 Vt keeps
    that to 7e-8 of the current: Is/2 exp(-4) exp((v + 4 Vt)/Vt), and the constant terms of the two diodes cancel.
    """
    return [
        f"Vforth forth {plus} {{{_BIAS}*emission_voltage}}",
        f"Dforth forth {minus} electrons",
        f"Vopposite opposite {minus} {{{_BIAS}*emission_voltage}}",
        f"Dopposite opposite {plus} electrons",
        f".model electrons D(is={{{math.exp(-_BIAS) / 2!r}*saturation}} n={{emission_voltage/thermal_voltage}})",
    ]


def _use(actuator: Actuator, name: str, pins: tuple[str, ...], beam: str) -> list[str]:
    lines = [
        f"use: X1 {' '.join(pins)} {name}",
        f"     X1 {' '.join(pins)} {name} width=10e-3 thickness=0.4e-3 for a strip of another size",
        "     (PSpice and Xyce want the word params: before the first parameter)",
        "",
        "plus, minus: volt and ampere; nothing inside leans on ground there",
    ]
    if actuator.coupling is None:
        return lines
    lines += [
        f"tip: {SCALE_NOTE.removeprefix('mechanical side: ')}",
        "     voltage to ground: force on the load; current out of the pin: its velocity (into 1 F: the way in mm)",
        "     to ground by Vtip tip 0 0: free; open: clamped; a load is an element from tip to ground:",
        "     mass m kg: L of 1000 m henry; dashpot c N s/m: R of 1000 c ohm; spring k N/m: load_stiffness=k, or, from",
        "     rest only, C of 0.001/k farad. The way is also the voltage of the node way inside, which .op, .dc and",
        "     .tran without uic know: v(x1.way), in gnucap v(X1.Rway)",
    ]
    if actuator.mounting.orientation == "hanging":
        lines.append("     what hangs on the tip has weight: load_mass, besides its L")
    if beam == "static":
        lines += [
            "static beam: d(s) is the tip's whole motion, and nothing acts back on plus and minus; under a load the",
            f"     beam has no mass of its own: for that write the file with {argument('beam', 'dynamic')}",
        ]
    return lines


def _table(parameters: Iterable[Quantity]) -> list[str]:
    rows = [
        f"  {p.name:<28} {format_quantity(p.value, '', 6):>12} {p.unit or '1':<9} {p.meaning}".translate(_UNSAFE)
        for p in parameters
    ]
    return ["", "parameters, all in SI units, with the values of this strip as defaults", *rows]


def _notes(actuator: Actuator, lumped: Elements, beam: str) -> list[str]:
    material, coupled = actuator.material, actuator.coupling is not None
    ladder = lumped.port.ladder
    lines = [""]
    if ladder is not None:
        low, high = (format_quantity(f, "Hz", 3) for f in ladder.band)
        scope = material.model.ions.library_note
        lines.append(
            f"ladder of {len(ladder.sections)} sections: within {ladder.error:.1e} from {low} to {high}; {scope}"
        )
    if isinstance(actuator.coupling, RelaxingCoupling) and (own := actuator.coupling.ladder(material.ladder_band())):
        lines.append(
            f"fractional relaxation: {len(own.sections)} relaxations, within {own.error:.1e} of it; exponent fixed"
        )
    if material.emission_voltage is not None:
        lines += [
            f"sinh electron path: two diodes of Is/2; a bias of {_BIAS} Vt, which cancels, keeps them from the cube",
            "     by which SPICE replaces their exponential in reverse. Temperature: 27 degrees Celsius: leave TEMP",
            "     and TNOM there, or set thermal_voltage",
        ]
    if coupled and actuator.mounting.orientation == "hanging":
        lines.append(
            f"gravity: for strips up to {HEAVIER} times as heavy for their EI/L0^3 (r up to "
            f"{HEAVIER * gravity_ratio(actuator):.3g}), and loads up to {HEAVIER} times this strip's weight"
        )
    if coupled and beam == "dynamic" and not material.beam_damping_ratio:
        lines.append("the beam rings for ever without damping: displacement within 1e-5 of the maximum only")
    gnucap = ["gnucap: short=1e-7, since its sources hide 10 uohm, chgtol=1e-7, method=gear and noincmode; within 1e-3"]
    if coupled:
        gnucap.append("     an open tip has no operating point there if K is above 1e-3 N/m")
    if lumped.port.charge_law is not None:
        gnucap = ["the law of the charge is a behavioural source B, which ngspice and LTspice read"]
    if actuator.coupling is not None and not actuator.coupling.linear:
        gnucap = ["the coupling's odd and even parts are a behavioural source B, which ngspice and LTspice read"]
    return [
        *lines,
        *(INDUCTORS if coupled or lumped.port.inductance else ()),
        "the transient starts from rest by .tran ... uic, without uic from the operating point",
        f"within 1e-6 of the maximum in ngspice: {TIGHT_OPTIONS.removeprefix('.options ')}",
        f"with .tran FIRST T 0 LONGEST uic, LONGEST = {LONGEST_STEP:g} T, FIRST = {FIRST_STEP:g} T (no error control)",
        *gnucap,
    ]
