"""Strip -> lumped elements, EC (10)-(14). Pure functions of SI values, each with its equation."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from ..errors import InputError
from .actuator import CANTILEVER_EIGENVALUE, Actuator, CouplingLaw, Geometry, Material
from .couplings import Relaxation, RelaxingCoupling
from .ladder import LADDER_BAND, Ladders
from .models.model import ElectricalModel
from .port import Port

GRAVITY = 9.80665
#: Largest weight of a hanging strip and its load, times g L0^2/EI, that `hanging_stiffness` takes.
LARGEST_TENSION = 3e5


def resistance(resistivity: float, length: float, width: float, thickness: float) -> float:
    """Return the resistance through the thickness [ohm], EC (12), (13): R = rho b/(L w); rho [ohm m], sizes [m]."""
    return resistivity * thickness / (length * width)


def capacitance(permittivity: float, length: float, width: float, thickness: float) -> float:
    """Return the capacitance of the strip [F], EC (14): C = eps L w/b; eps [F/m], sizes [m]."""
    return permittivity * length * width / thickness


def tip_stiffness(youngs_modulus: float, width: float, thickness: float, load_distance: float) -> float:
    """Return the bending stiffness at the load [N/m], EC (10): K = E w b^3/(4 L_F^3)."""
    return youngs_modulus * width * thickness**3 / (4 * load_distance**3)


def tip_mass(density: float, free_length: float, width: float, thickness: float, load_distance: float) -> float:
    """Return the equivalent mass at the load [kg], EC (11): m = 3 L0^4 rho_m w b/(L_F^3 Gamma^4), Gamma = 1.8751041."""
    return 3 * free_length**4 * density * width * thickness / (load_distance**3 * CANTILEVER_EIGENVALUE**4)


def tip_damping(damping_ratio: float, stiffness: float, mass: float) -> float:
    """Return the dashpot in series with the mass [N s/m]: Rm = 2 zeta sqrt(K m); assumed, not in the paper."""
    return 2 * damping_ratio * math.sqrt(stiffness * mass)


def gravity_ratio(actuator: Actuator) -> float:
    """Return gravity's number, rho_m w b g L0^3/(8 EI): r of a hanging strip, sag over L0 of a horizontal one."""
    g, m = actuator.geometry, actuator.material
    return m.density * g.width * g.thickness * GRAVITY * g.free_length**3 / (8 * bending_stiffness(actuator))


def bending_stiffness(actuator: Actuator) -> float:
    """Return EI [N m^2] of the strip: as given, or E w b^3/12."""
    g, m = actuator.geometry, actuator.material
    return m.youngs_modulus * g.width * g.thickness**3 / 12 if m.bending_stiffness is None else m.bending_stiffness


def hanging_stiffness(actuator: Actuator, hung: float = 0.0) -> float:
    """Return the stiffness [N/m] that gravity adds at L_F of a hanging strip, ``hung`` [kg] on its tip: K (1/phi - 1).

    phi is the share of the free deflection at L_F that the tension T = g [rho_m w b (L0 - x) + hung] leaves of the
    linear beam EI (y'' - k0)'' = (T y')'. Its slope and, by reciprocity, phi are ratios of power series with positive
    terms only: `growth_terms` of the way from the free end to the clamp. Raises InputError where they overflow.
    """
    g, stiffness = actuator.geometry, bending_stiffness(actuator)
    own, load = 8 * gravity_ratio(actuator), hung * GRAVITY * g.free_length**2 / stiffness
    if not own + load < LARGEST_TENSION:
        raise InputError(
            f"mounting.orientation is 'hanging', but EI = {stiffness:.3g} N m^2 is nothing beside the weight: "
            f"g (weight) L0^2/EI is {own + load:.3g} (allowed: {LARGEST_TENSION:g}); give youngs_modulus or "
            "bending_stiffness of the whole strip, or mount it 'weightless' if the coupling has gravity in it"
        )
    part = g.load_distance / g.free_length
    whole = sum(growth_terms(0, load, own))
    bent = sum(growth_terms(2, (own * (1 - part) + load) * part**2, own * part**3))
    return 3 * stiffness / g.load_distance**3 * (whole - bent) / bent


def growth_terms(first: int, square: float, cube: float, least: float = 1e-17) -> list[float]:
    """Return the terms u_n, n = ``first`` on, of u = sum of u_n at t = 1: u_n n (n - 1) = square u_n-2 + cube u_n-3.

    That is the solution of u'' = (``square`` + ``cube`` t) u which begins as t^``first``, under a constant source if
    ``first`` is 2. The last ones are below ``least`` of the sum.
    """
    terms = [0.0, 1.0, 0.0]  # with the one before the first
    while len(terms) < 5 or max(terms[-3:]) > least * sum(terms):
        n = first + len(terms) - 1
        terms.append((square * terms[-2] + cube * terms[-3]) / (n * (n - 1)))
    return terms[1:]


@dataclass(frozen=True)
class Elements:
    """Lumped elements of one strip; the mechanical ones are at the load position L_F.

    ``port`` is its electrical side; ``gravity`` [N/m] is the stiffness that gravity adds to a hanging strip and load;
    ``bending_ratio`` is 3 L_F^2/b^2: times d [m/V] and volts it is the displacement. ``relaxations`` are those of a
    coupling that relaxes, the ladder of a fractional one among them.
    """

    port: Port
    stiffness: float
    mass: float
    damping: float
    gravity: float
    bending_ratio: float
    coupling: CouplingLaw | None
    relaxations: tuple[Relaxation, ...] = ()

    @property
    def hanging_share(self) -> float:
        """The ratio of the static, free displacement with gravity to the one without."""
        return self.stiffness / (self.stiffness + self.gravity)

    def ion_impedance(self, s: complex) -> complex:
        """Return Zp(s) [ohm] of the ion path near 0 V; for one branch Rd + 1/(C s)."""
        return complex(self.port.ion_impedance(s))

    def coupling_factor(self, s: complex) -> complex:
        """Return N(s) = (3 L_F^2/b^2) d(s) s Zp(s) [m/C], EC (17); for one branch (1 + Rd C s)/C replaces s Zp.

        Where bending follows charge it is (3 L_F^2/b^2) D(s)/C_ref.
        """
        if self.coupling is None:
            return 0j
        driven = 1 / self.port.capacitance if self.coupling.follows_charge else complex(self.port.ion_elastance(s))
        return self.bending_ratio * self.coupling.response(s) * driven

    def bent(self, inner: float) -> float:
        """Return the drive [V] of the coupling at rest under ``inner`` [V] behind Re, its odd and even parts in it."""
        if self.coupling is None:
            return 0.0
        x = self.port.charge(inner) / self.port.capacitance if self.coupling.follows_charge else inner
        return self.coupling.bent(x)

    def steady(self, terminal: float) -> float:
        """Return the displacement [m] of the free strip at rest under ``terminal`` [V]."""
        if self.coupling is None or not terminal:
            return 0.0
        return self.bending_ratio * self.coupling.static * self.bent(self.port.inner_voltage(terminal))


def lumped_elements(actuator: Actuator, band: tuple[float, float] = LADDER_BAND, hung: float = 0.0) -> Elements:
    """Return the elements of a strip, EC (10)-(14). ``band`` [Hz] is that of a ladder where the strip gives none.

    ``hung`` [kg] is the mass on the tip, whose weight adds to ``gravity``.
    """
    g, m, coupling = actuator.geometry, actuator.material, actuator.coupling
    stiffness = tip_stiffness(m.youngs_modulus, g.width, g.thickness, g.load_distance)
    if m.bending_stiffness is not None:
        stiffness = 3 * m.bending_stiffness / g.load_distance**3
    mass = tip_mass(m.density, g.free_length, g.width, g.thickness, g.load_distance)
    return Elements(
        port=lumped_port(actuator, band),
        stiffness=stiffness,
        mass=mass,
        damping=tip_damping(m.beam_damping_ratio, stiffness, mass),
        gravity=hanging_stiffness(actuator, hung) if actuator.mounting.orientation == "hanging" else 0.0,
        bending_ratio=3 * g.load_distance**2 / g.thickness**2,
        coupling=actuator.coupling,
        relaxations=coupling.modes(m.ladder_band(band)) if isinstance(coupling, RelaxingCoupling) else (),
    )


def lumped_port(actuator: Actuator, band: tuple[float, float] = LADDER_BAND) -> Port:
    """Return the electrical side of a strip, EC (12)-(14); ``band`` as for `lumped_elements`."""
    return _lumped_port(actuator.geometry, actuator.material, actuator.material.model, band)


@lru_cache(maxsize=64)
def _lumped_port(g: Geometry, m: Material, model: ElectricalModel, band: tuple[float, float]) -> Port:
    """Return the port of a strip; a fit of d(s) needs that of one strip some thousand times."""
    size = (g.length, g.width, g.thickness)
    given = m.electrical_constants()
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
