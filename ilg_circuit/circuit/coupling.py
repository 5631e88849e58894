"""The coupling d(s) of a strip as elements: a filter driven by the voltage across the ion path. EC (31)."""

from __future__ import annotations

from ..strip.actuator import Coupling
from ..strip.elements import Elements
from .netlist import GROUND, Element, Role


def filter_elements(coupling: Coupling, plus: str, minus: str, name: str, inner: float = 0.0) -> list[Element]:
    """Return the series R-L-C of d(s) behind a source that does not load (plus, minus); nodes name1, name2, name3."""
    wn = coupling.natural_frequency
    role = Role.COUPLING_FILTER
    return [
        Element(f"E{name}", (f"{name}1", GROUND, plus, minus), 1.0, role=role),
        Element(f"R{name}", (f"{name}1", f"{name}2"), 2 * coupling.damping_ratio / wn, role=role),
        Element(f"L{name}", (f"{name}2", f"{name}3"), 1 / wn**2, role=role),
        Element(f"C{name}", (f"{name}3", GROUND), 1.0, role=role, start=inner),
    ]


def filter_rate(
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


def free_displacement(lumped: Elements, coupling: Coupling) -> dict[str, float]:
    """Return y1 = k d(s) v as coefficients of the filter's node voltages: k d0 [v_C + (v1 - v2)/(R Zd C)]."""
    static = lumped.bending_ratio * coupling.static
    through = static / (2 * coupling.damping_ratio / coupling.natural_frequency * coupling.zero)
    return {"v(d3)": static, "v(d1)": through, "v(d2)": -through}
