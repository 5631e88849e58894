"""A complete SPICE deck, which plain ``ngspice -b`` runs as it is."""

from __future__ import annotations

import re
from dataclasses import replace

from ..drive import Drive, each
from ..strip.actuator import Actuator
from .netlist import GROUND, Element, Netlist, plain, series_sum
from .operating_point import with_operating_point
from .provenance import FIRST_STEP, INDUCTORS, LONGEST_STEP, TIGHT_OPTIONS, folded, provenance


def deck(netlist: Netlist, drive: Drive, duration: float, actuator: Actuator, samples: int = 601) -> str:
    """Return a complete deck: the strip, its drive over ``duration`` [s], a transient from rest, and a printed table.

    The outputs are nodes of their own, in SI units (1 V is one ampere, coulomb, metre, newton). ``samples`` is the
    least number of rows; ngspice prints every time point.
    """
    netlist = with_operating_point(netlist)
    # ngspice prints the first fifteen letters of a name
    short = {"voltage": "u", "current": "i", "curvature": "k"}
    named = [
        replace(o, name=re.sub(r"^(voltage|current|curvature)_(?=\d+$)", lambda found: short[found[1]], o.name))
        for o in netlist.outputs
    ]
    shown = tuple(o for o in named if any(c for _, c in o.terms) and not o.name.startswith("delivered_"))
    step = duration / (samples - 1)
    longest = min(step, duration * LONGEST_STEP)
    if drive.angular_frequency():
        longest = min(longest, 0.01 / drive.angular_frequency())
    nodes = " ".join(f"v(out_{o.name})" for o in shown)
    units = ", ".join(f"out_{o.name} [{o.unit}]" for o in shown)
    header = [*provenance(netlist.title, actuator), *netlist.comments, f"drive: {drive.text}"]
    header.append(f"outputs in SI units as voltages: {units}")
    header.append("run with: ngspice -b FILE")
    if any(e.kind == "L" for e in netlist.elements):
        header += INDUCTORS
    body = [e.line() for e in netlist.driven]
    for k, (source, part) in enumerate(zip(netlist.sources, each(drive), strict=True)):
        body.append(source.line(f"{'' if k else 'AC 1 '}{part.spice(duration)}"))
    body += [e.line() for o in shown for e in series_sum(f"out_{o.name}", [(q, c) for q, c in o.terms if c])]
    printed = f"{' '.join(f'v({source.nodes[0]})' for source in netlist.sources)} {nodes}"
    lines = [
        *(f"* {plain(line)}" for line in header),
        *folded(body),
        *transient_lines(duration, step, longest, printed),
    ]
    return "\n".join([*lines, ".end", ""])


def transient_lines(
    duration: float,
    step: float,
    longest: float,
    *printed: str,
    first: float | None = None,
    options: str = TIGHT_OPTIONS,
) -> list[str]:
    """Return the lines of a transient from rest over ``duration`` [s], which prints tables of quantities.

    Its rows are ``step`` [s] apart at most, its steps no longer than ``longest`` [s], the ``first`` ones shorter than
    that many seconds (default: a part of the run); ``options`` are the line of tolerances.
    """
    start = Element("Vstart", ("start", GROUND), 0.0)
    return [
        "* a corner in a source makes the first step short: its error is the only one that ngspice does not check",
        start.line(f"PWL(0 0 {first or duration * FIRST_STEP:.2g} 0 {2 * duration!r} 0)"),
        f"{options} numdgt=9",
        # gnucap does what it reads in turn: print comes before the run
        *(f".print tran {quantities}" for quantities in printed),
        f".tran {step!r} {duration!r} 0 {longest:.3g} uic",
    ]
