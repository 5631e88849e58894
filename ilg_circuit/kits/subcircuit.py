"""The library of a kit: the strip's subcircuit with a pin for the position, a switch for the beam, and tolerances."""

from __future__ import annotations

import re
from dataclasses import replace

from ..circuit.library import Parts, parts
from ..errors import InputError
from ..strip.actuator import Actuator, Quantity
from .tolerances import Tolerances

#: Name of the subcircuit, which has one more pin than the `ilg_strip` of a library alone.
NAME = "ilg_actuator"
PINS = ("plus", "minus", "tip", "position")
#: What stands beside the tip's mass under a dynamic beam has so many times sqrt(K m).
_ASIDE = 1e9


def kit_library(actuator: Actuator, tolerance: Tolerances | None, beam: str | None = None) -> str:
    """Return the text of the subcircuit ``ilg_actuator plus minus tip position``.

    It is that of `ilg_circuit.circuit.library.library` and: ``position`` is the way of the tip, 1 V a millimetre, from
    a source that nothing loads; with ``static_beam=1`` the beam has no mass and nothing is reflected onto the port;
    ``z1`` and so on move what was fitted within its ``tolerance``. ``beam`` is what the switch says by default, and
    by default that of the strip. Raises InputError for a strip without coupling.
    """
    if actuator.coupling is None:
        raise InputError(
            f"actuator '{actuator.name}' has no [coupling], so a kit has no position to give: fit a displacement too, "
            "or write its circuit alone by netlist --out strip.lib"
        )
    dynamic, static = (parts(actuator, NAME, beam) for beam in ("dynamic", "static"))
    switch = 1.0 if actuator.beam(beam) == "static" else 0.0
    added = [Quantity("static_beam", switch, "1", "1: d(s) is the whole motion; 0: the beam has mass and acts back")]
    lines = [*_switched(dynamic, static), "Eposition position 0 way 0 1.0"]
    made = replace(
        dynamic,
        pins=PINS,
        header=tuple(_header(dynamic)),
        derived=dynamic.derived | {"lag": static.derived["lag"]},
        body=tuple(lines),
    )
    if tolerance is not None:
        meaning = "standard normal number of the tolerances at the end of this head; 0: as fitted"
        added += [Quantity(f"z{k}", 0.0, "1", meaning) for k in _numbers(tolerance)]
        made = _tolerant(made, tolerance)
    return replace(made, parameters=(*made.parameters, *added)).text()


def _numbers(tolerance: Tolerances) -> range:
    return range(1, len(tolerance.names) + 1)


def _header(dynamic: Parts) -> list[str]:
    """Return the head of a library with the further pin."""
    title, *lines = dynamic.header
    three = " ".join(dynamic.pins)
    lines = [line.replace(f" {three} {NAME}", f" {' '.join(PINS)} {NAME}") for line in lines]
    return [
        re.sub(", dynamic beam, free tip$", "", title),
        *lines,
        "position: the way of the tip at L_F, 1 V = 1 mm to ground, an ideal source: .op and .ac know it too",
    ]


def _switched(dynamic: Parts, static: Parts) -> list[str]:
    """Return the elements of a dynamic beam, of which ``static_beam`` makes a static one."""
    other = {line.split()[0]: line for line in static.body}
    lines = []
    for line in dynamic.body:
        name, *rest = line.split()
        if name == "Ltip":
            nodes = " ".join(rest[:2])
            mass, massless = (_value(text) for text in (line, other[name]))
            lines.append(line.replace(f"{{{mass}}}", f"{{(1-static_beam)*{mass}+static_beam*{massless}}}"))
            damped, unit = _value(other["Rlag"]), massless.partition("*")[0]
            aside = f"(1-static_beam)*{_ASIDE!r}*{unit}*sqrt(stiffness*mass)"
            lines.append(f"Rlag {nodes} {{static_beam*{damped}+{aside}}}")
        elif name == "Htip":
            lines.append(line.replace("{", "{(1-static_beam)*"))
        elif name == "Eback":
            lines.append(" ".join([name, *rest[:-1], "{1-static_beam}"]))
        else:
            lines.append(line)
    return lines


def _value(line: str) -> str:
    """Return the expression in braces of an element's line."""
    return line[line.index("{") + 1 : line.index("}")]


def _tolerant(made: Parts, tolerance: Tolerances) -> Parts:
    """Return a subcircuit in which factors of the numbers z stand beside the parameters that they move."""
    before = dict(made.derived)
    derived: dict[str, str] = {}
    drawn: dict[str, str] = {}
    for name, coefficients in tolerance.moved.items():
        terms = (f"({c:.17g})*z{k}" for k, c in zip(_numbers(tolerance), coefficients, strict=True) if c)
        factor = f"exp({'+ '.join(terms) or '0'})"
        if name in before:  # what the library has no parameter for
            before[name] = f"({before[name]})*{factor}"
        else:
            derived[f"{name}_drawn"] = f"{name}*{factor}"
            drawn[name] = f"{name}_drawn"
    word = re.compile(rf"\b({'|'.join(map(re.escape, drawn))})\b") if drawn else re.compile(r"(?!)")

    def moved(text: str) -> str:
        return word.sub(lambda match: drawn[match[1]], text)

    notes = [
        "",
        "tolerances: standard errors of the fit in parts of each value; z1, z2, ... move all of them, correlated",
    ]
    notes += [f"     {name} {error:.4g}" for name, error in zip(tolerance.names, tolerance.stderr, strict=True)]
    notes += [f"     {name}: cannot be moved here, stays as fitted" for name in tolerance.fixed]
    return replace(
        made,
        derived=derived | {name: moved(text) for name, text in before.items()},
        body=tuple(map(moved, made.body)),
        notes=(*made.notes, *notes),
    )
