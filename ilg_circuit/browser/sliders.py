"""What can be moved in a page: one slider for each parameter of the strip's subcircuit, with its unit and range."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..circuit.library import library_parameters
from ..strip.actuator import Actuator, Quantity, quantities

#: Parameters of the subcircuit that describe neither the strip nor its material.
_ELSEWHERE = {"load_stiffness", "load_mass", "thermal_voltage"}
#: A slider goes from the strip's value divided by this to that times it.
_SIZES, _CONSTANTS = 4.0, 10.0
#: Units that are shown with a prefix, which goes before the first of them.
_PREFIXED = {"m", "Pa", "V", "s", "H", "F/m", "ohm m", "N m^2", "m/(V s)", "m/V"}
_PREFIXES = {-12: "p", -9: "n", -6: "\N{MICRO SIGN}", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
_SIGNS = {"ohm": "\N{GREEK CAPITAL LETTER OMEGA}", "^2": "²", "^3": "³", " ": "\N{NO-BREAK SPACE}"}


@dataclass(frozen=True)
class Slider:
    """A parameter ``name`` of the subcircuit: its SI ``value`` and range, shown as value/``scale`` in ``unit``.

    The way is even in the logarithm, or in the value itself where ``even``.
    """

    name: str
    label: str
    meaning: str
    group: str
    unit: str
    scale: float
    value: float
    lowest: float
    highest: float
    even: bool = False


def sliders(actuator: Actuator, beam: str | None = None) -> list[Slider]:
    """Return the sliders of a strip; ``beam`` as for its library. A constant that is zero stays so."""
    sizes = {q.name for q in quantities(actuator.geometry)}
    found = []
    for q in library_parameters(actuator, beam):
        if q.name in _ELSEWHERE:
            continue
        if q.name == "beam_damping_ratio":
            found.append(_slider(q, "Mechanics", 0.0, max(1.0, 2 * q.value), even=True))
        elif q.value:
            ratio = _SIZES if q.name in sizes else _CONSTANTS
            if q.name.startswith("coupling_") and q.value < 0:
                found.append(_slider(q, _group(q.name, sizes), ratio * q.value, -ratio * q.value, even=True))
            else:
                found.append(_slider(q, _group(q.name, sizes), q.value / ratio, q.value * ratio))
    return found


def _group(name: str, sizes: set[str]) -> str:
    if name in sizes:
        return "Geometry"
    if name.startswith("coupling_"):
        return "Coupling d(s)"
    return "Mechanics" if name in ("youngs_modulus", "bending_stiffness", "density") else "Electrical material"


def _slider(q: Quantity, group: str, lowest: float, highest: float, *, even: bool = False) -> Slider:
    unit, scale = shown_unit(q.value, q.unit)
    label = q.name.removeprefix("coupling_").replace("_", " ").replace("youngs", "Young's").replace("dc ", "DC ")
    label = label[0].upper() + label[1:]
    return Slider(q.name, label, q.meaning, group, unit, scale, q.value, lowest, highest, even)


def shown_unit(value: float, unit: str) -> tuple[str, float]:
    """Return the unit in which an SI ``value`` reads well, and its size in SI units.

    >>> shown_unit(0.035, "m")
    ('mm', 0.001)
    """
    exponent = 3 * math.floor(math.log10(abs(value)) / 3 + 1e-12) if unit in _PREFIXED and value else 0
    exponent = exponent if exponent in _PREFIXES else 0
    text = _PREFIXES[exponent] + unit
    for written, sign in _SIGNS.items():
        text = text.replace(written, sign)
    return text, float(f"1e{exponent}")
