"""The layers of a strip and their laws: neutral axis, bending stiffness, mass, charge, resistances, curvature.

Layers are listed from the face of the plus electrode (the anode) to the other. Two of them store charge, the electrodes
(carbon); what lies between is the gel, what lies outside conducts along the strip (gold). The laws are per unit of
width and of area, z [m] is counted from the first face:

    z_n = sum E h z/sum E h          EI/w = sum E (h^3/12 + h (z - z_n)^2)          mass/area = sum rho h
    C/area = C_1 C_2/(C_1 + C_2), C_k = C_v h      Rd area = sum over the gel of h/sigma + (R_1 + R_2)/3, R_k = h/sigma
    strain of an electrode: + or - beta q/(area h)           kappa = w sum E h strain (z - z_n)/EI, towards the anode
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError
from .fields import checked, quantity, validate_quantities

#: Largest difference of the layers' sum from the strip's thickness, relative to it.
SUM_AGREES = 0.01
#: Most layers of a strip.
MOST_LAYERS = 50


@dataclass(frozen=True)
class Layer:
    """One layer of a strip, in SI units.

    Attributes
    ----------
    name : str
        Its material, lower-case letters, digits and _; layers of one name are varied together.
    thickness : float
        Thickness [m].
    density : float
        Density [kg/m^3].
    youngs_modulus : float or None
        Young's modulus [Pa], or None for what ``filler_moduli`` gives.
    resistivity : float or None
        Resistivity for electrons [ohm m].
    sheet_resistance : float or None
        Resistance along the layer [ohm per square], in place of ``resistivity``.
    ionic_conductivity : float or None
        Conductivity for ions [S/m], of a gel or within the pores of an electrode.
    capacitance_per_volume : float or None
        Capacitance of an electrode that stores charge [F/m^3].
    strain_per_charge : float or None
        Strain times volume over charge [m^3/C] of such an electrode.
    filler : float or None
        Part of the weight that is filler.
    filler_moduli : tuple of (float, float)
        Measured pairs of filler and Young's modulus [Pa], ascending; PCHIP between them.
    """

    name: str
    thickness: float = quantity("m", "thickness of the layer")
    density: float = quantity("kg/m^3", "density of the layer")
    youngs_modulus: float | None = quantity("Pa", "Young's modulus of the layer", default=None)
    resistivity: float | None = quantity("ohm m", "resistivity of the layer for electrons", default=None)
    sheet_resistance: float | None = quantity("ohm", "resistance along the layer, per square", default=None)
    ionic_conductivity: float | None = quantity("S/m", "conductivity of the layer for ions", default=None)
    capacitance_per_volume: float | None = quantity("F/m^3", "capacitance of the layer per volume", default=None)
    strain_per_charge: float | None = quantity(
        "m^3/C", "strain of the layer per charge and volume", zero=True, default=None
    )
    filler: float | None = quantity("", "part of the layer's weight that is filler", zero=True, default=None)
    filler_moduli: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        if not (isinstance(self.name, str) and self.name.isidentifier() and self.name == self.name.lower()):
            raise InputError(
                f"a layer's name is {str(self.name)[:40]!r}; write lower-case letters, digits and _, such as carbon"
            )
        where = f"layer '{self.name}': "
        validate_quantities(self, where)
        table = tuple((checked(f"{where}filler", x, "", zero=True), checked(f"{where}modulus", e, "Pa"))
                      for x, e in self.filler_moduli)  # fmt: skip
        object.__setattr__(self, "filler_moduli", table)
        if (self.youngs_modulus is None) == (not table):
            raise InputError(f"{where}give either youngs_modulus, or filler and filler_moduli")
        if table and self.filler is None:
            raise InputError(f"{where}filler is missing; filler_moduli are Young's moduli at several fillers")
        if table:
            shares = [x for x, _ in table]
            if len(table) < 2 or any(b <= a for a, b in pairwise(shares)):
                raise InputError(f"{where}filler_moduli needs two pairs or more, with ascending fillers")
            if self.filler is not None and not shares[0] <= self.filler <= shares[-1]:
                raise InputError(
                    f"{where}filler {self.filler:g} lies outside filler_moduli, {shares[0]:g} to {shares[-1]:g}"
                )
        if self.resistivity is not None and self.sheet_resistance is not None:
            raise InputError(f"{where}give either resistivity or sheet_resistance")

    @property
    def modulus(self) -> float:
        """Young's modulus [Pa]: as given, or that of the filler."""
        if self.youngs_modulus is not None:
            return self.youngs_modulus
        from scipy.interpolate import PchipInterpolator

        shares, moduli = np.array(self.filler_moduli).T
        return float(PchipInterpolator(shares, moduli)(self.filler))

    @property
    def square(self) -> float | None:
        """Resistance along the layer [ohm per square], None for a layer without one."""
        return self.resistivity / self.thickness if self.resistivity is not None else self.sheet_resistance

    def with_(self, **values: Any) -> Layer:
        """Return the layer with some values [SI] changed; its resistance per square follows its thickness."""
        if self.sheet_resistance is not None and "thickness" in values and "sheet_resistance" not in values:
            checked(f"layer '{self.name}': thickness", values["thickness"], "m")
            values = {**values, "sheet_resistance": self.sheet_resistance * self.thickness / values["thickness"]}
        return replace(self, **values)


#: Numbers of a layer that can be varied: those of `Layer` with a unit.
LAYER_FIELDS = {f.name: f.metadata for f in fields(Layer) if "unit" in f.metadata}


@dataclass(frozen=True)
class Section:
    """A stack that bends as one: thickness [m] and Young's modulus [Pa] of each layer (k,), from ``origin`` [m] on."""

    thickness: Array
    modulus: Array
    origin: float = 0.0

    @property
    def middles(self) -> Array:
        """Planes z [m] (k,) of the layers' middles."""
        return np.asarray(self.origin + np.cumsum(self.thickness) - self.thickness / 2)

    @property
    def neutral_axis(self) -> float:
        """z_n [m], where bending alone strains nothing."""
        rigid = self.modulus * self.thickness
        return float(rigid @ self.middles / rigid.sum())

    @property
    def stiffness(self) -> float:
        """EI per width [N m]."""
        arms = self.middles - self.neutral_axis
        return float(self.modulus @ (self.thickness**3 / 12 + self.thickness * arms**2))

    def curvature(self, strains: ArrayLike) -> float:
        """Return kappa [1/m] under free ``strains`` (k,) of the layers; positive if the first face is the inner one."""
        moments = self.modulus * self.thickness * np.asarray(strains)
        return float(moments @ (self.middles - self.neutral_axis) / self.stiffness)

    def axial_strain(self, strains: ArrayLike) -> float:
        """Return the strain of the neutral axis under free ``strains`` (k,) of the layers."""
        rigid = self.modulus * self.thickness
        return float(rigid @ np.asarray(strains) / rigid.sum())


@dataclass(frozen=True)
class Storing:
    """What two electrodes about a gel make of a strip, per area.

    Resistances times area [ohm m^2] of electrons (``leak``), of ions in the ``gel`` and in the ``pores`` of both
    electrodes, ``capacitance`` [F/m^2], ``per_charge`` kappa per charge and area [m/C]. ``absolute`` names those that
    the layers' data give in full; the others are good for ratios only.
    """

    leak: float
    gel: float
    pores: float
    capacitance: float
    per_charge: float
    absolute: frozenset[str]

    def ions(self, *, diffusion: bool) -> float:
        """Return the ions' resistance times area [ohm m^2]; a Warburg element has that of the pores in itself."""
        return self.gel if diffusion else self.gel + self.pores / 3

    @property
    def diffusion_time(self) -> float:
        """Time constant [s] of ions in the pores: (R_1 + R_2) C; 0 where no conductivity is given."""
        return self.pores * self.capacitance

    @property
    def per_volt(self) -> float:
        """Kappa per volt across the gel at rest [1/(m V)]."""
        return self.per_charge * self.capacitance


@dataclass(frozen=True)
class Laws:
    """What layers make of a strip, per width and area: ``mass`` [kg/m^2], and ``storing`` if two store charge."""

    section: Section
    mass: float
    storing: Storing | None = None

    @property
    def thickness(self) -> float:
        """Sum of the layers' thicknesses [m]."""
        return float(self.section.thickness.sum())

    @property
    def stiffness(self) -> float:
        """EI per width [N m]."""
        return self.section.stiffness


def section(layers: Sequence[Layer]) -> Section:
    """Return the stack that ``layers`` make."""
    return Section(np.array([x.thickness for x in layers]), np.array([x.modulus for x in layers]))


def electrodes(layers: Sequence[Layer]) -> tuple[int, int] | None:
    """Return the places of the two layers that store charge, None where none does.

    Raises InputError for one or three of them, or nothing between them.
    """
    found = [k for k, layer in enumerate(layers) if layer.capacitance_per_volume is not None]
    if not found:
        return None
    if len(found) != 2 or found[1] == found[0] + 1:
        raise InputError(
            f"layers: {len(found)} have capacitance_per_volume; give it for the two electrodes, one on each side of "
            "the gel, or for no layer"
        )
    return found[0], found[1]


def laws(layers: Sequence[Layer]) -> Laws:
    """Return what ``layers`` make of a strip. Raises InputError for layers that are no strip."""
    stack = section(layers)
    mass = sum(x.density * x.thickness for x in layers)
    places = electrodes(layers)
    if places is None:
        return Laws(stack, mass)
    first, last = (layers[k] for k in places)
    between = layers[places[0] + 1 : places[1]]
    absolute = {"capacitance"}
    leak, gel = (sum(x.thickness for x in between) for _ in range(2))
    if all(x.resistivity is not None for x in between):
        leak = sum(x.resistivity * x.thickness for x in between if x.resistivity)
        absolute.add("leak")
    pores = 0.0
    if all(x.ionic_conductivity is not None for x in between):
        gel = sum(x.thickness / x.ionic_conductivity for x in between if x.ionic_conductivity)
        pores = sum(x.thickness / x.ionic_conductivity for x in (first, last) if x.ionic_conductivity)
        absolute.add("gel")
    stored = [(x.capacitance_per_volume or 0.0) * x.thickness for x in (first, last)]
    betas = [x.strain_per_charge for x in (first, last)]
    if all(beta is not None for beta in betas):
        absolute.add("per_charge")
    elif all(beta is None for beta in betas):
        betas = [1.0, 1.0]
    else:
        raise InputError("layers: give strain_per_charge of both electrodes, or of none")
    if not any(betas):
        raise InputError("layers: strain_per_charge is zero in both electrodes, which then do not bend the strip")
    strains = np.zeros(len(layers))
    # the plus electrode shrinks, the other swells: towards the anode
    strains[places[0]] = -(betas[0] or 0.0) / first.thickness
    strains[places[1]] = (betas[1] or 0.0) / last.thickness
    storing = Storing(
        leak=leak,
        gel=gel,
        pores=pores,
        capacitance=stored[0] * stored[1] / sum(stored),
        per_charge=stack.curvature(strains),
        absolute=frozenset(absolute),
    )
    return Laws(stack, mass, storing)


def checked_layers(layers: Sequence[Layer], thickness: float) -> tuple[Layer, ...]:
    """Return ``layers`` of a strip of ``thickness`` [m]. Raises InputError where they are not those of one."""
    if len(layers) > MOST_LAYERS:
        raise InputError(f"a strip of {len(layers)} layers; at most {MOST_LAYERS} are possible")
    total = laws(layers).thickness
    if abs(total - thickness) > SUM_AGREES * thickness:
        raise InputError(
            f"the layers' thicknesses sum to {total:.6g} m, but geometry.thickness is {thickness:g} m; "
            f"they may differ by {SUM_AGREES:.0%}"
        )
    return tuple(layers)


def composite(layers: Sequence[Layer], thickness: float) -> dict[str, float]:
    """Return [material]'s constants of a strip of ``thickness`` [m] as far as its ``layers`` give them.

    Young's modulus and density of the one layer with their EI and mass, always; resistivities and permittivity of
    EC (12)-(14) from full data.
    """
    made = laws(layers)
    found = {"youngs_modulus": 12 * made.stiffness / thickness**3, "density": made.mass / thickness}
    if made.storing is None:
        return found
    if "leak" in made.storing.absolute:
        found["dc_resistivity"] = made.storing.leak / thickness
    if "gel" in made.storing.absolute:
        found["dynamic_resistivity"] = made.storing.ions(diffusion=False) / thickness
    return found | {"permittivity": made.storing.capacitance * thickness}


def static_coupling(layers: Sequence[Layer], thickness: float) -> float | None:
    """Return d(0) = (b^2/6) kappa/v [m/V] of a strip of ``thickness`` b [m], None where its layers do not give it."""
    storing = laws(layers).storing
    if storing is None or "per_charge" not in storing.absolute:
        return None
    return thickness**2 / 6 * storing.per_volt


def sheet_resistances(layers: Sequence[Layer]) -> tuple[float, float] | None:
    """Return the resistance of each side along the strip [ohm per square], its layers in parallel; None if not given.

    A side is an electrode and all layers outside it. Raises InputError as `electrodes` does.
    """
    places = electrodes(layers)
    if places is None:
        return None
    sides = layers[: places[0] + 1], layers[places[1] :]
    squares = [[x.square for x in side if x.square is not None] for side in sides]
    if not all(squares):
        return None
    first, second = (1 / sum(1 / x for x in side) for side in squares)
    return first, second


def layer_from(values: Layer | Mapping[str, Any]) -> Layer:
    """Return a layer of a mapping from `Layer`'s names to SI numbers or texts with units; a layer itself as it is.

    Raises InputError for an unknown or missing name, or a value that is not understood.
    """
    if isinstance(values, Layer):
        return values
    from ..errors import unknown_name
    from ..units import si

    if not isinstance(values, Mapping):
        raise InputError(f"a layer is a mapping such as {{'name': 'gel', 'thickness': '0.4 mm'}}, not {values!r}"[:120])
    known = [f.name for f in fields(Layer)]
    where = f"layer '{values.get('name', '')}'"
    for key in values:
        if key not in known:
            raise unknown_name("key", str(key), known, f"{where}: ")
    for key in ("name", "thickness", "density"):
        if key not in values:
            raise InputError(f"{where}: {key} is missing")
    made: dict[str, Any] = {
        key: si(value, LAYER_FIELDS[key]["unit"], f"{where}: {key}")
        for key, value in values.items()
        if key in LAYER_FIELDS
    }
    rows = values.get("filler_moduli", ())
    if rows:
        try:
            made["filler_moduli"] = tuple(
                (si(x, "", f"{where}: filler"), si(e, "Pa", f"{where}: filler_moduli")) for x, e in rows
            )
        except (TypeError, ValueError):
            raise InputError(
                f'{where}: filler_moduli is a list of pairs, such as [["0 %", "5 kPa"], ["3 %", "7.6 kPa"]]'
            ) from None
    return Layer(name=values["name"], **made)
