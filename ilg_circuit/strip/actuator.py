"""The description of one actuator strip: geometry, material, coupling, mounting. Everything else is computed from it.

All values are SI floats. Equation numbers "EC (n)" refer to *Electromechanical Coupling Model for Ionic Liquid
Gel Soft Actuators*.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Self

from ..errors import InputError, visible
from .couplings import BEAMS as BEAMS
from .couplings import Coupling as Coupling
from .couplings import CouplingLaw as CouplingLaw
from .electrodes import Electrodes as Electrodes
from .geometry import ORIENTATIONS as ORIENTATIONS
from .geometry import Geometry as Geometry
from .geometry import Mounting as Mounting
from .layers import Layer as Layer
from .layers import checked_layers, composite
from .material import MODEL_FIELDS
from .material import IonBranch as IonBranch
from .material import Material as Material
from .material import Quantity as Quantity
from .material import quantities as quantities
from .models.branches import branch_endings
from .models.registry import ADDITIONS, ion_path
from .port import Port
from .sensing import Sensing as Sensing
from .uncertainty import Uncertainty as Uncertainty

#: First root of cos(x) cosh(x) = -1, the cantilever's eigenvalue in EC (11).
CANTILEVER_EIGENVALUE = 1.875104068711961

#: Longest name [characters] of a strip.
LONGEST_NAME = 200


@dataclass(frozen=True, repr=False)
class Actuator:
    """A strip: its sizes ``geometry``, ``material``, ``coupling`` and ``mounting`` against gravity, and a ``name``.

    ``coupling`` is None if no displacement was measured; then only the circuit is known. ``uncertainty`` is the
    covariance of the fit that the strip comes from, None for others. With ``electrodes`` the strip is a line of cells
    between two sheets; the electrode resistance of the material, EC (13), then does not count. ``layers`` from the
    anode's face to the other, if known, give Young's modulus and density of the material, and what other thicknesses
    make of the strip. ``sensing`` is a measured law of its signal as a sensor, None where reciprocity gives it.
    """

    geometry: Geometry
    material: Material
    coupling: CouplingLaw | None = None
    mounting: Mounting = field(default_factory=Mounting)
    name: str = "strip"
    uncertainty: Uncertainty | None = None
    electrodes: Electrodes | None = None
    layers: tuple[Layer, ...] = ()
    sensing: Sensing | None = None

    def __post_init__(self) -> None:
        if self.electrodes is not None:
            self.electrodes.require_fits(self.geometry)
        if len(self.name) > LONGEST_NAME:
            raise InputError(f"name '{self.name[:40]}...' is longer than {LONGEST_NAME} characters; shorten it")
        object.__setattr__(self, "name", visible(self.name))
        if self.layers:
            thickness = self.geometry.thickness
            object.__setattr__(self, "layers", checked_layers(self.layers, thickness))
            made = composite(self.layers, thickness)
            material = replace(self.material, youngs_modulus=made["youngs_modulus"], density=made["density"])
            object.__setattr__(self, "material", material)

    @property
    def linear(self) -> bool:
        """Whether its circuit is linear: electrical model and coupling."""
        return self.material.model.linear and (self.coupling is None or self.coupling.linear)

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
            Numbers in SI units, or texts with units; ``permittivity_2`` is of a second ionic branch. ``kind`` puts a
            new coupling of that kind, made of the other values, in place of the strip's own. ``electrodes`` and
            ``sensing`` take a mapping of the keys of these sections, or None.

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

    def with_layers(self, layers: Iterable[Layer | Mapping[str, Any]]) -> Actuator:
        """Return a copy that is known to consist of ``layers``; the circuit and d(s) stay what they are.

        Young's modulus and density become those of the layers, a measured ``bending_stiffness`` stays. Other
        thicknesses then follow the layers: ``with_(gel_thickness="0.2 mm")``.

        Parameters
        ----------
        layers : iterable of Layer or mapping
            Layers from the anode's face to the other, as mappings with the keys of [[layers]] in a strip's file.

        Returns
        -------
        Actuator
            The copy with layers.

        Raises
        ------
        InputError
            A key or a value is wrong, or the thicknesses do not sum to the strip's.

        Examples
        --------
        >>> carbon = {"name": "carbon", "thickness": "50 um", "youngs_modulus": "1 MPa", "density": "700 kg/m^3"}
        >>> gel = {"name": "gel", "thickness": "0.4 mm", "youngs_modulus": "7.6 kPa", "density": "1250 kg/m^3"}
        >>> electrode = carbon | {"capacitance_per_volume": "80 F/cm^3"}
        >>> thin = PAPER.with_layers([electrode, gel, electrode]).with_(gel_thickness="0.1 mm")
        >>> f"{1e3 * thin.geometry.thickness:.1f} mm"
        '0.2 mm'
        """
        from .layers import layer_from

        return replace(self, layers=tuple(layer_from(layer) for layer in layers))

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
        known: dict[str, Any] = {name: constants.pop(name) for name in MODEL_FIELDS if name in constants}
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
