"""Gamry's data files (.DTA): tables of readings over time (CURVE, CURVE1, ...) or an impedance spectrum (ZCURVE)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from ...errors import InputError, argument
from ...findings import Finding
from ..derived import impedance_of
from ..kind import RECORD, SPECTRUM, Kind
from ..said import pick
from ..table import Rows, Table, parse_rows

NAME = "Gamry"
KINDS: tuple[Kind, ...] = (RECORD, SPECTRUM)

_TABLE = re.compile(r"Z?CURVE\d*\s+TABLE")
_RECORD = re.compile(r"CURVE\d*\s+TABLE")
_SPECTRUM = re.compile(r"ZCURVE\s+TABLE")
_KNOWN = {
    **{"t": ("time", "s"), "vf": ("voltage", "V"), "im": ("current", "A")},
    **{"freq": ("frequency", "Hz"), "zreal": ("re", "ohm"), "zimag": ("im", "ohm")},
}


def recognises(lines: Sequence[str]) -> Kind | None:
    """Return the kind of data in a file that begins with EXPLAIN or has a table of readings."""
    tables = [line for line in lines if line.startswith(("CURVE", "ZCURVE")) and _TABLE.match(line)]
    if not tables and not (lines and lines[0].strip().strip("\ufeff") == "EXPLAIN"):
        return None
    record = any(map(_RECORD.match, tables)) and not any(map(_SPECTRUM.match, tables))
    return RECORD if record else SPECTRUM


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return all CURVE tables, one after the other, or the ZCURVE table.

    A reading that the instrument marks as overloaded has no current; a note counts them.

    Raises
    ------
    InputError
        There is no such table, or a column of it is missing or cannot be read.
    """
    return _spectrum(lines, name, kind) if kind == SPECTRUM else _record(lines, name, kind)


def _rows(lines: Sequence[str], start: int) -> Rows:
    """Return (line number, cells) of the rows of the table whose name stands in line ``start`` (from 0)."""
    rows = []
    for k in range(start + 3, len(lines)):
        if not lines[k].startswith(("\t", " ")):
            break  # the next entry
        if lines[k].strip():
            rows.append((k + 1, lines[k].split("\t")))
    return rows


def _spectrum(lines: Sequence[str], name: str, kind: Kind) -> Table:
    starts = [k for k, line in enumerate(lines) if _SPECTRUM.match(line) and k + 3 <= len(lines)]
    if not starts:
        raise InputError(f"{name}: a Gamry file without a ZCURVE table: it holds no impedance spectrum")
    start = pick([(f"ZCURVE in line {k + 1}", k) for k in starts], kind.said, name)
    rows = _rows(lines, start)
    if not rows:
        raise InputError(f"{name}: its table of impedances has no rows")
    kind = kind.whole.knowing(_KNOWN)
    heads = [(k + 1, lines[k].split("\t")) for k in (start + 1, start + 2)]
    return impedance_of(parse_rows([*heads, *rows], name, kind, ()), kind)


def _record(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return the CURVE tables, which follow one another in time, or the one chosen by ``--cycle`` or ``--part``."""
    starts = [k for k, line in enumerate(lines) if _RECORD.match(line) and k + 3 <= len(lines)]
    if not starts:
        raise InputError(f"{name}: a Gamry file without a CURVE table: it holds no record over time")
    meant = kind.said.part if kind.said.part is not None else kind.said.cycle
    if meant is not None:
        said = replace(kind.said, part=meant, cycle=None)
        starts = [pick([(lines[k].strip(), k) for k in starts], said, name)]
        kind = kind.told(replace(said, part=None))
    heads = [(k + 1, lines[k].split("\t")) for k in (starts[0] + 1, starts[0] + 2)]
    titles = heads[0][1]
    words = [title.strip().lower() for title in titles]
    current = next((k for k, w in enumerate(words) if _KNOWN.get(w, "")[:1] == ("current",)), None)
    kept: Rows = []
    overloaded = 0
    for start in starts:
        if lines[start + 1].split("\t") != titles:
            raise InputError(
                f"{name}: line {start + 2}: other columns than in line {starts[0] + 2}; choose with {argument('part')}"
            )
        for number, cells in _rows(lines, start):
            over = words.index("over") if "over" in words else len(cells)
            if current is not None and over < len(cells) and cells[over].strip(" .0"):
                cells[current] = ""
                overloaded += 1
            kept.append((number, cells))
    notes = [Finding("overloaded", values={"count": overloaded})] if overloaded else []
    return replace(parse_rows([*heads, *kept], name, kind.knowing(_KNOWN), notes), ignored=())
