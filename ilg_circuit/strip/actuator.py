"""The description of one actuator strip: geometry, material, coupling, mounting. Everything else is computed from it.

All values are SI floats. Equation numbers "EC (n)" refer to *Electromechanical Coupling Model for Ionic Liquid
Gel Soft Actuators*.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Self

from ..errors import InputError, visible, wrong_choice
from .fields import checked, quantity, validate_quantities
from .ladder import LADDER_BAND
from .models.branches import branch_endings
from .models.model import ElectricalModel
from .models.registry import ADDITIONS, composed, ion_path, ion_path_of_material
from .port import Port
from .uncertainty import Uncertainty as Uncertainty

#: First root of cos(x) cosh(x) = -1, the cantilever's eigenvalue in EC (11).
CANTILEVER_EIGENVALUE = 1.875104068711961

#: Longest name [characters] of a strip.
LONGEST_NAME = 200

ORIENTATIONS = ("weightless", "hanging", "horizontal")
BEAMS = ("dynamic", "static")


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
        "1/V", "growth k of the capacitance with voltage: q = C (v + k v abs(v)/2)", default=None
    )
    bending_stiffness: float | None = quantity(
        "N m^2", "EI of the composite strip, in place of E w b^3/12", default=None
    )
    further_branches: tuple[IonBranch, ...] = ()
    constants: Mapping[str, float] | tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        validate_quantities(self)
        object.__setattr__(self, "further_branches", tuple(self.further_branches))
        constants = {n: checked(f"material.{n}", v, "SI units") for n, v in dict(self.constants).items()}
        object.__setattr__(self, "constants", tuple(sorted(constants.items())))
        model = self.model
        given = self.electrical_constants()
        for key in model.ions.material:
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
        known: dict[str, Any] = {name: getattr(self, name) for name in _MODEL_FIELDS}
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
_MODEL_FIELDS = ("diffusion_time", "cpe_exponent", "emission_voltage", "capacitance_slope")


@dataclass(frozen=True)
class Coupling:
    """Electromechanical coupling d(s) = Kd (s + Zd)/(s^2 + 2 zeta' wn' s + wn'^2) [m/V], EC (31).

    ``beam`` is the one that d(s) was fitted with, where a fit says so: ``static`` if the tip's whole motion is in d(s),
    the beam's inertia included, which a ``dynamic`` beam would count again.
    """

    gain: float = quantity("m/(V s)", "Kd")
    zero: float = quantity("1/s", "Zd")
    damping_ratio: float = quantity("", "zeta'")
    natural_frequency: float = quantity("rad/s", "wn'")
    beam: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        validate_quantities(self)
        if self.beam not in (None, *BEAMS):
            raise InputError(f"coupling.beam is {self.beam!r}; choose one of {', '.join(BEAMS)}, or leave it out")

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
            raise wrong_choice("mounting.orientation", self.orientation, ORIENTATIONS)


@dataclass(frozen=True, repr=False)
class Actuator:
    """A strip: its sizes ``geometry``, ``material``, ``coupling`` and ``mounting`` against gravity, and a ``name``.

    ``coupling`` is None if no displacement was measured; then only the circuit is known. ``uncertainty`` is the
    covariance of the fit that the strip comes from, None for others.
    """

    geometry: Geometry
    material: Material
    coupling: Coupling | None = None
    mounting: Mounting = Mounting()
    name: str = "strip"
    uncertainty: Uncertainty | None = None

    def __post_init__(self) -> None:
        if len(self.name) > LONGEST_NAME:
            raise InputError(f"name '{self.name[:40]}...' is longer than {LONGEST_NAME} characters; shorten it")
        object.__setattr__(self, "name", visible(self.name))

    def beam(self, asked: str | None = None, *, loaded: bool = False) -> str:
        """Return the beam ``asked`` for; by default the one that d(s) was fitted with, a dynamic one under a load."""
        if asked is not None:
            return asked
        fitted = self.coupling.beam if self.coupling is not None else None
        return "dynamic" if loaded or fitted is None else fitted

    def with_(self, **values: Any) -> Actuator:
        """Return a copy with some values changed; the keys are those of a strip's TOML file.

        Material and d(s) are kept, so the elements of a fitted strip follow its sizes by EC (10)-(14), see
        `ilg_circuit.strip.changes`. ``uncertainty`` is kept with new sizes, not with another material or coupling.

        Parameters
        ----------
        **values : float or str
            Numbers in SI units, or texts with units; ``permittivity_2`` is of a second ionic branch.

        Returns
        -------
        Actuator
            The changed copy.

        Raises
        ------
        InputError
            An unknown key (the nearest ones are named), a wrong unit, an impossible strip.

        Examples
        --------
        >>> PAPER.with_(thickness="0.4 mm", youngs_modulus=9e3).geometry.thickness
        0.0004
        """
        from .changes import with_values

        return with_values(self, values)

    def save(self, path: str | Path) -> None:
        """Write the strip as a TOML file, which `ilg_circuit.load` and all commands read.

        Parameters
        ----------
        path : str or Path
            The file to write; it is replaced whole or not at all.

        Raises
        ------
        InputError
            The file cannot be written.

        Examples
        --------
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     PAPER.with_(thickness="0.4 mm").save(Path(folder) / "thin.toml")
        """
        from .file import save_actuator

        save_actuator(self, path)

    def describe(
        self, low: str | float = "0.1 mHz", high: str | float = "10 Hz", voltage: str | float | None = None
    ) -> dict[str, Any]:
        """Return sizes, material, lumped elements and limits of the model as plain data in SI units.

        The model is judged for frequencies from ``low`` to ``high`` [Hz] and up to a ``voltage`` [V], all numbers or
        texts with units. Raises InputError for values that are not understood.

        Examples
        --------
        >>> round(PAPER.describe(voltage="2 V")["elements"]["capacitance"]["value"], 2)
        0.35
        """
        from .describe import described

        return described(self, low, high, voltage)

    def __repr__(self) -> str:
        """Return the strip as a table of at most twenty lines."""
        from .describe import lines

        return "\n".join(lines(self))

    def _repr_html_(self) -> str:
        from .describe import html

        return html(self)

    @classmethod
    def from_port(cls, geometry: Geometry, port: Port, *, base: Material, **rest: Any) -> Self:
        """Return the strip whose electrical port is the given one: EC (12)-(14) solved for the material.

        What a circuit does not say (E, density, damping, EI) comes from ``base``. An electrode resistance is put into
        one electrode of 1 um.
        """
        area = geometry.length * geometry.width
        scale = {"ohm m": area / geometry.thickness, "F/m": geometry.thickness / area}
        ions = ion_path(port)
        constants = ions.to_material(ions.values(port))
        endings = branch_endings(len(port.branches))
        units = {f.name + ending: f.metadata["unit"] for f in fields(IonBranch) for ending in endings}
        units |= {key.name: key.unit for key in ions.material}
        constants = {name: value * scale.get(units[name], 1.0) for name, value in constants.items()}
        first, *others = (
            IonBranch(constants.pop(f"dynamic_resistivity{end}"), constants.pop(f"permittivity{end}"))
            for end in endings
        )
        added = {a.parameter.name: getattr(port, a.parameter.name) for a in ADDITIONS.values()}
        constants |= {name: value for name, value in added.items() if value}
        known: dict[str, Any] = {name: constants.pop(name) for name in _MODEL_FIELDS if name in constants}
        band = port.ladder.band if port.ladder is not None else (None, None)
        thickness = 1e-6 if port.electrode_resistance else 0.0
        material = Material(
            dc_resistivity=port.dc_resistance * scale["ohm m"],
            dynamic_resistivity=first.dynamic_resistivity,
            permittivity=first.permittivity,
            youngs_modulus=base.youngs_modulus,
            density=base.density,
            beam_damping_ratio=base.beam_damping_ratio,
            bending_stiffness=base.bending_stiffness,
            electrode_resistivity_1=port.electrode_resistance * area / thickness if thickness else 0.0,
            electrode_thickness_1=thickness,
            ladder_lowest=band[0],
            ladder_highest=band[1],
            further_branches=tuple(others),
            constants=constants,
            **known,
        )
        return cls(geometry, material, **rest)


#: Recomputed from EC (30), Tables 1-3 and the sample's size; density and beam damping are assumed.
PAPER = Actuator(
    name="paper",
    geometry=Geometry(length=35e-3, free_length=30e-3, width=5e-3, thickness=0.5e-3),
    material=Material(
        dc_resistivity=4 / 0.0060 * 0.35, dynamic_resistivity=4 / 0.2058 * 0.35, permittivity=1.0, youngs_modulus=7600.0
    ),
    coupling=Coupling(gain=2.4448e-9, zero=0.2075, damping_ratio=0.6212, natural_frequency=0.0742),
)

PRESETS = {"paper": PAPER}
