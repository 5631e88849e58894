"""A strip with electrodes as a subcircuit for any SPICE: a pin for each segment, curvatures and the free end inside.

The values are numbers: another size has other cells. Curvatures are voltages of inner nodes, and the centre line is
that of arcs of constant curvature, exact for large deflections:

    theta_k = theta_(k-1) + kappa_k dx_k,  x = sum of dx_k cos(theta) sin(a)/a,  y = sum of dx_k sin(theta) sin(a)/a

with theta in the middle of an arc and a = kappa_k dx_k/2.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from ..errors import InputError
from ..strip.actuator import Actuator
from ..strip.elements import lumped_elements
from ..strip.ladder import LADDER_BAND
from ..units import format_quantity
from .line import Line
from .line_response import chosen_layout
from .netlist import GROUND, Element, plain, series_sum
from .provenance import FIRST_STEP, INDUCTORS, LONGEST_STEP, TIGHT_OPTIONS, folded, provenance

#: Millimetres of a metre: x and y are in mm, as the tip of other subcircuits.
_MM = 1e3
#: Band [Hz] of use for which cells are chosen where a strip gives no number of them.
_BAND = (1e-4, 10.0)
#: sin(a)/a for a up to a quarter turn in half a cell, within 4e-8.
_SINC = "(1-{a}/6*(1-{a}/20*(1-{a}/42*(1-{a}/72*(1-{a}/110)))))"


def line_library(actuator: Actuator, name: str | None = None, beam: str | None = None) -> str:
    """Return a subcircuit with the pins p1 m1 p2 m2 ... of all segments, called ilg_strip_4 for four by default.

    Inner nodes k1, k2, ... are the free curvatures of the cells (1 V is 1 1/m), angle (1 V is 1 rad), x and y (1 V is
    1 mm) the free end's. Raises InputError for a name that SPICE would not take, a dynamic beam, and a strip whose
    electron path is no resistor.
    """
    sheets = actuator.electrodes
    assert sheets is not None
    name = f"ilg_strip_{max(sheets.segments(1), sheets.segments(2))}" if name is None else name
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
        raise InputError(f"subcircuit name '{plain(name[:40])}': use letters, digits and _, starting with a letter")
    if beam == "dynamic":
        raise InputError(
            "the subcircuit of a strip with [electrodes] gives free curvatures, without the beam's mass; leave beam "
            "out, or write a deck (.cir)"
        )
    layout, error = chosen_layout(actuator, _BAND)
    lumped = lumped_elements(actuator, LADDER_BAND)
    line = Line(actuator, layout, lumped)
    line.add_leads()
    line.add_sheets()
    line.add_cells("static")
    shape: list[str] = []
    if lumped.coupling is not None:
        shape = list(_shape(line))
    pins = sorted(line.pins, key=lambda pin: (int(pin[1:]), pin[0] == "m"))
    named = {line.node(f"{pin}_pin"): pin for pin in pins}
    if len(named) < len(pins):
        raise InputError("two segments are joined without resistance; give sheets or leads some")
    elements = [replace(e, nodes=tuple(named.get(n, n) for n in e.nodes)) for e in line.resolved()]
    header = [*provenance(f"subcircuit {name}: ILG strip {actuator.name}, line of {len(layout.free)} cells", actuator)]
    header += _use(name, pins, line, error, shaped=bool(shape))
    lines = [*(f"* {plain(text)}".rstrip() for text in header), f".subckt {name} {' '.join(pins)}"]
    lines += folded([e.line() for e in elements]) + folded(shape)
    return "\n".join([*lines, f".ends {name}", ""])


def _shape(line: Line) -> Iterator[str]:
    """Add the filters of all cells to a line; return the sources of curvatures, angle, x and y."""
    thickness = line.actuator.geometry.thickness
    free = [(j, cell) for j, cell in enumerate(line.layout.cells) if cell.free]
    last = {"angle": GROUND, "x": GROUND, "y": GROUND}
    for n, (j, cell) in enumerate(free, 1):
        terms = line.add_filter(j) if cell.active else {}
        gained = [(quantity, 6 / thickness**2 * c) for quantity, c in terms.items()]
        sources = series_sum(f"k{n}", gained) if gained else [Element(f"Vk{n}", (f"k{n}", GROUND), 0.0)]
        yield from (element.line() for element in sources)
        at = {key: key if n == len(free) else f"{key}{n}" for key in last}
        yield f"Eangle{n} {at['angle']} {last['angle']} k{n} 0 {cell.length!r}"
        before = "" if last["angle"] == GROUND else f"v({last['angle']})+"
        middle = f"({before}v({at['angle']}))/2"
        size = f"{_MM * cell.length!r}*{_SINC.format(a=f'({cell.length**2 / 4!r}*v(k{n})*v(k{n}))')}"
        for key, function in (("x", "cos"), ("y", "sin")):
            yield f"B{key}{n} {at[key]} {last[key]} v={size}*{function}({middle})"
        last = at


def _use(name: str, pins: list[str], line: Line, error: float, *, shaped: bool) -> list[str]:
    sheets = line.sheets
    cells = "; ".join(
        f"{side}: " + ", ".join(f"{1e3 * a:.6g}..{1e3 * b:.6g}" for a, b in sheets.spans(side, line.actuator.geometry))
        for side in (1, 2)
    )
    squares = " and ".join(format_quantity(x, "ohm", 6) for x in (sheets.sheet_resistance_1, sheets.sheet_resistance_2))
    lines = [
        f"use: X1 {' '.join(pins)} {name}",
        "",
        f"pk, mk: segment k of side 1 and of side 2, contact {sheets.contact}; nothing inside leans on ground",
        f"segments in mm from the clamp, side {cells}; sheets of {squares} per square",
        f"the size of the cells moves currents and displacement by at most {error:.1e}; values are of this size only",
    ]
    if shaped:
        lengths = ", ".join(f"{1e3 * cell.length:.6g}" for cell in line.layout.free)
        lines += [
            f"inside: k1 to k{len(line.layout.free)}, free curvature of the cells from the clamp on, 1 V = 1/m;",
            f"     their lengths in mm: {lengths}",
            "     angle, x, y of the free end, 1 V = 1 rad, 1 V = 1 mm: arcs, large deflections, no load and no mass;",
            "     x along the strip, y towards the anode: v(x1.angle), v(x1.x), v(x1.y), v(x1.k1)",
        ]
    return [
        *lines,
        *(INDUCTORS if shaped or line.port.inductance else ()),
        f"within 1e-6 of the maximum in ngspice: {TIGHT_OPTIONS.removeprefix('.options ')}",
        f"with .tran FIRST T 0 LONGEST uic, LONGEST = {LONGEST_STEP:g} T, FIRST = {FIRST_STEP:g} T (no error control)",
    ]
