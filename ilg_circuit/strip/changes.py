"""Replaces some values of a strip, for `Actuator.with_` and for a study's variations.

Names are the keys of an actuator's TOML file (``thickness``, ``youngs_modulus``, ``gain``), those of further ionic
branches with the branch's number (``permittivity_2``).

A geometry stays one strip of the same make: where ``free_length`` is changed and ``length`` is not, the clamped part
keeps its length, so the whole grows with the free part; where ``load_position`` is given and not changed, it keeps its
place in proportion to the free part. The material's constants stay what they are, so resistances, capacitances and
stiffness follow the sizes by EC (12)-(14) and (10), those of a fitted strip too; a measured ``bending_stiffness`` and
d(s) stay as they were measured. A strip with layers has further names, such as ``gel_thickness`` and
``carbon_youngs_modulus``; these, and ``thickness`` (all layers in proportion), change it by the laws of its layers
(`ilg_circuit.strip.layered`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields, replace
from typing import Any, TypeVar

from ..errors import InputError, unknown_name, wrong_choice
from ..units import parse
from .actuator import BEAMS, ORIENTATIONS, Actuator, Coupling, Electrodes, Geometry, IonBranch, Material, Mounting
from .couplings import COUPLINGS, CouplingLaw, RelaxingCoupling, coupling_class
from .electrodes import CONTACTS
from .layered import require_layer, split_name, with_layer_values, with_thickness
from .layers import LAYER_FIELDS
from .models import material_keys
from .plausible import warn_of_sizes
from .sensing import Sensing

Part = TypeVar("Part", Electrodes, Sensing)
#: Value of a parameter: a number in SI units, or a word (an orientation).
Value = float | str


@dataclass(frozen=True)
class VariedParameter:
    """A parameter that can be varied, with its ``part`` of the description, SI unit and meaning.

    ``words`` are the values allowed where it is not a number.
    """

    name: str
    part: str
    unit: str
    meaning: str
    words: tuple[str, ...] = ()

    def value(self, text: str) -> Value:
        """Return the value of a text with a unit. Raises InputError naming the parameter."""
        if self.words:
            if text not in self.words:
                raise wrong_choice(self.name, text, self.words)
            return text
        return parse(text, self.unit, self.name)

    def checked(self, value: Any) -> Value:
        """Return a word, or a finite SI number. Raises InputError naming the parameter."""
        if self.words:
            return self.value(str(value))
        try:
            number = float(value) if not isinstance(value, bool) else None
        except (TypeError, ValueError, OverflowError):
            number = None
        if number is None:
            raise InputError(f"{self.name} is {str(value)[:40]!r}; give a number in {self.unit or 'no unit'}")
        if not math.isfinite(number):
            raise InputError(f"{self.name} is {number}; give a finite value")
        return number


def _of_record(kind: type, part: str, suffix: str = "") -> list[VariedParameter]:
    return [
        VariedParameter(f"{f.name}{suffix}", part, f.metadata["unit"], f.metadata["meaning"])
        for f in fields(kind)
        if "unit" in f.metadata
    ]


#: Parameters of a strip in the order of its file.
STRIP_PARAMETERS = (
    *_of_record(Geometry, "geometry"),
    *_of_record(Material, "material"),
    *_of_record(Coupling, "coupling"),
    *_of_record(RelaxingCoupling, "coupling"),
    *_of_record(IonBranch, "branch", "_2"),
    *_of_record(IonBranch, "branch", "_3"),
    *_of_record(Electrodes, "electrodes"),
)
ORIENTATION = VariedParameter("orientation", "mounting", "", "how the strip is held against gravity", ORIENTATIONS)
CONTACT = VariedParameter("contact", "electrodes", "", "where the segments are wired", CONTACTS)
_KIND = VariedParameter("kind", "coupling", "", "the law by which it bends", tuple(COUPLINGS))
_BEAM = VariedParameter("beam", "coupling", "", "the beam that d(s) was fitted with", BEAMS)


def layer_parameter(name: str) -> VariedParameter | None:
    """Return the parameter of a name such as gel_thickness, None for a name that is none of a layer."""
    found = split_name(name)
    if found is None:
        return None
    layer, key = found
    return VariedParameter(name, "layer", LAYER_FIELDS[key]["unit"], f"{key} of the layers named {layer}")


def with_values(actuator: Actuator, values: Mapping[str, Any]) -> Actuator:
    """Return ``actuator`` with ``values`` by key, SI numbers or texts with units; see `Actuator.with_`."""
    given = dict(values)
    name = given.pop("name", actuator.name)
    if not isinstance(name, str):
        raise InputError(f"name is {str(name)[:40]!r}; give a text")
    sheets = _electrodes(given.pop("electrodes", actuator.electrodes))
    sensing = _sensing(given.pop("sensing", actuator.sensing))
    known = {item.name: item for item in (*STRIP_PARAMETERS, ORIENTATION, CONTACT, _BEAM, _KIND)}
    known = {key: VariedParameter(key, "material", p.unit, p.meaning) for key, p in material_keys().items()} | known
    changes: dict[str, dict[str, Value]] = {}
    for key, value in given.items():
        item = known.get(key) or layer_parameter(key)
        if item is None:
            raise unknown_name("key", key, ["name", *known])
        changes.setdefault(item.part, {})[key] = item.value(value) if isinstance(value, str) else item.checked(value)
    bare = replace(actuator, electrodes=None, sensing=sensing)
    made = replace(changed(bare, changes, sheets), name=name)
    warn_of_sizes(made, given)
    return made


def changed(
    actuator: Actuator, changes: Mapping[str, Mapping[str, Any]], electrodes: Electrodes | None = None
) -> Actuator:
    """Return ``actuator`` with ``changes``: part of the description -> name -> SI value or word.

    ``electrodes`` take the place of its own.

    Without its ``uncertainty`` where material or coupling change: the covariance is that of other constants. Raises
    InputError for a value out of range, an impossible strip (a free part longer than the whole), and a part that the
    strip does not have (a second branch, a coupling).
    """
    parts: dict[str, Any] = {}
    for name in changes.get("layer", {}):
        require_layer(actuator, name)
    geometry = dict(changes.get("geometry", {}))
    thickness = geometry.pop("thickness", None) if actuator.layers else None
    if actuator.layers:
        _require_of_layers(changes, thickness)
    if geometry:
        parts["geometry"] = _geometry(actuator.geometry, geometry)
    if "material" in changes or "branch" in changes:
        branches = list(actuator.material.further_branches)
        for name, value in changes.get("branch", {}).items():
            key, _, number = name.rpartition("_")
            if int(number) - 2 >= len(branches):
                raise InputError(
                    f"{name} belongs to ionic branch {number}, and '{actuator.name}' has {len(branches) + 1}"
                )
            branches[int(number) - 2] = replace(branches[int(number) - 2], **{key: value})
        given, known = dict(changes.get("material", {})), {f.name for f in fields(Material)}
        constants = dict(actuator.material.constants) | {k: given.pop(k) for k in given.keys() - known}
        material = {"further_branches": tuple(branches), "constants": constants, **given}
        parts["material"] = replace(actuator.material, **material)
    if "coupling" in changes and "kind" in changes["coupling"]:
        parts["coupling"] = _made(changes["coupling"])
    elif "coupling" in changes:
        if actuator.coupling is None:
            names = ", ".join(changes["coupling"])
            raise InputError(f"{names}: actuator '{actuator.name}' has no [coupling] that could be varied")
        _require_keys(type(actuator.coupling), changes["coupling"], f"'{actuator.name}' has a")
        parts["coupling"] = replace(actuator.coupling, **changes["coupling"])
    if electrodes is not None:
        parts["electrodes"] = electrodes
    if "electrodes" in changes:
        electrodes = electrodes or actuator.electrodes
        if electrodes is None:
            names = ", ".join(changes["electrodes"])
            raise InputError(f"{names}: actuator '{actuator.name}' has no [electrodes] that could be varied")
        parts["electrodes"] = replace(electrodes, **changes["electrodes"])
    if "mounting" in changes:
        parts["mounting"] = Mounting(changes["mounting"]["orientation"])
    if not parts.keys() <= {"geometry", "mounting", "electrodes"}:
        parts["uncertainty"] = None
    made = replace(actuator, **parts) if parts else actuator
    if thickness is not None:
        made = with_thickness(made, thickness)
    return with_layer_values(made, changes["layer"]) if "layer" in changes else made


def _require_of_layers(changes: Mapping[str, Mapping[str, Any]], thickness: float | None) -> None:
    """Raise InputError for changes of a strip with layers that its layers make."""
    if thickness is not None and any(name.endswith("_thickness") for name in changes.get("layer", {})):
        raise InputError("thickness is the sum of the layers: give it, or thicknesses of layers, not both")
    for key in ("youngs_modulus", "density"):
        if key in changes.get("material", {}):
            raise InputError(f"{key} is made by the strip's layers; give that of a layer, such as gel_{key}")


def _electrodes(given: Any) -> Electrodes | None:
    """Return the electrodes that an object, None or a mapping of keys names, see `_section`."""
    values = _section(given, Electrodes)
    if not isinstance(values, dict):
        return values
    if missing := [key for key in ("sheet_resistance_1", "sheet_resistance_2") if key not in values]:
        raise InputError(f"key 'electrodes.{missing[0]}' is missing; give it in ohm per square, or zero")
    return Electrodes(**values)


def _sensing(given: Any) -> Sensing | None:
    """Return the law of sensing that an object, None or a mapping of keys names, see `_section`."""
    values = _section(given, Sensing)
    return Sensing(**values) if isinstance(values, dict) else values


def _section(given: Any, kind: type[Part]) -> Part | dict[str, Any] | None:
    """Return an object of a section or None as it is, of a mapping of SI numbers and texts with units the values."""
    section = kind.__name__.lower()
    if given is None or isinstance(given, kind):
        return given
    if not isinstance(given, Mapping):
        raise InputError(
            f"{section}={str(given)[:40]!r}: give an object {kind.__name__}, a mapping of its keys, or None"
        )
    known = {item.name: item for item in fields(kind)}
    values: dict[str, Any] = {}
    for key, value in given.items():
        if key not in known:
            raise unknown_name("key", str(key), known, f"{section}.")
        unit = known[key].metadata.get("unit", known[key].metadata.get("each"))
        if unit is None or value is None:
            values[key] = value
        elif isinstance(value, str) or not hasattr(value, "__iter__"):
            values[key] = parse(value, unit, key) if isinstance(value, str) else value
        else:
            values[key] = tuple(parse(x, unit, key) if isinstance(x, str) else x for x in value)
    return values


def _made(given: Mapping[str, Any]) -> CouplingLaw:
    """Return a new coupling of the ``kind`` that is given, from the other values."""
    values = {name: value for name, value in given.items() if name != "kind"}
    law = coupling_class(given["kind"])
    _require_keys(law, values, "it is a")
    needed = [f.name for f in fields(law) if f.default is MISSING]
    if missing := [name for name in needed if name not in values]:
        raise InputError(f"a coupling of kind '{law.kind}' needs {', '.join(missing)} too")
    return law(**values)


def _require_keys(law: type[CouplingLaw], given: Mapping[str, Any], whose: str) -> None:
    """Raise InputError for a name that a kind of coupling does not have."""
    keys = [f.name for f in fields(law)]
    if unknown := next((name for name in given if name not in keys), None):
        raise InputError(f"{unknown}: {whose} coupling of kind '{law.kind}', which has {', '.join(keys)}")


def _geometry(geometry: Geometry, changes: Mapping[str, float]) -> Geometry:
    follow: dict[str, float] = {}
    if "free_length" in changes:
        free = changes["free_length"]
        follow = {"length": geometry.length - geometry.free_length + free}
        if geometry.load_position is not None:
            follow["load_position"] = geometry.load_position / geometry.free_length * free
    return replace(geometry, **{**follow, **changes})
