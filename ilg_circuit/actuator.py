"""The description of one actuator strip: geometry, material, coupling, mounting. Everything else is computed from it.

All values are SI floats. Equation numbers "EC (n)" are those of *Electromechanical Coupling Model for Ionic Liquid
Gel Soft Actuators*.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Any, Self

from .errors import InputError

#: First root of cos(x) cosh(x) = -1, the cantilever's eigenvalue in EC (11).
CANTILEVER_EIGENVALUE = 1.875104068711961

ORIENTATIONS = ("weightless", "hanging", "horizontal")


def quantity(unit: str, meaning: str, *, zero: bool = False, default: Any = ...) -> Any:
    """A dataclass field that holds an SI float, with its unit and meaning for files, tables and validation."""
    metadata = {"unit": unit, "meaning": meaning, "zero": zero}
    return field(metadata=metadata) if default is ... else field(default=default, metadata=metadata)


def validate_quantities(record: Any) -> None:
    """Check every `quantity` field: a finite float, positive, or not negative where zero is allowed."""
    for item in fields(record):
        if "unit" not in item.metadata:
            continue
        value = getattr(record, item.name)
        if value is None and item.default is None:
            continue
        name = f"{type(record).__name__.lower()}.{item.name}"
        try:
            number = float(value) if not isinstance(value, (bool, str)) else math.nan
        except (TypeError, ValueError, OverflowError):
            number = math.nan
        if math.isnan(number) and not isinstance(value, float):
            raise InputError(f"{name} is {str(value)[:40]!r}; give a number in {item.metadata['unit'] or 'no unit'}")
        object.__setattr__(record, item.name, number)
        if not math.isfinite(number):
            raise InputError(f"{name} is {number}; give a finite value")
        if number < 0 or (number == 0 and not item.metadata["zero"]):
            allowed = "zero or more" if item.metadata["zero"] else "more than zero"
            raise InputError(f"{name} is {number:g}; it must be {allowed}")


@dataclass(frozen=True)
class Geometry:
    """Sizes of the strip, clamped at one end. ``load_position`` is L_F, where load and displacement are taken."""

    length: float = quantity("m", "total length L")
    free_length: float = quantity("m", "free length L0")
    width: float = quantity("m", "width w")
    thickness: float = quantity("m", "total thickness b")
    load_position: float | None = quantity(
        "m", "distance L_F of load and displacement from the clamp; free_length if absent", default=None
    )

    def __post_init__(self) -> None:
        validate_quantities(self)
        if self.free_length > self.length:
            raise InputError(
                f"geometry.free_length {self.free_length:g} m is longer than geometry.length {self.length:g} m; "
                "the free part cannot exceed the whole"
            )
        if self.load_position is not None and self.load_position > self.free_length:
            raise InputError(
                f"geometry.load_position {self.load_position:g} m lies beyond geometry.free_length "
                f"{self.free_length:g} m; give a distance from the clamp within the free part"
            )

    @property
    def load_distance(self) -> float:
        """L_F [m]: ``load_position``, or the free end where none is given."""
        return self.free_length if self.load_position is None else self.load_position


@dataclass(frozen=True)
class IonBranch:
    """One further ionic branch R-C beside the first: its share of resistivity and permittivity."""

    dynamic_resistivity: float = quantity("ohm m", "resistivity rho_d of the branch")
    permittivity: float = quantity("F/m", "permittivity eps of the branch")

    def __post_init__(self) -> None:
        validate_quantities(self)


@dataclass(frozen=True)
class Material:
    """Electrical and mechanical constants of the strip as a whole, independent of its size."""

    dc_resistivity: float = quantity("ohm m", "resistivity rho_dc of the electron path, EC (12)")
    dynamic_resistivity: float = quantity("ohm m", "resistivity rho_d of the ion path, EC (13)")
    permittivity: float = quantity("F/m", "permittivity eps of the ion path, EC (14)")
    youngs_modulus: float = quantity("Pa", "Young's modulus E")
    density: float = quantity("kg/m^3", "density rho_m; assumed, the paper gives none", default=1250.0)
    beam_damping_ratio: float = quantity(
        "", "damping ratio of the beam; assumed, the paper gives none", zero=True, default=0.3
    )
    electrode_resistivity_1: float = quantity("ohm m", "resistivity rho_e1 of one electrode", zero=True, default=0.0)
    electrode_thickness_1: float = quantity("m", "thickness b_e1 of that electrode", zero=True, default=0.0)
    electrode_resistivity_2: float = quantity(
        "ohm m", "resistivity rho_e2 of the other electrode", zero=True, default=0.0
    )
    electrode_thickness_2: float = quantity("m", "thickness b_e2 of the other electrode", zero=True, default=0.0)
    further_branches: tuple[IonBranch, ...] = ()

    def __post_init__(self) -> None:
        validate_quantities(self)
        object.__setattr__(self, "further_branches", tuple(self.further_branches))

    @property
    def branches(self) -> tuple[IonBranch, ...]:
        """All ionic branches, the first one included."""
        return (IonBranch(self.dynamic_resistivity, self.permittivity), *self.further_branches)


@dataclass(frozen=True)
class Coupling:
    """Electromechanical coupling d(s) = Kd (s + Zd)/(s^2 + 2 zeta' wn' s + wn'^2) [m/V], EC (31)."""

    gain: float = quantity("m/(V s)", "Kd")
    zero: float = quantity("1/s", "Zd")
    damping_ratio: float = quantity("", "zeta'")
    natural_frequency: float = quantity("rad/s", "wn'")

    def __post_init__(self) -> None:
        validate_quantities(self)

    @property
    def static(self) -> float:
        """d0 = d(0) = Kd Zd/wn'^2 [m/V]."""
        return self.gain * self.zero / self.natural_frequency**2


@dataclass(frozen=True)
class Mounting:
    """How the strip is held against gravity. ``weightless``: the coupling was fitted with gravity already in it."""

    orientation: str = "weightless"

    def __post_init__(self) -> None:
        if self.orientation not in ORIENTATIONS:
            raise InputError(f"mounting.orientation is {self.orientation!r}; choose one of {', '.join(ORIENTATIONS)}")


@dataclass(frozen=True)
class Actuator:
    """One strip. ``coupling`` is None where no displacement was ever measured: then only its circuit is known."""

    geometry: Geometry
    material: Material
    coupling: Coupling | None = None
    mounting: Mounting = Mounting()
    name: str = "strip"

    @classmethod
    def from_circuit_values(
        cls,
        geometry: Geometry,
        *,
        dc_resistance: float,
        branches: tuple[tuple[float, float], ...],
        electrode_resistance: float = 0.0,
        base: Material,
        **rest: Any,
    ) -> Self:
        """The strip whose lumped elements are the given ones: EC (12)-(14) solved for the material.

        ``branches`` are (resistance [ohm], capacitance [F]) pairs; what a circuit does not say (E, density,
        damping) comes from ``base``. An electrode resistance is put into one electrode of 1 um.
        """
        area = geometry.length * geometry.width
        resistive, capacitive = area / geometry.thickness, geometry.thickness / area
        ions = tuple(IonBranch(r * resistive, c * capacitive) for r, c in branches)
        electrode_thickness = 1e-6 if electrode_resistance else 0.0
        material = Material(
            dc_resistivity=dc_resistance * resistive,
            dynamic_resistivity=ions[0].dynamic_resistivity,
            permittivity=ions[0].permittivity,
            youngs_modulus=base.youngs_modulus,
            density=base.density,
            beam_damping_ratio=base.beam_damping_ratio,
            electrode_resistivity_1=electrode_resistance * area / electrode_thickness if electrode_resistance else 0.0,
            electrode_thickness_1=electrode_thickness,
            further_branches=ions[1:],
        )
        return cls(geometry, material, **rest)


#: Recomputed from EC (30), Tables 1-3 and the sample's size; density and beam damping are assumed.
PAPER = Actuator(
    name="paper",
    geometry=Geometry(length=35e-3, free_length=30e-3, width=5e-3, thickness=0.5e-3),
    material=Material(
        dc_resistivity=4 / 0.0060 * 0.35,
        dynamic_resistivity=4 / 0.2058 * 0.35,
        permittivity=1.0,
        youngs_modulus=7600.0,
    ),
    coupling=Coupling(gain=2.4448e-9, zero=0.2075, damping_ratio=0.6212, natural_frequency=0.0742),
)

PRESETS = {"paper": PAPER}
