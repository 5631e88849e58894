"""What `ilg-circuit show` tells of an actuator: sizes, lumped elements, and where the model holds."""

from __future__ import annotations

from typing import Any

from .actuator import Actuator, quantities
from .elements import lumped_elements
from .models.model import ElectricalModel, Shown
from .port import Port
from .validity import assumptions


def describe(actuator: Actuator, *, band: tuple[float, float], voltage: float | None = None) -> dict[str, Any]:
    """A JSON-ready description, SI values with their units. ``band`` [Hz]; ``voltage`` [V] of use, if known."""
    lumped = lumped_elements(actuator, band)
    elements = _electrical(lumped.port, actuator.material.model)
    given = actuator.material.bending_stiffness is not None
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
        "mounting": actuator.mounting.orientation,
        "elements": {name: _value(value, unit) | {"equation": note} for name, value, unit, note in elements},
        "band_Hz": list(band),
        "holds": [
            {"assumption": a.name, "number": a.number, "limit": a.limit, "holds": a.holds, "consequence": a.consequence}
            for a in rows
        ],
    }


def _electrical(port: Port, model: ElectricalModel) -> list[Shown]:
    """The rows of the electrical side: terminals, electrons, ions."""

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


def _shown(record: Any) -> dict[str, Any]:
    return {q.name: _value(q.value, q.unit) for q in quantities(record)}


def _value(value: float, unit: str) -> dict[str, Any]:
    return {"value": value, "unit": unit}
