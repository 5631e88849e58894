"""Strip -> lumped elements, EC (10)-(14). Pure functions of SI values, each with its equation."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .actuator import CANTILEVER_EIGENVALUE, Actuator, Coupling

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


def horizontal_force(density: float, width: float, thickness: float, free_length: float) -> float:
    """Tip force [N] that stands for the weight of a horizontal strip: (3/8) rho_m w b L0 g."""
    return 3 / 8 * density * width * thickness * free_length * GRAVITY


@dataclass(frozen=True)
class Elements:
    """Lumped elements of one strip; the mechanical ones are at the load position L_F.

    ``branches`` are the ionic (resistance, capacitance) pairs; ``bending_ratio`` is 3 L_F^2/b^2, which turns
    d [m/V] times volts into displacement.
    """

    dc_resistance: float
    branches: tuple[tuple[float, float], ...]
    electrode_resistance: float
    stiffness: float
    mass: float
    damping: float
    bending_ratio: float
    coupling: Coupling | None

    @property
    def dynamic_resistance(self) -> float:
        """Rd [ohm] of the first ionic branch."""
        return self.branches[0][0]

    @property
    def capacitance(self) -> float:
        """C [F]: sum over the ionic branches."""
        return sum(c for _, c in self.branches)

    def ion_impedance(self, s: complex) -> complex:
        """Zp(s) [ohm] of the ionic branches in parallel; for one branch Rd + 1/(C s)."""
        return 1 / sum(c * s / (1 + r * c * s) for r, c in self.branches)

    def coupling_factor(self, s: complex) -> complex:
        """N(s) = (3 L_F^2/b^2) d(s) s Zp(s) [m/C], EC (17); for one branch (1 + Rd C s)/C replaces s Zp."""
        if self.coupling is None:
            return 0j
        k = self.coupling
        d = k.gain * (s + k.zero) / (s**2 + 2 * k.damping_ratio * k.natural_frequency * s + k.natural_frequency**2)
        # s Zp written without its pole at s = 0
        s_zp = 1 / sum(c / (1 + r * c * s) for r, c in self.branches)
        return self.bending_ratio * d * s_zp


def lumped_elements(actuator: Actuator) -> Elements:
    """The elements of a strip, EC (10)-(14)."""
    g, m = actuator.geometry, actuator.material
    area = g.length * g.width
    stiffness = tip_stiffness(m.youngs_modulus, g.width, g.thickness, g.load_distance)
    mass = tip_mass(m.density, g.free_length, g.width, g.thickness, g.load_distance)
    return Elements(
        dc_resistance=resistance(m.dc_resistivity, g.length, g.width, g.thickness),
        branches=tuple(
            (
                resistance(b.dynamic_resistivity, g.length, g.width, g.thickness),
                capacitance(b.permittivity, g.length, g.width, g.thickness),
            )
            for b in m.branches
        ),
        electrode_resistance=(
            m.electrode_resistivity_1 * m.electrode_thickness_1 + m.electrode_resistivity_2 * m.electrode_thickness_2
        )
        / area,
        stiffness=stiffness,
        mass=mass,
        damping=tip_damping(m.beam_damping_ratio, stiffness, mass),
        bending_ratio=3 * g.load_distance**2 / g.thickness**2,
        coupling=actuator.coupling,
    )
