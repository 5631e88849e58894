"""A strip before any fit: its sizes and other known constants, but no circuit.

Its file is that of an `Actuator` without the constants of the circuit, which `identify` fits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from ..errors import unknown_name, visible
from ..files import write_text
from ..units import format_quantity
from .actuator import PAPER, Actuator, Geometry, Layer, Material, Mounting

#: Keys of [material] that no fit gives, and an example of each that has no default.
_EXAMPLES = {"youngs_modulus": PAPER.material.youngs_modulus, "bending_stiffness": 1e-6}
#: Keys of [material] that no fit gives.
MECHANICAL = (
    *("youngs_modulus", "density", "beam_damping_ratio", "bending_stiffness"),
    *(f"electrode_{what}_{k}" for k in (1, 2) for what in ("resistivity", "thickness")),
)
#: Keys of [material] that make a circuit and are needed for one.
ELECTRICAL = ("dc_resistivity", "dynamic_resistivity", "permittivity")
#: Column at which comments begin.
_COMMENT = 36


@dataclass(frozen=True, repr=False)
class Specimen:
    """A strip whose circuit is not known yet: what `identify` takes beside the data.

    Attributes
    ----------
    geometry : Geometry
        Sizes [m].
    known : tuple of (str, float)
        Keys of [material] that no fit gives, with SI values. Without Young's modulus a fit takes the paper's.
    mounting : Mounting
        How the strip is held against gravity.
    name : str
        Its name.
    layers : tuple of Layer
        Its layers from the anode's face to the other, if known.
    """

    geometry: Geometry
    known: Mapping[str, float] | tuple[tuple[str, float], ...] = ()
    mounting: Mounting = field(default_factory=Mounting)
    name: str = "strip"
    layers: tuple[Layer, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "known", tuple(sorted(dict(self.known).items())))
        object.__setattr__(self, "name", visible(self.name))
        for key in dict(self.known):
            if key not in MECHANICAL:
                raise unknown_name("key", str(key), MECHANICAL)
        self.stand_in()  # checks all values

    def __repr__(self) -> str:
        """Return sizes and known constants as a table."""
        units = {f.name: f.metadata["unit"] for f in (*fields(Geometry), *fields(Material)) if "unit" in f.metadata}
        values = {key: value for key, value in (vars(self.geometry) | dict(self.known)).items() if value is not None}
        rows = [f"  {key:<20}{format_quantity(value, units[key], 6)}" for key, value in values.items()]
        return "\n".join([f"Specimen '{self.name}': {self.mounting.orientation}, no circuit yet", *rows])

    @property
    def modulus_known(self) -> bool:
        """True if Young's modulus was given, or EI or layers in its place."""
        return bool(self.layers) or not dict(self.known).keys().isdisjoint(("youngs_modulus", "bending_stiffness"))

    def stand_in(self) -> Actuator:
        """Return an actuator of these sizes with the paper's circuit, from which a fit begins."""
        known: dict[str, Any] = dict(self.known)
        material = replace(PAPER.material, **known)
        return Actuator(self.geometry, material, mounting=self.mounting, name=self.name, layers=self.layers)

    def to_toml(self) -> str:
        """Return the strip's file, every key with its meaning; those that were not given are comments."""
        from .file import layer_lines

        known = dict(self.known)
        sizes = {f.name: getattr(self.geometry, f.name) for f in fields(Geometry)}
        lines = [
            "# A strip before any measurement. Fit it: ilg-circuit identify DATA.csv --actuator THIS_FILE",
            "# Every quantity is a number with its unit, in quotes.",
            f'name = "{_escaped(self.name)}"',
            "format = 2",
            "",
            "[geometry]",
            *(_line(Geometry, key, value, self.geometry.load_distance) for key, value in sizes.items()),
            "",
            "[material]",
            *(_line(Material, key, known.get(key), _EXAMPLES.get(key)) for key in MECHANICAL[:4]),
            f"# {', '.join(ELECTRICAL)}: the circuit's, which identify fits",
            "",
            "[mounting]",
            f'orientation = "{self.mounting.orientation}"'.ljust(_COMMENT) + "# weightless, hanging or horizontal",
            *layer_lines(self.layers),
        ]
        return "\n".join(lines) + "\n"

    def save(self, path: str | Path) -> None:
        """Write the strip as a TOML file with a comment on every key.

        Parameters
        ----------
        path : str or Path
            The file to write; it is replaced whole or not at all.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        write_text(Path(path), self.to_toml())


def _line(kind: type, key: str, value: float | None, example: float | None) -> str:
    """Return the line of a key with its meaning, a comment where it has no value."""
    item = next(f for f in fields(kind) if f.name == key)
    unit = item.metadata["unit"]
    default: Any = item.default
    shown = next(float(x) for x in (value, example, default) if x is not None)
    text = f'"{format_quantity(shown, unit)}"' if unit else repr(shown)
    return f"{'' if value is not None else '# '}{key} = {text}".ljust(_COMMENT) + f"# {item.metadata['meaning']}"


def _escaped(text: str) -> str:
    return "".join(f"\\u{ord(c):04X}" if c in '"\\' or ord(c) < 32 or ord(c) == 127 else c for c in text)
