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
from collections.abc import Iterator
from dataclasses import replace

from ..errors import InputError
from ..strip.actuator import CANTILEVER_EIGENVALUE, Actuator, Material, Quantity, quantities
from ..strip.elements import GRAVITY, Elements, lumped_elements
from ..strip.models.model import LibraryText
from ..units import format_quantity
from .netlist import GROUND, Element, Role, plain
from .provenance import FIRST_STEP, LONGEST_STEP, TIGHT_OPTIONS, folded, provenance
from .strip import FORCE_SCALE, IMPEDANCE_SCALE, SCALE_NOTE, VELOCITY_SCALE, Load, strip_netlist

#: kT/q [V] at 27 degrees Celsius with the constants that ngspice has (CODATA 2014).
THERMAL_VOLTAGE = 1.38064852e-23 * 300.15 / 1.6021766208e-19
#: Bias of the diodes of a sinh electron path, in units of its Vt.
_BIAS = 4
#: What `plain` would turn into underscores in units and symbols.
_UNSAFE = str.maketrans("", "", "'^")


def library_parameters(actuator: Actuator) -> list[Quantity]:
    """What the subcircuit can be told, with the defaults: named as in an actuator's TOML file, and a fit's report.

    A field that the strip leaves out, or that has no influence on it, is no parameter.
    """
    m = actuator.material
    used = {"length", "width", "thickness", "dc_resistivity", *m.model.ions.library_parameters}
    used |= {addition.parameter.name for addition in m.model.additions}
    if _has_electrodes(m):
        used |= {f"electrode_{what}_{k}" for what in ("resistivity", "thickness") for k in (1, 2)}
    if actuator.coupling is not None:
        used |= {"free_length", "load_position", "density", "beam_damping_ratio"}
        used.add("youngs_modulus" if m.bending_stiffness is None else "bending_stiffness")
    found = [*quantities(actuator.geometry), *quantities(m)]
    for k, branch in enumerate(m.further_branches, 2):
        meaning = f"that of ionic branch {k}"
        found += [replace(q, name=f"{q.name}_{k}", meaning=meaning) for q in quantities(branch)]
    found = [q for q in found if q.name in used]
    if actuator.coupling is not None:
        found += [replace(q, name=f"coupling_{q.name}") for q in quantities(actuator.coupling)]
    if m.emission_voltage is not None:
        meaning = "kT/q of your SPICE; the default is that of ngspice at 27 degrees Celsius"
        found.append(Quantity("thermal_voltage", THERMAL_VOLTAGE, "V", meaning))
    return found


def _has_electrodes(m: Material) -> bool:
    return bool(
        m.electrode_resistivity_1 * m.electrode_thickness_1 + m.electrode_resistivity_2 * m.electrode_thickness_2
    )


def library(actuator: Actuator, name: str = "ilg_strip") -> str:
    """A subcircuit ``name plus minus tip``: electrical pins, and the tip's mechanical pin where there is a coupling.

    Across ``tip`` and ground is the force, out of it flows the velocity: grounded it is free, open it is clamped, and
    a load is an inductor (mass), resistor (dashpot) or capacitor (spring) from ``tip`` to ground. Nothing leans on
    ground at the electrical pins. Raises InputError for a name that SPICE would not take.
    """
    netlist = strip_netlist(actuator, load=Load())
    lumped = lumped_elements(actuator)
    pins, elements = pinned(actuator, name)
    parameters = library_parameters(actuator)
    g = actuator.geometry
    text = actuator.material.model.ions.library(lumped.port, g.length * g.width / g.thickness)
    values = element_values(actuator, lumped, text)
    body = [line for element in elements for line in _lines(element, values)]
    lines = [f"* {plain(line)}".rstrip() for line in _header(actuator, lumped, name, " ".join(pins), netlist.title)]
    lines += [f".subckt {name} {' '.join(pins)}", "+ params:", *(f"+ {p.name}={p.value!r}" for p in parameters)]
    lines += [f".param {key}={{{value}}}" for key, value in derived_values(actuator, text).items()]
    return "\n".join([*lines, *folded(body), f".ends {name}", ""])


def pinned(actuator: Actuator, name: str) -> tuple[tuple[str, ...], tuple[Element, ...]]:
    """Return the pins of the subcircuit ``name`` and its elements, see `library`.

    Raises InputError for a name that SPICE would not take.
    """
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
        raise InputError(f"subcircuit name '{plain(name[:40])}': use letters, digits and _, starting with a letter")
    coupled = actuator.coupling is not None
    elements = strip_netlist(actuator, load=Load()).driven
    return ("plus", "minus", "tip")[: 2 + coupled], tuple(_at_the_pins(elements, coupled=coupled))


def derived_values(actuator: Actuator, ions: LibraryText) -> dict[str, str]:
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
    fourth = "free_length*free_length*free_length*free_length"
    derived["mass"] = f"{3 / CANTILEVER_EIGENVALUE**4!r}*{fourth}*density*width*thickness/{cube}"
    derived["damping"] = "2*beam_damping_ratio*sqrt(stiffness*mass)"
    derived["bending"] = f"3*{at}*{at}/(thickness*thickness)"
    derived["lfilter"] = "1/(coupling_natural_frequency*coupling_natural_frequency)"
    derived["rfilter"] = "2*coupling_damping_ratio/coupling_natural_frequency"
    # of s d(s) v: from the filter's inductor voltage (d0 wn^2/Zd is Kd), and from its current
    derived["rate_a"] = "bending*coupling_gain"
    derived["rate_b"] = "bending*coupling_gain*coupling_zero*lfilter/rfilter"
    return derived


def element_values(actuator: Actuator, lumped: Elements, ions: LibraryText) -> dict[str, str]:
    """Element name of `strip_netlist` -> expression of its value."""
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
    for name in "ds":
        values |= {f"R{name}": "rfilter", f"L{name}": "lfilter"}
    for source, scale in (("v1", 1 / VELOCITY_SCALE), ("u1", FORCE_SCALE)):
        values |= {f"G{source}a": f"{scale!r}*rate_a", f"G{source}b": f"{scale!r}*rate_b"}
    values["Cbeam"] = f"1/({IMPEDANCE_SCALE:.12g}*stiffness)"
    values["Ltip"] = f"{IMPEDANCE_SCALE:.12g}*mass"
    values["Rtip"] = f"{IMPEDANCE_SCALE:.12g}*damping"
    if actuator.mounting.orientation == "hanging":
        values["Cgravity"] = f"1/({3 / 8 * GRAVITY * IMPEDANCE_SCALE:.15g}*density*width*thickness)"
    return values


def _at_the_pins(elements: tuple[Element, ...], *, coupled: bool) -> Iterator[Element]:
    """The strip's elements without its drive, between the pins plus and minus in place of drive and ground."""
    leaning = {Role.ELECTRON_PATH, Role.REFLECTED_VOLTAGE}
    if not coupled:  # the ion path ends at minus; a growing capacitance keeps its charge on a node of its own
        leaning |= {Role.ION_PATH, Role.SOURCE}
    for element in elements:
        nodes = ["plus" if n == "drive" else n for n in element.nodes]
        if nodes[1] == GROUND and element.role in leaning:
            nodes[1] = "minus"
        if coupled and element is elements[-1]:
            nodes[1] = "tip"  # the last of the tip's mesh
        yield replace(element, nodes=tuple(nodes))


def _lines(element: Element, values: dict[str, str]) -> list[str]:
    """An element as SPICE writes it, its value in braces."""
    if element.law == "sinh":
        return _diodes(*element.nodes)
    if element.law == "charge":
        ions = values[f"C{element.name.removeprefix('Bq')}"]
        charge = element.nodes[2]
        root = f"sqrt(1+{{2*capacitance_slope/({ions})}}*abs(v({charge})))"
        return [element.line(f"{{2/({ions})}}*v({charge})/(1+{root})")]
    return [element.line(f"{{{values[element.name]}}}" if element.name in values else "")]


def _diodes(plus: str, minus: str) -> list[str]:
    """Is sinh(v/Vt) by two antiparallel diodes of Is/2, each behind a bias that the other's takes out again.

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


def _header(actuator: Actuator, lumped: Elements, name: str, pins: str, title: str) -> list[str]:
    m, coupled = actuator.material, actuator.coupling is not None
    lines = [
        *provenance(f"subcircuit {name}: {title}", actuator),
        f"use: X1 {pins} {name}",
        f"     X1 {pins} {name} width=10e-3 thickness=0.4e-3 for a strip of another size",
        "     (PSpice and Xyce want the word params: before the first parameter)",
        "",
        "plus, minus: volt and ampere; nothing inside leans on ground there",
    ]
    if coupled:
        lines += [
            f"tip: {SCALE_NOTE.removeprefix('mechanical side: ')}",
            "     voltage to ground: force on the load; current out of the pin: its velocity (into 1 F: the way in mm)",
            "     to ground by Vtip tip 0 0: free; open: clamped; a load is an element from tip to ground:",
            "     mass m kg: L of 1000 m henry; dashpot c N s/m: R of 1000 c ohm; spring k N/m: C of 0.001/k farad",
        ]
        if actuator.usual_beam() == "static":
            lines += [
                "d(s) was fitted to the tip's whole motion, beam included: for that motion set density to 1e-3 of this",
                "     strip's, so that the beam's inertia does not count twice",
            ]
    table = ["", "parameters, all in SI units, with the values of this strip as defaults"]
    table += [
        f"  {p.name:<28} {format_quantity(p.value, '', 6):>12} {p.unit or '1':<9} {p.meaning}".translate(_UNSAFE)
        for p in library_parameters(actuator)
    ]
    return [*lines, *table, *_notes(m, lumped, coupled=coupled)]


def _notes(material: Material, lumped: Elements, *, coupled: bool) -> list[str]:
    ladder = lumped.port.ladder
    lines = [""]
    if ladder is not None:
        low, high = (format_quantity(f, "Hz", 3) for f in ladder.band)
        scope = material.model.ions.library_note
        lines.append(
            f"ladder of {len(ladder.sections)} sections: within {ladder.error:.1e} from {low} to {high}; {scope}"
        )
    if material.emission_voltage is not None:
        lines += [
            f"sinh electron path: two diodes of Is/2; a bias of {_BIAS} Vt, which cancels, keeps them from the cube",
            "     by which SPICE replaces their exponential in reverse. Temperature: 27 degrees Celsius: leave TEMP",
            "     and TNOM there, or set thermal_voltage",
        ]
    if coupled and not material.beam_damping_ratio:
        lines.append("the beam rings for ever without damping: displacement within 1e-5 of the maximum only")
    gnucap = "gnucap: short=1e-7, since its sources hide 10 uohm, and method=gear; within 1e-3"
    if material.capacitance_slope:
        gnucap = "the capacitance that grows is a behavioural source B, which ngspice and LTspice read"
    return [
        *lines,
        "the transient starts from rest: .tran ... uic",
        f"within 1e-6 of the maximum in ngspice: {TIGHT_OPTIONS.removeprefix('.options ')}",
        f"with .tran FIRST T 0 LONGEST uic, LONGEST = {LONGEST_STEP:g} T, FIRST = {FIRST_STEP:g} T (no error control)",
        gnucap,
    ]
