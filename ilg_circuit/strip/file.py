"""An `Actuator` as a TOML file with units, lossless both ways.

Files are written with ``format = 2``. Files without it are from version 0.1.0 and stay readable. The table [provenance]
states the origin of a file and is not part of the actuator.
"""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any, NoReturn

from ..errors import InputError, nearest, unknown_name, visible
from ..files import read_bytes, write_text
from ..provenance import Provenance
from ..units import format_quantity, likely, parse
from .actuator import (
    PRESETS,
    Actuator,
    Coupling,
    Electrodes,
    Geometry,
    IonBranch,
    Material,
    Mounting,
    Sensing,
    Uncertainty,
    quantities,
)
from .couplings import COUPLINGS, CouplingLaw, coupling_class
from .layers import LAYER_FIELDS, Layer, composite, layer_from, static_coupling
from .models import electrical_model, material_keys
from .plausible import warn_of_sizes
from .specimen import ELECTRICAL, MECHANICAL, Specimen
from .uncertainty import Residuals

#: Format of the files that are written; older ones are read as well.
FORMAT = 2
_MOST_BYTES = 1_000_000

_SECTIONS: dict[str, type] = {
    "geometry": Geometry,
    "material": Material,
    "coupling": Coupling,
    "electrodes": Electrodes,
    "mounting": Mounting,
    "sensing": Sensing,
}


def load_actuator(source: str | Path) -> Actuator:
    """Return the preset or TOML file that ``source`` names.

    Raises InputError when it is neither, or when the file has unknown keys, missing or wrong units, values out of
    range, or no circuit; the message names the file and the key.
    """
    found = load_strip(source)
    return found if isinstance(found, Actuator) else _without_circuit(f"{source}: ", source)


def load_strip(source: str | Path) -> Actuator | Specimen:
    """Return the strip of a preset or TOML file; one without the circuit's constants is a `Specimen`."""
    if not isinstance(source, str | Path):
        shown = f"{type(source).__name__} {source!r}"[:60]
        raise InputError(f"a strip is an object, the path of a TOML file or a preset's name, not {shown}")
    if str(source) in PRESETS:
        return PRESETS[str(source)]
    if not os.path.lexists(source):
        near = nearest(str(source), [*PRESETS, *(path.name for path in Path().glob("*.toml"))])
        hint = f"; perhaps {', '.join(near)}" if near else ""
        raise InputError(
            f"no actuator '{source}': give a TOML file that exists or a preset ({', '.join(PRESETS)}){hint}"
        )
    try:
        text = read_bytes(source, _MOST_BYTES, "actuator").decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{source}: not a text file; an actuator is a TOML file in UTF-8{_meant(source)}") from None
    try:
        found = _parsed(text)
    except InputError as error:
        raise InputError(f"{source}: {error}{_meant(source)}") from None
    warn_of_sizes(found)
    return found


def _meant(source: str | Path) -> str:
    """Return advice for a file that is not a TOML file by its name: it may be a measurement."""
    name = Path(source)
    if name.suffix.lower() in ("", ".toml"):
        return ""
    fitted = name.with_suffix(".fit") / "fitted.toml"
    return f"; if it is a measurement, fit it first: ilg-circuit identify {source}, then take {fitted}"


def loads(text: str) -> Actuator:
    """Parse the TOML text of an actuator; see `load_actuator` for the errors."""
    found = _parsed(text)
    return found if isinstance(found, Actuator) else _without_circuit()


def _without_circuit(where: str = "", file: str | Path = "strip.toml") -> NoReturn:
    raise InputError(
        f"{where}section [material] is missing {', '.join(ELECTRICAL)}, the circuit's; fit them to a measurement: "
        f"ilg-circuit identify DATA.csv --actuator {file} --out fitted.toml"
    )


def _parsed(text: str) -> Actuator | Specimen:
    try:
        table = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also numbers of thousands of digits, brackets without end
        raise InputError(_mistake(text, str(error)) or f"not valid TOML: {str(error)[:120]}") from None
    name = table.pop("name", "strip")
    if not isinstance(name, str):
        raise InputError(f"name is {name!r}; write it in quotes")
    written = table.pop("format", 1)
    if not isinstance(written, int) or isinstance(written, bool) or not 1 <= written <= FORMAT:
        raise InputError(f"format is {written!r}; this version reads formats 1 to {FORMAT}: update ilg_circuit")
    if not isinstance(table.pop("provenance", {}), dict):
        raise InputError("'provenance' must be a section [provenance] with keys in it")
    uncertainty = _uncertainty(table.pop("uncertainty")) if "uncertainty" in table else None
    layers = _layers(table.pop("layers", []))
    _refuse_unknown(table, (*_SECTIONS, "layers", "uncertainty", "provenance"), "section")
    if "geometry" not in table:
        raise InputError("section [geometry] is missing; a strip needs its sizes")
    made = _made_by_layers(table, layers)
    if _before_any_fit(table.get("material", {})) and not set(ELECTRICAL) <= made.get("material", {}).keys():
        known = table.pop("material", {})
        sections = (*table, *(["uncertainty"] if uncertainty else []))
        if left := [section for section in sections if section not in ("geometry", "mounting")]:
            raise InputError(f"section [{left[0]}] needs the circuit in [material]; leave it out: identify fits both")
        units = {item.name: item.metadata["unit"] for item in fields(Material) if item.name in MECHANICAL}
        values = {key: _quantity(value, units[key], f"material.{key}") for key, value in known.items()}
        return Specimen(known=values, name=name, layers=layers, **_parts(table))
    if layers:
        table.setdefault("material", {})
    return Actuator(name=name, uncertainty=uncertainty, layers=layers, **_parts(table, made))


def _before_any_fit(material: Any) -> bool:
    """Return True for a section [material] that has nothing of a circuit, and no unknown key."""
    return isinstance(material, dict) and material.keys() <= set(MECHANICAL)


def _parts(table: dict[str, Any], made: Mapping[str, Mapping[str, float]] | None = None) -> dict[str, Any]:
    """Return the records of the sections; keys that a section leaves out are those that the layers have ``made``."""
    return {
        section: _record(kind, table[section], section, (made or {}).get(section, {}))
        for section, kind in _SECTIONS.items()
        if section in table
    }


def _layers(entries: Any) -> tuple[Layer, ...]:
    """Return the layers of the [[layers]] sections."""
    if not (isinstance(entries, list) and all(isinstance(entry, dict) for entry in entries)):
        raise InputError("'layers' must be written as [[layers]] sections")
    found = []
    for k, entry in enumerate(entries, 1):
        name = str(entry.get("name", f"number {k}"))[:40]
        values = dict(entry)
        for key, value in entry.items():
            if key in LAYER_FIELDS:
                values[key] = _quantity(value, LAYER_FIELDS[key]["unit"], f"layer '{name}': {key}")
        rows = entry.get("filler_moduli", [])
        if not (isinstance(rows, list) and all(isinstance(row, list) and len(row) == 2 for row in rows)):
            raise InputError(f'layer \'{name}\': filler_moduli is a list of pairs, such as [["3 %", "7.6 kPa"]]')
        values["filler_moduli"] = [
            [_quantity(x, "", f"layer '{name}': filler"), _quantity(e, "Pa", f"layer '{name}': filler_moduli")]
            for x, e in rows
        ]
        found.append(layer_from(values))
    return tuple(found)


def _made_by_layers(table: Mapping[str, Any], layers: tuple[Layer, ...]) -> dict[str, dict[str, float]]:
    """Return the constants of [material] and [coupling] that the layers' data give in full."""
    written = table["geometry"].get("thickness") if isinstance(table["geometry"], dict) else None
    if not layers or written is None:
        return {}
    thickness = _quantity(written, "m", "geometry.thickness")
    made = {"material": composite(layers, thickness) if thickness > 0 else {}}
    coupling, static = table.get("coupling"), static_coupling(layers, thickness)
    if isinstance(coupling, dict) and static is not None and {"zero", "natural_frequency"} <= coupling.keys():
        zero = _quantity(coupling["zero"], "1/s", "coupling.zero")
        frequency = _quantity(coupling["natural_frequency"], "rad/s", "coupling.natural_frequency")
        if zero > 0:
            made["coupling"] = {"gain": static * frequency**2 / zero}
    return made


#: A value that is not valid TOML: a bare number with a decimal comma, or with a unit.
_BARE = re.compile(r"""\s*([\w-]+)\s*=\s*([+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)\s*([^#,"'\[]*?)\s*(?:#.*)?""")


def _mistake(text: str, error: str) -> str:
    """Return what is wrong with the line that TOML's parser stopped at, empty where it is none of the usual slips."""
    place = re.search(r"at line (\d+)", error)
    lines = text.splitlines()
    number = int(place[1]) if place else 0
    match = _BARE.fullmatch(lines[number - 1]) if 0 < number <= len(lines) else None
    if match is None:
        return ""
    key, value, unit = match[1], match[2].replace(",", "."), match[3]
    kinds: list[Any] = [*_SECTIONS.values(), *COUPLINGS.values(), IonBranch]
    item = next((f for kind in kinds for f in fields(kind) if f.name == key), None)
    si_unit = item.metadata.get("unit", "") if item else unit
    right = f'"{value} {unit}"' if unit else f'"{likely(value, si_unit, key)}"' if si_unit else value
    wrong = f"{key} = {match[2]} {unit}".rstrip()
    how = "in quotes with its unit" if si_unit else "with a decimal point"
    return f"line {number}: '{wrong}' is not valid TOML; write a number {how}: {key} = {right}"


def dumps(actuator: Actuator, comment: str = "", provenance: Provenance | None = None) -> str:
    """Return an actuator as TOML; ``loads(dumps(a)) == a`` exactly. ``comment`` becomes ``#`` lines at the top."""
    lines = [f"# {visible(line)}".rstrip() for line in comment.splitlines()]
    lines += [f"name = {_toml_string(actuator.name)}", f"format = {FORMAT}"]
    for section in _SECTIONS:
        record = getattr(actuator, section)
        if record is None:
            continue
        lines += ["", f"[{section}]", *_entries(record)]
        for branch in getattr(record, "further_branches", ()):
            lines += ["", f"[[{section}.further_branches]]", *_entries(branch)]
    lines += layer_lines(actuator.layers)
    if actuator.uncertainty is not None:
        u = actuator.uncertainty
        lines += ["", "[uncertainty] # covariance of the logarithms of fitted parameters"]
        lines.append(f"model = {_toml_string(u.model)}")
        lines.append(f"names = [{', '.join(map(_toml_string, u.names))}]")
        lines += ["covariance = [", *(f"    [{', '.join(map(repr, row))}]," for row in u.covariance), "]"]
        if u.voltage is not None:
            lines.append(f"voltage = {u.voltage!r} # the largest of the data, in volts")
        for left in u.residuals:
            lines += [
                "",
                "[[uncertainty.residuals]] # misfit by the time since the onset in s, per volt",
                *_residual_lines(left),
            ]
    if provenance is not None:
        lines += ["", *_table("provenance", provenance.to_dict())]
    return "\n".join(lines) + "\n"


def layer_lines(layers: tuple[Layer, ...]) -> list[str]:
    """Return the [[layers]] sections of a strip's file."""
    lines = []
    for layer in layers:
        lines += ["", "[[layers]]", *_entries(layer)]
        if layer.filler_moduli:
            rows = ", ".join(f'[{x!r}, "{format_quantity(e, "Pa")}"]' for x, e in layer.filler_moduli)
            lines.append(f"filler_moduli = [{rows}]")
    return lines


def save_actuator(
    actuator: Actuator, path: str | Path, comment: str = "", provenance: Provenance | None = None
) -> None:
    """Write the TOML file, whole or not at all."""
    write_text(Path(path), dumps(actuator, comment, provenance))


def _table(name: str, table: Mapping[str, Any]) -> list[str]:
    """Return a TOML table of texts, numbers and one table more."""
    lines = [f"[{name}]"]
    for key, value in table.items():
        if isinstance(value, Mapping):
            items = ", ".join(f"{_toml_string(k)} = {_toml_string(v)}" for k, v in value.items())
            lines.append(f"{key} = {{ {items} }}")
        else:
            lines.append(f"{key} = {_toml_string(value) if isinstance(value, str) else repr(value)}")
    return lines


def _uncertainty(table: Any) -> Uncertainty:
    keys = ("model", "names", "covariance")
    if not isinstance(table, dict) or set(table) - {"voltage", "residuals"} != set(keys):
        raise InputError(
            f"section [uncertainty] must have exactly the keys {', '.join(keys)}, and may have voltage and residuals"
        )
    voltage = table.get("voltage")
    if voltage is not None and (isinstance(voltage, bool) or not isinstance(voltage, (int, float))):
        raise InputError(f"uncertainty.voltage is {voltage!r}; give a number of volts without a unit")
    names, rows = table["names"], table["covariance"]
    if not isinstance(table["model"], str) or not (isinstance(names, list) and all(isinstance(n, str) for n in names)):
        raise InputError("uncertainty.model must be a text in quotes, uncertainty.names a list of them")
    electrical_model(table["model"])
    if not (isinstance(rows, list) and all(isinstance(row, list) for row in rows)):
        raise InputError("uncertainty.covariance must be a list of rows of numbers")
    for x in (x for row in rows for x in row):
        if isinstance(x, bool) or not isinstance(x, (int, float)):
            raise InputError(f"uncertainty.covariance has {x!r} in it; give numbers without units")
    left = tuple(_residuals(entry) for entry in table.get("residuals", []))
    return Uncertainty(table["model"], tuple(names), tuple(tuple(row) for row in rows), voltage, left)


def _residual_lines(left: Residuals) -> list[str]:
    lists = {"times": left.times, "deviations": left.deviations}
    written = [f"{key} = [{', '.join(map(repr, values))}]" for key, values in lists.items()]
    return [f"quantity = {_toml_string(left.quantity)}", *written, f"correlation = {left.correlation!r}"]


def _residuals(entry: Any) -> Residuals:
    keys = {"quantity", "times", "deviations", "correlation"}
    numbers: list[Any] = []
    if (
        isinstance(entry, dict)
        and set(entry) == keys
        and all(isinstance(entry[k], list) for k in ("times", "deviations"))
    ):
        numbers = [*entry["times"], *entry["deviations"], entry["correlation"]]
    if not numbers or any(isinstance(x, bool) or not isinstance(x, (int, float)) for x in numbers):
        raise InputError(
            f"[[uncertainty.residuals]] must have exactly the keys {', '.join(sorted(keys))}, with numbers"
        )
    return Residuals(str(entry["quantity"]), tuple(entry["times"]), tuple(entry["deviations"]), entry["correlation"])


def _entries(record: Any) -> list[str]:
    written = {q.name: f'"{format_quantity(q.value, q.unit)}"' if q.unit else repr(q.value) for q in quantities(record)}
    texts = {f.name: getattr(record, f.name) for f in fields(record)}
    written |= {name: _toml_string(text) for name, text in texts.items() if isinstance(text, str)}
    lists = {f.name: f.metadata["each"] for f in fields(record) if "each" in f.metadata and getattr(record, f.name)}
    for name, unit in lists.items():
        written[name] = f"[{', '.join(_toml_string(format_quantity(x, unit)) for x in getattr(record, name))}]"
    if isinstance(record, CouplingLaw) and not isinstance(record, Coupling):
        written = {"kind": _toml_string(record.kind)} | written
    return [f"{name} = {value}" for name, value in written.items()]


def _toml_string(text: str) -> str:
    escaped = "".join(f"\\u{ord(c):04X}" if c in '"\\' or ord(c) < 32 or ord(c) == 127 else c for c in text)
    return f'"{escaped}"'


def _refuse_unknown(table: dict[str, Any], known: Any, what: str, where: str = "") -> None:
    for key in table:
        if key not in known:
            raise unknown_name(what, key, known, where)


def _record(kind: type, table: Any, where: str, made: Mapping[str, float] | None = None) -> Any:
    """Return the record of a section; ``made`` are values [SI] of keys that it may leave out."""
    if not isinstance(table, dict):
        raise InputError(f"'{where}' must be a section [{where}] with keys in it")
    if kind is Coupling and "kind" in table:
        kind, table = coupling_class(table["kind"]), {key: value for key, value in table.items() if key != "kind"}
    known = {item.name: item for item in fields(kind) if item.name != "constants"}
    keys = material_keys() if kind is Material and not table.keys() <= known.keys() else {}
    _refuse_unknown(table, known | keys, "key", f"{where}.")
    made = {key: value for key, value in (made or {}).items() if key not in table}
    for item in known.values():
        if item.default is MISSING and item.default_factory is MISSING and item.name not in {*table, *made}:
            raise InputError(f"key '{where}.{item.name}' is missing; give it in {item.metadata['unit'] or 'no unit'}")
    values: dict[str, Any] = made
    constants: dict[str, float] = {}
    for key, value in table.items():
        name = f"{where}.{key}"
        if key not in known:
            constants[key] = _quantity(value, keys[key].unit, name)
        elif key == "further_branches":
            if not isinstance(value, list):
                raise InputError(f"'{name}' must be written as [[{name}]] sections")
            values[key] = tuple(_record(IonBranch, entry, name) for entry in value)
        elif "each" in known[key].metadata:
            if not isinstance(value, list):
                raise InputError(f'{name} is {value!r}; write a list in brackets, like ["7 mm", "8 mm"]')
            values[key] = tuple(_quantity(entry, known[key].metadata["each"], name) for entry in value)
        elif "unit" not in known[key].metadata:
            if not isinstance(value, str):
                raise InputError(f"{name} is {value!r}; write it in quotes")
            values[key] = value
        else:
            values[key] = _quantity(value, known[key].metadata["unit"], name)
    return kind(**values, **({"constants": constants} if constants else {}))


def _quantity(value: Any, unit: str, name: str) -> float:
    if isinstance(value, str):
        return parse(value, unit, name)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f'{name} is {value!r}; write a number with its unit in quotes, like "30 {unit}"')
    if unit:
        raise InputError(f'{name} = {value} has no unit; write it in quotes, like "{likely(str(value), unit, name)}"')
    try:
        return float(value)
    except OverflowError:
        raise InputError(f"{name} is out of range; give a number of ordinary size") from None
