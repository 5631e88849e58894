"""The material of a strip: electrical and mechanical constants, and the electrical model that they make."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from ..errors import InputError
from .fields import checked, quantity, validate_quantities
from .ladder import LADDER_BAND
from .models.branches import branch_endings
from .models.model import ElectricalModel
from .models.registry import ADDITIONS, composed, ion_path_of_material


@dataclass(frozen=True)
class Quantity:
    """A quantity that a part of an actuator gives: its SI ``value``, SI ``unit`` and ``meaning``."""

    name: str
    value: float
    unit: str
    meaning: str


def quantities(record: Any) -> list[Quantity]:
    """Return the quantities that a part of an actuator gives: its `quantity` fields, and a material's ``constants``."""
    found = [
        Quantity(f.name, getattr(record, f.name), f.metadata["unit"], f.metadata["meaning"])
        for f in fields(record)
        if "unit" in f.metadata and getattr(record, f.name) is not None
    ]
    if isinstance(record, Material) and record.constants:
        keys = record.model.material_keys
        found += [Quantity(name, x, keys[name].unit, keys[name].meaning) for name, x in dict(record.constants).items()]
    return found


@dataclass(frozen=True)
class IonBranch:
    """One further ionic branch R-C beside the first: its share of resistivity and permittivity."""

    dynamic_resistivity: float = quantity("ohm m", "resistivity rho_d of the branch")
    permittivity: float = quantity("F/m", "permittivity eps of the branch")

    def __post_init__(self) -> None:
        validate_quantities(self)


@dataclass(frozen=True)
class Material:
    """Electrical and mechanical constants of the strip as a whole, independent of its size.

    The ion path is one R-C branch, several with ``further_branches``, or what the keys of an electrical model make it:
    see `ilg_circuit.strip.models`. ``constants`` holds those of these keys that are no fields of their own, name ->
    SI value.
    """

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
    diffusion_time: float | None = quantity(
        "s", "makes the ion path a finite Warburg element of this time constant tau; Rw = tau/C", default=None
    )
    cpe_exponent: float | None = quantity(
        "", "makes the ion path a constant phase element; permittivity is then that at 1 rad/s", default=None
    )
    ladder_lowest: float | None = quantity("Hz", "lower end of the band of a ladder; 0.1 mHz if absent", default=None)
    ladder_highest: float | None = quantity("Hz", "upper end of that band; 10 kHz if absent", default=None)
    ladder_sections: float | None = quantity(
        "", "sections of the ladder; as many as its stated error needs if absent", zero=True, default=None
    )
    emission_voltage: float | None = quantity(
        "V", "makes the electron path i = (Vt/Rdc) sinh(v/Vt) with this Vt", default=None
    )
    capacitance_slope: float | None = quantity(
        "1/V", "growth k of the capacitance with voltage: q = C (v + k v abs(v)/2)", signed=True, default=None
    )
    bending_stiffness: float | None = quantity(
        "N m^2", "EI of the composite strip, in place of E w b^3/12", default=None
    )
    further_branches: tuple[IonBranch, ...] = ()
    constants: Mapping[str, float] | tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        validate_quantities(self)
        object.__setattr__(self, "further_branches", tuple(self.further_branches))
        if self.capacitance_slope == 0:
            raise InputError("material.capacitance_slope is 0, a linear capacitance; leave it out")
        constants = {n: checked(f"material.{n}", v, "SI units") for n, v in dict(self.constants).items()}
        object.__setattr__(self, "constants", tuple(sorted(constants.items())))
        model = self.model
        given = self.electrical_constants()
        for key in model.material_keys.values():
            if given[key.name] >= key.upper:
                raise InputError(f"material.{key.name} is {given[key.name]:g}; it must be less than {key.upper:g}")
        low, high = self.ladder_band()
        if low >= high:
            raise InputError(f"material.ladder_lowest {low:g} Hz must be less than ladder_highest {high:g} Hz")
        if self.ladder_sections is not None and not (self.ladder_sections.is_integer() and self.ladder_sections >= 1):
            raise InputError(
                f"material.ladder_sections is {self.ladder_sections:g}; give a whole number from 1 on, or leave it out"
            )

    @property
    def model(self) -> ElectricalModel:
        """The electrical model. Raises InputError for constants of several models, or of a part of one."""
        given = self.electrical_constants()
        added = [a for a in ADDITIONS.values() if a.parameter.name in given]
        keys = given.keys() - {a.parameter.name for a in added}
        ions = ion_path_of_material(keys, len(self.branches))
        for addition in added:
            if not addition.goes_with(ions):
                raise InputError(
                    f"material.{addition.parameter.name} goes with R-C branches, not with {min(keys)}; leave one out"
                )
        return composed(ions, tuple(sorted(a.name for a in added)))

    def electrical_constants(self) -> dict[str, float]:
        """Return the constants of the electrical model beyond resistivities and permittivities, by name."""
        known: dict[str, Any] = {name: getattr(self, name) for name in MODEL_FIELDS}
        return {name: value for name, value in known.items() if value is not None} | dict(self.constants)

    def ladder_band(self, default: tuple[float, float] = LADDER_BAND) -> tuple[float, float]:
        """Return the band [Hz] over which a ladder holds; ``default`` where the strip says nothing."""
        return self.ladder_lowest or default[0], self.ladder_highest or default[1]

    @property
    def branches(self) -> tuple[IonBranch, ...]:
        """All ionic branches, the first one included."""
        return (IonBranch(self.dynamic_resistivity, self.permittivity), *self.further_branches)

    def branch_quantities(self) -> list[Quantity]:
        """Return the quantities of all ionic branches; the names of those after the first end in ``_2``, ``_3``."""
        named = zip(self.branches, branch_endings(len(self.branches)), strict=True)
        return [replace(q, name=q.name + ending) for branch, ending in named for q in quantities(branch)]


#: Fields of a `Material` that are constants of electrical models.
MODEL_FIELDS = ("diffusion_time", "cpe_exponent", "emission_voltage", "capacitance_slope")
