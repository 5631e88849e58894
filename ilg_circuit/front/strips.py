"""A strip from its sizes, before any measurement."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..errors import InputError, argument, unknown_name
from ..strip.actuator import Actuator, Geometry, Mounting
from ..strip.file import load_strip
from ..strip.layers import Layer, layer_from
from ..strip.plausible import warn_of_sizes
from ..strip.specimen import MECHANICAL, Specimen
from ..units import si
from .given import Given, Strip

#: Keys of a strip that are lengths, and all that `identify` takes.
SIZES = ("length", "free_length", "width", "thickness", "load_position")
KEYS = (*SIZES, "youngs_modulus", "density", "bending_stiffness", "orientation")
_UNITS = {"youngs_modulus": "Pa", "density": "kg/m^3", "bending_stiffness": "N m^2", "beam_damping_ratio": ""}


def new_strip(
    *,
    length: Given,
    free_length: Given,
    width: Given,
    thickness: Given,
    load_position: Given | None = None,
    youngs_modulus: Given | None = None,
    orientation: str = "weightless",
    name: str = "strip",
    layers: Iterable[Layer | Mapping[str, Any]] = (),
    **known: Given,
) -> Specimen:
    """Return a strip by its sizes, for `identify`, which fits its circuit and coupling.

    Parameters
    ----------
    length : float or str
        Total length: a number in metres, or a text with a unit.
    free_length : float or str
        From the clamp to the tip [m].
    width : float or str
        Width [m].
    thickness : float or str
        Total thickness [m].
    load_position : float or str, optional
        Where displacement is measured and a load sits, from the clamp [m] (default: the tip).
    youngs_modulus : float or str, optional
        Young's modulus [Pa] (default: the paper's, with a warning by the fit).
    orientation : {"weightless", "hanging", "horizontal"}
        How the strip is held against gravity.
    name : str
        Its name, which the fitted strip keeps.
    layers : iterable of Layer or mapping, optional
        Its layers from the anode's face to the other, with the keys of [[layers]] in a strip's file.
    **known : float or str
        Other keys of [material] that no fit gives: density, beam_damping_ratio, bending_stiffness,
        electrode_resistivity_1, electrode_thickness_1 and so on.

    Returns
    -------
    Specimen
        The strip; ``save("strip.toml")`` writes the file that commands take. A size outside the usual range issues an
        `IlgWarning`.

    Raises
    ------
    InputError
        A key or a unit is wrong, or a size is impossible.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> gel = ilg.new_strip(length="35 mm", free_length="30 mm", width="5 mm", thickness="0,5 mm", name="gel 7")
    >>> gel.geometry.thickness, gel.modulus_known
    (0.0005, False)
    """
    for key in known:
        if key not in MECHANICAL:
            raise unknown_name("key", key, [*SIZES, *MECHANICAL, "orientation", "name"])
    lengths = (length, free_length, width, thickness, load_position)
    sizes = {key: si(value, "m", key) for key, value in zip(SIZES, lengths, strict=True) if value is not None}
    given = known | ({} if youngs_modulus is None else {"youngs_modulus": youngs_modulus})
    made = Specimen(
        geometry=Geometry(**sizes),
        known={key: si(value, _unit(key), key) for key, value in given.items()},
        mounting=Mounting(orientation),
        name=name,
        layers=tuple(layer_from(layer) for layer in layers),
    )
    warn_of_sizes(made)
    return made


def measured_strip(strip: Strip | Specimen | None, **sizes: Given | None) -> Actuator | Specimen | None:
    """Return the measured strip: the given one, with ``sizes`` (`KEYS`) in place of its own, or one of these sizes.

    None where nothing was given. Raises InputError where sizes are missing.
    """
    given: dict[str, Any] = {key: value for key, value in sizes.items() if value is not None}
    if strip is None:
        if not given:
            return None
        missing = [key for key in SIZES[:4] if key not in given]
        if missing:
            raise InputError(
                f"the strip's {', '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing; give all of "
                f"{', '.join(SIZES[:4])}, or a strip that has them"
            )
        return new_strip(**given)
    found = strip if isinstance(strip, Actuator | Specimen) else load_strip(strip)
    if not given:
        return found
    if isinstance(found, Actuator):
        return found.with_(**given)
    geometry = {key: getattr(found.geometry, key) for key in SIZES}
    rest = {"orientation": found.mounting.orientation, "name": found.name, "layers": found.layers}
    return new_strip(**geometry | dict(found.known) | rest | given)


def _unit(key: str) -> str:
    return _UNITS.get(key) or ("" if key in _UNITS else "ohm m" if "resistivity" in key else "m")


def save_new(made: Specimen, path: str | Path, *, force: bool = False) -> None:
    """Write a strip's file. Raises InputError for one that is there already, unless ``force``."""
    if Path(path).exists() and not force:
        raise InputError(f"'{path}' exists already; give {argument('force')} to replace it, or another name")
    made.save(path)
