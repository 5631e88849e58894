"""Strip -> lumped elements, EC (10)-(14). Pure functions of SI values, each with its equation."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from .actuator import CANTILEVER_EIGENVALUE, Actuator, Coupling
from .ladder import LADDER_BAND, Ladders
from .port import Port

GRAVITY = 9.80665


def resistance(resistivity: float, length: float, width: float, thickness: float) -> float:
    """Resistance through the thickness [ohm], EC (12), (13): R = rho b/(L w); rho [ohm m], sizes [m]."""
    return resistivity * thickness / (length * width)


def capacitance(permittivity: float, length: float, width: float, thickness: float) -> float:
    """Capacitance of the strip [F], EC (14): C = eps L w/b; eps [F/m], sizes [m]."""
    return permittivity * length * width / thickness


def tip_stiffness(youngs_modulus: float, width: float, thickness: float, load_distance: float) -> float:
    """Bending stiffness at the load [N/m], EC (10): K = E w b^3/(4 L_F^3)."""
    return youngs_modulus * width * thickness**3 / (4 * load_distance**3)


def tip_mass(density: float, free_length: float, width: float, thickness: float, load_distance: float) -> float:
    """Equivalent mass at the load [kg], EC (11): m = 3 L0^4 rho_m w b/(L_F^3 Gamma^4), Gamma = 1.8751041."""
    return 3 * free_length**4 * density * width * thickness / (load_distance**3 * CANTILEVER_EIGENVALUE**4)


def tip_damping(damping_ratio: float, stiffness: float, mass: float) -> float:
    """Dashpot in series with the mass [N s/m]: Rm = 2 zeta sqrt(K m); assumed, not in the paper."""
    return 2 * damping_ratio * math.sqrt(stiffness * mass)


def hanging_stiffness(density: float, width: float, thickness: float) -> float:
    """Stiffness [N/m] that gravity adds at the tip of a hanging strip: (3/8) rho_m w b g."""
    return 3 / 8 * density * width * thickness * GRAVITY


@dataclass(frozen=True)
class Elements:
    """Lumped elements of one strip; the mechanical ones are at the load position L_F.

    ``port`` is its electrical side; ``gravity`` [N/m] is the stiffness that gravity adds to a hanging strip;
    ``bending_ratio`` is 3 L_F^2/b^2: times d [m/V] and volts it is the displacement.
    """

    port: Port
    stiffness: float
    mass: float
    damping: float
    gravity: float
    bending_ratio: float
    coupling: Coupling | None

    def ion_impedance(self, s: complex) -> complex:
        """Zp(s) [ohm] of the ion path near 0 V; for one branch Rd + 1/(C s)."""
        return complex(self.port.ion_impedance(s))

    def coupling_factor(self, s: complex) -> complex:
        """N(s) = (3 L_F^2/b^2) d(s) s Zp(s) [m/C], EC (17); for one branch (1 + Rd C s)/C replaces s Zp."""
        if self.coupling is None:
            return 0j
        k = self.coupling
        d = k.gain * (s + k.zero) / (s**2 + 2 * k.damping_ratio * k.natural_frequency * s + k.natural_frequency**2)
        return self.bending_ratio * d * complex(self.port.ion_elastance(s))


def lumped_elements(actuator: Actuator, band: tuple[float, float] = LADDER_BAND) -> Elements:
    """The elements of a strip, EC (10)-(14). ``band`` [Hz] is that of a ladder where the strip gives none."""
    g, m = actuator.geometry, actuator.material
    stiffness = tip_stiffness(m.youngs_modulus, g.width, g.thickness, g.load_distance)
    if m.bending_stiffness is not None:
        stiffness = 3 * m.bending_stiffness / g.load_distance**3
    hanging = actuator.mounting.orientation == "hanging"
    mass = tip_mass(m.density, g.free_length, g.width, g.thickness, g.load_distance)
    return Elements(
        port=lumped_port(actuator, band),
        stiffness=stiffness,
        mass=mass,
        damping=tip_damping(m.beam_damping_ratio, stiffness, mass),
        gravity=hanging_stiffness(m.density, g.width, g.thickness) if hanging else 0.0,
        bending_ratio=3 * g.load_distance**2 / g.thickness**2,
        coupling=actuator.coupling,
    )


def lumped_port(actuator: Actuator, band: tuple[float, float] = LADDER_BAND) -> Port:
    """The electrical side of a strip, EC (12)-(14); ``band`` as for `lumped_elements`."""
    g, m = actuator.geometry, actuator.material
    size = (g.length, g.width, g.thickness)
    model, given = m.model, m.electrical_constants()
    units = {q.name: q.unit for q in m.branch_quantities()} | {key.name: key.unit for key in model.ions.material}
    values = {q.name: q.value for q in m.branch_quantities()} | given
    scales = {"ohm m": resistance, "F/m": capacitance}
    constants = {n: scales[u](values[n], *size) if u in scales else values[n] for n, u in units.items()}
    ladders = Ladders(m.ladder_band(band), int(m.ladder_sections) if m.ladder_sections else None)
    port = model.ions.port(resistance(m.dc_resistivity, *size), model.ions.from_material(constants), ladders)
    electrodes = (
        m.electrode_resistivity_1 * m.electrode_thickness_1 + m.electrode_resistivity_2 * m.electrode_thickness_2
    ) / (g.length * g.width)
    added: dict[str, Any] = {a.parameter.name: given[a.parameter.name] for a in model.additions}
    return replace(port, electrode_resistance=electrodes, **added)
