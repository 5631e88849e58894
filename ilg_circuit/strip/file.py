"""An `Actuator` as a TOML file with units, lossless both ways.

Files are written with ``format = 2``; those without are of version 0.1.0, and read for good. The table [provenance]
says where a file comes from, and is no part of the actuator.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from ..errors import InputError, visible
from ..files import read_bytes, write_text
from ..provenance import Provenance
from ..units import format_quantity, parse
from .actuator import PRESETS, Actuator, Coupling, Geometry, IonBranch, Material, Mounting, Uncertainty, quantities
from .models import electrical_model, material_keys

#: Format of the files that are written; older ones are read as well.
FORMAT = 2
_MOST_BYTES = 1_000_000

_SECTIONS: dict[str, type] = {"geometry": Geometry, "material": Material, "coupling": Coupling, "mounting": Mounting}


def load_actuator(source: str | Path) -> Actuator:
    """The preset or TOML file that ``source`` names.

    Raises InputError when it is neither, or when the file has unknown keys, missing or wrong units, or values out
    of range; the message names the file and the key.
    """
    if not isinstance(source, str | Path):
        shown = f"{type(source).__name__} {source!r}"[:60]
        raise InputError(f"a strip is an object, the path of a TOML file or a preset's name, not {shown}")
    if str(source) in PRESETS:
        return PRESETS[str(source)]
    if not os.path.lexists(source):
        known = ", ".join(PRESETS)
        raise InputError(f"no actuator '{source}': give a TOML file that exists or a preset ({known})")
    try:
        text = read_bytes(source, _MOST_BYTES, "actuator").decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{source}: not a text file; an actuator is a TOML file in UTF-8") from None
    try:
        return loads(text)
    except InputError as error:
        raise InputError(f"{source}: {error}") from None


def loads(text: str) -> Actuator:
    """Parse the TOML text of an actuator; see `load_actuator` for the errors."""
    try:
        table = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also numbers of thousands of digits, brackets without end
        raise InputError(f"not valid TOML: {str(error)[:120]}") from None
    name = table.pop("name", "strip")
    if not isinstance(name, str):
        raise InputError(f"name is {name!r}; write it in quotes")
    written = table.pop("format", 1)
    if not isinstance(written, int) or isinstance(written, bool) or not 1 <= written <= FORMAT:
        raise InputError(f"format is {written!r}; this version reads formats 1 to {FORMAT}: update ilg_circuit")
    if not isinstance(table.pop("provenance", {}), dict):
        raise InputError("'provenance' must be a section [provenance] with keys in it")
    uncertainty = _uncertainty(table.pop("uncertainty")) if "uncertainty" in table else None
    _refuse_unknown(table, (*_SECTIONS, "uncertainty", "provenance"), "section")
    for section in ("geometry", "material"):
        if section not in table:
            raise InputError(f"section [{section}] is missing; an actuator needs [geometry] and [material]")
    parts = {section: _record(kind, table[section], section) for section, kind in _SECTIONS.items() if section in table}
    return Actuator(name=name, uncertainty=uncertainty, **parts)


def dumps(actuator: Actuator, comment: str = "", provenance: Provenance | None = None) -> str:
    """TOML text of an actuator; ``loads(dumps(a)) == a`` exactly. ``comment`` becomes ``#`` lines at the top."""
    lines = [f"# {visible(line)}".rstrip() for line in comment.splitlines()]
    lines += [f"name = {_toml_string(actuator.name)}", f"format = {FORMAT}"]
    for section in _SECTIONS:
        record = getattr(actuator, section)
        if record is None:
            continue
        lines += ["", f"[{section}]", *_entries(record)]
        for branch in getattr(record, "further_branches", ()):
            lines += ["", f"[[{section}.further_branches]]", *_entries(branch)]
    if actuator.uncertainty is not None:
        u = actuator.uncertainty
        lines += ["", "[uncertainty] # covariance of the logarithms of fitted parameters"]
        lines.append(f"model = {_toml_string(u.model)}")
        lines.append(f"names = [{', '.join(map(_toml_string, u.names))}]")
        lines += ["covariance = [", *(f"    [{', '.join(map(repr, row))}]," for row in u.covariance), "]"]
        if u.voltage is not None:
            lines.append(f"voltage = {u.voltage!r} # the largest of the data, in volts")
    if provenance is not None:
        lines += ["", *_table("provenance", provenance.to_dict())]
    return "\n".join(lines) + "\n"


def save_actuator(
    actuator: Actuator, path: str | Path, comment: str = "", provenance: Provenance | None = None
) -> None:
    """Write the TOML file, whole or not at all."""
    write_text(Path(path), dumps(actuator, comment, provenance))


def _table(name: str, table: Mapping[str, Any]) -> list[str]:
    """A TOML table of texts, numbers and one table more."""
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
    if not isinstance(table, dict) or set(table) - {"voltage"} != set(keys):
        raise InputError(f"section [uncertainty] must have exactly the keys {', '.join(keys)}, and may have voltage")
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
    return Uncertainty(table["model"], tuple(names), tuple(tuple(row) for row in rows), voltage)


def _entries(record: Any) -> list[str]:
    written = {q.name: f'"{format_quantity(q.value, q.unit)}"' if q.unit else repr(q.value) for q in quantities(record)}
    texts = {f.name: getattr(record, f.name) for f in fields(record)}
    written |= {name: _toml_string(text) for name, text in texts.items() if isinstance(text, str)}
    return [f"{name} = {value}" for name, value in written.items()]


def _toml_string(text: str) -> str:
    escaped = "".join(f"\\u{ord(c):04X}" if c in '"\\' or ord(c) < 32 or ord(c) == 127 else c for c in text)
    return f'"{escaped}"'


def _refuse_unknown(table: dict[str, Any], known: Any, what: str, where: str = "") -> None:
    for key in table:
        if key not in known:
            raise InputError(f"unknown {what} '{where}{key}'; known are {', '.join(known)}")


def _record(kind: type, table: Any, where: str) -> Any:
    if not isinstance(table, dict):
        raise InputError(f"'{where}' must be a section [{where}] with keys in it")
    known = {item.name: item for item in fields(kind) if item.name != "constants"}
    keys = material_keys() if kind is Material and not table.keys() <= known.keys() else {}
    _refuse_unknown(table, known | keys, "key", f"{where}.")
    for item in known.values():
        if item.default is MISSING and item.default_factory is MISSING and item.name not in table:
            raise InputError(f"key '{where}.{item.name}' is missing; give it in {item.metadata['unit'] or 'no unit'}")
    values: dict[str, Any] = {}
    constants: dict[str, float] = {}
    for key, value in table.items():
        name = f"{where}.{key}"
        if key not in known:
            constants[key] = _quantity(value, keys[key].unit, name)
        elif key == "further_branches":
            if not isinstance(value, list):
                raise InputError(f"'{name}' must be written as [[{name}]] sections")
            values[key] = tuple(_record(IonBranch, entry, name) for entry in value)
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
        raise InputError(f'{name} = {value} has no unit; write it in quotes, like "{value} {unit}"')
    try:
        return float(value)
    except OverflowError:
        raise InputError(f"{name} is out of range; give a number of ordinary size") from None
