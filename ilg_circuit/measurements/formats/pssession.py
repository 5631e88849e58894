"""PalmSens's sessions (.pssession): JSON with measurements, each an array of values for every quantity."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from ...errors import InputError
from ..derived import impedance_of
from ..kind import RECORD, SPECTRUM, Kind
from ..said import pick
from ..table import Rows, Table, parse_rows

NAME = "PalmSens session"
KINDS: tuple[Kind, ...] = (RECORD, SPECTRUM)

#: The last word of a unit's type -> quantity and unit. Their ZIm is positive for a capacitor.
_KNOWN = {
    **{"time": ("time", "s"), "volt": ("voltage", "V"), "microampere": ("current", "uA"), "ampere": ("current", "A")},
    **{"milliampere": ("current", "mA"), "nanoampere": ("current", "nA"), "hertz": ("frequency", "Hz")},
    **{"zre": ("re", "ohm"), "zim": ("minus_im", "ohm")},
}


def recognises(lines: Sequence[str]) -> Kind | None:
    """Return the kind of data in JSON that has measurements: a spectrum where a frequency is among the units."""
    begin = "".join(lines[:20])[:400].lstrip("\ufeff \t")
    if not begin.startswith("{") or not any('"Measurements"' in line for line in lines):
        return None
    return SPECTRUM if any("Units.Hertz" in line for line in lines) else RECORD


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return the measurement of a ``kind`` that is meant.

    Raises
    ------
    InputError
        The file is no such JSON, holds no measurement of the kind, or several and none was chosen.
    """
    text = "\n".join(lines)
    try:
        session = json.loads(text[text.index("{") : text.rindex("}") + 1])
        tables = [_table(measurement) for measurement in session["Measurements"]]
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise InputError(f"{name}: no session of PalmSens: export the measurement as CSV") from None
    wanted = {"frequency"} if kind == SPECTRUM else set(kind.required) - {"voltage"}
    parts = [(title, rows) for title, rows in tables if wanted <= {_KNOWN[t][0] for t in rows[0][1]}]
    if not parts:
        raise InputError(f"{name}: none of its measurements is a {kind.name}")
    rows = pick(parts, kind.said, name)
    kind = kind.whole.knowing(_KNOWN)
    table = parse_rows(rows, name, kind, ())
    return impedance_of(table, kind) if kind == SPECTRUM else table


def _table(measurement: Any) -> tuple[str, Rows]:
    """Return the title and the rows of a measurement, the first of them the words of its units."""
    columns: dict[str, list[float]] = {}
    for values in measurement["DataSet"]["Values"]:
        word = str((values.get("Unit") or {}).get("Type", "")).split(",")[0].rpartition(".")[2].lower()
        if word in _KNOWN and word not in columns:
            columns[word] = [float(value["V"]) for value in values["DataValues"]]
    size = max(map(len, columns.values()), default=0)
    cells = [[repr(c[k]) if k < len(c) else "" for c in columns.values()] for k in range(size)]
    return str(measurement.get("Title", "")), [(1, list(columns)), *((k, row) for k, row in enumerate(cells, 2))]
