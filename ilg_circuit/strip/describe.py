"""The description of an actuator by `ilg-circuit show`: sizes, lumped elements, validity of the model."""

from __future__ import annotations

import math
from dataclasses import replace
from html import escape
from typing import Any

from ..errors import InputError, argument
from ..units import format_quantity, si
from .actuator import Actuator, quantities
from .elements import lumped_elements
from .layered import NEGLIGIBLE_GRAVITY, gravity_scope, scalings
from .models.model import ElectricalModel, Shown
from .port import Port
from .validity import assumptions

#: Most lines of a strip in a console.
_MOST = 20
#: Shown though it is zero.
_ALWAYS = ("beam_damping_ratio",)


def describe(actuator: Actuator, *, band: tuple[float, float], voltage: float | None = None) -> dict[str, Any]:
    """Return a JSON-ready description, SI values with their units. ``band`` [Hz]; ``voltage`` [V] of use, if known."""
    lumped = lumped_elements(actuator, band)
    if actuator.electrodes is not None:
        # current flows along the sheets, not through a resistance across the thickness
        lumped = replace(lumped, port=replace(lumped.port, electrode_resistance=0.0))
    elements = _electrical(lumped.port, actuator.material.model)
    if actuator.electrodes is not None:
        elements += _line(actuator, lumped.port, band)
    given = actuator.material.bending_stiffness is not None or bool(actuator.layers)
    elements += [
        ("stiffness", lumped.stiffness, "N/m", "K = 3 EI/L_F^3" if given else "EC (10): K = E w b^3/(4 L_F^3)"),
        ("mass", lumped.mass, "kg", "EC (11): m = 3 L0^4 rho_m w b/(L_F^3 Gamma^4)"),
        ("damping", lumped.damping, "N s/m", "Rm = 2 zeta sqrt(K m), assumed"),
        ("resonance", (lumped.stiffness / lumped.mass) ** 0.5, "rad/s", "sqrt(K/m)"),
    ]
    displacement = None
    if lumped.coupling is not None:
        per_volt = lumped.bending_ratio * lumped.coupling.static
        displacement = per_volt * voltage if voltage is not None else None
        elements += [
            ("coupling_factor_static", abs(lumped.coupling_factor(0)), "m/C", "EC (17): N(0)"),
            ("displacement_per_volt", per_volt, "m/V", "EC (37): 3 L_F^2 d0/b^2"),
            ("clamped_force_per_volt", per_volt * lumped.stiffness, "N/V", "EC (39): 3/4 d0 E b w/L_F"),
        ]
    rows = assumptions(actuator, band=band, voltage=voltage, displacement=displacement)
    return {
        "name": actuator.name,
        "geometry": _shown(actuator.geometry) | {"load_distance": _value(actuator.geometry.load_distance, "m")},
        "material": _shown(actuator.material),
        "coupling": _shown(actuator.coupling) if actuator.coupling else None,
        **({"electrodes": _sheets(actuator)} if actuator.electrodes is not None else {}),
        "mounting": actuator.mounting.orientation,
        "layers": [_shown(layer) | {"name": layer.name} for layer in actuator.layers],
        "elements": {name: _value(value, unit) | {"equation": note} for name, value, unit, note in elements},
        "band_Hz": list(band),
        "holds": [
            {"assumption": a.name, "number": a.number, "limit": a.limit, "holds": a.holds, "consequence": a.consequence}
            for a in rows
        ],
        "scaling": [vars(row) for row in scalings(actuator)],
        "gravity": {"limit": NEGLIGIBLE_GRAVITY, "sizes": [vars(row) for row in gravity_scope(actuator)]},
    }


def described(
    actuator: Actuator, low: str | float, high: str | float, voltage: str | float | None = None
) -> dict[str, Any]:
    """Return `describe` for numbers or texts with units. Raises InputError for other texts, and for an empty band."""
    band = si(low, "Hz", argument("low")), si(high, "Hz", argument("high"))
    if not 0 < band[0] < band[1] < math.inf:
        raise InputError(f"band from {low} to {high}: give two frequencies above zero, the lower one first")
    largest = None if voltage is None else abs(si(voltage, "V", argument("voltage")))
    return describe(actuator, band=band, voltage=largest)


def lines(actuator: Actuator) -> list[str]:
    """Return the strip as a table of at most twenty lines; the whole of it is `strip.file.dumps`."""
    rows = [f"  {part:<11}{name:<24}{value}".rstrip() for part, name, value, _ in _rows(actuator)]
    more = [f"  and {len(rows) - _MOST + 2} more"] if len(rows) >= _MOST else []
    return [_headline(actuator), *rows[: _MOST - 1 - len(more)], *more]


def html(actuator: Actuator) -> str:
    """Return the strip as a table with the meaning of every value, for a notebook."""
    cells = ("".join(f'<td style="text-align:left">{escape(cell)}</td>' for cell in row) for row in _rows(actuator))
    table = "".join(f"<tr>{row}</tr>" for row in cells)
    return f"<div><b>{escape(_headline(actuator))}</b><table>{table}</table></div>"


def _headline(actuator: Actuator) -> str:
    """Name, electrical model, mounting, and whether a fit made it."""
    name = " ".join(actuator.name.split())[:60]
    fitted = ", with the covariance of a fit" if actuator.uncertainty is not None else ""
    return f"Actuator '{name}': {actuator.material.model.name}, {actuator.mounting.orientation}{fitted}"


def _rows(actuator: Actuator) -> list[tuple[str, str, str, str]]:
    """Return part (once), name, value and meaning of all quantities but those that are zero by default."""
    first, *others = actuator.material.branches
    material = [q for q in quantities(actuator.material) if q.value or q.name in _ALWAYS]
    branches = actuator.material.branch_quantities()[len(quantities(first)) :] if others else []
    parts = {"geometry": quantities(actuator.geometry), "material": material + branches}
    parts["coupling"] = quantities(actuator.coupling) if actuator.coupling else []
    parts["electrodes"] = quantities(actuator.electrodes) if actuator.electrodes else []
    rows = [(part, q) for part, found in parts.items() for q in found]
    starts = [k == 0 or rows[k - 1][0] != part for k, (part, _) in enumerate(rows)]
    table = [
        (part if start else "", q.name, format_quantity(q.value, q.unit, 6), q.meaning)
        for start, (part, q) in zip(starts, rows, strict=True)
    ]
    if not actuator.coupling:
        table.append(("coupling", "not known", "", "no displacement was measured"))
    for k, layer in enumerate(actuator.layers):
        value = format_quantity(layer.thickness, "m", 6)
        table.append(("layers" if k == 0 else "", layer.name, value, f"E = {format_quantity(layer.modulus, 'Pa', 4)}"))
    return table


def _electrical(port: Port, model: ElectricalModel) -> list[Shown]:
    """Return the rows of the electrical side: terminals, electrons, ions."""

    def added(of: str) -> list[Shown]:
        return [row for addition in model.additions if addition.of == of for row in addition.shown(port)]

    return [
        *added("terminals"),
        ("electrode_resistance", port.electrode_resistance, "ohm", "EC (13): Re = sum of rho_ek b_ek/(L w)"),
        ("dc_resistance", port.dc_resistance, "ohm", "EC (12): Rdc = rho_dc b/(L w)"),
        *added("electrons"),
        *model.ions.shown(port),
        *added("ions"),
    ]


def _sheets(actuator: Actuator) -> dict[str, Any]:
    """Return the electrodes: quantities as `_shown`, the contact, and the free parts of the segments of each side."""
    sheets = actuator.electrodes
    assert sheets is not None
    spans = {side: sheets.spans(side, actuator.geometry) for side in (1, 2)}
    lengths = {f"lengths_{side}": {"value": [b - a for a, b in of], "unit": "m"} for side, of in spans.items()}
    return _shown(sheets) | lengths | {"contact": sheets.contact}


def _line(actuator: Actuator, port: Port, band: tuple[float, float]) -> list[Shown]:
    """Return the rows of a strip with electrodes: the resistance along them, and abs(gamma L) at both ends of a band.

    Over one segment: beyond about one the voltage falls along it.
    """
    sheets, g = actuator.electrodes, actuator.geometry
    assert sheets is not None
    along = (sheets.sheet_resistance_1 + sheets.sheet_resistance_2) / g.width
    longest = max(b - a for side in (1, 2) for a, b in sheets.spans(side, g))
    rows = [("line_resistance", along * longest, "ohm", "(R_s1 + R_s2) L/w of the longest segment")]
    for name, frequency in (("low", band[0]), ("high", band[1])):
        admittance = 1 / (port.share(1.0).impedance(2j * math.pi * frequency) * g.length)
        size = float(abs(along * admittance)) ** 0.5 * longest
        rows.append((f"line_number_{name}", size, "", f"abs(gamma L) of it at {format_quantity(frequency, 'Hz', 3)}"))
    return rows


def _shown(record: Any) -> dict[str, Any]:
    return {q.name: _value(q.value, q.unit) for q in quantities(record)}


def _value(value: float, unit: str) -> dict[str, Any]:
    return {"value": value, "unit": unit}
